//! The first samples of a recording -> what their stamps are. Pure.
//!
//! Apart from the preparation because it is one of its passes, and what `check` looks with: at stamps, arrivals and rates
//! as they were recorded.

use super::plan::EstimationSettings;
use crate::condition::{
    BatchRate, Batches, Clock, ClockSpeed, SpeedPass, SpeedVerdict, StampRepair, batches,
};
use crate::diagnostic::Diagnostic;
use crate::record::RawSample;
use crate::setting::{RATE_HZ, STAMPS, TIME};

/// Samples that are looked at: of a sensor that is read in batches, thousands of them.
const LOOKED_AT: usize = 20_000;

/// Stamps, arrivals and rates of the first samples.
#[derive(Clone, Debug, Default)]
pub struct ClockPass {
    samples: Vec<RawSample>,
}

/// Verdict of a [`ClockPass`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ClockVerdict {
    /// The rate of samples that were stamped when their batch came.
    pub batches: Option<BatchRate>,
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

    /// Takes the next sample; more than are looked at are passed over.
    pub fn take(&mut self, raw: &RawSample) {
        if self.wants_more() {
            self.samples.push(*raw);
        }
    }

    /// Whether more samples would tell more.
    #[must_use]
    pub fn wants_more(&self) -> bool {
        self.samples.len() < LOOKED_AT
    }

    /// Judges the samples that were taken, on `clock`.
    #[must_use]
    pub fn finish(self, clock: Clock) -> ClockVerdict {
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
            of_speed: self
                .speed(clock)
                .filter(is_wrong)
                .map(|found| of_speed(&found)),
        }
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

fn of_speed(found: &ClockSpeed) -> Diagnostic {
    let (stamps, log) = found.steps_secs;
    Diagnostic::new(format!(
        "header stamps advance {:.3} s in a second of the recorder's clock: {:.2} Hz by the one, {:.2} Hz by the other",
        found.speed,
        1.0 / stamps.max(1e-9),
        1.0 / log.max(1e-9)
    ))
    .help(format!(
        "{TIME} log if the recorder's clock is right: every angle is wrong by the ratio otherwise"
    ))
    .coded("clock-speed")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::record::Nanos;

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
        pass.finish(Clock::Header)
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
