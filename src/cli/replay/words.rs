//! Summaries of a replay -> what is printed of them: text, the warnings alone, JSON. I/O.
//!
//! Apart from the run because the run is the same whatever is printed of it.

use super::Replay;
use crate::cli::{Global, print};
use crate::error::Result;
use crate::report::summary::RunSummary;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use strapd_recording::Source;

impl Replay {
    /// Prints the text summary: on stdout, or on stderr when the data or JSON is there.
    pub(super) fn say(&self, global: &Global, summary: &RunSummary) -> Result<()> {
        if global.quiet {
            say_warnings(summary);
            return Ok(());
        }
        let text = match global.verbose {
            0 => format!("{}{}", summary.brief(), next(summary, self.join)),
            _ => summary.text(),
        };
        if global.json || self.writes_stdout() {
            // A stderr that is gone leaves nobody to tell.
            let _ = std::io::stderr().write_all(text.as_bytes());
            return Ok(());
        }
        print(&text)
    }
}

const NOTHING_NEXT: &str = "  next     -v prints all of this summary\n";

/// Line about what to do next.
fn next(summary: &RunSummary, is_joined: bool) -> String {
    if Path::new(&summary.source) == Source::Stdin.name() {
        // It is gone: there is nothing that a command could read again.
        return NOTHING_NEXT.to_owned();
    }
    // No other command takes several files as one recording.
    if is_joined {
        return NOTHING_NEXT.to_owned();
    }
    let log = strapd_replay::shell::quoted(OsString::from(&summary.source));
    let has_more = summary.is_lossy() || summary.topics.iter().any(|t| !t.warnings().is_empty());
    match has_more {
        true => format!(
            "  next     strapd check {log}  (what is wrong and what helps; -v prints all of this summary)\n"
        ),
        false => format!(
            "  next     strapd report {log} -o report.html  (pictures; -v prints all of this summary)\n"
        ),
    }
}

/// Prints what `--quiet` leaves: why the exit code is 3, and the warnings.
fn say_warnings(summary: &RunSummary) {
    let source = &summary.source;
    for topic in &summary.topics {
        let lost = topic.counts.lost();
        if lost > 0 {
            let total = topic.counts.total();
            tracing::warn!("{source}: {}: lost {lost} of {total} samples", topic.topic);
        }
        let breaks = topic.gaps.held + topic.gaps.resets;
        if breaks > 0 {
            tracing::warn!(
                "{source}: {}: {breaks} gaps were not integrated over, {:.3} s in all",
                topic.topic,
                topic.gaps.held_secs
            );
        }
        for warning in topic.warnings() {
            tracing::warn!("{source}: {}: {warning}", topic.topic);
        }
    }
    for problem in &summary.file_problems {
        tracing::warn!("{source}: {problem}");
    }
}

/// Prints one object for one log, an array for several.
pub(super) fn say_json(is_of_one: bool, summaries: &[RunSummary]) -> Result<()> {
    let value = match summaries {
        [one] if is_of_one => one.json(),
        many => many.iter().map(RunSummary::json).collect(),
    };
    print(&format!("{value}\n"))
}
