//! Body rate -> delta angle -> rotation vector: three vectors in rad that are not the same thing. Pure.
//!
//! Types of their own because the step between them is the whole art: the integral of the rate is a
//! rotation only while the axis stands still, and adding delta angles of a moving axis loses the
//! coning. Only a [`RotationVector`] can advance an attitude.

use nalgebra::Vector3;

/// Angular rate of the body, resolved in body axes, rad/s: relative to the navigation axes (w_nb_b), or to
/// inertial space (w_ib_b) where a gyro measured it. A gyro's bias is one, too.
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
    /// Rate of a body that does not rotate.
    pub const ZERO: BodyRate = BodyRate(Vector3::new(0.0, 0.0, 0.0));

    /// The integral of this rate held for `secs`.
    #[must_use]
    pub fn held_for(self, secs: f64) -> DeltaAngle {
        DeltaAngle(self.0 * secs)
    }
}

/// Components x, y, z, rad/s, for what writes them.
impl From<BodyRate> for [f64; 3] {
    fn from(rate: BodyRate) -> [f64; 3] {
        rate.0.into()
    }
}

impl DeltaAngle {
    /// The rotation if the axis stood still over the interval. Says so because it rarely does:
    /// the error is the coning, of third order in the interval.
    #[must_use]
    pub fn about_fixed_axis(self) -> RotationVector {
        RotationVector(self.0)
    }
}

impl RotationVector {
    /// Angle turned, rad.
    #[must_use]
    pub fn angle(&self) -> f64 {
        super::kernel::length(&self.0)
    }
}
