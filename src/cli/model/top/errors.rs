//! A top, a rate and methods -> the largest error of each. Pure.

use crate::model::attitude::Quaternion;
use crate::model::rigid_body::{HeldRate, Spin};
use crate::model::top::{EulerState, SymmetricTop, TopMethod, compare};
use crate::propagate::{Method, Noise, Propagator, Sequential, Settings};
use crate::record::{Join, Nanos, RateSample, SampleKind, Status};

/// A way to find the attitude of the top.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum How {
    /// One of the model's own.
    Top(TopMethod),
    /// The propagator, on exact samples of the rate.
    Samples(Method),
}

impl How {
    pub(super) fn name(&self) -> String {
        match self {
            How::Top(method) => method.name().to_owned(),
            How::Samples(method) => method.name().to_owned(),
        }
    }

    /// The seven of the table, and what replay does.
    pub(super) fn defaults() -> Vec<How> {
        TopMethod::ALL
            .into_iter()
            .map(How::Top)
            .chain([How::Samples(Method::Auto)])
            .collect()
    }

    /// By name.
    pub(super) fn parse_all(names: &[String]) -> Result<Vec<How>, String> {
        names
            .iter()
            .map(|name| {
                TopMethod::from_name(name)
                    .map(How::Top)
                    .or_else(|| name.parse().ok().map(How::Samples))
                    .ok_or_else(|| {
                        let own = TopMethod::ALL.iter().map(|m| m.name());
                        let all: Vec<&str> = own.chain(Method::names()).collect();
                        format!(
                            "unknown method `{}`\n  help: one of {}",
                            name.escape_debug(),
                            all.join(", ")
                        )
                    })
            })
            .collect()
    }
}

/// Largest angles between a method's attitude and the truth, rad.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Worst {
    /// Between the axes of symmetry.
    pub(super) axis: f64,
    /// Of the whole rotation.
    pub(super) attitude: f64,
}

/// What was found over a course.
#[derive(Clone, Debug)]
pub(super) struct MethodErrors {
    pub(super) errors: Vec<(How, Worst)>,
    /// Largest change of the exact motion's energy, as a part of it.
    pub(super) energy_drift: f64,
    /// Least and greatest angle of the axis from the vertical, rad.
    pub(super) nutation: [f64; 2],
}

/// A top, its start, and how long and how often it is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    pub(super) top: SymmetricTop,
    pub(super) start: EulerState,
    pub(super) rate_hz: f64,
    pub(super) secs: f64,
}

/// Most samples of one course: about ten seconds' work.
const MOST_SAMPLES: f64 = 1e6;

impl Course {
    /// Checked.
    pub(super) fn new(
        top: SymmetricTop,
        start: EulerState,
        rate_hz: f64,
        secs: f64,
    ) -> Result<Self, String> {
        if !(rate_hz > 0.0 && rate_hz <= 1e6) {
            return Err(format!(
                "rate_hz {rate_hz}: above 0, at most 1e6, is needed"
            ));
        }
        if !(secs > 0.0 && secs * rate_hz <= MOST_SAMPLES) {
            return Err(format!(
                "duration {secs} s: above 0 and at most {} s, 1e6 samples, is needed",
                MOST_SAMPLES / rate_hz
            ));
        }
        let needed_hz = start.spin().w_nb_b.norm() / std::f64::consts::PI;
        if needed_hz >= rate_hz {
            return Err(format!(
                "rate_hz {rate_hz}: the top turns half a turn or more from sample to sample; above {needed_hz:.1} Hz is needed"
            ));
        }
        Ok(Course {
            top,
            start,
            rate_hz,
            secs,
        })
    }

