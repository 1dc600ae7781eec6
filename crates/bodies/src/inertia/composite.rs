//! Several bodies -> one ("CG corrected"), payload added or taken away. Pure.
//!
//! When the load changes, mass and tensor change with the centre of gravity (erratum I11: the seed
//! recomputes r_G alone).

use super::spatial::parallel_axes;
use super::{InertiaError, RigidBody};
use nalgebra::{Matrix3, Vector3};

impl RigidBody {
    /// The bodies welded together, all given from the same origin in the same axes.
    ///
    /// # Errors
    /// [`InertiaError::NoBodies`] for an empty slice; [`InertiaError::NotFinite`] when sums overflow.
    pub fn combined(bodies: &[RigidBody]) -> Result<Self, InertiaError> {
        if bodies.is_empty() {
            return Err(InertiaError::NoBodies);
        }
        let mass: f64 = bodies.iter().map(RigidBody::mass).sum();
        let first: Vector3<f64> = bodies.iter().map(|b| b.r_og_b() * b.mass()).sum();
        let r = first / mass;
        // About the common centre of gravity, not about O: nothing large is subtracted.
        let tensor: Matrix3<f64> = bodies
            .iter()
            .map(|b| b.inertia_cg() + parallel_axes(b.mass(), &(b.r_og_b() - r)))
            .sum();
        Self::new(mass, r, tensor)
    }

    /// Returns the body with a payload welded on.
    ///
    /// # Errors
    /// As [`RigidBody::combined`].
    pub fn with_payload(&self, payload: &RigidBody) -> Result<Self, InertiaError> {
        Self::combined(&[*self, *payload])
    }

    /// Returns the body with a point mass in kg at `r_op_b` (from O, m): not a body by itself, but part of one.
    ///
    /// # Errors
    /// [`InertiaError::MassNotPositive`] unless the point mass is above zero.
    pub fn with_point_mass(&self, mass: f64, r_op_b: Vector3<f64>) -> Result<Self, InertiaError> {
        if mass <= 0.0 {
            return Err(InertiaError::MassNotPositive { mass });
        }
        let total = self.mass() + mass;
        let arm = r_op_b - self.r_og_b();
        // Two centres of gravity a distance apart act as their reduced mass.
        let reduced = self.mass() / total * mass;
        Self::new(
            total,
            self.r_og_b() + arm * (mass / total),
            self.inertia_cg() + parallel_axes(reduced, &arm),
        )
    }

    /// Returns the body without a payload that was part of it.
    ///
    /// # Errors
    /// What is left must be physical: [`InertiaError::MassNotPositive`],
    /// [`InertiaError::NotPositive`] or [`InertiaError::TriangleInequality`] when the payload can
    /// not have been part of this body.
    pub fn without_payload(&self, payload: &RigidBody) -> Result<Self, InertiaError> {
        let mass = self.mass() - payload.mass();
        if mass <= 0.0 {
            return Err(InertiaError::MassNotPositive { mass });
        }
        let r = (self.r_og_b() * self.mass() - payload.r_og_b() * payload.mass()) / mass;
        let tensor = self.inertia_cg()
            - payload.inertia_cg()
            - parallel_axes(payload.mass(), &(payload.r_og_b() - self.r_og_b()))
            - parallel_axes(mass, &(r - self.r_og_b()));
        Self::new(mass, r, tensor)
    }
}
