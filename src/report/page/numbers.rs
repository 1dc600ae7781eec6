//! Results about a topic -> JSON. Pure.

use super::Noise;
use crate::report::series::{Drawn, Errors, Mark};
use serde_json::{Value, json};
use strapd_attitude::compare::{Comparison, ErrorStats};
use strapd_replay::inspection::CheckedTopic;

/// Rests told one by one.
const RESTS: usize = 1000;

/// One topic.
pub(super) fn topic(topic: &CheckedTopic, noise: Option<&Noise>) -> Value {
    let looked = &topic.looked;
    let q = &looked.quality;
    let (run, refused) = match &topic.replayed {
        Ok(summary) => (Some(summary), None),
        Err(why) => (None, Some(why)),
    };
    let drawn = run.and_then(|s| s.drawn.as_deref());
    json!({
        "topic": looked.topic,
        "type": looked.described.to_string(),
        "frame": looked.frame,
        "refused": refused.map(ToString::to_string),
        "replay": run.map(|s| s.json()),
        "first_ns": q.first.map(|n| n.0),
        "last_ns": q.newest.map(|n| n.0),
        "spacing": q.spacing.map(|s| json!({
            "median_s": s.median_secs, "rate_hz": s.rate_hz, "p99_s": s.p99_secs, "max_s": s.max_secs,
            "jitter_p50_s": s.jitter_p50_secs, "jitter_p99_s": s.jitter_p99_secs,
            "jitter_max_s": s.jitter_max_secs,
        })),
        "jitter_histogram": q.jitter.iter().map(|(from, to, count)| json!({
            "from_ns": from, "to_ns": to, "count": count })).collect::<Vec<_>>(),
        "marks": drawn.map(marks),
        "rests": {
            "count": looked.rests.count,
            "total_s": looked.rests.secs,
            "longest_s": longest_rest(topic).map(|(_, secs)| secs),
            "first": looked.rests.kept.iter().take(RESTS).map(|r| json!({
                "start_s": looked.rests.first.map(|f| r.start.secs_since(f)), "duration_s": r.secs(),
            })).collect::<Vec<_>>(),
        },
        "bias": looked.bias.map(|b| json!({
            "x": b.bias.0.x, "y": b.bias.0.y, "z": b.bias.0.z, "sigma": b.sigma.max(), "rest_s": b.secs })),
        "allan": match noise {
            Some(Noise::Measured { json, .. }) => json.clone(),
            Some(Noise::Missing(why)) => json!({ "missing": why }),
            None => Value::Null,
        },
        "reference_error": drawn.and_then(|d| d.errors.as_ref()).map(errors),
    })
}

/// Beginning of the longest rest, seconds after the first sample, and its length.
#[must_use]
pub fn longest_rest(topic: &CheckedTopic) -> Option<(f64, f64)> {
    let rests = &topic.looked.rests;
    let longest = rests
        .kept
        .iter()
        .max_by(|a, b| a.secs().total_cmp(&b.secs()))?;
    Some((longest.start.secs_since(rests.first?), longest.secs()))
}

fn marks(drawn: &Drawn) -> Value {
    let counts = Mark::ALL.iter().zip(&drawn.marks);
    counts
        .map(|(mark, found)| (mark.name().to_owned(), json!(found.samples)))
        .collect::<serde_json::Map<_, _>>()
        .into()
}

fn errors(errors: &Errors) -> Value {
    json!({
        "usable": errors.usable,
        "unusable": errors.unusable,
        "kept_every": errors.stride,
        "kinds": errors.traces.iter().map(|t| {
            let mut value = comparison_json(&t.comparison);
            if let Some(object) = value.as_object_mut() {
                object.insert("kind".to_owned(), t.kind.into());
                object.insert("used".to_owned(), t.is_used.into());
                object.insert("align".to_owned(), "first".into());
            }
            value
        }).collect::<Vec<_>>(),
    })
}

/// A comparison's numbers, as `strapd compare --json` has them.
#[must_use]
pub fn comparison_json(result: &Comparison) -> Value {
    let stats = |s: &ErrorStats| {
        json!({ "rms_deg": s.rms.to_degrees(), "p95_deg": s.p95.to_degrees(),
                "max_deg": s.max.to_degrees(), "mean_deg": s.mean.to_degrees() })
    };
    json!({
        "samples": result.samples,
        "parts": result.parts,
        "span_s": result.span.map(|(a, b)| b.secs_since(a)),
        "left_out": {
            "bad_estimates": result.left_out.bad_estimates,
            "bad_references": result.left_out.bad_references,
            "outside": result.left_out.outside,
            "in_gap": result.left_out.in_gap,
        },
        "total": result.errors.as_ref().map(|e| stats(&e.total)),
        "heading": result.errors.as_ref().map(|e| stats(&e.heading)),
        "inclination": result.errors.as_ref().map(|e| stats(&e.inclination)),
        "drift_deg_per_h": result.drift.as_ref().map(|d| json!({
            "total": d.total_deg_per_hour(), "heading": d.heading_deg_per_hour() })),
        "relative_1s": result.relative_1s.as_ref().map(|r| json!({
            "median_deg": r.median.to_degrees(), "p95_deg": r.p95.to_degrees(), "pairs": r.count })),
    })
}
