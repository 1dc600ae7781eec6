//! Numbers -> physical mass properties, or the reason why not. Pure.

use nalgebra::{Matrix3, SMatrix, SymmetricEigen, Vector3};
use std::fmt;

/// Relative slack for what rounding does to six numbers that were once exact.
pub(super) const SLACK: f64 = 1e-12;

/// Why no arrangement of matter has these mass properties, or a mass matrix is not one.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum InertiaError {
    /// NaN, infinity, or numbers so large that their products are.
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
    },
    /// Mass zero or below.
    MassNotPositive {
        /// Mass as given, kg.
        mass: f64,
    },
    /// The tensor differs from its transpose.
    NotSymmetric {
        /// Row of the worst entry, from 0.
        row: usize,
        /// Column of the worst entry, from 0.
        column: usize,
        /// Difference between the entry and its mirror image.
        difference: f64,
        /// Largest difference taken for rounding.
        allowed: f64,
    },
    /// A principal moment is zero or below.
    NotPositive {
        /// Principal moments, ascending, kg m^2.
        moments: [f64; 3],
    },
    /// A principal moment is above the sum of the other two: no matter is spread like that.
    TriangleInequality {
        /// Principal moments, ascending, kg m^2.
        moments: [f64; 3],
    },
    /// A matrix given as a rotation is not orthonormal and right-handed.
    NotRotation {
        /// Largest entry of `C C^T - 1`, or 2 for a mirror image.
        defect: f64,
    },
    /// A 6x6 matrix is not of the form `[m 1, -m S(r); m S(r), I_O]`.
    NotRigidMassMatrix {
        /// Name of the block, and the property it lacks.
        what: &'static str,
        /// Size of the defect.
        defect: f64,
        /// Largest defect taken for rounding.
        allowed: f64,
    },
    /// A mass matrix (with added mass) is not positive definite, so nothing can be solved with it.
    NotInvertible,
    /// A composite of no bodies.
    NoBodies,
}

impl fmt::Display for InertiaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { what } => write!(f, "{what} is not a finite number"),
            Self::MassNotPositive { mass } => write!(f, "mass {mass} kg is not positive"),
            Self::NotSymmetric {
                row,
                column,
                difference,
                allowed,
            } => write!(
                f,
                "matrix not symmetric: entries ({r},{c}) and ({c},{r}) differ by {difference:e}, {allowed:e} allowed",
                r = row + 1,
                c = column + 1
            ),
            Self::NotPositive { moments: [a, b, c] } => write!(
                f,
                "principal moments {a}, {b}, {c}: the smallest must be above zero"
            ),
            Self::TriangleInequality { moments: [a, b, c] } => write!(
                f,
                "principal moments {a}, {b}, {c}: the largest exceeds the sum of the others ({}), which no matter can",
                a + b
            ),
            Self::NotRotation { defect } => write!(
                f,
                "not a rotation matrix: orthonormal to {defect:e} only (1e-9 allowed), or left-handed"
            ),
            Self::NotRigidMassMatrix {
                what,
                defect,
                allowed,
            } => write!(
                f,
                "not the mass matrix of a rigid body: {what} by {defect:e}, {allowed:e} allowed"
            ),
            Self::NotInvertible => write!(f, "mass matrix not positive definite"),
            Self::NoBodies => write!(f, "a composite needs at least one body"),
        }
    }
}

impl std::error::Error for InertiaError {}

pub(super) fn finite(what: &'static str, x: f64) -> Result<(), InertiaError> {
    if x.is_finite() {
        Ok(())
    } else {
        Err(InertiaError::NotFinite { what })
    }
}

/// The matrix, exactly symmetric: the mean of both halves, where they differ by no more than `allowed`.
pub(crate) fn symmetric<const N: usize>(
    m: &SMatrix<f64, N, N>,
    allowed: f64,
) -> Result<SMatrix<f64, N, N>, InertiaError> {
    for row in 0..N {
        for column in row + 1..N {
            let difference = m[(row, column)] - m[(column, row)];
            if difference.abs() > allowed {
                return Err(InertiaError::NotSymmetric {
                    row,
                    column,
                    difference,
                    allowed,
                });
            }
        }
    }
    Ok(0.5 * (m + m.transpose()))
}

/// The tensor, exactly symmetric, when everything about it is physical.
pub(super) fn physical(
    mass: f64,
    r_og_b: &Vector3<f64>,
    inertia_cg: &Matrix3<f64>,
) -> Result<Matrix3<f64>, InertiaError> {
    finite("mass", mass)?;
    if mass <= 0.0 {
        return Err(InertiaError::MassNotPositive { mass });
    }
    finite("centre of gravity", r_og_b.norm_squared() * mass)?;
    // Squares too: an overflow further on would come out as NaN.
    finite("inertia tensor", inertia_cg.norm_squared())?;
    let scale = inertia_cg.amax();
    let allowed = SLACK * scale;
    let tensor = symmetric(inertia_cg, allowed)?;
    let moments = principal_moments(&tensor);
    let [a, b, c] = moments;
    // Zero to rounding is zero: a rod without thickness cannot be spun up about itself.
    if a.is_nan() || a <= allowed * 1e-3 {
        return Err(InertiaError::NotPositive { moments });
    }
    if c > (a + b) * (1.0 + SLACK) {
        return Err(InertiaError::TriangleInequality { moments });
    }
    Ok(tensor)
}

/// Eigenvalues of a symmetric, finite tensor, ascending. NaN when the iteration does not end.
pub(super) fn principal_moments(tensor: &Matrix3<f64>) -> [f64; 3] {
    // The bound on sweeps is far above the two or three it takes.
    let Some(eigen) = SymmetricEigen::try_new(*tensor, f64::EPSILON, 1000) else {
        return [f64::NAN; 3];
    };
    let mut m = [
        eigen.eigenvalues.x,
        eigen.eigenvalues.y,
        eigen.eigenvalues.z,
    ];
    m.sort_by(f64::total_cmp);
    m
}

pub(super) fn rotation(c: &Matrix3<f64>) -> Result<(), InertiaError> {
    let gram = (c * c.transpose() - Matrix3::identity()).amax();
    let mirror = c.determinant() < 0.0;
    let defect = if mirror { gram.max(2.0) } else { gram };
    // The other way round would let NaN pass.
    if defect <= 1e-9 {
        Ok(())
    } else {
        Err(InertiaError::NotRotation { defect })
    }
}
