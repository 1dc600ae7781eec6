//! Requests of a run that could not be met -> why. Pure.
//!
//! Apart from the summary because it is no property of an attitude: who asked for north and had no field, or for a
//! window without a sample, gets no output, and not one that claims what it has not.

use super::delivery::Resampled;
use super::session::Topic;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_attitude::record::{Nanos, Verdict};
use strapd_attitude::setting::{
    ACCEL_TOPIC, AID, AT, FIELD, LINEAR_ACCELERATION, MAG_TOPIC, START, UNTIL,
};

/// Why a topic has not what was asked for; `None` where it has, or gave no attitude at all for other reasons.
pub(super) fn unmet(plan: &EstimationSettings, topic: &Topic) -> Option<Diagnostic> {
    let counts = topic.estimator.conditioning().counts;
    let total = counts.total();
    if is_outside(topic) {
        let mut window = [(START, plan.start), (UNTIL, plan.until)]
            .into_iter()
            .filter_map(|(name, secs)| Some(format!("{name} {}", secs?)));
        let named: Vec<String> = window.by_ref().collect();
        let first = topic.estimator.conditioning().first_bad(Verdict::Trimmed);
        let lasts = first
            .and_then(|first| Some(topic.last_stamp?.secs_since(first.stamp?)))
            .map_or_else(String::new, |secs| format!(", which last {secs:.3} s"));
        return Some(
            Diagnostic::new(format!(
                "{}: none of the {total} samples{lasts}, lies in that window",
                named.join(" ")
            ))
            .help(format!(
                "{START}, {UNTIL} are seconds after the first sample"
            )),
        );
    }
    if let Some(of) = topic.instants.filter(|of| of.missing() == of.asked) {
        return Some(without_attitude(&of, topic));
    }
    if plan.linear_acceleration && counts.used() > 0 && !topic.estimator.gives_acceleration() {
        let what = format!("{LINEAR_ACCELERATION}: there is no vertical to take gravity out along");
        return Some(Diagnostic::new(what).help(format!(
            "it needs an accelerometer that shows gravity: {FIELD} accel=PATH or {ACCEL_TOPIC} NAME says where it is"
        )));
    }
    let filter = topic.estimator.filter().filter(|_| counts.used() > 0)?;
    let asked = match plan.aid {
        Aid::None | Aid::Auto => return None,
        Aid::Gravity => format!("{AID} gravity"),
        Aid::GravityAndField => format!("{AID} gravity+mag"),
    };
    if !filter.is_started() {
        let what = format!("{asked}: no specific force belonged to one of the {total} samples");
        return Some(Diagnostic::new(what).help(format!(
            "{FIELD} accel=PATH or {ACCEL_TOPIC} NAME says where it is, {AID} none does without"
        )));
    }
    let why = topic.field.as_ref()?.no_field(filter.report().fields)?;
    Some(Diagnostic::new(format!("{asked}: {why}")).help(format!(
        "{MAG_TOPIC} NAME or {FIELD} mag=PATH names another, {AID} gravity does without"
    )))
}

/// Refusal of instants of which none has an attitude.
fn without_attitude(of: &Resampled, topic: &Topic) -> Diagnostic {
    let secs = |span: Option<(Nanos, Nanos)>| {
        let secs = |t: Nanos| t.0 as f64 * 1e-9;
        span.map_or_else(
            || "none".to_owned(),
            |(a, b)| format!("{:.3} to {:.3} s", secs(a), secs(b)),
        )
    };
    let output = &topic.output;
    let attitudes = output
        .first
        .zip(output.last)
        .map(|(a, b)| (a.stamp, b.stamp));
    Diagnostic::new(format!(
        "{AT}: none of the {} instants ({}) lies between attitudes ({})",
        of.asked,
        secs(of.span),
        secs(attitudes)
    ))
    .help(match (of.span, attitudes) {
        // They would all lie in it, if it began at 0.
        (Some((from, to)), Some((first, last))) if from.0 >= 0 && to.0 <= last.since(first) => {
            format!(
                "instants are on the clock of the samples' stamps; if these count from the first attitude, \
                 add {}.{:09} s to each",
                first.0.div_euclid(1_000_000_000),
                first.0.rem_euclid(1_000_000_000)
            )
        }
        _ => "instants are on the clock of the samples' stamps".to_owned(),
    })
}

/// Whether there were samples, all outside the window that was asked for.
pub(super) fn is_outside(topic: &Topic) -> bool {
    let counts = topic.estimator.conditioning().counts;
    counts.total() > 0 && counts.get(Verdict::Trimmed) == counts.total()
}
