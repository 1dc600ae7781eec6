//! Force with its neighbours -> whether it is a glitch of the accelerometer alone. Pure.
//!
//! Apart from the rule about rates because the gyro, which feels every blow, is the witness here: it saw nothing. The
//! force of such a sample is left out; its rate stays.

use super::super::gate::{Entry, finite_accel};
use super::{LONGEST, PAST, Past, QUIET_FORCE, Run};
use nalgebra::Vector3;

/// Distance of a force from its neighbours that nobody calls a glitch, m/s^2.
const LEAST: f64 = 15.0;
/// The same in times of what is ordinary about it.
const ALONE_FORCE: f64 = 6.0;
/// Bend of the rate that is no blow, rad/s, beyond twice the ordinary one.
const QUIET_RATE: f64 = 0.05;

impl Past {
    /// Whether a glitch of the force can begin at this entry.
    #[inline]
    pub(super) fn may_be_force(&self, entry: &Entry) -> bool {
        let before = self.forces[0];
        before.is_some_and(|before| {
            // A force that is none is no number, and larger than nothing.
            (Vector3::from(entry.accel) - before).norm_squared() > LEAST * LEAST
        })
    }

    /// Adds a sample whose force is left out, being so far off, m/s^2: what comes shortly after and is like it is none.
    #[cold]
    pub(super) fn push_without_force(&mut self, entry: &Entry, off: f64) {
        self.push(entry, &entry.value);
        let newest = (self.at + PAST - 1) % PAST;
        if let Some((_, force)) = self.changes.get_mut(newest) {
            *force = force.max(off * off);
        }
    }

    /// Distance of the forces of the `samples` from `entry` on off the line between their neighbours, m/s^2, where they
    /// are a glitch; `unit` is the value of 1 rad/s.
    #[cold]
    pub(super) fn force_off(
        &self,
        entry: &Entry,
        ahead: &[Entry],
        samples: usize,
        unit: f64,
    ) -> Option<f64> {
        let behind = ahead.get(samples - 1)?;
        if behind.epoch != entry.epoch {
            return None;
        }
        let line = |ends| Run {
            samples,
            ends,
            distance: 0.0,
        };
        let forces = line((self.forces[0]?, finite_accel(&behind.accel)?));
        let rates = line((self.rates[0], behind.value));
        let apart = |run: &Run| (run.ends.1 - run.ends.0).norm();
        let (mut off, mut bend) = ([Vector3::zeros(); LONGEST], apart(&rates));
        let within = std::iter::once(entry).chain(ahead).take(samples);
        for (n, (off, sample)) in off.iter_mut().zip(within).enumerate() {
            *off = finite_accel(&sample.accel)? - forces.line(n);
            bend = bend.max((sample.value - rates.line(n)).norm());
        }
        let off = off.get(..samples)?;
        let sum = off.iter().sum::<Vector3<f64>>();
        let distance = off.iter().map(Vector3::norm).fold(f64::INFINITY, f64::min);
        let (rate, force) = self.ordinary();
        let is_felt = bend > 2.0 * rate + QUIET_RATE * unit;
        let is_alone = distance > LEAST
            && distance > ALONE_FORCE * (apart(&forces) + force + QUIET_FORCE)
            && off.iter().all(|off| off.dot(&sum) > 0.0);
        (is_alone && !is_felt).then_some(distance)
    }
}
