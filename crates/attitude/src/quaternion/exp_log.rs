//! Rotation vector <-> quaternion, exact at zero and at half a turn. Pure.
//!
//! Apart from the [kernel](super::kernel), which does the arithmetic, because these two carry frames and promises.

use super::kernel::{exp_minus_one, length};
use super::{Quaternion, RotationVector};
use nalgebra::Vector3;

impl<To, From> Quaternion<To, From> {
    /// The rotation that turns by |phi| about phi: exp(phi), of unit norm to rounding.
    ///
    /// # Accuracy
    /// 1e-15 rad up to half a turn.
    #[must_use]
    pub fn from_rotation_vector(phi: &RotationVector) -> Self {
        let [w, x, y, z] = exp_minus_one(&phi.0);
        Self::assume_unit([1.0 + w, x, y, z])
    }

    /// The shortest rotation vector: log(q), angle in 0..=pi.
    ///
    /// # Accuracy
    /// 4 ulp of the angle, from 0 to pi, for any norm: no arc cosine, no cut near zero or half
    /// a turn. At exactly half a turn (w = 0) the axis is that of the stored vector part.
    #[must_use]
    pub fn rotation_vector(&self) -> RotationVector {
        let [w, x, y, z] = self.wxyz();
        let sign = if w < 0.0 { -1.0 } else { 1.0 };
        let v = Vector3::new(x, y, z) * sign;
        let sine = length(&v);
        if sine == 0.0 {
            return RotationVector(v);
        }
        let angle = 2.0 * sine.atan2(w.abs());
        // Unit axis first: angle / sine overflows for a sine below 1e-308.
        RotationVector(v / sine * angle)
    }
}
