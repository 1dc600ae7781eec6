//! What `info` found -> text or JSON. Pure.

use crate::cli::shell::{flag, quoted_file};
use crate::report::calendar::{date, duration};
use crate::report::findings::{Finding, of_samples};
use crate::report::summary::{human_bytes, significant};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use strapd_recording::Input;
use strapd_recording::Source;
use strapd_recording::format::Format;
use strapd_recording::mcap::Survey;
use strapd_recording::recording::log_channel::{LogChannel, described, rank};
use strapd_recording::text::named_few;
use strapd_replay::inspection::Inspection;

/// Most other topics that are listed.
const OTHERS: usize = 40;

/// Everything `info` knows.
#[derive(Clone, Debug)]
pub(super) struct Report<'a> {
    /// The file, or standard input.
    pub(super) input: &'a Input,
    /// What is in it.
    pub(super) survey: &'a Survey,
    /// What is wrong with it.
    pub(super) problems: Vec<String>,
    /// Its channels.
    pub(super) channels: &'a [LogChannel],
    /// Its topics of samples.
    pub(super) looked: &'a [Inspection],
    /// Topics of samples that were too many to look at.
    pub(super) left_out: &'a [String],
}

impl Report<'_> {
    /// For people.
    #[must_use]
    pub(super) fn text(&self) -> String {
        let mut out = String::new();
        self.write_file(&mut out);
        for looked in self.looked {
            write_topic(looked, &mut out);
        }
        self.write_others(&mut out);
        for problem in &self.problems {
            let _ = writeln!(out, "problem   {problem}");
        }
        let _ = writeln!(out, "next      {}", self.next());
        out
    }

    /// How a table was read: the `--columns` that say the same.
    fn tables(&self) -> Vec<&str> {
        let stated = self.channels.iter().filter_map(|k| k.stated.as_ref());
        let mut said: Vec<&str> = stated
            .map(|stated| stated.description.as_str())
            .filter(|said| said.starts_with("--columns"))
            .collect();
        said.dedup();
        said
    }

    fn write_file(&self, out: &mut String) {
        let survey = self.survey;
        let size = survey.file_size.map_or_else(String::new, human_bytes);
        let profile = match survey.facts.profile.as_str() {
            "" => String::new(),
            name => format!("  profile {}", strapd_recording::text::printable(name)),
        };
        let _ = write!(
            out,
            "file      {}  {size}{profile}",
            self.input.name().display()
        );
        if let Some((first, last)) = survey.times {
            let secs = last.saturating_sub(first) as f64 * 1e-9;
            let _ = write!(out, "  {}", duration(secs));
            if let Some(date) = date(first) {
                let _ = write!(out, "  {date}");
            }
        }
        let _ = writeln!(out);
        let format = self.input.format();
        if matches!(format, Format::Lines | Format::Table) {
            let _ = writeln!(
                out,
                "          {} samples of {} sensors; {}",
                survey.messages,
                survey.channels.len(),
                format.name()
            );
            for said in self.tables() {
                let _ = writeln!(out, "          read as {said}");
            }
            return;
        }
        let chunks: Vec<String> = survey
            .facts
            .chunks
            .iter()
            .map(|(how, n)| format!("{n} {}", how.name()))
            .collect();
        let _ = writeln!(
            out,
            "          {} messages on {} topics; {}{}{}",
            survey.messages,
            survey.channels.len(),
            match format {
                Format::Mcap if chunks.is_empty() => "no chunks".to_owned(),
                Format::Mcap => format!("chunks: {}", chunks.join(", ")),
                other => other.name().to_owned(),
            },
            if survey.has_summary || format != Format::Mcap {
                ""
            } else {
                "; no summary section"
            },
            match strapd_recording::text::printable(&survey.facts.library).as_str() {
                "" => String::new(),
                library => format!("; written by {library}"),
            }
        );
    }

    fn write_others(&self, out: &mut String) {
        if !self.left_out.is_empty() {
            let _ = writeln!(
                out,
                "{} more topics carry a rate and were not looked at: {}",
                self.left_out.len(),
                named_few(self.left_out)
            );
        }
        let looked: BTreeSet<&str> = self.looked.iter().map(|l| l.of.as_str()).collect();
        let others: Vec<&LogChannel> = self
            .channels
            .iter()
            .filter(|k| !looked.contains(k.channel.topic.as_str()))
            .collect();
        for known in others.iter().take(OTHERS) {
            let what = match (rank(&known.role), known.role.has_orientation) {
                (1.., _) => "  (carries a rate: --topic takes it)",
                (_, true) => "  (carries an orientation: compare takes it)",
                _ => "",
            };
            let _ = writeln!(
                out,
                "{}  {}  {} messages{what}",
                strapd_recording::text::printable(&known.channel.topic),
                described(&known.channel),
                known.messages
            );
        }
        if others.len() > OTHERS {
            let _ = writeln!(out, "... and {} more topics", others.len() - OTHERS);
        }
    }

    /// The command to run next, with the flags this log needs.
    fn next(&self) -> String {
        let file = match self.input.source() {
            Source::File(path) => quoted_file(path),
            Source::Stdin => "-".to_owned(),
        };
        let best = match self.looked {
            [] => {
                return format!(
                    "strapd replay {file} --topic NAME --field gyro=PATH   # no IMU topic here; this names a rate in any message"
                );
            }
            [one] => one,
            several => {
                let mut ranks = BTreeMap::new();
                for known in self.channels {
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
        let advice = &best.quality.advice;
        use strapd_attitude::condition::quality::Advice;
        if advice
            .iter()
            .any(|a| matches!(a, Advice::RatesLookLikeDegrees { .. }))
        {
            flags.push_str(" --gyro-unit deg");
        }
        if best.bias.is_some() {
            flags.push_str(" --bias auto");
            let from_start =
                best.rests
                    .kept
                    .first()
                    .zip(best.rests.first)
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

    /// For machines: one object.
    #[must_use]
    pub(super) fn json(&self) -> Value {
        let survey = self.survey;
        json!({
            "file": self.input.name().display().to_string(),
            "bytes": survey.file_size,
            "format": survey.facts.format.name(),
            "profile": survey.facts.profile,
            "library": survey.facts.library,
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

fn write_topic(looked: &Inspection, out: &mut String) {
    let q = &looked.quality;
    let _ = write!(
        out,
        "{}  {}  {} samples",
        strapd_recording::text::printable(&looked.topic),
        looked.described,
        q.count
    );
    if let Some(spacing) = &q.spacing {
        let _ = write!(
            out,
            "  {} Hz  jitter p99 {} ms",
            significant(spacing.rate_hz, 5),
            significant(spacing.jitter_p99_secs * 1e3, 2)
        );
    }
    let _ = writeln!(
        out,
        "  gaps {}  dup {}  disorder {}",
        q.gaps, q.duplicates, q.disorder
    );
    let frame = if looked.frame.is_empty() {
        "unnamed"
    } else {
        &looked.frame
    };
    let _ = write!(out, "   frame {frame}, input {}", looked.resolved.body);
    if let (Some(g), Some(axis)) = (q.accel_at_rest, q.gravity) {
        let _ = write!(
            out,
            "; gravity {} on {axis} when quietest",
            significant(g, 4)
        );
    }
    let peak = q
        .axes
        .iter()
        .map(|a| a.max.abs().max(a.min.abs()))
        .fold(0.0, f64::max);
    let _ = writeln!(
        out,
        "; largest rate {} {}/s",
        significant(peak, 4),
        looked.quality_unit.name()
    );
    if let Some(offset) = &q.offset {
        let _ = writeln!(
            out,
            "   header - log time: mean {} ms, {} to {} ms, drift {} ppm; {} clock",
            significant(offset.mean_secs * 1e3, 3),
            significant(offset.min_secs * 1e3, 3),
            significant(offset.max_secs * 1e3, 3),
            significant(offset.drift_ppm, 2),
            looked.clock.name()
        );
    }
    let _ = writeln!(
        out,
        "   orientation: {}; a sample is taken as {}{}",
        match q.with_orientation {
            0 => "none".to_owned(),
            n if n == q.count => "in every message".to_owned(),
            n => format!("in {n} messages"),
        },
        looked.resolved.kind.name(),
        if looked.kind_stated {
            " (stated by the format)"
        } else {
            " (--sample-kind)"
        }
    );
    for line in super::aids::lines(&looked.aid) {
        let _ = writeln!(out, "   {line}");
    }
    match (&looked.bias, looked.rests.kept.first(), looked.rests.first) {
        (Some(bias), Some(rest), Some(first)) => {
            let [x, y, z]: [f64; 3] = bias.bias.into();
            let _ = writeln!(
                out,
                "   rest {:.1} to {:.1} s{}: bias ({x:.5}, {y:.5}, {z:.5}) +- {:.1e} rad/s",
                rest.start.secs_since(first),
                rest.end.secs_since(first),
                match looked.rests.count {
                    0 | 1 => String::new(),
                    n => format!(" and {} more", n - 1),
                },
                bias.sigma.max()
            );
        }
        _ => {
            let _ = writeln!(out, "   rest: none found");
        }
    }
    for finding in of_samples(looked) {
        let _ = writeln!(out, "   {}: {}", finding.severity.name(), finding.line());
    }
}

fn topic_json(looked: &Inspection) -> Value {
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
        "aid": super::aids::aids_json(&looked.aid),
        "sample_kind": looked.resolved.kind.name(),
        "sample_kind_stated": looked.kind_stated,
        "gyro_unit": looked.resolved.unit.name(),
        "input_axes": looked.resolved.body.to_string(),
        "rests": looked.rests.kept.iter().take(100).map(|r| json!({
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
