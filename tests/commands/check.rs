//! Promise: `strapd check` finds what is wrong with a log, invents nothing, and its advice helps.

mod faults;
mod many;
mod orientation;
mod recordings;

use std::path::Path;
use strapd::pipeline::check::check;
use strapd::pipeline::logged;
use strapd::report::findings::{Finding, Severity, findings};
use strapd_recording::decode::Options;
use strapd_recording::pool::Pool;

fn found(path: &Path) -> Vec<Finding> {
    let pool = Pool::new(2).unwrap();
    findings(
        &check(
            &logged::open(path).unwrap(),
            None,
            &Options::default(),
            &pool,
        )
        .unwrap(),
    )
}

/// The codes of errors and warnings, each once, sorted.
fn codes(found: &[Finding]) -> Vec<&'static str> {
    let mut codes: Vec<_> = found
        .iter()
        .filter(|f| f.severity > Severity::Note)
        .map(|f| f.code)
        .collect();
    codes.sort_unstable();
    codes.dedup();
    codes
}

fn notes(found: &[Finding]) -> Vec<&'static str> {
    let is_note = |f: &&Finding| f.severity == Severity::Note;
    found.iter().filter(is_note).map(|f| f.code).collect()
}
