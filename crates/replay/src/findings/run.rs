//! Counts of a run -> findings, the same of a log and of a live sensor. Pure.

use super::{Finding, Severity, axes, cures, magnetometer, orientation, samples, sensors, stream};
use crate::field_watch::Saturated;
use crate::summary::aid::Frozen;
use crate::summary::clocks::{clock_was_set, counter_wraps};
use crate::summary::{Gaps, TopicSummary, significant};
use strapd_attitude::condition::quality::{AxisFault, LONGEST_GAP_NANOS};
use strapd_attitude::condition::{Report, SpikeCount};
use strapd_attitude::consistency::{Consistency, FieldConsistency};
use strapd_attitude::estimate::{EstimationSettings, Meaning, batches_message};
use strapd_attitude::frames::BodyAxes;
use strapd_attitude::propagate;
use strapd_attitude::record::Verdict;
use strapd_attitude::setting::{
    AGAINST_RECORDED, AID, GYRO_RANGE, GYRO_UNIT, MAX_GAP, ON_GAP, RATE_HZ, REGULARISE_STAMPS,
    SPIKES, START, TIME, TOPIC, UNTIL,
};

/// Largest turn per step that integrates well whatever the motion: beyond, aliasing is near.
const LARGE_STEP_DEG: f64 = 30.0;
/// Above this a rate is probably not in rad/s: 200 rad/s is 11,500 deg/s, five times what most gyros
/// can measure.
const UNLIKELY_RATE: f64 = 200.0;

/// Facts that a run knows of its samples and its summary does not state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noted<'a> {
    /// Counts of conditioning.
    pub(crate) conditioning: &'a Report,
    /// Largest component of any rate, rad/s.
    pub(crate) largest_rate: f64,
    /// Samples whose format marks their gyro as absent.
    pub(crate) marked_absent: u64,
    /// Samples without any rate amid others.
    pub(crate) zeros: u64,
    /// Stamps with a second or more of nanoseconds.
    pub(crate) stamps_carried: u64,
    /// Time for which the magnetic field stood still while the body rotated.
    pub(crate) frozen_field: Option<Frozen>,
    /// Axis of the magnetometer at the end of its range.
    pub(crate) saturated_field: Option<Saturated>,
    /// Axis of the magnetometer that reads but one value, and that.
    pub(crate) dead_field: Option<(usize, f64)>,
    /// Frames of other bodies on the topic, and how many messages named them.
    pub(crate) left_out: &'a [(String, u64)],
    /// Gyro held against accelerometer, with what the samples were taken for.
    pub(crate) gyro: Option<(&'a Consistency, &'a EstimationSettings, &'a Meaning)>,
    /// Gyro held against magnetometer.
    pub(crate) field: Option<(&'a FieldConsistency, &'a EstimationSettings)>,
    /// Orientations that were compared with; `None` where none were to be.
    pub(crate) references: Option<u64>,
    /// Faults of single axes of the gyro.
    pub(crate) axes: [AxisFault; 3],
    /// Whether the body's z points down at rest, and for most of the run.
    pub(crate) is_upside_down: bool,
}

