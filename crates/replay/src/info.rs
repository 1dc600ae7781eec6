//! A recording that was looked at -> what is said of it to machines, and the command to run next. Pure.
//!
//! A room of its own above inspections and findings, because the command and Python say the same of a log.

use crate::findings::{Finding, of_samples};
use crate::inspection::{Aids, Inspection};
use crate::shell::{flag, quoted_file};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use strapd_attitude::setting::{
    AGAINST_RECORDED, BIAS, COLUMNS, Choice, FIELD, INIT, JOIN, RATE_HZ, TIME, TOPIC,
};
use strapd_recording::mcap::Survey;
use strapd_recording::recording::beside::TopicOfVectors;
use strapd_recording::recording::log_channel::LogChannel;
use strapd_recording::{Input, MadeBefore, Source};

/// Units of a field by the length of the Earth's, 22 to 67 uT, with room for what iron does to it.
const FIELD_UNITS: [(&str, f64); 5] = [
    ("T", 1.0),
    ("G", 1e-4),
    ("mG", 1e-7),
    ("uT", 1e-6),
    ("nT", 1e-9),
];
const EARTHS_FIELD: std::ops::Range<f64> = 1.5e-5..1e-4;
/// Codes of findings that may know the unit of the rates.
const UNITS: [&str; 2] = ["unit-degrees", "unit-against-gravity"];
/// Rests that are listed.
const RESTS: usize = 100;

/// Everything that looking at a recording tells.
#[derive(Clone, Debug)]
pub struct Overview<'a> {
    /// The file, or standard input.
    pub input: &'a Input,
    /// Origin of attitudes that are no recording.
    pub made_before: Option<MadeBefore>,
    /// Survey of its contents.
    pub survey: &'a Survey,
    /// Problems with it.
    pub problems: Vec<String>,
    /// Channels.
    pub channels: &'a [LogChannel],
    /// Topics of samples.
    pub looked: &'a [Inspection],
    /// Topics of samples that were too many to look at.
    pub left_out: &'a [String],
}

impl Overview<'_> {
    /// Setting that states how a table was read.
    #[must_use]
    pub fn tables(&self) -> Vec<&str> {
        let columns = COLUMNS.to_string();
        let stated = self.channels.iter().filter_map(|k| k.stated.as_ref());
        let mut said: Vec<&str> = stated
            .map(|stated| stated.description.as_str())
            .filter(|said| said.starts_with(&columns))
            .collect();
        said.dedup();
        said
    }

    /// The command to run next, with the flags this log needs; `None`: none that runs as it stands.
    #[must_use]
    pub fn next(&self) -> Option<String> {
        let file = typed(self.input.source());
        if let Some(made) = &self.made_before {
            let of = quoted_file(Path::new(made.of.as_ref()?));
            return Some(format!("strapd compare {file} {of}   # {made}"));
        }
        let best = match self.looked {
            [] => return None,
            [one] => one,
            several => {
                let mut ranks = BTreeMap::new();
                for known in self.channels {
                    let topic = known.channel.topic.as_str();
                    let best = ranks.entry(topic).or_insert(0);
                    *best = known.rank().max(*best);
                }
                let of = |l: &Inspection| ranks.get(l.of.as_str()).copied().unwrap_or(0);
                let best = several.iter().map(of).max().unwrap_or(0);
                let mut likely = several.iter().filter(|l| of(l) == best);
                match (likely.next(), likely.next()) {
                    (Some(one), None) => one,
                    (first, _) => {
                        return Some(format!(
                            "strapd replay {file} {} -o attitude.mcap   # or another topic, or all",
                            flag(&TOPIC.to_string(), first.map_or("", |l| l.topic.as_str()))
                        ));
                    }
                }
            }
        };
        if best.has_no_clock() {
            return None;
        }
        let mut help: Vec<Choice> = Vec::new();
        let units = of_samples(best)
            .into_iter()
            .filter(|f| UNITS.contains(&f.code));
        let one = |f: Finding| <[_; 1]>::try_from(f.help).ok();
        help.extend(units.filter_map(one).flatten().flatten().next());
        if best.bias.is_some() {
            help.push(BIAS.to("auto"));
            let start = best.rests.kept.first().zip(best.rests.first);
            let rests_at_start = start.is_some_and(|(rest, first)| {
                rest.mean_accel.is_some() && rest.start.secs_since(first) < 1.0
            });
            if rests_at_start {
                help.push(INIT.to("gravity"));
            }
        }
        if best.has_reference {
            help.push(AGAINST_RECORDED.into());
        }
        let help: String = help.iter().map(|choice| format!(" {choice}")).collect();
        Some(format!("strapd replay {file} -o attitude.mcap{help}"))
    }

    /// Reason for which there is no command to run next.
    #[must_use]
    pub fn why_no_next(&self) -> String {
        match &self.made_before {
            Some(made) => format!("{made}: look at the recording it was made of"),
            None if self.looked.iter().any(Inspection::has_no_clock) => {
                let file = typed(self.input.source());
                let (index, rate) = (TIME.to("index"), RATE_HZ.to("HZ"));
                format!(
                    "nothing says when; of HZ samples a second: strapd replay {file} {index} {rate} -o attitude.mcap"
                )
            }
            None => format!(
                "no topic carries a rate: {TOPIC} NAME {FIELD} gyro=PATH takes it from any message"
            ),
        }
    }

    /// JSON for machines: one object.
    #[must_use]
    pub fn json(&self) -> Value {
        let survey = self.survey;
        json!({
            "file": self.input.name().display().to_string(),
            "bytes": survey.file_size,
            "format": survey.facts.format.name(),
            "profile": survey.facts.profile,
            "library": survey.facts.library,
            "made_before": self.made_before.is_some(),
            "messages": survey.messages,
            "log_time_ns": survey.times.map(|(a, b)| json!({ "first": a.to_string(), "last": b.to_string() })),
            "has_summary": survey.has_summary,
            "chunks": survey.facts.chunks.iter()
                .map(|(how, n)| (how.name().to_owned(), json!(n)))
                .collect::<serde_json::Map<_, _>>(),
            "metadata_records": survey.facts.metadata,
            "attachments": survey.facts.attachments,
            "problems": self.problems,
            "read_as": self.tables(),
            "topics": self.channels.iter().map(|k| json!({
                "topic": k.channel.topic,
                "type": k.channel.schema.as_deref().map(|s| s.name.as_str()),
                "message_encoding": k.channel.message_encoding,
                "messages": k.messages,
                "carries_rate": k.role.has_rate,
                "carries_orientation": k.role.has_orientation,
            })).collect::<Vec<_>>(),
            "not_looked_at": self.left_out,
            "imu": self.looked.iter().map(topic_json).collect::<Vec<_>>(),
            "next": self.next(),
        })
    }
}

