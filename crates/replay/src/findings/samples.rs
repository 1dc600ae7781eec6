//! Statistics of the samples as recorded -> findings. Pure.

use super::{Finding, Severity, verdicts};
use crate::inspection::Inspection;
use crate::summary::significant;
use nalgebra::{Vector3, Vector4};
use serde_json::json;
use strapd_attitude::condition::quality::{Advice, AxisStats, GravityAxis};
use strapd_attitude::frames::BodyAxes;
use strapd_attitude::record::Counts;
use strapd_attitude::setting::{
    AGAINST_RECORDED, BIAS, BODY, COLUMNS, GYRO_RANGE, GYRO_UNIT, IGNORE_COVARIANCE_FLAG, MAX_GAP,
    MOUNT, ON_GAP, RATE_HZ, REGULARISE_STAMPS, TIME,
};

/// Header and recorder's clock further apart than this are different clocks, s.
const OTHER_CLOCK_SECS: f64 = 1.0;
/// A bias is worth removing when it is this many sigmas from nothing, and above this rate (deg/h).
const BIAS_SIGMAS: f64 = 5.0;
const BIAS_DEG_PER_H: f64 = 10.0;
/// Share of rows repeated exactly above which something upstream repeats samples.
const REPEATED_SHARE: f64 = 0.003;
/// Longer runs of one value are no repeats of a sensor with noise.
const LONG_RUN: u64 = 20;

/// Findings from the samples of a topic as they were recorded.
#[must_use]
pub fn of_samples(looked: &Inspection) -> Vec<Finding> {
    of_counted(looked, &looked.counts)
}

/// The same where a run has counted what became of them.
pub(super) fn of_counted(looked: &Inspection, counts: &Counts) -> Vec<Finding> {
    let mut out = verdicts::find(counts);
    rows(looked, counts.total(), &mut out);
    if let Some(warning) = &looked.clock_warning {
        out.push(
            Finding::said(Severity::Warning, "clock", warning).with("clock", looked.clock.name()),
        );
    }
    for advice in &looked.quality.advice {
        out.extend(advised(looked, advice));
    }
    silent(looked, &mut out);
    clocks(looked, &mut out);
    bias(looked, &mut out);
    // What nobody takes unasked spoils nothing.
    if !looked.is_likely {
        out.iter_mut().for_each(|f| f.severity = Severity::Note);
    }
    out
}

/// Axes that never read but one value, while another moves.
fn silent(looked: &Inspection, out: &mut Vec<Finding>) {
    let q = &looked.quality;
    let varies = |a: &AxisStats| a.max > a.min;
    if !q.axes.iter().any(varies) || q.count < LONG_RUN {
        return;
    }
    for (axis, stats) in q.axes.iter().enumerate().filter(|(_, a)| !varies(a)) {
        out.push(
            Finding::new(
                Severity::Note,
                "axis-silent",
                format!(
                    "gyro {} reads {} in every sample",
                    axis_name(axis),
                    significant(stats.min, 4)
                ),
            )
            .with("axis", axis_name(axis))
            .with("reading", stats.min)
            .advise("fine for a body that turns about one axis; a real sensor has noise"),
        );
    }
}

/// Rows that are bad in themselves, though they be used.
fn rows(looked: &Inspection, total: u64, out: &mut Vec<Finding>) {
    use Severity::Warning;
    let q = &looked.quality;
    let repeated = q.repeated_rows.saturating_sub(q.duplicates);
    // A rest, or a steady turn, without noise repeats itself for long; a sensor read too often does not.
    let longest = q.axes.iter().map(|a| a.longest_run).max().unwrap_or(0);
    let is_read_too_often =
        repeated as f64 > REPEATED_SHARE * total as f64 && longest < LONG_RUN && total >= LONG_RUN;
    let found = [
        some(
            (repeated, total),
            (Warning, "repeated-rows"),
            "samples repeat the values before them under a new stamp",
            "the sensor is read faster than it measures: record at its own rate",
        )
        .filter(|_| is_read_too_often),
        zero_rows(q.lone_zero_rows, total),
        some(
            (q.accel_not_finite, total),
            (Warning, "accel-not-finite"),
            "samples have NaN or infinity in the acceleration",
            "only levelling is affected",
        ),
    ];
    out.extend(found.into_iter().flatten());
}

