//! True rate, delta angle and specific force -> what the sensor reads. Pure, seeded.

use super::constants::ConstantErrors;
use super::drift::Drift;
use super::low_pass::{Course, LowPass};
use super::normal::{Purpose, Stream, vector};
use super::{ImuError, ImuErrorFault};
use crate::record::{Nanos, SampleKind};
use nalgebra::Vector3;
use std::fmt;

/// The exact motion over one sampling interval. Sensor axes, SI.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Truth {
    /// Rate at the end of the interval, rad/s.
    pub rate: Vector3<f64>,
    /// Integral of the rate over the interval, rad.
    pub delta_angle: Vector3<f64>,
    /// Specific force at the end of the interval, m/s^2.
    pub specific_force: Vector3<f64>,
    /// The same as the accelerometer takes it, at the instant or as a mean, m/s^2.
    pub sampled_force: Vector3<f64>,
    /// Kelvin away from the temperature of calibration.
    pub temperature: f64,
}

impl Default for Truth {
    /// Rest, in free fall, at the temperature of calibration.
    fn default() -> Truth {
        Truth {
            rate: Vector3::zeros(),
            delta_angle: Vector3::zeros(),
            specific_force: Vector3::zeros(),
            sampled_force: Vector3::zeros(),
            temperature: 0.0,
        }
    }
}

/// One reading.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Measured {
    /// rad/s for rates and averages, rad for delta angles.
    pub gyro: Vector3<f64>,
    /// Specific force, m/s^2.
    pub specific_force: Vector3<f64>,
    /// A component of the rate was clipped at the range.
    pub saturated: bool,
    /// A component of the specific force was.
    pub force_saturated: bool,
}

/// A reading that cannot be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MeasureError {
    /// The interval is empty or runs backwards.
    Interval {
        /// Beginning.
        from: Nanos,
        /// End.
        to: Nanos,
    },
    /// The interval begins before the end of the one before.
    Overlap {
        /// Beginning.
        from: Nanos,
        /// End of the one before.
        last: Nanos,
    },
    /// The truth is not finite, or beyond 1e9 in SI units.
    Truth {
        /// The end of the interval.
        to: Nanos,
    },
}

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Interval { from, to } => write!(
                f,
                "a sampling interval from {} to {} ns: it must have a length",
                from.0, to.0
            ),
            Self::Overlap { from, last } => write!(
                f,
                "a sampling interval that begins at {} ns, before the last one ended ({} ns)",
                from.0, last.0
            ),
            Self::Truth { to } => write!(
                f,
                "the motion at {} ns is not a number below {FASTEST:e}",
                to.0
            ),
        }
    }
}

impl std::error::Error for MeasureError {}

/// Beyond any motion; what is below does not overflow on its way through.
const FASTEST: f64 = 1e9;

/// A running sensor. Constant memory; about 0.2 us (2300 instructions) a reading with
/// a preset's noise.
#[derive(Clone, Debug)]
pub struct GyroModel {
    error: ImuError,
    constants: ConstantErrors,
    kind: SampleKind,
    seed: u64,
    white: [Stream; 3],
    acceleration: [Stream; 3],
    /// State from the first reading on.
    running: Option<Running>,
}

#[derive(Clone, Debug)]
struct Running {
    last: Nanos,
    rate: Vector3<f64>,
    force: Vector3<f64>,
    low_pass: Option<LowPass>,
    drift: Drift,
    bias: Vector3<f64>,
    /// Angle that quantisation has not put out yet, rad.
    remainder: Vector3<f64>,
}

impl GyroModel {
    /// A sensor whose constant errors are drawn from `seed`, as all its noise is.
    ///
    /// # Errors
    /// What [`ImuError::check`] refuses.
    pub fn new(error: &ImuError, kind: SampleKind, seed: u64) -> Result<GyroModel, ImuErrorFault> {
        GyroModel::with_constants(error, ConstantErrors::draw(error, seed), kind, seed)
    }

    /// A sensor whose constant errors are given; their sizes in `error` are not used.
    ///
    /// # Errors
    /// What [`ImuError::check`] refuses, or a constant that is not finite.
    pub fn with_constants(
        error: &ImuError,
        constants: ConstantErrors,
        kind: SampleKind,
        seed: u64,
    ) -> Result<GyroModel, ImuErrorFault> {
        error.check()?;
        if !constants.is_finite() {
            return Err(ImuErrorFault(
                "a constant error is not a finite number".into(),
            ));
        }
        Ok(GyroModel {
            error: *error,
            constants,
            kind,
            seed,
            white: Stream::axes(seed, Purpose::White),
            acceleration: Stream::axes(seed, Purpose::Acceleration),
            running: None,
        })
    }

    /// Constant errors drawn for this unit.
    #[must_use]
    pub fn constants(&self) -> &ConstantErrors {
        &self.constants
    }

