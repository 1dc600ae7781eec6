//! Joint angles of the KUKA youBot's arm <-> pose, motion, forces and torques of its gripper. Pure.
//!
//! A stage of its own because an IMU on the gripper is a gyro whose exact attitude is the forward
//! kinematics: an end-to-end check of the propagator that no integrator had a hand in.
//!
//! | file | arrow |
//! |---|---|
//! | `geometry`, `limits`, `joints` | lengths, ranges, the two joint conventions |
//! | `forward` | joints -> pose |
//! | `inverse`, `policy` | pose -> up to four joint vectors, or by how much it is out of reach |
//! | `jacobian`, `recursion` | joint motion <-> motion of the gripper and of every link |
//! | `dynamics`, `masses` | motion -> joint torques; energies; what the links weigh |
//! | `path`, `follow`, `timing` | paths in joint space and of the gripper -> joint motion in time |
//! | `imu` | joint motion -> what an IMU mounted on the gripper reads |
//!
//! # Convention
//! - Base frame: z up along the axis of joint 1, x forward, origin in the mounting plane (preset
//!   `seed`) or in that of `arm_link_0` (preset `urdf`). Tool frame: z is the approach, out of the
//!   gripper; the upright arm has its tool turned by half a turn about z.
//! - Joint angles have two conventions, and each is a type: [`TableJoints`] of the document's table
//!   2.1, and [`DriverJoints`] of the encoders, ROS and the URDF. They run in opposite directions.
//! - Gravity is an argument.
//!
//! # Source
//! The source document (Antonov, Artemov, ITMO 2017, sections 1, 2, appendices A and B) as far as it
//! is right; `crates/bodies/tests/bodies/youbot/errata.rs` names each place where it is not (Y1 to Y21). Lengths: its
//! table 2.1 and the URDF of mas-group/youbot_description (commit 65489aa). Craig, Introduction to
//! Robotics, chapters 5 and 6, for the recursions.
//!
//! # Example
//! ```
//! use strapd_bodies::youbot::{Arm, Policy, TableJoints};
//! let arm = Arm::published();
//! let q = TableJoints::from_degrees([20.0, -30.0, -80.0, 60.0, 10.0])?;
//! let t_base_tool = arm.forward(&q);
//! let found = arm.inverse(&t_base_tool, Policy::default(), Some(&q))?;
//! let nearest = found.nearest(&q)?;
//! assert!(nearest.q.angles().iter().zip(q.angles()).all(|(a, b)| (a - b).abs() < 1e-12));
//! # Ok::<(), strapd_bodies::youbot::ArmError>(())
//! ```
//! The encoders' angles are not those of the model:
//! ```compile_fail,E0308
//! use strapd_bodies::youbot::{Arm, DriverJoints};
//! let u = DriverJoints::new([2.9, 1.1, -2.5, 1.8, 2.9])?;
//! let pose = Arm::urdf().forward(&u); // Arm::urdf().seed_joints(&u) was meant
//! # Ok::<(), strapd_bodies::youbot::ArmError>(())
//! ```

mod dynamics;
mod error;
mod follow;
mod forward;
mod geometry;
mod imu;
mod inverse;
mod jacobian;
mod joints;
mod limits;
mod masses;
mod path;
mod policy;
mod recursion;
mod timing;

pub use dynamics::{Actuator, Dynamics, Energy, Wrench};
pub use error::{ArmError, Reach};
pub use follow::{Follower, ToolMotion, ToolPath, ToolTrack};
pub use geometry::{Arm, Parameters};
pub use imu::{Gripper, ImuMount, ImuReading};
pub use inverse::{BaseTurn, Elbow, Solution, Solutions};
pub use jacobian::{Singularity, Twist};
pub use joints::{
    DriverJoints, DriverMotion, DriverTorques, JOINTS, SeedTorques, TableJoints, TableMotion,
};
pub use limits::Limits;
pub use masses::{gripper, published_links};
pub use path::{JointPath, Leg, Sinusoid};
pub use policy::Policy;
pub use recursion::LinkMotion;
pub use timing::slow_down_factor;

/// The arm's base: z up along joint 1, x forward.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Base {}
/// The gripper: z is the approach direction, the origin the tool point.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Tool {}
/// One of the five link frames; which one is the index of the array it stands in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Link {}
/// The URDF's first link of the arm, bolted to the platform.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ArmLink0 {}
/// The URDF's last link of the arm, the flange.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ArmLink5 {}
