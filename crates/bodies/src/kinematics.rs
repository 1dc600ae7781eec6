//! Kinematics at a sensor on a moving body at an instant, whatever moves the body.

use crate::rigid_body::Spin;
use nalgebra::Vector3;

/// Kinematics at a sensor in the origin of the body axes at an instant.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Kinematics {
    /// Attitude and body rate.
    pub spin: Spin,
    /// Rate of change of the body rate, rad/s^2, body axes.
    pub rate_change: Vector3<f64>,
    /// Acceleration of the origin, m/s^2, navigation axes.
    pub acceleration_n: Vector3<f64>,
}
