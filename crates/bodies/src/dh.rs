//! Joint angles -> poses and motions of a chain of links. Pure.
//!
//! A stage of its own because an arm is read wrongly in two places: which Denavit-Hartenberg
//! convention its table means, and relative to what a velocity is. The first is fixed here
//! (*standard*, also called distal; erratum Y20), the second is in the types.
//!
//! # Convention
//! Link i has its frame at its far end: z_(i-1) is the axis of joint i, x_i is perpendicular to
//! z_(i-1) and meets it. `(i-1)A(i) = Rz(theta) Tz(d) Tx(a) Rx(alpha)`.
//!
//! # Source
//! Denavit, Hartenberg 1955; the source document's (2.1)-(2.5), appendices A and B. Modified
//! (proximal) tables, such as that of Zhang, Li, Xiao 2015, do not fit.
//!
//! ```
//! use strapd_bodies::dh::{DhLink, Transform};
//! enum Base {}
//! enum Wrist {}
//! enum Tool {}
//! # use std::f64::consts::FRAC_PI_2;
//! let t_base_wrist: Transform<Base, Wrist> = DhLink::new(0.3, 0.0, 0.0, 0.0).transform(FRAC_PI_2);
//! let t_wrist_tool: Transform<Wrist, Tool> = DhLink::new(0.1, 0.0, 0.0, 0.0).transform(0.0);
//! let t_base_tool = t_base_wrist * t_wrist_tool; // inner names cancel
//! assert!((t_base_tool.translation().as_vector().y - 0.4).abs() < 1e-15);
//! ```
//! The wrong order does not compile:
//! ```compile_fail,E0277
//! use strapd_bodies::dh::Transform;
//! enum Base {}
//! enum Wrist {}
//! enum Tool {}
//! let t_base_wrist = Transform::<Base, Wrist>::identity();
//! let t_wrist_tool = Transform::<Wrist, Tool>::identity();
//! let wrong = t_wrist_tool * t_base_wrist;
//! ```

mod relative;
mod transform;
mod tree;

pub use relative::RelativeMotion;
pub use transform::{Transform, TransformError};
pub use tree::{Asked, Child, FrameTree, FrameTreeError, Parent, Question, Root};

use nalgebra::{Matrix3, Vector3};
use strapd_attitude::frames::{Dcm, In};

/// One link with a revolute joint, by its standard Denavit-Hartenberg parameters.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DhLink {
    a: f64,
    d: f64,
    theta_offset: f64,
    sin_alpha: f64,
    cos_alpha: f64,
}

impl DhLink {
    /// Length `a` along x_i in m, twist `alpha` about x_i in rad, offset `d` along z_(i-1) in m, and
    /// what is added to the joint angle, `theta = q + theta_offset`, in rad.
    #[must_use]
    pub fn new(a: f64, alpha: f64, d: f64, theta_offset: f64) -> Self {
        let (sin_alpha, cos_alpha) = alpha.sin_cos();
        // The f64 next to pi/2 has a cosine of 6e-17: a quarter turn was meant.
        let cos_alpha = if cos_alpha.abs() < 1e-16 {
            0.0
        } else {
            cos_alpha
        };
        Self {
            a,
            d,
            theta_offset,
            sin_alpha,
            cos_alpha,
        }
    }

    /// Distance from z_(i-1) to z_i along x_i, m.
    #[must_use]
    pub fn a(&self) -> f64 {
        self.a
    }

    /// Distance from x_(i-1) to x_i along z_(i-1), m.
    #[must_use]
    pub fn d(&self) -> f64 {
        self.d
    }

    /// `theta = q + theta_offset`, rad.
    #[must_use]
    pub fn theta_offset(&self) -> f64 {
        self.theta_offset
    }

    /// Pose of the link's frame in the one before, (2.4), at joint angle `q` in rad.
    /// The caller says which two frames these are.
    #[must_use]
    pub fn transform<To, From>(&self, q: f64) -> Transform<To, From> {
        let (s, c) = (q + self.theta_offset).sin_cos();
        Transform::new(
            Dcm::assume(self.rotation(s, c)),
            In::assume(Vector3::new(self.a * c, self.a * s, self.d)),
        )
    }

    /// The rotation of (2.4) from sine and cosine of theta.
    pub(super) fn rotation(&self, s: f64, c: f64) -> Matrix3<f64> {
        let (sa, ca) = (self.sin_alpha, self.cos_alpha);
        Matrix3::new(c, -ca * s, sa * s, s, ca * c, -sa * c, 0.0, sa, ca)
    }

    /// `r_i = R_i^T p(A_i)`: from O_(i-1) to O_i, resolved in frame i. Does not depend on the joint.
    pub(super) fn reach(&self) -> Vector3<f64> {
        Vector3::new(self.a, self.d * self.sin_alpha, self.d * self.cos_alpha)
    }

    /// The joint's axis z_(i-1) resolved in frame i: `R_i^T z`.
    pub(super) fn axis(&self) -> Vector3<f64> {
        Vector3::new(0.0, self.sin_alpha, self.cos_alpha)
    }
}
