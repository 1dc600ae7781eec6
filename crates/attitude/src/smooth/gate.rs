//! Samples -> those that can be used, in order, each with a force. Pure.

use super::sample::{Numbers, Sample};
use crate::record::Nanos;
use nalgebra::Vector3;

/// A rate beyond this (each component, rad/s), and a force (m/s^2), are none.
const LARGEST_RATE: f64 = 100.0;
const LARGEST_FORCE: f64 = 2000.0;
/// A single stamp so far ahead of those around it is none, ns.
const LEAP: i64 = 10_000_000_000;
/// Longer gaps are breaks, s: nothing is known of the motion.
pub(super) const LONGEST_BRIDGE: f64 = 0.25;

/// Leaves out samples that are none: not finite, beyond what there is, or not later than the ones before. One without
/// a force gets that between its neighbours', for an accelerometer slower than the gyro.
#[derive(Default)]
pub(super) struct Gate {
    offered: u64,
    last: Option<i64>,
    /// Accepted unless its stamp turns out to have leapt.
    waiting: Option<(Numbers, u64)>,
    /// The last force that was measured.
    force: Option<(Nanos, Vector3<f64>)>,
    /// Samples since then, without one.
    lacking: Vec<(Numbers, u64)>,
}

impl Gate {
    /// Gives those that are accepted to `take`, some of them late, with their place in the input.
    pub(super) fn offer(&mut self, sample: &Sample, take: &mut dyn FnMut(&Numbers, u64)) {
        let place = self.offered;
        self.offered += 1;
        let sample = Numbers::from(sample);
        if !is_usable(&sample) {
            return;
        }
        let stamp = sample.stamp.0;
        if let Some((waiting, its_place)) = self.waiting {
            let ahead = waiting.stamp.0;
            if stamp > ahead {
                self.accept(&waiting, its_place, take);
                self.last = Some(ahead);
            } else {
                let has_leapt = match self.last {
                    Some(last) => ahead.saturating_sub(last) > LEAP && stamp > last,
                    None => ahead.saturating_sub(stamp) > LEAP,
                };
                if !has_leapt {
                    return;
                }
            }
        }
        self.waiting = Some((sample, place));
    }

    fn accept(&mut self, sample: &Numbers, place: u64, take: &mut dyn FnMut(&Numbers, u64)) {
        let Some(force) = sample.force else {
            let since = |(stamp, _): &(Nanos, _)| sample.stamp.secs_since(*stamp);
            if self
                .force
                .as_ref()
                .is_some_and(|force| since(force) <= LONGEST_BRIDGE)
            {
                self.lacking.push((*sample, place));
            }
            return;
        };
        if let Some((stamp, before)) = self.force {
            let secs = sample.stamp.secs_since(stamp);
            for (lacking, its_place) in self.lacking.drain(..) {
                if secs <= LONGEST_BRIDGE {
                    let share = lacking.stamp.secs_since(stamp) / secs;
                    let force = Some(before + (force - before) * share);
                    take(&Numbers { force, ..lacking }, its_place);
                }
            }
        }
        self.force = Some((sample.stamp, force));
        take(sample, place);
    }

    /// The last ones.
    pub(super) fn finish(&mut self, take: &mut dyn FnMut(&Numbers, u64)) {
        if let Some((sample, place)) = self.waiting.take() {
            self.accept(&sample, place, take);
        }
        let force = self.force.map(|(_, force)| force);
        for (lacking, place) in self.lacking.drain(..) {
            take(&Numbers { force, ..lacking }, place);
        }
    }
}

fn is_usable(sample: &Numbers) -> bool {
    // NaN is not below anything.
    let is_force = |force: &Vector3<f64>| force.iter().all(|f| f.abs() < LARGEST_FORCE);
    sample.rate.iter().all(|w| w.abs() < LARGEST_RATE) && sample.force.as_ref().is_none_or(is_force)
}