/// Everything a replay says of a topic beside its numbers. The gaps have a line of their own there.
pub(crate) fn of_run(summary: &TopicSummary, noted: &Noted<'_>) -> Vec<Finding> {
    let mut out = Vec::new();
    if summary.counts.used() == 0 {
        out.push(nothing_used(summary));
    }
    if noted.largest_rate > UNLIKELY_RATE {
        out.push(samples::rates_of_another_unit(noted.largest_rate));
    }
    out.extend(steps(summary.undersampled, summary.largest_step).filter(is_no_opinion));
    let total = summary.counts.total();
    out.extend(samples::gyro_absent(noted.marked_absent, total));
    match (summary.smoothing(), &summary.aided) {
        (Some(smoothing), _) => out.extend(smoothing.doubts(&summary.noise)),
        (None, Some(aided)) => {
            let refused = summary.not_smoothed();
            out.extend(refused.map(|why| {
                Finding::new(
                    Severity::Warning,
                    "not-smoothed",
                    format!("not smoothed: {why}"),
                )
            }));
            out.extend(aided.given_up());
            out.extend(aided.doubt(&summary.noise));
        }
        (None, None) => {}
    }
    out.extend(
        noted
            .frozen_field
            .map(|frozen| field_frozen(noted.conditioning, frozen)),
    );
    out.extend(noted.saturated_field.map(field_saturated));
    out.extend(noted.dead_field.map(field_axis_dead));
    out.extend(samples::zero_rows(noted.zeros, total));
    if noted.stamps_carried > 0 {
        let n = noted.stamps_carried;
        out.push(
            Finding::new(
                Severity::Warning,
                "stamps-carried",
                format!("{n} stamps had a second or more of nanoseconds, carried over"),
            )
            .with("count", n),
        );
    }
    for (frame, n) in noted.left_out {
        let (name, _) = summary
            .topic
            .split_once('@')
            .unwrap_or((&summary.topic, ""));
        out.push(
            Finding::new(
                Severity::Error,
                "other-frame",
                format!("{n} messages name the frame `{frame}`, another body's, and were left out"),
            )
            .with("frame", frame.as_str())
            .with("count", *n)
            .help([TOPIC.to(format!("{name}@{frame}"))]),
        );
    }
    out.extend(stamps(noted.conditioning, &summary.clock));
    if summary.stamps.as_ref().is_some_and(|stamps| stamps.uneven) {
        out.push(
            Finding::new(
                Severity::Warning,
                "no-constant-rate",
                format!("{REGULARISE_STAMPS}: there was no constant rate in this stream"),
            )
            .advise("leave it out, or number the samples")
            .help([TIME.to("index"), RATE_HZ.to("HZ")]),
        );
    }
    out.extend(stream::find(noted.conditioning, false));
    out.extend(saturated(noted.conditioning));
    if let Some((_, _, resolved)) = noted.gyro.filter(|_| noted.is_upside_down)
        && resolved.body != BodyAxes::Frd
    {
        out.push(samples::upside_down(resolved.body));
    }
    out.extend(axes::hung(&noted.axes));
    let wanders = noted.gyro.is_some_and(|(gyro, ..)| gyro.wanders());
    out.extend(axes::broken(&noted.axes, wanders));
    out.extend(spikes(noted.conditioning));
    out.extend(force_spikes(noted.conditioning));
    if let Some(references) = noted.references.filter(|_| summary.against.is_empty()) {
        out.push(no_reference(references));
    }
    out.extend(orientation::of_run(summary));
    let changed = noted.gyro.and_then(|(gyro, plan, _)| {
        stream::axes_changed(gyro, plan, noted.conditioning.first, false)
    });
    let disagrees = || sensors::disagreement(noted.gyro?, orientation::witness(summary));
    let leap = noted
        .gyro
        .and_then(|(gyro, ..)| stream::gravity_leap(gyro, noted.conditioning.first, false));
    out.extend(leap);
    let bias = || {
        noted
            .gyro
            .and_then(|(gyro, ..)| stream::bias_changed(gyro, noted.conditioning.first))
    };
    let by_orientation =
        || orientation::other_unit(summary).or_else(|| orientation::other_scale(summary));
    let of_gyro = changed
        .or_else(bias)
        .or_else(disagrees)
        .or_else(by_orientation);
    // A gyro that is wrong against gravity turns against the field, too: the gyro is cured first.
    let is_gyro_sound = of_gyro.is_none() && noted.gyro.is_none_or(|(gyro, ..)| gyro.agrees());
    out.extend(of_gyro);
    if let Some((field, plan)) = noted.field.filter(|_| is_gyro_sound) {
        out.extend(magnetometer::finding(field, plan));
    }
    sensors::settle(&mut out);
    stream::settle(&mut out);
    cures::offer(&mut out);
    out
}

/// Findings from a live sensor's counts, for `STATUS`. `clock`: of its stamps.
#[must_use]
pub fn of_sensor(report: &Report, propagation: &propagate::Report, clock: &str) -> Vec<Finding> {
    let held = Gaps::of(report, propagation);
    let mut out: Vec<Finding> = gaps(&held).into_iter().collect();
    out.extend(steps(propagation.undersampled, propagation.largest_step));
    out.extend(stamps(report, clock));
    out.extend(report.clock_set.map(clock_was_set));
    out.extend(report.wraps.map(counter_wraps));
    let batches = report.batches.as_ref().map(batches_message);
    out.extend(batches.map(|said| Finding::said(Severity::Warning, "batches", &said)));
    out.extend(saturated(report));
    out.extend(spikes(report));
    out.extend(force_spikes(report));
    out.extend(spikes_left(report));
    out.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    out
}

/// Whether it is more than an opinion about the motion, of which a replay's own numbers tell.
fn is_no_opinion(finding: &Finding) -> bool {
    finding.severity == Severity::Error
}

/// Why a run gave no attitude at all.
fn nothing_used(summary: &TopicSummary) -> Finding {
    let total = summary.counts.total();
    let trimmed = summary.counts.get(Verdict::Trimmed);
    let what = if total == 0 {
        "no sample was used: the topic has no messages".to_owned()
    } else if trimmed == total {
        format!("no sample was used: all {total} lie outside {START}, {UNTIL}")
    } else {
        format!("no sample was used: all {total} were turned away (see lost)")
    };
    Finding::new(Severity::Error, "nothing-used", what).with("samples", total)
}

