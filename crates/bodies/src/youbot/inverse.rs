//! Pose of the gripper -> every joint vector that takes it there. Pure; no allocation.
//!
//! The document's version has one base branch, one sign too many and no reach test (errata Y9 to Y16);
//! this one is complete: base turned to the wrist or away from it, elbow up or down.

mod plane;

use super::error::{Reach, bounded};
use super::joints::{JOINTS, TableJoints};
use super::policy::Policy;
use super::{Arm, ArmError, Base, Tool};
use crate::dh::Transform;
use plane::Plane;
use strapd_attitude::frames::Dcm;

/// Elbow angles nearer than this to straight or folded are taken for exactly that, rad: both branches
/// have met, and the pose changes by less than 1e-15 m.
const MERGED: f64 = 1e-7;
/// Distance beyond its reach that the wrist may be asked for where the policy states no tolerance, m.
const REACH_SLACK: f64 = 1e-9;
/// The farthest target taken, m: squares of it stay finite.
const FARTHEST: f64 = 1e9;

/// Direction in which joint 1 is turned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BaseTurn {
    /// Towards the wrist.
    Front,
    /// Away from it: the arm reaches back over its base.
    Back,
}

/// Direction in which the elbow is bent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Elbow {
    /// Above the line from shoulder to wrist (`sin q3 < 0` in front, `> 0` to the back).
    Up,
    /// Below it.
    Down,
    /// Straight or folded, on the boundary: up and down are one solution.
    Straight,
}

/// One joint vector that takes the gripper to the target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Solution {
    /// The joints, each within half a turn of the middle of its range.
    pub q: TableJoints,
    /// Direction in which joint 1 is turned.
    pub base: BaseTurn,
    /// Direction in which the elbow is bent.
    pub elbow: Elbow,
    /// Whether every joint is between its stops.
    pub within_limits: bool,
    /// Distance from the target's tool point, m, exact.
    pub position_residual: f64,
}

/// All solutions for one target, one to four, and what was found on the way.
///
/// Order: theta1 in (-90, 90] degrees before its opposite (under the policies that fix theta1 by one
/// vector: that direction first); for each, `sin q3 > 0` before `< 0`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Solutions {
    found: [Solution; 4],
    count: usize,
    limits: super::Limits,
    reach: Reach,
    /// Distance of the target's tool point from the arm's plane, m, signed along `(sin th1, -cos th1, 0)`.
    pub plane_position: f64,
    /// Angle of the target's approach out of the arm's plane, rad, signed likewise.
    pub plane_angle: f64,
    /// Distance by which the wrist misses its reach, m, for theta1 and its opposite; zero where it reaches.
    pub reach_excess: [f64; 2],
    /// Joint 1 turns about the approach: only its sum or difference with joint 5 is determined, and it
    /// was left at the current joints (or zero).
    pub theta1_free: bool,
    /// The approach is square to the plane, and any turn into it is the smallest: straight out was taken.
    pub approach_free: bool,
}

impl Solutions {
    /// The solutions.
    #[must_use]
    pub fn as_slice(&self) -> &[Solution] {
        &self.found[..self.count]
    }

    /// Angle between the target's orientation and that of the solutions, rad.
    #[must_use]
    pub fn angle_residual(&self) -> f64 {
        self.plane_angle.abs()
    }

    /// Index of the first solution between the stops.
    #[must_use]
    pub fn first_within_limits(&self) -> Option<usize> {
        self.as_slice().iter().position(|s| s.within_limits)
    }

    /// The solution between the stops that is nearest to `q_current`.
    ///
    /// # Errors
    /// [`ArmError::Limit`] when every solution has a joint past its stop; the numbers are those of
    /// the solution that is past by least.
    pub fn nearest(&self, q_current: &TableJoints) -> Result<&Solution, ArmError> {
        self.nearest_weighted(q_current, &[1.0; JOINTS])
    }

    /// Same as [`Solutions::nearest`], with a weight for each joint: least largest `w_i |q_i - q_current,i|`, ties
    /// by the sum of squares. Plain differences: no joint can pass its stop.
    ///
    /// # Errors
    /// As [`Solutions::nearest`]; weights that are not finite or not above zero.
    pub fn nearest_weighted(
        &self,
        q_current: &TableJoints,
        weights: &[f64; JOINTS],
    ) -> Result<&Solution, ArmError> {
        bounded("weight of a joint", *weights, 1e9)?;
        if let Some(value) = weights.iter().find(|w| **w <= 0.0) {
            return Err(ArmError::Impossible {
                what: "the weight of a joint must be above zero",
                value: *value,
            });
        }
        let mut best: Option<(f64, f64, &Solution)> = None;
        for s in self.as_slice().iter().filter(|s| s.within_limits) {
            let (mut largest, mut squares) = (0.0_f64, 0.0);
            for ((a, b), w) in s.q.angles().iter().zip(q_current.angles()).zip(weights) {
                let d = w * (a - b).abs();
                largest = largest.max(d);
                squares += d * d;
            }
            let better = best.is_none_or(|(l, q, _)| largest < l || (largest == l && squares < q));
            if better {
                best = Some((largest, squares, s));
            }
        }
        match best {
            Some((_, _, s)) => Ok(s),
            None => Err(self.least_past_limits()),
        }
    }

