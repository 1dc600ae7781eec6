//! Gravity as the accelerometer shows it -> findings about units, axes and mounting. Pure.

use super::{Finding, Seen, Severity, is_fast};
use crate::inspection::Inspection;
use crate::summary::significant;
use nalgebra::{Vector3, Vector4};
use serde_json::json;
use strapd_attitude::condition::GyroUnit;
use strapd_attitude::condition::quality::GravityAxis;
use strapd_attitude::consistency::CHIPS;
use strapd_attitude::frames::BodyAxes;
use strapd_attitude::setting::{
    ACCEL_SIGN, ACCEL_TOPIC, AID, BODY, COLUMNS, GYRO_SCALE, GYRO_UNIT, MOUNT,
};
use strapd_recording::format::Format;
use strapd_recording::recording::beside::forces_elsewhere;
use strapd_recording::text::printable;

/// Below this correlation the accelerometer reads too much besides gravity.
const MIN_CORRELATION: f64 = 0.7;
/// Factors within 2.5 of a unit's belong to it; accelerations make them vary.
const UNIT_FACTOR: f64 = 2.5;
/// Correlation from which the counts of a chip are told apart, and share by which a factor is off theirs.
const COUNTS_CORRELATION: f64 = 0.9;
const COUNTS_WITHIN: f64 = 0.06;
/// Key of the counts for one deg/s, in the evidence.
pub(in crate::findings) const COUNTS: &str = "counts_per_deg_s";
/// Fewer accelerations tell nothing of their unit.
const FEWEST: u64 = 20;

