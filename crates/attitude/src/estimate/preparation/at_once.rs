//! The first sample of a live stream -> clock, bias, initial attitude, without waiting. Pure.
//!
//! Apart from the preparation by many samples because nothing here may look ahead: what only rest tells begins unknown.

use super::super::aiding::Aiding;
use super::super::class_pass;
use super::super::meaning::Meaning;
use super::super::plan::{Bias, EstimationSettings};
use super::super::stamps::Stamps;
use super::bias::decide_bias;
use super::initial::{Earth, decide_initial};
use super::rates::decide_truncation;
use super::{Prepared, learned_on_the_way, needs_rest};
use crate::condition::stillness::Rests;
use crate::diagnostic::Diagnostic;
use crate::frames::In;
use crate::record::RawSample;
use crate::setting::{AID, BIAS, INIT};
use nalgebra::Vector3;

/// Decides from the first sample alone, for a live stream: its attitude must not wait. `together` are those that came
/// with it, which tell whether specific forces come in messages of their own. The clock is the one asked for, and
/// another never takes its place. What only rest tells begins level, without a bias, where a filter learns the rest.
///
/// # Errors
/// In words: what only rest can tell was asked for of a gyro alone, or the sample carries no orientation to begin with.
pub fn at_once(
    plan: &EstimationSettings,
    resolved: &Meaning,
    together: &[RawSample],
) -> Result<Prepared, Diagnostic> {
    let asked = plan;
    let is_force = |raw: &RawSample| raw.is_beside && raw.accel.is_some();
    let first = together.iter().find(|raw| !raw.is_beside);
    let first = &first.copied().unwrap_or_default();
    let plan = &EstimationSettings {
        has_forces_beside: asked.has_forces_beside
            || (first.accel.is_none() && together.iter().any(is_force)),
        ..learned_on_the_way(asked)
    };
    let rests = Rests::default();
    let mut warnings = Vec::new();
    let first_alone = std::slice::from_ref(first);
    let aiding = Aiding::decide(plan, resolved, first_alone, &mut warnings)?;
    if aiding.is_none() && needs_rest(asked) {
        return Err(
            Diagnostic::new(format!(
                "{BIAS} auto and {INIT} gravity: without a specific force that corrects it the attitude needs to be found at rest beforehand, and a live stream waits for nothing"
            ))
            .help(format!(
                "{AID} gravity with a sensor that carries `accel` learns both on the way; else measure once (`strapd info LOG` shows the bias) and give {BIAS} x,y,z; {INIT} rpy=roll,pitch,yaw or identity"
            ))
        );
    }
    let (initial, initial_origin, world) = decide_initial(
        (plan, aiding.as_ref()),
        resolved,
        first_alone,
        &rests,
        &mut warnings,
    )?;
    let earth = plan.latitude_deg.map(|deg| Earth::at(deg.to_radians()));
    let (bias, bias_sigma, mut bias_origin) =
        decide_bias((plan, resolved), &rests, earth.map(|e| e.felt_by(&initial)))?;
    if asked.bias == Bias::Auto && resolved.calibrated_bias(&plan.noise).is_none() {
        "none to begin with, learned on the way".clone_into(&mut bias_origin);
    }
    warnings.extend(earth.and_then(|e| e.heading_warning(plan.initial)));
    let stamps = if plan.regularise_stamps {
        Stamps::Causal {
            states_interval: first.interval_nanos.is_some(),
        }
    } else {
        Stamps::AsRecorded
    };
    Ok(Prepared {
        sample_kind: resolved.kind_choice(),
        has_arrival: false,
        is_class_open: class_pass::is_open(plan),
        has_temperature: together.iter().any(|raw| raw.temperature.is_some()),
        batches: None,
        coarse: None,
        noise: plan.noise.taken(),
        aiding,
        truncation_step: decide_truncation(plan, None, &mut warnings)?,
        gyro_range: plan.gyro_range,
        clock: plan.clock,
        bias,
        bias_sigma,
        bias_origin,
        bias_left: plan.bias.left(),
        initial,
        initial_origin,
        tilt_sigma: 0.0,
        world_rate: earth.map_or_else(|| In::assume(Vector3::zeros()), |e| e.w_ie),
        world,
        stamps,
        warnings,
    })
}
