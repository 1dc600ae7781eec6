//! The first samples, and an orientation in them -> what a sample means. Pure.

use super::FEW;
use super::is_causal;
use crate::condition::choose_clock_as;
use crate::diagnostic::Diagnostic;
use crate::digits::significant;
use crate::estimate::meaning::Meaning;
use crate::estimate::orientation_lag::LagPass;
use crate::estimate::plan::EstimationSettings;
use crate::estimate::sample_kind::{KindChoice, KindReason, STEPS_LIVE};
use crate::record::RawSample;
use crate::setting::SENSOR_DELAY;

/// Decides what a sample means, where nothing states it: by an orientation in the same samples, or by the ordinary step
/// of the `first`.
pub(super) fn decide_kind(
    (plan, resolved): (&EstimationSettings, &Meaning),
    first: &[RawSample],
    lag: Option<LagPass>,
    warnings: &mut Vec<Diagnostic>,
) -> KindChoice {
    if !resolved.is_kind_open() {
        return resolved.kind_choice();
    }
    if let Some(choice) = lag.and_then(|pass| pass.choice()) {
        let of_filter = match choice.reason {
            KindReason::Orientation(lag) => lag.of_filter(),
            _ => None,
        };
        if let Some(secs) = of_filter.filter(|_| plan.sensor_delay_secs == 0.0) {
            let setting = SENSOR_DELAY.to(significant(secs, 2));
            warnings.push(
                Diagnostic::new(format!(
                    "the rates are {} ms later than the recorded orientation, beside what samples of kind {} explain",
                    significant(secs * 1e3, 2),
                    choice.kind.name()
                ))
                .help(format!("{setting} puts the attitude where that orientation is")),
            );
        }
        return choice;
    }
    let (clock, _) = choose_clock_as(first, plan.clock, plan.stamps);
    // As a daemon, which has no more steps.
    let most = match is_causal(plan) {
        true => STEPS_LIVE,
        false => FEW,
    };
    resolved.settled_by(first, clock, most).kind_choice()
}
