//! State of a replay's estimator so far -> its fields of `STATUS`. Pure.
//!
//! A copy: the run itself may be waiting for its time, or for somebody to go on.

use crate::report::aid::FilterSummary;
use crate::serve::core::stream::attitude_now::attitude_now;
use serde_json::{Map, Value, json};
use strapd_attitude::aid::Filter;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::propagate::Method;
use strapd_attitude::record::{AttitudeSample, Counts, Verdict};

/// Health of a stream's samples and attitude.
#[derive(Clone, Debug)]
pub(in crate::serve) struct Health {
    counts: Counts,
    gaps: u64,
    not_bridged: u64,
    /// Missing samples by the ordinary step: the numbers of a sender are in no recording.
    missing: u64,
    spacing_nanos: Option<i64>,
    method: Method,
    filter: Option<Filter>,
}

impl Health {
    pub(in crate::serve) fn of(estimator: &Estimator) -> Health {
        let report = estimator.conditioning();
        Health {
            counts: report.counts,
            gaps: report.gaps.count,
            not_bridged: report.gaps.not_bridged,
            missing: report.gaps.missing,
            spacing_nanos: report.spacing_nanos,
            method: estimator.method(),
            filter: estimator.filter().cloned(),
        }
    }

    /// The same beside what else is told of the stream, which comes first where both tell something.
    pub(in crate::serve) fn beside(&self, own: Value, last: Option<&AttitudeSample>) -> Value {
        let filter = self.filter.as_ref();
        let mut fields = json!({
            "samples": self.counts.total(),
            "lost": self.counts.lost(),
            "missing": self.missing,
            "counts": counted(&self.counts),
            "gaps": self.gaps,
            "not_bridged": self.not_bridged,
            "rate_hz": rate_hz(self.spacing_nanos),
            "method": self.method.name(),
            "aid": filter.map(|filter| FilterSummary::of(filter).json()),
            "attitude": attitude_now(filter, last),
        });
        if let (Some(fields), Value::Object(own)) = (fields.as_object_mut(), own) {
            fields.extend(own);
        }
        fields
    }
}

/// Outcomes of samples, by the names of the verdicts that there were.
fn counted(counts: &Counts) -> Map<String, Value> {
    Verdict::ALL
        .into_iter()
        .filter(|verdict| counts.get(*verdict) > 0)
        .map(|verdict| (verdict.name().to_owned(), counts.get(verdict).into()))
        .collect()
}

/// Samples a second, by the ordinary step.
fn rate_hz(spacing_nanos: Option<i64>) -> Option<f64> {
    spacing_nanos.filter(|n| *n > 0).map(|n| 1e9 / n as f64)
}
