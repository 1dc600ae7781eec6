//! Statement, format, orientation, ordinary step -> what a sample means. Pure.
//!
//! One rule for files, streams, arrays and daemon (`docs/theory/clocks.md`, "What a sample means"): apart from the
//! meaning of a sample because everything else in that is stated, and this may be found in the samples.

use super::lag::OrientationLag;
use crate::condition::Clock;
use crate::digits::significant;
use crate::record::{Nanos, RawSample, SampleKind};
use crate::setting::SAMPLE_KIND;
use std::fmt;

/// Longest ordinary step of a sensor that is taken to give means, ns: 20 ms, and a tenth, so that the jitter of a clock
/// of 50 Hz decides nothing. Of eleven sources whose kind is known six of eight up to 20 ms give means, and of three
/// above two give rates.
const LONGEST_OF_MEANS: i64 = 22_000_000;
/// A step of more than so many medians is one over a sample that is missing.
const OVER_A_GAP: f64 = 1.75;
/// Steps of more than a second and so many medians tell nothing at all: a stamp was none.
const NO_STEP: i64 = 20;
/// Steps from which it is seen that samples come in batches, or several on one stamp: then the mean step counts.
const BATCHED: usize = 12;
/// Share of the mean below which a step is short, and share of short steps from which samples come in batches.
const SHORT: f64 = 0.3;
const SHORT_SHARE: f64 = 0.4;

/// Samples by which a recording decides.
pub(super) const AHEAD: usize = 512;
/// Steps by which a stream whose attitudes wait for nothing decides.
pub(super) const STEPS_LIVE: usize = 3;

/// Kind of the samples, and why they are taken so.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KindChoice {
    /// The kind.
    pub kind: SampleKind,
    /// Reason for it.
    pub reason: KindReason,
}

/// Reason why samples are taken for a kind: the first of these that tells.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum KindReason {
    /// Statement of the user.
    Setting,
    /// Statement of the recording or its sender: a column, a field, metadata, a type that fixes it.
    Recording,
    /// Custom of the format's sensors.
    Format,
    /// Fit of the rates to an orientation in the same samples.
    Orientation(OrientationLag),
    /// Ordinary step, ns: nothing states it.
    Step(i64),
    /// Nothing: there is no step yet.
    #[default]
    Unknown,
}

impl KindChoice {
    /// Choice where nothing tells it yet.
    pub(super) const OPEN: KindChoice = KindChoice {
        kind: SampleKind::Rate,
        reason: KindReason::Unknown,
    };

    /// Choice by the ordinary step, ns.
    fn by_step(step: i64) -> KindChoice {
        KindChoice {
            kind: match step <= LONGEST_OF_MEANS {
                true => SampleKind::Average,
                false => SampleKind::Rate,
            },
            reason: KindReason::Step(step),
        }
    }
}

impl KindReason {
    /// Whether something states it: a person, the recording or its format.
    #[must_use]
    pub fn is_stated(&self) -> bool {
        matches!(
            self,
            KindReason::Setting | KindReason::Recording | KindReason::Format
        )
    }

    /// Name for machines.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            KindReason::Setting => "setting",
            KindReason::Recording => "recording",
            KindReason::Format => "format",
            KindReason::Orientation(_) => "orientation",
            KindReason::Step(_) => "step",
            KindReason::Unknown => "unknown",
        }
    }
}

impl fmt::Display for KindReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            KindReason::Setting => write!(f, "stated by {SAMPLE_KIND}"),
            KindReason::Recording => f.write_str("stated by the recording"),
            KindReason::Format => f.write_str("usual for sensors of this format"),
            KindReason::Orientation(lag) => write!(
                f,
                "by the recorded orientation: the rates are {} steps behind it",
                lag.in_steps()
            ),
            KindReason::Step(0) => f.write_str("nothing states it; several samples on one stamp"),
            KindReason::Step(step) => write!(
                f,
                "nothing states it; ordinary step {} ms",
                significant(*step as f64 * 1e-6, 3)
            ),
            KindReason::Unknown => f.write_str("nothing states it"),
        }
    }
}

/// The ordinary step of the first samples.
#[derive(Clone, Debug)]
pub(super) struct OrdinaryStep {
    clock: Clock,
    /// Stamp and reading of the last sample.
    last: Option<(Nanos, [f64; 3])>,
    steps: Vec<i64>,
    /// Steps that are looked at.
    most: usize,
}

impl OrdinaryStep {
    /// Makes one that looks at this many steps on this clock.
    pub(super) fn of(clock: Clock, most: usize) -> OrdinaryStep {
        OrdinaryStep {
            clock,
            last: None,
            steps: Vec::new(),
            most,
        }
    }

    /// Takes the next sample. One that repeats its predecessor is none, and one that was overtaken tells no step;
    /// two that share a stamp and differ are a step of nothing: the clock is coarser than the sensor.
    pub(super) fn take(&mut self, raw: &RawSample) {
        if self.is_known() || raw.is_beside {
            return;
        }
        let (Some(stamp), Some(read)) = (self.clock.read(raw), raw.gyro) else {
            return;
        };
        if !read.iter().all(|value| value.is_finite()) {
            return;
        }
        if let Some((at, before)) = self.last {
            let step = stamp.since(at);
            if step < 0 || step == 0 && read == before {
                return;
            }
            self.steps.push(step);
        }
        self.last = Some((stamp, read));
    }

    /// Whether what follows changes nothing.
    pub(super) fn is_known(&self) -> bool {
        matches!(self.clock, Clock::Index { .. }) || self.steps.len() >= self.most
    }

    /// Kind by it; open where there is no step yet.
    pub(super) fn choice(&self) -> KindChoice {
        self.nanos().map_or(KindChoice::OPEN, KindChoice::by_step)
    }

    /// The ordinary step, ns.
    fn nanos(&self) -> Option<i64> {
        if let Clock::Index { rate_hz } = self.clock {
            return (rate_hz > 0.0).then(|| (1e9 / rate_hz).round() as i64);
        }
        let mut steps = self.steps.clone();
        let middle = steps.len().checked_sub(1)? / 2;
        let median = *steps.select_nth_unstable(middle).1;
        let longest = median.saturating_mul(NO_STEP).max(1_000_000_000);
        let mean_of = |longest: f64| {
            let kept = steps.iter().map(|step| *step as f64);
            let (sum, count) = kept
                .filter(|step| *step <= longest)
                .fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
            sum / f64::max(count, 1.0)
        };
        let mean = mean_of(longest as f64);
        let short = steps.iter().filter(|step| (**step as f64) < SHORT * mean);
        let is_batched = short.count() as f64 >= SHORT_SHARE * steps.len() as f64;
        Some(match is_batched && steps.len() >= BATCHED {
            true => mean,
            false => mean_of(OVER_A_GAP * median as f64),
        } as i64)
    }
}

#[cfg(test)]
mod tests;