    /// Each method against the exact motion.
    pub(super) fn errors(&self, methods: &[How]) -> Result<MethodErrors, String> {
        let truth = self.truth()?;
        let mut errors = Vec::with_capacity(methods.len());
        for how in methods {
            let worst = match how {
                How::Top(method) => {
                    let steps = truth.len() as u64 - 1;
                    let rows = compare(&[*method], &self.top, &self.start, self.rate_hz, steps)
                        .map_err(|e| format!("{}: {e}", method.name()))?;
                    rows.first().map_or(Worst::default(), |row| Worst {
                        axis: row.axis_max,
                        attitude: row.attitude_max,
                    })
                }
                How::Samples(method) => propagated(*method, &truth, 0)?,
            };
            errors.push((*how, worst));
        }
        let energy = |spin: &Spin| self.top.exact(&self.start).map(|body| body.energy(spin));
        let first = energy(&truth[0].1).map_err(|e| e.to_string())?;
        let body = self.top.exact(&self.start).map_err(|e| e.to_string())?;
        let (mut drift, mut nutation) = (0.0_f64, [f64::INFINITY, 0.0_f64]);
        for (_, spin) in &truth {
            drift = drift.max((body.energy(spin) - first).abs());
            let [w, x, y, z] = spin.q_nb.wxyz();
            let angle = 2.0 * x.hypot(y).atan2(w.hypot(z));
            nutation = [nutation[0].min(angle), nutation[1].max(angle)];
        }
        let scale = first.abs().max(f64::MIN_POSITIVE);
        Ok(MethodErrors {
            errors,
            energy_drift: drift / scale,
            nutation,
        })
    }

    /// The exact motion at every sample.
    pub(super) fn truth(&self) -> Result<Vec<(Nanos, Spin)>, String> {
        let mut exact = self.top.exact(&self.start).map_err(|e| e.to_string())?;
        let steps = (self.secs * self.rate_hz * (1.0 + 4.0 * f64::EPSILON)).floor() as u64;
        Ok((0..=steps.max(1))
            .map(|k| {
                let nanos = (k as f64 * 1e9 / self.rate_hz).round() as u64;
                (Nanos(nanos as i64), exact.at_nanos(nanos))
            })
            .collect())
    }
}

/// The propagator on exact samples; the first and last `margin` left out, the first attitude taken
/// as given.
pub(super) fn propagated(
    method: Method,
    truth: &[(Nanos, Spin)],
    margin: usize,
) -> Result<Worst, String> {
    let mut propagator = Propagator::new(Settings {
        method,
        kind: SampleKind::Rate,
        initial: truth
            .first()
            .map_or(Quaternion::identity(), |(_, spin)| spin.q_nb),
        noise: Noise::default(),
        ..Settings::default()
    })
    .map_err(|e| e.to_string())?;
    let samples: Vec<RateSample> = truth
        .iter()
        .zip(0..)
        .map(|((stamp, spin), k)| RateSample {
            stamp: *stamp,
            start: *stamp,
            value: spin.w_nb_b,
            accel: None,
            join: if k == 0 {
                Join::Start
            } else {
                Join::Continuous
            },
            status: Status::OK,
            log: *stamp,
        })
        .collect();
    let mut found = Vec::with_capacity(samples.len());
    propagator.push(&samples, &Sequential, &mut found);
    propagator.finish(&Sequential, &mut found);
    // What was turned since the first sample looked at: the ends of a run have no centred window.
    let pairs = || {
        let n = truth.len().min(found.len()).saturating_sub(2 * margin);
        let truths = truth.iter().map(|(_, spin)| spin.q_nb);
        let estimates = found.iter().map(|a| a.q_nb);
        truths.zip(estimates).skip(margin).take(n)
    };
    let mut worst = Worst::default();
    let Some((q_true, q_found)) = pairs().next() else {
        return Ok(worst);
    };
    let from_found = q_true * q_found.inverse();
    for (q_true, q_found) in pairs() {
        let turned = q_true.inverse() * from_found * q_found;
        let [w, x, y, z] = turned.wxyz();
        let (tilt, twist) = (x.hypot(y), w.hypot(z));
        worst.axis = worst.axis.max(2.0 * tilt.atan2(twist));
        let full = 2.0 * (tilt * tilt + z * z).sqrt().atan2(w.abs());
        worst.attitude = worst.attitude.max(full);
    }
    Ok(worst)
}

/// A method for each rate that can be held.
type OfHeld = fn(HeldRate) -> TopMethod;

/// The columns of the table of methods, in its order.
pub(super) const HELD: [(&str, OfHeld); 2] = [("live", TopMethod::Live), ("gyro", TopMethod::Gyro)];
