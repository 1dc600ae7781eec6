//! Direction cosine matrices and vectors that know their frames. Pure.
//!
//! A stage of its own because a transposed matrix has the right shape, the right norm and the
//! wrong meaning. Here the type parameters are the book's subscripts: [`Dcm<Nav, Body>`] is C_nb,
//! inner subscripts cancel, and what does not cancel does not compile.
//!
//! A human states a direction at one door only, [`Dcm::assume`] / [`In::assume`]; write there who
//! says so. There is no `Deref` to nalgebra: kernels ask for [`Dcm::as_matrix`].
//!
//! What the types do not catch: two sensors are both [`Sensor`], a frame is a name and not an
//! instant (`C_nb` of yesterday has the type of `C_nb` of today), and `assume` believes anything.
//!
//! ```
//! use strapd_attitude::frames::{Attitude, Body, Dcm, In, Nav, Sensor};
//! # use nalgebra::{Matrix3, Vector3};
//! let c_nb = Attitude::identity();
//! let c_bs = Dcm::<Body, Sensor>::identity();
//! let f_s = In::<Sensor>::assume(Vector3::new(0.0, 0.0, 9.8));
//! let f_n: In<Nav> = c_nb * c_bs * f_s; // n<-b b<-s s: inner subscripts cancel
//! # assert_eq!(f_n.as_vector().z, 9.8);
//! ```
//!
//! The wrong order does not compile:
//! ```compile_fail,E0277
//! use strapd_attitude::frames::{Attitude, Body, Dcm, Sensor};
//! let c_nb = Attitude::identity();
//! let c_bs = Dcm::<Body, Sensor>::identity();
//! let wrong = c_bs * c_nb; // s and n do not cancel
//! ```
//! Neither does a vector in the wrong axes:
//! ```compile_fail,E0277
//! use strapd_attitude::frames::{Attitude, In, Nav};
//! # use nalgebra::Vector3;
//! let g_n = In::<Nav>::assume(Vector3::new(0.0, 0.0, -9.8));
//! let wrong = Attitude::identity() * g_n; // takes body components; C_nb^T * g_n was meant
//! ```

mod axes;

pub use axes::{AxisMap, AxisMapError, BodyAxes};

use nalgebra::{Matrix3, Vector3};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

// A frame is a type with no values, used only as a subscript.

/// The navigation ("world") frame attitude is given in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Nav {}
/// The body frame: the vehicle's axes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Body {}
/// The sensor's own axes, before mounting.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sensor {}
/// World: x north, y east, z down (aviation, PX4, MAVLink).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ned {}
/// World: x east, y north, z up (ROS REP-103).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Enu {}
/// World: x north, y west, z up (x-io).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Nwu {}
/// Body: x forward, y right, z down; goes with [`Ned`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Frd {}
/// Body: x forward, y left, z up; goes with [`Enu`] and [`Nwu`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Flu {}

/// The tag's name for messages: the last segment of its path.
pub fn tag<F>() -> &'static str {
    std::any::type_name::<F>()
        .rsplit("::")
        .next()
        .unwrap_or_default()
}

/// A vector resolved in the axes of `F`. The unit is that of the quantity.
pub struct In<F> {
    v: Vector3<f64>,
    frame: PhantomData<F>,
}

/// A direction cosine matrix C with the book's subscripts: `Dcm<Nav, Body>` is C_nb.
///
/// # Convention
/// `C_nb * v_b = v_n`: its columns are the body axes resolved in n. Right-handed, active when read
/// as "turn the n axes onto the b axes".
pub struct Dcm<To, From> {
    m: Matrix3<f64>,
    frames: PhantomData<(To, From)>,
}

/// Attitude: the rotation that takes vectors from body axes to navigation axes, C_nb.
pub type Attitude = Dcm<Nav, Body>;

// Written out, not derived: a derive would ask the tags for the same traits.
impl<F> Clone for In<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for In<F> {}
impl<F> PartialEq for In<F> {
    fn eq(&self, other: &Self) -> bool {
        self.v == other.v
    }
}
impl<F> fmt::Debug for In<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "In<{}>[{}, {}, {}]",
            tag::<F>(),
            self.v.x,
            self.v.y,
            self.v.z
        )
    }
}

/// Components x, y, z, for what writes them.
impl<F> From<In<F>> for [f64; 3] {
    fn from(vector: In<F>) -> [f64; 3] {
        vector.v.into()
    }
}

