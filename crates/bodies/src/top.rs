//! A symmetric top, a case and a spin -> its motion by four methods, one of them exact. Pure.
//!
//! A stage of its own because the top is the hardest easy motion there is: it turns fast, it wobbles,
//! and its solution is known. It is the source document's own test of attitude integration.
//!
//! # Convention
//! Pivot O, axis of symmetry z, centre of gravity at `arm` along it. Navigation z is up, gravity
//! `(0, 0, -g)`. Attitude by z-x'-z'' angles, `C_nb = Rz(precession) Rx(nutation) Rz(spin)`;
//! `w3 = precession_rate cos(nutation) + spin_rate` is the body rate about z and stays constant.
//!
//! | method | what it does |
//! |---|---|
//! | live ([`TopMethod::Live`], A) | the document's simulation: torque held over a step, RK4, one rotation |
//! | Euler angles ([`TopMethod::EulerAngles`], B) | the differential equation of the angles (Hasbun); singular upright and hanging |
//! | gyro ([`TopMethod::Gyro`], C) | rates sampled from B, one rotation a sample: what a gyro user does |
//! | exact ([`SymmetricTop::exact`], D) | power series in 32 digits ([`HeavyBody`]); proven by [`ClosedForm`] |
//!
//! # Source
//! Goldstein, Classical Mechanics, 2nd ed., 5-7 (eq. 5-77: steady precession; 4-125: body rates).
//! The source document's errata are in `docs/top.md`, each with the test that shows it.

mod case;
mod closed_form;
mod compare;
mod error;
mod euler_angles;
pub mod method_errors;

pub use case::Case;
pub use closed_form::ClosedForm;
pub use compare::{MethodError, TopMethod, TopRun, compare};
pub use error::TopError;
pub use euler_angles::{EulerAngles, EulerState};

use super::inertia::{InertiaError, RigidBody};
use super::rigid_body::{HeavyBody, Rotor};
use nalgebra::{Matrix3, Vector3};

/// A symmetric top on a fixed pivot. SI.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SymmetricTop {
    mass: f64,
    arm: f64,
    transverse: f64,
    axial: f64,
    gravity: f64,
}

