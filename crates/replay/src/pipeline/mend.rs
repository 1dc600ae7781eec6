//! Settings -> the same with the cures that a recording agrees with. Pure but for the trials.
//!
//! A stage of its own because it is the only one that changes what was asked for: it does where [`MEND`](strapd_attitude::setting::MEND) is set, with
//! cures that are certain (one, with its value) and that were tried on the whole recording. One that leaves the finding,
//! or brings another error, is not applied.

use crate::finding::{Finding, Severity};
use crate::findings::cure;
use strapd_attitude::estimate::settings::{Value, row};
use strapd_attitude::estimate::{EstimationSettings, Mended};

/// Cures, one after the other: a magnetometer is judged by a gyro that is right.
const MOST: usize = 3;

/// The settings to run with. `trial` returns the findings of a run with others; `None` where there is not one sensor
/// alone.
///
/// # Errors
/// Those of the first trial.
pub(super) fn settled<E>(
    asked: &EstimationSettings,
    mut trial: impl FnMut(&EstimationSettings) -> Result<Option<Vec<Finding>>, E>,
) -> Result<EstimationSettings, E> {
    let mut plan = asked.clone();
    if !asked.mend {
        return Ok(plan);
    }
    let Some(mut findings) = trial(&plan)? else {
        return Ok(plan);
    };
    for _ in 0..MOST {
        let Some((finding, next)) = findings.iter().find_map(|f| Some((f, cured(&plan, f)?)))
        else {
            break;
        };
        let Ok(Some(after)) = trial(&next) else { break };
        if !is_better(&findings, &after, finding.code) {
            break;
        }
        (plan, findings) = (next, after);
    }
    Ok(plan)
}

fn cured(plan: &EstimationSettings, finding: &Finding) -> Option<EstimationSettings> {
    let settings = cure(finding)?;
    let mut next = plan.clone();
    for choice in settings {
        let row = row(choice.setting.name())?;
        row.apply(&mut next, &Value::Text(&choice.value)).ok()?;
    }
    next.mended.push(Mended {
        what: finding.what.clone(),
        settings: settings.to_vec(),
    });
    Some(next)
}

fn is_better(before: &[Finding], after: &[Finding], code: &str) -> bool {
    let errors = |found: &[Finding]| {
        let errors = found.iter().filter(|f| f.severity == Severity::Error);
        errors.count()
    };
    after.iter().all(|f| f.code != code) && errors(after) < errors(before)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use strapd_attitude::setting::{GYRO_AXES, GYRO_SCALE, MEND};

    fn error(code: &'static str) -> Finding {
        Finding::new(Severity::Error, code, "what")
    }

    fn asked() -> EstimationSettings {
        EstimationSettings {
            mend: true,
            ..EstimationSettings::default()
        }
    }

    #[test]
    fn a_cure_is_applied_where_the_trial_agrees_and_nowhere_else() {
        let axes = || error("gyro-axes").help([GYRO_AXES.to("yXZ")]).help([MEND]);
        let wrong = |plan: &EstimationSettings| plan.gyro_axes == asked().gyro_axes;
        let helps = |plan: &EstimationSettings| -> Result<_, ()> {
            Ok(Some(if wrong(plan) {
                vec![axes()]
            } else {
                Vec::new()
            }))
        };
        let plan = settled(&asked(), helps).unwrap();
        assert_eq!(plan.gyro_axes.to_string(), "yXZ");
        assert_eq!(plan.mended.len(), 1);
        let leaves = |_: &EstimationSettings| -> Result<_, ()> { Ok(Some(vec![axes()])) };
        let brings = |plan: &EstimationSettings| -> Result<_, ()> {
            let other = if wrong(plan) {
                axes()
            } else {
                error("gyro-scale")
            };
            Ok(Some(vec![other]))
        };
        for plan in [settled(&asked(), leaves), settled(&asked(), brings)] {
            assert!(plan.unwrap().mended.is_empty());
        }
        let unasked = settled(&EstimationSettings::default(), helps).unwrap();
        assert!(unasked.mended.is_empty());
    }

    #[test]
    fn of_two_cures_none_is_applied_and_a_warning_is_not_certain() {
        let two = error("gyro-scale")
            .help([GYRO_SCALE.to("0.5")])
            .help([GYRO_SCALE.to("0.51")]);
        assert_eq!(cure(&two), None);
        let warning =
            Finding::new(Severity::Warning, "gyro-axes", "what").help([GYRO_AXES.to("yXZ")]);
        assert_eq!(cure(&warning), None);
        assert_eq!(cure(&error("saturated").help([GYRO_SCALE.to("2")])), None);
    }
}
