//! Samples that have been judged -> what is ordinary. Pure.
//!
//! Apart from the rule because it is all that the rule remembers: of the last samples their changes, of the newest its
//! value.

use super::super::gate::{Entry, finite_accel};
use super::{LONGEST, PAST, is_whole};
use crate::record::Nanos;
use nalgebra::Vector3;

/// The last samples, as far as the rule needs them.
#[derive(Clone, Debug)]
pub(super) struct Past {
    /// The last two rates, newest first.
    pub(super) rates: [Vector3<f64>; 2],
    /// Specific forces before the next sample, newest first; the last one that came stands in for none.
    pub(super) forces: [Option<Vector3<f64>>; LONGEST + 2],
    /// Squares of the largest change of the rate, and of the step of the force, at each of the last samples but the
    /// newest.
    pub(super) changes: [(f64, f64); PAST],
    pub(super) at: usize,
    pub(super) count: usize,
    pub(super) last: Nanos,
    /// Smallest change of one component so far, rad/s.
    pub(super) quantum: f64,
}

impl Past {
    pub(super) fn new() -> Past {
        Past {
            rates: [Vector3::zeros(); 2],
            forces: [None; LONGEST + 2],
            changes: [(0.0, 0.0); PAST],
            at: 0,
            count: 0,
            last: Nanos(0),
            quantum: f64::INFINITY,
        }
    }

    /// Whether no sample stands before the next, or none that a line can be drawn from.
    #[inline]
    pub(super) fn is_hole(&self, next: &Entry, spacing: i64, coarse: Option<i64>) -> bool {
        self.count == 0 || !is_whole(next.stamp.since(self.last), LONGEST, spacing, coarse)
    }

    /// Adds a sample with this rate, which may be the repaired one.
    #[inline]
    pub(super) fn push(&mut self, entry: &Entry, rate: &Vector3<f64>) {
        let [newest, older] = self.rates;
        let step = (newest - older).norm_squared();
        let bend = (newest - (older + rate) * 0.5).norm_squared();
        let force = match self.forces {
            [Some(newest), Some(older), ..] => (newest - older).norm_squared(),
            _ => 0.0,
        };
        // The first two have no predecessors to differ from.
        if self.count >= 2
            && let Some(slot) = self.changes.get_mut(self.at)
        {
            *slot = (step.max(bend), force);
            self.at = (self.at + 1) % PAST;
        }
        for (now, before) in rate.iter().zip(&newest) {
            let change = (now - before).abs();
            if self.count > 0 && change > 0.0 && change < self.quantum {
                self.quantum = change;
            }
        }
        self.rates = [*rate, newest];
        let force = finite_accel(&entry.accel).or(self.forces[0]);
        self.forces.rotate_right(1);
        self.forces[0] = force;
        self.count = self.count.saturating_add(1);
        self.last = entry.stamp;
    }

    /// The largest change of the rate and of the force in the samples before the newest.
    pub(super) fn ordinary(&self) -> (f64, f64) {
        let largest = self
            .changes
            .iter()
            .fold((0.0_f64, 0.0_f64), |most, change| {
                (most.0.max(change.0), most.1.max(change.1))
            });
        (largest.0.sqrt(), largest.1.sqrt())
    }

    /// The largest step of the force from as many samples before the run as are in it to the `count`th from its first;
    /// `None` without forces.
    pub(super) fn force_step(
        &self,
        entry: &Entry,
        ahead: &[Entry],
        count: usize,
        samples: usize,
    ) -> Option<f64> {
        let before = self.forces.get(..=samples)?.iter().rev();
        let mut last = (*before.clone().next()?)?;
        let mut largest = 0.0_f64;
        let following = std::iter::once(entry).chain(ahead).take(count);
        let forces = before
            .skip(1)
            .copied()
            .chain(following.map(|sample| finite_accel(&sample.accel)));
        for force in forces.flatten() {
            largest = largest.max((force - last).norm());
            last = force;
        }
        Some(largest)
    }
}
