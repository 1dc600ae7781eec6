//! z-x'-z'' angles and their rates <-> attitude and body rates. Pure.

use crate::rigid_body::Spin;
use nalgebra::Vector3;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;

/// z-x'-z'' angles in rad: `C_nb = Rz(precession) Rx(nutation) Rz(spin)`. Nutation may be negative:
/// it tips the axis the other way.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct EulerAngles {
    /// First rotation, about the vertical.
    pub precession: f64,
    /// Second rotation, the angle of the axis from the vertical.
    pub nutation: f64,
    /// Third rotation, about the axis.
    pub spin: f64,
}

/// Angles and what changes them. The rate about the axis is kept in place of the spin angle's own
/// rate, because it is the constant of the motion.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct EulerState {
    /// Angles.
    pub angles: EulerAngles,
    /// Rate of precession, rad/s.
    pub precession_rate: f64,
    /// Rate of nutation, rad/s.
    pub nutation_rate: f64,
    /// Body rate about the axis, `precession_rate cos(nutation) + spin_rate`, rad/s.
    pub w3: f64,
}

impl EulerAngles {
    /// Attitude.
    #[must_use]
    pub fn quaternion(&self) -> Quaternion<Nav, Body> {
        let (sn, cn) = (0.5 * self.nutation).sin_cos();
        let (ss, cs) = (0.5 * (self.precession + self.spin)).sin_cos();
        let (sd, cd) = (0.5 * (self.precession - self.spin)).sin_cos();
        Quaternion::assume_unit([cn * cs, sn * cd, sn * sd, cn * ss])
    }
}

impl EulerState {
    /// Body rate in rad/s.
    ///
    /// # Source
    /// Goldstein eq. 4-125; seed document eqs. 22-24.
    #[must_use]
    pub fn body_rate(&self) -> Vector3<f64> {
        let (s, c) = self.angles.spin.sin_cos();
        let across = self.precession_rate * self.angles.nutation.sin();
        Vector3::new(
            across * s + self.nutation_rate * c,
            across * c - self.nutation_rate * s,
            self.w3,
        )
    }

    /// Attitude and body rate.
    #[must_use]
    pub fn spin(&self) -> Spin {
        Spin {
            q_nb: self.angles.quaternion(),
            w_nb_b: self.body_rate(),
        }
    }
}
