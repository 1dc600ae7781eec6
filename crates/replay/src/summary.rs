//! Summary of a replay -> text or JSON. Pure.
//!
//! Built by the pipeline, which knows the numbers; the words are here, in one place.

pub mod against;
pub mod aid;
pub mod calendar;
pub mod calibrating;
pub mod calibration;
pub mod gaps;
pub mod series;
pub(crate) mod sigma;
pub(crate) mod simulation;
pub mod smoothing;
pub mod stamps;
pub mod trace;

use self::aid::Aided;
pub use self::gaps::Gaps;
use self::series::Drawn;
use self::sigma::SigmaTerms;
use self::smoothing::Smoothing;
use self::stamps::Regularised;
use crate::finding::Finding;
use serde_json::{Value, json};
use std::fmt::Write as _;
use strapd_attitude::compare::{BiasFit, BodyAxesFit, Consistency};
use strapd_attitude::diagnostic::Diagnostic;
pub use strapd_attitude::digits::significant;
use strapd_attitude::estimate::SensorCalibration;
use strapd_attitude::record::{Counts, Nanos, SampleKind, Verdict};
use strapd_attitude::setting::AID;
use strapd_attitude::worlds::EARTH_RATE;

/// Summary of one topic of one log.
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
    /// Outcome of the stamps, if `--regularise-stamps` asked for it.
    pub stamps: Option<Regularised>,
    /// Kind for which a sample was taken.
    pub kind: SampleKind,
    /// The integrator in words.
    pub method: String,
    /// Axes of the recorded numbers.
    pub input_axes: String,
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
    /// Origin of the bias, with its sigma if it was estimated.
    pub bias_origin: String,
    /// Account of what corrected the attitude, if something did.
    pub aided: Option<Aided>,
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
    /// Series to draw, if a report asked for them.
    pub drawn: Option<Box<Drawn>>,
}

/// Error against a recorded orientation for one meaning of a sample.
#[derive(Clone, Debug)]
pub struct Against {
    /// `rate`, `average` or `held`.
    pub kind: &'static str,
    /// Meaning of the kind.
    pub meaning: &'static str,
    /// Median of the error of the rotation over 1 s, deg.
    pub median_deg: f64,
    /// 95th percentile of it, deg.
    pub p95_deg: f64,
    /// Pairs compared.
    pub pairs: usize,
}

/// A recorded orientation that was compared with.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Recorded {
    /// Recorded attitudes that are rotations (a long log's are thinned).
    pub usable: usize,
    /// Recorded quadruples that are none: norm far from 1, zero, NaN.
    pub unusable: u64,
    /// All of them are one and the same.
    pub constant: bool,
    /// Axes of its body relative to the gyro's; `None` = the motion does not tell.
    pub axes: Option<BodyAxesFit>,
    /// Whether the run's errors lie within what it said of them; `None` = no instant in common, or no sigma.
    pub consistency: Option<Consistency>,
    /// The bias by which the gyro alone leaves it.
    pub bias: Option<BiasFit>,
    /// The bias that was removed before, rad/s.
    pub removed: [f64; 3],
    /// Resets by its source: errors are those of the parts between, each aligned by itself.
    pub resets: usize,
}

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

    /// Text for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for topic in &self.topics {
            topic.write_text(&self.source, self.file_losses > 0, &mut out);
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

impl TopicSummary {
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

    fn write_text(&self, source: &str, damaged: bool, out: &mut String) {
        let _ = writeln!(out, "{source}  {}  {}", self.topic, self.decoded_as);
        let rate = self
            .rate_hz
            .map_or_else(String::new, |hz| format!(" at {} Hz", significant(hz, 5)));
        line(
            out,
            "samples",
            &format!(
                "{} in, {} used; {:.3} s{rate}, {} clock",
                self.counts.total(),
                self.counts.used(),
                self.duration_secs,
                self.clock
            ),
        );
        if let Some(stamps) = &self.stamps {
            line(out, "stamps", &stamps.text());
        }
        line(
            out,
            "method",
            &format!("{}; {}", self.method, meaning(self.kind)),
        );
        line(
            out,
            "frames",
            &format!(
                "input {} -> body {} -> world {}; initial attitude: {}",
                self.input_axes, self.body, self.world, self.initial
            ),
        );
        if let Some(why) = self.not_smoothed() {
            line(out, "smooth", &why);
        }
        match self.has_attitude() {
            true => self.write_attitude(out),
            false => line(out, "final", "no attitude: no sample was used"),
        }
        line(out, "gaps", &self.gaps.text());
        line(out, "lost", &self.lost_text(damaged));
        for first in &self.first_losses {
            line(out, "", first);
        }
        self.write_against(out);
        for warning in self.warnings() {
            line(out, "warning", &warning);
        }
    }

