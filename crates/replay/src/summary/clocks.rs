//! Wraps and steps of the clock behind the stamps -> their text, their JSON, their finding. Pure.
//!
//! Apart from the topic's summary because `check` says the same of a log that is not replayed.

use super::rows::Row;
use super::significant;
use crate::finding::{Finding, Severity};
use serde_json::json;
use strapd_attitude::condition::{ClockSet, Wraps};
use strapd_attitude::record::Nanos;
use strapd_attitude::setting::STAMPS;

/// Note about the counter behind the stamps of a live sensor, which has no summary.
pub(crate) fn counter_wraps(wraps: Wraps) -> Finding {
    let times = match wraps.count {
        1 => "1 wrap".to_owned(),
        n => format!("{n} wraps"),
    };
    Finding::new(
        Severity::Note,
        "counter-wraps",
        format!("{}: {times}, continued", wraps.period),
    )
    .with("count", wraps.count)
    .with("period_s", wraps.period.nanos as f64 * 1e-9)
    .advise("nothing is lost by it")
}

/// Row of the wraps of a counter; `span` is the first and the last stamp.
pub(super) fn wraps_row(wraps: Option<Wraps>, span: Option<(Nanos, Nanos)>) -> Row {
    let json = |wraps: Wraps| {
        json!({
            "count": wraps.count,
            "period_s": wraps.period.nanos as f64 * 1e-9,
            "first_ns": wraps.first.0,
        })
    };
    let text = |wraps: Wraps| {
        let times = match wraps.count {
            1 => "1 wrap at".to_owned(),
            n => format!("{n} wraps, the first at"),
        };
        let start = span.map_or(wraps.first, |(first, _)| first);
        let at = wraps.first.secs_since(start);
        format!("{}: {times} {at:.1} s, continued", wraps.period)
    };
    Row::value("counter_wraps", wraps.map(json)).told("stamps", wraps.map(text))
}

/// Row of the steps of a clock, which the warning tells.
pub(super) fn clock_set_row(set: Option<ClockSet>) -> Row {
    let json = |set: ClockSet| {
        json!({
            "count": set.count,
            "largest_s": set.largest_nanos as f64 * 1e-9,
            "first_ns": set.first.0,
        })
    };
    Row::value("clock_set", set.map(json))
}

/// Warning of a stamp clock that was set while the recorder's went on.
pub(crate) fn clock_was_set(set: ClockSet) -> Finding {
    let largest = significant(set.largest_nanos.unsigned_abs() as f64 * 1e-9, 3);
    let way = if set.largest_nanos < 0 {
        "back"
    } else {
        "ahead"
    };
    let times = match set.count {
        1 => format!("once, by {largest} s {way}"),
        n => format!("{n} times, by up to {largest} s {way}"),
    };
    Finding::new(
        Severity::Warning,
        "clock-set",
        format!("the stamp clock was set {times}, while the recorder's clock went on"),
    )
    .with("count", set.count)
    .with("largest_s", set.largest_nanos as f64 * 1e-9)
    .with("first_ns", set.first.0)
    .advise("the steps are taken off: no time is missing there; keep them if the stamps are right")
    .help([STAMPS.to("as-recorded")])
}
