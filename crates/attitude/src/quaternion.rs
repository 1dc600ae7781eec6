//! Attitude as a quaternion that knows its frames; how motion advances it. Pure.
//!
//! A stage of its own because it is the one place where rotation vectors, quaternions, matrices
//! and yaw-pitch-roll turn into each other; everything else holds a [`Quaternion`].
//!
//! # Convention
//! Hamilton product, `[w, x, y, z]`, scalar first in every signature. `Quaternion<Nav, Body>` is
//! q_nb and takes body components to navigation components: `v_n = q_nb v_b q_nb*`. Body rates move
//! it from the right: `q' = q (0, w)/2`. q and -q are the same attitude.

mod exp_log;
mod increments;
#[doc(hidden)]
pub mod kernel;
#[cfg(feature = "serde")]
pub(crate) mod numbers;
mod yaw_pitch_roll;

pub use increments::{BodyRate, DeltaAngle, RotationVector};
pub use kernel::exp_minus_one;
pub use yaw_pitch_roll::YawPitchRoll;

use crate::frames::{Body, Dcm, In, NotARotation, tag};
use nalgebra::{Matrix3, Vector3};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

/// A unit quaternion with the book's subscripts: `Quaternion<Nav, Body>` is q_nb, takes body
/// components to navigation components. Hamilton product, scalar first in every signature.
pub struct Quaternion<To, From> {
    wxyz: [f64; 4],
    frames: PhantomData<(To, From)>,
}

// Written out, not derived: a derive would ask the tags for the same traits.
impl<To, From> Clone for Quaternion<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Quaternion<To, From> {}
impl<To, From> Default for Quaternion<To, From> {
    fn default() -> Self {
        Quaternion::identity()
    }
}
/// The same four numbers; q and -q are the same attitude but not equal.
impl<To, From> PartialEq for Quaternion<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.wxyz == other.wxyz
    }
}
impl<To, From> fmt::Debug for Quaternion<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [w, x, y, z] = self.wxyz;
        let (to, from) = (tag::<To>(), tag::<From>());
        write!(
            f,
            "Quaternion<{to}, {from}>{{w: {w}, x: {x}, y: {y}, z: {z}}}"
        )
    }
}

