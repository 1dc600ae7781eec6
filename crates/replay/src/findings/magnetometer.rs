//! Gyro held against magnetometer -> findings: axes, with the map that cures them, and iron. Pure.
//!
//! Apart from gyro and accelerometer because the answer is another: a field has iron, which a calibration takes out, and a
//! mirror that no rotation of the body shows. What is measured is in `strapd_attitude::consistency`.

use super::{Finding, Severity};
use crate::summary::significant;
use nalgebra::Matrix3;
use strapd_attitude::consistency::{FieldConsistency, FieldDisagreement, FieldIron};
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_attitude::frames::AxisMap;
use strapd_attitude::setting::{AID, CALIBRATION, MAG_AXES};

/// Every axis reversed.
const MIRROR: &str = "xyz";
/// Elevation of the field, rad, from which on it tells the hemisphere.
const STEEP: f64 = 0.35;
/// Error of the heading, rad, from which on iron is worth a warning.
const LARGE: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// Hard iron below so many sigmas is none.
const SIGMAS: f64 = 5.0;

/// Finding about the magnetometer of a stream: its axes, and where those agree its iron.
pub(super) fn finding(field: &FieldConsistency, plan: &EstimationSettings) -> Option<Finding> {
    let mut found = match field.disagreement() {
        Some(found) => axes(&found, plan),
        None => iron(&field.iron()?, plan)?,
    };
    if plan.aid != Aid::GravityAndField {
        // No heading is taken from it, so no attitude is wrong; the settings that cure it belong to one that is.
        found.severity = found.severity.min(Severity::Warning);
        let aided = AID.to("gravity+mag");
        found
            .help
            .iter_mut()
            .for_each(|set| set.insert(0, aided.clone()));
    }
    Some(found)
}

fn axes(found: &FieldDisagreement, plan: &EstimationSettings) -> Finding {
    let map = found.map.after(plan.mag_axes);
    let mirrored = MIRROR
        .parse::<AxisMap>()
        .map_or(map, |mirror| mirror.after(map));
    let names = found.map.to_string();
    let of: Vec<String> = ["x", "y", "z"]
        .into_iter()
        .zip(names.chars())
        .filter(|(axis, letter)| {
            !axis.eq_ignore_ascii_case(&letter.to_string()) || letter.is_lowercase()
        })
        .map(|(axis, letter)| {
            let sign = if letter.is_lowercase() { "-" } else { "" };
            format!(
                "along {axis} is the recorded {sign}{}",
                letter.to_ascii_lowercase()
            )
        })
        .collect();
    let tried = format!(
        "the field wanders by {} % as recorded, by {} % with the axes mapped",
        significant(100.0 * found.recorded, 2),
        significant(100.0 * found.cured, 1)
    );
    let finding = Finding::new(
        Severity::Error,
        "mag-axes",
        format!(
            "gyro and magnetometer disagree about the axes: the true field {}",
            of.join(", ")
        ),
    )
    .with("map", names)
    .with("scatter", found.recorded)
    .with("scatter_cured", found.cured)
    .with("segments", found.segments);
    // A mirror turns like its opposite: which of them it is, the hemisphere says.
    match found.elevation {
        Some(elevation) if elevation < -STEEP => finding
            .with("elevation_deg", elevation.to_degrees())
            .advise(format!(
                "{tried}; it points down then, as north of the equator"
            ))
            .help([MAG_AXES.to(map)]),
        Some(elevation) if elevation > STEEP => finding
            .with("elevation_deg", elevation.to_degrees())
            .advise(format!(
                "{tried}; {mirrored} where it points down (north of the equator), {map} south of it"
            ))
            .help([MAG_AXES.to(mirrored)])
            .help([MAG_AXES.to(map)]),
        _ => finding
            .advise(format!(
                "{tried}, and as well by {mirrored}, which reverses the heading"
            ))
            .help([MAG_AXES.to(map)])
            .help([MAG_AXES.to(mirrored)]),
    }
}

fn iron(found: &FieldIron, plan: &EstimationSettings) -> Option<Finding> {
    if !found.is_observed() {
        return None;
    }
    let hard = found.offset.norm();
    let is_hard = hard > SIGMAS * found.offset_sigma.norm();
    // The largest share by which it changes a field of any direction.
    let soft = (found.matrix - Matrix3::identity()).singular_values().max();
    let is_soft = found.has_soft_iron();
    let learns_hard = plan.mag_hard_iron > 0.0;
    let part = |is: bool, share: f64| if is { share } else { 0.0 };
    let off = part(is_hard && !learns_hard, hard / found.length) + part(is_soft, soft);
    let horizontal = found.elevation.unwrap_or_default().cos().max(1e-3);
    let worst = (off / horizontal).min(1.0).asin();
    if worst < LARGE {
        return None;
    }
    let mut what = Vec::new();
    if is_hard {
        what.push(format!(
            "hard iron of {} % of the field",
            significant(100.0 * hard / found.length, 2)
        ));
    }
    if is_soft {
        what.push(format!("soft iron of {} %", significant(100.0 * soft, 2)));
    }
    Some(
        Finding::new(
            Severity::Warning,
            "mag-iron",
            format!(
                "the magnetometer is not calibrated: {} turns the heading by up to {:.0} deg",
                what.join(" and "),
                worst.to_degrees()
            ),
        )
        .with("hard_iron", found.offset.as_slice().to_vec())
        .with("hard_iron_share", hard / found.length)
        .with("soft_iron_share", if is_soft { soft } else { 0.0 })
        .with("heading_deg", worst.to_degrees())
        .advise("calibrate it with its field, by this recording or by two minutes of rotating it every way")
        .help([CALIBRATION.to("FILE.toml")]),
    )
}

#[cfg(test)]
mod tests;
