//! Everything known -> one sentence. Pure.

use super::findings::FindingRow;
use super::markup::sentence;
use crate::report::calendar::duration;
use crate::report::findings::Severity;
use crate::report::summary::{TopicSummary, significant};
use strapd_replay::inspection::Checked;

/// Topics of a log that are compared with those of others.
const TOPICS: usize = 6;

/// Level of quality.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Level {
    Good,
    Warning,
    Bad,
}

impl Level {
    pub(super) fn name(self) -> &'static str {
        match self {
            Level::Good => "good",
            Level::Warning => "warning",
            Level::Bad => "bad",
        }
    }

    /// Read aloud before the sentence, so that no colour is needed.
    pub(super) fn word(self) -> &'static str {
        match self {
            Level::Good => "Good.",
            Level::Warning => "Usable, with care.",
            Level::Bad => "Something is wrong.",
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Verdict {
    pub(super) level: Level,
    pub(super) text: String,
}

impl Verdict {
    pub(super) fn of(checked: &Checked, rows: &[FindingRow]) -> Verdict {
        let count = |severity| rows.iter().filter(|t| t.is_open(severity)).count();
        let (errors, warnings) = (count(Severity::Error), count(Severity::Warning));
        let runs = || {
            checked
                .topics
                .iter()
                .filter_map(|t| t.replayed.as_ref().ok())
        };
        let used = |s: &&TopicSummary| s.counts.used();
        let best = runs()
            .map(|s| &**s)
            .max_by_key(used)
            .filter(|s| s.counts.used() > 0);
        let level = match (best, errors, warnings) {
            (None, ..) => Level::Bad,
            _ if errors > 0 => Level::Bad,
            (_, _, 1..) => Level::Warning,
            _ => Level::Good,
        };
        let worst = rows
            .iter()
            .find(|t| t.is_open(Severity::Error))
            .or_else(|| rows.iter().find(|t| t.is_open(Severity::Warning)))
            .map(|t| match t.finding.topic.as_str() {
                topic if checked.topics.len() > 1 && !topic.is_empty() => {
                    format!("{topic}: {}", t.finding.what)
                }
                _ => t.finding.what.clone(),
            });
        let Some(best) = best else {
            let why =
                worst.unwrap_or_else(|| "the log holds no gyro sample that can be used".to_owned());
            return Verdict {
                level,
                text: format!("No attitude could be had: {why}."),
            };
        };
        // What does not follow the gyro says nothing about how well the gyro was followed.
        let trusted = !rows
            .iter()
            .any(|t| t.finding.topic == best.topic && t.finding.code.starts_with("orientation-"));
        let wrong = match (errors, warnings, worst) {
            (_, _, None) => "; nothing wrong was found.".to_owned(),
            (errors, warnings, Some(worst)) => {
                let counts: Vec<String> = [(errors, "error"), (warnings, "warning")]
                    .into_iter()
                    .filter(|(n, _)| *n > 0)
                    .map(|(n, what)| format!("{n} {what}{}", if n == 1 { "" } else { "s" }))
                    .collect();
                let first = if errors + warnings == 1 {
                    ""
                } else {
                    "first of all, "
                };
                format!("; but {}: {first}{worst}.", counts.join(" and "))
            }
        };
        Verdict {
            level,
            text: sentence(&good(best, trusted)) + &wrong,
        }
    }
}

/// Figures of each topic that was integrated: duration, rate, lost samples, gaps, turned, error, and that of the gyro
/// over 1 s.
pub(super) fn figures(checked: &Checked) -> Vec<(String, [String; 7])> {
    let of = |s: &TopicSummary| {
        [
            format!("{:.3}", s.duration_secs),
            s.rate_hz.map_or_else(String::new, |hz| significant(hz, 4)),
            s.counts.lost().to_string(),
            (s.gaps.bridged + s.gaps.held + s.gaps.resets).to_string(),
            format!("{:.1}", s.turned.to_degrees()),
            whole_error(s).map_or_else(String::new, |parts| parts.join(" / ")),
            over_one_second(s).unwrap_or_default(),
        ]
    };
    let runs = checked.topics.iter().filter_map(|topic| {
        let summary = topic.replayed.as_ref().ok()?;
        Some((summary.topic.clone(), of(summary)))
    });
    runs.take(TOPICS).collect()
}

/// Errors of tilt and heading of the attitude that was made, over the whole run, deg.
fn whole_error(s: &TopicSummary) -> Option<[String; 2]> {
    let errors = s.drawn.as_deref()?.errors.as_ref()?;
    let (found, _) = errors.bounds.as_ref()?;
    Some([found.tilt.rms, found.heading.rms].map(|rms| significant(rms.to_degrees(), 2)))
}

/// Error of the gyro alone over 1 s, the median, deg.
fn over_one_second(s: &TopicSummary) -> Option<String> {
    let row = s.against.iter().find(|row| row.kind == s.kind.name())?;
    Some(significant(row.median_deg, 3))
}

/// All of the error first: what the gyro misses over 1 s says little of a heading that drifts for an hour.
fn from_the_reference(s: &TopicSummary) -> String {
    match (whole_error(s), over_one_second(s)) {
        (Some([tilt, heading]), over) => {
            let over = over.map_or_else(String::new, |over| {
                format!("; the gyro alone {over} deg over 1 s")
            });
            format!(
                ", {tilt} deg of tilt and {heading} deg of heading from the reference (rms{over})"
            )
        }
        (None, Some(over)) => format!(", the gyro {over} deg from the reference over 1 s (median)"),
        (None, None) => String::new(),
    }
}

fn good(s: &TopicSummary, trusted: bool) -> String {
    let (used, total) = (s.counts.used(), s.counts.total());
    let which = if used == total {
        format!("all {total}")
    } else {
        format!("{used} of {total}")
    };
    let rate = s
        .rate_hz
        .map_or_else(String::new, |hz| format!(" at {} Hz", significant(hz, 4)));
    let gaps = match s.gaps.bridged + s.gaps.held + s.gaps.resets {
        0 => " without a gap".to_owned(),
        1 => " with one gap".to_owned(),
        n => format!(" with {n} gaps"),
    };
    let follows = match trusted {
        true => from_the_reference(s),
        false => String::new(),
    };
    format!(
        "{which} samples{rate} were integrated over {}{gaps}{follows}",
        duration(s.duration_secs)
    )
}
