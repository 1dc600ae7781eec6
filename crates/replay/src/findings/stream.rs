//! Evidence that a stream is no single sensor in one unit -> findings: two that take turns, a unit or axes that change. Pure.
//!
//! Apart from the counts of a run because the advice depends on who reads it: a recording is split, a sender is mended.

use super::sensors::AXES;
use super::{Finding, Severity, sensors};
use crate::finding::{
    ACCEL_UNIT_CHANGE, GRAVITY_LEAP, GYRO_AXES_CHANGE, GYRO_BIAS_CHANGE, GYRO_UNIT_CHANGE, MIXED,
};
use crate::summary::significant;
use strapd_attitude::condition::{ACCEL_UNITS, Apart, GYRO_UNITS, Mixture, Report, UnitChange};
use strapd_attitude::consistency::Consistency;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::Nanos;
use strapd_attitude::setting::{COLUMNS, GYRO_AXES, GYRO_UNIT, START, TOPIC, UNTIL, WHERE};

/// Findings about gyro and gravity that these explain, beside those of a misread sensor.
const EXPLAINED: [&str; 2] = ["gyro-against-gravity", "unit-against-gravity"];
/// Findings that name the cause of a leap of gravity.
const LEAPS: [&str; 4] = [MIXED, ACCEL_UNIT_CHANGE, GYRO_AXES_CHANGE, AXES];
/// Ratio of two units by which readings change, less 1.
const NEAR: f64 = 0.15;
/// Findings from the report of a stream: of a recording, or live.
pub(crate) fn find(report: &Report, is_live: bool) -> Vec<Finding> {
    let since = |at: Nanos| report.first.map_or(0.0, |first| at.secs_since(first));
    let mixed = report.mixture.map(|found| mixed(&found, is_live, since));
    let changes = report.unit_changes;
    let gyro = changes.gyro.map(|change| {
        let at = since(change.at);
        let found = changed((&change, at), ("gyro", GYRO_UNIT_CHANGE), &GYRO_UNITS);
        advised(found, (&change, at), is_live)
    });
    let accel = changes.accel.map(|change| {
        let at = since(change.at);
        let found = changed(
            (&change, at),
            ("accelerometer", ACCEL_UNIT_CHANGE),
            &ACCEL_UNITS,
        );
        advised(found, (&change, at), is_live)
    });
    mixed.into_iter().chain(gyro).chain(accel).collect()
}

/// Leaves out what two sensors, or a change of the gyro's unit, explain.
pub(super) fn settle(found: &mut Vec<Finding>) {
    let causes = [MIXED, GYRO_UNIT_CHANGE, GYRO_AXES_CHANGE];
    let is_cause = |f: &Finding| causes.contains(&f.code);
    if found.iter().any(is_cause) {
        found.retain(|f| !f.is_misread() && !EXPLAINED.contains(&f.code));
    }
    if found.iter().any(|f| LEAPS.contains(&f.code)) {
        found.retain(|f| f.code != GRAVITY_LEAP);
    }
}

fn mixed(found: &Mixture, is_live: bool, since: impl Fn(Nanos) -> f64) -> Finding {
    let n = found.samples;
    let (what, key, value) = match found.apart {
        Apart::Forces(angle) => {
            let deg = angle.to_degrees();
            let what = format!(
                "the accelerations of {n} samples jump back and forth between two directions {deg:.0} deg apart"
            );
            (what, "apart_deg", deg)
        }
        Apart::Rates(apart) => {
            let shown = significant(apart, 2);
            let what = format!(
                "the rates of {n} samples jump back and forth between two that are {shown} rad/s apart"
            );
            (what, "apart_rad_s", apart)
        }
        Apart::Clocks(apart) => {
            let secs = apart as f64 * 1e-9;
            let what = format!(
                "the stamps jump {n} times back and forth between two clocks {} s apart",
                significant(secs, 3)
            );
            (what, "apart_s", secs)
        }
    };
    let finding = Finding::new(
        Severity::Error,
        MIXED,
        format!("two sensors take turns in one stream: {what}"),
    )
    .with("samples", n)
    .with(key, value);
    if is_live {
        return finding
            .advise("the attitude is that of neither: give each sensor an id of its own");
    }
    let at = since(found.first);
    let finding = match found.apart {
        Apart::Clocks(_) => finding,
        _ => finding.with("first_at_s", at),
    };
    finding
        .advise("the attitude is that of neither: record each on a topic of its own, or with a column that names the sensor, and choose one")
        .help([WHERE.to("COLUMN=VALUE")])
        .help([COLUMNS.to("sensor=NAME")])
        .help([TOPIC.to("NAME")])
}

