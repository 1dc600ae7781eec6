//! Counts of the stages -> the summary of the run. Pure.

use super::delivery::broken;
use super::request::ReplayRequest;
use super::sample_kinds::AgainstRecorded;
use super::session::{FinishedRun, Topic};
use super::unmet::unmet;
use crate::field_watch::FieldWatch;
use crate::findings;
use crate::summary::calibration;
use crate::summary::series::Drawn;
use crate::summary::{RunSummary, TopicSummary, warning};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::SensorCalibration;
use strapd_attitude::record::Verdict;
use strapd_recording::Source;
use strapd_recording::mcap::Survey;

/// The summary of a run.
#[must_use]
pub(super) fn run(run: &ReplayRequest, ended: FinishedRun, survey: &Survey) -> RunSummary {
    let FinishedRun {
        mut topics,
        outputs,
    } = ended;
    RunSummary {
        source: run.source.name().display().to_string(),
        topics: topics
            .iter_mut()
            .map(|topic| of_topic(run, topic))
            .collect(),
        broken: broken(&outputs),
        reader_gone: !outputs.is_empty() && outputs.iter().all(|(_, written)| written.closed),
        outputs: outputs
            .into_iter()
            .map(|(name, written)| (name, written.bytes, written.messages))
            .collect(),
        calibration: None,
        served: run
            .targets
            .iter()
            .filter_map(|target| Some(target.listens()?.to_string()))
            .collect(),
        file_problems: strapd_recording::recording::opened::problems(survey),
        file_losses: survey.problems.losses(),
        elapsed_secs: 0.0,
    }
}

/// Summary of a topic, or the reason why there is none.
pub(super) type TopicOutcome = std::result::Result<Box<TopicSummary>, Diagnostic>;

/// Summaries of the topics of a run without outputs, or why one has not what was asked for.
pub(super) fn topics(run: &ReplayRequest, ended: FinishedRun) -> Vec<TopicOutcome> {
    let told = |mut topic: Topic| match unmet(&run.plan, &topic) {
        Some(what) => Err(what),
        None => Ok(Box::new(of_topic(run, &mut topic))),
    };
    ended.topics.into_iter().map(told).collect()
}

/// Summary of one topic.
pub(super) fn of_topic(run: &ReplayRequest, topic: &mut Topic) -> TopicSummary {
    let drawn = drawn(topic);
    let of = (&run.plan, &topic.resolved, &topic.prepared);
    let mut summary = TopicSummary {
        topic: topic.name.clone(),
        output_topic: topic.output_topic.clone(),
        decoded_as: topic.described.to_string(),
        left_out: topic.noticed.left_out().iter().map(|(_, n)| n).sum(),
        first_losses: first_losses(topic),
        written: topic.output.count,
        rate_hz: topic.output.rate_hz(),
        against: topic
            .against
            .as_ref()
            .map(AgainstRecorded::rows)
            .unwrap_or_default(),
        recorded: topic.against.as_ref().and_then(AgainstRecorded::recorded),
        drawn,
        warming: std::mem::take(&mut topic.warming.pairs),
        ..TopicSummary::of(of, &topic.estimator, topic.output.last.as_ref())
    };
    summary.findings.extend(topic.warnings.iter().map(warning));
    let found = findings::of_run(
        &summary,
        &findings::Noted {
            conditioning: topic.estimator.conditioning(),
            largest_rate: topic.output.largest_rate,
            marked_absent: topic.noticed.gyro_marked_absent.load(Ordering::Relaxed),
            zeros: topic.zeros.count(),
            stamps_carried: topic.noticed.stamps_carried.load(Ordering::Relaxed),
            left_out: &topic.noticed.left_out(),
            frozen_field: topic.field.as_ref().and_then(FieldWatch::frozen),
            dead_field: topic.field.as_ref().and_then(FieldWatch::dead_axis),
            saturated_field: topic.field.as_ref().and_then(FieldWatch::saturated),
            gyro: topic
                .estimator
                .consistency()
                .map(|consistency| (consistency, &run.plan, &topic.resolved)),
            field: topic
                .estimator
                .field_consistency()
                .map(|consistency| (consistency, &run.plan)),
            axes: topic.broken.found(),
            is_upside_down: topic.output.is_upside_down(),
            references: topic.against.as_ref().map(|a| a.references() as u64),
        },
    );
    summary.findings.extend(found);
    summary.calibration = calibrated(run, topic, summary.calibration);
    for finding in &mut summary.findings {
        finding.topic.clone_from(&summary.topic);
    }
    summary
}

/// Calibration of the sensor at the end, with whose it is and from where.
fn calibrated(run: &ReplayRequest, topic: &Topic, known: SensorCalibration) -> SensorCalibration {
    let source = match &run.source {
        Source::File(path) => path.file_name().unwrap_or_default().to_string_lossy(),
        Source::Parts(paths) => parts_named(paths).into(),
        Source::Stdin => "standard input".into(),
        Source::Elsewhere(_) => {
            let name = run.source.name();
            let name = name.file_name().unwrap_or_default().to_string_lossy();
            name.into_owned().into()
        }
    };
    calibration::described(known, &topic.name, &source, topic.output.last.as_ref())
}

/// The first of several files, and how many more.
fn parts_named(paths: &[PathBuf]) -> String {
    let first = paths.first().and_then(|path| path.file_name());
    let more = paths.len().saturating_sub(1);
    format!(
        "{} and {more} more",
        first.unwrap_or_default().to_string_lossy()
    )
}

/// Series kept to be drawn, with the errors against the reference.
fn drawn(topic: &mut Topic) -> Option<Box<Drawn>> {
    let mut drawn = topic.history.take()?.finish();
    if let Some(against) = &topic.against {
        let elapsed = &drawn.elapsed;
        let errors = against.errors(drawn.stretches, topic.resolved.kind, |stamp| {
            elapsed.at(stamp)
        });
        drawn.errors = Some(errors);
    }
    Some(Box::new(drawn))
}

fn first_losses(topic: &Topic) -> Vec<String> {
    let report = topic.estimator.conditioning();
    let start = report.first.unwrap_or_default();
    let mut said: Vec<String> = Verdict::ALL
        .iter()
        .filter(|v| v.is_loss() && **v != Verdict::Undecodable)
        .filter_map(|v| report.first_bad(*v).map(|bad| (v, bad)))
        .map(|(verdict, bad)| {
            let at = bad
                .stamp
                // A stamp that is none says nothing about when.
                .filter(|_| !matches!(verdict, Verdict::NoStamp | Verdict::FarStamp))
                .map_or_else(String::new, |s| format!(" at {:.6} s", s.secs_since(start)));
            format!(
                "first {}: sample {}{at}",
                verdict.name().replace('_', " "),
                bad.index
            )
        })
        .collect();
    if let Some((log, why)) = &topic.first_undecodable {
        // Payloads of lines and rows carry their number where others carry a time.
        said.push(if topic.described.text.is_some() {
            format!("first undecodable, line {}: {why}", log.0)
        } else {
            format!("first undecodable, logged at {} ns: {why}", log.0)
        });
    }
    said
}
