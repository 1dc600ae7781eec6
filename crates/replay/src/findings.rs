//! Facts about a log, a run or a live sensor -> findings: how bad, on what evidence, what to do. Pure.
//!
//! The one vocabulary: `info`, `check`, `report`, a replay's warnings and the daemon's `STATUS` take their words from
//! here. Thresholds are opinions, and lie here too, beside the words; what is counted of the samples for them is in
//! [`strapd_attitude::condition::quality`]. A finding's `code` is stable: scripts match on it.

mod axes;
mod cures;
mod live;
mod magnetometer;
mod orientation;
mod run;
mod samples;
mod sensors;
mod stream;
mod verdicts;

pub(crate) use cures::cure;
pub use live::{LiveFindings, SensorWatch, is_of_gyro, says};
pub use run::of_sensor;
pub(crate) use run::{Noted, of_run};
pub use samples::of_samples;
use strapd_attitude::setting::{AID, FIELD, TOPIC};
pub(crate) use stream::find as of_stream;

pub use crate::finding::{Finding, Severity};

use crate::inspection::{Checked, CheckedTopic};
use strapd_recording::text::named_few;

/// Finding of a log in which no topic of samples could be chosen.
pub(crate) fn no_topic(why: &strapd_recording::Error) -> Finding {
    let found = Finding::said(Severity::Error, "no-imu-topic", &why.unlisted());
    match why {
        strapd_recording::Error::NoImuTopic {
            undefined: None, ..
        } => found
            .advise("name the topic and where the rate lies in it")
            .help([TOPIC.to("NAME"), FIELD.to("gyro=PATH")]),
        _ => found,
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
    if let Some(made) = &checked.made_before {
        found.push(
            Finding::new(Severity::Warning, "made-before", made.to_string())
                .with("made_of", made.of.clone())
                .advise(
                    "its rates are those of that recording, less the bias: look at the recording",
                ),
        );
    }
    found.extend(checked.no_topic.clone());
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
            .help([TOPIC.to("NAME")]),
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
            .help([TOPIC.to("NAME")]),
        );
    }
    if checked.is_gyro_alone {
        let what = format!("the gyro alone was judged, as {AID} none asks");
        found.push(Finding::new(Severity::Note, "gyro-alone", what));
    }
    for topic in &checked.topics {
        let mut of_topic = of_run_and_samples(topic);
        for finding in &mut of_topic {
            // As those of its samples.
            if !topic.looked.is_likely {
                finding.severity = Severity::Note;
            }
            finding.topic.clone_from(&topic.looked.topic);
        }
        found.append(&mut of_topic);
    }
    found.sort_by_key(|f| std::cmp::Reverse(f.severity));
    found
}

/// Findings from the samples and from integrating them: the same as a replay reports of its run.
fn of_run_and_samples(topic: &CheckedTopic) -> Vec<Finding> {
    let summary = match &topic.replayed {
        Ok(summary) => summary,
        Err(why) => {
            let mut found = of_samples(&topic.looked);
            // That no clock moves is why, and has been said.
            if !topic.looked.has_no_clock() {
                found.push(Finding::said(Severity::Error, "refused", why));
            }
            return found;
        }
    };
    let mut found = samples::of_counted(&topic.looked, &summary.counts);
    run::missing(&summary.gaps, &mut found);
    found.extend(run::gaps(&summary.gaps));
    found.extend(run::steps(summary.undersampled, summary.largest_step));
    orientation::find(topic, &mut found);
    if summary.findings.iter().any(|f| f.code == "coarse-stamps") {
        found.retain(|f| f.code != "shared-stamps");
    }
    let known: Vec<&str> = found.iter().map(|f| f.code).collect();
    let is_new = |f: &&Finding| !known.contains(&f.code) && !orientation::CODES.contains(&f.code);
    let new: Vec<Finding> = summary.findings.iter().filter(is_new).cloned().collect();
    found.extend(new.into_iter().map(|finding| Finding {
        // What the run decided, and said.
        severity: match finding.code {
            "preparation" => Severity::Note,
            _ => finding.severity,
        },
        ..finding
    }));
    sensors::settle(&mut found);
    stream::settle(&mut found);
    found.extend(
        summary
            .mended_text()
            .map(|said| Finding::new(Severity::Note, "mended", format!("applied: {said}"))),
    );
    if summary.aided.is_some() {
        found.iter_mut().for_each(samples::follow_bias);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_comes_first() {
        assert!(Severity::Error > Severity::Warning && Severity::Warning > Severity::Note);
    }
}
