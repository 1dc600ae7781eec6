//! AttitudeSample -> every n-th AttitudeSample, by stamps. Pure.
//!
//! A stage of its own because `--out-rate` thins what is written and never what is integrated.

use strapd_attitude::record::{AttitudeSample, Nanos, Status};

/// Thins a stream to about `--out-rate` samples a second.
///
/// Output instants lie on a grid from the first sample on. Of the input samples the first one is
/// taken that is no more than half a mean input step before the grid point: at equal rates jitter
/// loses none, at higher input rates the sample nearest to the grid point is taken. A stamp that goes
/// backwards starts a new grid. What the samples left out had to say is added to the status of the
/// next one kept.
#[derive(Clone, Debug)]
pub struct Decimator {
    /// Nanoseconds between outputs.
    period: f64,
    /// First sample of the grid and the sample seen last.
    grid: Option<(Nanos, Nanos)>,
    /// Sum of the input steps since, in ns, each cut to two periods so that a gap weighs little.
    steps_sum: f64,
    steps: f64,
    /// Grid point not yet served.
    next: f64,
    skipped: Status,
}

impl Decimator {
    /// `rate_hz` must be finite and positive; otherwise `None`.
    #[must_use]
    pub fn new(rate_hz: f64) -> Option<Decimator> {
        let period = 1e9 / rate_hz;
        (rate_hz > 0.0 && period.is_finite() && period > 0.0).then_some(Decimator {
            period,
            grid: None,
            steps_sum: 0.0,
            steps: 0.0,
            next: 0.0,
            skipped: Status::OK,
        })
    }

    /// The sample to write, or `None` when it is left out.
    pub fn keep(&mut self, sample: &AttitudeSample) -> Option<AttitudeSample> {
        let stamp = sample.stamp;
        let (origin, previous) = match self.grid {
            Some((origin, previous)) if stamp >= previous => (origin, previous),
            _ => {
                (self.next, self.steps_sum, self.steps) = (0.0, 0.0, 0.0);
                (stamp, stamp)
            }
        };
        self.grid = Some((origin, stamp));
        // Integers until subtracted; an f64 holds the difference exactly for 104 days and the
        // nearest few nanoseconds after that.
        let elapsed = stamp.since(origin) as f64;
        let step = stamp.since(previous) as f64;
        if step > 0.0 {
            self.steps_sum += step.min(2.0 * self.period);
            self.steps += 1.0;
        }
        // No step yet: the first sample, which lies on the grid.
        let mean_step = self.steps_sum / self.steps.max(1.0);
        let half_step = 0.5 * mean_step.min(self.period);
        let reached = ((elapsed + half_step) / self.period).floor();
        if reached < self.next {
            self.skipped = self.skipped.with(sample.status);
            return None;
        }
        self.next = reached + 1.0;
        let kept = AttitudeSample {
            status: sample.status.with(self.skipped),
            ..*sample
        };
        self.skipped = Status::OK;
        Some(kept)
    }

    /// Appends to `out` those of `samples` that are to be written.
    pub fn select(&mut self, samples: &[AttitudeSample], out: &mut Vec<AttitudeSample>) {
        out.extend(samples.iter().filter_map(|s| self.keep(s)));
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sink::tests::sample;

    fn thin(rate_hz: f64, stamps: impl IntoIterator<Item = i64>) -> Vec<i64> {
        let mut decimator = Decimator::new(rate_hz).unwrap();
        stamps
            .into_iter()
            .filter_map(|ns| decimator.keep(&sample(Nanos(ns))))
            .map(|s| s.stamp.0)
            .collect()
    }

    #[test]
    fn a_thousand_hertz_becomes_thirty_without_drift() {
        // 10 s at 1 kHz from today's epoch; 30 Hz does not divide 1 kHz.
        let t0 = 1_700_000_000_000_000_000;
        let kept = thin(30.0, (0..10_000).map(|k| t0 + k * 1_000_000));
        assert_eq!(kept.len(), 300);
        for (k, stamp) in kept.iter().enumerate() {
            let ideal = k as f64 * 1e9 / 30.0;
            // Nearest of a 1 ms grid: never more than half a step away (+1 ns of rounding).
            assert!(
                ((stamp - t0) as f64 - ideal).abs() <= 500_001.0,
                "{k}: {stamp}"
            );
        }
    }

    #[test]
    fn at_equal_rates_jitter_loses_no_sample() {
        // +-40 % of the step: stamps stay in order, and a plain grid comparison would drop some.
        let jitter = [0, 4, -4, 3, -3, 4, -4, 0, -4, 4];
        let stamps: Vec<i64> = (0..1000)
            .map(|k| k * 10_000_000 + jitter[(k % 10) as usize] * 1_000_000)
            .collect();
        assert_eq!(thin(100.0, stamps.clone()), stamps);
    }

    #[test]
    fn a_rate_above_the_input_keeps_everything_and_a_backward_jump_restarts_the_grid() {
        assert_eq!(thin(1e6, [0, 1_000, 2_000_000, 3_000_000]).len(), 4);
        let kept = thin(
            1.0,
            [0, 500_000_000 - 1, 2_000_000_000, 100, 200, 1_000_000_100],
        );
        assert_eq!(kept, [0, 2_000_000_000, 100, 1_000_000_100]);
    }

    #[test]
    fn after_a_gap_the_output_does_not_hurry_to_catch_up() {
        // 100 Hz in, 10 Hz out, five seconds missing in the middle.
        let stamps = (0..100).chain(600..700).map(|k| k * 10_000_000);
        let kept = thin(10.0, stamps);
        assert_eq!(kept.len(), 20);
        assert!(
            kept.windows(2).all(|w| w[1] - w[0] >= 100_000_000),
            "{kept:?}"
        );
    }

    #[test]
    fn the_status_of_samples_left_out_reaches_the_next_one_kept() {
        let mut decimator = Decimator::new(1.0).unwrap();
        let mut held = sample(Nanos(1));
        held.status = Status::HELD;
        assert!(decimator.keep(&sample(Nanos(0))).is_some());
        assert!(decimator.keep(&held).is_none());
        let kept = decimator.keep(&sample(Nanos(1_000_000_000))).unwrap();
        assert_eq!(kept.status, Status::HELD);
        let kept = decimator.keep(&sample(Nanos(2_000_000_000))).unwrap();
        assert_eq!(kept.status, Status::OK);
    }

    #[test]
    fn rates_that_are_none_are_refused() {
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE / 4.0] {
            assert!(Decimator::new(rate).is_none(), "{rate}");
        }
    }
}
