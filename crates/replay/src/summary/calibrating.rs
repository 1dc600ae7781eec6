//! Facts that recordings have told of a sensor -> words, JSON, and the motions that are missing. Pure.

use super::calibration;
use super::{TopicSummary, significant};
use crate::finding::Finding;
use serde_json::{Value, json};
use std::fmt::Write as _;
use strapd_attitude::estimate::{CalibrationTerm, Pooled, SensorCalibration};

/// One recording's part in a calibration.
#[derive(Clone, Debug)]
pub struct Recorded {
    log: String,
    topic: String,
    samples: u64,
    secs: f64,
    /// Why the smoother made nothing of it: what is known of the sensor is the real-time filter's then.
    not_smoothed: Option<String>,
    /// Doubts about it.
    doubts: Vec<String>,
    /// Names of the numbers that were estimated.
    told: Vec<String>,
}

impl Recorded {
    /// Makes it of a run that began with nothing known.
    #[must_use]
    pub fn of(log: &str, topic: &TopicSummary) -> Recorded {
        let smoothing = topic.smoothing();
        Recorded {
            log: log.to_owned(),
            topic: topic.topic.clone(),
            samples: topic.counts.used(),
            secs: topic.duration_secs,
            not_smoothed: topic.not_smoothed(),
            doubts: smoothing.map_or_else(Vec::new, |s| {
                let doubts = s.doubts(&topic.noise);
                doubts.iter().map(Finding::line).collect()
            }),
            told: calibration::names(&topic.calibration),
        }
    }
}

/// Result of `calibrate`.
#[derive(Clone, Debug)]
pub struct Calibrating {
    /// The recordings, in order.
    pub recorded: Vec<Recorded>,
    /// The sensor by all of them, and what was known before.
    pub pooled: Pooled,
    /// Whether a magnetometer was asked for.
    pub has_magnetometer: bool,
    /// Path at which it was written.
    pub file: Option<String>,
}

/// Limit above which recordings do not describe the same sensor within what they claim to know.
const DISAGREEING: f64 = 2.0;

impl Calibrating {
    /// Text for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for recorded in &self.recorded {
            let Recorded {
                log,
                topic,
                samples,
                secs,
                ..
            } = recorded;
            let _ = writeln!(out, "{log}  {topic}  {samples} samples, {secs:.1} s");
            let mut line = |name: &str, text: &str| {
                let _ = writeln!(out, "  {name:<11}{text}");
            };
            match recorded.told.as_slice() {
                [] => line("estimated", "NOTHING"),
                told => line("estimated", &told.join(", ")),
            }
            let doubts = recorded.not_smoothed.iter().chain(&recorded.doubts);
            doubts.for_each(|doubt| line("doubt", doubt));
        }
        let _ = writeln!(out, "the sensor");
        let mut line = |name: &str, text: &str| {
            let _ = writeln!(out, "  {name:<22}{text}");
        };
        for row in rows(&self.pooled.calibration) {
            let [value, sigma] = [&row.value, &row.sigma].map(|numbers| {
                let said: Vec<String> = numbers.iter().map(|v| significant(*v, 3)).collect();
                said.join(", ")
            });
            line(
                row.label(),
                &match row.sigma.is_empty() {
                    true => format!("({value}) {}", row.unit),
                    false => format!("({value}) +- ({sigma}) {}{}", row.unit, row.part()),
                },
            );
        }
        let parts = ["gyro", "accelerometer", "magnetometer"];
        for (part, by) in parts.iter().zip(self.pooled.disagreement) {
            let Some(by) = by else { continue };
            let said = significant(by, 2);
            let differ = format!("{part}: the recordings differ by {said} of their sigmas");
            line(
                "agreement",
                &match by {
                    _ if by > DISAGREEING => format!(
                        "POOR, {differ}, which were made as much larger: is it one sensor, at one temperature?"
                    ),
                    _ if by > 1.0 => format!("{differ}, which were made as much larger"),
                    _ => differ,
                },
            );
        }
        for motion in self.missing() {
            line("not observable", &motion);
        }
        if let Some(file) = &self.file {
            line(
                "wrote",
                &format!(
                    "{file}  {}",
                    calibration::observed(&self.pooled.calibration)
                ),
            );
        }
        out
    }

    /// Motions that would show what is not known yet.
    #[must_use]
    pub fn missing(&self) -> Vec<String> {
        fn unknown<const N: usize>(known: &Option<CalibrationTerm<N>>) -> Vec<usize> {
            let is_known = |i: &usize| {
                known
                    .as_ref()
                    .and_then(|known| known.sigma_of(*i))
                    .is_some()
            };
            (0..N).filter(|i| !is_known(i)).collect()
        }
        let known = &self.pooled.calibration;
        let mut missing = Vec::new();
        if !unknown(&known.bias).is_empty() {
            missing.push(
                "the gyro's bias: rest for two seconds, at the beginning and at the end".to_owned(),
            );
        }
        let gyro = unknown(&known.gyro);
        let axes: Vec<&str> = [(0, "x"), (4, "y"), (8, "z")]
            .iter()
            .filter(|(i, _)| gyro.contains(i))
            .map(|(_, axis)| *axis)
            .collect();
        if !axes.is_empty() {
            missing.push(format!(
                "the gyro's scale about {}: hold that axis level and turn about it, two full turns one way and back, then rest",
                axes.join(" and ")
            ));
        }
        if axes.is_empty() && !gyro.is_empty() {
            missing.push(
                "the gyro's misalignment: turn about each axis by half a turn and more, with rests between"
                    .to_owned(),
            );
        }
        if !unknown(&known.force_bias).is_empty() || !unknown(&known.force).is_empty() {
            missing.push(
                "the accelerometer: rest for two seconds in each of six attitudes, every axis up and down once"
                    .to_owned(),
            );
        }
        if !unknown(&known.lead).is_empty() {
            missing.push(
                "the accelerometer's time offset: turn fast, to and fro, at 200 deg/s and more"
                    .to_owned(),
            );
        }
        if self.has_magnetometer {
            let hard = unknown(&known.hard_iron);
            let axes: Vec<&str> = ["x", "y", "z"]
                .into_iter()
                .enumerate()
                .filter(|(i, _)| hard.contains(i))
                .map(|(_, axis)| axis)
                .collect();
            if !axes.is_empty() {
                missing.push(format!(
                    "the magnetometer's hard iron along {}: rotate it so that each of these axes points along the field and against it, away from iron",
                    axes.join(" and ")
                ));
            }
            if !unknown(&known.soft_iron).is_empty() {
                missing.push(
                    "the magnetometer's soft iron: none above 3 % shows; rotate it about every axis for two minutes, away from iron"
                        .to_owned(),
                );
            }
        }
        missing
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let recorded: Vec<Value> = self
            .recorded
            .iter()
            .map(|r| {
                json!({
                    "log": r.log, "topic": r.topic, "samples": r.samples, "duration_s": r.secs,
                    "told": r.told, "not_smoothed": r.not_smoothed, "doubts": r.doubts,
                })
            })
            .collect();
        let sensor: serde_json::Map<String, Value> = rows(&self.pooled.calibration)
            .into_iter()
            .map(|row| {
                let of = json!({
                    "value": row.value, "sigma": row.sigma, "observed": row.observed, "unit": row.unit,
                });
                (row.name.to_owned(), of)
            })
            .collect();
        json!({
            "recordings": recorded,
            "sensor": sensor,
            "disagreement_sigmas": {
                "gyro": self.pooled.disagreement[0],
                "accelerometer": self.pooled.disagreement[1],
                "magnetometer": self.pooled.disagreement[2],
            },
            "missing": self.missing(),
            "wrote": self.file,
        })
    }
}

