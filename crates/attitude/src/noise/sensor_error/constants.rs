//! Sizes and a seed -> what one unit drew: the errors that stay from switching on. Pure.

use super::ImuError;
use super::normal::{Purpose, Stream, vector};
use nalgebra::{Matrix3, Vector3};

/// The constant errors of one unit. Sensor axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ConstantErrors {
    /// K_sf = I + diag(scale) + misalignment: the rate read is K_sf times the true rate.
    /// Row = axis that reads, column = axis that turns.
    pub sensitivity: Matrix3<f64>,
    /// Factor of `w |w|` for each axis, s/rad.
    pub nonlinear2: Vector3<f64>,
    /// Factor of `w^3` for each axis, s^2/rad^2.
    pub nonlinear3: Vector3<f64>,
    /// Rate read per specific force, (rad/s)/(m/s^2).
    pub g_sensitivity: Matrix3<f64>,
    /// Turn-on bias, rad/s.
    pub bias: Vector3<f64>,
    /// Bias per kelvin, rad/s/K.
    pub temperature_coefficient: Vector3<f64>,
    /// Bias of the specific force, m/s^2.
    pub accel_bias: Vector3<f64>,
    /// The specific force read is this times the true one, and the bias.
    pub accel_sensitivity: Matrix3<f64>,
}

impl ConstantErrors {
    /// A unit without any.
    #[must_use]
    pub fn none() -> ConstantErrors {
        ConstantErrors {
            sensitivity: Matrix3::identity(),
            nonlinear2: Vector3::zeros(),
            nonlinear3: Vector3::zeros(),
            g_sensitivity: Matrix3::zeros(),
            bias: Vector3::zeros(),
            temperature_coefficient: Vector3::zeros(),
            accel_bias: Vector3::zeros(),
            accel_sensitivity: Matrix3::identity(),
        }
    }

    /// Draws a unit: each element normal with the 1 sigma of its size.
    #[must_use]
    pub fn draw(error: &ImuError, seed: u64) -> ConstantErrors {
        let spread = |purpose, sigma: f64| sigma * vector(&mut Stream::axes(seed, purpose));
        let matrix = |purpose, sigma: f64| {
            let mut streams = Stream::axes(seed, purpose);
            sigma * Matrix3::from_fn(|row, _| streams[row].normal())
        };
        let sensitivity = |scale: Vector3<f64>, mut misalignment: Matrix3<f64>| {
            misalignment.fill_diagonal(0.0);
            Matrix3::identity() + Matrix3::from_diagonal(&scale) + misalignment
        };
        // Without a range there is no non-linearity: `ImuError::check`.
        let range = error.range.unwrap_or(1.0);
        ConstantErrors {
            sensitivity: sensitivity(
                spread(Purpose::Scale, error.scale),
                matrix(Purpose::Misalignment, error.misalignment),
            ),
            nonlinear2: spread(Purpose::Nonlinearity, error.nonlinearity / range),
            nonlinear3: spread(
                Purpose::Nonlinearity3,
                error.nonlinearity3 / (range * range),
            ),
            g_sensitivity: matrix(Purpose::GSensitivity, error.g_sensitivity),
            bias: spread(Purpose::TurnOnBias, error.turn_on_bias),
            temperature_coefficient: spread(
                Purpose::TemperatureCoefficient,
                error.temperature_coefficient,
            ),
            accel_bias: spread(Purpose::AccelerationBias, error.accel_bias),
            accel_sensitivity: sensitivity(
                spread(Purpose::AccelerationScale, error.accel_scale),
                matrix(Purpose::AccelerationMisalignment, error.accel_misalignment),
            ),
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.sensitivity
            .iter()
            .chain(self.g_sensitivity.iter())
            .chain(self.nonlinear2.iter())
            .chain(self.nonlinear3.iter())
            .chain(self.bias.iter())
            .chain(self.temperature_coefficient.iter())
            .chain(self.accel_bias.iter())
            .chain(self.accel_sensitivity.iter())
            .all(|v| v.is_finite())
    }
}