impl SymmetricTop {
    /// Mass in kg, distance pivot to centre of gravity in m, moments of inertia **about the pivot**
    /// across and along the axis in kg m^2, gravity in m/s^2 downwards (zero: a free top).
    ///
    /// # Errors
    /// [`TopError::OutOfRange`] unless mass and moments are positive, arm and gravity not negative.
    pub fn new(
        mass: f64,
        arm: f64,
        transverse: f64,
        axial: f64,
        gravity: f64,
    ) -> Result<Self, TopError> {
        for (what, value) in [
            ("mass", mass),
            ("transverse moment of inertia", transverse),
            ("axial moment of inertia", axial),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(TopError::OutOfRange { what, value });
            }
        }
        for (what, value) in [
            ("arm", arm),
            ("gravity", gravity),
            ("torque of gravity", mass * gravity * arm),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(TopError::OutOfRange { what, value });
            }
        }
        Ok(Self {
            mass,
            arm,
            transverse,
            axial,
            gravity,
        })
    }

    /// The source document's top: 1 kg, 4 cm, 0.002 and 0.0008 kg m^2, 9.8 m/s^2.
    #[must_use]
    pub fn published() -> Self {
        Self {
            mass: 1.0,
            arm: 0.04,
            transverse: 0.002,
            axial: 0.0008,
            gravity: 9.8,
        }
    }

    /// Makes it from a rigid body whose origin is the pivot and whose z is the axis of symmetry.
    ///
    /// # Errors
    /// [`TopError::NotATop`] when it is not, beyond 1e-9 of its largest moment.
    pub fn from_body(body: &RigidBody, gravity: f64) -> Result<Self, TopError> {
        let j = body.inertia_at_origin();
        let r = body.r_og_b();
        let transverse = 0.5 * (j[(0, 0)] + j[(1, 1)]);
        let off = r.xy().norm() * body.mass();
        let defect = [
            j[(0, 0)] - j[(1, 1)],
            j[(0, 1)],
            j[(0, 2)],
            j[(1, 2)],
            off * r.norm(),
        ]
        .iter()
        .fold(0.0_f64, |m, x| m.max(x.abs()));
        if defect > 1e-9 * j.amax() {
            return Err(TopError::NotATop { defect });
        }
        Self::new(body.mass(), r.z, transverse, j[(2, 2)], gravity)
    }

    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }
    /// Pivot to centre of gravity, m.
    #[must_use]
    pub fn arm(&self) -> f64 {
        self.arm
    }
    /// Moment of inertia about a horizontal axis through the pivot, kg m^2.
    #[must_use]
    pub fn transverse(&self) -> f64 {
        self.transverse
    }
    /// Moment of inertia about the axis of symmetry, kg m^2.
    #[must_use]
    pub fn axial(&self) -> f64 {
        self.axial
    }
    /// Gravity, m/s^2, downwards.
    #[must_use]
    pub fn gravity(&self) -> f64 {
        self.gravity
    }

    /// Largest torque of gravity, `M g arm`, N m.
    #[must_use]
    pub(crate) fn largest_torque(&self) -> f64 {
        self.mass * self.gravity * self.arm
    }

    /// The slow and the fast rate in rad/s at which the top precesses without nutation: the roots of
    /// `I1 cos(nutation) p^2 - I3 w3 p + M g arm = 0`. At nutation 90 degrees the fast one is infinite.
    ///
    /// # Errors
    /// [`TopError::NoSteadyPrecession`] when the spin is too slow.
    ///
    /// # Source
    /// Seed document eq. 21; Goldstein eq. 5-77.
    pub fn steady_precession(&self, nutation: f64, w3: f64) -> Result<(f64, f64), TopError> {
        let a = self.transverse * nutation.cos();
        let b = self.axial * w3;
        let c = self.largest_torque();
        let discriminant = b * b - 4.0 * a * c;
        let real = discriminant >= 0.0;
        if !real {
            return Err(TopError::NoSteadyPrecession {
                w3,
                needed: 2.0 * (a * c).sqrt() / self.axial,
            });
        }
        // The sum of two numbers of one sign: the slow root loses no digits.
        let q = 0.5 * (b + b.signum() * discriminant.sqrt());
        if q == 0.0 {
            return Err(TopError::NoSteadyPrecession { w3, needed: 0.0 });
        }
        Ok((c / q, q / a))
    }

    /// The spin frequency in Hz that the top must exceed by far to precess at all (the document's eq. 25):
    /// `sqrt(M g arm sin(nutation) / (2 pi I3))`. An order of magnitude, not a border.
    #[must_use]
    pub fn spin_threshold_hz(&self, nutation: f64) -> f64 {
        (self.largest_torque() * nutation.sin().abs() / (std::f64::consts::TAU * self.axial)).sqrt()
    }

    /// The body rate about the axis in rad/s above which an upright top sleeps:
    /// `I3^2 w3^2 > 4 I1 M g arm`.
    #[must_use]
    pub fn sleeping_threshold(&self) -> f64 {
        2.0 * (self.transverse * self.largest_torque()).sqrt() / self.axial
    }

    /// Inertia about the pivot.
    ///
    /// # Errors
    /// [`InertiaError`] for moments so far apart that their matrix cannot be inverted.
    pub fn rotor(&self) -> Result<Rotor, InertiaError> {
        Rotor::new(Matrix3::from_diagonal(&Vector3::new(
            self.transverse,
            self.transverse,
            self.axial,
        )))
    }

    /// The exact motion from a start (method D).
    ///
    /// # Errors
    /// [`TopError::OutOfRange`] for numbers out of all proportion ([`HeavyBody::new`]).
    pub fn exact(&self, start: &EulerState) -> Result<HeavyBody, TopError> {
        Ok(HeavyBody::new(
            self.rotor()?,
            Vector3::new(0.0, 0.0, self.mass * self.arm),
            Vector3::new(0.0, 0.0, -self.gravity),
            start.spin(),
        )?)
    }
}
