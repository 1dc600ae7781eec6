//! Account of what a smoother learned of a recording -> words, rows, JSON. Pure.

use super::significant;
use crate::finding::{Finding, Severity};
use serde_json::{Value, json};
use strapd_attitude::estimate::Recording;
use strapd_attitude::setting::{NOISE, SMOOTH};
use strapd_attitude::smooth::{Bias, Calibration, Counts, Estimated, HeldBias, Outcome, Sizes};

/// Degrees a second for each g in one radian a second for each m/s^2.
const DEG_S_PER_G: f64 = 57.295_779_513 * 9.806_65;

/// A recording that was smoothed.
#[derive(Clone, Debug)]
pub struct Smoothing {
    outcome: Outcome,
    counts: Counts,
    calibration: Calibration,
    /// Gyro, in the middle of the recording: bias and one sigma, deg/s.
    bias: ([f64; 3], [f64; 3]),
    /// The same at its end.
    last_bias: ([f64; 3], [f64; 3]),
    /// Wander over the recording, deg/s.
    wander: f64,
    sections: usize,
    has_north: bool,
    bound: [f64; 2],
    /// The bias that no motion told.
    held: Option<HeldBias>,
    is_beyond_class: bool,
    spooled_bytes: u64,
    sizes: Vec<Sizes>,
}

/// Sizes over a recording, as measured and as calibrated.
#[derive(Clone, Copy, Debug)]
struct Spread {
    mean: [f64; 2],
    /// Root mean square about it.
    deviation: [f64; 2],
}

