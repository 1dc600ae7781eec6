//! Target pose and policy -> the vertical plane the arm stands in, and the target's part in it. Pure.
//!
//! All five links move in one plane through the base axis. A target fits when both its tool point and
//! its approach lie in one; the residuals say by how much they do not.

use crate::youbot::error::bounded;
use crate::youbot::policy::Policy;
use crate::youbot::{ArmError, TableJoints};
use nalgebra::{Matrix3, Vector3};

/// Horizontal parts shorter than this (m, or sine of an angle) have no direction.
const NO_DIRECTION: f64 = 1e-12;

/// The arm's plane for a target.
pub(super) struct Plane {
    /// Angle of the plane, rad, and its sine and cosine.
    pub(super) theta1: f64,
    pub(super) sin: f64,
    pub(super) cos: f64,
    /// The approach in the plane, of unit length: outwards, upwards.
    pub(super) approach: [f64; 2],
    /// Residuals: of the tool point, m, and of the approach, rad.
    pub(super) position: f64,
    pub(super) angle: f64,
    /// Every plane fits.
    pub(super) theta1_free: bool,
    /// The approach is square to the plane.
    pub(super) approach_free: bool,
}

impl Plane {
    pub(super) fn of(
        p: &Vector3<f64>,
        r: &Matrix3<f64>,
        policy: Policy,
        q_current: Option<&TableJoints>,
        offset1: f64,
    ) -> Result<Self, ArmError> {
        let a = r.column(2);
        let (a_x, a_y) = (a[0], a[1]);
        let by_position = p.x.hypot(p.y) > NO_DIRECTION;
        let by_approach = a_x.hypot(a_y) > NO_DIRECTION;
        let free = !by_position && !by_approach;
        let theta1 = match policy {
            _ if free => free_angle(q_current, offset1),
            Policy::KeepPosition if by_position => p.y.atan2(p.x),
            Policy::KeepApproach if by_approach => a_y.atan2(a_x),
            Policy::KeepPosition => a_y.atan2(a_x),
            Policy::KeepApproach => p.y.atan2(p.x),
            Policy::Reject { position, angle } => {
                tolerance("allowed distance from the plane (m)", position)?;
                tolerance("allowed angle out of the plane (rad)", angle)?;
                let both = position > 0.0 && angle > 0.0;
                let length = if both { position / angle } else { 1.0 };
                shared_direction(p, a_x, a_y, length.clamp(1e-6, 1e6))
            }
            Policy::Weighted { length } => {
                bounded("weight length (m)", [length], 1e6)?;
                if length < 1e-6 {
                    return Err(ArmError::Impossible {
                        what: "the weight length must be above a micrometre",
                        value: length,
                    });
                }
                shared_direction(p, a_x, a_y, length)
            }
        };
        let (sin, cos) = theta1.sin_cos();
        let out_of_plane = sin * a_x - cos * a_y;
        let outwards = cos * a_x + sin * a_y;
        let length = outwards.hypot(a[2]);
        let approach_free = length < NO_DIRECTION;
        let plane = Self {
            theta1,
            sin,
            cos,
            approach: if approach_free {
                [1.0, 0.0]
            } else {
                [outwards / length, a[2] / length]
            },
            position: sin * p.x - cos * p.y,
            angle: out_of_plane.atan2(length),
            theta1_free: free,
            approach_free,
        };
        if let Policy::Reject { position, angle } = policy {
            let fits = plane.position.abs() <= position && plane.angle.abs() <= angle;
            if !fits {
                return Err(ArmError::OutOfPlane {
                    position: plane.position,
                    angle: plane.angle,
                    allowed_position: position,
                    allowed_angle: angle,
                });
            }
        }
        Ok(plane)
    }

    /// Theta5 from the target's x and y axes against the plane's normal. The smallest turn that brings
    /// the approach into the plane does not change it.
    pub(super) fn theta5(&self, r: &Matrix3<f64>) -> f64 {
        let along = |column: usize| self.sin * r[(0, column)] - self.cos * r[(1, column)];
        along(0).atan2(along(1))
    }

    /// Recomputes what follows from theta1 after it was changed where it is free.
    pub(super) fn retake(&mut self) {
        (self.sin, self.cos) = self.theta1.sin_cos();
    }
}

/// The wish for joint 1 as an angle of one turn.
fn free_angle(q_current: Option<&TableJoints>, offset1: f64) -> f64 {
    let [q1, ..] = q_current.map_or([0.0; 5], TableJoints::angles);
    let (s, c) = (q1 + offset1).sin_cos();
    s.atan2(c)
}

/// The line through the origin nearest to the horizontal parts of position (over `length`) and approach:
/// minimises `(n.p/length)^2 + (n.a)^2`. Within (-pi/2, pi/2].
fn shared_direction(p: &Vector3<f64>, a_x: f64, a_y: f64, length: f64) -> f64 {
    let (x, y) = (p.x / length, p.y / length);
    let twice_sin = 2.0 * (x * y + a_x * a_y);
    let twice_cos = (x - y) * (x + y) + (a_x - a_y) * (a_x + a_y);
    0.5 * twice_sin.atan2(twice_cos)
}

fn tolerance(what: &'static str, value: f64) -> Result<(), ArmError> {
    bounded(what, [value], 1e6)?;
    if value < 0.0 {
        return Err(ArmError::Impossible {
            what: "an allowed residual must not be below zero",
            value,
        });
    }
    Ok(())
}