/// Numbers of a calibration as people read them.
struct Row {
    /// Key in JSON, and of most rows the label.
    name: &'static str,
    unit: &'static str,
    value: Vec<f64>,
    /// Empty where nothing is said.
    sigma: Vec<f64>,
    observed: Vec<bool>,
}

impl Row {
    /// Words for people; `name` is the key in JSON.
    fn label(&self) -> &'static str {
        match self.name {
            "gyro axes" => "gyro misalignment",
            "accel axes" => "accel misalignment",
            "accel lead" => "accel time offset",
            "soft iron axes" => "soft iron cross-axis",
            "mag lead" => "mag time offset",
            name => name,
        }
    }

    /// Name of the part that data have not told.
    fn part(&self) -> &'static str {
        match self.observed.iter().filter(|o| **o).count() {
            0 => ", not observed",
            n if n < self.observed.len() => ", in part not observed",
            _ => "",
        }
    }
}

fn rows(known: &SensorCalibration) -> Vec<Row> {
    fn row<const N: usize>(
        (name, unit): (&'static str, &'static str),
        known: &Option<CalibrationTerm<N>>,
        factor: f64,
        places: &[usize],
    ) -> Option<Row> {
        let known = known.as_ref()?;
        let of = |numbers: &[f64; N]| -> Vec<f64> {
            let places = places.iter().filter_map(|i| numbers.get(*i));
            places.map(|v| v * factor).collect()
        };
        Some(Row {
            name,
            unit,
            value: of(&known.value),
            sigma: known.sigma.as_ref().map(of).unwrap_or_default(),
            observed: places
                .iter()
                .filter_map(|i| known.observed.get(*i).copied())
                .collect(),
        })
    }
    const DIAGONAL: [usize; 3] = [0, 4, 8];
    const OTHERS: [usize; 6] = [1, 2, 3, 5, 6, 7];
    let deg = 1_f64.to_degrees();
    [
        row(("gyro bias", "deg/s"), &known.bias, deg, &[0, 1, 2]),
        row(("gyro scale", "%"), &known.gyro, 100.0, &DIAGONAL),
        row(("gyro axes", "deg"), &known.gyro, deg, &OTHERS),
        row(("accel bias", "m/s^2"), &known.force_bias, 1.0, &[0, 1, 2]),
        row(("accel scale", "%"), &known.force, 100.0, &DIAGONAL),
        row(("accel axes", "deg"), &known.force, deg, &OTHERS),
        row(("accel lead", "ms"), &known.lead, 1e3, &[0]),
        row(
            ("hard iron", "as recorded"),
            &known.hard_iron,
            1.0,
            &[0, 1, 2],
        ),
        row(("soft iron", "%"), &known.soft_iron, 100.0, &DIAGONAL),
        row(("soft iron axes", "deg"), &known.soft_iron, deg, &OTHERS),
        row(("mag lead", "ms"), &known.field_lead, 1e3, &[0]),
        row(("truncation", "deg/s"), &known.truncation_step, deg, &[0]),
    ]
    .into_iter()
    .flatten()
    .collect()
}
