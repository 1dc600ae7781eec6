//! Finding -> the settings that cure it, where they are certain. Pure.

use super::{Finding, Severity};
use strapd_attitude::setting::{Choice, MEND};

/// The cure of a finding, where it has exactly one.
pub(crate) fn cure(finding: &Finding) -> Option<&[Choice]> {
    let is_certain = finding.severity == Severity::Error && finding.is_misread();
    let of_mending = |set: &&Vec<Choice>| set.iter().all(|choice| choice.setting != MEND);
    let mut cures = finding.help.iter().filter(of_mending);
    match (cures.next(), cures.next()) {
        (Some(cure), None) if is_certain => Some(cure),
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
