//! An estimator as it is now -> the summary of its topic, and its rows. Pure.
//!
//! A figure of an estimator stands in this file alone: a field, what it is taken from, and its row, of which text,
//! JSON, page and Python are made. The words of a row that is more than its number are in `words`.

mod brief;
mod words;

use super::against::{Against, Recorded, against_text};
use super::aid::FilterSummary;
use super::clocks::{clock_set_row, clock_was_set, wraps_row};
use super::gaps::Gaps;
use super::meaning;
use super::rows::{self, Row};
use super::series::Drawn;
use super::sigma::SigmaTerms;
use super::smoothing::Smoothing;
use super::stamps::Regularised;
use super::warming::Warming;
use crate::finding::{AS_READ, Finding, Severity};
use serde_json::Value;
use strapd_attitude::condition::{ClockSet, Wraps};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    EstimationSettings, Estimator, KindReason, Meaning, Mended, Prepared, SensorCalibration,
    learned,
};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{AttitudeSample, Counts, Nanos, SampleKind};
use words::{earth_json, earth_text, mended_json, method_words, sensor_maps, smoothed_json};

/// Text of a sigma where no noise was stated.
const NO_SIGMA: &str = "not known: no noise was stated";

/// Summary of one topic: of a log, or of samples that still come.
#[derive(Clone, Debug, Default)]
pub struct TopicSummary {
    /// Topic of the samples.
    pub topic: String,
    /// Topic of the attitude.
    pub output_topic: String,
    /// Message type and encoding, as found.
    pub decoded_as: String,
    /// Outcome of every sample.
    pub counts: Counts,
    /// Messages of another body, by the frame they name, that nobody asked to leave out.
    pub left_out: u64,
    /// The first sample of each verdict that is a loss, explained.
    pub first_losses: Vec<String>,
    /// Attitudes written.
    pub written: u64,
    /// First to last stamp, s.
    pub duration_secs: f64,
    /// The first and the last stamp.
    pub span: Option<(Nanos, Nanos)>,
    /// Median sample rate, Hz.
    pub rate_hz: Option<f64>,
    /// The clock the samples were placed on.
    pub clock: String,
    /// Wraps of the counter behind the stamps.
    pub wraps: Option<Wraps>,
    /// Steps of the stamp clock that the arrival clock did not make.
    pub clock_set: Option<ClockSet>,
    /// Outcome of the stamps, if `--regularise-stamps` asked for it.
    pub stamps: Option<Regularised>,
    /// Kind for which a sample was taken.
    pub kind: SampleKind,
    /// Reason for that kind.
    pub kind_reason: KindReason,
    /// The integrator in words.
    pub method: String,
    /// Axes of the recorded numbers.
    pub input_axes: String,
    /// Maps and factors of single sensors, where settings state them.
    pub sensor_maps: Option<String>,
    /// Cures that were applied.
    pub mended: Vec<Mended>,
    /// Axes of the body.
    pub body: String,
    /// World of the attitude.
    pub world: String,
    /// Origin of the initial attitude.
    pub initial: String,
    /// Latitude for which the Earth's rotation was taken out, deg.
    pub latitude_deg: Option<f64>,
    /// Bias removed, rad/s, body axes.
    pub bias: [f64; 3],
    /// Uncertainty of the bias removed, rad/s, body axes.
    pub bias_sigma: [f64; 3],
    /// Origin of the bias, with its sigma if it was estimated.
    pub bias_origin: String,
    /// Step in which the driver cut the rates, rad/s, where half of it was put back.
    pub truncation_step: Option<f64>,
    /// Samples of the gyro that were spikes and were repaired.
    pub spikes: u64,
    /// Samples whose force was a glitch of the accelerometer alone and was left out.
    pub force_spikes: u64,
    /// Account of what corrected the attitude, if something did.
    pub aided: Option<FilterSummary>,
    /// Result of a smoother, if one was asked for, or why there is none: then the attitude is that of `aided`.
    pub smoothed: Option<Result<Smoothing, Diagnostic>>,
    /// Calibration of the sensor at the end.
    pub calibration: SensorCalibration,
    /// Noise behind sigma.
    pub noise: String,
    /// Terms of sigma.
    pub sigma_terms: Option<SigmaTerms>,
    /// Drift to be expected from what is not known of the bias, rad/s.
    pub drift: f64,
    /// Bound on the worst attitude error of the integration itself, rad; `None` where the method cannot tell.
    pub integration_error: Option<f64>,
    /// Gaps.
    pub gaps: Gaps,
    /// Sum of the angles of all steps, rad.
    pub turned: f64,
    /// Largest angle of one step, rad.
    pub largest_step: f64,
    /// Steps of more than half a turn.
    pub undersampled: u64,
    /// Last attitude `[w, x, y, z]`.
    pub final_wxyz: [f64; 4],
    /// Final yaw, pitch, roll, rad.
    pub final_ypr: [f64; 3],
    /// One standard deviation about each body axis at the end, rad.
    pub final_sigma: [f64; 3],
    /// Comparisons with the recorded orientation, one row per sample kind.
    pub against: Vec<Against>,
    /// Description of the recorded orientation itself, if one was compared with.
    pub recorded: Option<Recorded>,
    /// Things to know, each with the flag that helps.
    pub findings: Vec<Finding>,
    /// The bias against the temperature.
    pub warming: Warming,
    /// Series to draw, if a report asked for them.
    pub drawn: Option<Box<Drawn>>,
}

