//! What a smoother learned of a recording -> words, rows, JSON. Pure.

use super::summary::significant;
use serde_json::{Value, json};
use strapd_attitude::smooth::{Calibration, Counts, Failure, Learned, Outcome, Smoothed};

/// A recording that was smoothed, or was to be.
#[derive(Clone, Debug)]
pub struct Smoothing {
    found: Result<Found, String>,
}

#[derive(Clone, Debug)]
struct Found {
    outcome: Outcome,
    counts: Counts,
    calibration: Calibration,
    /// Of the gyro, in the middle of the recording: bias and one sigma, deg/s.
    bias: ([f64; 3], [f64; 3]),
    /// By how much it wanders over the recording, deg/s.
    wander: f64,
    sections: usize,
    has_north: bool,
    bound: [f64; 2],
}

impl Smoothing {
    /// As it is at the end of a run; in words where there is no result.
    #[must_use]
    pub fn of(smoothed: Result<&Smoothed, &str>) -> Smoothing {
        let found = smoothed.map_err(str::to_owned).map(|smoothed| {
            let biases: Vec<_> = smoothed.biases().collect();
            let middle = biases.get(biases.len() / 2);
            let deg = |v: &nalgebra::Vector3<f64>| v.map(f64::to_degrees).into();
            let span = |axis: usize| {
                let of = biases.iter().filter_map(|b| b.value.get(axis).copied());
                let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), b| {
                    (low.min(b), high.max(b))
                });
                high - low
            };
            let wander = (0..3).map(span).fold(0.0, f64::max);
            Found {
                outcome: smoothed.outcome(),
                counts: *smoothed.counts(),
                calibration: *smoothed.calibration(),
                bias: middle.map_or(([0.0; 3], [0.0; 3]), |b| (deg(&b.value), deg(&b.sigma))),
                wander: wander.to_degrees(),
                sections: smoothed.sections().len(),
                has_north: smoothed.sections().iter().any(|section| section.has_north),
                bound: smoothed.bound(),
            }
        });
        Smoothing { found }
    }

    /// For people: what was done, then what was learned.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let found = match &self.found {
            Ok(found) => found,
            Err(why) => {
                return vec![format!(
                    "NOT SMOOTHED: {}; the attitude is the real-time filter's",
                    why.replace("\n  help: ", "; ")
                )];
            }
        };
        let counts = &found.counts;
        let mut did = match found.outcome {
            Outcome::Filter(why) => {
                format!(
                    "NOT CONVERGED ({}): the attitude is the real-time filter's",
                    words(&why)
                )
            }
            Outcome::WithoutField(why) => format!(
                "gravity, north by the mean field: with all of the field it did not converge ({})",
                words(&why)
            ),
            Outcome::Converged | Outcome::Unsettled(_) if found.has_north => {
                "gravity and field, the whole recording at once".to_owned()
            }
            Outcome::Converged | Outcome::Unsettled(_) => {
                "gravity, the whole recording at once; heading of the first sample".to_owned()
            }
        };
        did += &format!(
            ": at rest in {} of {} segments",
            counts.standstills, counts.segments
        );
        if let Outcome::Unsettled(left) = found.outcome {
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
        let gyro = &found.calibration.gyro;
        let scale = [0, 4, 8].map(|i| gyro.value.get(i).map_or(0.0, |g| g * 100.0));
        let sigma = [0, 4, 8].map(|i| gyro.sigma.get(i).map_or(0.0, |g| g * 100.0));
        let (bias, of_bias) = &found.bias;
        let mut lines = vec![
            did,
            format!(
                "learned: bias {} +- {} deg/s, wandering {}; scale {} +- {} %; not observed: {}",
                triple(bias),
                triple(of_bias),
                significant(found.wander, 2),
                triple(&scale),
                triple(&sigma),
                self.unobserved(),
            ),
        ];
        if let Some(magnetometer) = &found.calibration.magnetometer {
            lines.push(format!(
                "hard iron {} +- {} uT, of a field taken for {} uT north and {} up",
                triple(&magnetometer.hard_iron.value),
                triple(&magnetometer.hard_iron.sigma),
                significant(magnetometer.north_up.value[0], 3),
                significant(magnetometer.north_up.value[1], 3),
            ));
        }
        lines
    }

    /// What the recording told nothing of.
    fn unobserved(&self) -> String {
        let Ok(found) = &self.found else {
            return String::new();
        };
        let c = &found.calibration;
        let m = c.magnetometer.as_ref();
        let all = [
            part("gyro scale and axes", Some(&c.gyro)),
            part("accelerometer bias", Some(&c.force_bias)),
            part("accelerometer scale and axes", Some(&c.force)),
            part("accelerometer lead", Some(&c.force_time)),
            part("hard iron", m.map(|m| &m.hard_iron)),
            part("soft iron", m.map(|m| &m.matrix)),
            part("magnetometer lead", m.map(|m| &m.time)),
        ];
        let said: Vec<String> = all.into_iter().flatten().collect();
        if said.is_empty() {
            "nothing".to_owned()
        } else {
            said.join(", ")
        }
    }

    /// What the sigma of the attitude is of.
    #[must_use]
    pub fn sigma_text(&self) -> &'static str {
        match &self.found {
            Ok(found) if found.has_north => "of tilt and of heading from north, by the smoother",
            _ => "of tilt and of heading relative to the start, by the smoother",
        }
    }

    /// What was learned, a row each: what and in which unit, about x, y, z, and one sigma of each.
    #[must_use]
    pub fn learned(&self) -> Option<Vec<Vec<String>>> {
        let found = self.found.as_ref().ok()?;
        let row = |name: &str, value: [f64; 3], sigma: [f64; 3]| {
            let numbers = value.into_iter().chain(sigma);
            let said = numbers.map(|v| significant(v, 3));
            std::iter::once(name.to_owned()).chain(said).collect()
        };
        let diagonal = |learned: &Learned<9>| {
            (
                [0, 4, 8].map(|i| learned.value.get(i).map_or(0.0, |v| v * 100.0)),
                [0, 4, 8].map(|i| learned.sigma.get(i).map_or(0.0, |v| v * 100.0)),
            )
        };
        let c = &found.calibration;
        let (gyro, of_gyro) = diagonal(&c.gyro);
        let (force, of_force) = diagonal(&c.force);
        let mut rows = vec![
            row("gyro bias in the middle, deg/s", found.bias.0, found.bias.1),
            row("gyro scale, %", gyro, of_gyro),
            row(
                "accelerometer bias, m/s^2",
                c.force_bias.value,
                c.force_bias.sigma,
            ),
            row("accelerometer scale, %", force, of_force),
        ];
        if let Some(m) = &c.magnetometer {
            let (soft, of_soft) = diagonal(&m.matrix);
            rows.push(row("hard iron, uT", m.hard_iron.value, m.hard_iron.sigma));
            rows.push(row("soft iron, %", soft, of_soft));
        }
        Some(rows)
    }

    /// What is to be said aloud: that there is no result, or another than was asked for.
    #[must_use]
    pub fn doubt(&self) -> Option<String> {
        let is_well = self
            .found
            .as_ref()
            .is_ok_and(|found| found.outcome == Outcome::Converged);
        (!is_well).then(|| {
            let said = self.lines().into_iter().next().unwrap_or_default();
            format!("--smooth: {said}")
        })
    }

    /// For machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let found = match &self.found {
            Ok(found) => found,
            Err(why) => return json!({ "outcome": "failed", "why": why }),
        };
        fn numbers<const N: usize>(learned: &Learned<N>) -> Value {
            let observed: Vec<bool> = (0..N).map(|i| learned.is_observed(i)).collect();
            json!({
                "value": learned.value.as_slice(), "sigma": learned.sigma.as_slice(),
                "prior": learned.prior.as_slice(), "observed": observed,
            })
        }
        let (outcome, why) = match &found.outcome {
            Outcome::Converged => ("converged", None),
            Outcome::Unsettled(_) => ("unsettled", None),
            Outcome::WithoutField(why) => ("without_field", Some(words(why))),
            Outcome::Filter(why) => ("filter", Some(words(why))),
        };
        let c = &found.calibration;
        json!({
            "outcome": outcome,
            "why": why,
            "segments": found.counts.segments,
            "standstills": found.counts.standstills,
            "rejected": found.counts.rejected,
            "bridged": found.counts.bridged,
            "sections": found.sections,
            "iterations": found.counts.iterations,
            "has_north": found.has_north,
            "velocity_bound_m_s": found.bound[0],
            "position_bound_m": found.bound[1],
            "gyro_bias_deg_s": { "value": found.bias.0, "sigma": found.bias.1, "wander": found.wander },
            "G": numbers(&c.gyro),
            "ba": numbers(&c.force_bias),
            "A": numbers(&c.force),
            "lead": numbers(&c.force_time),
            "h": c.magnetometer.as_ref().map(|m| numbers(&m.hard_iron)),
            "S": c.magnetometer.as_ref().map(|m| numbers(&m.matrix)),
            "mag_lead": c.magnetometer.as_ref().map(|m| numbers(&m.time)),
        })
    }
}

fn part<const N: usize>(name: &str, learned: Option<&Learned<N>>) -> Option<String> {
    let learned = learned?;
    match (0..N).filter(|i| !learned.is_observed(*i)).count() {
        0 => None,
        n if n == N => Some(name.to_owned()),
        n => Some(format!("{name} ({n} of {N})")),
    }
}

fn words(why: &Failure) -> String {
    let deg = |rad: &f64| significant(rad.to_degrees(), 2);
    match why {
        Failure::NotFinite => "the equations had no solution".to_owned(),
        Failure::Diverging(turn) => format!("it diverged, by {} deg in the end", deg(turn)),
        Failure::Unfinished(turn) => format!("it still turned by {} deg at the end", deg(turn)),
        Failure::Strays(far) => {
            format!("the motion went {} m without a rest", significant(*far, 2))
        }
        Failure::NotUpright(off) => format!("the mean force was {} deg off the vertical", deg(off)),
    }
}

fn triple(v: &[f64; 3]) -> String {
    format!(
        "({}, {}, {})",
        significant(v[0], 2),
        significant(v[1], 2),
        significant(v[2], 2)
    )
}