impl Spread {
    /// `None` where there are too few to tell.
    fn of(sizes: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Spread> {
        let count = sizes.clone().count();
        if count < FEWEST {
            return None;
        }
        let mean =
            |value: &dyn Fn([f64; 2]) -> f64| sizes.clone().map(value).sum::<f64>() / count as f64;
        let means = [
            mean(&|[measured, _]| measured),
            mean(&|[_, calibrated]| calibrated),
        ];
        Some(Spread {
            mean: means,
            deviation: [
                mean(&|[measured, _]| (measured - means[0]).powi(2)).sqrt(),
                mean(&|[_, calibrated]| (calibrated - means[1]).powi(2)).sqrt(),
            ],
        })
    }

    fn text(&self, unit: &str) -> String {
        let [before, after] = [0, 1].map(|i| {
            let mean = significant(self.mean[i], 4);
            format!(
                "{mean} {unit} (spread {})",
                significant(self.deviation[i], 2)
            )
        });
        format!("{before} as measured, {after} as calibrated")
    }

    fn json(&self) -> Value {
        json!({
            "measured": {"mean": self.mean[0], "deviation": self.deviation[0]},
            "calibrated": {"mean": self.mean[1], "deviation": self.deviation[1]},
        })
    }
}

/// Segments that tell a spread.
const FEWEST: usize = 4;

impl Smoothing {
    /// Makes it as it is at the end of a run.
    #[must_use]
    pub fn of(recording: &Recording) -> Smoothing {
        let smoothed = &recording.smoothed;
        let biases: Vec<_> = smoothed.biases().collect();
        let middle = biases.get(biases.len() / 2);
        let deg = |v: &nalgebra::Vector3<f64>| v.map(f64::to_degrees).into();
        let said = |bias: Option<&Bias>| {
            bias.map_or(([0.0; 3], [0.0; 3]), |b| (deg(&b.value), deg(&b.sigma)))
        };
        let span = |axis: usize| {
            let of = biases.iter().filter_map(|b| b.value.get(axis).copied());
            let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), b| {
                (low.min(b), high.max(b))
            });
            high - low
        };
        let wander = (0..3).map(span).fold(0.0, f64::max);
        Smoothing {
            outcome: smoothed.outcome(),
            counts: *smoothed.counts(),
            calibration: *smoothed.calibration(),
            bias: said(middle),
            last_bias: said(biases.last()),
            wander: wander.to_degrees(),
            sections: smoothed.sections().len(),
            has_north: smoothed.sections().iter().any(|section| section.has_north),
            bound: smoothed.bound(),
            held: smoothed.held(),
            is_beyond_class: recording.is_beyond_class,
            spooled_bytes: recording.spooled_bytes,
            sizes: recording.sizes.clone(),
        }
    }

    /// Sizes of forces at rest and of fields, over time.
    #[must_use]
    pub fn sizes(&self) -> &[Sizes] {
        &self.sizes
    }

    /// Spreads of the force at rest, m/s^2, and of the field, uT.
    fn spreads(&self) -> [Option<Spread>; 2] {
        [
            Spread::of(self.sizes.iter().filter_map(|sizes| sizes.force)),
            Spread::of(self.sizes.iter().filter_map(|sizes| sizes.field)),
        ]
    }

    /// Name of what integrated.
    #[must_use]
    pub fn method(&self) -> String {
        "smoothed".to_owned()
    }

    /// Lines for people: what was done, then what was learned.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let counts = &self.counts;
        let mut did = match self.has_north {
            true => "gravity and field, the whole recording at once".to_owned(),
            false => "gravity, the whole recording at once; heading of the first sample".to_owned(),
        };
        did += &format!(
            ": at rest in {} of {} segments",
            counts.standstills, counts.segments
        );
        if let Outcome::Unsettled(left) = self.outcome {
            did += &format!(
                "; NOT SETTLED: it still turned by {} deg",
                significant(left.to_degrees(), 2)
            );
        }
        for (n, what) in [
            (counts.rejected, "samples could not be used"),
            (counts.bridged, "samples bridged"),
            (
                counts.breaks,
                "gaps too long to bridge, each with a heading of its own behind it",
            ),
        ] {
            if n > 0 {
                did += &format!(", {n} {what}");
            }
        }
        if let Some(held) = &self.held {
            let [rate, sigma] = [held.rate, held.sigma].map(|v| significant(v.to_degrees(), 2));
            did += &match held.is_by_rest {
                true => format!(
                    "; one axis stays vertical: the bias about it held at {rate} +- {sigma} deg/s, by rest"
                ),
                false => format!(
                    "; one axis stays vertical and nothing rests: the bias is not observed about it, held at {rate} +- {sigma} deg/s"
                ),
            };
        }
        if self.spooled_bytes > 0 {
            let size = super::human_bytes(self.spooled_bytes);
            did += &format!("; {size} of it kept in a temporary file");
        }
        let (scale, of_scale) = scales(&self.calibration.gyro);
        let (bias, of_bias) = &self.bias;
        let mut lines = vec![
            did,
            format!(
                "learned: bias {} +- {} deg/s, wandering {}; scale {} +- {} %; not observable: {}",
                triple(bias),
                triple(of_bias),
                significant(self.wander, 2),
                triple(&scale),
                triple(&of_scale),
                self.unobserved(),
            ),
        ];
        if let Some(magnetometer) = &self.calibration.magnetometer {
            lines.push(format!(
                "hard iron {} +- {} uT, of a field taken for {} uT north and {} up",
                triple(&magnetometer.hard_iron.value),
                triple(&magnetometer.hard_iron.sigma),
                significant(magnetometer.north_up.value[0], 3),
                significant(magnetometer.north_up.value[1], 3),
            ));
        }
        let [force, field] = self.spreads();
        lines.extend(force.map(|force| format!("force at rest {}", force.text("m/s^2"))));
        lines.extend(field.map(|field| format!("field {}", field.text("uT"))));
        lines
    }

    /// Text of what the recording told nothing of.
    fn unobserved(&self) -> String {
        let c = &self.calibration;
        let m = c.magnetometer.as_ref();
        let all = [
            part("gyro scale and misalignment", Some(&c.gyro)),
            part(
                "gyro sensitivity to acceleration",
                Some(&c.gyro_sensitivity),
            ),
            part("accelerometer bias", Some(&c.force_bias)),
            part("accelerometer scale and misalignment", Some(&c.force)),
            part("accelerometer time offset", Some(&c.force_time)),
            part("hard iron", m.map(|m| &m.hard_iron)),
            part("soft iron", m.map(|m| &m.matrix)),
            part("magnetometer time offset", m.map(|m| &m.time)),
        ];
        let said: Vec<String> = all.into_iter().flatten().collect();
        if said.is_empty() {
            "nothing".to_owned()
        } else {
            said.join(", ")
        }
    }

    /// Text of what the sigma of the attitude is of.
    #[must_use]
    pub fn sigma_text(&self) -> &'static str {
        if self.has_north {
            "of tilt and of heading from north, by the smoother"
        } else {
            "of tilt and of heading relative to the start, by the smoother"
        }
    }

    /// Rows of what was learned, under [`Smoothing::HEAD`].
    #[must_use]
    pub fn learned(&self) -> Vec<Vec<String>> {
        let c = &self.calibration;
        let [x, y, z] = self.bias.0.map(|v| significant(v, 3));
        let [of_x, of_y, of_z] = self.bias.1.map(|v| significant(v, 3));
        let name = "gyro bias in the middle, deg/s".to_owned();
        let mut rows = vec![vec![
            name,
            x,
            y,
            z,
            of_x,
            of_y,
            of_z,
            String::new(),
            String::new(),
        ]];
        matrix("gyro", &c.gyro, &mut rows);
        for (axis, places) in [("x", [0, 1, 2]), ("y", [3, 4, 5]), ("z", [6, 7, 8])] {
            let name = format!("gyro {axis} by acceleration, deg/s per g");
            rows.push(row(&name, &c.gyro_sensitivity, places, DEG_S_PER_G));
        }
        rows.push(row(
            "accelerometer bias, m/s^2",
            &c.force_bias,
            [0, 1, 2],
            1.0,
        ));
        matrix("accelerometer", &c.force, &mut rows);
        rows.push(row(
            "accelerometer time offset, ms",
            &c.force_time,
            [0],
            1e3,
        ));
        if let Some(m) = &c.magnetometer {
            rows.push(row("hard iron, uT", &m.hard_iron, [0, 1, 2], 1.0));
            matrix("magnetometer", &m.matrix, &mut rows);
            rows.push(row("magnetometer time offset, ms", &m.time, [0], 1e3));
        }
        rows
    }

    /// Heads of the columns of [`Smoothing::learned`]: numbers, one sigma of each, one sigma beforehand, and whether
    /// the recording showed them.
    pub const HEAD: [&str; 9] = [
        "",
        "x",
        "y",
        "z",
        "+- x",
        "+- y",
        "+- z",
        "known to +-",
        "observed",
    ];

    /// Findings, each with the flag that helps; `noise` is the class the sensor was taken for.
    #[must_use]
    pub fn doubts(&self, noise: &str) -> Vec<Finding> {
        let mut found = Vec::new();
        if self.outcome != Outcome::Converged {
            let did = self.lines().into_iter().next();
            found.extend(did.map(|did| {
                Finding::new(Severity::Warning, "smoothing", format!("{SMOOTH}: {did}"))
            }));
        }
        if self.is_beyond_class {
            found.push(
                Finding::new(
                    Severity::Warning,
                    "beyond-class",
                    format!(
                        "the sensor is farther off than those of class {noise} are: smoothed again as one that nobody calibrated"
                    ),
                )
                .with("noise", noise)
                .advise("a class says so beforehand")
                .help([NOISE.to("uncalibrated")]),
            );
        }
        found
    }

    /// JSON for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        fn numbers<const N: usize>(learned: &Estimated<N>) -> Value {
            let observed: Vec<bool> = (0..N).map(|i| learned.is_observed(i)).collect();
            json!({
                "value": learned.value.as_slice(), "sigma": learned.sigma.as_slice(),
                "prior": learned.prior.as_slice(), "observed": observed,
            })
        }
        let outcome = match &self.outcome {
            Outcome::Unsettled(_) => "unsettled",
            _ => "converged",
        };
        let held = self.held.map(|held| {
            json!({
                "axis": held.axis.as_slice(), "rate_deg_s": held.rate.to_degrees(),
                "sigma_deg_s": held.sigma.to_degrees(), "by_rest": held.is_by_rest,
            })
        });
        let c = &self.calibration;
        let [force, field] = self.spreads();
        json!({
            "outcome": outcome,
            "held_bias": held,
            "segments": self.counts.segments,
            "standstills": self.counts.standstills,
            "rejected": self.counts.rejected,
            "bridged": self.counts.bridged,
            "spooled_bytes": self.spooled_bytes,
            "sections": self.sections,
            "iterations": self.counts.iterations,
            "has_north": self.has_north,
            "velocity_bound_m_s": self.bound[0],
            "position_bound_m": self.bound[1],
            "gyro_bias_deg_s": {
                "value": self.bias.0, "sigma": self.bias.1, "wander": self.wander,
                "last": self.last_bias.0, "last_sigma": self.last_bias.1,
            },
            "G": numbers(&c.gyro),
            "gyro_sensitivity": numbers(&c.gyro_sensitivity),
            "ba": numbers(&c.force_bias),
            "A": numbers(&c.force),
            "lead": numbers(&c.force_time),
            "h": c.magnetometer.as_ref().map(|m| numbers(&m.hard_iron)),
            "S": c.magnetometer.as_ref().map(|m| numbers(&m.matrix)),
            "mag_lead": c.magnetometer.as_ref().map(|m| numbers(&m.time)),
            "force_at_rest_m_s2": force.map(|spread| spread.json()),
            "field_ut": field.map(|spread| spread.json()),
        })
    }
}

