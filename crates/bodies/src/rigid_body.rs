//! Inertia, torque, initial attitude and rate -> motion. Pure.
//!
//! A stage of its own because it is the gyro before the gyro: whatever turns here is what
//! `propagate` has to find again from rates alone. The top is one instance.
//!
//! # Convention
//! `q_nb` takes body to navigation components, the body rate `w_nb_b` is in rad/s in body axes,
//! torques are about the body's fixed point (or centre of gravity, when free) in body axes.
//! Euler's equations are `J w_dot = tau - w x (J w)`, for any symmetric J: the third component is
//! `(Iy - Ix) wx wy`, where the source document prints `(Ix - Iy)` (eq. 17), which a symmetric top can
//! not tell apart.
//!
//! # Methods
//! | [`Method`] | order | use |
//! |---|---|---|
//! | `HeldTorque(..)` | 1 | the source document's own scheme, for comparison |
//! | `Rk4` | 4 | comparison |
//! | `GaussLegendre6` | 6 | default for any torque; keeps the norm, energy and momentum of a free body to rounding |
//!
//! For gravity alone there is [`HeavyBody`], exact to rounding, at any instant.

mod heavy;
mod integrator;
mod six_dof;
mod taylor;

pub use heavy::HeavyBody;
pub use integrator::{HeldRate, Method, NotConverged};
pub(crate) use integrator::{gauss_legendre6, rk4};
pub use six_dof::{Pose, Vessel, Wrench};
pub(crate) use taylor::{Rates, Sine, Trajectory};

use super::inertia::{InertiaError, symmetric};
use nalgebra::{Cholesky, Matrix3, Vector3};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// Attitude and body rate at an instant.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spin {
    /// Body to navigation.
    pub q_nb: Quaternion<Nav, Body>,
    /// Body rate, rad/s.
    pub w_nb_b: Vector3<f64>,
}

/// An inertia tensor about the point the body turns about, ready for Euler's equations.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rotor {
    inertia: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl Rotor {
    /// Makes it from a symmetric positive definite tensor in kg m^2. Physical tensors come from
    /// [`super::inertia::RigidBody`]; this constructor also takes the idealised ones of text books.
    ///
    /// # Errors
    /// [`InertiaError::NotFinite`], [`InertiaError::NotSymmetric`], [`InertiaError::NotInvertible`].
    pub fn new(inertia: Matrix3<f64>) -> Result<Self, InertiaError> {
        if !inertia.norm_squared().is_finite() {
            return Err(InertiaError::NotFinite {
                what: "inertia tensor",
            });
        }
        let inertia = symmetric(&inertia, 1e-12 * inertia.amax())?;
        let inverse = Cholesky::new(inertia)
            .ok_or(InertiaError::NotInvertible)?
            .inverse();
        // The exact reference inverts in 32 digits, which end at 1e-290 and 1e290.
        let in_range = (1e-200..1e200).contains(&inertia.determinant());
        if !(in_range && inverse.norm_squared().is_finite()) {
            return Err(InertiaError::NotInvertible);
        }
        Ok(Self { inertia, inverse })
    }

    /// The tensor, kg m^2.
    #[must_use]
    pub fn inertia(&self) -> &Matrix3<f64> {
        &self.inertia
    }

    /// Inverse of the inertia tensor.
    #[must_use]
    pub fn inverse(&self) -> &Matrix3<f64> {
        &self.inverse
    }

    /// Rate of change of the body rate under a torque in N m, body axes, rad/s^2.
    #[must_use]
    pub fn angular_acceleration(&self, w: &Vector3<f64>, torque: &Vector3<f64>) -> Vector3<f64> {
        self.inverse * (torque - w.cross(&(self.inertia * w)))
    }

    /// Energy of rotation, J.
    #[must_use]
    pub fn kinetic_energy(&self, w: &Vector3<f64>) -> f64 {
        0.5 * w.dot(&(self.inertia * w))
    }

    /// Angular momentum in **navigation** axes, kg m^2/s: constant while no torque acts.
    #[must_use]
    pub fn angular_momentum_n(&self, spin: &Spin) -> Vector3<f64> {
        quat::matrix(&spin.q_nb.wxyz()) * (self.inertia * spin.w_nb_b)
    }

    /// One step of `h` seconds from time `t` under `torque(t, q_nb, w)` in N m, body axes.
    ///
    /// # Errors
    /// [`NotConverged`] from [`Method::GaussLegendre6`] when the step is so long that its equations
    /// have no fixed point to find (about half a turn), or the torque is not finite.
    pub fn step(
        &self,
        method: Method,
        t: f64,
        spin: &Spin,
        h: f64,
        mut torque: impl FnMut(f64, &Quaternion<Nav, Body>, &Vector3<f64>) -> Vector3<f64>,
    ) -> Result<Spin, NotConverged> {
        let mut derivative = |t: f64, y: &[f64; 7]| {
            let q = [y[0], y[1], y[2], y[3]];
            let w = Vector3::new(y[4], y[5], y[6]);
            let tau = torque(t, &Quaternion::assume_unit(q), &w);
            let a = self.angular_acceleration(&w, &tau);
            let d = quat::derivative(&q, &[w.x, w.y, w.z]);
            [d[0], d[1], d[2], d[3], a.x, a.y, a.z]
        };
        let q = spin.q_nb.wxyz();
        let w = spin.w_nb_b;
        let y = [q[0], q[1], q[2], q[3], w.x, w.y, w.z];
        let y = match method {
            Method::HeldTorque(rate) => {
                let held = torque(t, &spin.q_nb, &w);
                return Ok(self.step_with_held_torque(rate, spin, h, &held));
            }
            Method::Rk4 => rk4(&mut derivative, t, &y, h),
            Method::GaussLegendre6 => gauss_legendre6(&mut derivative, t, &y, h)?,
        };
        let q = quat::normalised(&[y[0], y[1], y[2], y[3]]);
        Ok(Spin {
            q_nb: Quaternion::assume_unit(q),
            w_nb_b: Vector3::new(y[4], y[5], y[6]),
        })
    }

    /// The document's program: RK4 on Euler's equations with the torque of the step's start held, then
    /// one rotation by a rate held over the step.
    fn step_with_held_torque(
        &self,
        rate: HeldRate,
        spin: &Spin,
        h: f64,
        held: &Vector3<f64>,
    ) -> Spin {
        let w0 = spin.w_nb_b;
        let mut euler = |_: f64, y: &[f64; 3]| {
            let a = self.angular_acceleration(&Vector3::from(*y), held);
            [a.x, a.y, a.z]
        };
        let w1 = Vector3::from(rk4(&mut euler, 0.0, &[w0.x, w0.y, w0.z], h));
        let phi = rate.of(&w0, &w1) * h;
        let q = quat::product(&spin.q_nb.wxyz(), &quat::exp(&phi));
        Spin {
            q_nb: Quaternion::assume_unit(quat::normalised(&q)),
            w_nb_b: w1,
        }
    }
}
