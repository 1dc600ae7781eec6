//! Rotation and displacement -> one transform whose subscripts cancel. Pure.

use nalgebra::{Matrix3, Matrix4, Vector3};
use std::fmt;
use std::ops::Mul;
use strapd_attitude::frames::{Dcm, In, NotARotation, tag};

/// Pose of frame `From` in frame `To`, a homogeneous transform: `t_base_tool: Transform<Base, Tool>`
/// is the document's `0A5`.
///
/// # Convention
/// Rotation takes `From` components to `To` components; translation leads from the origin of `To` to
/// that of `From`, resolved in `To`, in m.
pub struct Transform<To, From> {
    c: Dcm<To, From>,
    r: In<To>,
}

// Written out, not derived: a derive would ask the tags for the same traits.
impl<To, From> Clone for Transform<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Transform<To, From> {}
impl<To, From> PartialEq for Transform<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.c == other.c && self.r == other.r
    }
}
impl<To, From> fmt::Debug for Transform<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (to, from) = (tag::<To>(), tag::<From>());
        write!(f, "Transform<{to}, {from}>{{{:?}, {:?}}}", self.c, self.r)
    }
}

impl<To, From> Transform<To, From> {
    /// Makes it from a rotation and the position of the origin of `From`, m.
    #[must_use]
    pub fn new(c: Dcm<To, From>, r: In<To>) -> Self {
        Self { c, r }
    }

    /// Both frames coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self::new(Dcm::identity(), In::assume(Vector3::zeros()))
    }

    /// Checks a 4x4 matrix from outside; the direction is the caller's word.
    ///
    /// # Errors
    /// [`TransformError`] when the rotation is none, a length is not finite, or the last row is not
    /// `0 0 0 1`.
    pub fn try_from_homogeneous(m: &Matrix4<f64>) -> Result<Self, TransformError> {
        let c = Matrix3::from(m.fixed_view::<3, 3>(0, 0));
        let r = Vector3::from(m.fixed_view::<3, 1>(0, 3));
        if m.row(3) != nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0) {
            return Err(TransformError::LastRow);
        }
        if !r.iter().all(|x| x.is_finite()) {
            return Err(TransformError::NotFinite);
        }
        let c = Dcm::try_from_matrix(c).map_err(TransformError::Rotation)?;
        Ok(Self::new(c, In::assume(r)))
    }

    /// The 4x4 matrix, (B.1).
    #[must_use]
    pub fn to_homogeneous(&self) -> Matrix4<f64> {
        let mut m = Matrix4::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(self.c.as_matrix());
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(self.r.as_vector());
        m
    }

    /// Takes free vectors (velocities, forces, axes) from `From` to `To`.
    #[must_use]
    pub fn rotation(&self) -> Dcm<To, From> {
        self.c
    }

    /// Vector from the origin of `To` to that of `From`, m.
    #[must_use]
    pub fn translation(&self) -> In<To> {
        self.r
    }

    /// A point's coordinates, (B.2). A *free* vector does not move with the origin: for those,
    /// [`Transform::rotation`].
    #[must_use]
    pub fn point(&self, p: In<From>) -> In<To> {
        In::assume((self.c * p).as_vector() + self.r.as_vector())
    }

    /// The way back, exact but for one rounding.
    #[must_use]
    pub fn inverse(&self) -> Transform<From, To> {
        let c = self.c.transpose();
        let r = -(c * self.r).as_vector();
        Transform::new(c, In::assume(r))
    }
}

impl<A, B, C> Mul<Transform<B, C>> for Transform<A, B> {
    type Output = Transform<A, C>;
    fn mul(self, right: Transform<B, C>) -> Transform<A, C> {
        Transform::new(self.c * right.c, self.point(right.r))
    }
}

/// Why sixteen numbers are no pose.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum TransformError {
    /// The upper left 3x3 block is no rotation.
    Rotation(NotARotation),
    /// The last column holds NaN or infinity.
    NotFinite,
    /// The last row is not `0 0 0 1`: perhaps the matrix is transposed.
    LastRow,
}

impl fmt::Display for TransformError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rotation(why) => write!(f, "{why}"),
            Self::NotFinite => write!(f, "a position must be finite numbers"),
            Self::LastRow => write!(
                f,
                "not a homogeneous transform: the last row must be 0 0 0 1 (transposed?)"
            ),
        }
    }
}

impl std::error::Error for TransformError {}
