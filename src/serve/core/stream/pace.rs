//! The first stamps of a sender beside their arrivals -> the unit that the stamps look like. Pure.
//!
//! Apart from [`stamp_unit`](super::stamp_unit) because no step is too short here: what is wrong is seen only beside
//! another clock.

use strapd_attitude::condition::Clock;
use strapd_attitude::record::{Nanos, RawSample, TimeUnit};

/// Steps that are looked at: a sender may pause, or begin with what it has held back, but mostly does not.
const LOOKED_AT: usize = 64;
/// Steps, and time of arrivals, ns, that tell something.
const FEWEST: usize = 16;
const SHORTEST: i64 = 50_000_000;
/// Time of arrivals after which the steps so far are enough, ns.
const ENOUGH: i64 = 1_000_000_000;
/// Step that no gyro has, ns. Shorter ones may be of a recording that is sent faster than it ran.
const LONG: i64 = 500_000_000;
/// Deviation from a power of a thousand, as a factor: arrivals come in bursts.
const ABOUT: f64 = 2.0;

const UNITS: [(TimeUnit, &str); 4] = [
    (TimeUnit::Nano, "nanoseconds"),
    (TimeUnit::Micro, "microseconds"),
    (TimeUnit::Milli, "milliseconds"),
    (TimeUnit::Second, "seconds"),
];

/// The first steps of a sender.
#[derive(Debug, Default)]
pub(super) struct Pace {
    last: Option<(Nanos, Nanos)>,
    /// Steps of the stamps, whatever their sign, ns.
    steps: Vec<i64>,
    /// Time in which they arrived, ns.
    arrived: i64,
}

impl Pace {
    /// Takes the next sample.
    #[inline]
    pub(super) fn take(&mut self, raw: &RawSample, clock: Clock) {
        let Some(stamp) = raw.header.filter(|_| clock == Clock::Header) else {
            return;
        };
        if self.steps.len() >= LOOKED_AT {
            return;
        }
        if let Some((before, came)) = self.last.replace((stamp, raw.log)) {
            self.steps.push(stamp.since(before).saturating_abs());
            let arrived = raw.log.since(came).max(0);
            self.arrived = self.arrived.saturating_add(arrived);
        }
    }

    /// Whether more samples will tell what to say of such steps.
    pub(super) fn is_open(&self) -> bool {
        let is_enough = self.steps.len() >= LOOKED_AT || self.arrived >= ENOUGH;
        !is_enough && self.step().is_some_and(|step| step >= LONG)
    }

    /// Advice where the stamps, `stated` in that unit if in any, go on a thousand or a million times as fast as their
    /// samples come, or as slowly.
    pub(super) fn advice(&self, stated: Option<TimeUnit>) -> Option<String> {
        let thousands = self.thousands()?;
        let factor = 1000_u32.pow(thousands.unsigned_abs());
        let speed = if thousands > 0 { "fast" } else { "slowly" };
        let speed = format!("go on about {factor} times as {speed} as their samples come");
        let place = |unit| UNITS.iter().position(|(known, _)| *known == unit);
        let read = stated.and_then(place);
        let real = read.and_then(|read| read.checked_add_signed(-(thousands as isize)));
        let named = |place: usize| UNITS.get(place);
        Some(match (read.and_then(named), real.and_then(named)) {
            (Some((read, called)), Some((unit, name))) => {
                let (read, unit) = (read.name(), unit.name());
                format!(
                    "the stamps look like {name} that are called {called}, as they {speed}: send them as stamp_{unit}, or start the daemon with --field stamp=stamp_{read}:{unit} (of a table --columns stamp=NAME:{unit})"
                )
            }
            _ => format!("the stamps {speed}: they are not in the unit in which they are read"),
        })
    }

    /// Power of a thousand by which the stamps are faster than their arrivals; `None` where they go on together, or
    /// nothing tells.
    fn thousands(&self) -> Option<i32> {
        if self.steps.len() < FEWEST || self.arrived < SHORTEST || self.is_open() {
            return None;
        }
        let step = self.step()?;
        let ratio = step as f64 * self.steps.len() as f64 / self.arrived as f64;
        let power = ratio.log10() / 3.0;
        let nearest = power.round();
        let is_one = (power - nearest).abs() <= ABOUT.log10() / 3.0;
        let is_slow = nearest < 0.0;
        let is_told = is_one && (1.0..=2.0).contains(&nearest.abs()) && (is_slow || step >= LONG);
        is_told.then_some(nearest as i32)
    }

    /// The ordinary step, ns.
    fn step(&self) -> Option<i64> {
        let mut steps: Vec<i64> = self
            .steps
            .iter()
            .copied()
            .filter(|step| *step > 0)
            .collect();
        steps.sort_unstable();
        steps.get(steps.len().saturating_sub(1) / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// Steps of so many ns, of samples that come every 10 ms but for a pause.
    fn pace(step: i64, count: i64) -> Pace {
        let mut pace = Pace::default();
        for n in 0..count {
            let pause = if n > 40 { 300 * MS } else { 0 };
            let raw = RawSample {
                header: Some(Nanos(step * n)),
                log: Nanos(10 * MS * n + pause),
                ..RawSample::default()
            };
            pace.take(&raw, Clock::Header);
        }
        pace
    }

    fn advice(step: i64, stated: Option<TimeUnit>) -> String {
        pace(step, 100).advice(stated).unwrap_or_default()
    }

    #[test]
    fn a_unit_called_another_is_named_with_both() {
        use TimeUnit::{Micro, Milli, Nano, Second};
        for (step, stated, words, sent) in [
            (
                10_000,
                Second,
                "milliseconds that are called seconds, as they go on about 1000 times as fast",
                "stamp_ms",
            ),
            (
                -10_000,
                Second,
                "milliseconds that are called seconds",
                "stamp_ms",
            ),
            (
                10_000,
                Milli,
                "microseconds that are called milliseconds",
                "stamp_us",
            ),
            (
                10_000,
                Micro,
                "nanoseconds that are called microseconds",
                "stamp_ns",
            ),
            (
                10_000_000,
                Second,
                "microseconds that are called seconds, as they go on about 1000000 times",
                "stamp_us",
            ),
        ] {
            let said = advice(step * MS, Some(stated));
            assert!(said.contains(words), "{stated:?}: {said}");
            assert!(said.contains(&format!("send them as {sent},")), "{said}");
        }
        let slow = advice(10_000, Some(Micro));
        assert!(
            slow.contains("milliseconds that are called microseconds"),
            "{slow}"
        );
        assert!(slow.contains("1000 times as slowly"), "{slow}");
        for stated in [None, Some(Nano)] {
            let said = advice(10_000 * MS, stated);
            assert!(
                said.contains("not in the unit in which they are read"),
                "{said}"
            );
        }
    }

    #[test]
    fn stamps_that_go_on_with_their_samples_are_in_their_unit() {
        for step in [10 * MS, -10 * MS, 5 * MS, 100 * MS, 600_000 * MS, 0] {
            assert_eq!(advice(step, Some(TimeUnit::Second)), "", "{step}");
            assert!(!pace(step, 100).is_open());
        }
        // One long gap.
        let mut gap = pace(10 * MS, 30);
        let late = RawSample {
            header: Some(Nanos(3_600_000 * MS)),
            log: Nanos(310 * MS),
            ..RawSample::default()
        };
        gap.take(&late, Clock::Header);
        assert_eq!(gap.advice(Some(TimeUnit::Second)), None);
        assert!(pace(10_000 * MS, 3).is_open() && !gap.is_open());
    }
}