impl<F> In<F> {
    /// A human says: these components are resolved in `F`.
    #[must_use]
    pub fn assume(v: Vector3<f64>) -> Self {
        In {
            v,
            frame: PhantomData,
        }
    }
    /// The bare components, for kernels.
    #[must_use]
    pub fn as_vector(&self) -> &Vector3<f64> {
        &self.v
    }
}

impl<To, From> Clone for Dcm<To, From> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<To, From> Copy for Dcm<To, From> {}
impl<To, From> PartialEq for Dcm<To, From> {
    fn eq(&self, other: &Self) -> bool {
        self.m == other.m
    }
}
impl<To, From> fmt::Debug for Dcm<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows: Vec<[f64; 3]> = self.m.row_iter().map(|r| [r[0], r[1], r[2]]).collect();
        write!(f, "Dcm<{}, {}>{rows:?}", tag::<To>(), tag::<From>())
    }
}

impl<To, From> Dcm<To, From> {
    /// A human says: this matrix takes `From` to `To`. Nothing is checked.
    #[must_use]
    pub fn assume(m: Matrix3<f64>) -> Self {
        Dcm {
            m,
            frames: PhantomData,
        }
    }

    /// A matrix from outside, if it is a rotation; the direction is still the human's word.
    ///
    /// # Errors
    /// [`NotARotation`] when an entry is not finite, when a row or column is off orthonormal by
    /// more than 1e-6, or when it mirrors (determinant -1).
    pub fn try_from_matrix(m: Matrix3<f64>) -> Result<Self, NotARotation> {
        let defect = Self::assume(m).orthonormality_defect();
        if defect > 1e-6 || defect.is_nan() {
            return Err(NotARotation::NotOrthonormal { defect });
        }
        let determinant = m.determinant();
        if determinant < 0.0 {
            return Err(NotARotation::Mirrors { determinant });
        }
        Ok(Self::assume(m))
    }

    /// Identity: both frames coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self::assume(Matrix3::identity())
    }

    /// The bare matrix, for kernels.
    #[must_use]
    pub fn as_matrix(&self) -> &Matrix3<f64> {
        &self.m
    }

    /// The way back: C_bn from C_nb.
    #[must_use]
    pub fn transpose(&self) -> Dcm<From, To> {
        Dcm::assume(self.m.transpose())
    }

    /// Largest entry of `C C^T - I`: how far rounding (or an attacker) has taken it from a rotation.
    /// NaN when an entry is not finite.
    #[must_use]
    pub fn orthonormality_defect(&self) -> f64 {
        // Not `amax()`, which passes over NaN.
        (self.m * self.m.transpose() - Matrix3::identity())
            .iter()
            .map(|entry| entry.abs())
            .fold(
                0.0,
                |worst, e| if e > worst || e.is_nan() { e } else { worst },
            )
    }
}

impl<A, B, C> Mul<Dcm<B, C>> for Dcm<A, B> {
    type Output = Dcm<A, C>;
    fn mul(self, right: Dcm<B, C>) -> Dcm<A, C> {
        Dcm::assume(self.m * right.m)
    }
}

impl<A, B> Mul<In<B>> for Dcm<A, B> {
    type Output = In<A>;
    fn mul(self, v: In<B>) -> In<A> {
        In::assume(self.m * v.v)
    }
}

/// Why nine or four numbers are no rotation.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum NotARotation {
    /// `max |C C^T - I|` is beyond 1e-6, or NaN.
    NotOrthonormal {
        /// Size of the defect.
        defect: f64,
    },
    /// Matrix that turns right-handed axes into left-handed ones.
    Mirrors {
        /// About -1.
        determinant: f64,
    },
    /// A quaternion whose norm is outside 0.5 to 2, or NaN.
    Norm {
        /// Norm as given.
        norm: f64,
    },
}

impl fmt::Display for NotARotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NotARotation::NotOrthonormal { defect } => write!(
                f,
                "not a rotation matrix: C C^T differs from 1 by {defect:.3e}, allowed 1e-6"
            ),
            NotARotation::Mirrors { determinant } => write!(
                f,
                "not a rotation matrix: determinant {determinant:.3}, it mirrors"
            ),
            NotARotation::Norm { norm } => {
                write!(
                    f,
                    "not a rotation: quaternion norm {norm:.3}, allowed 0.5 to 2"
                )
            }
        }
    }
}

impl std::error::Error for NotARotation {}

/// Outside text, fit for a message: of at most so many characters, and without control characters.
pub(crate) fn quoted(text: &str, most: usize) -> String {
    let shown = text.chars().take(most);
    let mut quoted: String = shown.flat_map(char::escape_debug).collect();
    if text.chars().nth(most).is_some() {
        quoted.push_str("...");
    }
    quoted
}
