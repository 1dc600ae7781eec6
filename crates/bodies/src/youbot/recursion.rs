//! Joint motion -> rate, velocity and acceleration of every link. Pure.

use super::joints::{JOINTS, TableJoints, TableMotion};
use super::{Arm, Link};
use nalgebra::{Matrix3, Vector3};
use strapd_attitude::frames::In;

/// Motion of one link relative to the base, resolved in its own axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LinkMotion {
    /// Angular rate, rad/s.
    pub rate: In<Link>,
    /// Rate of change, rad/s^2.
    pub rate_change: In<Link>,
    /// Velocity of the frame's origin, m/s.
    pub velocity: In<Link>,
    /// Acceleration of the frame's origin, m/s^2.
    pub acceleration: In<Link>,
}

/// The motion of one link as bare numbers, for the kernels.
#[derive(Clone, Copy)]
pub(super) struct Moving {
    pub w: Vector3<f64>,
    pub wd: Vector3<f64>,
    pub v: Vector3<f64>,
    pub a: Vector3<f64>,
}

impl Moving {
    /// A base that stands still but feels `a`: minus gravity folds gravity into every link.
    pub(super) fn base(a: Vector3<f64>) -> Self {
        let zero = Vector3::zeros();
        Self {
            w: zero,
            wd: zero,
            v: zero,
            a,
        }
    }
}

impl Arm {
    /// `R_i`: from link i to link i-1.
    pub(super) fn rotations(&self, q: &TableJoints) -> [Matrix3<f64>; JOINTS] {
        let mut out = [Matrix3::identity(); JOINTS];
        for ((r, link), angle) in out.iter_mut().zip(self.links()).zip(q.angles()) {
            let (s, c) = (angle + link.theta_offset()).sin_cos();
            *r = link.rotation(s, c);
        }
        out
    }

    /// Step from link i-1 to link i.
    #[inline]
    pub(super) fn step(
        &self,
        joint: usize,
        r: &Matrix3<f64>,
        before: &Moving,
        qd: f64,
        qdd: f64,
    ) -> Moving {
        let link = &self.links()[joint];
        let (axis, arm) = (link.axis(), link.reach());
        let w_before = r.tr_mul(&before.w);
        let turn = axis * qd;
        let w = w_before + turn;
        let wd = r.tr_mul(&before.wd) + axis * qdd + w_before.cross(&turn);
        Moving {
            w,
            wd,
            v: r.tr_mul(&before.v) + w.cross(&arm),
            a: r.tr_mul(&before.a) + wd.cross(&arm) + w.cross(&w.cross(&arm)),
        }
    }

    /// Motion of every link, from joint 1 outwards; the last is the tool.
    ///
    /// # Source
    /// Craig, Introduction to Robotics, chapter 6, for standard link frames: `w_i = R^T (w_(i-1) + z qd_i)`,
    /// `V_i = R^T V_(i-1) + w_i x r_i` and their derivatives.
    #[must_use]
    pub fn link_motions(&self, motion: &TableMotion) -> [LinkMotion; JOINTS] {
        let rotations = self.rotations(motion.q());
        let (qd, qdd) = (motion.qd(), motion.qdd());
        let mut before = Moving::base(Vector3::zeros());
        let rest = In::assume(Vector3::zeros());
        let mut out = [LinkMotion {
            rate: rest,
            rate_change: rest,
            velocity: rest,
            acceleration: rest,
        }; JOINTS];
        for (joint, (slot, r)) in out.iter_mut().zip(&rotations).enumerate() {
            before = self.step(joint, r, &before, qd[joint], qdd[joint]);
            *slot = LinkMotion {
                rate: In::assume(before.w),
                rate_change: In::assume(before.wd),
                velocity: In::assume(before.v),
                acceleration: In::assume(before.a),
            };
        }
        out
    }
}
