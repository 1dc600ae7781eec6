//! Recorded intervals beside the steps of the stamps -> whether they can both be true. Pure.
//!
//! Apart from the preparation because an interval read in the wrong unit makes every sample a point and
//! every step a gap, and nothing behind it can tell; and because a daemon looks at them, too.

use crate::condition::Clock;
use crate::diagnostic::Diagnostic;
use crate::digits::significant;
use crate::record::TimeUnit;
use crate::record::{RawSample, SampleKind};
use crate::setting::{FIELD, SAMPLE_KIND, TIME};

/// Largest ratio of an interval to a step: samples are lost and stamps jitter, but not by this.
const MOST: f64 = 3.0;
/// Fewer intervals than this prove nothing.
pub const LEAST_INTERVALS: usize = 8;

/// Intervals and steps that disagree, in seconds (medians).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mismatch {
    interval: f64,
    step: f64,
    looked_at: usize,
}

impl Mismatch {
    /// Mismatch of the intervals of these samples; `None` where there is none, or where they play no
    /// part.
    pub(super) fn between(first: &[RawSample], clock: Clock, kind: SampleKind) -> Option<Mismatch> {
        if kind == SampleKind::Rate {
            return None;
        }
        let intervals = first.iter().filter_map(|s| s.interval_nanos);
        let stamps = first.iter().filter_map(|s| clock.read(s)).map(|s| s.0);
        Mismatch::of(intervals, stamps, clock)
    }

    /// The same of intervals and stamps in nanoseconds, by the clock the stamps are of.
    #[must_use]
    pub fn of(
        intervals: impl Iterator<Item = i64>,
        stamps: impl Iterator<Item = i64>,
        clock: Clock,
    ) -> Option<Mismatch> {
        let mut intervals: Vec<f64> = intervals
            .filter(|nanos| *nanos > 0)
            .map(|nanos| nanos as f64 * 1e-9)
            .collect();
        let looked_at = intervals.len();
        if looked_at < LEAST_INTERVALS {
            return None;
        }
        let interval = median(&mut intervals)?;
        let step = step(stamps, clock)?;
        let ratio = step / interval;
        (!(1.0 / MOST..=MOST).contains(&ratio)).then_some(Mismatch {
            interval,
            step,
            looked_at,
        })
    }

    /// Why the samples cannot be used as they are, with the flags that help; `read` is where the
    /// interval lies and the unit it was read in.
    pub(super) fn refusal(&self, read: Option<&(String, TimeUnit)>) -> Diagnostic {
        let (path, unit) = match read {
            Some((path, unit)) => (path.as_str(), *unit),
            None => ("PATH", TimeUnit::Second),
        };
        let count = self.interval * 1e9 / nanos_in(unit);
        let fits = |(_, unit): &&(&str, TimeUnit)| {
            let ratio = self.step * 1e9 / (count * nanos_in(*unit));
            (1.0 / MOST..=MOST).contains(&ratio)
        };
        let same = |(_, other): &&(&str, TimeUnit)| nanos_in(*other) == nanos_in(unit);
        let own = TimeUnit::NAMED
            .iter()
            .find(same)
            .map_or("s", |(name, _)| name);
        let other = TimeUnit::NAMED.iter().find(fits).map_or_else(
            || "no unit makes them agree".to_owned(),
            |(name, _)| format!("{FIELD} dt={path}:{name} reads it in {name}, which fits"),
        );
        Diagnostic::new(format!(
            "{self}: one of the two is wrong, or most samples were left out"
        ))
        .help(format!(
            "{other}; {FIELD} dt={path}:{own} takes it as it is and bridges the rest; {SAMPLE_KIND} rate leaves it aside; {TIME} log takes other stamps"
        ))
    }
}

impl std::fmt::Display for Mismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let short = |secs: f64| significant(secs, 3);
        write!(
            f,
            "the messages say that a sample lasts {} s, and their stamps are {} s apart (medians of {})",
            short(self.interval),
            short(self.step),
            self.looked_at
        )
    }
}

fn nanos_in(unit: TimeUnit) -> f64 {
    match unit {
        // An interval is no instant: without a stated unit it is seconds.
        TimeUnit::ByMagnitude => 1e9,
        unit => unit.nanos(0.0) as f64,
    }
}

/// The ordinary step of the stamps, s: the median, or where most stamps are shared the mean.
fn step(stamps: impl Iterator<Item = i64>, clock: Clock) -> Option<f64> {
    if let Clock::Index { rate_hz } = clock {
        return Some(1.0 / rate_hz);
    }
    let mut stamps: Vec<i64> = stamps.collect();
    stamps.retain(|stamp| *stamp != 0);
    stamps.sort_unstable();
    let mut steps: Vec<f64> = stamps
        .windows(2)
        .filter_map(|pair| Some(pair.last()?.saturating_sub(*pair.first()?) as f64 * 1e-9))
        .collect();
    let median = median(&mut steps)?;
    if median > 0.0 {
        return Some(median);
    }
    let mean = steps.iter().sum::<f64>() / steps.len() as f64;
    (mean > 0.0).then_some(mean)
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len().checked_sub(1)? / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