impl TopicSummary {
    /// Summary of what `estimator` knows now; `last` is its newest attitude. Names, outputs and what else a run knows of
    /// a topic are left empty.
    #[must_use]
    pub fn of(
        (plan, resolved, prepared): (&EstimationSettings, &Meaning, &Prepared),
        estimator: &Estimator,
        last: Option<&AttitudeSample>,
    ) -> TopicSummary {
        let conditioning = estimator.conditioning();
        let propagation = estimator.propagation();
        let (world, body) = resolved.labels(prepared.world);
        let q = last.map_or_else(Quaternion::identity, |s| s.q_nb);
        let angles = q.yaw_pitch_roll();
        let first = conditioning.first.unwrap_or_default();
        let recording = estimator.smoothed().and_then(Result::ok);
        let smoothed = estimator.smoothed().map(|result| {
            let result = result.map(Smoothing::of);
            result.map_err(Diagnostic::clone)
        });
        let gaps = Gaps::of(conditioning, &propagation);
        let choice = estimator.sample_kind();
        TopicSummary {
            counts: conditioning.counts,
            duration_secs: conditioning.duration_nanos() as f64 * 1e-9,
            span: conditioning.first.zip(conditioning.last),
            rate_hz: conditioning
                .spacing_nanos
                .filter(|n| *n > 0)
                .map(|n| 1e9 / n as f64),
            clock: prepared.clock.name().to_owned(),
            wraps: conditioning.wraps,
            clock_set: conditioning.clock_set,
            stamps: estimator
                .regularising()
                .map(|(causal, report)| Regularised::of(causal, &report, first)),
            kind: choice.kind,
            kind_reason: choice.reason,
            method: match &smoothed {
                Some(Ok(smoothing)) => smoothing.method(),
                _ => method_words(estimator.method(), choice.kind),
            },
            body,
            world,
            initial: prepared.initial_origin.clone(),
            latitude_deg: plan.latitude_deg,
            bias: prepared.bias.into(),
            bias_sigma: prepared.bias_sigma.into(),
            bias_origin: prepared.bias_origin.clone(),
            truncation_step: prepared.truncation_step,
            spikes: conditioning.spikes.samples,
            force_spikes: conditioning.force_spikes.samples,
            aided: estimator.filter().map(FilterSummary::of),
            smoothed,
            calibration: learned((plan, resolved, prepared), estimator.filter(), recording),
            noise: prepared.noise.name.clone(),
            sigma_terms: recording
                .is_none()
                .then(|| SigmaTerms::of(plan, prepared, gaps.bridged)),
            drift: drift(prepared, propagation.integrated_secs),
            // Of what runs along with a smoother it would be another attitude's.
            integration_error: propagation
                .integration_error
                .filter(|_| recording.is_none()),
            input_axes: resolved.body.to_string(),
            sensor_maps: sensor_maps(plan),
            mended: plan.mended.clone(),
            gaps,
            turned: propagation.angle_turned,
            largest_step: propagation.largest_step,
            undersampled: propagation.undersampled,
            final_wxyz: q.wxyz(),
            final_ypr: [angles.yaw, angles.pitch, angles.roll],
            final_sigma: last.map_or([0.0; 3], |s| s.covariance.sigma().into()),
            findings: prepared
                .warnings
                .iter()
                .map(warning)
                .chain(conditioning.clock_set.map(clock_was_set))
                .collect(),
            ..TopicSummary::default()
        }
    }

