//! Statistics of the samples as recorded -> findings. Pure.

use super::{Finding, Severity};
use crate::pipeline::check::CheckedTopic;
use crate::summary::significant;
use serde_json::json;
use strapd_attitude::condition::quality::{Advice, AxisStats};
use strapd_attitude::frames::BodyAxes;

/// Header and recorder's clock further apart than this are different clocks, s.
const OTHER_CLOCK_SECS: f64 = 1.0;
/// A bias is worth removing when it is this many sigmas from nothing, and above this rate (deg/h).
const BIAS_SIGMAS: f64 = 5.0;
const BIAS_DEG_PER_H: f64 = 10.0;
/// Share of rows repeated exactly above which something upstream repeats samples.
const REPEATED_SHARE: f64 = 0.003;
/// Longer runs of one value are no repeats of a sensor with noise.
const LONG_RUN: u64 = 20;

pub(super) fn find(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    counted(topic, out);
    if let Some(warning) = &topic.looked.clock_warning {
        // What was seen on the first line, the flags on those after it.
        let (what, help) = warning.split_once('\n').unwrap_or((warning, ""));
        out.push(
            Finding::new(Severity::Warning, "clock", what)
                .with("clock", topic.looked.clock.name())
                .advise(help.trim().trim_start_matches("help: ").to_owned()),
        );
    }
    for advice in &topic.looked.quality.advice {
        out.extend(advised(topic, advice));
    }
    silent(topic, out);
    clocks(topic, out);
    bias(topic, out);
}