    /// Reads over `from..to`, the interval since the last sampling instant. Time that is left
    /// out between two intervals passes for the drift, but is not integrated.
    ///
    /// # Errors
    /// An interval without length or before the last one's end, or a truth that cannot be.
    // Inlined whole into a caller's loops at link time, LLVM 22 spends minutes in constraint elimination.
    #[inline(never)]
    pub fn measure(
        &mut self,
        from: Nanos,
        to: Nanos,
        truth: &Truth,
    ) -> Result<Measured, MeasureError> {
        let nanos = i128::from(to.0) - i128::from(from.0);
        if nanos <= 0 {
            return Err(MeasureError::Interval { from, to });
        }
        if !is_possible(truth) {
            return Err(MeasureError::Truth { to });
        }
        let secs = nanos as f64 * 1e-9;
        let mean = truth.delta_angle / secs;
        let (error, constants) = (&self.error, &self.constants);
        let running = match &mut self.running {
            Some(running) if from < running.last => {
                return Err(MeasureError::Overlap {
                    from,
                    last: running.last,
                });
            }
            Some(running) => running,
            None => {
                let drift = Drift::new(error, secs, self.seed);
                self.running.insert(Running {
                    last: from,
                    // A straight line with the interval's mean.
                    rate: 2.0 * mean - truth.rate,
                    force: truth.specific_force,
                    low_pass: None,
                    bias: drift.value(),
                    drift,
                    remainder: Vector3::zeros(),
                })
            }
        };

        let mut course = Course {
            start: running.rate,
            end: truth.rate,
            mean,
        };
        if from > running.last {
            course.start = 2.0 * mean - truth.rate;
            running.low_pass = None;
            running.drift.advance(from.secs_since(running.last));
            running.bias = running.drift.value();
        }
        if let Some(hz) = error.bandwidth_hz {
            let filter = running
                .low_pass
                .get_or_insert_with(|| LowPass::new(hz, error.damping, &course, secs));
            course = filter.pass(&course, secs);
        }
        running.drift.advance(secs);
        let bias = running.drift.value();

        let (mut rate, force, drift) = if self.kind == SampleKind::Rate {
            let linear = constants.sensitivity * course.end;
            (
                linear + bent(constants, &linear),
                truth.specific_force,
                bias,
            )
        } else {
            let [start, middle, end] = [course.start, course.middle(), course.end]
                .map(|w| bent(constants, &(constants.sensitivity * w)));
            (
                constants.sensitivity * course.mean + (start + 4.0 * middle + end) / 6.0,
                0.5 * (running.force + truth.specific_force),
                0.5 * (running.bias + bias),
            )
        };
        rate += constants.g_sensitivity * force
            + constants.bias
            + constants.temperature_coefficient * truth.temperature
            + drift;
        if error.arw > 0.0 {
            rate += error.arw / secs.sqrt() * vector(&mut self.white);
        }
        let mut saturated = false;
        if let Some(range) = error.range {
            saturated = rate.amax() > range;
            rate.apply(|v| *v = v.clamp(-range, range));
        }
        let gyro = quantised(error, self.kind, &mut running.remainder, rate, secs);
        let (specific_force, force_saturated) =
            accelerometer(error, constants, &mut self.acceleration, truth, secs);
        running.last = to;
        running.rate = truth.rate;
        running.force = truth.specific_force;
        running.bias = bias;
        Ok(Measured {
            gyro,
            specific_force,
            saturated,
            force_saturated,
        })
    }
}

/// Whether no number of the truth is beyond what any body does.
fn is_possible(truth: &Truth) -> bool {
    let rates = truth.rate.iter().chain(truth.delta_angle.iter());
    let forces = truth
        .specific_force
        .iter()
        .chain(truth.sampled_force.iter());
    let mut all = rates.chain(forces).chain([&truth.temperature]);
    all.all(|v| v.abs() <= FASTEST)
}

/// Specific force that is read over `secs`, m/s^2, and whether it was beyond the range.
fn accelerometer(
    error: &ImuError,
    constants: &ConstantErrors,
    noise: &mut [Stream; 3],
    truth: &Truth,
    secs: f64,
) -> (Vector3<f64>, bool) {
    let mut force = constants.accel_sensitivity * truth.sampled_force + constants.accel_bias;
    if error.accel_noise > 0.0 {
        force += error.accel_noise / secs.sqrt() * vector(noise);
    }
    let mut saturated = false;
    if let Some(range) = error.accel_range {
        saturated = force.amax() > range;
        force.apply(|v| *v = v.clamp(-range, range));
    }
    if error.accel_lsb > 0.0 {
        force.apply(|v| *v = (*v / error.accel_lsb).round() * error.accel_lsb);
    }
    (force, saturated)
}

/// Contribution of the non-linear terms.
fn bent(constants: &ConstantErrors, rate: &Vector3<f64>) -> Vector3<f64> {
    constants
        .nonlinear2
        .component_mul(&rate.component_mul(&rate.abs()))
        + constants
            .nonlinear3
            .component_mul(&rate.component_mul(rate).component_mul(rate))
}

/// Rate in whole steps, in the unit of the sample kind.
fn quantised(
    error: &ImuError,
    kind: SampleKind,
    remainder: &mut Vector3<f64>,
    rate: Vector3<f64>,
    secs: f64,
) -> Vector3<f64> {
    let increments = matches!(kind, SampleKind::DeltaAngle | SampleKind::Rotation);
    if error.truncation > 0.0 {
        let cut = |v: f64| (v / error.truncation).trunc() * error.truncation;
        return if increments { rate * secs } else { rate }.map(cut);
    }
    let angle_step = match error.quantization {
        q if q > 0.0 => q * 12f64.sqrt(),
        _ if increments => error.lsb,
        _ => 0.0,
    };
    if angle_step > 0.0 {
        let owed = rate * secs + *remainder;
        let steps = owed.map(|v| (v / angle_step).round() * angle_step);
        *remainder = owed - steps;
        return if increments { steps } else { steps / secs };
    }
    if increments {
        return rate * secs;
    }
    if error.lsb > 0.0 {
        return rate.map(|v| (v / error.lsb).round() * error.lsb);
    }
    rate
}