    /// Whether samples were lost, or time in which nothing is known.
    #[must_use]
    pub fn is_lossy(&self) -> bool {
        self.counts.lost() + self.left_out > 0
            || self.gaps.held + self.gaps.resets > 0
            || !self.has_attitude()
    }

    /// Whether a sample was used, so that there is an attitude.
    #[must_use]
    pub fn has_attitude(&self) -> bool {
        self.counts.used() > 0
    }

    /// All of it: in the order of the text, for people and machines. `is_damaged`: the file lost some of its data.
    #[must_use]
    pub fn rows(&self, is_damaged: bool) -> Vec<Row> {
        // What is said of an attitude where there is one.
        let seen = |line: String| self.has_attitude().then_some(line);
        let (corrector, corrected) = self.correction();
        let mut rows = vec![
            Row::value("topic", self.topic.as_str()),
            Row::value("output_topic", self.output_topic.as_str()),
            Row::value("decoded_as", self.decoded_as.as_str()),
            Row::value("samples", self.counts_json()).told("samples", [self.samples_text()]),
            Row::value("left_out", self.left_out),
            Row::value("written", self.written),
            Row::value("duration_s", self.duration_secs),
            Row::value("rate_hz", self.rate_hz),
            Row::value("clock", self.clock.as_str()),
            wraps_row(self.wraps, self.span),
            clock_set_row(self.clock_set),
            Row::value(
                "regularised_stamps",
                self.stamps.as_ref().map(Regularised::json),
            )
            .told("stamps", self.stamps.as_ref().map(Regularised::text)),
            Row::value("sample_kind", self.kind.name()),
            Row::value("sample_kind_by", self.kind_reason.name()),
            Row::value("method", self.method.as_str()).told(
                "method",
                [format!(
                    "{}; {} ({})",
                    self.method,
                    meaning(self.kind),
                    self.kind_reason
                )],
            ),
            Row::value("input_axes", self.input_axes.as_str()),
            Row::value("sensor_maps", self.sensor_maps.as_deref())
                .told("sensors", self.sensor_maps.clone()),
            Row::value(
                "mended",
                self.mended.iter().map(mended_json).collect::<Value>(),
            )
            .told("mended", self.mended_text()),
            Row::value("body", self.body.as_str()),
            Row::value("world", self.world.as_str()),
            Row::value("initial", self.initial.as_str()).told("frames", [self.frames_text()]),
            Row::value("smooth", self.smoothed.as_ref().map(smoothed_json))
                .told("smooth", self.not_smoothed()),
            Row::value("aid", self.aided.as_ref().map(FilterSummary::json))
                .told(corrector, corrected.into_iter().filter_map(seen)),
            Row::value("bias_rad_s", self.bias_json()).told("bias", seen(self.bias_text())),
            Row::value("bias_sigma_rad_s", self.bias_sigma.as_slice()),
            Row::value("temperature", self.warming.json())
                .told("warming", self.warming.text().and_then(seen)),
            Row::value("truncation_step_rad_s", self.truncation_step),
            Row::value("repaired_spikes", self.spikes),
            Row::value("forces_left_out", self.force_spikes),
            Row::value("earth_rate", self.latitude_deg.map(earth_json))
                .told("earth", self.latitude_deg.map(earth_text).and_then(seen)),
            Row::angle("turned_deg", self.turned).told("turned", seen(self.turned_text())),
            Row::angle("largest_step_deg", self.largest_step),
            Row::value("undersampled_steps", self.undersampled),
            Row::value("final", self.has_attitude().then(|| self.final_json()))
                .told("final", [self.final_text()]),
            Row::value("noise", self.noise.as_str()).told("sigma", seen(self.sigma_text())),
            Row::value("sigma_holds", self.sigma_holds()).told("", self.sigma_doubt()),
            Row::value(
                "sigma_terms",
                self.sigma_terms.as_ref().map(SigmaTerms::json),
            )
            .told(
                "",
                self.sigma_terms
                    .as_ref()
                    .and_then(|terms| seen(terms.text())),
            ),
            Row::value("drift_deg_per_h", self.drift_deg_per_h()),
            Row::angle("integration_error_deg", self.integration_error)
                .told("numeric", seen(self.error_text())),
            Row::value("gaps", self.gaps.json()).told("gaps", [self.gaps.text()]),
            Row::value("first_losses", self.first_losses.as_slice()).told(
                "lost",
                std::iter::once(self.lost_text(is_damaged)).chain(self.first_losses.clone()),
            ),
            Row::value("against_recorded", Against::json(&self.against)).told(
                "against",
                against_text(&self.against, self.recorded.as_ref()),
            ),
            Row::value("recorded", self.recorded.as_ref().map(Recorded::json)),
            Row::value("warnings", self.warnings()),
            Row::value(
                "findings",
                self.findings.iter().map(Finding::json).collect::<Value>(),
            ),
        ];
        rows.extend(
            self.warnings()
                .into_iter()
                .map(|said| Row::words("warning", [said])),
        );
        rows
    }

