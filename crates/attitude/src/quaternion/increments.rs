//! Body rate -> delta angle -> rotation vector: three vectors in rad that are not the same thing. Pure.
//!
//! Types of their own because the step between them is the whole art: the integral of the rate is a
//! rotation only while the axis stands still, and adding delta angles of a moving axis loses the
//! coning. Only a [`RotationVector`] can advance an attitude.

use nalgebra::Vector3;

/// Angular rate of the body relative to n, resolved in body axes (w_nb_b), rad/s.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BodyRate(pub Vector3<f64>);

/// The integral of the body rate over an interval, resolved in the moving body axes, rad.
/// Not yet a rotation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DeltaAngle(pub Vector3<f64>);

/// A rotation vector (Bortz): axis times angle in rad, resolved in body axes; coning included.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RotationVector(pub Vector3<f64>);

impl BodyRate {
    /// The integral of this rate held for `secs`.
    #[must_use]
    pub fn held_for(self, secs: f64) -> DeltaAngle {
        DeltaAngle(self.0 * secs)
    }
}

impl DeltaAngle {
    /// The rotation if the axis stood still over the interval. Says so because it rarely does:
    /// the error is the coning, of third order in the interval.
    #[must_use]
    pub fn about_fixed_axis(self) -> RotationVector {
        RotationVector(self.0)
    }

    /// The rotation: delta angle plus a coning term computed by whoever knows the rate's shape.
    #[must_use]
    pub fn with_coning(self, coning: &Vector3<f64>) -> RotationVector {
        RotationVector(self.0 + coning)
    }
}

impl RotationVector {
    /// Angle turned, rad.
    #[must_use]
    pub fn angle(&self) -> f64 {
        super::norm3(&self.0)
    }
}