    /// Writes what corrected the attitude, what was taken out, what it is at the end, and how well it is known.
    fn write_attitude(&self, out: &mut String) {
        let (name, lines) = match (self.smoothing(), &self.aided) {
            (Some(smoothing), _) => ("smooth", smoothing.lines()),
            (None, Some(aided)) => ("aid", aided.lines()),
            (None, None) => (
                "aid",
                vec![format!(
                    "none: the gyro alone, which drifts ({AID} gravity corrects tilt by the accelerometer)"
                )],
            ),
        };
        for (i, words) in lines.iter().enumerate() {
            line(out, if i == 0 { name } else { "" }, words);
        }
        line(out, "bias", &self.bias_text());
        if let Some(latitude) = self.latitude_deg {
            line(
                out,
                "earth",
                &format!(
                    "rotation taken out for latitude {} deg, {:.3} deg/h; rates stay relative to inertial space",
                    latitude,
                    EARTH_RATE.to_degrees() * 3600.0
                ),
            );
        }
        line(
            out,
            "turned",
            &format!(
                "{:.1} deg in all, at most {:.3} deg in one step",
                self.turned.to_degrees(),
                self.largest_step.to_degrees()
            ),
        );
        let [w, x, y, z] = self.final_wxyz;
        let [yaw, pitch, roll] = self.final_ypr.map(f64::to_degrees);
        line(
            out,
            "final",
            &format!(
                "roll {roll:.3}  pitch {pitch:.3}  yaw {yaw:.3} deg   q w {w:.6}  x {x:.6}  y {y:.6}  z {z:.6}"
            ),
        );
        let [sx, sy, sz] = self.final_sigma.map(f64::to_degrees);
        line(
            out,
            "sigma",
            &format!(
                "{}, {}, {} deg about x, y, z at the end; {}",
                significant(sx, 2),
                significant(sy, 2),
                significant(sz, 2),
                self.drift_text()
            ),
        );
        if let Some(terms) = &self.sigma_terms {
            line(out, "", &terms.text());
        }
        line(
            out,
            "numeric",
            &self.integration_error.map_or_else(
                || "integration error not estimated for this method".to_owned(),
                |error| {
                    format!(
                        "integration error at most about {} deg, by a window of four samples less{}",
                        significant(error.to_degrees(), 2),
                        self.gaps.not_in_the_error()
                    )
                },
            ),
        );
    }

