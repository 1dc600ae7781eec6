//! Lengths, offsets and ranges -> an arm. Pure.

use super::error::bounded;
use super::joints::{DriverJoints, JOINTS, TableJoints};
use super::limits::Limits;
use super::{ArmError, ArmLink0, ArmLink5, Base, Tool};
use crate::dh::{DhLink, Transform};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};
use strapd_attitude::frames::{Dcm, In};

/// Parameters in which one arm of this build differs from another. Lengths in m, angles in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Parameters {
    /// Shoulder axis from the base axis.
    pub a1: f64,
    /// Upper arm.
    pub a2: f64,
    /// Forearm.
    pub a3: f64,
    /// Distance by which the axis of joint 5 misses that of joint 4; the seed and every peer leave it out.
    pub a4: f64,
    /// Shoulder axis above the base frame.
    pub d1: f64,
    /// Tool point from the wrist.
    pub d5: f64,
    /// `theta = q + theta_offset`.
    pub theta_offset: [f64; JOINTS],
    /// The joint angles q at which the encoders read zero: `q = driver_zero - u`.
    pub driver_zero: [f64; JOINTS],
    /// Ranges of the joints.
    pub limits: Limits,
    /// Fastest rate of each joint, rad/s.
    pub fastest: [f64; JOINTS],
}

impl Parameters {
    /// Table 2.1 of the source document: the base in the mounting plane, the tool point between the
    /// finger tips. Its 147, 218 and 655 mm are roundings of KUKA's 147, 217.5 and 654.5 (erratum Y18).
    #[must_use]
    pub fn published() -> Self {
        Self {
            a1: 0.033,
            a2: 0.155,
            a3: 0.135,
            a4: 0.0,
            d1: 0.147,
            d5: 0.218,
            theta_offset: [0.0, FRAC_PI_2, 0.0, 0.0, 0.0],
            driver_zero: [169.0, 65.0, -146.0, 192.5, 167.5].map(f64::to_radians),
            limits: Limits::stops(),
            fastest: [FRAC_PI_2; JOINTS],
        }
    }

    /// The URDF of mas-group/youbot_description (commit 65489aa): the base in the height of
    /// `arm_link_0`, the tool at `arm_link_5`, and the 2 mm between the last two axes. Its joint 1
    /// origin is turned by 170 degrees where limits and every inverse say 169: here 169.
    #[must_use]
    pub fn urdf() -> Self {
        Self {
            a4: 0.002,
            d1: 0.115,
            d5: 0.130,
            ..Self::published()
        }
    }
}

/// The youBot's arm: five revolute joints, the middle three parallel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Arm {
    p: Parameters,
    links: [DhLink; JOINTS],
}

impl Arm {
    /// Makes it from its parameters.
    ///
    /// # Errors
    /// Not finite, lengths beyond 1 km, `a2` or `a3` not above zero, offsets beyond two turns, rates not
    /// above zero.
    pub fn new(p: Parameters) -> Result<Self, ArmError> {
        bounded(
            "length of a link (m)",
            [p.a1, p.a2, p.a3, p.a4, p.d1, p.d5],
            1e3,
        )?;
        bounded("joint offset (rad)", p.theta_offset, 2.0 * TAU)?;
        bounded("zero of the driver (rad)", p.driver_zero, 2.0 * TAU)?;
        bounded("fastest rate (rad/s)", p.fastest, 1e5)?;
        let smallest = p.a2.min(p.a3);
        if smallest < 1e-6 {
            return Err(ArmError::Impossible {
                what: "a2 and a3 must be lengths above a micrometre",
                value: smallest,
            });
        }
        if let Some(value) = p.fastest.into_iter().find(|w| *w <= 0.0) {
            return Err(ArmError::Impossible {
                what: "the fastest rate of a joint must be above zero",
                value,
            });
        }
        Ok(Self::of(p))
    }

    fn of(p: Parameters) -> Self {
        let [o1, o2, o3, o4, o5] = p.theta_offset;
        let links = [
            DhLink::new(p.a1, FRAC_PI_2, p.d1, o1),
            DhLink::new(p.a2, 0.0, 0.0, o2),
            DhLink::new(p.a3, 0.0, 0.0, o3),
            DhLink::new(p.a4, FRAC_PI_2, 0.0, o4),
            DhLink::new(0.0, 0.0, p.d5, o5),
        ];
        Self { p, links }
    }

    /// Table 2.1 of the source document; see [`Parameters::published`].
    #[must_use]
    pub fn published() -> Self {
        Self::of(Parameters::published())
    }

    /// The published URDF; see [`Parameters::urdf`].
    #[must_use]
    pub fn urdf() -> Self {
        Self::of(Parameters::urdf())
    }

    /// Parameters it was made from.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.p
    }

    /// The five links, standard Denavit-Hartenberg.
    #[must_use]
    pub fn links(&self) -> &[DhLink; JOINTS] {
        &self.links
    }

    /// Ranges of the joints.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.p.limits
    }

    /// The encoders' angles in the model's convention.
    #[must_use]
    pub fn seed_joints(&self, u: &DriverJoints) -> TableJoints {
        u.to_seed(&self.p.driver_zero)
    }

    /// The model's angles in the encoders' convention.
    #[must_use]
    pub fn driver_joints(&self, q: &TableJoints) -> DriverJoints {
        q.to_driver(&self.p.driver_zero)
    }

    /// Pose of the base frame on the URDF's `arm_link_0`: 24 mm forward; preset `seed` 32 mm below.
    #[must_use]
    pub fn t_armlink0_base(&self) -> Transform<ArmLink0, Base> {
        let r = Vector3::new(0.024, 0.0, 0.115 - self.p.d1);
        Transform::new(Dcm::identity(), In::assume(r))
    }

    /// Pose of the tool frame on the URDF's `arm_link_5`: half a turn about z, which is why the
    /// upright arm has a yaw of 180 degrees; preset `seed` 88 mm further out.
    #[must_use]
    pub fn t_armlink5_tool(&self) -> Transform<ArmLink5, Tool> {
        let half_turn = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
        let r = Vector3::new(0.0, 0.0, self.p.d5 - 0.130);
        Transform::new(Dcm::assume(half_turn), In::assume(r))
    }
}