fn changed(
    (change, at): (&UnitChange, f64),
    (sensor, code): (&str, &'static str),
    units: &[(f64, &str, &str)],
) -> Finding {
    let factor = change.factor;
    if factor < 0.0 {
        let what = format!(
            "the {sensor} reads the other way from {at:.1} s after the start on: gravity turns round in one sample, and the gyro does not"
        );
        return Finding::new(Severity::Error, code, what)
            .with("at_s", at)
            .with("factor", factor);
    }
    let is_near = |ratio: f64| (factor / ratio - 1.0).abs() < NEAR;
    let named = units.iter().find_map(|(ratio, larger, smaller)| {
        match (is_near(*ratio), is_near(1.0 / ratio)) {
            (true, _) => Some(format!("its unit changes from {smaller} to {larger}")),
            (_, true) => Some(format!("its unit changes from {larger} to {smaller}")),
            _ => None,
        }
    });
    let named = named.unwrap_or_else(|| "its range or scale changes".to_owned());
    let by = match code {
        ACCEL_UNIT_CHANGE => "gravity's length becomes",
        _ => "against the rotation of gravity its rates become",
    };
    Finding::new(
        Severity::Error,
        code,
        format!(
            "the {sensor} reads otherwise from {at:.1} s after the start on: {by} {} of what it was, {named}",
            significant(factor, 3)
        ),
    )
    .with("at_s", at)
    .with("factor", factor)
}

fn advised(found: Finding, (change, at): (&UnitChange, f64), is_live: bool) -> Finding {
    if is_live {
        return found.advise("the attitude is wrong after it: mend the sender, which was restarted with other settings, and reset the attitude");
    }
    let (before, behind) = (
        format!("{:.1}", (at - 0.2).max(0.0)),
        format!("{:.1}", at + 0.5),
    );
    let found = found.advise(match change.factor < 0.0 {
        true => "the attitude is wrong after it: take each part by itself, with its own sign",
        false => "the attitude is wrong after it: take each part by itself, with its own unit",
    });
    let is_gyro = found.code == GYRO_UNIT_CHANGE;
    let (before, behind) = (UNTIL.to(before), START.to(behind));
    match change.is_first_right.filter(|_| is_gyro) {
        None => found.help([before]).help([behind]),
        Some(true) => found.help([before]).help([behind, GYRO_UNIT.to("UNIT")]),
        Some(false) => found.help([before, GYRO_UNIT.to("UNIT")]).help([behind]),
    }
}

/// Axes of the gyro that are others from one moment on; `first`: stamp of the stream's first sample.
pub(super) fn axes_changed(
    gyro: &Consistency,
    plan: &EstimationSettings,
    first: Option<Nanos>,
    is_live: bool,
) -> Option<Finding> {
    let change = gyro.axes_change()?;
    let since = |at: Nanos| first.map_or(0.0, |first| at.secs_since(first));
    let at = since(change.at());
    let words = sensors::in_words(&change.map, change.decided);
    let what = match change.is_first_right {
        true => format!(
            "the gyro's axes change about {at:.0} s after the start: from there on the true rate {words}"
        ),
        false => format!(
            "the gyro's axes change about {at:.0} s after the start: until there the true rate {words}, then as recorded"
        ),
    };
    let finding = Finding::new(Severity::Error, GYRO_AXES_CHANGE, what)
        .with("at_s", at)
        .with("map", change.map.to_string())
        .with("is_first_right", change.is_first_right)
        .with("segments_before", change.segments.0)
        .with("segments_behind", change.segments.1);
    if is_live {
        return Some(finding.advise("the attitude is wrong on one side of it: mend the sender, which was restarted with other axes, and reset the attitude"));
    }
    let (before, behind) = change.between;
    let (before, behind) = (since(before.min(behind)), since(behind.max(before)));
    let before = UNTIL.to(format!("{before:.1}"));
    let behind = START.to(format!("{behind:.1}"));
    let axes = GYRO_AXES.to(change.map.after(plan.gyro_axes));
    let finding = finding.advise(
        "the attitude is wrong on one side of it: take each part by itself, with its own axes",
    );
    Some(match change.is_first_right {
        true => finding.help([before]).help([behind, axes]),
        false => finding.help([before, axes]).help([behind]),
    })
}

/// Gravity that leaps where the gyro reads no rotation; `first`: stamp of the stream's first sample.
pub(super) fn gravity_leap(
    gyro: &Consistency,
    first: Option<Nanos>,
    is_live: bool,
) -> Option<Finding> {
    let leap = gyro.gravity_leap()?;
    let at = first.map_or(0.0, |first| leap.at.secs_since(first));
    let degrees = leap.angle.to_degrees();
    let others = match leap.count {
        1 => String::new(),
        2 => ", and once more later".to_owned(),
        n => format!(", and {} times more later", n - 1),
    };
    let finding = Finding::new(
        Severity::Error,
        GRAVITY_LEAP,
        format!(
            "gravity leaps by {degrees:.0} degrees in one sample {at:.1} s after the start{others}, and the gyro reads no such rotation"
        ),
    )
    .with("at_s", at)
    .with("angle_deg", degrees)
    .with("scatter_g", leap.scatter)
    .with("leaps", leap.count);
    if is_live {
        return Some(finding.advise("the sensor was mounted anew, or its sender restarted with other axes: the attitude is wrong until gravity pulls it back; reset it, and state the axes it has now"));
    }
    // The attitude begins anew in the second part.
    let before = UNTIL.to(format!("{:.1}", (at - 0.1).max(0.0)));
    let behind = START.to(format!("{:.1}", at + 0.1));
    Some(
        finding
            .advise("the sensor was mounted anew or restarted with other axes, recordings were joined, or samples are missing: the attitude is wrong after it; take each part by itself")
            .help([before])
            .help([behind]),
    )
}

/// Bias of the gyro that is another from one moment on; `first`: stamp of the recording's first sample.
pub(super) fn bias_changed(gyro: &Consistency, first: Option<Nanos>) -> Option<Finding> {
    let change = gyro.bias_change()?;
    let at = first.map_or(0.0, |first| change.at.secs_since(first));
    let by = change.by.map(f64::to_degrees);
    let parts: Vec<String> = by.iter().map(|part| significant(*part, 2)).collect();
    let sigma = significant(change.sigma.to_degrees().max(0.01), 1);
    let (one, two) = (
        significant(change.recorded, 2),
        significant(change.cured, 1),
    );
    let part = |at: f64| format!("{:.0}", at.max(0.0));
    Some(
        Finding::new(
            Severity::Warning,
            GYRO_BIAS_CHANGE,
            format!(
                "the gyro's bias changes about {at:.0} s after the start by ({}) deg/s (+- {sigma})",
                parts.join(", ")
            ),
        )
        .with("at_s", at)
        .with("by_deg_s", by.as_slice().to_vec())
        .with("sigma_deg_s", change.sigma.to_degrees())
        .with("scatter_g", change.recorded)
        .with("scatter_cured_g", change.cured)
        .with("segments", change.segments)
        .advise(format!(
            "gravity wanders by {one} g under one bias, by {two} g under two; the attitude drifts until the filter has learned the second: take each part by itself"
        ))
        .help([UNTIL.to(part(at))])
        .help([START.to(part(at))]),
    )
}
