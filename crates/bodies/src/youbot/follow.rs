//! A path of the gripper in space, parametrised by time -> joints, rates, accelerations. Pure.
//!
//! Two ways in. [`Follower`] takes any motion of the gripper, step by step, and stays on the branch it
//! is on. [`ToolTrack`] follows a [`ToolPath`], which lies in the arm's plane by construction, and can
//! be asked for any instant in any order.

use super::error::bounded;
use super::forward::orientation;
use super::inverse::Solution;
use super::jacobian::{Singularity, Twist};
use super::joints::{JOINTS, TableJoints, TableMotion};
use super::path::{JointPath, Sinusoid};
use super::policy::Policy;
use super::timing::slow_down;
use super::{Arm, ArmError, Base, Tool};
use crate::dh::Transform;
use crate::rest_to_rest::rest_to_rest;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};
use strapd_attitude::frames::In;

/// Jumps of a joint below this between two steps are not looked into, rad.
const JUMP: f64 = 0.1;

/// Pose, velocity and acceleration of the gripper at an instant.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ToolMotion {
    /// Pose in the base frame.
    pub t_base_tool: Transform<Base, Tool>,
    /// Velocity and angular rate.
    pub twist: Twist,
    /// Acceleration and change of the angular rate, m/s^2 and rad/s^2.
    pub acceleration: Twist,
}

/// Follows any motion of the gripper, one step after the other.
#[derive(Clone, Debug)]
pub struct Follower {
    arm: Arm,
    policy: Policy,
    allowed: f64,
    last: Option<(f64, TableMotion)>,
    start: TableJoints,
}

impl Follower {
    /// Starts near `start` (which decides the branch). `policy` for poses that five joints cannot take;
    /// `allowed`: how much of a velocity may be along the direction they lack (m/s and rad/s mixed).
    ///
    /// # Errors
    /// `allowed` not a finite number.
    pub fn new(
        arm: Arm,
        start: TableJoints,
        policy: Policy,
        allowed: f64,
    ) -> Result<Self, ArmError> {
        bounded("allowed part of a twist", [allowed], 1e9)?;
        Ok(Self {
            arm,
            policy,
            allowed,
            last: None,
            start,
        })
    }

    /// Joints, rates and accelerations for the gripper's motion at `secs`.
    ///
    /// # Errors
    /// [`ArmError::Path`] with the time and the reason: out of reach (by how much), off the plane, past
    /// a stop, singular, or [`ArmError::BranchChange`]. The follower stays where it was.
    pub fn step(&mut self, secs: f64, wanted: &ToolMotion) -> Result<TableMotion, ArmError> {
        bounded("time on the path (s)", [secs], 1e9)?;
        let motion = self.solve(secs, wanted).map_err(|why| ArmError::Path {
            secs,
            why: Box::new(why),
        })?;
        self.last = Some((secs, motion));
        Ok(motion)
    }

    fn solve(&self, secs: f64, wanted: &ToolMotion) -> Result<TableMotion, ArmError> {
        let before = self.last.as_ref().map_or(self.start, |(_, m)| *m.q());
        let found = self
            .arm
            .inverse(&wanted.t_base_tool, self.policy, Some(&before))?;
        let q = found.nearest(&before)?.q;
        let motion = moving(&self.arm, q, wanted, self.allowed)?;
        if let Some((earlier, last)) = &self.last {
            no_jump(last, &motion, secs - earlier)?;
        }
        Ok(motion)
    }
}

/// Rates and accelerations that go with joints and a motion of the gripper.
fn moving(
    arm: &Arm,
    q: TableJoints,
    wanted: &ToolMotion,
    allowed: f64,
) -> Result<TableMotion, ArmError> {
    let qd = arm.joint_rates(&q, &wanted.twist, allowed)?;
    let coasting = TableMotion::new(q, qd, [0.0; JOINTS])?;
    let qdd = arm.joint_accelerations(&coasting, &wanted.acceleration)?;
    TableMotion::new(q, qd, qdd)
}

/// The joints went where their rates took them, within half the way and 0.1 rad.
fn no_jump(last: &TableMotion, now: &TableMotion, secs: f64) -> Result<(), ArmError> {
    for joint in 0..JOINTS {
        let jump = now.q().angles()[joint] - last.q().angles()[joint];
        let expected = 0.5 * secs * (now.qd()[joint] + last.qd()[joint]);
        if (jump - expected).abs() > JUMP + 0.5 * expected.abs() {
            return Err(ArmError::BranchChange {
                joint: joint + 1,
                jump,
                expected,
            });
        }
    }
    Ok(())
}

/// One coordinate of a gripper path: value, first and second derivative.
type Coordinate = [f64; 3];