    /// JSON for machines: one object.
    #[must_use]
    pub fn json(&self) -> Value {
        rows::json(self.rows(false))
    }

    /// Result of a smoother, if there is one.
    #[must_use]
    pub fn smoothing(&self) -> Option<&Smoothing> {
        self.smoothed.as_ref()?.as_ref().ok()
    }

    /// Warning that a smoother was asked for and gave nothing.
    #[must_use]
    pub fn not_smoothed(&self) -> Option<String> {
        let why = self.smoothed.as_ref()?.as_ref().err()?;
        Some(format!(
            "NOT SMOOTHED: {}; the attitude is the real-time filter's",
            why.line()
        ))
    }

    /// Warnings, a line each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.findings.iter().map(Finding::line).collect()
    }

    /// Whether the attitude can be as good as its sigma: not where sensors contradict each other, or are not what they
    /// are taken for.
    #[must_use]
    pub fn sigma_holds(&self) -> bool {
        self.contradiction().is_none()
    }

    fn contradiction(&self) -> Option<&Finding> {
        self.findings.iter().find(|f| f.is_beyond_sigma())
    }
}

/// Finding of something that the preparation, or a run, noticed.
pub(crate) fn warning(said: &Diagnostic) -> Finding {
    Finding::said(Severity::Warning, said.code().unwrap_or(AS_READ), said)
}

/// Uncertainty of the bias after `secs`, about the worst axis, rad/s: what was not known at the start, and what it has
/// wandered since.
fn drift(prepared: &Prepared, secs: f64) -> f64 {
    prepared
        .bias_sigma
        .iter()
        .zip(prepared.noise.rrw)
        .map(|(bias, rrw)| bias.hypot(rrw * secs.sqrt()))
        .fold(0.0, f64::max)
}
