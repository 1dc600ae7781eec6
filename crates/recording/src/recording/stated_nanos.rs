//! Stamps that are nanoseconds by their name -> whether their steps are those of a gyro. Pure.
//!
//! Apart from `bare_stamps` because nothing waits: such stamps are believed until all of them are known.
//! A table of another maker is judged by its first rows; here the whole counts, as a sensor may begin with a burst.

use crate::decode::{Bare, SHORTEST_STEP, units_of_steps};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{Nanos, TimeUnit};
use strapd_attitude::setting::{COLUMNS, FIELD};

/// Least number of steps that is judged.
const FEWEST: u64 = 8;
/// Least number of steps by which a second clock is judged.
const FEWEST_ARRIVALS: u64 = 128;
/// Steps of which the ordinary one is named.
const FIRST: usize = 64;
/// A longer step counts as this, ns: a pause is none, and a burst of a hundred samples lies between two of them.
const PAUSE: i64 = 100 * SHORTEST_STEP;

/// The steps of one sensor's stamps.
#[derive(Clone, Debug, Default)]
pub struct StatedNanos {
    last: Option<Nanos>,
    steps: u64,
    short: u64,
    /// Sum of the steps, none of them above [`PAUSE`], ns.
    sum: i64,
    first: Vec<Bare>,
}

/// Steps that no gyro has, in nanoseconds.
#[derive(Clone, PartialEq, Debug)]
pub struct TooFast {
    /// The ordinary step, ns.
    pub step: f64,
    /// The units in which it is that of a gyro.
    pub fits: Vec<TimeUnit>,
}

impl StatedNanos {
    /// Takes the next stamp. Samples that share one, and those without any, say nothing.
    #[inline]
    pub fn take(&mut self, stamp: Nanos) {
        let Some(last) = self.last.replace(stamp) else {
            return;
        };
        let step = stamp.since(last).saturating_abs();
        if step == 0 {
            return;
        }
        self.steps += 1;
        self.short += u64::from(step < SHORTEST_STEP);
        self.sum = self.sum.saturating_add(step.min(PAUSE));
        if self.first.len() < FIRST && step < SHORTEST_STEP {
            self.first.push(Bare::whole(step));
        }
    }

    /// Returns the number of steps.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Whether these are the steps of a sensor, enough of them to judge another clock by.
    pub(super) fn are_a_sensors(&self) -> bool {
        self.steps >= FEWEST_ARRIVALS && self.mean() >= SHORTEST_STEP
    }

    /// The mean step, pauses cut, ns.
    fn mean(&self) -> i64 {
        self.sum / i64::try_from(self.steps.max(1)).unwrap_or(i64::MAX)
    }

    /// Returns the steps if most are shorter than any gyro's, other than in bursts, and would be a gyro's in another
    /// unit.
    #[must_use]
    pub fn too_fast(&self) -> Option<TooFast> {
        let is_ordinary = self.steps >= FEWEST && 2 * self.short > self.steps;
        if !is_ordinary || self.mean() >= SHORTEST_STEP {
            return None;
        }
        let (step, mut fits) = units_of_steps(self.first.iter().copied())?;
        // In that unit the stamp itself must be an instant.
        let last = Bare::whole(self.last?.0);
        fits.retain(|unit| *unit != TimeUnit::Nano && last.is_instant_in(*unit));
        if let Some(ours) = fits
            .iter()
            .copied()
            .find(|unit| last.is_of_our_time_in(*unit))
        {
            fits = vec![ours];
        }
        (!fits.is_empty()).then_some(TooFast { step, fits })
    }
}

impl TooFast {
    /// Describes what is seen, without what helps.
    #[must_use]
    pub fn what(&self) -> String {
        let names: Vec<&str> = self.fits.iter().map(|unit| unit.name()).collect();
        format!(
            "its stamps are in ns by their name, but steps of {} ns are those of a gyro only in {}",
            self.step,
            names.join(" or ")
        )
    }

    /// The name of the unit that fits, the shortest of several.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        self.fits.first().map_or("us", |unit| unit.name())
    }

    /// The error for rows or lines of a file, with the setting that states the unit.
    pub(super) fn in_file(&self, is_table: bool) -> Diagnostic {
        let unit = self.unit();
        let help = match is_table {
            true => {
                format!("{COLUMNS} stamp=stamp_ns:{unit} takes them so, and :ns as their name says")
            }
            false => {
                format!("{FIELD} stamp=stamp_ns:{unit} takes them so, and :ns as their name says")
            }
        };
        Diagnostic::new(self.what()).help(help)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(stamps: impl Iterator<Item = i64>) -> Option<(f64, Vec<&'static str>)> {
        let mut steps = StatedNanos::default();
        stamps.for_each(|stamp| steps.take(Nanos(stamp)));
        let found = steps.too_fast()?;
        Some((found.step, found.fits.iter().map(|u| u.name()).collect()))
    }

    const MS: i64 = 1_700_000_000_000;

    #[test]
    fn milliseconds_microseconds_and_seconds_under_another_name_are_seen() {
        assert_eq!(
            judged((0..200).map(|i| MS + 10 * i)),
            Some((10.0, vec!["ms"]))
        );
        assert_eq!(
            judged((0..200).map(|i| MS * 1000 + 10_000 * i)),
            Some((10_000.0, vec!["us"]))
        );
        assert_eq!(
            judged((0..200).map(|i| 1_700_000_000 + i)),
            Some((1.0, vec!["s"]))
        );
        // One in twenty lost, and an hour's pause.
        let lossy = (0..2000).filter(|i| i % 20 != 7);
        let stamps = lossy.map(|i| MS + 10 * i + if i > 900 { 3_600_000 } else { 0 });
        assert_eq!(judged(stamps), Some((10.0, vec!["ms"])));
    }

    #[test]
    fn fast_sensors_bursts_and_samples_that_share_a_stamp_are_good_data() {
        for step in [1_000_000, 125_000, 31_250, 20_000] {
            assert_eq!(judged((0..2000).map(|i| MS + step * i)), None, "{step} ns");
        }
        // Sixteen at a time on arrival, 3 us apart.
        assert_eq!(
            judged((0..2000).map(|i| i / 16 * 16_000_000 + i % 16 * 3000)),
            None
        );
        // Each row twice, and a clock that ticks in milliseconds.
        assert_eq!(judged((0..2000).map(|i| MS + i / 2 * 10_000_000)), None);
        assert_eq!(judged((0..2000).map(|i| MS + i / 4 * 1_000_000)), None);
        // Of our time in nanoseconds they are in no other unit, however near.
        assert_eq!(judged((0..2000).map(|i| MS * 1_000_000 + 10_000 * i)), None);
        assert_eq!(judged((0..8).map(|i| MS + 10 * i)), None, "too few");
    }
}
