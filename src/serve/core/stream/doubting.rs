//! A sensor's samples and counts -> its findings, for `STATUS` and the log. Pure.
//!
//! Apart from what is found because that is saved, too, and knows no stream.

use super::SensorStream;
use super::doubts::rank;
use crate::report::findings::{Finding, Severity, of_sensor};
use std::collections::BTreeSet;
use strapd_attitude::estimate::EstimationSettings;

/// Samples after which the counts are judged again.
const EVERY: u64 = 256;
/// Codes of steps that are too long, which stamps in another unit make.
const OF_STEPS: [&str; 3] = ["gap-held", "under-sampled", "large-turn-per-step"];

/// Findings from counts, as far as they are in the log of a run.
#[derive(Debug, Default)]
pub(super) struct Logged {
    codes: BTreeSet<&'static str>,
    /// Samples when they were judged last, and whether there were steps not integrated, and steps that turn too far.
    judged: (u64, [bool; 2]),
}

/// Line for the log.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LogLine {
    /// Name under which it is said once in a while.
    pub cause: String,
    /// Text.
    pub text: String,
}

impl SensorStream {
    /// Judges the samples so far, and returns lines for the log, each once a run. `plan` is that of
    /// [`SensorStream::new`].
    pub fn doubted(&mut self, plan: &EstimationSettings) -> Vec<LogLine> {
        let mut news = self.news_of_counts();
        let last = self.conditioning().last;
        let (Some(doubts), Some(last)) = (&mut self.doubts, last) else {
            return news;
        };
        doubts.judge(last, &self.estimator, plan);
        news.extend(doubts.news().into_iter().map(|text| LogLine {
            cause: text.clone(),
            text,
        }));
        news
    }

    /// Lines of findings from counts that are not in the log. A first gap is said at once, unless a few samples more
    /// tell why.
    fn news_of_counts(&mut self) -> Vec<LogLine> {
        let report = self.conditioning();
        let propagation = self.estimator.propagation();
        let broken = [report.gaps.not_bridged > 0, propagation.undersampled > 0];
        let samples = report.counts.total();
        let (before, was_broken) = self.logged.judged;
        let is_due = broken != was_broken || samples >= before.saturating_add(EVERY);
        if !is_due || self.pace.is_open() {
            return Vec::new();
        }
        self.logged.judged = (samples, broken);
        let found = self.of_counts();
        let is_new = |finding: &&Finding| {
            finding.severity > Severity::Note && !self.logged.codes.contains(finding.code)
        };
        let new: Vec<&Finding> = found.iter().filter(is_new).collect();
        self.logged
            .codes
            .extend(new.iter().map(|finding| finding.code));
        let line = |finding: &&Finding| LogLine {
            cause: finding.code.to_owned(),
            text: finding.line(),
        };
        new.iter().map(line).collect()
    }

    /// Findings from what is counted, with the unit that the stamps look like where their steps are too long.
    fn of_counts(&self) -> Vec<Finding> {
        let (report, clock) = (self.conditioning(), self.prepared.clock.name());
        let mut found = of_sensor(report, &self.estimator.propagation(), clock);
        let stated = self.stamp_unit.stated().or(self.stamps.unit());
        if let Some(advice) = self.pace.advice(stated) {
            let of_steps = found.iter_mut().filter(|f| OF_STEPS.contains(&f.code));
            for finding in of_steps {
                finding.advice.clone_from(&advice);
                finding.help.clear();
            }
        }
        found
    }

    /// Findings as `STATUS` has them, the worst first.
    #[must_use]
    pub fn findings(&self) -> Vec<serde_json::Value> {
        let mut found = self.of_counts();
        found.extend(self.stamp_unit.finding());
        found.extend(self.still_stamps.finding());
        let mut found: Vec<_> = found.iter().map(Finding::json).collect();
        found.extend(self.doubts.iter().flat_map(|doubts| doubts.findings()));
        found.sort_by_key(rank);
        found
    }
}
