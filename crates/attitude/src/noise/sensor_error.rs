//! Exact motion -> what a gyro and an accelerometer would have read. Pure; randomness only from a passed seed.
//!
//! A stage of its own because an estimator is judged with data whose errors are known: each term
//! below is put in with a stated size and found again by [`super::allan`].
//!
//! Order of application, each term on the result of those before it:
//!
//! ```text
//! true rate -> bandwidth -> scale and misalignment -> non-linearity -> g-sensitivity
//!           -> bias: turn-on, temperature -> drift: flicker, Gauss-Markov, random walk, ramp -> white
//!           -> saturation -> quantisation or truncation                      (stamps: StampError)
//! ```
//!
//! The accelerometer and the magnetometer have a shorter chain each:
//!
//! ```text
//! true force -> scale and misalignment -> bias -> white -> saturation -> quantisation
//! true field -> soft iron -> hard iron -> white -> quantisation
//! ```
//!
//! [`ImuError`] holds the sizes, `ConstantErrors` what one unit drew of them, `GyroModel` the
//! state of a running sensor, `StampModel` when it sampled and what its stamps say. The last two
//! need the feature `random`: ChaCha for the bits, `libm` for the functions, so
//! one seed gives the same samples on every platform.
//!
//! # Source
//! Terms and power spectral densities: IEEE Std 952-1997, annex C.

mod presets;
mod stamps;
mod terms;

#[cfg(feature = "random")]
mod constants;
#[cfg(feature = "random")]
mod drift;
#[cfg(feature = "random")]
mod gyro;
#[cfg(feature = "random")]
mod low_pass;
#[cfg(feature = "random")]
mod magnetometer;
#[cfg(feature = "random")]
mod normal;
#[cfg(feature = "random")]
mod sampling;

pub use presets::{PRESETS, Preset};
pub use stamps::StampError;
pub use terms::{TERMS, Term};

#[cfg(feature = "random")]
pub use constants::ConstantErrors;
#[cfg(feature = "random")]
pub use gyro::{GyroModel, MeasureError, Measured, Truth};
#[cfg(feature = "random")]
pub use magnetometer::MagnetometerModel;
#[cfg(feature = "random")]
pub use sampling::{StampModel, Tick};

use crate::diagnostic::Diagnostic;
use std::fmt;

/// Sizes of a sensor's errors, SI: rad, s, m. Zero or `None` = the term is absent; the default has none.
///
/// Terms marked "1 sigma" are drawn once per unit from a normal distribution of that width, for each
/// axis or matrix element by itself. The same size holds for the three axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ImuError {
    /// Second-order low-pass of the rate: undamped natural frequency, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Damping ratio.
    pub damping: f64,
    /// Scale-factor error, 1 sigma, of one.
    pub scale: f64,
    /// Misalignment, 1 sigma of each of the six off-diagonal elements, rad.
    pub misalignment: f64,
    /// Deviation at full range of the term `w |w|`, 1 sigma, as a part of the range.
    pub nonlinearity: f64,
    /// Deviation at full range of the term `w^3`, 1 sigma, as a part of the range.
    pub nonlinearity3: f64,
    /// Rate per specific force, 1 sigma of each of the nine elements, (rad/s)/(m/s^2).
    pub g_sensitivity: f64,
    /// Bias that is constant from switching on, 1 sigma, rad/s.
    pub turn_on_bias: f64,
    /// Bias per kelvin away from the temperature of calibration, 1 sigma, rad/s/K.
    pub temperature_coefficient: f64,
    /// Bias instability B (flicker): power spectral density B^2 / (2 pi |f|), rad/s.
    pub bias_instability: f64,
    /// Shortest and longest correlation time of the flicker, s. `None` = from the first sampling
    /// interval to 1e5 s.
    pub flicker_tau: Option<[f64; 2]>,
    /// Gauss-Markov bias: standard deviation, rad/s.
    pub gm_sigma: f64,
    /// Gauss-Markov bias: correlation time, s.
    pub gm_tau: f64,
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: f64,
    /// Rate ramp R, rad/s per s: the bias grows by this, on every axis with the same sign.
    pub rate_ramp: f64,
    /// Angle random walk N, rad/sqrt(s): the angle gains a standard deviation of N sqrt(t).
    pub arw: f64,
    /// The rate is clipped to plus and minus this, rad/s.
    pub range: Option<f64>,
    /// Angle quantisation Q, rad: the output is whole steps of Q sqrt(12), the remainder is carried.
    pub quantization: f64,
    /// Step of the output: rad/s for rates and averages; rad for delta angles, remainder carried.
    pub lsb: f64,
    /// Step to which the output is cut towards zero, as a cast to an integer does: rad/s for rates and
    /// averages, rad for delta angles; nothing is carried.
    pub truncation: f64,
    /// White noise of the specific force (velocity random walk), m/s/sqrt(s).
    pub accel_noise: f64,
    /// Constant bias of the specific force, 1 sigma, m/s^2.
    pub accel_bias: f64,
    /// Scale-factor error of the specific force, 1 sigma, of one.
    pub accel_scale: f64,
    /// Misalignment of the accelerometer, 1 sigma of each of the six off-diagonal elements, rad.
    pub accel_misalignment: f64,
    /// The specific force is clipped to plus and minus this, m/s^2.
    pub accel_range: Option<f64>,
    /// Step of the specific force, m/s^2.
    pub accel_lsb: f64,
    /// White noise of the magnetic field, 1 sigma of a sample, T.
    pub mag_noise: f64,
    /// Field of iron that turns with the sensor, 1 sigma of each axis, T.
    pub mag_hard_iron: f64,
    /// Answer of iron that turns with the sensor to the field it is in, 1 sigma of each of the six
    /// elements of a symmetric matrix, of one.
    pub mag_soft_iron: f64,
    /// Step of the magnetic field, T.
    pub mag_lsb: f64,
}

