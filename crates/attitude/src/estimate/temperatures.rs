//! Temperatures beside the samples -> temperature of each attitude. Pure.
//!
//! Apart from the stages between because none of them uses it: a temperature goes by the instant at which it was
//! received, which every attitude keeps of its sample.

use crate::record::{AttitudeSample, Nanos, RawSample};
use std::collections::VecDeque;
use std::ops::RangeInclusive;

/// Temperatures that a sensor may have, degrees Celsius: what lies beyond is a count, or another unit.
const PLAUSIBLE: RangeInclusive<f32> = -100.0..=200.0;
/// Temperatures that wait for their attitudes; of a recording that is smoothed, all of which wait, every second one is
/// kept when there are more.
const MOST: usize = 1 << 18;
/// Temperatures that are kept behind the last attitude: one that is estimated again is as far back.
const BEHIND: usize = 64;

/// Temperatures by the instant at which they were received; of equal ones in a row the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Temperatures(VecDeque<(Nanos, f32)>);

impl Temperatures {
    /// Takes the temperature of a sample, where it has one.
    #[inline]
    pub(super) fn take(&mut self, raw: &RawSample) {
        if let Some(temperature) = raw.temperature {
            self.push(raw.log, temperature);
        }
    }

    fn push(&mut self, log: Nanos, temperature: f32) {
        if !PLAUSIBLE.contains(&temperature) {
            return;
        }
        let mut log = log;
        if let Some((before, last)) = self.0.back() {
            if *last == temperature {
                return;
            }
            log = log.max(*before);
        }
        if self.0.len() >= MOST {
            let mut is_kept = false;
            self.0.retain(|_| {
                is_kept = !is_kept;
                is_kept
            });
        }
        self.0.push_back((log, temperature));
    }

    /// The one received last.
    pub(super) fn last(&self) -> Option<f32> {
        self.0.back().map(|(_, temperature)| *temperature)
    }

    /// Gives each attitude the temperature that was received last by then.
    pub(super) fn apply(&mut self, attitudes: &mut [AttitudeSample]) {
        if self.0.is_empty() {
            return;
        }
        for attitude in attitudes.iter_mut() {
            let last = self.number_by(attitude.log).checked_sub(1);
            attitude.temperature = last.and_then(|n| Some(self.0.get(n)?.1));
        }
        if let Some(last) = attitudes.last() {
            let useless = self.number_by(last.log).saturating_sub(BEHIND);
            self.0.drain(..useless);
        }
    }

    /// Number of temperatures received by then.
    fn number_by(&self, log: Nanos) -> usize {
        self.0.partition_point(|(received, _)| *received <= log)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quaternion::{BodyRate, Quaternion};
    use crate::record::{AttitudeCovariance, Status};

    fn raw(log: i64, temperature: f32) -> RawSample {
        RawSample {
            log: Nanos(log),
            temperature: Some(temperature),
            ..RawSample::default()
        }
    }

    fn attitude(log: i64) -> AttitudeSample {
        AttitudeSample {
            stamp: Nanos(7),
            q_nb: Quaternion::identity(),
            rate: BodyRate::ZERO,
            accel: None,
            linear_acceleration: None,
            covariance: AttitudeCovariance::default(),
            status: Status::OK,
            reset_count: 0,
            log: Nanos(log),
            temperature: None,
        }
    }

    fn of(temperatures: &mut Temperatures, logs: &[i64]) -> Vec<Option<f32>> {
        let mut attitudes: Vec<_> = logs.iter().map(|log| attitude(*log)).collect();
        temperatures.apply(&mut attitudes);
        attitudes.iter().map(|a| a.temperature).collect()
    }

    #[test]
    fn an_attitude_has_the_temperature_that_was_received_last_by_then() {
        let mut all = Temperatures::default();
        for (log, temperature) in [
            (10, 21.5),
            (20, 21.5),
            (30, 22.0),
            (40, f32::NAN),
            (41, -2e4),
        ] {
            all.take(&raw(log, temperature));
        }
        all.take(&RawSample {
            log: Nanos(50),
            ..RawSample::default()
        });
        // Behind the clock of those before: not earlier than they.
        all.take(&raw(25, 23.0));
        assert_eq!(of(&mut all, &[5, 10, 29]), [None, Some(21.5), Some(21.5)]);
        assert_eq!(of(&mut all, &[30, 1000]), [Some(23.0), Some(23.0)]);
        // One that is estimated again for good.
        assert_eq!(of(&mut all, &[12]), [Some(21.5)]);
        assert_eq!(of(&mut Temperatures::default(), &[12]), [None]);
    }

    #[test]
    fn memory_is_bounded_however_many_wait_and_little_is_kept_of_what_has_left() {
        let mut all = Temperatures::default();
        for n in 0..1_000_000 {
            all.take(&raw(n, 20.0 + (n % 100) as f32 * 0.01));
        }
        assert!(all.0.len() <= MOST);
        let told = of(&mut all, &[500_000, 999_999]);
        assert!(
            told.iter()
                .all(|t| t.is_some_and(|t| (20.0..21.0).contains(&t)))
        );
        assert!(all.0.len() <= BEHIND);
    }
}
