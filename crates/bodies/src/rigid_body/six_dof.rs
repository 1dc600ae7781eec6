//! A free body with mass, centre of gravity and perhaps added mass -> its path and attitude. Pure.
//!
//! All six degrees of freedom at the origin O of the body axes, so that the body's own
//! description ([`RigidBody`]) is used as it is. Without the Coriolis term of
//! `M nu_dot + C(nu) nu = tau` a free body gains momentum from nowhere (`crates/bodies/tests/bodies/inertia.rs`).

use super::integrator::{NotConverged, gauss_legendre6};
use crate::inertia::{AddedMass, InertiaError, RigidBody};
use nalgebra::{Cholesky, Matrix6, Vector3, Vector6};
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// Force in N and moment about O in N m, both in body axes: `[f; n]`.
pub type Wrench = Vector6<f64>;

/// Position of the origin O, attitude of the body, and how both change.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    /// Position of O, m, navigation axes.
    pub p_o_n: Vector3<f64>,
    /// Body to navigation.
    pub q_nb: Quaternion<Nav, Body>,
    /// `[v; w]`: velocity of O in m/s and body rate in rad/s, body axes.
    pub nu: Vector6<f64>,
}

/// A body ready to move: its mass matrix, fluid carried along included, is factored once.
#[derive(Clone, Debug)]
pub struct Vessel {
    body: RigidBody,
    added: Option<AddedMass>,
    total: Matrix6<f64>,
    factored: Cholesky<f64, nalgebra::U6>,
}

impl Vessel {
    /// A body in vacuum, or with the added mass of the fluid round it.
    ///
    /// # Errors
    /// [`InertiaError::NotInvertible`] when the mass matrix cannot be factored.
    pub fn new(body: RigidBody, added: Option<AddedMass>) -> Result<Self, InertiaError> {
        let total = added.map_or(body.mass_matrix(), |a| body.mass_matrix() + a.matrix());
        let factored = Cholesky::new(total).ok_or(InertiaError::NotInvertible)?;
        Ok(Self {
            body,
            added,
            total,
            factored,
        })
    }

    /// `nu_dot` under a wrench: `M^-1 (tau - C(nu) nu)`.
    #[must_use]
    pub fn acceleration(&self, nu: &Vector6<f64>, tau: &Wrench) -> Vector6<f64> {
        let fluid = self.added.map_or(Vector6::zeros(), |a| a.coriolis(nu));
        self.factored.solve(&(tau - self.body.coriolis(nu) - fluid))
    }

    /// Gravity as a wrench at O: it acts at the centre of gravity. `gravity_n` in m/s^2.
    #[must_use]
    pub fn weight(&self, pose: &Pose, gravity_n: &Vector3<f64>) -> Wrench {
        let f = quat::matrix(&pose.q_nb.wxyz()).transpose() * gravity_n * self.body.mass();
        let n = self.body.r_og_b().cross(&f);
        Wrench::new(f.x, f.y, f.z, n.x, n.y, n.z)
    }

    /// One step of `h` seconds by Gauss-Legendre collocation of order 6; `wrench(t, pose)` is what
    /// acts at O, in body axes.
    ///
    /// # Errors
    /// [`NotConverged`] when the step is too long for the motion or the wrench is not finite.
    pub fn step(
        &self,
        t: f64,
        pose: &Pose,
        h: f64,
        mut wrench: impl FnMut(f64, &Pose) -> Wrench,
    ) -> Result<Pose, NotConverged> {
        let mut derivative = |t: f64, y: &[f64; 13]| {
            let pose = unpack(y);
            let nu_dot = self.acceleration(&pose.nu, &wrench(t, &pose));
            let q = pose.q_nb.wxyz();
            let (v, w) = (Vector3::new(y[7], y[8], y[9]), [y[10], y[11], y[12]]);
            let p = quat::matrix(&q) * v;
            let q = quat::derivative(&q, &w);
            let mut d = [0.0; 13];
            d[..3].copy_from_slice(p.as_slice());
            d[3..7].copy_from_slice(&q);
            d[7..].copy_from_slice(nu_dot.as_slice());
            d
        };
        let mut next = unpack(&gauss_legendre6(&mut derivative, t, &pack(pose), h)?);
        next.q_nb = Quaternion::assume_unit(quat::normalised(&next.q_nb.wxyz()));
        Ok(next)
    }

    /// Linear momentum, and angular momentum about the navigation origin, both in navigation axes:
    /// constant while no wrench acts.
    #[must_use]
    pub fn momentum_n(&self, pose: &Pose) -> (Vector3<f64>, Vector3<f64>) {
        let c_nb = quat::matrix(&pose.q_nb.wxyz());
        let m = self.total * pose.nu;
        let p = c_nb * Vector3::new(m[0], m[1], m[2]);
        let h = c_nb * Vector3::new(m[3], m[4], m[5]);
        (p, h + pose.p_o_n.cross(&p))
    }

    /// Kinetic energy, J, of body and fluid.
    #[must_use]
    pub fn kinetic_energy(&self, nu: &Vector6<f64>) -> f64 {
        0.5 * nu.dot(&(self.total * nu))
    }
}

fn pack(pose: &Pose) -> [f64; 13] {
    let mut y = [0.0; 13];
    y[..3].copy_from_slice(pose.p_o_n.as_slice());
    y[3..7].copy_from_slice(&pose.q_nb.wxyz());
    y[7..].copy_from_slice(pose.nu.as_slice());
    y
}

fn unpack(y: &[f64; 13]) -> Pose {
    Pose {
        p_o_n: Vector3::new(y[0], y[1], y[2]),
        q_nb: Quaternion::assume_unit([y[3], y[4], y[5], y[6]]),
        nu: Vector6::new(y[7], y[8], y[9], y[10], y[11], y[12]),
    }
}
