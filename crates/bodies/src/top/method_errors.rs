//! A top, a rate and methods -> how far each is from the exact motion, and where it went. Pure.
//!
//! Behind `strapd model top` and the interactive top of `strapd serve`: both say the same numbers
//! because they are made here.

use crate::rigid_body::Spin;
use crate::top::{Case, EulerState, SymmetricTop, TopMethod, TopRun, compare};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::settings::{row, with};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::propagate::{Method, Noise, Propagator, Sequential, Settings};
use strapd_attitude::quaternion::kernel as quat;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{Join, Measured, Nanos, RateSample, SampleKind, Status};
use strapd_attitude::setting::METHOD;

/// A way to find the attitude of the top.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum How {
    /// One of the model's own.
    Top(TopMethod),
    /// The propagator, on exact samples of the rate.
    Samples(Method),
}

impl How {
    /// The name at the command line.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            How::Top(method) => method.name().to_owned(),
            How::Samples(method) => method.name().to_owned(),
        }
    }

    /// The seven of the table, and what replay does.
    #[must_use]
    pub fn defaults() -> Vec<How> {
        TopMethod::ALL
            .into_iter()
            .map(How::Top)
            .chain([How::Samples(Method::Auto)])
            .collect()
    }

    /// Finds methods by their names.
    ///
    /// # Errors
    /// An unknown one; says which there are.
    pub fn parse_all(names: &[String]) -> Result<Vec<How>, Diagnostic> {
        names
            .iter()
            .map(|name| {
                TopMethod::from_name(name)
                    .map(How::Top)
                    .or_else(|| of_samples().find(|m| m.name() == name).map(How::Samples))
                    .ok_or_else(|| {
                        let own = TopMethod::ALL.iter().map(|m| m.name());
                        let all: Vec<&str> = own.chain(of_samples().map(Method::name)).collect();
                        Diagnostic::new(format!("unknown method `{}`", name.escape_debug()))
                            .help(format!("one of {}", all.join(", ")))
                    })
            })
            .collect()
    }
}

/// Methods of the setting that go by their own names.
fn of_samples() -> impl Iterator<Item = Method> {
    let words = row(METHOD.name()).into_iter().flat_map(|row| row.words);
    let methods = words.map(|word| (word.name, with(METHOD, word.name)));
    methods.filter_map(|(name, plan)| Some(plan.ok()?.method).filter(|m| m.name() == name))
}

/// Largest angles between a method's attitude and the truth, rad.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Worst {
    /// Angle between the axes of symmetry.
    pub axis: f64,
    /// Angle of the whole rotation.
    pub attitude: f64,
}

/// Errors found over a course.
#[derive(Clone, Debug)]
pub struct MethodErrors {
    /// Worst error of each method, in the order asked for.
    pub errors: Vec<(How, Worst)>,
    /// Largest change of the exact motion's energy, as a part of it.
    pub energy_drift: f64,
    /// Least and greatest angle of the axis from the vertical, rad.
    pub nutation: [f64; 2],
}

/// A top, its start, and how long and how often it is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Top.
    pub top: SymmetricTop,
    /// Start of the top.
    pub start: EulerState,
    /// Samples a second.
    pub rate_hz: f64,
    /// Length, s.
    pub secs: f64,
}

/// Most samples of one course: about ten seconds' work.
const MOST_SAMPLES: f64 = 1e6;

