//! Body velocities -> Coriolis and centripetal forces, momentum, energy, accelerations. Pure.
//!
//! The vector `C(nu) nu` is the primary result: it is unique, while the matrix C is not. The three
//! matrices below differ entry by entry and agree in that product.

use super::validity::{self, SLACK};
use super::{InertiaError, RigidBody, skew};
use nalgebra::{Cholesky, Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

/// Form of the matrix C(nu), of several equivalent ones.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CoriolisForm {
    /// `[0, -S(p); -S(p), -S(h)]` with `[p; h] = M nu` (Fossen, theorem 3.2; Kirchhoff). The only
    /// one that also serves added mass.
    FromMassMatrix,
    /// `[m S(w), -m S(w) S(r); m S(r) S(w), -S(I_O w)]`: free of the linear velocity, as wanted
    /// where that is the velocity through a current.
    LinearVelocityFree,
    /// `H^T blkdiag(m S(w), -S(I_cg w)) H`: as MSS `rbody.m`.
    FromCentreOfGravity,
}

fn halves(x: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        Vector3::new(x[0], x[1], x[2]),
        Vector3::new(x[3], x[4], x[5]),
    )
}

fn joined(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

fn blocks(a: &Matrix3<f64>, b: &Matrix3<f64>, c: &Matrix3<f64>, d: &Matrix3<f64>) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    m.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    m.fixed_view_mut::<3, 3>(3, 0).copy_from(c);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(d);
    m
}

/// C(nu) of any symmetric mass matrix, rigid or added: [`CoriolisForm::FromMassMatrix`].
#[must_use]
fn coriolis_from_mass_matrix(m: &Matrix6<f64>, nu: &Vector6<f64>) -> Matrix6<f64> {
    let (p, h) = halves(&(m * nu));
    blocks(&Matrix3::zeros(), &-skew(&p), &-skew(&p), &-skew(&h))
}

impl RigidBody {
    /// `C(nu) nu`: the force in N and moment about O in N m that a body at constant body-axes
    /// velocity needs, on top of `M nu_dot`.
    #[must_use]
    pub fn coriolis(&self, nu: &Vector6<f64>) -> Vector6<f64> {
        let (v, w) = halves(nu);
        let r = self.r_og_b();
        let f = self.mass() * (w.cross(&v) + w.cross(&w.cross(&r)));
        let n = w.cross(&(self.inertia_cg() * w)) + r.cross(&f);
        joined(&f, &n)
    }

    /// The matrix C(nu) in the named form; all forms are skew and have the same product with nu.
    #[must_use]
    pub fn coriolis_matrix(&self, form: CoriolisForm, nu: &Vector6<f64>) -> Matrix6<f64> {
        let (_, w) = halves(nu);
        let (m, sw, sr) = (self.mass(), skew(&w), skew(&self.r_og_b()));
        match form {
            CoriolisForm::FromMassMatrix => coriolis_from_mass_matrix(&self.mass_matrix(), nu),
            CoriolisForm::LinearVelocityFree => blocks(
                &(m * sw),
                &(-m * sw * sr),
                &(m * sr * sw),
                &-skew(&(self.inertia_at_origin() * w)),
            ),
            CoriolisForm::FromCentreOfGravity => {
                // H^T blkdiag(..) H written out: the full products would cost six times as much.
                let a = m * sw;
                let d = -skew(&(self.inertia_cg() * w)) - m * sr * sw * sr;
                blocks(&a, &(-m * sw * sr), &(m * sr * sw), &d)
            }
        }
    }

    /// Linear and angular momentum about O, `M nu`, in body axes.
    #[must_use]
    pub fn momentum(&self, nu: &Vector6<f64>) -> Vector6<f64> {
        let (v, w) = halves(nu);
        let r = self.r_og_b();
        let p = self.mass() * (v + w.cross(&r));
        joined(&p, &(self.inertia_cg() * w + r.cross(&p)))
    }

    /// Kinetic energy in J: that of the centre of gravity plus that about it.
    #[must_use]
    pub fn kinetic_energy(&self, nu: &Vector6<f64>) -> f64 {
        let (v, w) = halves(nu);
        let v_g = v + w.cross(&self.r_og_b());
        0.5 * (self.mass() * v_g.norm_squared() + w.dot(&(self.inertia_cg() * w)))
    }

    /// `nu_dot` in body axes from `M nu_dot + C(nu) nu = tau`, `tau` applied at O.
    ///
    /// The document's `M nu_dot = tau` holds only at rest (erratum I6).
    ///
    /// # Errors
    /// [`InertiaError::NotInvertible`] when the tensor is too near singular to solve with.
    pub fn acceleration(
        &self,
        nu: &Vector6<f64>,
        tau: &Vector6<f64>,
    ) -> Result<Vector6<f64>, InertiaError> {
        let (v, w) = halves(nu);
        let (f, n) = halves(tau);
        let (r, inertia) = (self.r_og_b(), self.inertia_cg());
        let about_g = n - r.cross(&f) - w.cross(&(inertia * w));
        let w_dot = Cholesky::new(inertia)
            .ok_or(InertiaError::NotInvertible)?
            .solve(&about_g);
        let v_dot = f / self.mass() - w.cross(&v) - w_dot.cross(&r) - w.cross(&w.cross(&r));
        Ok(joined(&v_dot, &w_dot))
    }
}

/// Added mass M_A of a body in an ideal fluid: symmetric and positive semidefinite, kg, kg m, kg m^2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AddedMass(Matrix6<f64>);

impl AddedMass {
    /// Checks and keeps the matrix.
    ///
    /// # Errors
    /// [`InertiaError::NotFinite`], [`InertiaError::NotSymmetric`] beyond 1e-12 of the largest entry,
    /// [`InertiaError::NotInvertible`] when an eigenvalue is below zero by more than that.
    pub fn new(m_a: Matrix6<f64>) -> Result<Self, InertiaError> {
        validity::finite("added mass", m_a.norm_squared())?;
        let allowed = SLACK * m_a.amax();
        let m = validity::symmetric(&m_a, allowed)?;
        let smallest = SymmetricEigen::try_new(m, f64::EPSILON, 1000)
            .map_or(f64::NAN, |e| e.eigenvalues.min());
        if smallest >= -allowed {
            Ok(Self(m))
        } else {
            Err(InertiaError::NotInvertible)
        }
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Matrix6<f64> {
        &self.0
    }

    /// `C_A(nu) nu`.
    #[must_use]
    pub fn coriolis(&self, nu: &Vector6<f64>) -> Vector6<f64> {
        let (v, w) = halves(nu);
        let (p, h) = halves(&(self.0 * nu));
        joined(&w.cross(&p), &(v.cross(&p) + w.cross(&h)))
    }

    /// `nu_dot` of a body that carries this fluid along:
    /// `(M_RB + M_A) nu_dot = tau - (C_RB + C_A) nu`, by Cholesky.
    ///
    /// # Errors
    /// [`InertiaError::NotInvertible`] when the sum is not positive definite to rounding.
    pub fn acceleration(
        &self,
        body: &RigidBody,
        nu: &Vector6<f64>,
        tau: &Vector6<f64>,
    ) -> Result<Vector6<f64>, InertiaError> {
        let rest = tau - body.coriolis(nu) - self.coriolis(nu);
        Ok(Cholesky::new(body.mass_matrix() + self.0)
            .ok_or(InertiaError::NotInvertible)?
            .solve(&rest))
    }
}
