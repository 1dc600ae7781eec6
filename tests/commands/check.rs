//! Promise: `strapd check` finds what is wrong with a log, invents nothing, and its advice helps.

mod advice;
mod counts;
mod faults;
mod forces_elsewhere;
mod judged;
mod many;
mod mixed;
mod orientation;
mod recordings;
mod set_clocks;

use std::path::Path;
use strapd::pipeline::check::{Examination, examine};
use strapd::pipeline::opening;
use strapd::report::findings::{Finding, Severity, findings};
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::setting::Choice;
use strapd_recording::Selection;
use strapd_recording::pool::Pool;

/// Findings of the gyro alone, unless a test asks for more: that it is alone is none of them.
fn found(path: &Path) -> Vec<Finding> {
    let pool = Pool::new(2).unwrap();
    let asked = Examination {
        selection: Selection::default(),
        plan: EstimationSettings::default(),
        reference_topic: String::new(),
        drawing: None,
        command: String::new(),
    };
    let input = opening::open(path).unwrap();
    let mut found = findings(&examine(&input, &asked, &pool, &mut |_| {}).unwrap());
    found.retain(|finding| finding.code != "gyro-alone");
    found
}

/// Advice as the command's flags: here nobody has named settings.
pub(crate) fn flags(finding: &Finding) -> String {
    let sets = finding.help.iter().map(|set| {
        let flag = |choice: &Choice| {
            let flag = format!(
                "--{} {}",
                choice.setting.name().replace('_', "-"),
                choice.value
            );
            flag.trim_end().to_owned()
        };
        set.iter().map(flag).collect::<Vec<_>>().join(" ")
    });
    sets.collect::<Vec<_>>().join(", or ")
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
