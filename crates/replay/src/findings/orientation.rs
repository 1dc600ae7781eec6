//! A recorded orientation, and what it says about the samples -> findings. Pure.

mod causes;

pub(super) use causes::{Witness, other_scale, other_unit, witness};

use super::{Finding, Severity};
use crate::inspection::CheckedTopic;
use crate::summary::against::{
    axes_json, axes_words, beyond_sigma, bias_json, bias_words, consistency_json, removing, resets,
};
use crate::summary::{Against, Recorded, TopicSummary, significant};
use nalgebra::Vector3;
use serde_json::json;
use strapd_attitude::compare::{BiasFit, BodyAxesFit, Consistency};
use strapd_attitude::estimate::KindReason;
use strapd_attitude::record::SampleKind;
use strapd_attitude::setting::{AID, BIAS, Choice, METHOD, MOUNT, NOISE, SAMPLE_KIND, TIME};

/// A meaning is better when its median error is below this share of the other's.
const CLEARLY: f64 = 0.95;
/// A meaning is certain when its median error over 1 s is below this share of the other's, which is above so many degrees.
const CERTAINLY: f64 = 0.2;
const LOST: f64 = 5.0;
/// A bias explains an error when it leaves less than this share of it.
const EXPLAINED: f64 = 0.4;
/// Turns over 1 s above this are a motion, rad (2 degrees).
const SMALL: f64 = 0.035;
/// Share of the time in gaps above which the rotation is not known.
const MOSTLY_THERE: f64 = 0.5;
/// An orientation that misses the motion by this share of it does not follow the gyro.
const ANOTHER_MOTION: f64 = 0.5;
/// Share of the motion below which a bias is believed: of a motion about one axis other axes look like a bias.
const SMALL_SHARE: f64 = 0.3;
/// A heading that is off by more than this is worth a word though sigma allows it: 15 degrees in rad.
const DRIFTED: f64 = 15.0 * std::f64::consts::PI / 180.0;
/// Two biases that differ by less than this share are the same.
const SAME: f64 = 0.3;

/// Code of errors that are larger than sigma allows.
pub(super) const BEYOND_SIGMA: &str = "beyond-sigma";
/// Code of an orientation whose clock is another.
const SHIFTED: &str = "orientation-shifted";
/// Code of a meaning of samples that fits better than the one used.
pub(super) const MEANING: &str = "sample-kind";
/// Codes of what is said of a recorded orientation: of a log that is examined it is said once it is known for a truth.
pub(super) const CODES: [&str; 7] = [
    MEANING,
    SHIFTED,
    "orientation-leans",
    "bias-by-orientation",
    BEYOND_SIGMA,
    "heading-drift",
    "no-reference",
];

pub(super) fn find(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    let Ok(summary) = &topic.replayed else {
        return;
    };
    let Some(recorded) = &summary.recorded else {
        out.extend(meaning_unknown(summary));
        return;
    };
    let is_seen = summary.gaps.total_secs <= MOSTLY_THERE * summary.duration_secs;
    if topic.looked.clock_set.is_some() && topic.looked.quality.with_orientation == 0 {
        out.push(of_another_clock());
        out.extend(meaning_unknown(summary));
        return;
    }
    if let Some(what) = resets(recorded.resets) {
        let note = Finding::new(Severity::Note, "orientation-reset", what);
        out.push(note.with("resets", recorded.resets));
    }
    if let Some(found) = explained(summary, recorded) {
        let is_shift = found.as_ref().is_some_and(|f| f.code == SHIFTED);
        out.extend(found);
        out.extend(meaning_unknown(summary).filter(|_| is_shift));
        return;
    }
    let trusted = is_truth(recorded, is_seen, out);
    let used = summary.kind.name();
    match best_meaning(&summary.against) {
        Some(best) if trusted => meaning(&summary.against, best, used, out),
        _ => out.extend(meaning_unknown(summary)),
    }
    if trusted {
        let at_rest = topic.looked.bias.as_ref().map(|found| found.bias.0);
        told_by_it(summary, recorded, at_rest, out);
    }
}