fn advised(looked: &Inspection, advice: &Advice) -> Option<Finding> {
    use Severity::{Error, Note, Warning};
    let stated_frd = looked.resolved.body == BodyAxes::Frd;
    Some(match *advice {
        Advice::RatesLookLikeDegrees { peak } => rates_like_degrees(peak),
        Advice::GravityTurnsOtherwise { found, unit } => {
            let share = match unit {
                Some(_) => format!("{:.4}", found.factor),
                None => format!("{:.2}", found.factor),
            };
            let seen = format!(
                "gravity turns by {share} of what the gyro says (correlation {:.2})",
                found.correlation
            );
            let what = match unit {
                Some(unit) => format!("{seen}: the rates look like {unit}/s"),
                None => format!("{seen}: gyro and accelerometer disagree about axes, signs or unit"),
            };
            let finding = Finding::new(Error, "unit-against-gravity", what)
                .with("factor", found.factor)
                .with("correlation", found.correlation);
            match unit {
                Some(unit) => finding
                    .advise("the accelerometer shows the unit of the rates")
                    .help([GYRO_UNIT.to(unit)]),
                None => finding
                    .advise("give the gyro's axes or unit as they are")
                    .help([BODY.to("MAP")]).help([GYRO_UNIT.to("deg")]),
            }
        }
        Advice::AccelNotInMetres { magnitude, unit } => not_in_metres(
            looked,
            format!("acceleration at rest is {magnitude:.3}: plausible in {unit}, not in m/s^2"),
            unit,
        )
        .with("magnitude_at_rest", magnitude),
        Advice::AccelMostlyOneG { share, unit } => not_in_metres(
            looked,
            format!(
                "{:.0} % of the accelerations have the length of gravity in {unit}, not in m/s^2",
                100.0 * share
            ),
            unit,
        )
        .with("share_of_one_g", share),
        Advice::LooksLikeFrd if stated_frd => return None,
        Advice::LooksLikeFrd => Finding::new(
            Warning,
            "looks-frd",
            "gravity reads negative on z at rest: z points down",
        )
        .with("stated", looked.resolved.body.to_string())
        .advise("the body looks like front, right, down")
        .help([BODY.to("frd")]),
        Advice::MountedOnSide { gravity } => Finding::new(
            Note,
            "mounted-on-side",
            format!("gravity is on {gravity} at rest: the sensor is mounted on its side"),
        )
        .with("gravity", gravity.to_string())
        .advise("the attitude is the sensor's; this mounting makes it level (its heading is free)")
        .help([MOUNT.to(levelled(looked, gravity))]).help([BODY.to("MAP")]),
        Advice::Saturated { axis, at, samples } => Finding::new(
            Error,
            "saturated",
            format!(
                "gyro {} reads exactly {at} in {samples} samples: looks saturated",
                axis_name(axis)
            ),
        )
        .with("axis", axis_name(axis))
        .with("reading", at)
        .with("samples", samples)
        .advise("the true rate was higher: the attitude is wrong after it; have them flagged")
        .help([GYRO_RANGE.to(format!("{:.4}", at.abs()))]),
        Advice::Stuck { axis, samples } => Finding::new(
            Error,
            "stuck",
            format!(
                "gyro {} repeats one value {samples} times in a row while the others move: stuck?",
                axis_name(axis)
            ),
        )
        .with("axis", axis_name(axis))
        .with("samples", samples)
        .advise("one axis repeats itself while the others move: the sensor or its driver is broken"),
        Advice::StampsStandStill => {
            Finding::new(Error, "stamps-stand-still", "the stamps do not advance")
                .advise("take another clock")
                .help([TIME.to("log")]).help([TIME.to("index"), RATE_HZ.to("HZ")])
        }
        Advice::StampsJitter { share } => Finding::new(
            Warning,
            "jitter",
            format!("stamps jitter by {:.0} % of the step (p99)", share * 100.0),
        )
        .with("p99_share_of_step", share)
        .with(
            "p99_s",
            looked.quality.spacing.map_or(0.0, |s| s.jitter_p99_secs),
        )
        .advise("if the sensor samples evenly and only its stamps jitter, straighten them; if it samples unevenly, keep them")
        .help([REGULARISE_STAMPS]),
        Advice::StampsJitterEvenly { jitter, segments } => Finding::new(
            Warning,
            "jitter",
            format!(
                "stamps jitter by {:.1} % of the step (rms) about {}",
                jitter * 100.0,
                match segments {
                    1 => "one constant rate".to_owned(),
                    n => format!("{n} stretches of constant rate"),
                }
            ),
        )
        .with("rms_share_of_step", jitter)
        .with("segments_of_constant_rate", segments)
        .advise({
            let advice = "if a clock of its own triggers the sensor, straighten its stamps; if it samples when it is asked, keep them";
            match looked.has_reference {
                true => format!("{advice}: they cannot tell, {AGAINST_RECORDED} may"),
                false => advice.to_owned(),
            }
        })
        .help([REGULARISE_STAMPS]),
        Advice::StampsUneven { share } => Finding::new(
            Warning,
            "jitter",
            format!(
                "stamps jitter by {:.0} % of the step (p99) and keep no constant rate",
                share * 100.0
            ),
        )
        .with("p99_share_of_step", share)
        .advise("another clock may be steadier; if no sample is missing, number them")
        .help([TIME.to("log")]).help([TIME.to("index"), RATE_HZ.to("HZ")]),
        Advice::ClocksDrift { ppm } => Finding::new(
            Warning,
            "clock-drift",
            format!("header and log time drift apart by {ppm:.0} ppm"),
        )
        .with("ppm", ppm)
        .advise("one of the clocks is wrong by as much, and so is every angle")
        .help([TIME.to("header|log")]),
        Advice::SamplesMissing {
            missing,
            longest_secs,
        } => missing_samples(missing, longest_secs, looked.quality.gaps),
        Advice::NeverStill => Finding::new(
            Note,
            "never-still",
            "the body is never still for half a second",
        )
        .advise("no bias can be had from this log: give one, if it is known")
        .help([BIAS.to("x,y,z")]),
    })
}

