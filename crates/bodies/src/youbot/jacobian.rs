//! Joint rates <-> velocity of the gripper. Pure.

use super::error::bounded;
use super::forward::Planar;
use super::joints::{JOINTS, TableJoints, TableMotion};
use super::{Arm, ArmError, Base};
use nalgebra::{SMatrix, Vector3};
use std::fmt;
use strapd_attitude::frames::In;

/// Below this sine of the elbow, or this distance from the base axis and sine of the approach, joint
/// rates are not computed: a velocity of 1 mm/s would ask for a million rad/s.
const SINGULAR: f64 = 1e-9;

/// Configurations in which the five joints lose a direction. The first two are all there are,
/// `det(J^T J) = (a2 a3 sin th3)^2 (rho^2 + a_r^2)`; the third is a path's own.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum Singularity {
    /// Straight or folded.
    Elbow {
        /// Sine of the angle between forearm and upper arm.
        sine: f64,
    },
    /// The tool point on the base axis *and* the approach vertical. Either alone is not singular.
    Base {
        /// Distance from the axis (m) and sine of the approach's angle to the vertical, as one length.
        measure: f64,
    },
    /// A path of the gripper that gives theta1 by its tool point meets the base axis.
    Path {
        /// Distance from the axis, m.
        distance: f64,
    },
}

impl fmt::Display for Singularity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Elbow { sine } => {
                write!(f, "the elbow is straight or folded (sine {sine:.1e})")
            }
            Self::Base { measure } => write!(
                f,
                "the tool point is on the base axis with vertical approach (measure {measure:.1e})"
            ),
            Self::Path { distance } => write!(
                f,
                "the path meets the base axis (distance {distance:.1e} m), where joint 1 would jump"
            ),
        }
    }
}

/// Velocity of the tool point (m/s) and angular rate of the gripper (rad/s), relative to the base and
/// resolved in it. For accelerations: m/s^2 and rad/s^2.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Twist {
    /// Linear part.
    pub v: In<Base>,
    /// Angular part.
    pub w: In<Base>,
}

impl Arm {
    /// The Jacobian J: `[v; w] = J qd`, velocity of the tool point and rate of the gripper, relative to
    /// the base and resolved in it. Column i: `[z x (p - o); z]` of joint i.
    #[must_use]
    pub fn jacobian(&self, q: &TableJoints) -> SMatrix<f64, 6, JOINTS> {
        let k = self.planar(q);
        let p = self.parameters();
        let ((s1, c1), (s, c)) = (k.one, k.pitch);
        let [rho, z] = k.tool;
        let mut j = SMatrix::zeros();
        j[(0, 0)] = -rho * s1;
        j[(1, 0)] = rho * c1;
        j[(5, 0)] = 1.0;
        // Joints 2 to 4 turn in the arm's plane, about (s1, -c1, 0).
        for (column, [from_rho, from_z]) in [[p.a1, p.d1], k.elbow, k.wrist].into_iter().enumerate()
        {
            let column = column + 1;
            let (outwards, upwards) = (from_z - z, rho - from_rho);
            j[(0, column)] = outwards * c1;
            j[(1, column)] = outwards * s1;
            j[(2, column)] = upwards;
            j[(3, column)] = s1;
            j[(4, column)] = -c1;
        }
        // Joint 5 turns about the approach, through the tool point whatever a4 is.
        let approach = Vector3::new(c1 * s, s1 * s, -c);
        for row in 0..3 {
            j[(row + 3, 4)] = approach[row];
        }
        j
    }

    /// Distance from the two singularities: `|sin theta3|` of the elbow, and the base's distance of the
    /// tool point from the axis (m) and sine of the approach's tilt as one length. Zero is singular.
    #[must_use]
    pub fn singularity_measures(&self, q: &TableJoints) -> [f64; 2] {
        let k = self.planar(q);
        [self.sine_of_elbow(&k).abs(), k.tool[0].hypot(k.pitch.0)]
    }

    /// The unit vector `[v; w]` the arm cannot move along (left null vector of J).
    ///
    /// # Errors
    /// [`ArmError::Singular`] where the base axis is met with vertical approach: more than one is lost.
    pub fn lost_direction(&self, q: &TableJoints) -> Result<Twist, ArmError> {
        let k = self.planar(q);
        let ((s1, c1), (s, c)) = (k.one, k.pitch);
        let rho = k.tool[0];
        let measure = rho.hypot(s);
        if measure < SINGULAR {
            return Err(ArmError::Singular(Singularity::Base { measure }));
        }
        Ok(Twist {
            v: In::assume(Vector3::new(s * s1, -s * c1, 0.0) / measure),
            w: In::assume(Vector3::new(rho * c * c1, rho * c * s1, rho * s) / measure),
        })
    }

    /// A twist without its part along the lost direction, and that part (m/s and rad/s mixed).
    ///
    /// # Errors
    /// As [`Arm::lost_direction`]; [`ArmError::NotFinite`].
    pub fn feasible_twist(&self, q: &TableJoints, twist: &Twist) -> Result<(Twist, f64), ArmError> {
        finite(twist)?;
        let lost = self.lost_direction(q)?;
        let (lv, lw) = (lost.v.as_vector(), lost.w.as_vector());
        let (v, w) = (twist.v.as_vector(), twist.w.as_vector());
        let defect = lv.dot(v) + lw.dot(w);
        let kept = Twist {
            v: In::assume(v - lv * defect),
            w: In::assume(w - lw * defect),
        };
        Ok((kept, defect))
    }