/// Finding of orientations on a topic of their own, beside samples whose clock was set.
fn of_another_clock() -> Finding {
    Finding::new(
        Severity::Note,
        "no-reference",
        "the recorded orientation has stamps of its own, of which the steps of the clock are not taken off",
    )
    .advise("it is not compared; on the recorder's clock it can be")
    .help([TIME.to("log")])
}

/// Findings of a replay about the orientation it was compared with: nothing of its bias if that is no truth.
pub(super) fn of_run(summary: &TopicSummary) -> Vec<Finding> {
    let mut found = Vec::new();
    if let Some(recorded) = &summary.recorded
        && let Some(cause) = explained(summary, recorded)
    {
        found.extend(cause);
        return found;
    }
    if let Some(best) = best_meaning(&summary.against) {
        meaning(&summary.against, best, summary.kind.name(), &mut found);
    }
    let Some(recorded) = &summary.recorded else {
        return found;
    };
    let is_seen = summary.gaps.total_secs <= MOSTLY_THERE * summary.duration_secs;
    if is_truth(recorded, is_seen, &mut Vec::new()) {
        told_by_it(summary, recorded, None, &mut found);
    }
    found
}

/// Finding of the one cause that explains what the orientation contradicts, so that nothing else is concluded from it;
/// `Some(None)` where the run names it beside its other sensors.
fn explained(summary: &TopicSummary, recorded: &Recorded) -> Option<Option<Finding>> {
    if other_unit(summary).is_some() {
        return Some(None);
    }
    if let (Some(best), Some(used)) = (best_meaning(&summary.against), used(summary))
        && is_certain(best, used)
    {
        let mut found = Vec::new();
        meaning(&summary.against, best, used.kind, &mut found);
        return Some(found.pop());
    }
    if let Some(shift) = &recorded.shift {
        return Some(Some(causes::shifted(shift)));
    }
    other_scale(summary).map(|_| None)
}

/// Whether the orientation follows the gyro by this meaning of a sample, and by the one used it does not at all.
fn is_certain(best: &Against, used: &Against) -> bool {
    best.median_deg < CERTAINLY * used.median_deg && used.median_deg > LOST
}

/// Error over a second by the meaning that was used.
fn used(summary: &TopicSummary) -> Option<&Against> {
    let mut rows = summary.against.iter();
    rows.find(|row| row.kind == summary.kind.name())
}

/// A bias by which the gyro leaves it, and a sigma that does not hold. `at_rest` is the bias that a rest shows.
fn told_by_it(
    summary: &TopicSummary,
    recorded: &Recorded,
    at_rest: Option<Vector3<f64>>,
    out: &mut Vec<Finding>,
) {
    let mut help: Option<Choice> = None;
    // What the filter has learned needs no flag.
    let is_learned = |fit: &BiasFit| {
        let aided = summary.aided.as_ref();
        aided.is_some_and(|aided| (aided.bias() - fit.bias).norm() < SAME * fit.bias.norm())
    };
    let bias = recorded
        .bias
        .filter(|fit| is_bias(recorded, fit) && !is_learned(fit));
    if let Some(fit) = bias {
        let left = |rest: Vector3<f64>| rest - Vector3::from(recorded.removed) - fit.bias;
        if at_rest.is_some_and(|rest| left(rest).norm() < SAME * fit.bias.norm()) {
            // Said already.
            help = Some(BIAS.to("auto"));
        } else {
            help = Some(removing(&fit, recorded.removed));
            out.push(
                Finding::new(
                    Severity::Warning,
                    "bias-by-orientation",
                    bias_words(&fit, "the gyro", "the recorded orientation"),
                )
                .with("fit", bias_json(&fit))
                .advise("remove it; of another run of the sensor it may be another")
                .help(help.clone()),
            );
        }
    }
    let Some(found) = &recorded.consistency else {
        return;
    };
    if let Some(lean) = found.leaning.filter(|lean| *lean > causes::LEANS) {
        out.push(causes::leaning(lean, recorded.accel_axes));
    }
    let Some(what) = beyond_sigma(found) else {
        heading_drift(found, help, out);
        return;
    };
    let advice = if help.is_some() {
        "without that bias it may hold"
    } else if summary.aided.is_some() {
        "the motion violates the filter's assumptions, or the reference is wrong"
    } else {
        "the sensor is worse than its class, or the reference is wrong"
    };
    // The next worse class; there is none behind the last, and a list is the user's own.
    let worse = match summary.noise.as_str() {
        "consumer" => Some(NOISE.to("uncalibrated")),
        "industrial" | "tactical" | "navigation" => Some(NOISE.to("consumer")),
        _ => None,
    };
    if summary.aided.is_none() {
        help = help.or(worse);
    }
    out.push(
        Finding::new(Severity::Warning, BEYOND_SIGMA, what)
            .with("sigma", consistency_json(found))
            .with("noise", summary.noise.clone())
            .advise(advice)
            .help(help),
    );
}

