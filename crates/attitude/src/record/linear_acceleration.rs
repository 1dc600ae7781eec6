//! Acceleration without gravity: specific force, less the force that only holds a body up. Pure.

use super::AttitudeCovariance;
use crate::frames::{Body, In, Nav};
use crate::quaternion::Quaternion;
use nalgebra::{Matrix3, Vector3};

/// White noise of an accelerometer of the usual class, m/s^2/sqrt(Hz) (Bosch BMI088: 190 ug/sqrt(Hz)).
const NOISE: f64 = 1.9e-3;
/// Shortest time between samples that white noise is counted for, s.
const SHORTEST: f64 = 1e-4;

/// Acceleration of the body in space, m/s^2, and how well it is known.
///
/// # Convention
/// `a = f - C_bn g`, body axes, with `f` the specific force without what is known of the accelerometer's errors and `g`
/// gravity's reaction, upwards: at rest it is zero. Of the point where the accelerometer sits, rotation included.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LinearAcceleration {
    /// The acceleration, body axes, m/s^2.
    pub body: In<Body>,
    /// Covariance of its error, (m/s^2)^2, body axes: upper triangle, row by row. NaN: not known.
    pub covariance: [f64; 6],
}

impl LinearAcceleration {
    /// Computes the value alone from a calibrated specific force, the matrix of an attitude whose world has z up, and gravity
    /// (m/s^2).
    pub(crate) fn of(force: &Vector3<f64>, c_nb: &Matrix3<f64>, gravity: f64) -> Vector3<f64> {
        force - c_nb.row(2).transpose() * gravity
    }

    /// Computes it where errors of attitude and force have nothing to do with each other: `force` (m/s^2) is calibrated,
    /// `variance` that of each of its components, and the world has z up.
    pub(crate) fn at(
        q_nb: &Quaternion<Nav, Body>,
        covariance: &AttitudeCovariance,
        force: &Vector3<f64>,
        variance: &Vector3<f64>,
        gravity: f64,
    ) -> LinearAcceleration {
        let c_nb = *q_nb.to_dcm().as_matrix();
        // q_true = q exp(e): the vertical in the body moves by up x e.
        let by_error = (c_nb.row(2).transpose() * gravity).cross_matrix();
        let p = by_error * covariance.matrix() * by_error.transpose()
            + Matrix3::from_diagonal(variance);
        let is_known = *covariance != AttitudeCovariance::default();
        LinearAcceleration {
            body: In::assume(Self::of(force, &c_nb, gravity)),
            covariance: match is_known {
                true => AttitudeCovariance::of(&p).upper(),
                false => [f64::NAN; 6],
            },
        }
    }

    /// Variance of a component by the white noise of an accelerometer whose samples are so many seconds apart,
    /// (m/s^2)^2.
    pub(crate) fn white(secs: f64) -> f64 {
        NOISE * NOISE / secs.max(SHORTEST)
    }

    /// The acceleration in the world of the attitude that it belongs to, m/s^2.
    #[must_use]
    pub fn in_world(&self, q_nb: &Quaternion<Nav, Body>) -> In<Nav> {
        *q_nb * self.body
    }

    /// One standard deviation along each body axis, m/s^2.
    #[must_use]
    pub fn sigma(&self) -> Vector3<f64> {
        AttitudeCovariance::from_upper(self.covariance).sigma()
    }

    /// The same along other body axes: `change` gives the new components of a body vector.
    #[must_use]
    pub(crate) fn relabelled(
        &self,
        change: impl Fn(Vector3<f64>) -> Vector3<f64>,
    ) -> LinearAcceleration {
        LinearAcceleration {
            body: In::assume(change(*self.body.as_vector())),
            covariance: AttitudeCovariance::from_upper(self.covariance)
                .relabelled(change)
                .upper(),
        }
    }
}