    /// Error for solutions wanted with one turn of the base when only the other has any.
    pub(super) fn other_side_out_of_reach(&self) -> ArmError {
        let [a, b] = self.reach.excess();
        let [ra, rb] = self.reach.wanted;
        let wanted = [if a > b { ra } else { rb }; 2];
        ArmError::OutOfReach(Reach {
            wanted,
            ..self.reach
        })
    }

    /// Why no solution is between the stops.
    fn least_past_limits(&self) -> ArmError {
        let past = |s: &Solution| {
            let excess = self.limits.excess(&s.q.angles());
            excess.into_iter().fold(f64::NEG_INFINITY, f64::max)
        };
        let least = self
            .as_slice()
            .iter()
            .min_by(|a, b| past(a).total_cmp(&past(b)));
        // There is always a solution, and it is past a stop: else it had been taken.
        least
            .and_then(|s| self.limits.check(&s.q).err())
            .unwrap_or(ArmError::Impossible {
                what: "the number of solutions must be above zero",
                value: 0.0,
            })
    }
}

impl Arm {
    /// Every joint vector, up to four, that takes the gripper to `target`; where five joints cannot,
    /// to the pose the policy names. `q_current` decides joint 1 where it is free.
    ///
    /// # Errors
    /// [`ArmError::NotARotation`] (orthonormal to 1e-6 is asked), [`ArmError::NotFinite`],
    /// [`ArmError::OutOfPlane`] under [`Policy::Reject`], [`ArmError::OutOfReach`]. Stops are not an
    /// error here: each solution says whether it is between them.
    ///
    /// # Accuracy
    /// Pose of every solution within 1e-15 m and 3e-15 rad of the target's (or of its projection).
    /// Joints within 2e-12 rad while `|sin q3| > 1e-3` and the tool is 1 mm off the base axis or its
    /// approach 1 mrad off vertical; towards those singularities the joints lose digits, not the pose.
    ///
    /// # Source
    /// Seed document (2.10) to (2.21), corrected. Its (2.14) `theta1 = atan2(py, px)` knows only the
    /// position; here position and approach share (Y9). (2.17) subtracts one square twice (Y11),
    /// (2.19) has the angle from the vertical (Y12), and the sign of the elbow twice (Y13).
    pub fn inverse(
        &self,
        target: &Transform<Base, Tool>,
        policy: Policy,
        q_current: Option<&TableJoints>,
    ) -> Result<Solutions, ArmError> {
        let r = Dcm::<Base, Tool>::try_from_matrix(*target.rotation().as_matrix())
            .map_err(ArmError::NotARotation)?;
        let r = r.as_matrix();
        let p = target.translation();
        let p = p.as_vector();
        bounded("target position (m)", [p.x, p.y, p.z], FARTHEST)?;
        let mut plane = Plane::of(p, r, policy, q_current, self.parameters().theta_offset[0])?;
        let slack = match policy {
            Policy::Reject { position, .. } => position,
            _ => REACH_SLACK,
        };
        let mut list = List::new(self, &plane);
        if plane.theta1_free {
            let (theta5, theta1) = (plane.theta5(r), plane.theta1);
            plane.theta1 = list.relieved(theta1, theta5, plane.approach[1] > 0.0);
            plane.retake();
        }
        let theta5 = plane.theta5(r);
        for side in [0, 1] {
            list.side(side, &plane, p, theta5, slack);
        }
        list.finish()
    }
}

/// Solutions as they are found.
struct List<'a> {
    arm: &'a Arm,
    out: Solutions,
}

impl<'a> List<'a> {
    fn new(arm: &'a Arm, plane: &Plane) -> Self {
        let g = arm.parameters();
        let empty = Solution {
            q: TableJoints::ZERO,
            base: BaseTurn::Front,
            elbow: Elbow::Straight,
            within_limits: false,
            position_residual: 0.0,
        };
        Self {
            arm,
            out: Solutions {
                found: [empty; 4],
                count: 0,
                limits: *arm.limits(),
                reach: Reach {
                    wanted: [0.0; 2],
                    nearest: (g.a2 - g.a3).abs(),
                    farthest: g.a2 + g.a3,
                },
                plane_position: plane.position,
                plane_angle: plane.angle,
                reach_excess: [0.0; 2],
                theta1_free: plane.theta1_free,
                approach_free: plane.approach_free,
            },
        }
    }

