//! Statistics of the samples as recorded -> findings. Pure.
//!
//! A finding is a function here, or in a part of this, and its place in [`RULES`]; what it counts is counted in
//! `strapd_attitude::condition::quality`. Thresholds are opinions, and stand by the words that they decide.

mod gravity;
mod stamps;
#[cfg(test)]
mod tests;

pub(super) use self::gravity::{COUNTS, upside_down};
pub(super) use self::stamps::missing_samples;
use super::{Finding, Severity, axes, verdicts};
use crate::inspection::Inspection;
use crate::summary::significant;
use serde_json::json;
use strapd_attitude::condition::ClockWarning;
use strapd_attitude::condition::quality::{AxisStats, Clipped};
use strapd_attitude::record::Counts;
use strapd_attitude::setting::{BIAS, GYRO_RANGE, GYRO_SCALE, GYRO_UNIT, IGNORE_COVARIANCE_FLAG};

/// A bias is worth removing when it is this many sigmas from nothing, and above this rate (deg/h).
const BIAS_SIGMAS: f64 = 5.0;
const BIAS_DEG_PER_H: f64 = 10.0;
/// Share of rows repeated exactly above which something upstream repeats samples.
const REPEATED_SHARE: f64 = 0.003;
/// Longer runs of one value are no repeats of a sensor with noise.
const LONG_RUN: u64 = 20;
/// A rest in rad/s is below this; in deg/s, a rest is below it times 57.
const STILL_DEVIATION: f64 = 0.025;
/// Longest credible run of one value from a moving, quantised sensor.
const STUCK_SAMPLES: u64 = 100;

/// Samples of a topic, and facts about them that several rules need.
pub(super) struct Seen<'a> {
    looked: &'a Inspection,
    /// Samples, as who has counted them says.
    total: u64,
    /// Size of the rates' unit in deg/s as in rad/s: 57.3 where they look like degrees.
    unit: f64,
    /// Length of the acceleration at rest, where there is a rest.
    at_rest: Option<f64>,
}

/// A rule: adds its findings, if it has any.
type Rule = fn(&Seen<'_>, &mut Vec<Finding>);

/// The rules, in the order of what they find.
const RULES: [Rule; 18] = [
    rows,
    clock,
    stamps::clocks,
    degrees,
    gravity::turns_otherwise,
    stamps::stand_still,
    never_still,
    gravity::elsewhere,
    gravity::unit,
    gravity::mounting,
    clipped_or_stuck,
    stamps::jitter,
    stamps::drift,
    stamps::missing,
    stamps::slight_jitter,
    silent,
    stamps::other_clock,
    bias,
];

/// The rules for a live sensor, whose stamps and steps are judged as they come.
const LIVE: [Rule; 7] = [
    rows,
    degrees,
    gravity::turns_otherwise,
    gravity::unit,
    gravity::mounting,
    clipped_or_stuck,
    silent,
];

/// Findings from the samples of a live sensor.
pub(super) fn live(seen: &Seen<'_>) -> Vec<Finding> {
    found_by(&LIVE, seen)
}

/// Findings from the samples of a topic as they were recorded.
#[must_use]
pub fn of_samples(looked: &Inspection) -> Vec<Finding> {
    of_counted(looked, &looked.counts)
}

/// The same where a run has counted what became of them.
pub(super) fn of_counted(looked: &Inspection, counts: &Counts) -> Vec<Finding> {
    let mut out = verdicts::find(counts);
    if looked.has_no_clock() {
        out.retain(|found| found.code != verdicts::NO_STAMP);
    }
    out.extend(found_by(&RULES, &Seen::of(looked, counts.total())));
    // What nobody takes unasked spoils nothing.
    if !looked.is_likely {
        out.iter_mut().for_each(|f| f.severity = Severity::Note);
    }
    out
}

/// Findings of these rules, in their order.
fn found_by(rules: &[Rule], seen: &Seen<'_>) -> Vec<Finding> {
    let mut out = Vec::new();
    rules.iter().for_each(|rule| rule(seen, &mut out));
    out
}

impl Seen<'_> {
    pub(super) fn of(looked: &Inspection, total: u64) -> Seen<'_> {
        let unit = match is_fast(looked) || gravity::shows_degrees(looked) {
            true => 57.3,
            false => 1.0,
        };
        let seen = Seen {
            looked,
            total,
            unit,
            at_rest: None,
        };
        Seen {
            at_rest: looked.quality.accel_at_rest.filter(|_| seen.is_still()),
            ..seen
        }
    }

    /// Whether the quietest half second is a rest.
    fn is_still(&self) -> bool {
        let deviation = self.looked.quality.quietest_deviation;
        deviation.is_some_and(|deviation| deviation <= STILL_DEVIATION * self.unit)
    }
}

/// Whether rates are too fast for rad/s. One in ten thousand may be a spike; a flipped bit is no unit.
fn is_fast(looked: &Inspection) -> bool {
    looked.quality.fast_rows > looked.quality.count / 10_000 + 2
}

fn degrees(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let axes = seen.looked.quality.axes.iter();
    let peak = axes
        .map(|a| a.max.abs().max(a.min.abs()))
        .fold(0.0, f64::max);
    if is_fast(seen.looked) && !gravity::shows_counts(seen.looked) {
        out.push(rates_of_another_unit(peak));
    }
}