/// Motion of the gripper through space: tool point x, y, z (m, base axes), pitch
/// `P = theta2 + theta3 + theta4` (rad; 0 points down, 90 degrees forward) and roll theta5 (rad) as functions of time.
/// Theta1 follows from x and y, so every pose lies in the arm's plane.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ToolPath {
    /// Each coordinate a sinusoid: x, y, z, pitch, roll.
    Waves([Sinusoid; 5]),
    /// Straight from rest to rest, x, y, z, pitch, roll together.
    Line {
        /// Start.
        from: [f64; 5],
        /// End.
        to: [f64; 5],
        /// Seconds it takes.
        duration: f64,
    },
}

impl ToolPath {
    /// Each coordinate a sinusoid.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`], [`ArmError::TooLarge`].
    pub fn waves(coordinates: [Sinusoid; 5]) -> Result<Self, ArmError> {
        for coordinate in coordinates {
            coordinate.checked("sinusoid of the gripper")?;
        }
        Ok(Self::Waves(coordinates))
    }

    /// A straight line.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`], [`ArmError::TooLarge`], a duration below a millisecond.
    pub fn line(from: [f64; 5], to: [f64; 5], duration: f64) -> Result<Self, ArmError> {
        bounded("start of a line", from, 1e4)?;
        bounded("end of a line", to, 1e4)?;
        bounded("duration of a line (s)", [duration], 1e9)?;
        if duration < 1e-3 {
            return Err(ArmError::Impossible {
                what: "a line must last at least a millisecond (s)",
                value: duration,
            });
        }
        Ok(Self::Line { from, to, duration })
    }

    /// The same path, `factor` times as slow.
    ///
    /// # Errors
    /// A factor not above zero and finite.
    pub fn slowed(&self, factor: f64) -> Result<Self, ArmError> {
        let factor = slow_down(factor)?;
        match self {
            Self::Waves(waves) => Self::waves(waves.map(|w| w.slowed(factor))),
            Self::Line { from, to, duration } => Self::line(*from, *to, duration * factor),
        }
    }

    /// Length in s; `None` for a path without end.
    #[must_use]
    pub fn duration(&self) -> Option<f64> {
        match self {
            Self::Waves(_) => None,
            Self::Line { duration, .. } => Some(*duration),
        }
    }

    fn coordinates(&self, secs: f64) -> [Coordinate; 5] {
        match self {
            Self::Waves(waves) => waves.map(|w| w.at(secs)),
            Self::Line { from, to, duration } => {
                let [s, sd, sdd] = rest_to_rest(secs, *duration);
                let mut out = [[0.0; 3]; 5];
                for ((o, a), b) in out.iter_mut().zip(from).zip(to) {
                    let way = b - a;
                    *o = [a + way * s, way * sd, way * sdd];
                }
                out
            }
        }
    }

    /// Motion of the gripper at `secs`.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`] time; [`ArmError::Singular`] where the path meets the base axis, where
    /// theta1 would jump.
    pub fn at(&self, secs: f64) -> Result<ToolMotion, ArmError> {
        bounded("time on the path (s)", [secs], 1e9)?;
        let [x, y, z, pitch, roll] = self.coordinates(secs);
        let square = x[0] * x[0] + y[0] * y[0];
        let distance = square.sqrt();
        if distance < 1e-6 {
            return Err(ArmError::Singular(Singularity::Path { distance }));
        }
        let (s1, c1) = (y[0] / distance, x[0] / distance);
        // theta1 = atan2(y, x)
        let turn = (x[0] * y[1] - y[0] * x[1]) / square;
        let outwards = (x[0] * x[1] + y[0] * y[1]) / square;
        let turn_change = (x[0] * y[2] - y[0] * x[2]) / square - 2.0 * turn * outwards;
        let ((s, c), five) = (pitch[0].sin_cos(), roll[0].sin_cos());
        let up = Vector3::z();
        let normal = Vector3::new(s1, -c1, 0.0);
        let approach = Vector3::new(c1 * s, s1 * s, -c);
        let plane = up * turn + normal * pitch[1];
        let w = plane + approach * roll[1];
        let w_change = up * turn_change
            + normal * pitch[2]
            + up.cross(&normal) * (turn * pitch[1])
            + approach * roll[2]
            + plane.cross(&approach) * roll[1];
        let point = |k: usize| In::assume(Vector3::new(x[k], y[k], z[k]));
        Ok(ToolMotion {
            t_base_tool: Transform::new(orientation((s1, c1), (s, c), five), point(0)),
            twist: Twist {
                v: point(1),
                w: In::assume(w),
            },
            acceleration: Twist {
                v: point(2),
                w: In::assume(w_change),
            },
        })
    }
}