/// Unit that the rates look like.
#[derive(Clone, Copy, PartialEq)]
enum Fitting {
    /// Unit with a name.
    Unit(&'static str),
    /// Counts of a chip: so many for one deg/s, and its range, deg/s.
    Counts(f64, u32),
}

/// Whether gravity turns in the accelerometer by another factor than the gyro says; and the gyro's unit that fits, if
/// one does.
fn another_factor(looked: &Inspection) -> Option<Option<Fitting>> {
    let found = looked.quality.gyro_against_gravity?;
    let is_near = |factor: f64| (1.0 / UNIT_FACTOR..=UNIT_FACTOR).contains(&factor);
    let is_seen = found.correlation.abs() > MIN_CORRELATION;
    // The rates are those of the unit that the format states, or as recorded where the plan states one.
    let (taken, is_as_recorded) = (looked.resolved.unit, looked.quality_unit != GyroUnit::Rad);
    if !is_seen || (is_near(found.factor) && !is_as_recorded) {
        return None;
    }
    let degree = 1_f64.to_radians();
    let off = |(counts, _): &(f64, u32)| (found.factor * counts / degree - 1.0).abs();
    // 16.4 counts for one deg/s and mrad/s are 6 % apart.
    let is_mrad = |chip: &_| (found.factor / 1e-3 - 1.0).abs() < off(chip);
    let nearest = CHIPS
        .into_iter()
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .filter(|chip| {
            let is_certain = found.correlation >= COUNTS_CORRELATION && off(chip) <= COUNTS_WITHIN;
            is_certain && (is_as_recorded || taken == GyroUnit::Rad) && !is_mrad(chip)
        })
        .map(|(counts, range)| Fitting::Counts(counts, range));
    let read = match is_as_recorded {
        true => 1.0,
        false => taken.to_rad(),
    };
    let unit = [GyroUnit::Deg, GyroUnit::Mrad, GyroUnit::Rad]
        .into_iter()
        .filter(|unit| is_as_recorded || *unit != taken)
        .find(|unit| is_near(found.factor * read / unit.to_rad()))
        .map(|unit| Fitting::Unit(unit.name()));
    Some(
        match is_fast(looked) && unit != Some(Fitting::Unit("deg")) {
            true => nearest.or(unit),
            false => unit,
        },
    )
}

/// Whether the rates are counts by what gravity does.
pub(super) fn shows_counts(looked: &Inspection) -> bool {
    matches!(another_factor(looked), Some(Some(Fitting::Counts(..))))
}

/// Whether the gyro is in deg/s by what gravity does.
pub(super) fn shows_degrees(looked: &Inspection) -> bool {
    another_factor(looked) == Some(Some(Fitting::Unit("deg")))
}

/// Rates that turn gravity by another factor than it turns.
pub(super) fn turns_otherwise(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let looked = seen.looked;
    let (Some(found), Some(unit)) = (looked.quality.gyro_against_gravity, another_factor(looked))
    else {
        return;
    };
    let share = significant(found.factor, 3);
    let turns = format!(
        "gravity turns by {share} of what the gyro says (correlation {:.2})",
        found.correlation
    );
    let what = match unit {
        Some(Fitting::Unit(unit)) => format!("{turns}: the rates look like {unit}/s"),
        Some(Fitting::Counts(counts, range)) => {
            format!(
                "{turns}: the rates look like counts of a range of {range} deg/s, {counts:.1} for one deg/s"
            )
        }
        None => format!("{turns}: gyro and accelerometer disagree about axes, signs or unit"),
    };
    let finding = Finding::new(Severity::Error, "unit-against-gravity", what)
        .with("factor", found.factor)
        .with("correlation", found.correlation);
    out.push(match unit {
        Some(Fitting::Unit(unit)) => finding
            .advise("the accelerometer shows the unit of the rates")
            .help([GYRO_UNIT.to(unit)]),
        Some(Fitting::Counts(counts, _)) => finding
            .with(COUNTS, counts)
            .advise("the accelerometer shows the unit of the rates; the data sheet has the number to the last digit")
            .help([GYRO_SCALE.to(significant(1_f64.to_radians() / counts, 4))]),
        None => finding
            .advise("give the gyro's axes or unit as they are")
            .help([BODY.to("MAP")])
            .help([GYRO_UNIT.to(match seen.looked.resolved.unit {
                GyroUnit::Deg => "rad",
                _ => "deg",
            })]),
    });
}

/// Absence of forces in the samples, and the topics that carry them.
pub(super) fn elsewhere(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let aid = &seen.looked.aid;
    let Some(first) = aid.forces.first().filter(|_| !aid.has_force) else {
        return;
    };
    let names: Vec<&str> = aid.forces.iter().map(|one| one.topic.as_str()).collect();
    out.push(
        Finding::new(
            Severity::Note,
            "force-on-another-topic",
            forces_elsewhere(&names),
        )
        .with("topics", json!(names))
        .advise("gravity then corrects the tilt")
        .help([AID.to("gravity"), ACCEL_TOPIC.to(printable(&first.topic))]),
    );
}

/// Accelerations in g: at rest, or as most of them are long where nothing rests.
pub(super) fn unit(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let at_rest = seen
        .at_rest
        .and_then(|size| Some((size, accel_unit(size)?)));
    out.extend(match at_rest {
        Some((magnitude, unit)) => Some(
            not_in_metres(
                seen.looked,
                format!("acceleration at rest is {magnitude:.3}: plausible in {unit}, not in m/s^2"),
                unit,
            )
            .with("magnitude_at_rest", magnitude),
        ),
        // Who is never at rest has gravity in most of his accelerations.
        None => mostly_one_g(seen.looked).map(|(share, unit)| {
            not_in_metres(
                seen.looked,
                format!(
                    "{:.0} % of the accelerations have the length of gravity in {unit}, not in m/s^2",
                    100.0 * share
                ),
                unit,
            )
            .with("share_of_one_g", share)
        }),
    });
}

/// The unit in which this is one g, when it is not m/s^2. Gravity is 9.78 to 9.83 m/s^2; scale and
/// bias of a cheap accelerometer make that 5 %.
fn accel_unit(magnitude: f64) -> Option<&'static str> {
    let near = |g: f64| (magnitude / g - 1.0).abs() < 0.05;
    let units = [("g", 1.0), ("mg", 1000.0)];
    units.iter().find(|(_, g)| near(*g)).map(|(name, _)| *name)
}

/// Share of the accelerations that have the length of one g, and the unit. Accelerations without gravity are as long,
/// too, where somebody walks, but not for most of the time: lengths of a normal spread about nothing lie within 0.8 to
/// 1.25 in 38 of 100 cases at most.
fn mostly_one_g(looked: &Inspection) -> Option<(f64, &'static str)> {
    let q = &looked.quality;
    let finite = q.with_accel.saturating_sub(q.accel_not_finite);
    let units = [(q.accel_near_one, "g"), (q.accel_near_thousand, "mg")];
    let is_most = |near: u64| finite >= FEWEST && near > finite / 2;
    let (near, unit) = units.into_iter().find(|(near, _)| is_most(*near))?;
    Some((near as f64 / finite as f64, unit))
}

