//! Rests of a file, or what was said -> the bias that is removed. Pure.
//!
//! Apart from the rest of the preparation because a bias nobody stated has rules of its own: only a file that is aided is
//! looked through for it, and a slow steady turn is none.

use super::{Patience, is_live};
use crate::condition::stillness::{self, Limits, NoRest, Rests};
use crate::diagnostic::Diagnostic;
use crate::estimate::meaning::Meaning;
use crate::estimate::plan::{Aid, Bias, EstimationSettings};
use crate::quaternion::BodyRate;
use crate::setting::{BIAS, EARTH_RATE, START};
use nalgebra::Vector3;

/// Whether nobody has said the bias of a file that is aided, and a rest would tell it better than its class. With the
/// Earth's rotation taken out it is the rest at the start alone that could, and on the way the filter learns as much.
pub(super) fn looks_for_bias(
    plan: &EstimationSettings,
    resolved: &Meaning,
    patience: Patience,
) -> bool {
    plan.bias == Bias::Unsaid
        && plan.aid != Aid::None
        && patience == Patience::WholeLog
        && !is_live(plan.method)
        && plan.latitude_deg.is_none()
        && resolved.calibrated_bias(&plan.noise).is_none()
        && Bias::Auto.left() < Some(plan.noise.bias_of_class())
}

/// The plan with the bias of a file's rests, if they tell it, those that do, and what to say of the others.
pub(super) fn with_bias_of_rest(
    plan: EstimationSettings,
    rests: &Rests,
) -> (EstimationSettings, Rests, Option<Diagnostic>) {
    let (rests, turn) = rests.less_turns(plan.noise.bias_of_class());
    let bias = match stillness::estimate_bias(&rests, &Limits::default()) {
        Ok(_) => Bias::Auto,
        Err(_) => Bias::None,
    };
    (EstimationSettings { bias, ..plan }, rests, turn)
}

/// Returns the bias that is removed, rad/s, its sigma and its origin in words. `earth` is what the gyro feels of the Earth's rotation at the initial attitude, rad/s, where that is
/// taken out: then it is no bias, and only a rest at the start, where the attitude is known, can tell
/// the two apart.
pub(super) fn decide_bias(
    (plan, resolved): (&EstimationSettings, &Meaning),
    rests: &Rests,
    earth: Option<Vector3<f64>>,
) -> Result<(BodyRate, Vector3<f64>, String), Diagnostic> {
    match plan.bias {
        Bias::Unsaid | Bias::None => Ok(match resolved.calibrated_bias(&plan.noise) {
            Some((bias, sigma)) => (BodyRate(bias), sigma, "as calibrated".to_owned()),
            None => (
                BodyRate::ZERO,
                plan.noise.unremoved_bias().into(),
                "none".to_owned(),
            ),
        }),
        Bias::Given(bias) => Ok((
            bias,
            plan.noise.unstable_bias().into(),
            "as given".to_owned(),
        )),
        Bias::Auto => {
            let limits = Limits::default();
            let refuse = |e: NoRest| Diagnostic::from(&e).at(format_args!("{BIAS} auto"));
            let mut estimate = stillness::estimate_bias(rests, &limits).map_err(refuse)?;
            let mut earths = "";
            if let Some(earth) = earth {
                let first = stillness::rest_at_start(rests, &limits)
                    .map_err(|e| not_at_start(&e))?
                    .alone();
                estimate = stillness::estimate_bias(&first, &limits).map_err(refuse)?;
                estimate.bias.0 -= earth;
                earths = " at the start, less the Earth's rate";
            }
            let sigma = estimate.sigma.max();
            // Known to the estimate's sigma at rest, and not stable since.
            let instability = Vector3::from(plan.noise.unstable_bias());
            Ok((
                estimate.bias,
                estimate.sigma.zip_map(&instability, f64::hypot),
                format!(
                    "from {:.1} s of rest{earths}, +- {sigma:.1e} rad/s",
                    estimate.secs
                ),
            ))
        }
    }
}

/// Refusal of a bias by a rest that is not at the start, where the rotation of the Earth is taken out.
fn not_at_start(why: &NoRest) -> Diagnostic {
    let why = Diagnostic::from(why);
    let why = why.what();
    Diagnostic::new(format!(
        "{BIAS} auto with {EARTH_RATE}: {why}; only at the start is the attitude known, and without it a bias and the Earth's rotation are the same"
    ))
    .help(format!(
        "{START} SECS begins at a rest, {BIAS} x,y,z (rad/s) gives the bias"
    ))
}
