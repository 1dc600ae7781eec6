//! Pairs -> the one rotation between their worlds. Pure.
//!
//! Apart from `compare` because a gyro knows no north: its world is where it started, the reference's
//! is the laboratory's, and how much of that difference is forgiven must be said.

use super::matching::{Track, for_each_match};
use crate::diagnostic::Diagnostic;
use crate::frames::Nav;
use crate::quaternion::Quaternion;
use nalgebra::{Matrix4, SymmetricEigen, Vector4};
use std::fmt;
use std::ops::ControlFlow;
use std::str::FromStr;

/// Constant rotation of the world that is removed before absolute errors are measured (`--align`).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Align {
    /// Nothing: both worlds are claimed to be the same.
    None,
    /// The one that makes the first matched sample agree: what a dead reckoner may ask for.
    First,
    /// The turn about the vertical (z) that makes the heading of the first matched sample agree: what who is level and
    /// knows no north may ask for.
    FirstHeading,
    /// The turn about the vertical (z) that fits best over all samples: heading unknown, level known.
    Heading,
    /// The rotation that fits best over all samples.
    Best,
}

impl Align {
    /// Every choice.
    pub const ALL: [Align; 5] = [
        Align::None,
        Align::First,
        Align::FirstHeading,
        Align::Heading,
        Align::Best,
    ];

    /// The name used by `--align`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Align::None => "none",
            Align::First => "first",
            Align::FirstHeading => "first-heading",
            Align::Heading => "heading",
            Align::Best => "best",
        }
    }

    /// World of the estimate to world of the reference; the identity when nothing matches.
    pub(super) fn rotation(
        self,
        estimate: &Track<'_>,
        reference: &Track<'_>,
    ) -> Quaternion<Nav, Nav> {
        match self {
            Align::None => Quaternion::identity(),
            Align::First => first(estimate, reference),
            Align::FirstHeading => {
                let [w, _, _, z] = first(estimate, reference).wxyz();
                let size = w.hypot(z);
                if size > 0.0 {
                    Quaternion::assume_unit([w / size, 0.0, 0.0, z / size])
                } else {
                    Quaternion::identity()
                }
            }
            Align::Heading => mean_heading(&scatter(estimate, reference)),
            Align::Best => mean_rotation(scatter(estimate, reference)),
        }
    }
}

impl FromStr for Align {
    type Err = ParseAlignError;

    /// # Errors
    /// [`ParseAlignError`] for anything but the names of [`Align::ALL`].
    fn from_str(text: &str) -> Result<Align, ParseAlignError> {
        Align::ALL
            .into_iter()
            .find(|align| align.name() == text)
            .ok_or(ParseAlignError)
    }
}

impl fmt::Display for Align {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A text that names no alignment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ParseAlignError;

impl From<&ParseAlignError> for Diagnostic {
    fn from(error: &ParseAlignError) -> Diagnostic {
        let ParseAlignError = error;
        Diagnostic::new("no such alignment").help("none, first, first-heading, heading or best")
    }
}

impl fmt::Display for ParseAlignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for ParseAlignError {}

/// Alignment at the first match; the identity when there is none.
fn first(estimate: &Track<'_>, reference: &Track<'_>) -> Quaternion<Nav, Nav> {
    let mut first = Quaternion::identity();
    for_each_match(estimate, reference, |_, q_ref_est, _| {
        first = q_ref_est;
        ControlFlow::Break(())
    });
    first
}

/// Sum of `d d^T` over the matches: blind to the sign of each quaternion.
fn scatter(estimate: &Track<'_>, reference: &Track<'_>) -> Matrix4<f64> {
    let mut sum = Matrix4::zeros();
    for_each_match(estimate, reference, |_, q_ref_est, _| {
        let d = Vector4::from(q_ref_est.wxyz());
        sum += d * d.transpose();
        ControlFlow::Continue(())
    });
    sum
}

/// The quaternion mean: the eigenvector of the largest eigenvalue of the scatter matrix. It minimises
/// the sum of squared matrix differences, `sum 8 sin^2(angle/2)`: least squares of the angle while
/// the angles are small, and kinder to outliers.
///
/// # Source
/// Markley, Cheng, Crassidis, Oshman, "Averaging quaternions", JGCD 30(4), 2007, eqs. 12-13.
fn mean_rotation(scatter: Matrix4<f64>) -> Quaternion<Nav, Nav> {
    // Bounded, and the matrix is finite: it sums products of unit quaternions.
    let Some(eigen) = SymmetricEigen::try_new(scatter, f64::EPSILON, 1000) else {
        return Quaternion::identity();
    };
    let v = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    let q = Quaternion::try_from_wxyz([v[0], v[1], v[2], v[3]]).unwrap_or(Quaternion::identity());
    q.same_sign_as(&Quaternion::identity())
}

/// The same mean among turns about z: largest `sum (w cos(h/2) + z sin(h/2))^2`.
fn mean_heading(scatter: &Matrix4<f64>) -> Quaternion<Nav, Nav> {
    let (ww, zz, wz) = (scatter[(0, 0)], scatter[(3, 3)], scatter[(0, 3)]);
    let half = 0.5 * (2.0 * wz).atan2(ww - zz);
    Quaternion::assume_unit([half.cos(), 0.0, 0.0, half.sin()])
}
