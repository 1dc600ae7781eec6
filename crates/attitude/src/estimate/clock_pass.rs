//! The first samples of a recording -> what their stamps are. Pure.
//!
//! Apart from the preparation because it is one of its passes, and what `check` looks with: at stamps, arrivals and rates
//! as they were recorded.

use super::clock_choice;
use super::meaning::Meaning;
use super::plan::EstimationSettings;
use crate::condition::{
    BatchRate, Batches, Clock, ClockSpeed, CoarseClock, Sharing, SpeedPass, SpeedVerdict,
    StampRepair, batches, sharing,
};
use crate::diagnostic::Diagnostic;
use crate::record::{Nanos, RawSample};
use crate::setting::{RATE_HZ, STAMPS, TIME};

/// Samples that are looked at: of a sensor that is read in batches, thousands of them.
const LOOKED_AT: usize = 20_000;

/// The same of a stream, whose samples wait meanwhile.
const LOOKED_AT_IN_STREAM: usize = 8192;
/// Different stamps by which a coarse clock can be told, and samples on each from which it may be one.
const STAMPS_TOLD_BY: usize = 6;
const SHARING: usize = 3;

/// Stamps, arrivals and rates of the first samples.
#[derive(Clone, Debug, Default)]
pub struct ClockPass {
    samples: Vec<RawSample>,
    shared: SharedStamps,
    /// Samples of a stream, of which only a coarse clock is told.
    is_stream: bool,
}

/// Number of samples and of their stamps: whether a clock may be coarse and too few of its steps were seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SharedStamps {
    samples: usize,
    stamps: usize,
    last: Option<Nanos>,
}

impl SharedStamps {
    pub(super) fn take(&mut self, raw: &RawSample) {
        let stamp = raw.header.filter(|stamp| stamp.0 != 0);
        self.samples += 1;
        if stamp.is_none() || stamp != self.last {
            (self.stamps, self.last) = (self.stamps + 1, stamp);
        }
    }

    pub(super) fn want_more(&self) -> bool {
        self.stamps < STAMPS_TOLD_BY
            && self.samples > SHARING * self.stamps.saturating_sub(1).max(1)
            && self.samples < LOOKED_AT_IN_STREAM
    }
}

/// The clock of samples that share their stamps, where it is coarser than the sensor.
pub(super) fn coarse_clock(
    samples: &[RawSample],
    clock: Clock,
    repair: StampRepair,
) -> Option<CoarseClock> {
    match shared(samples, clock) {
        Sharing::Coarse(found) if repair == StampRepair::Auto => Some(found),
        _ => None,
    }
}

fn shared(samples: &[RawSample], clock: Clock) -> Sharing {
    let stamped = samples.iter();
    let stamped: Vec<(i64, &RawSample)> = stamped
        .filter_map(|raw| Some((clock.read(raw)?.0, raw)))
        .collect();
    sharing(&stamped)
}

/// Verdict of a [`ClockPass`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ClockVerdict {
    /// The clock to use.
    pub clock: Clock,
    /// The rate of samples that were stamped when their batch came.
    pub batches: Option<BatchRate>,
    /// The clock, where it is coarser than the sensor.
    pub coarse: Option<CoarseClock>,
    /// Message about batches.
    pub of_batches: Option<Diagnostic>,
    /// Message about two clocks that run at different speeds.
    pub of_speed: Option<Diagnostic>,
}

impl ClockPass {
    /// Makes one; `None` where the plan leaves stamps as they are, or straightens them all.
    #[must_use]
    pub fn of(plan: &EstimationSettings) -> Option<ClockPass> {
        let is_left = plan.stamps == StampRepair::AsRecorded
            || plan.regularise_stamps
            || matches!(plan.clock, Clock::Index { .. });
        (!is_left).then(ClockPass::default)
    }

    /// The same for samples that cannot be read again.
    #[must_use]
    pub(super) fn of_stream(self) -> ClockPass {
        ClockPass {
            is_stream: true,
            ..self
        }
    }