/// Finding for so many missing samples.
pub(super) fn missing_samples(missing: u64, longest_secs: f64, gaps: u64) -> Finding {
    Finding::new(
        Severity::Warning,
        "missing",
        format!("{missing} samples are missing, at most {longest_secs:.3} s at a time"),
    )
    .with("missing", missing)
    .with("longest_s", longest_secs)
    .with("gaps", gaps)
    .advise("bridged by interpolation where short")
    .help([MAX_GAP.to("SECS"), ON_GAP.to("hold|bridge|reset")])
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
    match looked.format.is_table() {
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

/// Finding for rates that no gyro reaches in rad/s.
pub(super) fn rates_like_degrees(peak: f64) -> Finding {
    Finding::new(
        Severity::Error,
        "unit-degrees",
        format!("rates reach {peak:.1}: no gyro measures that in rad/s; deg/s would be plausible"),
    )
    .with("largest_rate", peak)
    .advise("the rates are in deg/s")
    .help([GYRO_UNIT.to("deg")])
}

/// Samples without a gyro by the mark of their format.
pub(super) fn gyro_absent(n: u64, total: u64) -> Option<Finding> {
    let found = some(
        (n, total),
        (Severity::Error, "gyro-absent"),
        "samples mark their gyro as absent (covariance -1)",
        "some drivers set the mark wrongly; if the rates are good, use them",
    )?;
    Some(found.help([IGNORE_COVARIANCE_FLAG]))
}

/// Samples without any rate amid others.
pub(super) fn zero_rows(n: u64, total: u64) -> Option<Finding> {
    some(
        (n, total),
        (Severity::Warning, "zero-rows"),
        "samples are exactly zero about all axes",
        "a driver that has no data yet says so this way; they are integrated as rest",
    )
}

/// Finding for so many of all, if there are any.
pub(super) fn some(
    (n, total): (u64, u64),
    (severity, code): (Severity, &'static str),
    what: &str,
    advice: &str,
) -> Option<Finding> {
    (n > 0).then(|| {
        Finding::new(severity, code, format!("{n} of {total} {what}"))
            .with("count", n)
            .with("samples", total)
            .advise(advice)
    })
}

fn clocks(looked: &Inspection, out: &mut Vec<Finding>) {
    if let Some(offset) = &looked.quality.offset
        && offset.mean_secs.abs() > OTHER_CLOCK_SECS
    {
        out.push(
            Finding::new(
                Severity::Note,
                "other-clock",
                format!(
                    "header stamps are {} s {} the recorder's clock",
                    significant(offset.mean_secs.abs(), 4),
                    if offset.mean_secs < 0.0 {
                        "behind"
                    } else {
                        "ahead of"
                    }
                ),
            )
            .with("mean_s", offset.mean_secs)
            .with("drift_ppm", offset.drift_ppm)
            .advise("different clocks, or a log played again; compare only on one of them")
            .help([TIME.to("header|log")]),
        );
    }
}

fn bias(looked: &Inspection, out: &mut Vec<Finding>) {
    let Some(found) = &looked.bias else {
        return;
    };
    let to_deg_per_h = |v: f64| v.to_degrees() * 3600.0;
    let size = to_deg_per_h(found.bias.0.norm());
    let sigma = found.sigma.norm();
    if found.bias.0.norm() > BIAS_SIGMAS * sigma && size > BIAS_DEG_PER_H {
        let bias: [f64; 3] = found.bias.into();
        out.push(
            Finding::new(
                Severity::Warning,
                "bias",
                format!(
                    "at rest the gyro reads {} deg/h (+- {}): so fast the attitude drifts",
                    significant(size, 3),
                    significant(to_deg_per_h(sigma), 2)
                ),
            )
            .with("bias_rad_s", json!(bias))
            .with("sigma_rad_s", sigma)
            .with("rest_s", found.secs)
            .advise("remove it")
            .help([BIAS.to("auto")]),
        );
    }
}

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or("?")
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
