//! Attitudes of an estimator in order -> figures of them: how many, how fast, and which way up. Pure.
//!
//! Apart from the topic because it sees attitudes alone, neither samples nor the estimator.

use strapd_attitude::condition::Histogram;
use strapd_attitude::record::{AttitudeSample, Status};

/// Figures of the attitudes of an estimator.
#[derive(Clone, Debug, Default)]
pub(in crate::pipeline) struct AttitudeStats {
    /// First attitude.
    pub first: Option<AttitudeSample>,
    /// Last attitude.
    pub last: Option<AttitudeSample>,
    /// Number.
    pub count: u64,
    /// Largest component of any rate, rad/s.
    pub largest_rate: f64,
    /// Steps between attitudes, nanoseconds.
    steps: Histogram,
    /// Sum of the vertical parts of the body's z, up positive; and that at the first rest.
    up: f64,
    up_at_rest: Option<f64>,
}

/// Vertical part of the body's z below which it points down at rest, and in the mean of a run.
const DOWN: f64 = -0.87;
const MOSTLY_DOWN: f64 = -0.5;

impl AttitudeStats {
    pub(in crate::pipeline) fn add(&mut self, samples: &[AttitudeSample]) {
        if self.first.is_none() {
            self.first = samples.first().copied();
        }
        let mut last = self.last.map(|last| last.stamp);
        for sample in samples {
            // A clock that was set back, or far ahead, makes no step.
            let step = last
                .replace(sample.stamp)
                .map(|last| sample.stamp.since(last));
            if let Some(step) = step.filter(|step| *step > 0) {
                self.steps.add(step);
            }
            let [_, x, y, _] = sample.q_nb.wxyz();
            let up = 1.0 - 2.0 * (x * x + y * y);
            self.up += up;
            if self.up_at_rest.is_none() && sample.status.has(Status::REST) {
                self.up_at_rest = Some(up);
            }
        }
        self.last = samples.last().copied().or(self.last);
        self.count += samples.len() as u64;
        self.largest_rate = samples
            .iter()
            .map(|s| s.rate.0.amax())
            .fold(self.largest_rate, f64::max);
    }

    /// Whether the body's z, which is up in a body of forward, left, up, points down at the first rest and for most of the
    /// time: who lies on his face for a while turns round.
    pub(in crate::pipeline) fn is_upside_down(&self) -> bool {
        let mean = self.up / self.count.max(1) as f64;
        self.up_at_rest.is_some_and(|up| up < DOWN) && mean < MOSTLY_DOWN
    }

    /// The median rate, Hz; `None` below two attitudes.
    pub(in crate::pipeline) fn rate_hz(&self) -> Option<f64> {
        let step = self.steps.quantile(0.5);
        (step > 0.0).then(|| 1e9 / step)
    }
}