/// Puts in what the run missed, in place of what the steps of the first samples make of it.
pub(super) fn missing(gaps: &Gaps, found: &mut Vec<Finding>) {
    let Some(at) = found.iter().position(|f| f.code == "missing") else {
        return;
    };
    if gaps.missing == 0 {
        found.remove(at);
    } else if let Some(old) = found.get_mut(at) {
        *old = samples::missing_samples(gaps.missing, gaps.longest_missing_secs, gaps.forward());
    }
}

/// Gaps and clock jumps that were not integrated over.
pub(super) fn gaps(gaps: &Gaps) -> Option<Finding> {
    let breaks = gaps.held + gaps.resets;
    if breaks == 0 {
        return None;
    }
    let forward = breaks.saturating_sub(gaps.jumps_back);
    let longest = gaps.longest_held_secs;
    let of_gaps = (forward > 0).then(|| {
        let (what, are) = match forward {
            1 => ("gap or clock jump", "is"),
            _ => ("gaps or clock jumps", "are"),
        };
        format!(
            "{forward} {what} {are} too long to integrate over, the longest {longest:.3} s, {:.1} s after the start",
            gaps.longest_at_secs
        )
    });
    let what: Vec<String> = of_gaps.into_iter().chain(gaps.back_text()).collect();
    let held = Finding::new(Severity::Error, "gap-held", what.join("; "))
        .with("count", breaks)
        .with("longest_s", longest)
        .with("longest_at_s", gaps.longest_at_secs)
        .with("total_s", gaps.held_secs)
        .with("jumps_back", gaps.jumps_back)
        .with("farthest_back_s", gaps.farthest_back_secs)
        .with("farthest_back_at_s", gaps.farthest_back_at_secs);
    let hour = LONGEST_GAP_NANOS as f64 * 1e-9;
    // Nobody bridges an hour, or a clock that was set back: such a stamp is wrong, or another clock's.
    Some(match gaps.jumps_back == 0 && longest <= hour {
        true => held
            .advise("the attitude is held there; bridge them where the motion was slow")
            .help([
                ON_GAP.to("bridge"),
                MAX_GAP.to(format!("{:.1}", (longest * 10.0).ceil() / 10.0)),
            ]),
        false => held
            .advise("the attitude is held there; a clock was set, or is not always the same one: another may be steadier")
            .help([TIME.to("log")])
            .help([TIME.to("header")]),
    })
}

/// Steps that turn far.
pub(super) fn steps(undersampled: u64, largest_step: f64) -> Option<Finding> {
    let step_deg = largest_step.to_degrees();
    if undersampled > 0 {
        return Some(
            Finding::new(
                Severity::Error,
                "under-sampled",
                format!(
                    "{undersampled} steps turn more than half a turn (up to {step_deg:.0} deg): the samples are too few for the motion, or the unit is wrong"
                ),
            )
            .with("steps", undersampled)
            .with("largest_step_deg", step_deg)
            .advise("check the unit first; otherwise sample faster")
            .help([GYRO_UNIT.to("deg")]),
        );
    }
    (step_deg > LARGE_STEP_DEG).then(|| {
        Finding::new(
            Severity::Warning,
            "large-turn-per-step",
            format!("up to {step_deg:.0} deg are turned in one step: few samples for this motion"),
        )
        .with("largest_step_deg", step_deg)
        .advise("sample faster; delta angles suffer less than rates")
    })
}

/// A magnetometer that says the same while the body rotates.
pub(super) fn field_frozen(report: &Report, frozen: Frozen) -> Finding {
    let at = report
        .first
        .map_or(0.0, |first| frozen.from.secs_since(first));
    Finding::new(
        Severity::Warning,
        "field-frozen",
        format!(
            "the magnetic field stood still to the bit for {:.3} s while the body rotated, first {at:.3} s after the start",
            frozen.secs
        ),
    )
    .with("secs", frozen.secs)
    .with("first_at_s", at)
    .advise("the heading is the gyro's there: the magnetometer or its driver hung")
}

/// Finding of a magnetometer of which one axis reads but one value.
pub(super) fn field_axis_dead((axis, reading): (usize, f64)) -> Finding {
    let name = axes::name(axis);
    Finding::new(
        Severity::Error,
        "field-axis-dead",
        format!(
            "magnetometer {name} reads {} in every sample while the others turn: dead?",
            significant(reading, 4)
        ),
    )
    .with("axis", name)
    .with("reading", reading)
    .advise(
        "two axes of a field tell no heading: the magnetometer or its driver is broken; without it",
    )
    .help([AID.to("gravity")])
}

