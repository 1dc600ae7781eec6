//! 3-vectors and tensors -> 6x6 matrices at CG and CO, and back. Pure.

use super::validity;
use super::{InertiaError, RigidBody};
use nalgebra::{Matrix3, Matrix6, Vector3};

/// S(r), the cross product as a matrix: `S(r) a = r x a`.
#[must_use]
pub fn skew(r: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -r.z, r.y, r.z, 0.0, -r.x, -r.y, r.x, 0.0)
}

/// H(r) = `[1, -S(r); 0, 1]`: velocities of O become velocities of the point P at r,
/// `nu_P = H(r) nu_O`; wrenches go the other way with the transpose; the inverse is H(-r).
#[must_use]
pub fn system_transform(r: &Vector3<f64>) -> Matrix6<f64> {
    let mut h = Matrix6::identity();
    h.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(r));
    h
}

/// `m S(r)^T S(r)`, what the parallel axes add.
pub(super) fn parallel_axes(mass: f64, r: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * mass
}

/// CG -> CO: `M_CO = H(r)^T M_CG H(r)`, `r` from O to G.
#[must_use]
pub fn mass_matrix_at_origin(m_cg: &Matrix6<f64>, r_og_b: &Vector3<f64>) -> Matrix6<f64> {
    let h = system_transform(r_og_b);
    h.transpose() * m_cg * h
}

/// CO -> CG: `M_CG = H(-r)^T M_CO H(-r)`, `r` from O to G.
///
/// # Accuracy
/// Relative error of the tensor about `eps m r^2 / I_cg`.
#[must_use]
pub fn mass_matrix_at_cg(m_co: &Matrix6<f64>, r_og_b: &Vector3<f64>) -> Matrix6<f64> {
    mass_matrix_at_origin(m_co, &-r_og_b)
}

/// The mass matrix resolved in other axes: `diag(C, C) M diag(C, C)^T` with `c_ab` from b to a.
///
/// # Errors
/// [`InertiaError::NotRotation`] when `c_ab` is not one.
pub fn rotated_mass_matrix(
    m: &Matrix6<f64>,
    c_ab: &Matrix3<f64>,
) -> Result<Matrix6<f64>, InertiaError> {
    validity::rotation(c_ab)?;
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(c_ab);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(c_ab);
    Ok(both * m * both.transpose())
}

/// Result of [`RigidBody::from_mass_matrix`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Decomposition {
    /// The body whose mass matrix it is.
    pub body: RigidBody,
    /// Estimated relative error of its inertia tensor, `eps (1 + m r^2 / smallest moment)`: the
    /// parallel axes' share has been subtracted from numbers that contained it.
    pub relative_error: f64,
}

impl RigidBody {
    /// The mass matrix about the centre of gravity, `blkdiag(m 1, I_cg)`.
    #[must_use]
    pub fn mass_matrix_cg(&self) -> Matrix6<f64> {
        let mut m = Matrix6::zeros();
        m.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(Matrix3::identity() * self.mass()));
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.inertia_cg());
        m
    }

    /// The mass matrix about the origin, M_RB at CO: `[m 1, -m S(r); m S(r), I_O]`.
    #[must_use]
    pub fn mass_matrix(&self) -> Matrix6<f64> {
        let first = skew(&self.r_og_b()) * self.mass();
        let mut m = self.mass_matrix_cg();
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&-first);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&first);
        m.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&self.inertia_at_origin());
        m
    }

    /// Takes a rigid body's mass matrix at CO apart into mass, centre of gravity and tensor.
    ///
    /// # Errors
    /// [`InertiaError::NotRigidMassMatrix`] when the blocks do not have the form (1e-9 of the largest
    /// entry allowed), and everything [`RigidBody::new`] refuses.
    pub fn from_mass_matrix(m_co: &Matrix6<f64>) -> Result<Decomposition, InertiaError> {
        validity::finite("mass matrix", m_co.norm_squared())?;
        let allowed = 1e-9 * m_co.amax();
        let block = |row, column| Matrix3::from(m_co.fixed_view::<3, 3>(row, column));
        let (m11, m12, m21, m22) = (block(0, 0), block(0, 3), block(3, 0), block(3, 3));
        let mass = m11.trace() / 3.0;
        let checks = [
            (
                "upper left block is not m times the identity",
                m11 - Matrix3::identity() * mass,
            ),
            (
                "upper right block is not the transpose of the lower left",
                m12 - m21.transpose(),
            ),
            ("lower left block is not skew", m21 + m21.transpose()),
            ("lower right block is not symmetric", m22 - m22.transpose()),
        ];
        for (what, difference) in checks {
            let defect = difference.amax();
            if defect > allowed {
                return Err(InertiaError::NotRigidMassMatrix {
                    what,
                    defect,
                    allowed,
                });
            }
        }
        if mass <= 0.0 {
            return Err(InertiaError::MassNotPositive { mass });
        }
        // Each component appears four times; their mean is the least-squares answer.
        let s = (m21 - m12 - (m21 - m12).transpose()) * (0.25 / mass);
        let r = Vector3::new(s[(2, 1)], s[(0, 2)], s[(1, 0)]);
        let inertia_o = 0.5 * (m22 + m22.transpose());
        let body = RigidBody::from_inertia_at_origin(mass, r, inertia_o)?;
        let smallest = body.principal_moments()[0];
        Ok(Decomposition {
            body,
            relative_error: f64::EPSILON * (1.0 + mass * r.norm_squared() / smallest),
        })
    }
}
