//! Joint angles -> pose of the gripper and of every link. Pure.

use super::joints::{JOINTS, TableJoints};
use super::{Arm, Base, Link, Tool};
use crate::dh::Transform;
use nalgebra::{Matrix3, Vector3};
use strapd_attitude::frames::{Dcm, In};

/// Sines and cosines one joint vector comes down to, and the planar coordinates of its points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planar {
    /// sin, cos of theta1, theta2, theta2 + theta3, P = theta2 + theta3 + theta4, theta5.
    pub one: (f64, f64),
    pub two: (f64, f64),
    pub three: (f64, f64),
    pub pitch: (f64, f64),
    pub five: (f64, f64),
    /// Radial distance from the base axis and height of the elbow, the wrist and the tool point, m.
    pub elbow: [f64; 2],
    pub wrist: [f64; 2],
    pub tool: [f64; 2],
}

impl Arm {
    pub(super) fn planar(&self, q: &TableJoints) -> Planar {
        let p = self.parameters();
        let [q1, q2, q3, q4, q5] = q.angles();
        let [o1, o2, o3, o4, o5] = p.theta_offset;
        let theta2 = q2 + o2;
        let theta23 = theta2 + (q3 + o3);
        let one = (q1 + o1).sin_cos();
        let two = theta2.sin_cos();
        let three = theta23.sin_cos();
        let pitch = (theta23 + (q4 + o4)).sin_cos();
        let five = (q5 + o5).sin_cos();
        let elbow = [p.a1 + p.a2 * two.1, p.d1 + p.a2 * two.0];
        let wrist = [elbow[0] + p.a3 * three.1, elbow[1] + p.a3 * three.0];
        let (s, c) = pitch;
        let tool = [
            wrist[0] + (p.a4 * c + p.d5 * s),
            wrist[1] + (p.a4 * s - p.d5 * c),
        ];
        Planar {
            one,
            two,
            three,
            pitch,
            five,
            elbow,
            wrist,
            tool,
        }
    }

    /// Pose of the gripper in the base frame, `0A5` of (2.6), in closed form.
    ///
    /// # Convention
    /// The approach, the tool's z, is `(c1 sin P, s1 sin P, -cos P)` with `P = theta2 + theta3 + theta4`.
    ///
    /// # Accuracy
    /// 1e-15 m and 1e-15 rad against the product of the five link matrices.
    ///
    /// # Source
    /// Seed document (2.5), (2.6) with five matrices: the six of its (2.6) to (2.7) agree only when
    /// the numbers of table 2.1 are shifted by one (erratum Y1). Angles in rad (Y4), lengths in m (Y6).
    #[must_use]
    pub fn forward(&self, q: &TableJoints) -> Transform<Base, Tool> {
        let k = self.planar(q);
        let (s1, c1) = k.one;
        let [rho, z] = k.tool;
        Transform::new(
            orientation(k.one, k.pitch, k.five),
            In::assume(Vector3::new(rho * c1, rho * s1, z)),
        )
    }

    /// Pose of each link's frame in the base frame, from joint 1 outwards: the products of (2.5).
    /// The last is the tool frame.
    #[must_use]
    pub fn link_poses(&self, q: &TableJoints) -> [Transform<Base, Link>; JOINTS] {
        let mut t_base_link = Transform::<Base, Link>::identity();
        let mut poses = [t_base_link; JOINTS];
        for ((pose, link), angle) in poses.iter_mut().zip(self.links()).zip(q.angles()) {
            t_base_link = t_base_link * link.transform::<Link, Link>(angle);
            *pose = t_base_link;
        }
        poses
    }
}

/// Orientation of the gripper from sine and cosine of theta1, the pitch P and theta5.
pub(super) fn orientation(
    (s1, c1): (f64, f64),
    (s, c): (f64, f64),
    (s5, c5): (f64, f64),
) -> Dcm<Base, Tool> {
    Dcm::assume(Matrix3::new(
        c1 * c * c5 + s1 * s5,
        s1 * c5 - c1 * c * s5,
        c1 * s,
        s1 * c * c5 - c1 * s5,
        -(s1 * c * s5 + c1 * c5),
        s1 * s,
        s * c5,
        -s * s5,
        -c,
    ))
}