impl Course {
    /// Checked.
    ///
    /// # Errors
    /// Numbers that cannot be, with the bounds.
    pub fn new(
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
    ///
    /// # Errors
    /// The first method's that refuses, by name.
    pub fn errors(&self, methods: &[How]) -> Result<MethodErrors, String> {
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
    ///
    /// # Errors
    /// Numbers out of all proportion.
    pub fn truth(&self) -> Result<Vec<(Nanos, Spin)>, String> {
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

/// Paths over a course, at few enough instants to be drawn.
#[derive(Clone, Debug)]
pub struct Paths {
    /// Seconds since the start, rising.
    pub times: Vec<f64>,
    /// The exact motion then.
    pub truth: Vec<Spin>,
    /// Path of each method, in the order asked for.
    pub methods: Vec<MethodPath>,
}

/// Path that one method gives.
#[derive(Clone, Debug)]
pub struct MethodPath {
    /// Method.
    pub how: How,
    /// Attitudes at the instants of [`Paths::times`].
    pub attitudes: Vec<Quaternion<Nav, Body>>,
    /// Largest angle from the truth since the instant before, rad: no peak is lost.
    pub errors: Vec<f64>,
}

impl Course {
    /// The exact motion and each method's at no more than `most` instants, the first and the last
    /// among them.
    ///
    /// # Errors
    /// As [`Course::errors`].
    pub fn paths(&self, methods: &[How], most: usize) -> Result<Paths, String> {
        let truth = self.truth()?;
        let last = truth.len() - 1;
        let stride = last.div_ceil(most.max(2) - 1).max(1);
        let is_kept = |k: usize| k.is_multiple_of(stride) || k == last;
        let mut paths = Paths {
            times: Vec::new(),
            truth: Vec::new(),
            methods: Vec::with_capacity(methods.len()),
        };
        for (k, (stamp, spin)) in truth.iter().enumerate() {
            if is_kept(k) {
                paths.times.push(stamp.0 as f64 * 1e-9);
                paths.truth.push(*spin);
            }
        }
        for how in methods {
            let found = match how {
                How::Top(method) => {
                    let fail = |e| format!("{}: {e}", method.name());
                    let mut run =
                        TopRun::new(*method, &self.top, &self.start, self.rate_hz).map_err(fail)?;
                    std::iter::once(Ok(self.start.spin().q_nb))
                        .chain((0..last).map(|_| run.advance()))
                        .collect::<Result<_, _>>()
                        .map_err(fail)?
                }
                How::Samples(method) => attitudes(*method, &truth)?,
            };
            let mut path = MethodPath {
                how: *how,
                attitudes: Vec::with_capacity(paths.times.len()),
                errors: Vec::with_capacity(paths.times.len()),
            };
            let mut worst = 0.0_f64;
            for (k, ((_, spin), q)) in truth.iter().zip(&found).enumerate() {
                worst = worst.max(quat::angle_between(&spin.q_nb.wxyz(), &q.wxyz()));
                if is_kept(k) {
                    path.attitudes.push(*q);
                    path.errors.push(std::mem::take(&mut worst));
                }
            }
            paths.methods.push(path);
        }
        Ok(paths)
    }
}

/// The propagator on exact samples; the first and last `margin` left out, the first attitude taken
/// as given.
///
/// # Errors
/// A method that is none for rates.
pub fn propagated(method: Method, truth: &[(Nanos, Spin)], margin: usize) -> Result<Worst, String> {
    let found = attitudes(method, truth)?;
    // What was turned since the first sample looked at: the ends of a run have no centred window.
    let n = truth.len().min(found.len()).saturating_sub(2 * margin);
    let pairs = || {
        let truths = truth.iter().map(|(_, spin)| spin.q_nb);
        truths.zip(found.iter().copied()).skip(margin).take(n)
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

/// The propagator's attitudes from exact samples of the rate, started at the truth.
///
/// # Errors
/// In words: a method that is none for rates.
pub fn attitudes(
    method: Method,
    truth: &[(Nanos, Spin)],
) -> Result<Vec<Quaternion<Nav, Body>>, String> {
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
            gyro: Measured::Rate(BodyRate(spin.w_nb_b)),
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
    Ok(found.into_iter().map(|a| a.q_nb).collect())
}

/// A case by its name.
///
/// # Errors
/// An unknown one; says which there are.
pub fn case(name: &str) -> std::result::Result<Case, String> {
    Case::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = Case::ALL.iter().map(|c| c.name()).collect();
        format!(
            "unknown case `{}`: one of {}",
            name.escape_debug(),
            names.join(", ")
        )
    })
}

/// A top some arrangement of matter can be.
///
/// # Errors
/// What cannot be, with its numbers.
pub fn body(
    mass: f64,
    arm: f64,
    [across, along]: [f64; 2],
    gravity: f64,
) -> std::result::Result<SymmetricTop, String> {
    if along > 2.0 * across {
        return Err(format!(
            "inertia {across} across, {along} along the axis: the latter exceeds the sum of the two across it ({}), which no matter can",
            2.0 * across
        ));
    }
    SymmetricTop::new(mass, arm, across, along, gravity).map_err(|e| e.to_string())
}