    /// Takes the next sample; more than are looked at are passed over.
    pub fn take(&mut self, raw: &RawSample) {
        if self.samples.len() < LOOKED_AT {
            self.shared.take(raw);
            self.samples.push(*raw);
        }
    }

    /// Whether more samples would tell more.
    #[must_use]
    pub fn wants_more(&self) -> bool {
        match self.is_stream {
            true => self.shared.want_more(),
            false => self.samples.len() < LOOKED_AT,
        }
    }

    /// Whether the samples so far share too few stamps for a coarse clock to be told.
    #[must_use]
    pub fn lacks_stamps(&self) -> bool {
        self.shared.want_more()
    }

    /// Returns the samples by which a clock is chosen: the `first`, or all that were taken where the first share one stamp.
    #[must_use]
    pub(super) fn prefix<'a>(&'a self, first: &'a [RawSample]) -> &'a [RawSample] {
        let is_one = |pair: &[RawSample]| matches!(pair, [a, b] if a.header == b.header);
        let is_stuck = first.len() > 1 && first.windows(2).all(is_one);
        match is_stuck && self.samples.len() > first.len() {
            true => &self.samples,
            false => first,
        }
    }

    /// Judges the samples that were taken, on `clock`, understood as in the run.
    #[must_use]
    pub fn finish(self, clock: Clock, of: (&EstimationSettings, &Meaning)) -> ClockVerdict {
        if self.is_stream {
            return ClockVerdict {
                clock,
                coarse: coarse_clock(&self.samples, clock, StampRepair::Auto),
                ..ClockVerdict::default()
            };
        }
        let (clock, of_speed) = self.by_speed(clock, of);
        let shared = shared(&self.samples, clock);
        if shared != Sharing::None {
            return ClockVerdict {
                clock,
                coarse: match shared {
                    Sharing::Coarse(found) => Some(found),
                    Sharing::Repeats | Sharing::None => None,
                },
                of_speed,
                ..ClockVerdict::default()
            };
        }
        let stamped = self.samples.iter();
        let (stamps, rates): (Vec<i64>, Vec<[f64; 3]>) = stamped
            .filter_map(|raw| Some((clock.read(raw)?.0, raw.gyro?)))
            .unzip();
        let (rate, of_batches) = match batches(&stamps, &rates) {
            Batches::None | Batches::Gaps => (None, None),
            Batches::Even(rate) => (Some(rate), Some(spread_evenly(&rate))),
            Batches::Unsure(rate) => (None, Some(unsure(&rate))),
        };
        ClockVerdict {
            batches: rate,
            of_batches,
            clock,
            coarse: None,
            of_speed,
        }
    }

    /// The clock to use, where that of the stamps runs at another speed than the recorder's, and what to say of it: the
    /// recorder's where gravity stands still by it.
    fn by_speed(
        &self,
        clock: Clock,
        of: (&EstimationSettings, &Meaning),
    ) -> (Clock, Option<Diagnostic>) {
        let Some(found) = self.speed(clock).filter(is_wrong) else {
            return (clock, None);
        };
        let told = clock_choice::for_arrival(&self.samples, of, found.speed);
        let clock = match told {
            Some(log) if log > clock_choice::CLEAR => Clock::Log,
            _ => clock,
        };
        (clock, Some(of_speed(&found, told)))
    }

    fn speed(&self, clock: Clock) -> Option<ClockSpeed> {
        if clock != Clock::Header {
            return None;
        }
        let mut pass = SpeedPass::default();
        let stamped = self.samples.iter();
        stamped
            .filter_map(|raw| Some((raw.header?, raw.log)))
            .for_each(|(stamp, log)| pass.push(stamp.0, log.0));
        pass.finish()
    }
}

/// Message about the speed of a stamp clock against that of arrival, where it is no clock's.
#[must_use]
pub fn speed_message(found: &ClockSpeed) -> Option<Diagnostic> {
    is_wrong(found).then(|| of_speed(found, None))
}