/// Finding of a body whose z points down at rest.
pub(in crate::findings) fn upside_down(stated: BodyAxes) -> Finding {
    Finding::new(
        Severity::Warning,
        "looks-frd",
        "gravity reads negative on z at rest: z points down",
    )
    .with("stated", stated.to_string())
    .advise("the body is front, right, down; or its accelerometer says down where it should say up: the gyro agrees with both, and the wrong one mirrors pitch and yaw")
    .help([BODY.to("frd")])
    .help([ACCEL_SIGN.to("kinematic")])
}

/// A body whose z does not point up at rest.
pub(super) fn mounting(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let stated = seen.looked.resolved.body;
    let gravity = seen
        .looked
        .quality
        .gravity
        .filter(|_| seen.at_rest.is_some());
    out.extend(match gravity {
        None => None,
        Some(GravityAxis { axis: 2, positive }) => {
            (!positive && stated != BodyAxes::Frd).then(|| upside_down(stated))
        }
        Some(gravity) => Some(
            Finding::new(
                Severity::Note,
                "mounted-on-side",
                format!("gravity is on {gravity} at rest: the sensor is mounted on its side"),
            )
            .with("gravity", gravity.to_string())
            .advise(
                "the attitude is the sensor's; this mounting makes it level (its heading is free)",
            )
            .help([MOUNT.to(levelled(seen.looked, gravity))])
            .help([BODY.to("MAP")]),
        ),
    });
}

/// An acceleration in another unit than the format has.
fn not_in_metres(looked: &Inspection, what: String, unit: &'static str) -> Finding {
    let found = Finding::new(Severity::Warning, "accel-unit", what).with("plausible_unit", unit);
    if looked.aid.force_scale != 1.0 {
        return found.advise(
            "taken to be in g where gravity corrects the attitude; who else reads this log does not know",
        );
    }
    // Of a table the columns say it.
    match looked.described.text.is_some_and(Format::is_table) {
        true => found
            .advise("so gravity cannot correct the attitude: say the unit")
            .help([COLUMNS.to(format!("accel=X:Y:Z:{unit}"))]),
        false => found.advise(
            "so gravity cannot correct the attitude, and no setting says otherwise: record m/s^2",
        ),
    }
}

/// The shortest turn from the sensor to a body with z up: gravity as a rest shows it, or the axis it is nearest to.
fn levelled(looked: &Inspection, gravity: GravityAxis) -> String {
    let longest = looked
        .rests
        .kept
        .iter()
        .max_by(|a, b| a.secs().total_cmp(&b.secs()));
    let measured = longest
        .and_then(|rest| rest.mean_accel)
        .map(|f| *f.as_vector());
    let axis = || {
        let mut axis = Vector3::zeros();
        if let Some(one) = axis.get_mut(gravity.axis) {
            *one = if gravity.positive { 1.0 } else { -1.0 };
        }
        axis
    };
    let up = measured
        .filter(|f| f.norm() > 0.0)
        .unwrap_or_else(axis)
        .normalize();
    let q = level_turn(&up);
    format!("q={:.6},{:.6},{:.6},0", q.x, q.y, q.z)
}

/// The shortest turn that brings `up`, of length 1, to z; upside down, the half turn about x. w, x, y, z.
fn level_turn(up: &Vector3<f64>) -> Vector4<f64> {
    let half = Vector4::new(1.0 + up.z, up.y, 0.0 - up.x, 0.0);
    half.try_normalize(1e-6).unwrap_or_else(Vector4::y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Quaternion, UnitQuaternion};

    #[test]
    fn whatever_is_up_comes_to_z_upside_down_too() {
        let ups = [
            Vector3::x(),
            -Vector3::x(),
            Vector3::y(),
            -Vector3::y(),
            Vector3::z(),
            -Vector3::z(),
            Vector3::new(1e-9, -1e-9, -1.0),
            Vector3::new(0.6, 0.0, -0.8),
        ];
        for up in ups {
            let q = level_turn(&up);
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(q.x, q.y, q.z, q.w));
            let error = (turn * up - Vector3::z()).norm();
            assert!(error < 1e-5, "{up}: {q}, off by {error}");
        }
    }
}