impl Default for ImuError {
    fn default() -> ImuError {
        ImuError {
            bandwidth_hz: None,
            damping: std::f64::consts::FRAC_1_SQRT_2,
            scale: 0.0,
            misalignment: 0.0,
            nonlinearity: 0.0,
            nonlinearity3: 0.0,
            g_sensitivity: 0.0,
            turn_on_bias: 0.0,
            temperature_coefficient: 0.0,
            bias_instability: 0.0,
            flicker_tau: None,
            gm_sigma: 0.0,
            gm_tau: 0.0,
            rrw: 0.0,
            rate_ramp: 0.0,
            arw: 0.0,
            range: None,
            quantization: 0.0,
            lsb: 0.0,
            truncation: 0.0,
            accel_noise: 0.0,
            accel_bias: 0.0,
            accel_scale: 0.0,
            accel_misalignment: 0.0,
            accel_range: None,
            accel_lsb: 0.0,
            mag_noise: 0.0,
            mag_hard_iron: 0.0,
            mag_soft_iron: 0.0,
            mag_lsb: 0.0,
        }
    }
}

/// Smallest range, rad/s, and bandwidth, Hz.
const LEAST_PASSED: f64 = 1e-6;
/// Smallest step of an output, rad or rad/s: an f64 of a whole turn has no finer ones.
const FINEST: f64 = 1e-15;
/// Shortest correlation time of flicker, s.
const SHORTEST: f64 = 1e-9;

/// A set of sizes that no sensor can have, or text that names none.
#[derive(Clone, PartialEq, Debug)]
pub struct ImuErrorFault(pub(super) Diagnostic);

impl From<&ImuErrorFault> for Diagnostic {
    fn from(fault: &ImuErrorFault) -> Diagnostic {
        fault.0.clone()
    }
}

impl fmt::Display for ImuErrorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for ImuErrorFault {}

impl ImuError {
    /// Delay of the low-pass at low frequencies, s: 2 zeta / omega_n. Zero without one.
    #[must_use]
    pub fn group_delay(&self) -> f64 {
        self.bandwidth_hz.map_or(0.0, |hz| {
            2.0 * self.damping / (2.0 * std::f64::consts::PI * hz)
        })
    }

    /// Checks every size, and what cannot stand together.
    ///
    /// # Errors
    /// A size that is negative, not finite or beyond any sensor; a term that lacks another it needs.
    pub fn check(&self) -> Result<(), ImuErrorFault> {
        let fault = |what: String| Err(ImuErrorFault(what.into()));
        for term in &TERMS {
            let value = (term.read)(self) / term.si;
            if !(value >= 0.0 && value <= term.most) {
                return fault(format!(
                    "{}={value}: a number from 0 to {} {} is needed",
                    term.key, term.most, term.unit
                ));
            }
        }
        for (key, value) in [
            ("range", self.range),
            ("bandwidth_hz", self.bandwidth_hz),
            ("accel_range", self.accel_range),
        ] {
            if value.is_some_and(|v| v < LEAST_PASSED) {
                return fault(format!(
                    "{key}: so little that nothing would come through; leave it out"
                ));
            }
        }
        for (key, step) in [
            ("quantization", self.quantization),
            ("lsb", self.lsb),
            ("truncation", self.truncation),
            ("accel_lsb", self.accel_lsb),
            ("mag_lsb", self.mag_lsb),
        ] {
            if step > 0.0 && step < FINEST {
                return fault(format!(
                    "{key}: finer than {FINEST} is no step; leave it out"
                ));
            }
        }
        self.check_together()
    }

    /// Checks what cannot stand together.
    fn check_together(&self) -> Result<(), ImuErrorFault> {
        let fault = |what: String| Err(ImuErrorFault(what.into()));
        if self.bandwidth_hz.is_some() && self.damping < 0.05 {
            return fault(format!(
                "damping={}: below 0.05 the low-pass rings forever",
                self.damping
            ));
        }
        if (self.gm_sigma > 0.0) != (self.gm_tau > 0.0) {
            return fault("gm_sigma and gm_tau belong together: give both or neither".to_owned());
        }
        if (self.nonlinearity > 0.0 || self.nonlinearity3 > 0.0) && self.range.is_none() {
            return fault("nonlinearity_ppm is a part of the range: give range as well".to_owned());
        }
        let steps = [self.quantization, self.lsb, self.truncation];
        if steps.iter().filter(|step| **step > 0.0).count() > 1 {
            return fault(
                "quantization, lsb and truncation are each the step of the output: give one of them"
                    .to_owned(),
            );
        }
        if let Some([least, most]) = self.flicker_tau
            && !(least >= SHORTEST && least < most && most <= 1e9)
        {
            return fault(format!(
                "flicker_tau_min={least}, flicker_tau_max={most}: both are needed, 1e-9 <= min < max <= 1e9 s"
            ));
        }
        Ok(())
    }
}
