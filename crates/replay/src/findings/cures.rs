//! Finding -> the settings that cure it, where they are certain. Pure.

use super::{Finding, Severity};
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::estimate::settings::{Value, row};
use strapd_attitude::setting::{Choice, MEND};

/// The cure of a finding, where it has exactly one.
pub(crate) fn cure(finding: &Finding) -> Option<&[Choice]> {
    let is_certain = finding.severity == Severity::Error && finding.is_misread();
    let of_mending = |set: &&Vec<Choice>| set.iter().all(|choice| choice.setting != MEND);
    // A word in place of a value is no cure.
    let is_set = |choice: &Choice| {
        let mut trial = EstimationSettings::default();
        let row = row(choice.setting.name());
        row.is_some_and(|row| row.apply(&mut trial, &Value::Text(&choice.value)).is_ok())
    };
    let mut cures = finding.help.iter().filter(of_mending);
    match (cures.next(), cures.next()) {
        (Some(cure), None) if is_certain && cure.iter().all(is_set) => Some(cure),
        _ => None,
    }
}

/// Names mending as a way where there is a cure.
pub(super) fn offer(found: &mut [Finding]) {
    for finding in found {
        if cure(finding).is_some() {
            finding.help.push(vec![MEND.into()]);
        }
    }
}