    /// Joint 1 is free, but joint 5 follows it: as near to the wish as keeps joint 5 from its stop.
    fn relieved(&self, theta1: f64, theta5: f64, upwards: bool) -> f64 {
        let limits = self.arm.limits();
        let offset = self.arm.parameters().theta_offset[4];
        let q5 = limits.turned_in(4, theta5 - offset);
        let past = (q5 - limits.max()[4]).max(0.0) + (q5 - limits.min()[4]).min(0.0);
        // Approach up: theta1 + theta5 is fixed; down: theta1 - theta5.
        if upwards {
            theta1 + past
        } else {
            theta1 - past
        }
    }

    /// Both elbows with theta1 (`side` 0) or its opposite (1).
    fn side(
        &mut self,
        side: usize,
        plane: &Plane,
        p: &nalgebra::Vector3<f64>,
        theta5: f64,
        slack: f64,
    ) {
        let g = self.arm.parameters();
        let half_turn = std::f64::consts::PI;
        let (sign, theta1, theta5) = if side == 0 {
            (1.0, plane.theta1, theta5)
        } else {
            (-1.0, plane.theta1 + half_turn, theta5 + half_turn)
        };
        let [radial, up] = plane.approach;
        let radial = sign * radial;
        let theta234 = radial.atan2(-up);
        // The wrist, from the base axis and then from the shoulder.
        let from_axis = sign * (plane.cos * p.x + plane.sin * p.y) - g.d5 * radial + g.a4 * up;
        let u = from_axis - g.a1;
        let w = p.z - g.d5 * up - g.a4 * radial - g.d1;
        let r = u.hypot(w);
        self.out.reach.wanted[side] = r;
        let reach = self.out.reach;
        let excess = reach.excess()[side];
        if excess > slack {
            self.out.reach_excess[side] = excess;
            return;
        }
        let base = if from_axis >= 0.0 {
            BaseTurn::Front
        } else {
            BaseTurn::Back
        };
        // Heron's products: no arc cosine, no cancellation at the ends of the reach.
        let near = ((reach.farthest - r) * (reach.farthest + r))
            .max(0.0)
            .sqrt();
        let far = ((r - reach.nearest) * (r + reach.nearest)).max(0.0).sqrt();
        let theta3 = 2.0 * near.atan2(far);
        // far^2 + near^2 = 4 a2 a3, and near/far is the tangent of half the elbow's angle.
        let scale = 0.25 / (g.a2 * g.a3);
        let (sin3, cos3, merged) = if theta3 < MERGED {
            (0.0, 1.0, Some(0.0))
        } else if theta3 > half_turn - MERGED {
            (0.0, -1.0, Some(half_turn))
        } else {
            let sin3 = 2.0 * scale * near * far;
            (sin3, scale * (far * far - near * near), None)
        };
        let k1 = g.a2 + g.a3 * cos3;
        for elbow_sign in [1.0, -1.0] {
            let k2 = g.a3 * sin3 * elbow_sign;
            let theta2 = (k1 * w - k2 * u).atan2(k1 * u + k2 * w);
            let theta3 = merged.unwrap_or(elbow_sign * theta3);
            let theta = [theta1, theta2, theta3, theta234 - theta2 - theta3, theta5];
            let elbow = match (merged, base, elbow_sign > 0.0) {
                (Some(_), _, _) => Elbow::Straight,
                (None, BaseTurn::Front, false) | (None, BaseTurn::Back, true) => Elbow::Up,
                (None, _, _) => Elbow::Down,
            };
            self.push(theta, base, elbow, plane.position.hypot(excess));
            if merged.is_some() {
                break;
            }
        }
    }

    fn push(&mut self, theta: [f64; JOINTS], base: BaseTurn, elbow: Elbow, position_residual: f64) {
        let limits = self.arm.limits();
        let offsets = self.arm.parameters().theta_offset;
        let mut q = theta;
        for (joint, (angle, offset)) in q.iter_mut().zip(offsets).enumerate() {
            *angle = limits.turned_in(joint, *angle - offset);
        }
        let q = TableJoints::computed(q);
        // Two sides of two elbows: never a fifth.
        if let Some(place) = self.out.found.get_mut(self.out.count) {
            *place = Solution {
                q,
                base,
                elbow,
                within_limits: limits.contain(&q),
                position_residual,
            };
            self.out.count += 1;
        }
    }

    fn finish(self) -> Result<Solutions, ArmError> {
        if self.out.count > 0 {
            return Ok(self.out);
        }
        Err(ArmError::OutOfReach(self.out.reach))
    }
}
