//! Samples in the order they came -> whether two sensors take turns in one stream. Pure.
//!
//! A stage of its own because nothing behind it can tell: two sensors on one `id`, or in one table without a column that
//! names them, are sorted by stamp into one sensor at twice the rate, whose attitude is that of no body. In windows of 16
//! samples the specific forces (or the rates) fall into two groups that are far apart and tight, and the stream goes
//! from one to the other again and again. A vibration at half the sample rate does so, too; what tells them apart is the
//! length of each group's force (gravity's for two bodies, longer for a vibration), and stamps whose steps depend on the
//! group. `docs/theory/consistency.md` has the numbers.

mod clocks;
mod groups;

use super::gate::{Entry, finite_accel};
use crate::record::Nanos;
use clocks::Clocks;
use groups::{Groups, WINDOW};
use nalgebra::Vector3;

/// Least rms change from one sample to the next at which a window is worth a look: share of g, and rad/s.
const FORCE_CHANGE: f64 = 0.02;
const RATE_CHANGE: f64 = 0.05;
/// Distance of two groups of forces, share of their length: where stamps tell them apart, and where nothing else does.
const FORCES_APART: f64 = 0.04;
const FORCES_FAR_APART: f64 = 0.2;
/// Distance of two groups of rates that stamps tell apart, rad/s.
const RATES_APART: f64 = 0.08;
/// Ratio of the lengths of two groups' forces that can both be gravity and motion, less 1.
const LENGTHS: f64 = 0.35;
/// Gravity in m/s^2, g and mg, the share by which the mean length of forces may differ from it, and in times of which, with
/// a share more, the mean of both groups is shorter for two bodies.
const GRAVITY: [f64; 3] = [9.806_65, 1.0, 1000.0];
const NEAR_GRAVITY: f64 = 0.06;
const SHORTER: f64 = 2.0;
const SHORTER_BY: f64 = 0.02;
/// Number of the last 16 windows worth a look that show two groups before that is reported, and for how long, ns.
const ENOUGH: u32 = 10;
const LONG_ENOUGH: i64 = 2_000_000_000;

/// Evidence that two sensors take turns in one stream.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mixture {
    /// Difference by which the two are told apart.
    pub apart: Apart,
    /// Samples in which they were seen to take turns, or times that the stamps went from one clock to the other.
    pub samples: u64,
    /// Stamp of the first of these.
    pub first: Nanos,
}

/// Difference between two sensors that take turns.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Apart {
    /// Angle between their specific forces, rad.
    Forces(f64),
    /// Difference of their rates, rad/s.
    Rates(f64),
    /// Time between their clocks, ns.
    Clocks(i64),
}

/// Watch over one stream.
#[derive(Clone, Debug)]
pub(super) struct MixtureWatch {
    is_rate: bool,
    rates: [Vector3<f64>; WINDOW],
    forces: [Vector3<f64>; WINDOW],
    stamps: [i64; WINDOW],
    count: usize,
    forces_count: usize,
    last: Option<(Vector3<f64>, Vector3<f64>)>,
    /// Squares of the changes from sample to sample in the window: rates, forces.
    changes: (f64, f64),
    /// Windows worth a look, the newest in the lowest bit: whether each shows two groups.
    history: u16,
    since: Option<Nanos>,
    clocks: Clocks,
    seen: Seen,
}

/// Sums over the windows that show two groups.
#[derive(Clone, Copy, Default, Debug)]
struct Seen {
    samples: u64,
    forces: (f64, u32),
    rates: (f64, u32),
    /// Windows whose stamps tell the groups apart, and sums of the other windows: lengths of each group's force, and of
    /// the mean of both.
    by_stamps: u32,
    lengths: (f64, f64),
    is_reported: bool,
}

impl Seen {
    /// Whether the groups are two bodies: a vibration about gravity is longer than it at both ends, and its mean is
    /// gravity; of two bodies each is as long as gravity, and their mean is shorter.
    fn are_bodies(&self) -> bool {
        let others = self.forces.1 - self.by_stamps;
        if self.by_stamps + self.rates.1 >= others {
            return true;
        }
        let (each, middle) = self.lengths;
        let [each, middle] = [each, middle].map(|sum| sum / f64::from(others.max(1)));
        GRAVITY.iter().any(|gravity| {
            let off = (each / gravity - 1.0).abs();
            off < NEAR_GRAVITY && middle < gravity * (1.0 - SHORTER * off - SHORTER_BY)
        })
    }
}

impl MixtureWatch {
    /// Watch over samples whose gyro values are rates, or are not.
    pub(super) fn new(is_rate: bool) -> MixtureWatch {
        MixtureWatch {
            is_rate,
            rates: [Vector3::zeros(); WINDOW],
            forces: [Vector3::zeros(); WINDOW],
            stamps: [0; WINDOW],
            count: 0,
            forces_count: 0,
            last: None,
            changes: (0.0, 0.0),
            history: 0,
            since: None,
            clocks: Clocks::default(),
            seen: Seen::default(),
        }
    }

    /// Takes the stamp of the next sample as it was read.
    #[inline]
    pub(super) fn take_stamp(&mut self, stamp: Nanos, found: &mut Option<Mixture>) {
        if let Some((apart, returns, first)) = self.clocks.take(stamp) {
            *found = Some(Mixture {
                apart: Apart::Clocks(apart),
                samples: returns,
                first,
            });
        }
    }

