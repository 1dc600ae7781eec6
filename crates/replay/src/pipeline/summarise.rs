//! Counts of the stages -> the summary of the run. Pure.

use super::delivery::broken;
use super::request::ReplayRequest;
use super::sample_kinds::AgainstRecorded;
use super::session::{Ended, Topic};
use super::unmet::{FieldWatch, unmet};
use crate::finding::{Finding, Severity};
use crate::findings;
use crate::summary::aid::Aided;
use crate::summary::calibration;
use crate::summary::series::Drawn;
use crate::summary::sigma::SigmaTerms;
use crate::summary::smoothing::Smoothing;
use crate::summary::stamps::{Regularised, Segment};
use crate::summary::{Gaps, RunSummary, TopicSummary};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use strapd_attitude::condition::regularise;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{SensorCalibration, learned};
use strapd_attitude::propagate::Method;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{Nanos, SampleKind, Verdict};
use strapd_recording::Source;
use strapd_recording::format::Format;
use strapd_recording::mcap::Survey;

/// The summary of a run.
#[must_use]
pub(super) fn run(run: &ReplayRequest, ended: Ended, survey: &Survey) -> RunSummary {
    let Ended {
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
pub(super) type Told = std::result::Result<Box<TopicSummary>, Diagnostic>;

/// Summaries of the topics of a run without outputs, or why one has not what was asked for.
pub(super) fn topics(run: &ReplayRequest, ended: Ended) -> Vec<Told> {
    let told = |mut topic: Topic| match unmet(&run.plan, &topic) {
        Some(what) => Err(what),
        None => Ok(Box::new(of_topic(run, &mut topic))),
    };
    ended.topics.into_iter().map(told).collect()
}

/// Summary of one topic.
pub(super) fn of_topic(run: &ReplayRequest, topic: &mut Topic) -> TopicSummary {
    let drawn = drawn(topic);
    let conditioning = topic.estimator.conditioning();
    let propagation = topic.estimator.propagation();
    let (world, body) = topic.resolved.labels(topic.prepared.world);
    let last = topic.output.last;
    let q = last.map_or_else(Quaternion::identity, |s| s.q_nb);
    let angles = q.yaw_pitch_roll();
    let gaps = &conditioning.gaps;
    let first = conditioning.first.unwrap_or_default();
    let recording = topic.estimator.smoothed().and_then(Result::ok);
    let smoothed = topic.estimator.smoothed().map(|result| {
        let result = result.map(Smoothing::of);
        result.map_err(Diagnostic::clone)
    });
    let mut summary = TopicSummary {
        topic: topic.name.clone(),
        output_topic: topic.output_topic.clone(),
        decoded_as: topic.described.clone(),
        counts: conditioning.counts,
        left_out: topic.noticed.left_out().iter().map(|(_, n)| n).sum(),
        first_losses: first_losses(topic, first),
        written: topic.output.count,
        duration_secs: conditioning.duration_nanos() as f64 * 1e-9,
        span: conditioning.first.zip(conditioning.last),
        rate_hz: topic.output.rate_hz(),
        clock: topic.prepared.clock.name().to_owned(),
        stamps: topic
            .estimator
            .regularising()
            .map(|(causal, report)| regularised(causal, &report, first)),
        kind: match recording {
            Some(recording) if recording.is_taken_as_mean => SampleKind::Average,
            _ => topic.resolved.kind,
        },
        method: match &smoothed {
            Some(Ok(smoothing)) => smoothing.method(),
            _ => method_words(topic),
        },
        body,
        world,
        initial: topic.prepared.initial_origin.clone(),
        latitude_deg: run.plan.latitude_deg,
        bias: topic.prepared.bias.into(),
        bias_origin: topic.prepared.bias_origin.clone(),
        aided: topic.estimator.filter().map(Aided::of),
        smoothed,
        calibration: calibrated(run, topic),
        noise: run.plan.noise.name.clone(),
        sigma_terms: recording.is_none().then(|| {
            SigmaTerms::of(
                &run.plan,
                &topic.prepared,
                gaps.count.saturating_sub(gaps.not_bridged),
            )
        }),
        drift: drift(run, topic, propagation.integrated_secs),
        // Of what runs along with a smoother it would be another attitude's.
        integration_error: propagation
            .integration_error
            .filter(|_| recording.is_none()),
        input_axes: topic.resolved.body.to_string(),
        gaps: Gaps::of(conditioning, &propagation),
        turned: propagation.angle_turned,
        largest_step: propagation.largest_step,
        undersampled: propagation.undersampled,
        final_wxyz: q.wxyz(),
        final_ypr: [angles.yaw, angles.pitch, angles.roll],
        final_sigma: last.map_or([0.0; 3], |s| s.covariance.sigma().into()),
        against: topic
            .against
            .as_ref()
            .map(AgainstRecorded::rows)
            .unwrap_or_default(),
        recorded: topic.against.as_ref().and_then(AgainstRecorded::recorded),
        findings: Vec::new(),
        drawn,
    };
    let said = topic.prepared.warnings.iter().chain(&topic.warnings);
    summary.findings = said
        .map(|said| {
            Finding::said(
                Severity::Warning,
                said.code().unwrap_or("preparation"),
                said,
            )
        })
        .collect();
    let found = findings::of_run(
        &summary,
        &findings::Noted {
            conditioning: topic.estimator.conditioning(),
            largest_rate: topic.output.largest_rate,
            marked_absent: topic.noticed.gyro_marked_absent.load(Ordering::Relaxed),
            zeros: topic.zeros.count,
            stamps_carried: topic.noticed.stamps_carried.load(Ordering::Relaxed),
            left_out: &topic.noticed.left_out(),
            frozen_field: topic.field.as_ref().and_then(FieldWatch::frozen),
            references: topic.against.as_ref().map(|a| a.references() as u64),
        },
    );
    summary.findings.extend(found);
    for finding in &mut summary.findings {
        finding.topic.clone_from(&summary.topic);
    }
    summary
}

/// Calibration of the sensor at the end.
fn calibrated(run: &ReplayRequest, topic: &Topic) -> SensorCalibration {
    let filter = topic.estimator.filter();
    let recording = topic.estimator.smoothed().and_then(Result::ok);
    let of = (&run.plan, &topic.resolved, &topic.prepared);
    let known = learned(of, filter, recording);
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

/// Uncertainty of the bias at the end, about the worst axis, rad/s: what was not known at the start,
/// and what it has wandered since.
fn drift(run: &ReplayRequest, topic: &Topic, secs: f64) -> f64 {
    topic
        .prepared
        .bias_sigma
        .iter()
        .zip(run.plan.noise.rrw)
        .map(|(bias, rrw)| bias.hypot(rrw * secs.sqrt()))
        .fold(0.0, f64::max)
}

fn regularised(causal: bool, report: &regularise::Report, first: Nanos) -> Regularised {
    Regularised {
        causal,
        segments: report.segments,
        kept: report
            .kept
            .iter()
            .map(|s| Segment {
                from_secs: s.start.secs_since(first),
                samples: s.samples,
                rate_hz: s.rate_hz,
            })
            .collect(),
        rms_nanos: report.rms_nanos,
        p99_nanos: report.p99_nanos,
        max_nanos: report.max_nanos,
        jitter: report.jitter,
        ambiguous: report.ambiguous,
        uneven: report.is_uneven(),
    }
}

/// The method, `auto` with what it stands for.
fn method_words(topic: &Topic) -> String {
    match (topic.estimator.method(), topic.resolved.kind) {
        (Method::Auto, SampleKind::Rate) => "auto: centred window of 16 samples, exact".to_owned(),
        (Method::Auto, _) => "auto: centred window of 15 increments, exact".to_owned(),
        (other, _) => other.to_string(),
    }
}

fn first_losses(topic: &Topic, start: Nanos) -> Vec<String> {
    let report = topic.estimator.conditioning();
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
        said.push(if is_text(&topic.described) {
            format!("first undecodable, line {}: {why}", log.0)
        } else {
            format!("first undecodable, logged at {} ns: {why}", log.0)
        });
    }
    said
}

/// Whether it was read from lines or rows: their undecodable payloads carry the line's number where others carry a
/// time.
fn is_text(described: &str) -> bool {
    [Format::Lines, Format::Table, Format::Parquet]
        .iter()
        .map(|format| format.name())
        .any(|name| described == name || described.ends_with(&format!("[{name}]")))
}