impl<To, From> Quaternion<To, From> {
    /// Identity: both frames coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self::assume_unit([1.0, 0.0, 0.0, 0.0])
    }

    /// A human says: these four numbers `[w, x, y, z]` have unit norm and take `From` to `To`.
    #[must_use]
    pub fn assume_unit(wxyz: [f64; 4]) -> Self {
        Quaternion {
            wxyz,
            frames: PhantomData,
        }
    }

    /// Four numbers from outside, normalised; the direction is still the human's word.
    ///
    /// # Errors
    /// [`NotARotation::Norm`] when the norm is NaN or outside 0.5 to 2: recorded orientations of
    /// norm 0, 0.07 and 195.7 exist, and none of them was an attitude.
    pub fn try_from_wxyz(wxyz: [f64; 4]) -> Result<Self, NotARotation> {
        let norm = kernel::norm(&wxyz);
        if (0.5..=2.0).contains(&norm) {
            Ok(Self::assume_unit(wxyz.map(|c| c / norm)))
        } else {
            Err(NotARotation::Norm { norm })
        }
    }

    /// `[w, x, y, z]`.
    #[must_use]
    pub fn wxyz(&self) -> [f64; 4] {
        self.wxyz
    }

    /// The way back: q_bn from q_nb. Exact.
    #[must_use]
    pub fn inverse(&self) -> Quaternion<From, To> {
        Quaternion::assume_unit(kernel::conjugate(&self.wxyz))
    }

    /// Norm 1 to one rounding. For norms between 1e-150 and 1e150; a zero quaternion gives NaN.
    #[must_use]
    pub fn normalised(&self) -> Self {
        Self::assume_unit(kernel::unit(&self.wxyz))
    }

    /// The same attitude with the sign nearest to `previous`, so that a stream has no jumps.
    #[must_use]
    pub fn same_sign_as(&self, previous: &Self) -> Self {
        if kernel::dot(&self.wxyz, &previous.wxyz) < 0.0 {
            Self::assume_unit(self.wxyz.map(|c| -c))
        } else {
            *self
        }
    }

    /// The angle between two attitudes, rad, in 0..=pi.
    ///
    /// # Accuracy
    /// 4 ulp of the angle between the stored numbers, at every angle, however small: from the
    /// difference (exact for close attitudes), not from an arc cosine. Norms do not matter.
    #[must_use]
    pub fn angle_to(&self, other: &Self) -> f64 {
        let other = other.same_sign_as(self).wxyz;
        let [aw, ax, ay, az] = self.wxyz;
        let [bw, bx, by, bz] = other;
        // Vector part of a* (b - a): that of a* a is nothing, so this is the vector part of a* b.
        let [dw, dx, dy, dz] = [bw - aw, bx - ax, by - ay, bz - az];
        let v = Vector3::new(
            aw * dx - ax * dw - (ay * dz - az * dy),
            aw * dy - ay * dw - (az * dx - ax * dz),
            aw * dz - az * dw - (ax * dy - ay * dx),
        );
        2.0 * kernel::length(&v).atan2(kernel::dot(&self.wxyz, &other))
    }

    /// Shortest great arc from `self` (t = 0) to `other` (t = 1) at constant rate.
    ///
    /// At exactly half a turn apart both ways are shortest; one of them is taken.
    #[must_use]
    pub fn slerp(&self, other: &Self, t: f64) -> Self {
        let phi = (self.inverse() * *other).rotation_vector();
        self.turned(&(phi.0 * t)).normalised()
    }

    /// `q exp(phi)`, phi in `From` axes.
    fn turned(&self, phi: &Vector3<f64>) -> Self {
        Self::assume_unit(kernel::turned(&self.wxyz, phi))
    }

    /// The matrix C with the same subscripts.
    ///
    /// # Accuracy
    /// Entries to 4e-16 for a quaternion of unit norm.
    #[must_use]
    pub fn to_dcm(&self) -> Dcm<To, From> {
        let [[a, b, c], [d, e, f], [g, h, i]] = kernel::rows(&self.wxyz);
        Dcm::assume(Matrix3::new(a, b, c, d, e, f, g, h, i))
    }

    /// The quaternion of a matrix, w >= 0.
    ///
    /// # Accuracy
    /// 1e-15 rad at every angle, half turns included: of four quotients the one with the largest
    /// divisor is taken (never below 1).
    ///
    /// # Source
    /// Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1(3), 1978.
    #[must_use]
    pub fn from_dcm(c: &Dcm<To, From>) -> Self {
        let m = c.as_matrix();
        let (m00, m11, m22) = (m[(0, 0)], m[(1, 1)], m[(2, 2)]);
        let trace = m00 + m11 + m22;
        let sum = |i, j| m[(i, j)] + m[(j, i)];
        let (rx, ry, rz) = (
            m[(2, 1)] - m[(1, 2)],
            m[(0, 2)] - m[(2, 0)],
            m[(1, 0)] - m[(0, 1)],
        );
        // Each row is 4 times one component times the whole quaternion.
        let largest = trace.max(m00).max(m11).max(m22);
        let scaled = if largest == trace {
            [1.0 + trace, rx, ry, rz]
        } else if largest == m00 {
            [rx, 1.0 + m00 - m11 - m22, sum(0, 1), sum(0, 2)]
        } else if largest == m11 {
            [ry, sum(0, 1), 1.0 + m11 - m00 - m22, sum(1, 2)]
        } else {
            [rz, sum(0, 2), sum(1, 2), 1.0 + m22 - m00 - m11]
        };
        let q = Self::assume_unit(scaled).normalised();
        q.same_sign_as(&Self::identity())
    }
}

impl<To> Quaternion<To, Body> {
    /// The attitude after the body has turned by `phi`: `q exp(phi)`, from the right, because phi is
    /// resolved in body axes. Not renormalised; for long products see `propagate`.
    ///
    /// A rate does not advance an attitude, it must be integrated first:
    /// ```compile_fail,E0308
    /// use strapd_attitude::quaternion::{BodyRate, Quaternion};
    /// use strapd_attitude::frames::{Body, Nav};
    /// let q = Quaternion::<Nav, Body>::identity();
    /// q.advanced(&BodyRate(nalgebra::Vector3::x()));
    /// ```
    /// Neither does a delta angle, which lacks coning:
    /// ```compile_fail,E0308
    /// use strapd_attitude::quaternion::{DeltaAngle, Quaternion};
    /// use strapd_attitude::frames::{Body, Nav};
    /// let q = Quaternion::<Nav, Body>::identity();
    /// q.advanced(&DeltaAngle(nalgebra::Vector3::x()));
    /// ```
    #[must_use]
    pub fn advanced(&self, phi: &RotationVector) -> Self {
        self.turned(&phi.0)
    }
}

impl<A, B, C> Mul<Quaternion<B, C>> for Quaternion<A, B> {
    type Output = Quaternion<A, C>;
    /// Hamilton product; not renormalised.
    fn mul(self, right: Quaternion<B, C>) -> Quaternion<A, C> {
        Quaternion::assume_unit(kernel::product(&self.wxyz, &right.wxyz))
    }
}

impl<A, B> Mul<In<B>> for Quaternion<A, B> {
    type Output = In<A>;
    fn mul(self, v: In<B>) -> In<A> {
        In::assume(kernel::rotated(&self.wxyz, v.into()).into())
    }
}

#[cfg(test)]
mod tests;
