//! Summary of a replay -> text or JSON. Pure.
//!
//! What an estimator knows is taken from it in `topic.rs`, what a run knows beside it is added by the pipeline; the words
//! are here, in one place.

pub mod against;
pub mod aid;
pub mod calendar;
pub mod calibrating;
pub mod calibration;
pub(crate) mod clocks;
pub mod gaps;
mod rows;
pub mod series;
pub(crate) mod sigma;
pub(crate) mod simulation;
pub mod smoothing;
pub mod stamps;
mod topic;
pub mod trace;
pub mod warming;

pub use self::against::{Against, Recorded};
pub use self::gaps::Gaps;
pub use self::rows::Row;
pub use self::topic::TopicSummary;
pub(crate) use self::topic::warning;
use serde_json::{Value, json};
use std::fmt::Write as _;
pub use strapd_attitude::digits::significant;
use strapd_attitude::record::SampleKind;

/// Topics that are named one by one.
const FEW: usize = 5;

/// Summary of one log.
#[derive(Clone, Debug, Default)]
pub struct RunSummary {
    /// The log.
    pub source: String,
    /// One per topic.
    pub topics: Vec<TopicSummary>,
    /// Outputs: name, bytes, messages.
    pub outputs: Vec<(String, u64, u64)>,
    /// Path of the saved calibration.
    pub calibration: Option<String>,
    /// Addresses at which it was served to whoever connected.
    pub served: Vec<String>,
    /// Problems of the file itself.
    pub file_problems: Vec<String>,
    /// Number of these that lost data.
    pub file_losses: u64,
    /// Sockets that broke before the end.
    pub broken: Vec<String>,
    /// Whether the readers of every output hung up before the end (`| head`): the run stopped there,
    /// on purpose.
    pub reader_gone: bool,
    /// Wall seconds.
    pub elapsed_secs: f64,
}

impl RunSummary {
    /// Whether anything was lost: exit code 3.
    #[must_use]
    pub fn is_lossy(&self) -> bool {
        self.file_losses > 0
            || !self.broken.is_empty()
            || self.topics.iter().any(TopicSummary::is_lossy)
    }

    /// Samples seen on all topics.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.topics.iter().map(|t| t.counts.total()).sum()
    }

    /// Few lines for people, at most eight of one topic: what was done, how good it is, what to do next.
    #[must_use]
    pub fn brief(&self) -> String {
        let mut out = String::new();
        if let [topic] = self.topics.as_slice() {
            let head = [&self.source, &topic.topic, &topic.decoded_as].map(String::as_str);
            let _ = writeln!(out, "{}", head.join("  "));
            for (label, text) in topic.brief(&self.file_problems) {
                line(&mut out, label, &text);
            }
        } else {
            let _ = writeln!(out, "{}  {} topics", self.source, self.topics.len());
            for topic in self.topics.iter().take(FEW) {
                let lines = topic.brief(&[]);
                let of = |label| lines.iter().find(|(named, _)| *named == label);
                let said = ["samples", "final"].map(|label| of(label).map_or("", |(_, text)| text));
                line(
                    &mut out,
                    "topic",
                    &format!("{}: {}", topic.topic, said.join("; ")),
                );
            }
            if self.topics.len() > FEW {
                line(
                    &mut out,
                    "",
                    &format!("and {} more", self.topics.len() - FEW),
                );
            }
        }
        if let (Some(first), true) = (self.file_problems.first(), self.topics.len() != 1) {
            line(&mut out, "file", first);
        }
        self.where_it_went(&mut out);
        out
    }

    /// Outputs, as many lines as there are, or one if there are many.
    fn where_it_went(&self, out: &mut String) {
        let kept: Vec<String> = self
            .outputs
            .iter()
            .filter(|(name, ..)| name != "null:")
            .map(|(name, bytes, messages)| {
                format!("{name}  {}  {messages} messages", human_bytes(*bytes))
            })
            .chain(self.calibration.clone())
            .collect();
        if !kept.is_empty() {
            line(out, "wrote", &kept.join(", "));
        }
        if !self.served.is_empty() {
            line(out, "served", &self.served.join(", "));
        }
        if self.outputs.is_empty() && self.served.is_empty() {
            line(
                out,
                "wrote",
                "nothing: add -o attitude.mcap (or .ndjson, .csv, -)",
            );
        }
    }

    /// Text for people, every line.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for topic in &self.topics {
            let _ = writeln!(
                out,
                "{}  {}  {}",
                self.source, topic.topic, topic.decoded_as
            );
            rows::text(&topic.rows(self.file_losses > 0), &mut out);
        }
        for problem in &self.file_problems {
            line(&mut out, "file", problem);
        }
        for (name, bytes, messages) in &self.outputs {
            let what = if name == "null:" {
                "null: (nothing was kept)".to_owned()
            } else {
                format!("{name}  {}  {messages} messages", human_bytes(*bytes))
            };
            line(&mut out, "wrote", &what);
        }
        for (name, topic) in self.calibration.iter().zip(&self.topics) {
            let what = calibration::observed(&topic.calibration);
            line(&mut out, "wrote", &format!("{name}  {what}"));
        }
        for name in &self.served {
            line(&mut out, "served", name);
        }
        if self.outputs.is_empty() && self.served.is_empty() {
            line(
                &mut out,
                "wrote",
                "nothing: add -o attitude.mcap (or .ndjson, .csv, -)",
            );
        }
        let speed = self.samples() as f64 / self.elapsed_secs.max(1e-9);
        line(
            &mut out,
            "took",
            &format!(
                "{:.3} s, {} samples/s",
                self.elapsed_secs,
                human_count(speed)
            ),
        );
        out
    }

    /// JSON for machines: one object.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({
            "source": self.source,
            "topics": self.topics.iter().map(TopicSummary::json).collect::<Vec<_>>(),
            "file_problems": self.file_problems,
            "file_losses": self.file_losses,
            "outputs": self.outputs.iter().map(|(name, bytes, messages)| json!({
                "name": name, "bytes": bytes, "messages": messages,
            })).collect::<Vec<_>>(),
            "calibration": self.calibration,
            "served": self.served,
            "elapsed_s": self.elapsed_secs,
            "samples_per_s": self.samples() as f64 / self.elapsed_secs.max(1e-9),
            "lossy": self.is_lossy(),
        })
    }
}