    /// Takes the next sample, in order of arrival.
    #[inline]
    pub(super) fn take(&mut self, entry: &Entry, found: &mut Option<Mixture>) {
        let force = finite_accel(&entry.accel).unwrap_or_default();
        if let Some((rate, before)) = self.last {
            let steps = (
                (entry.value - rate).norm_squared(),
                (force - before).norm_squared(),
            );
            if steps == (0.0, 0.0) {
                // Recorded twice.
                return;
            }
            self.changes = (self.changes.0 + steps.0, self.changes.1 + steps.1);
        }
        self.last = Some((entry.value, force));
        let slots = (
            self.rates.get_mut(self.count),
            self.forces.get_mut(self.count),
            self.stamps.get_mut(self.count),
        );
        if let (Some(rate), Some(held), Some(stamp)) = slots {
            (*rate, *held, *stamp) = (entry.value, force, entry.stamp.0);
        }
        self.forces_count += usize::from(force != Vector3::zeros());
        self.count += 1;
        if self.count == WINDOW {
            self.close(found);
        }
    }

    #[inline]
    fn close(&mut self, found: &mut Option<Mixture>) {
        let (rates, forces) = std::mem::take(&mut self.changes);
        let has_forces = std::mem::take(&mut self.forces_count) == WINDOW;
        self.count = 0;
        let n = WINDOW as f64;
        let gravity = self.forces[0].norm_squared();
        let is_worth = (has_forces && forces > FORCE_CHANGE * FORCE_CHANGE * n * gravity)
            || (self.is_rate && rates > RATE_CHANGE * RATE_CHANGE * n);
        if is_worth {
            self.look(has_forces, found);
        }
    }

    #[cold]
    fn look(&mut self, has_forces: bool, found: &mut Option<Mixture>) {
        let forces = has_forces.then(|| Groups::of(&self.forces)).flatten();
        let by_forces = forces
            .as_ref()
            .and_then(|groups| Some((groups, self.lengths_of(groups)?)));
        let rates = match (by_forces, self.is_rate) {
            (None, true) => Groups::of(&self.rates),
            _ => None,
        };
        let by_rates = rates
            .as_ref()
            .filter(|groups| groups.apart() > RATES_APART && groups.alternate_by(&self.stamps));
        let is_seen = by_forces.is_some() || by_rates.is_some();
        self.history = self.history << 1 | u16::from(is_seen);
        if !is_seen {
            if self.history == 0 {
                (self.since, self.seen) = (None, Seen::default());
            }
            return;
        }
        if let Some((groups, lengths)) = by_forces {
            let (sum, count) = &mut self.seen.forces;
            (*sum, *count) = (*sum + groups.angle(), *count + 1);
            match lengths {
                None => self.seen.by_stamps += 1,
                Some((each, middle)) => {
                    let (sum, of_middle) = &mut self.seen.lengths;
                    (*sum, *of_middle) = (*sum + each, *of_middle + middle);
                }
            }
        } else if let Some(groups) = by_rates {
            let (sum, count) = &mut self.seen.rates;
            (*sum, *count) = (*sum + groups.apart(), *count + 1);
        }
        self.seen.samples += WINDOW as u64;
        let (first, last) = (Nanos(self.stamps[0]), Nanos(self.stamps[WINDOW - 1]));
        let since = *self.since.get_or_insert(first);
        let is_long = last.since(since).saturating_abs() >= LONG_ENOUGH;
        self.seen.is_reported |=
            is_long && self.history.count_ones() >= ENOUGH && self.seen.are_bodies();
        if self.seen.is_reported {
            self.report(since, found);
        }
    }

    /// Lengths of the groups' forces and of their mean, if the groups can be two bodies; `Some(None)` where the stamps
    /// tell that they are.
    fn lengths_of(&self, groups: &Groups) -> Option<Option<(f64, f64)>> {
        let [a, b] = groups.lengths();
        let square = (a * a + b * b) * 0.5;
        let (each, apart) = (square.sqrt(), groups.apart());
        if apart > FORCES_APART * each && groups.alternate_by(&self.stamps) {
            return Some(None);
        }
        let middle = (square - apart * apart * 0.25).max(0.0).sqrt();
        let is_far = apart > FORCES_FAR_APART * each && (a / b - 1.0).abs() < LENGTHS;
        is_far.then_some(Some((each, middle)))
    }

    fn report(&self, first: Nanos, found: &mut Option<Mixture>) {
        let mean = |(sum, count): (f64, u32)| sum / f64::from(count.max(1));
        let apart = match self.seen.forces.1 >= self.seen.rates.1 {
            true => Apart::Forces(mean(self.seen.forces)),
            false => Apart::Rates(mean(self.seen.rates)),
        };
        let is_by_clocks = |known: &Mixture| matches!(known.apart, Apart::Clocks(_));
        if !found.as_ref().is_some_and(is_by_clocks) {
            *found = Some(Mixture {
                apart,
                samples: self.seen.samples,
                first,
            });
        }
    }
}

#[cfg(test)]
mod tests;