/// A heading that sigma allows, and nobody expects.
fn heading_drift(found: &Consistency, help: Option<Choice>, out: &mut Vec<Finding>) {
    if found.heading.rms < DRIFTED {
        return;
    }
    let deg = |v: f64| significant(v.to_degrees(), 2);
    let advice = match help {
        Some(_) => "without that bias it is less".to_owned(),
        None => format!(
            "the gyro alone does not hold it, nor does gravity: a magnetic field does ({AID} gravity+mag)"
        ),
    };
    out.push(
        Finding::new(
            Severity::Warning,
            "heading-drift",
            format!(
                "the heading leaves the recorded orientation by {} deg (rms), within its sigma of {}",
                deg(found.heading.rms),
                deg(found.heading.sigma)
            ),
        )
        .with("sigma", consistency_json(found))
        .advise(advice)
        .help(help),
    );
}

/// Whether what was fitted is a bias: worth removing, and no other axes that look like one.
fn is_bias(recorded: &Recorded, fit: &BiasFit) -> bool {
    let one_axis = recorded.axes.is_none() && fit.turn > SMALL;
    fit.is_worth_removing() && !(one_axis && fit.bias.norm() > SMALL_SHARE * fit.turn)
}

/// Whether a bias explains what other axes might.
fn bias_explains(recorded: &Recorded) -> bool {
    recorded.bias.is_some_and(|fit| {
        let [before, after] = fit.over_1s;
        is_bias(recorded, &fit) && after < EXPLAINED * before
    })
}

/// Note that the ordinary step alone has decided what a sample is.
fn meaning_unknown(summary: &TopicSummary) -> Option<Finding> {
    let (KindReason::Step(_) | KindReason::Unknown) = summary.kind_reason else {
        return None;
    };
    let taken = match summary.kind {
        SampleKind::Average => "mean",
        _ => "rate",
    };
    Some(
        Finding::new(
            Severity::Note,
            "sample-kind-unknown",
            format!(
                "{}; whether a sample is the rate at its stamp or the mean over its interval is not said, it is taken as the {taken}",
                summary.kind_reason
            ),
        )
        .advise("the sensor's manual says it; it matters more than the integrator")
        .help([SAMPLE_KIND.to("rate|average|delta-angle")]),
    )
}

fn best_meaning(rows: &[Against]) -> Option<&Against> {
    rows.iter()
        .min_by(|a, b| a.median_deg.total_cmp(&b.median_deg))
}