    /// Joint rates that move the gripper by `twist`: `J^+ [v; w]` in closed form, exact for what the
    /// arm can do. At most `allowed` (m/s and rad/s mixed) may be along the direction it lacks, and is
    /// left out.
    ///
    /// # Errors
    /// [`ArmError::InfeasibleTwist`], [`ArmError::Singular`], [`ArmError::NotFinite`].
    pub fn joint_rates(
        &self,
        q: &TableJoints,
        twist: &Twist,
        allowed: f64,
    ) -> Result<[f64; JOINTS], ArmError> {
        bounded("allowed part of a twist", [allowed], 1e9)?;
        let (_, defect) = self.feasible_twist(q, twist)?;
        if defect.abs() > allowed {
            return Err(ArmError::InfeasibleTwist { defect, allowed });
        }
        let k = self.planar(q);
        self.pseudo_inverse(&k, twist)
    }

    /// Joint accelerations for an acceleration of the gripper (`v`, `w` in m/s^2 and rad/s^2) at given
    /// rates: `J^+ (acceleration - Jdot qd)`. Those of `motion` are not looked at.
    ///
    /// # Errors
    /// As [`Arm::joint_rates`], without the test of feasibility: only the part the arm can do is taken.
    pub(crate) fn joint_accelerations(
        &self,
        motion: &TableMotion,
        acceleration: &Twist,
    ) -> Result<[f64; JOINTS], ArmError> {
        finite(acceleration)?;
        let coasting = TableMotion::new(*motion.q(), motion.qd(), [0.0; JOINTS])?;
        let [.., tool] = self.link_motions(&coasting);
        let c_base_tool = self.forward(motion.q()).rotation();
        let resolve = |v: &Vector3<f64>| c_base_tool.as_matrix() * v;
        let left = Twist {
            v: In::assume(acceleration.v.as_vector() - resolve(tool.acceleration.as_vector())),
            w: In::assume(acceleration.w.as_vector() - resolve(tool.rate_change.as_vector())),
        };
        self.pseudo_inverse(&self.planar(motion.q()), &left)
    }

    fn sine_of_elbow(&self, k: &Planar) -> f64 {
        let ((s2, c2), (s3, c3)) = (k.two, k.three);
        c2 * s3 - s2 * c3
    }

    /// The plane and what is across it decouple: joints 2 to 4 by a 2x2 system, joints 1 and 5 by least
    /// squares of three equations in two unknowns.
    fn pseudo_inverse(&self, k: &Planar, twist: &Twist) -> Result<[f64; JOINTS], ArmError> {
        let p = self.parameters();
        let ((s1, c1), (s, c)) = (k.one, k.pitch);
        let (v, w) = (twist.v.as_vector(), twist.w.as_vector());
        let [rho, z] = k.tool;
        // Along the plane's normal (s1, -c1, 0) turn joints 2, 3 and 4 together.
        let pitch = s1 * w.x - c1 * w.y;
        let outwards = c1 * v.x + s1 * v.y + pitch * (z - k.wrist[1]);
        let upwards = v.z - pitch * (rho - k.wrist[0]);
        let sine = self.sine_of_elbow(k);
        if sine.abs() < SINGULAR {
            return Err(ArmError::Singular(Singularity::Elbow { sine: sine.abs() }));
        }
        let determinant = p.a2 * p.a3 * sine;
        let shoulder = [k.wrist[0] - p.a1, k.wrist[1] - p.d1];
        let elbow = [k.wrist[0] - k.elbow[0], k.wrist[1] - k.elbow[1]];
        let qd2 = (outwards * elbow[0] + upwards * elbow[1]) / determinant;
        let qd3 = -(shoulder[0] * outwards + shoulder[1] * upwards) / determinant;
        let qd4 = pitch - qd2 - qd3;
        // Across: v_t = rho qd1, w_r = a_r qd5, w_z = qd1 + a_z qd5.
        let measure = rho.hypot(s);
        if measure < SINGULAR {
            return Err(ArmError::Singular(Singularity::Base { measure }));
        }
        let (a_r, a_z) = (s, -c);
        let v_t = c1 * v.y - s1 * v.x;
        let w_r = c1 * w.x + s1 * w.y;
        let square = measure * measure;
        let qd1 = (rho * v_t + a_r * (a_r * w.z - a_z * w_r)) / square;
        let qd5 = (rho * (rho * (a_r * w_r + a_z * w.z) - a_z * v_t) + a_r * w_r) / square;
        Ok([qd1, qd2, qd3, qd4, qd5])
    }
}

fn finite(twist: &Twist) -> Result<(), ArmError> {
    let (v, w) = (twist.v.as_vector(), twist.w.as_vector());
    bounded(
        "velocity of the gripper",
        [v.x, v.y, v.z, w.x, w.y, w.z],
        1e9,
    )
    .map(|_| ())
}
