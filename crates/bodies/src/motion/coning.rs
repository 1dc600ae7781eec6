//! Constant rate and coning -> attitude, rate, delta angle. Pure.

use super::{FASTEST, MotionError, within};
use crate::double_double::DoubleDouble;
use crate::rigid_body::Spin;
use nalgebra::Vector3;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// Seconds of an interval, exact but for one rounding; negative when `to` is before `from`.
pub(super) fn secs(from: u64, to: u64) -> f64 {
    (DoubleDouble::from_nanos(to) - DoubleDouble::from_nanos(from)).to_f64()
}

/// A rotation about a fixed axis at a constant rate.
///
/// # Accuracy
/// Attitude within 4e-16 rad at any time: the angle is reduced in 32 digits.
#[derive(Clone, Copy, Debug)]
pub struct ConstantRate {
    start: [f64; 4],
    w: Vector3<f64>,
    speed: DoubleDouble,
}

impl ConstantRate {
    /// Makes it from an attitude at zero and a body rate in rad/s.
    ///
    /// # Errors
    /// [`MotionError`] for a rate that is not a number or above 1e5 rad/s.
    pub fn new(start: Quaternion<Nav, Body>, w: Vector3<f64>) -> Result<Self, MotionError> {
        within("body rate (rad/s)", w.norm(), FASTEST)?;
        let square = |x: f64| DoubleDouble::from(x) * x;
        Ok(Self {
            start: quat::normalised(&start.wxyz()),
            w,
            speed: (square(w.x) + square(w.y) + square(w.z)).sqrt(),
        })
    }

    /// Attitude and body rate at `nanos` nanoseconds.
    #[must_use]
    pub fn at_nanos(&self, nanos: u64) -> Spin {
        let half = self.speed * DoubleDouble::from_nanos(nanos) * 0.5;
        let (s, c) = half.sin_cos();
        let speed = self.speed.to_f64();
        let axis = if speed > 0.0 { self.w / speed } else { self.w };
        let turn = [c, s * axis.x, s * axis.y, s * axis.z];
        Spin {
            q_nb: Quaternion::assume_unit(quat::normalised(&quat::product(&self.start, &turn))),
            w_nb_b: self.w,
        }
    }

    /// Integral of the body rate, rad.
    #[must_use]
    pub fn delta_angle(&self, from: u64, to: u64) -> Vector3<f64> {
        self.w * secs(from, to)
    }
}

/// Classical coning: the body x axis runs round a cone about the navigation x axis without spinning on it.
///
/// `q = [cos(a/2), 0, sin(a/2) cos Wt, sin(a/2) sin Wt]`,
/// `w = [-2 W sin²(a/2), -W sin a sin Wt, W sin a cos Wt]`.
///
/// # Accuracy
/// 4e-16 rad at any time; delta angle within 1e-16 rad.
///
/// # Source
/// Wu, Litmanovich, Gyroscopy and Navigation 11 (2020), section 4; Savage, J. Guid. Control Dyn. 21
/// (1998) 19, section "classical coning". Checked by its derivative.
#[derive(Clone, Copy, Debug)]
pub struct Coning {
    half_sin: f64,
    half_cos: f64,
    omega: f64,
}

impl Coning {
    /// Half-angle of the cone `a` in rad, frequency in Hz.
    ///
    /// # Errors
    /// [`MotionError`] for an angle beyond half a turn, or a frequency above 1e5 rad/s.
    pub fn new(angle: f64, frequency_hz: f64) -> Result<Self, MotionError> {
        within("coning angle (rad)", angle, std::f64::consts::PI)?;
        let omega = frequency_hz * std::f64::consts::TAU;
        within("coning frequency (rad/s)", omega, FASTEST)?;
        let (half_sin, half_cos) = (0.5 * angle).sin_cos();
        Ok(Self {
            half_sin,
            half_cos,
            omega,
        })
    }

    /// `sin a`
    fn sin_angle(&self) -> f64 {
        2.0 * self.half_sin * self.half_cos
    }

    /// Attitude and body rate at `nanos` nanoseconds.
    #[must_use]
    pub fn at_nanos(&self, nanos: u64) -> Spin {
        let (s, c) = (DoubleDouble::from_nanos(nanos) * self.omega).sin_cos();
        let across = self.omega * self.sin_angle();
        Spin {
            q_nb: Quaternion::assume_unit([
                self.half_cos,
                0.0,
                self.half_sin * c,
                self.half_sin * s,
            ]),
            w_nb_b: Vector3::new(
                -2.0 * self.omega * self.half_sin * self.half_sin,
                -across * s,
                across * c,
            ),
        }
    }

    /// Rate of change of the body rate, rad/s^2.
    #[must_use]
    pub fn rate_change(&self, nanos: u64) -> Vector3<f64> {
        let (s, c) = (DoubleDouble::from_nanos(nanos) * self.omega).sin_cos();
        let across = self.omega * self.omega * self.sin_angle();
        Vector3::new(0.0, -across * c, -across * s)
    }

    /// Integral of the body rate, rad.
    #[must_use]
    pub fn delta_angle(&self, from: u64, to: u64) -> Vector3<f64> {
        // Differences of cosines as products: a short interval keeps its digits.
        let middle = DoubleDouble::from_nanos(from) + DoubleDouble::from_nanos(to);
        let (sm, cm) = (middle * (0.5 * self.omega)).sin_cos();
        let dt = secs(from, to);
        let chord = 2.0 * self.sin_angle() * (0.5 * self.omega * dt).sin();
        Vector3::new(
            -2.0 * self.omega * self.half_sin * self.half_sin * dt,
            -chord * sm,
            chord * cm,
        )
    }
}