    fn write_against(&self, out: &mut String) {
        if self.against.is_empty() {
            return;
        }
        line(
            out,
            "against",
            "the recorded orientation: error of the rotation over 1 s, median / 95 %, deg",
        );
        let best = self
            .against
            .iter()
            .map(|a| a.median_deg)
            .fold(f64::INFINITY, f64::min);
        for row in &self.against {
            let mark = if row.median_deg == best {
                "  <- best"
            } else {
                ""
            };
            line(
                out,
                "",
                &format!(
                    "{:<8} {:>8.3} / {:<8.3} {}{mark}",
                    row.kind, row.median_deg, row.p95_deg, row.meaning
                ),
            );
        }
        for words in self.recorded.iter().flat_map(Recorded::words) {
            line(out, "", &words);
        }
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

    /// Text of what the sigma is of, if something corrects the attitude; else of the drift.
    #[must_use]
    pub fn drift_text(&self) -> String {
        if let Some(smoothing) = self.smoothing() {
            return smoothing.sigma_text().to_owned();
        }
        if let Some(aided) = &self.aided {
            return aided.sigma_text().to_owned();
        }
        format!(
            "drift of about {} deg/h to be expected ({} noise)",
            significant(self.drift.to_degrees() * 3600.0, 2),
            self.noise
        )
    }

    fn bias_text(&self) -> String {
        if self.bias == [0.0; 3] {
            return format!("{} removed", self.bias_origin);
        }
        let [x, y, z] = self.bias;
        format!(
            "({x:.6}, {y:.6}, {z:.6}) rad/s removed, {}",
            self.bias_origin
        )
    }

    fn lost_text(&self, damaged: bool) -> String {
        let parts: Vec<String> = Verdict::ALL
            .iter()
            .filter(|v| !matches!(v, Verdict::Accepted) && self.counts.get(**v) > 0)
            .map(|v| format!("{} {}", self.counts.get(*v), v.name().replace('_', " ")))
            .collect();
        if parts.is_empty() {
            return if damaged {
                "nothing of what could be read, but the file is damaged:".to_owned()
            } else {
                "nothing".to_owned()
            };
        }
        format!(
            "{} of {} samples ({})",
            self.counts.lost(),
            self.counts.total(),
            parts.join(", ")
        )
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let [w, x, y, z] = self.final_wxyz;
        let [yaw, pitch, roll] = self.final_ypr.map(f64::to_degrees);
        json!({
            "topic": self.topic,
            "output_topic": self.output_topic,
            "decoded_as": self.decoded_as,
            "samples": {
                "total": self.counts.total(),
                "used": self.counts.used(),
                "lost": self.counts.lost(),
                "by_verdict": Verdict::ALL.iter()
                    .map(|v| (v.name().to_owned(), json!(self.counts.get(*v))))
                    .collect::<serde_json::Map<_, _>>(),
            },
            "left_out": self.left_out,
            "first_losses": self.first_losses,
            "written": self.written,
            "duration_s": self.duration_secs,
            "rate_hz": self.rate_hz,
            "clock": self.clock,
            "regularised_stamps": self.stamps.as_ref().map(Regularised::json),
            "sample_kind": self.kind.name(),
            "method": self.method,
            "input_axes": self.input_axes,
            "body": self.body,
            "world": self.world,
            "initial": self.initial,
            "bias_rad_s": { "x": self.bias[0], "y": self.bias[1], "z": self.bias[2],
                            "origin": self.bias_origin },
            "earth_rate": self.latitude_deg.map(|latitude| json!({
                "latitude_deg": latitude, "rad_s": EARTH_RATE,
            })),
            "aid": self.aided.as_ref().map(Aided::json),
            "smooth": self.smoothed.as_ref().map(|smoothed| match smoothed {
                Ok(smoothing) => smoothing.json(),
                Err(why) => json!({ "outcome": "filter", "why": why.to_string() }),
            }),
            "noise": self.noise,
            "sigma_terms": self.sigma_terms.as_ref().map(SigmaTerms::json),
            "drift_deg_per_h": self.drift.to_degrees() * 3600.0,
            "integration_error_deg": self.integration_error.map(f64::to_degrees),
            "gaps": {
                "bridged": self.gaps.bridged,
                "held": self.gaps.held,
                "resets": self.gaps.resets,
                "total_s": self.gaps.total_secs,
                "not_integrated_s": self.gaps.held_secs,
                "longest_s": self.gaps.longest_secs,
                "longest_at_s": self.gaps.longest_at_secs,
                "jumps_back": self.gaps.jumps_back,
                "farthest_back_s": self.gaps.farthest_back_secs,
                "farthest_back_at_s": self.gaps.farthest_back_at_secs,
            },
            "turned_deg": self.turned.to_degrees(),
            "largest_step_deg": self.largest_step.to_degrees(),
            "undersampled_steps": self.undersampled,
            "final": self.has_attitude().then(|| json!({
                "q": { "w": w, "x": x, "y": y, "z": z },
                "roll_deg": roll, "pitch_deg": pitch, "yaw_deg": yaw,
                "sigma_deg": self.final_sigma.map(f64::to_degrees),
            })),
            "against_recorded": self.against.iter().map(|a| json!({
                "kind": a.kind, "median_deg": a.median_deg, "p95_deg": a.p95_deg, "pairs": a.pairs,
            })).collect::<Vec<_>>(),
            "recorded": self.recorded.as_ref().map(Recorded::json),
            "warnings": self.warnings(),
            "findings": self.findings.iter().map(Finding::json).collect::<Vec<_>>(),
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
