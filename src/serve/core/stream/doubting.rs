//! A sensor's samples and counts -> its findings, for `STATUS` and the log. Pure.
//!
//! Apart from what is found because that is saved, too, and knows no stream.

use super::SensorStream;
use super::doubts::rank;
use crate::report::findings::{Finding, of_sensor};
use strapd_attitude::estimate::EstimationSettings;

impl SensorStream {
    /// Judges the samples so far, and returns lines for the log, each once. `plan` is that of [`SensorStream::new`].
    pub fn doubted(&mut self, plan: &EstimationSettings) -> Vec<String> {
        let last = self.conditioning().last;
        let (Some(doubts), Some(last)) = (&mut self.doubts, last) else {
            return Vec::new();
        };
        doubts.judge(last, &self.estimator, plan);
        doubts.news()
    }

    /// Findings as `STATUS` has them, the worst first.
    #[must_use]
    pub fn findings(&self) -> Vec<serde_json::Value> {
        let (report, clock) = (self.conditioning(), self.prepared.clock.name());
        let mut found = of_sensor(report, &self.estimator.propagation(), clock);
        found.extend(self.stamp_unit.finding());
        found.extend(self.still_stamps.finding());
        let mut found: Vec<_> = found.iter().map(Finding::json).collect();
        found.extend(self.doubts.iter().flat_map(|doubts| doubts.findings()));
        found.sort_by_key(rank);
        found
    }
}
