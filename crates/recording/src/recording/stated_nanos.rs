//! Stamps that state their unit, in nanoseconds -> whether their steps are those of a gyro. Pure.
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
    first: Vec<i64>,
}

/// Steps that no gyro has in the unit that their stamps state.
#[derive(Clone, PartialEq, Debug)]
pub struct TooFast {
    /// The ordinary step, in the unit that they state.
    pub step: f64,
    /// Unit that they state; `None`: no name states it, and they are nanoseconds.
    pub stated: Option<TimeUnit>,
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
            self.first.push(step);
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
    /// unit than the stamps state.
    #[must_use]
    pub fn too_fast(&self, stated: Option<TimeUnit>) -> Option<TooFast> {
        let is_ordinary = self.steps >= FEWEST && 2 * self.short > self.steps;
        if !is_ordinary || self.mean() >= SHORTEST_STEP {
            return None;
        }
        let unit = stated.unwrap_or(TimeUnit::Nano);
        let counted = |nanos: i64| Bare::of(nanos, unit);
        let (step, mut fits) = units_of_steps(self.first.iter().copied().map(counted))?;
        // In that unit the stamp itself must be an instant.
        let last = counted(self.last?.0);
        fits.retain(|other| *other != unit && last.is_instant_in(*other));
        if let Some(ours) = fits
            .iter()
            .copied()
            .find(|unit| last.is_of_our_time_in(*unit))
        {
            fits = vec![ours];
        }
        (!fits.is_empty()).then_some(TooFast { step, stated, fits })
    }
}

impl TooFast {
    /// Describes what is seen, without what helps.
    #[must_use]
    pub fn what(&self) -> String {
        let names: Vec<&str> = self.fits.iter().map(|unit| unit.name()).collect();
        let unit = self.stated_unit();
        let read = match self.stated {
            Some(_) => format!("in {unit} by their name or a setting"),
            None => format!("read in {unit}"),
        };
        format!(
            "its stamps are {read}, but steps of {} {unit} are those of a gyro only in {}",
            self.step,
            names.join(" or ")
        )
    }

    /// The name of the unit in which the stamps are read.
    #[must_use]
    pub fn stated_unit(&self) -> &'static str {
        self.stated.unwrap_or(TimeUnit::Nano).name()
    }

    /// The ordinary step as it is read, ns.
    #[must_use]
    pub fn step_nanos(&self) -> f64 {
        self.step * self.stated.unwrap_or(TimeUnit::Nano).nanos(0.0) as f64
    }

    /// The name of the unit that fits, the shortest of several.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        self.fits.first().map_or("us", |unit| unit.name())
    }

    /// The error for rows or lines of a file, with the setting that states the unit.
    pub(super) fn in_file(&self, is_table: bool) -> Diagnostic {
        let (unit, stated) = (self.unit(), self.stated_unit());
        let setting = if is_table { COLUMNS } else { FIELD };
        let help = format!(
            "{setting} stamp=stamp_{stated}:{unit} takes them so, and :{stated} as their name says"
        );
        Diagnostic::new(self.what()).help(help)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn judged(stamps: impl Iterator<Item = i64>) -> Option<(f64, Vec<&'static str>)> {
        let found = judged_in(None, stamps)?;
        Some((found.step, found.fits.iter().map(|u| u.name()).collect()))
    }

    fn judged_in(stated: Option<TimeUnit>, stamps: impl Iterator<Item = i64>) -> Option<TooFast> {
        let mut steps = StatedNanos::default();
        stamps.for_each(|stamp| steps.take(Nanos(stamp)));
        steps.too_fast(stated)
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

    #[test]
    fn the_unit_that_the_name_states_is_the_one_that_is_said() {
        // What is sent, in which unit by its name, and what it is.
        for (stated, count, step, unit) in [
            (TimeUnit::Micro, 11, 10, "ms"),
            (TimeUnit::Micro, MS, 10, "ms"),
            (TimeUnit::Micro, 1_700_000_000, 1, "s"),
            (TimeUnit::Nano, MS * 1000, 10_000, "us"),
        ] {
            let size = stated.nanos(0.0);
            let stamps = (0..200).map(|i| (count + step * i) * size);
            let found = judged_in(Some(stated), stamps).unwrap();
            let name = stated.name();
            assert_eq!((found.stated_unit(), found.unit()), (name, unit));
            let said = format!(
                "in {name} by their name or a setting, but steps of {step} {name} are those of a gyro only in {unit}"
            );
            assert!(found.what().contains(&said), "{}", found.what());
            let help = found.in_file(false).to_string();
            let setting = format!("stamp=stamp_{name}:{unit} takes them so, and :{name} as");
            assert!(help.contains(&setting), "{help}");
        }
        // Hundredths of a second called ms: 0.01 ms is short, and 0.01 s a gyro's.
        let stamps = (0..200).map(|i| 1_700_000_000_000_000 + 10_000 * i);
        let found = judged_in(Some(TimeUnit::Milli), stamps).unwrap();
        assert_eq!((found.step, found.unit()), (0.01, "s"));
        assert!(
            judged_in(None, (0..200).map(|i| 10 * i)).is_some_and(|found| {
                found
                    .what()
                    .starts_with("its stamps are read in ns, but steps of 10 ns")
            })
        );
    }
}
