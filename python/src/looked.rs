//! A recorded log -> what is in it, and what may spoil its attitude, as JSON. I/O.
//!
//! What `strapd info --json` and `strapd check --json` say, of the same numbers (`strapd-replay`); a test holds both beside each other.
//! The names of `info` stand here again, since the command has them for itself.

use crate::errand;
use crate::noted::noted;
use crate::recorded::{pool, raised};
use crate::refusal;
use crate::shell::{flag, quoted_file};
use pyo3::prelude::*;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use strapd_attitude::condition::quality::Advice;
use strapd_recording::decode::Options;
use strapd_recording::recording::beside::TopicOfVectors;
use strapd_recording::recording::log_channel::{LogChannel, rank};
use strapd_recording::recording::opened::problems;
use strapd_recording::{Input, Recording};
use strapd_replay::error::Result;
use strapd_replay::findings::{Finding, Severity, findings, of_samples};
use strapd_replay::inspection::{Aids, Inspection};
use strapd_replay::pipeline::check;
use strapd_replay::pipeline::inspection::{Looks, look};
use strapd_replay::pipeline::logged;

/// Rests that are listed.
const RESTS: usize = 100;
/// Units of a magnetic field, and the length of the Earth's in T with room for what iron does to it.
const FIELD_UNITS: [(&str, f64); 5] = [
    ("T", 1.0),
    ("G", 1e-4),
    ("mG", 1e-7),
    ("uT", 1e-6),
    ("nT", 1e-9),
];
const EARTHS_FIELD: std::ops::Range<f64> = 1.5e-5..1e-4;

/// What is in the log at `path`: JSON, and what was warned of.
#[pyfunction]
#[pyo3(signature = (path, /))]
pub fn info(py: Python<'_>, path: PathBuf) -> PyResult<(String, Vec<String>)> {
    let work = move || {
        let pool = pool(0)?;
        let options = Options::default();
        let input = logged::open(&path)?;
        let log = Recording::told_apart(&input, None, &options, &pool)?;
        let looks = look(&log, None, &options, &pool)?;
        Ok(told(&path, &input, &log, &looks).to_string())
    };
    answered(py, work)
}

/// Everything in the log at `path` that may spoil the attitude: JSON, and what was warned of.
#[pyfunction]
#[pyo3(signature = (path, topic, /))]
pub fn check_log(
    py: Python<'_>,
    path: PathBuf,
    topic: Option<String>,
) -> PyResult<(String, Vec<String>)> {
    let work = move || {
        let pool = pool(0)?;
        let input = logged::open(&path)?;
        let checked = check::check(&input, topic.as_deref(), &Options::default(), &pool)?;
        let found = findings(&checked);
        let worst = found.iter().map(|f| f.severity).max();
        let answer = json!({
            "file": input.name().display().to_string(),
            "findings": found.iter().map(Finding::json).collect::<Vec<_>>(),
            "worst": worst.map(Severity::name),
        });
        Ok(answer.to_string())
    };
    answered(py, work)
}

fn answered(
    py: Python<'_>,
    work: impl FnOnce() -> Result<String> + Send + 'static,
) -> PyResult<(String, Vec<String>)> {
    let (done, said) = errand::run(py, move |_| noted(work))?;
    let answer = done.map_err(|error| raised(py, &error))?;
    Ok((
        answer,
        said.iter().map(|line| refusal::of_log(line)).collect(),
    ))
}

fn told(path: &std::path::Path, input: &Input, log: &Recording, looks: &Looks) -> Value {
    let survey = &looks.survey;
    let mut read_as: Vec<&str> = log
        .channels
        .iter()
        .filter_map(|k| k.stated.as_ref())
        .map(|stated| stated.description.as_str())
        .filter(|said| said.starts_with("--columns"))
        .collect();
    read_as.dedup();
    json!({
        "file": input.name().display().to_string(),
        "bytes": survey.file_size,
        "format": survey.facts.format.name(),
        "profile": survey.facts.profile,
        "library": survey.facts.library,
        "messages": survey.messages,
        "log_time_ns": survey.times.map(|(a, b)| json!({ "first": a.to_string(), "last": b.to_string() })),
        "has_summary": survey.has_summary,
        "chunks": survey.facts.chunks.iter()
            .map(|(how, n)| (how.name().to_owned(), json!(n)))
            .collect::<Map<_, _>>(),
        "metadata_records": survey.facts.metadata,
        "attachments": survey.facts.attachments,
        "problems": problems(survey),
        "read_as": read_as,
        "topics": log.channels.iter().map(|k| json!({
            "topic": k.channel.topic,
            "type": k.channel.schema.as_deref().map(|s| s.name.as_str()),
            "message_encoding": k.channel.message_encoding,
            "messages": k.messages,
            "carries_rate": k.role.has_rate,
            "carries_orientation": k.role.has_orientation,
        })).collect::<Vec<_>>(),
        "not_looked_at": looks.left_out,
        "imu": looks.topics.iter().map(topic_told).collect::<Vec<_>>(),
        "next": next(&quoted_file(path), &log.channels, &looks.topics),
    })
}