/// Message about samples of batches that were spread evenly.
#[must_use]
pub fn batches_message(rate: &BatchRate) -> Diagnostic {
    spread_evenly(rate)
}

fn is_wrong(found: &ClockSpeed) -> bool {
    found.verdict == SpeedVerdict::Wrong
}

fn hz(rate: &BatchRate) -> f64 {
    1e9 / rate.step
}

fn spread_evenly(rate: &BatchRate) -> Diagnostic {
    Diagnostic::new(format!(
        "samples came in batches of {} and were stamped when they came, {:.2} ms apart: spread evenly, at {:.2} Hz",
        rate.size,
        rate.inside * 1e-6,
        hz(rate)
    ))
    .help(format!("{STAMPS} as-recorded to keep the stamps"))
    .coded("batches")
}

fn unsure(rate: &BatchRate) -> Diagnostic {
    Diagnostic::new(format!(
        "samples may have come in batches of {}, stamped when they came, or be missing between them: nothing tells",
        rate.size
    ))
    .help(format!(
        "{TIME} index {RATE_HZ} {:.2} if the sensor samples evenly and no sample is missing",
        hz(rate)
    ))
    .coded("batches")
}

/// Message about two clocks; `told` is the logarithm of how many times likelier the recorder's is.
fn of_speed(found: &ClockSpeed, told: Option<f64>) -> Diagnostic {
    let (stamps, log) = found.steps_secs;
    let what = format!(
        "header stamps advance {:.3} s in a second of the recorder's clock: {:.2} Hz by the one, {:.2} Hz by the other",
        found.speed,
        1.0 / stamps.max(1e-9),
        1.0 / log.max(1e-9)
    );
    let (why, help) = match told {
        Some(log) if log > clock_choice::CLEAR => (
            format!(
                "; gravity stands still by the recorder's (e^{log:.0} times likelier): using the log time"
            ),
            format!("{TIME} log makes this explicit, {STAMPS} as-recorded keeps the stamps"),
        ),
        Some(log) if log < -clock_choice::CLEAR => (
            format!(
                "; gravity stands still by the stamps (e^{:.0} times likelier), which are used",
                -log
            ),
            format!("{STAMPS} as-recorded if that is known"),
        ),
        _ => (
            String::new(),
            format!(
                "{TIME} log if the recorder's clock is right: every angle is wrong by the ratio otherwise"
            ),
        ),
    };
    Diagnostic::new(what + &why).help(help).coded("clock-speed")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::record::Declared;

    fn verdict(header: impl Fn(i64) -> i64) -> ClockVerdict {
        let mut pass = ClockPass::of(&EstimationSettings::default()).unwrap();
        for i in 0..2000 {
            let t = i as f64 * 0.005;
            pass.take(&RawSample {
                header: Some(Nanos(1_000_000_000 + header(i))),
                log: Nanos(1_650_000_000_000_000_000 + i * 5_000_000 + i % 3 * 1_000_000),
                gyro: Some([(1.7 * t).sin(), (1.1 * t).cos(), 0.1]),
                ..RawSample::default()
            });
        }
        let plan = EstimationSettings::default();
        let meaning = Meaning::new(&plan, &Declared::default());
        pass.finish(Clock::Header, (&plan, &meaning))
    }

    #[test]
    fn batches_and_a_clock_of_another_speed_are_reported_and_even_stamps_are_not() {
        assert_eq!(verdict(|i| i * 5_000_000), ClockVerdict::default());
        let batched = verdict(|i| (i / 10 + 1) * 50_000_000 + i % 10 * 20_000);
        assert!((hz(&batched.batches.unwrap()) - 200.0).abs() < 0.01);
        assert_eq!(batched.of_speed, None);
        let slow = verdict(|i| i * 2_500_000).of_speed.unwrap().to_string();
        assert!(
            slow.contains("0.500 s") && slow.contains("400.00 Hz") && slow.contains("199.98 Hz"),
            "{slow}"
        );
    }
}