/// Adds the meaning of a sample that fits, when it is clearly not the one used.
fn meaning(rows: &[Against], best: &Against, used: &str, out: &mut Vec<Finding>) {
    let Some(current) = rows.iter().find(|r| r.kind == used) else {
        return;
    };
    if best.median_deg >= CLEARLY * current.median_deg {
        return;
    }
    let help = match best.kind {
        "held" => METHOD.to("dcm-left"),
        kind => SAMPLE_KIND.to(kind),
    };
    let severity = match is_certain(best, current) {
        true => Severity::Error,
        false => Severity::Warning,
    };
    out.push(
        Finding::new(
            severity,
            MEANING,
            format!(
                "taken as {used}, the samples miss the recorded orientation by {} deg over 1 s (median); as {}, by {} deg",
                significant(current.median_deg, 3),
                best.meaning,
                significant(best.median_deg, 3)
            ),
        )
        .with(
            "median_deg",
            json!(
                rows.iter()
                    .map(|r| (r.kind.to_owned(), json!(r.median_deg)))
                    .collect::<serde_json::Map<_, _>>()
            ),
        )
        .with("pairs", best.pairs)
        .advise("take them so")
        .help([help]),
    );
}

/// Whether the recorded orientation can be a reference; what is wrong with it is said. Of its axes nothing can be
/// where the motion was not seen.
fn is_truth(recorded: &Recorded, is_seen: bool, out: &mut Vec<Finding>) -> bool {
    if recorded.unusable > 0 {
        out.push(
            Finding::new(
                Severity::Warning,
                "orientation-invalid",
                format!(
                    "{} recorded orientations are no rotation (zero, NaN, or far from norm 1)",
                    recorded.unusable
                ),
            )
            .with("count", recorded.unusable)
            .with("usable", recorded.usable)
            .advise("they are left out of comparisons; do not start from one"),
        );
    }
    if recorded.constant {
        out.push(
            Finding::new(
                Severity::Warning,
                "orientation-constant",
                format!(
                    "all {} recorded orientations are the same: the field is not filled",
                    recorded.usable
                ),
            )
            .with("count", recorded.usable)
            .advise("it is no reference"),
        );
        return false;
    }
    is_seen && (bias_explains(recorded) || recorded.axes.is_none_or(|fit| axes_agree(&fit, out)))
}

fn axes_agree(fit: &BodyAxesFit, out: &mut Vec<Finding>) -> bool {
    if fit.agrees() {
        return true;
    }
    let deg = f64::to_degrees;
    let evidence = |finding: Finding| {
        let json = axes_json(fit);
        let found = json.as_object().into_iter().flatten();
        found.fold(finding, |finding, (name, value)| {
            finding.with(name, value.clone())
        })
    };
    if fit.inverse {
        out.push(evidence(
            Finding::new(
                Severity::Warning,
                "orientation-inverse",
                format!(
                    "the recorded orientation follows the gyro only as its inverse ({} deg over 1 s instead of {}): it takes world to body, or its numbers are in another order",
                    significant(deg(fit.turned), 3),
                    significant(deg(fit.as_recorded), 3)
                ),
            )
            .advise("invert it where it was written; docs/conventions.md lists who means what"),
        ));
        return false;
    }
    if fit.are_others() {
        let [w, x, y, z] = fit.turn.wxyz();
        out.push(evidence(
            Finding::new(
                Severity::Warning,
                "orientation-other-axes",
                axes_words(fit, "the recorded orientation", "the gyro's"),
            )
            .advise("state the gyro's axes, or its mounting")
            .help([MOUNT.to(format!("q={w:.6},{x:.6},{y:.6},{z:.6}"))]),
        ));
        return false;
    }
    if fit.as_recorded > ANOTHER_MOTION * fit.median_turn {
        out.push(evidence(
            Finding::new(
                Severity::Warning,
                "orientation-unrelated",
                format!(
                    "the recorded orientation does not follow the gyro: {} deg of error over 1 s, of {} deg turned",
                    significant(deg(fit.as_recorded), 3),
                    significant(deg(fit.median_turn), 3)
                ),
            )
            .advise("it is no reference for these samples, or their clocks differ"),
        ));
        return false;
    }
    true
}