/// Axes that never read but one value, while another moves.
fn silent(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    let q = &topic.looked.quality;
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

/// Rows that are bad in themselves.
fn counted(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    let q = &topic.looked.quality;
    let total = q.count + topic.looked.undecodable;
    let of_total = |n: u64, what: &str| format!("{n} of {total} {what}");
    let mut add = |n: u64, severity, code, what: &str, advice: &str, flags: &str| {
        if n > 0 {
            out.push(
                Finding::new(severity, code, of_total(n, what))
                    .with("count", n)
                    .with("samples", total)
                    .advise(advice)
                    .flags(flags),
            );
        }
    };
    use Severity::{Error, Warning};
    add(
        topic.looked.undecodable,
        Error,
        "undecodable",
        "payloads can not be decoded",
        "they are left out and counted",
        "",
    );
    add(
        q.not_finite,
        Error,
        "not-finite",
        "samples have NaN or infinity in the gyro",
        "they are left out; the attitude is carried across them",
        "",
    );
    add(
        q.no_gyro,
        Error,
        "gyro-absent",
        "samples mark their gyro as absent (covariance -1)",
        "some drivers set the mark wrongly; if the rates are good, use them",
        "--ignore-covariance-flag",
    );
    add(
        q.no_stamp,
        Error,
        "no-stamp",
        "samples have no stamp",
        "take the recorder's time",
        "--time log",
    );
    add(
        q.collisions,
        Warning,
        "shared-stamps",
        "samples share their stamp with another that has other data",
        "each is given a stamp of its own between its neighbours, where there is room",
        "",
    );
    add(
        q.duplicates.saturating_sub(q.collisions),
        Warning,
        "repeats",
        "samples repeat their predecessor, stamp and data",
        "they are left out",
        "",
    );
    add(
        q.disorder,
        Warning,
        "disorder",
        "samples are older than one before them",
        "those within the reorder window are put back in place, later ones are left out",
        "",
    );
    let repeated = q.repeated_rows.saturating_sub(q.duplicates);
    // A rest, or a steady turn, without noise repeats itself for long; a sensor read too often does not.
    let longest = q.axes.iter().map(|a| a.longest_run).max().unwrap_or(0);
    if repeated as f64 > REPEATED_SHARE * total as f64 && longest < LONG_RUN && total >= LONG_RUN {
        add(
            repeated,
            Warning,
            "repeated-rows",
            "samples repeat the values before them under a new stamp",
            "the sensor is read faster than it measures: record at its own rate",
            "",
        );
    }
    if q.lone_zero_rows > 0 {
        add(
            q.lone_zero_rows,
            Warning,
            "zero-rows",
            "samples are exactly zero about all axes",
            "a driver that has no data yet says so this way; they are integrated as rest",
            "",
        );
    }
    add(
        q.accel_not_finite,
        Warning,
        "accel-not-finite",
        "samples have NaN or infinity in the acceleration",
        "only levelling is affected",
        "",
    );
}

fn advised(topic: &CheckedTopic, advice: &Advice) -> Option<Finding> {
    use Severity::{Error, Note, Warning};
    let text = advice.to_string();
    // The flag is said apart from what was seen.
    let what = text
        .split_once(": --")
        .or_else(|| text.split_once(": if "))
        .map_or(text.as_str(), |(what, _)| what)
        .to_owned();
    let stated_frd = topic.looked.resolved.body == BodyAxes::Frd;
    let finding = |severity, code| Finding::new(severity, code, what.clone());
    Some(match *advice {
        Advice::RatesLookLikeDegrees { peak } => finding(Error, "unit-degrees")
            .with("largest_rate", peak)
            .advise("the rates are in deg/s")
            .flags("--gyro-unit deg"),
        Advice::GravityTurnsOtherwise { found, unit } => {
            let found = finding(Error, "unit-against-gravity")
                .with("factor", found.factor)
                .with("correlation", found.correlation);
            match unit {
                Some(unit) => found
                    .advise("the accelerometer shows the unit of the rates")
                    .flags(format!("--gyro-unit {unit}")),
                None => found
                    .advise("give the gyro's axes or unit as they are")
                    .flags("--body MAP or --gyro-unit"),
            }
        }
        Advice::AccelNotInMetres { magnitude, unit } => finding(Warning, "accel-unit")
            .with("magnitude_at_rest", magnitude)
            .with("plausible_unit", unit)
            .advise("only levelling uses the acceleration, and its direction alone"),
        Advice::LooksLikeFrd if stated_frd => return None,
        Advice::LooksLikeFrd => finding(Warning, "looks-frd")
            .with("stated", topic.looked.resolved.body.to_string())
            .advise("the body's z points down")
            .flags("--body frd"),
        Advice::MountedOnSide { gravity } => finding(Note, "mounted-on-side")
            .with("gravity", gravity.to_string())
            .advise("the attitude is the sensor's; state its mounting to get the body's")
            .flags("--mount q=w,x,y,z"),
        Advice::Saturated { axis, at, samples } => finding(Error, "saturated")
            .with("axis", axis_name(axis))
            .with("reading", at)
            .with("samples", samples)
            .advise("the true rate was higher: the attitude is wrong after it; have them flagged")
            .flags(format!("--gyro-range {:.4}", at.abs())),
        Advice::Stuck { axis, samples } => finding(Error, "stuck")
            .with("axis", axis_name(axis))
            .with("samples", samples)
            .advise("one axis repeats itself while the others move: the sensor or its driver is broken"),
        Advice::StampsStandStill => finding(Error, "stamps-stand-still")
            .advise("take another clock")
            .flags("--time log"),
        Advice::StampsJitter { share } => finding(Warning, "jitter")
            .with("p99_share_of_step", share)
            .with(
                "p99_s",
                topic.looked.quality.spacing.map_or(0.0, |s| s.jitter_p99_secs),
            )
            .advise("if the sensor samples evenly and only its stamps jitter, straighten them; if it samples unevenly, keep them")
            .flags("--regularise-stamps"),
        Advice::StampsJitterEvenly { jitter, segments } => finding(Warning, "jitter")
            .with("rms_share_of_step", jitter)
            .with("segments_of_constant_rate", segments)
            .advise("if a clock of its own triggers the sensor, straighten its stamps; if it samples when it is asked, keep them: they can not tell, --against-recorded may")
            .flags("--regularise-stamps"),
        Advice::StampsUneven { share } => finding(Warning, "jitter")
            .with("p99_share_of_step", share)
            .advise("the stamps keep no constant rate: another clock may be steadier; if no sample is missing, number them")
            .flags("--time log, or --time index --rate-hz HZ"),
        Advice::ClocksDrift { ppm } => finding(Warning, "clock-drift")
            .with("ppm", ppm)
            .advise("one of the clocks is wrong by as much, and so is every angle")
            .flags("--time header|log"),
        Advice::SamplesMissing {
            missing,
            longest_secs,
        } => finding(Warning, "missing")
            .with("missing", missing)
            .with("longest_s", longest_secs)
            .with("gaps", topic.looked.quality.gaps)
            .advise("bridged by interpolation where short")
            .flags("--max-gap SECS --on-gap hold|bridge|reset"),
        Advice::NeverStill => finding(Note, "never-still")
            .advise("no bias can be had from this log: give one, if it is known")
            .flags("--bias x,y,z"),
    })
}

fn clocks(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    if let Some(offset) = &topic.looked.quality.offset
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
            .flags("--time header|log"),
        );
    }
}

fn bias(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    let Some(found) = &topic.looked.bias else {
        return;
    };
    let to_deg_per_h = |v: f64| v.to_degrees() * 3600.0;
    let size = to_deg_per_h(found.bias.norm());
    let sigma = found.sigma.norm();
    if found.bias.norm() > BIAS_SIGMAS * sigma && size > BIAS_DEG_PER_H {
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
            .flags("--bias auto"),
        );
    }
}

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or("?")
}