/// A sample kind in words.
#[must_use]
pub fn meaning(kind: SampleKind) -> &'static str {
    match kind {
        SampleKind::Rate => "a sample is the rate at its stamp",
        SampleKind::Average => "a sample is the mean rate over the interval ending at its stamp",
        SampleKind::DeltaAngle => {
            "a sample is the angle turned over the interval ending at its stamp"
        }
        SampleKind::Rotation => {
            "a sample is the whole rotation in the interval ending at its stamp"
        }
    }
}

/// One labelled entry; what follows its first line stands under it.
pub(super) fn line(out: &mut String, label: &str, text: &str) {
    let mut label = label;
    for part in text.lines() {
        let _ = writeln!(out, "  {label:<8} {}", part.trim_start());
        label = "";
    }
}

/// `4.2 MB`.
#[must_use]
pub fn human_bytes(bytes: u64) -> String {
    const UNITS: [(&str, f64); 3] = [("GB", 1e9), ("MB", 1e6), ("kB", 1e3)];
    UNITS
        .iter()
        .find(|(_, scale)| bytes as f64 >= *scale)
        .map_or_else(
            || format!("{bytes} B"),
            |(unit, scale)| format!("{:.1} {unit}", bytes as f64 / scale),
        )
}

/// `3.2 M`.
#[must_use]
pub fn human_count(count: f64) -> String {
    if count >= 1e6 {
        format!("{:.2} M", count / 1e6)
    } else if count >= 1e4 {
        format!("{:.0} k", count / 1e3)
    } else {
        format!("{count:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strapd_attitude::record::Verdict;

    #[test]
    fn numbers_keep_the_digits_that_matter() {
        assert_eq!(significant(286.0, 5), "286.00");
        assert_eq!(significant(0.00123456, 2), "0.0012");
        assert_eq!(significant(1.5e-9, 2), "1.5e-9");
        assert_eq!(significant(0.0, 2), "0");
        assert_eq!(human_bytes(4_200_000), "4.2 MB");
        assert_eq!(human_count(2_500_000.0), "2.50 M");
    }

    #[test]
    fn a_run_that_lost_a_sample_or_held_a_gap_is_lossy() {
        let mut run = RunSummary {
            topics: vec![TopicSummary::default()],
            ..RunSummary::default()
        };
        assert!(run.is_lossy(), "without any attitude all was lost");
        if let Some(topic) = run.topics.first_mut() {
            topic.counts.add(Verdict::Accepted);
        }
        assert!(!run.is_lossy());
        if let Some(topic) = run.topics.first_mut() {
            topic.counts.add(Verdict::Repeated);
        }
        assert!(
            !run.is_lossy(),
            "an exact repeat carries nothing that could be lost"
        );
        if let Some(topic) = run.topics.first_mut() {
            topic.counts.add(Verdict::NotFinite);
        }
        assert!(run.is_lossy());
    }
}