/// The command to run next, with the flags this log needs.
fn next(file: &str, channels: &[LogChannel], looked: &[Inspection]) -> String {
    let best = match looked {
        [] => {
            return format!(
                "strapd replay {file} --topic NAME --field gyro=PATH   # no IMU topic here; this names a rate in any message"
            );
        }
        [one] => one,
        several => {
            let mut ranks = BTreeMap::new();
            for known in channels {
                let topic = known.channel.topic.as_str();
                ranks.entry(topic).or_insert_with(|| rank(&known.role));
            }
            let of = |l: &Inspection| ranks.get(l.of.as_str()).copied().unwrap_or(0);
            let best = several.iter().map(of).max().unwrap_or(0);
            let mut likely = several.iter().filter(|l| of(l) == best);
            match (likely.next(), likely.next()) {
                (Some(one), None) => one,
                (first, _) => {
                    return format!(
                        "strapd replay {file} {} -o attitude.mcap   # or another topic, or all",
                        flag("--topic", first.map_or("", |l| l.topic.as_str()))
                    );
                }
            }
        }
    };
    let mut flags = String::new();
    let is_degrees = |a: &Advice| matches!(a, Advice::RatesLookLikeDegrees { .. });
    if best.quality.advice.iter().any(is_degrees) {
        flags.push_str(" --gyro-unit deg");
    }
    if best.bias.is_some() {
        flags.push_str(" --bias auto");
        let rests = &best.rests;
        let from_start = rests
            .kept
            .first()
            .zip(rests.first)
            .is_some_and(|(rest, first)| {
                rest.mean_accel.is_some() && rest.start.secs_since(first) < 1.0
            });
        if from_start {
            flags.push_str(" --init gravity");
        }
    }
    if best.quality.with_orientation > 0 {
        flags.push_str(" --against-recorded");
    }
    format!("strapd replay {file} -o attitude.mcap{flags}")
}

fn topic_told(looked: &Inspection) -> Value {
    let q = &looked.quality;
    let found = of_samples(looked);
    json!({
        "topic": looked.topic,
        "decoded_as": looked.described,
        "frame_id": looked.frame,
        "samples": q.count,
        "duration_s": q.duration_secs,
        "clock": looked.clock.name(),
        "rate_hz": q.spacing.map(|s| s.rate_hz),
        "jitter_p50_s": q.spacing.map(|s| s.jitter_p50_secs),
        "jitter_p99_s": q.spacing.map(|s| s.jitter_p99_secs),
        "jitter_max_s": q.spacing.map(|s| s.jitter_max_secs),
        "gaps": q.gaps,
        "missing": q.missing,
        "longest_gap_s": q.longest_gap_secs,
        "duplicates": q.duplicates,
        "collisions": q.collisions,
        "disorder": q.disorder,
        "undecodable": looked.undecodable,
        "not_finite": q.not_finite,
        "no_gyro": q.no_gyro,
        "no_stamp": q.no_stamp,
        "with_orientation": q.with_orientation,
        "with_accel": q.with_accel,
        "header_minus_log_s": q.offset.map(|o| json!({
            "mean": o.mean_secs, "min": o.min_secs, "max": o.max_secs, "drift_ppm": o.drift_ppm })),
        "gyro": q.axes.iter().map(|a| json!({
            "min": a.min, "max": a.max, "mean": a.mean, "rms": a.rms })).collect::<Vec<_>>(),
        "gravity": q.gravity.map(|g| g.to_string()),
        "accel_when_quietest": q.accel_at_rest,
        "aid": aids_told(&looked.aid),
        "sample_kind": looked.resolved.kind.name(),
        "sample_kind_stated": looked.kind_stated,
        "gyro_unit": looked.resolved.unit.name(),
        "input_axes": looked.resolved.body.to_string(),
        "rests": looked.rests.kept.iter().take(RESTS).map(|r| json!({
            "start_s": looked.rests.first.map(|f| r.start.secs_since(f)),
            "secs": r.secs(),
            "mean_rate": { "x": r.mean_rate.0.x, "y": r.mean_rate.0.y, "z": r.mean_rate.0.z },
        })).collect::<Vec<_>>(),
        "bias": looked.bias.map(|b| json!({
            "x": b.bias.0.x, "y": b.bias.0.y, "z": b.bias.0.z, "sigma": b.sigma.max(), "rest_s": b.secs })),
        "notes": found.iter().map(Finding::line).collect::<Vec<_>>(),
        "findings": found.iter().map(Finding::json).collect::<Vec<_>>(),
    })
}

/// The unit in which a field of this length is the Earth's, where there is one.
fn field_unit(length: f64) -> Option<&'static str> {
    let fits = |(_, tesla): &&(&str, f64)| EARTHS_FIELD.contains(&(length * tesla));
    FIELD_UNITS.iter().find(fits).map(|(name, _)| *name)
}

fn aids_told(aids: &Aids) -> Value {
    let of_force = |t: &TopicOfVectors| {
        json!({ "topic": t.topic, "decoded_as": t.described, "rate_hz": t.rate_hz,
                "first_length": t.first })
    };
    let of_field = |t: &TopicOfVectors| {
        json!({ "topic": t.topic, "decoded_as": t.described, "rate_hz": t.rate_hz,
                "first_length": t.first, "unit": t.first.and_then(field_unit) })
    };
    json!({
        "auto": if aids.gravity { "gravity" } else { "none" },
        "force": aids.has_force.then(|| json!({
            "mean_length": aids.mean_force,
            "unit": if aids.force_scale == 1.0 { "m/s^2" } else { "g" },
            "plausible": aids.gravity,
        })),
        "field": aids.own_field.map(|length| json!({
            "first_length": length, "unit": field_unit(length) })),
        "field_topics": aids.fields.0.iter().map(of_field).collect::<Vec<_>>(),
        "field_topic_taken": aids.fields.1,
        "force_topics": aids.forces.iter().map(of_force).collect::<Vec<_>>(),
        "notes": aids.notes,
    })
}