/// A magnetometer at the end of its range.
pub(super) fn field_saturated(found: Saturated) -> Finding {
    let axis = ["x", "y", "z"].get(found.axis).copied().unwrap_or("");
    Finding::new(
        Severity::Warning,
        "field-saturated",
        format!(
            "the magnetometer reads {} along {axis} in {} of {} fields, and never more: it is at the end of its range",
            significant(found.level, 4),
            found.samples,
            found.of
        ),
    )
    .with("axis", axis)
    .with("level", found.level)
    .with("fields", found.samples)
    .advise("the heading is wrong there: a wider range, or no magnet and no steel so near")
}

/// Stamps that several samples share.
fn stamps(report: &Report, clock: &str) -> Option<Finding> {
    let restamped = report.counts.get(Verdict::Restamped);
    if let Some(step) = report.coarse_nanos {
        let other = if clock == "log" { "header" } else { "log" };
        let in_each = report
            .spacing_nanos
            .filter(|n| *n > 0)
            .map_or(0.0, |n| step as f64 / n as f64);
        return Some(
            Finding::new(
                Severity::Warning,
                "coarse-stamps",
                format!(
                    "the {clock} stamps count in steps of {} s, {in_each:.1} samples in each: these were spread over it evenly ({restamped} of them), so a stamp is good to a part of that step",
                    significant(step as f64 * 1e-9, 3)
                ),
            )
            .with("step_s", step as f64 * 1e-9)
            .with("count", restamped)
            .advise("another clock may be finer")
            .help([TIME.to(other)]),
        );
    }
    (restamped > 0).then(|| {
        Finding::new(
            Severity::Warning,
            "shared-stamps",
            format!(
                "{restamped} samples shared their stamp with another and were given one of their own between their neighbours"
            ),
        )
        .with("count", restamped)
    })
}

/// Samples at the end of the gyro's range, where that was said.
fn saturated(report: &Report) -> Option<Finding> {
    let n = report.saturated;
    (n > 0).then(|| {
        Finding::new(
            Severity::Warning,
            "at-range",
            format!("{n} samples reach the gyro's range ({GYRO_RANGE}): the true rate was higher"),
        )
        .with("count", n)
    })
}

/// Readings of the gyro that nothing around them agrees with.
fn spikes(report: &Report) -> Option<Finding> {
    let found = report.spikes;
    let at = first_at(report, &found);
    let done = format!(", first {at:.3} s after the start: repaired");
    let finding = spikes_of((found.samples, found.largest), &done)?.with("first_at_s", at);
    let advice = "each was replaced by the line between its neighbours; to leave them as recorded";
    Some(finding.advise(advice).help([SPIKES.to("keep")]))
}

fn spikes_of((samples, largest): (u64, f64), done: &str) -> Option<Finding> {
    let shown = significant(largest, 3);
    (samples > 0).then(|| {
        Finding::new(
            Severity::Warning,
            "spikes",
            format!("{samples} spikes of the gyro, up to {shown} rad/s{done}"),
        )
        .with("count", samples)
        .with("largest_rad_s", largest)
    })
}

/// Time of the first spike since the start, s.
fn first_at(report: &Report, found: &SpikeCount) -> f64 {
    let both = found.first.zip(report.first);
    both.map_or(0.0, |(spike, first)| spike.secs_since(first))
}

/// Forces that nothing around them agrees with, and of which the gyro felt nothing.
fn force_spikes(report: &Report) -> Option<Finding> {
    let found = report.force_spikes;
    let at = first_at(report, &found);
    let (samples, shown) = (found.samples, significant(found.largest, 3));
    (samples > 0).then(|| {
        Finding::new(
            Severity::Warning,
            "accel-spikes",
            format!("{samples} spikes of the accelerometer, up to {shown} m/s^2, first {at:.3} s after the start: left out"),
        )
        .with("count", samples)
        .with("largest_m_s2", found.largest)
        .with("first_at_s", at)
        .advise("the gyro felt nothing of them; to leave them as recorded")
        .help([SPIKES.to("keep")])
    })
}

/// The same where a live stream could not go back to what was before.
fn spikes_left(report: &Report) -> Option<Finding> {
    let found = report.spikes_left;
    let finding = spikes_of((found.samples, found.largest), ": left as they came")?;
    Some(finding.advise("there was no state to go back to: mend the bus or its driver"))
}

fn no_reference(found: u64) -> Finding {
    match found {
        0 => Finding::new(
            Severity::Warning,
            "no-reference",
            format!("{AGAINST_RECORDED}: the log holds no orientation to compare with"),
        )
        .advise("name its topic")
        .help([AGAINST_RECORDED.to("TOPIC")]),
        n => Finding::new(
            Severity::Warning,
            "no-reference",
            format!("{AGAINST_RECORDED}: no two of the {n} recorded orientations are 1 s apart"),
        ),
    }
}