fn topic_json(looked: &Inspection) -> Value {
    let q = &looked.quality;
    let found = of_samples(looked);
    json!({
        "topic": looked.topic,
        "decoded_as": looked.described.to_string(),
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
        "orientation_varies": q.orientation_varies,
        "with_accel": q.with_accel,
        "header_minus_log_s": q.offset.map(|o| json!({
            "mean": o.mean_secs, "min": o.min_secs, "max": o.max_secs, "drift_ppm": o.drift_ppm })),
        "gyro": q.axes.iter().map(|a| json!({
            "min": a.min, "max": a.max, "mean": a.mean, "rms": a.rms })).collect::<Vec<_>>(),
        "gravity": q.gravity.map(|g| g.to_string()),
        "accel_when_quietest": q.accel_at_rest,
        "aid": aids_json(&looked.aid),
        "sample_kind": looked.resolved.kind.name(),
        "sample_kind_stated": looked.resolved.kind_reason.is_stated(),
        "sample_kind_by": looked.resolved.kind_reason.name(),
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
#[must_use]
pub fn field_unit(length: f64) -> Option<&'static str> {
    let fits = |(_, tesla): &&(&str, f64)| EARTHS_FIELD.contains(&(length * tesla));
    FIELD_UNITS.iter().find(fits).map(|(name, _)| *name)
}

fn aids_json(aids: &Aids) -> Value {
    let topic = |t: &TopicOfVectors| {
        json!({ "topic": t.topic, "decoded_as": t.described, "rate_hz": t.rate_hz,
                "first_length": t.first })
    };
    let of_field = |t: &TopicOfVectors| {
        let mut value = topic(t);
        if let Some(object) = value.as_object_mut() {
            object.insert("unit".to_owned(), t.first.and_then(field_unit).into());
        }
        value
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
        "force_topics": aids.forces.iter().map(topic).collect::<Vec<_>>(),
        "notes": aids.notes,
    })
}

/// A source as it is typed.
fn typed(source: &Source) -> String {
    match source {
        Source::File(path) => quoted_file(path),
        Source::Parts(paths) => {
            let files: Vec<String> = paths.iter().map(|path| quoted_file(path)).collect();
            format!("{JOIN} {}", files.join(" "))
        }
        Source::Stdin => "-".to_owned(),
        Source::Elsewhere(_) => quoted_file(&source.name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earth_s_field_shows_its_unit() {
        for (length, unit) in [
            (4.9e-5, Some("T")),
            (0.49, Some("G")),
            (490.0, Some("mG")),
            (49.0, Some("uT")),
            (49_000.0, Some("nT")),
            (1.0, None),
            (5000.0, None),
            (f64::NAN, None),
        ] {
            assert_eq!(field_unit(length), unit, "{length}");
        }
    }
}