/// Some numbers of what was learned, and what was known of them, times `factor`.
fn row<const N: usize, const M: usize>(
    name: &str,
    learned: &Estimated<N>,
    of: [usize; M],
    factor: f64,
) -> Vec<String> {
    let cells = |numbers: &[f64; N]| {
        let mut cells = [const { String::new() }; 3];
        for (cell, i) in cells.iter_mut().zip(of) {
            *cell = numbers
                .get(i)
                .map_or_else(String::new, |v| significant(v * factor, 3));
        }
        cells
    };
    let known = of.iter().filter_map(|i| learned.prior.get(*i)).copied();
    let observed = of.iter().filter(|i| learned.is_observed(**i)).count();
    let mut row = vec![name.to_owned()];
    row.extend(cells(&learned.value));
    row.extend(cells(&learned.sigma));
    row.push(significant(known.fold(0.0, f64::max) * factor, 2));
    row.push(match observed {
        0 => "no".to_owned(),
        n if n == M => "yes".to_owned(),
        n => format!("{n} of {M}"),
    });
    row
}

/// A matrix: its diagonal, and the turns of axes above and below it.
fn matrix(name: &str, learned: &Estimated<9>, rows: &mut Vec<Vec<String>>) {
    let degrees = 1f64.to_degrees();
    rows.push(row(&format!("{name} scale, %"), learned, [0, 4, 8], 100.0));
    rows.push(row(
        &format!("{name} misalignment xy, xz, yz, deg"),
        learned,
        [1, 2, 5],
        degrees,
    ));
    rows.push(row(
        &format!("{name} misalignment yx, zx, zy, deg"),
        learned,
        [3, 6, 7],
        degrees,
    ));
}

fn part<const N: usize>(name: &str, learned: Option<&Estimated<N>>) -> Option<String> {
    let learned = learned?;
    match (0..N).filter(|i| !learned.is_observed(*i)).count() {
        0 => None,
        n if n == N => Some(name.to_owned()),
        n => Some(format!("{name} ({n} of {N})")),
    }
}

/// The diagonal of a matrix, %, and its sigma.
fn scales(learned: &Estimated<9>) -> ([f64; 3], [f64; 3]) {
    let of = |numbers: &[f64; 9]| [0, 4, 8].map(|i| numbers.get(i).map_or(0.0, |v| v * 100.0));
    (of(&learned.value), of(&learned.sigma))
}

fn triple(v: &[f64; 3]) -> String {
    format!(
        "({}, {}, {})",
        significant(v[0], 2),
        significant(v[1], 2),
        significant(v[2], 2)
    )
}
