//! Results of `info` -> text. Pure.

use crate::report::calendar::{date, duration};
use crate::report::findings::of_samples;
use crate::report::summary::{human_bytes, significant};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use strapd_attitude::estimate::KindReason;
use strapd_recording::format::Format;
use strapd_recording::recording::log_channel::{LogChannel, described};
use strapd_recording::text::named_few;
use strapd_replay::info::Overview;
use strapd_replay::inspection::Inspection;

/// Most other topics that are listed.
const OTHERS: usize = 40;

/// Text for people.
#[must_use]
pub(super) fn text(info: &Overview<'_>) -> String {
    let mut out = String::new();
    write_file(info, &mut out);
    for looked in info.looked {
        write_topic(looked, &mut out);
    }
    write_others(info, &mut out);
    for problem in &info.problems {
        let _ = writeln!(out, "problem   {problem}");
    }
    let _ = match info.next() {
        Some(command) => writeln!(out, "next      {command}"),
        None => writeln!(out, "no attitude: {}", info.why_no_next()),
    };
    out
}

fn write_file(info: &Overview<'_>, out: &mut String) {
    let survey = info.survey;
    let size = survey.file_size.map_or_else(String::new, human_bytes);
    let profile = match survey.facts.profile.as_str() {
        "" => String::new(),
        name => format!("  profile {}", strapd_recording::text::printable(name)),
    };
    let _ = write!(
        out,
        "file      {}  {size}{profile}",
        info.input.name().display()
    );
    if let Some((first, last)) = survey.times {
        let secs = last.saturating_sub(first) as f64 * 1e-9;
        let _ = write!(out, "  {}", duration(secs));
        if let Some(date) = date(first) {
            let _ = write!(out, "  {date}");
        }
    }
    let _ = writeln!(out);
    match info.input.format() {
        text if text.is_text() => write_sensors(info, text, out),
        format => write_messages(info, format, out),
    }
}

/// Writes how many samples of how many sensors a text holds, and as what its tables are read.
fn write_sensors(info: &Overview<'_>, format: Format, out: &mut String) {
    let _ = writeln!(
        out,
        "          {} samples of {} sensors; {}",
        info.survey.messages,
        info.survey.channels.len(),
        format.name()
    );
    for said in info.tables() {
        let _ = writeln!(out, "          read as {said}");
    }
}

/// Writes how many messages of how many topics a log holds, and how they are packed.
fn write_messages(info: &Overview<'_>, format: Format, out: &mut String) {
    let survey = info.survey;
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

fn write_others(info: &Overview<'_>, out: &mut String) {
    if !info.left_out.is_empty() {
        let _ = writeln!(
            out,
            "{} more topics carry a rate and were not looked at: {}",
            info.left_out.len(),
            named_few(info.left_out)
        );
    }
    let looked: BTreeSet<&str> = info.looked.iter().map(|l| l.of.as_str()).collect();
    let others: Vec<&LogChannel> = info
        .channels
        .iter()
        .filter(|k| !looked.contains(k.channel.topic.as_str()))
        .collect();
    let forces: BTreeSet<&str> = info
        .looked
        .iter()
        .flat_map(|looked| &looked.aid.forces)
        .map(|force| force.topic.as_str())
        .collect();
    for known in others.iter().take(OTHERS) {
        let what = match (known.rank(), known.has_attitudes()) {
            _ if forces.contains(known.channel.topic.as_str()) => {
                "  (carries a specific force: --accel-topic takes it)"
            }
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
    write_meaning(looked, out);
    for line in super::aids::lines(&looked.aid) {
        let _ = writeln!(out, "   {line}");
    }
    write_rest(looked, out);
    for finding in of_samples(looked) {
        let _ = writeln!(out, "   {}: {}", finding.severity.name(), finding.line());
    }
}

/// Writes how the orientations are, and as which kind a sample is taken.
fn write_meaning(looked: &Inspection, out: &mut String) {
    let q = &looked.quality;
    let _ = writeln!(
        out,
        "   orientation: {}; a sample is taken as {}{}",
        match q.with_orientation {
            0 => "none".to_owned(),
            _ if !q.orientation_varies && q.with_orientation > 1 =>
                "always the same: the field is not filled".to_owned(),
            n if n == q.count => "in every message".to_owned(),
            n => format!("in {n} messages"),
        },
        looked.resolved.kind.name(),
        match looked.resolved.kind_reason {
            reason @ (KindReason::Step(_) | KindReason::Unknown) =>
                format!(" ({reason}; --sample-kind rate|average as its manual says)"),
            reason => format!(" ({reason})"),
        }
    );
}

/// Writes the first rest and the bias that it tells.
fn write_rest(looked: &Inspection, out: &mut String) {
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
}