/// Warning about the clock.
fn clock(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let name = seen.looked.clock.name();
    let (severity, code) = match seen.looked.has_no_clock() {
        true => (Severity::Error, ClockWarning::NO_CLOCK),
        false => (Severity::Warning, "clock"),
    };
    out.extend(
        seen.looked
            .clock_warning
            .as_ref()
            .map(|warning| Finding::said(severity, code, warning).with("clock", name)),
    );
}

/// A body without a rest, of which no bias can be had.
fn never_still(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    if seen.looked.quality.quietest_deviation.is_some() && !seen.is_still() {
        out.push(
            Finding::new(
                Severity::Note,
                "never-still",
                "the body is never still for half a second",
            )
            .advise("no bias can be had from this log: give one, if it is known")
            .help([BIAS.to("x,y,z")]),
        );
    }
}

/// Axes that stay at the end of their range, or repeat one value for long while others move.
fn clipped_or_stuck(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let axes = &seen.looked.quality.axes;
    let [in_rad, in_degrees] = &seen.looked.quality.clipped;
    let is_in_degrees = seen.unit > 1.0;
    let clipped = if is_in_degrees { in_degrees } else { in_rad };
    let [in_rad, in_degrees] = &seen.looked.quality.broken;
    let broken = if is_in_degrees { in_degrees } else { in_rad };
    // One that never reads anything else is not there, or not turned about.
    let moving = axes
        .iter()
        .enumerate()
        .filter(|(_, stats)| stats.min < stats.max);
    for (axis, stats) in moving {
        let name = axes::name(axis);
        if let Some(Clipped { level: at, samples }) = clipped.get(axis).copied().flatten() {
            let level = significant(at, 5);
            let unit = if is_in_degrees { "deg/s" } else { "rad/s" };
            out.push(
                Finding::new(
                    Severity::Error,
                    "saturated",
                    format!("gyro {name} reads exactly {level} {unit} in {samples} samples: looks saturated"),
                )
                .with("axis", name)
                .with("reading", at)
                .with("samples", samples)
                .advise(
                    "the true rate was higher: sigma grows by the rotation that is lost; a wider range in the sensor keeps it. To state the range",
                )
                .help([GYRO_RANGE.to(format!("{:.4}", at.abs()))]),
            );
            // A clipped axis repeats one value too, for another reason.
            continue;
        }
        let mut others = axes.iter().enumerate().filter(|(i, _)| *i != axis);
        let others_move = others.any(|(_, other)| other.longest_run * 10 < stats.longest_run);
        let long = Some(stats.longest_run).filter(|run| *run >= STUCK_SAMPLES && others_move);
        let frozen = broken.get(axis).and_then(|fault| fault.frozen);
        let samples = frozen.map(|frozen| frozen.samples).or(long);
        out.extend(samples.map(|samples| axes::stuck(axis, samples)));
    }
}

/// Axes that never read but one value, while another moves.
fn silent(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let q = &seen.looked.quality;
    let varies = |a: &AxisStats| a.max > a.min;
    if !q.axes.iter().any(varies) || q.count < LONG_RUN {
        return;
    }
    for (axis, stats) in q.axes.iter().enumerate().filter(|(_, a)| !varies(a)) {
        out.push(
            Finding::new(
                Severity::Note,
                axes::SILENT,
                format!(
                    "gyro {} reads {} in every sample",
                    axes::name(axis),
                    significant(stats.min, 4)
                ),
            )
            .with("axis", axes::name(axis))
            .with("reading", stats.min)
            .advise("fine for a body that turns about one axis; a real sensor has noise"),
        );
    }
}

/// Rows that are bad in themselves, though they be used.
fn rows(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    use Severity::Warning;
    let (q, total) = (&seen.looked.quality, seen.total);
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

/// Makes a note of a bias that the filter estimates: nothing is to be done about it.
pub(super) fn follow_bias(found: &mut Finding) {
    if found.code == BIAS_CODE {
        found.severity = Severity::Note;
        found.advice =
            "the filter estimates it; with the gyro alone it has to be removed".to_owned();
    }
}

/// Code of the finding of a bias at rest.
const BIAS_CODE: &str = "bias";

/// A bias at rest.
fn bias(seen: &Seen<'_>, out: &mut Vec<Finding>) {
    let Some(found) = &seen.looked.bias else {
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
                BIAS_CODE,
                format!(
                    "gyro bias {} deg/s ({} +- {} deg/h) at rest; the attitude drifts as fast",
                    significant(size / 3600.0, 2),
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

/// Largest rate of a gyro with three axes, deg/s, with room: larger numbers are no deg/s either.
const WIDEST_RANGE: f64 = 4600.0;

/// Finding for rates that no gyro reaches in rad/s.
pub(super) fn rates_of_another_unit(peak: f64) -> Finding {
    if peak > WIDEST_RANGE {
        return Finding::new(
            Severity::Error,
            "unit-unknown",
            format!("rates reach {peak:.0}: no gyro measures that in rad/s or deg/s: raw counts, or another unit"),
        )
        .with("largest_rate", peak)
        .advise("its data sheet says how many counts are one deg/s: rad/s are 0.01745 over that many")
        .help([GYRO_SCALE.to("FACTOR")]);
    }
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