/// A gripper path followed on one branch: base turned to it or away, elbow up or down.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ToolTrack {
    arm: Arm,
    path: ToolPath,
    /// Joint 1 points along the path's theta1, or against it.
    along: f64,
    /// Sign of sin q3.
    elbow: f64,
}

impl ToolTrack {
    /// Starts on the branch nearest to `start` at time zero.
    ///
    /// # Errors
    /// As [`ToolTrack::at`] at time zero.
    pub fn new(arm: Arm, path: ToolPath, start: &TableJoints) -> Result<Self, ArmError> {
        let nearest = || {
            let first = path.at(0.0)?.t_base_tool;
            let found = arm.inverse(&first, exact(), Some(start))?;
            Ok((first, found.nearest(start)?.q))
        };
        let (first, q) = nearest().map_err(|why| ArmError::Path {
            secs: 0.0,
            why: Box::new(why),
        })?;
        let track = Self {
            arm,
            path,
            along: if track_side(&arm, &first, &q) {
                1.0
            } else {
                -1.0
            },
            elbow: elbow_sign(&arm, &q),
        };
        track.at(0.0)?;
        Ok(track)
    }

    /// The arm.
    #[must_use]
    pub fn arm(&self) -> &Arm {
        &self.arm
    }

    /// The path.
    #[must_use]
    pub fn path(&self) -> &ToolPath {
        &self.path
    }

    /// Joints, rates and accelerations at `secs`.
    ///
    /// # Errors
    /// [`ArmError::Path`] with the time and the reason.
    pub fn at(&self, secs: f64) -> Result<TableMotion, ArmError> {
        self.solve(secs).map_err(|why| ArmError::Path {
            secs,
            why: Box::new(why),
        })
    }

    fn solve(&self, secs: f64) -> Result<TableMotion, ArmError> {
        let wanted = self.path.at(secs)?;
        let pose = &wanted.t_base_tool;
        let found = self.arm.inverse(pose, exact(), None)?;
        let on_branch = |s: &&Solution| {
            track_side(&self.arm, pose, &s.q) == (self.along > 0.0)
                && elbow_sign(&self.arm, &s.q) * self.elbow >= 0.0
        };
        match found.as_slice().iter().find(on_branch) {
            Some(s) => {
                self.arm.limits().check(&s.q)?;
                moving(&self.arm, s.q, &wanted, 1e-6)
            }
            // Only the other turn of the base reaches.
            None => Err(found.other_side_out_of_reach()),
        }
    }

    /// The joints' way from zero to `secs` in knots of at most 10 ms, between which it is a polynomial
    /// of fifth degree with the knots' rates and accelerations: within 1e-13 rad of the way itself for
    /// paths of a few rad/s, and as smooth.
    ///
    /// # Errors
    /// As [`ToolTrack::at`]; longer than 1e4 s (a million knots).
    pub fn joint_path(&self, secs: f64) -> Result<JointPath, ArmError> {
        bounded("duration of a gripper path (s)", [secs], 1e4)?;
        let count = (secs / 0.01).ceil().max(1.0);
        let step = secs / count;
        let count = count as u32;
        let knots: Result<Vec<_>, _> = (0..=count).map(|i| self.at(step * f64::from(i))).collect();
        JointPath::knots(step, knots?)
    }

    /// Factor by which the path must be slowed between `from` and `to` so that no joint exceeds its
    /// fastest rate, looked at in `steps` steps.
    ///
    /// # Errors
    /// As [`ToolTrack::at`].
    pub fn slow_down_factor(&self, from: f64, to: f64, steps: u32) -> Result<f64, ArmError> {
        let mut factor = 1.0_f64;
        for i in 0..=steps {
            let secs = from + (to - from) * f64::from(i) / f64::from(steps.max(1));
            let motion = self.at(secs)?;
            factor = factor.max(super::slow_down_factor(&self.arm, [&motion]));
        }
        Ok(factor)
    }
}

/// Poses of a [`ToolPath`] are in the plane to rounding.
fn exact() -> Policy {
    Policy::Weighted { length: 1.0 }
}

/// Whether joint 1 points towards the tool point rather than away from it.
fn track_side(arm: &Arm, pose: &Transform<Base, Tool>, q: &TableJoints) -> bool {
    let r = pose.translation();
    let [q1, ..] = q.angles();
    let towards = r.as_vector().y.atan2(r.as_vector().x);
    let off = (q1 + arm.parameters().theta_offset[0] - towards).rem_euclid(TAU);
    !(FRAC_PI_2..=3.0 * FRAC_PI_2).contains(&off)
}

fn elbow_sign(arm: &Arm, q: &TableJoints) -> f64 {
    let sine = (q.angles()[2] + arm.parameters().theta_offset[2]).sin();
    // Straight or folded is on both branches.
    if sine.abs() < 1e-6 {
        0.0
    } else {
        sine.signum()
    }
}
