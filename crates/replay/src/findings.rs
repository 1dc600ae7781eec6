//! What is known about a log -> findings: how bad, on what evidence, what to do. Pure.
//!
//! Thresholds are opinions; those about the samples themselves lie in [`strapd_attitude::condition::quality`],
//! those about the replay and the recorded orientation here. A finding's `code` is stable: scripts
//! match on it.

pub(crate) mod orientation;
mod samples;

use crate::pipeline::check::{Checked, CheckedTopic};
use crate::pipeline::topics::named_few;
use serde_json::{Map, Value, json};

/// How bad a finding is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Severity {
    /// Nothing is wrong; something to know, or to choose.
    Note,
    /// The attitude may be worse than it need be.
    Warning,
    /// Data is lost, or the attitude will be wrong.
    Error,
}

impl Severity {
    /// In text and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
}

/// One thing that was noticed.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// Its stable name.
    pub code: &'static str,
    /// The topic, empty = the file.
    pub topic: String,
    /// What was seen, with its numbers.
    pub what: String,
    /// The same numbers for machines.
    pub evidence: Map<String, Value>,
    /// What to do about it.
    pub advice: String,
    /// The exact flags that do it, where flags do.
    pub flags: String,
}

impl Finding {
    fn new(severity: Severity, code: &'static str, what: impl Into<String>) -> Finding {
        Finding {
            severity,
            code,
            topic: String::new(),
            what: what.into(),
            evidence: Map::new(),
            advice: String::new(),
            flags: String::new(),
        }
    }

    fn with(mut self, name: &str, value: impl Into<Value>) -> Finding {
        self.evidence.insert(name.to_owned(), value.into());
        self
    }

    fn advise(mut self, advice: impl Into<String>) -> Finding {
        self.advice = advice.into();
        self
    }

    fn flags(mut self, flags: impl Into<String>) -> Finding {
        self.flags = flags.into();
        self
    }

    /// For machines.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "severity": self.severity.name(),
            "code": self.code,
            "topic": self.topic,
            "what": self.what,
            "evidence": self.evidence,
            "advice": self.advice,
            "flags": self.flags,
        })
    }
}

/// Everything worth saying about a log, the worst first; within a severity in order of the flow.
#[must_use]
pub fn findings(checked: &Checked) -> Vec<Finding> {
    let mut found = Vec::new();
    if !checked.problems.is_empty() {
        let lossy = checked.file_losses > 0;
        let (severity, advice) = if lossy {
            (
                Severity::Error,
                "samples are missing; what is intact is used",
            )
        } else {
            (Severity::Warning, "nothing is lost by it")
        };
        for problem in &checked.problems {
            found.push(
                Finding::new(severity, "file-damaged", problem.clone())
                    .with("losses", checked.file_losses)
                    .advise(advice),
            );
        }
    }
    for why in &checked.refused {
        // Its own help follows on lines of its own.
        let what = why.lines().next().unwrap_or_default();
        found.push(
            Finding::new(Severity::Error, "no-imu-topic", what)
                .advise("name the topic and where the rate lies in it")
                .flags("--topic NAME --field gyro=PATH"),
        );
    }
    if checked.topics.len() > 1 {
        let names: Vec<&str> = checked
            .topics
            .iter()
            .map(|t| t.looked.topic.as_str())
            .collect();
        found.push(
            Finding::new(
                Severity::Note,
                "several-topics",
                format!("several topics carry a rate: {}", named_few(&names)),
            )
            .with("topics", names.clone())
            .advise("choose one, or `all`")
            .flags("--topic NAME"),
        );
    }
    if !checked.left_out.is_empty() {
        found.push(
            Finding::new(
                Severity::Warning,
                "topics-left-out",
                format!(
                    "{} more topics carry a rate and were not examined: {}",
                    checked.left_out.len(),
                    named_few(&checked.left_out)
                ),
            )
            .with("topics", checked.left_out.clone())
            .advise("examine one by its name")
            .flags("--topic NAME"),
        );
    }
    for topic in &checked.topics {
        let mut of_topic = Vec::new();
        samples::find(topic, &mut of_topic);
        replayed(topic, &mut of_topic);
        orientation::find(topic, &mut of_topic);
        for finding in &mut of_topic {
            finding.topic.clone_from(&topic.looked.topic);
        }
        found.append(&mut of_topic);
    }
    found.sort_by_key(|f| std::cmp::Reverse(f.severity));
    found
}

/// Largest turn per step that integrates well whatever the motion: beyond, aliasing is near.
const LARGE_STEP_DEG: f64 = 30.0;

/// Longest gap that anybody would bridge.
const LONGEST_BRIDGE_SECS: f64 = 3600.0;

/// What only integrating shows.
fn replayed(topic: &CheckedTopic, out: &mut Vec<Finding>) {
    let summary = match &topic.replayed {
        Ok(summary) => summary,
        Err(why) => {
            let (what, help) = why.split_once('\n').unwrap_or((why, ""));
            let help = help.trim().trim_start_matches("help: ");
            out.push(Finding::new(Severity::Error, "refused", what).advise(help));
            return;
        }
    };
    let breaks = summary.gaps.held + summary.gaps.resets;
    if breaks > 0 {
        let longest = summary.gaps.longest_held_secs;
        let held = Finding::new(
            Severity::Error,
            "gap-held",
            format!(
                "{breaks} gaps or clock jumps are too long to integrate over, the longest {longest:.3} s, {:.1} s after the start",
                summary.gaps.longest_at_secs
            ),
        )
        .with("count", breaks)
        .with("longest_s", longest)
        .with("longest_at_s", summary.gaps.longest_at_secs)
        .with("total_s", summary.gaps.held_secs);
        // Nobody bridges an hour, or a clock that was set back: such a stamp is wrong, or another clock's.
        out.push(if (f64::MIN_POSITIVE..=LONGEST_BRIDGE_SECS).contains(&longest) {
            held.advise("the attitude is held there; bridge them where the motion was slow")
                .flags(format!(
                    "--on-gap bridge --max-gap {:.1}",
                    (longest * 10.0).ceil() / 10.0
                ))
        } else {
            held.advise("the attitude is held there; a clock was set, or is not always the same one: another may be steadier")
                .flags("--time log, or --time header")
        });
    }
    let step_deg = summary.largest_step.to_degrees();
    if summary.undersampled > 0 {
        out.push(
            Finding::new(
                Severity::Error,
                "under-sampled",
                format!(
                    "{} steps turn more than half a turn (up to {step_deg:.0} deg): the samples are too few for the motion, or the unit is wrong",
                    summary.undersampled
                ),
            )
            .with("steps", summary.undersampled)
            .with("largest_step_deg", step_deg)
            .advise("check the unit first; otherwise sample faster"),
        );
    } else if step_deg > LARGE_STEP_DEG {
        out.push(
            Finding::new(
                Severity::Warning,
                "large-turn-per-step",
                format!(
                    "up to {step_deg:.0} deg are turned in one step: few samples for this motion"
                ),
            )
            .with("largest_step_deg", step_deg)
            .advise("sample faster; delta angles suffer less than rates"),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_comes_first() {
        assert!(Severity::Error > Severity::Warning && Severity::Warning > Severity::Note);
    }
}
