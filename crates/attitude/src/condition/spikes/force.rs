//! Force with its neighbours -> whether it is a glitch of the accelerometer alone. Pure.
//!
//! Apart from the rule about rates because the gyro, which feels every blow, is the witness here: it saw nothing. The
//! force of such a sample is left out; its rate stays.

use super::super::gate::{Entry, finite_accel};
use super::{ALONE_FORCE, PAST, Past, QUIET_FORCE, QUIET_RATE, Run};
use nalgebra::Vector3;

/// Distance of a force from its neighbours that nobody calls a glitch, m/s^2.
const LEAST: f64 = 15.0;

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

    /// How far the forces of the `samples` from `entry` on are off the line between their neighbours, m/s^2, where they
    /// are a glitch.
    #[cold]
    pub(super) fn force_off(&self, entry: &Entry, ahead: &[Entry], samples: usize) -> Option<f64> {
        let before = self.forces[0]?;
        let behind = ahead.get(samples - 1)?;
        let end = finite_accel(&behind.accel)?;
        if behind.epoch != entry.epoch {
            return None;
        }
        let run = Run {
            samples,
            ends: (before, end),
            distance: f64::INFINITY,
        };
        let rates = Run {
            samples,
            ends: (self.rates[0], behind.value),
            distance: 0.0,
        };
        let (rate, force) = self.ordinary();
        let (mut distance, mut swings) = (f64::INFINITY, (end - before).norm());
        let (mut bend, mut mean) = ((behind.value - self.rates[0]).norm(), Vector3::zeros());
        let within = std::iter::once(entry).chain(ahead).take(samples);
        for (n, sample) in within.clone().enumerate() {
            let off = finite_accel(&sample.accel)? - run.line(n);
            distance = distance.min(off.norm());
            mean += off;
            bend = bend.max((sample.value - rates.line(n)).norm());
        }
        // Both neighbours agree with what was before them, and with each other.
        swings += force;
        let on_one_side = within.enumerate().all(|(n, sample)| {
            let off = finite_accel(&sample.accel).map(|force| force - run.line(n));
            off.is_some_and(|off| off.dot(&mean) > 0.0)
        });
        let is_alone = distance > LEAST && distance > ALONE_FORCE * (swings + QUIET_FORCE);
        let is_felt = bend > 2.0 * rate + QUIET_RATE;
        (is_alone && !is_felt && on_one_side).then_some(distance)
    }
}
