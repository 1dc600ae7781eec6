//! `strapd model youbot fk|ik|jacobian|dynamics|trajectory`: the arm as a filter. I/O.

mod dynamics;
mod kinematics;
mod table;
pub(crate) mod trajectory;

use super::filter::{self, Refusal};
use crate::cli::Outcome;
use crate::error::Result;
use clap::{Args, Subcommand};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::io::IsTerminal;
use strapd_attitude::frames::Dcm;
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::youbot::{Arm, ArmError, DriverJoints, DriverMotion, TableJoints, TableMotion};

/// The KUKA youBot's arm: kinematics, forces, paths.
#[derive(Args, Debug)]
pub struct Youbot {
    /// Question about the arm
    #[command(subcommand)]
    pub what: What,
}

/// The questions.
#[derive(Subcommand, Debug)]
pub enum What {
    /// Joints -> pose of the gripper
    #[command(after_help = "Request: {\"q\":[5]}, and for all of these commands
  \"preset\":\"seed\"|\"urdf\"     lengths of the document's table (default) or of the URDF
  \"joints\":\"seed\"|\"driver\"   what joint angles mean: the document's q (default) or the encoders' u

Answer: p (m, base axes), r (rows, tool to base), quat, within_limits; a request of ik as it is.

Example:
  echo '{\"q\":[0,0,0,90,0]}' | strapd model youbot fk --degrees --table")]
    Fk(Flags),
    /// Pose of the gripper -> every joint vector that takes it there
    #[command(
        after_help = "Request: {\"p\":[3],\"r\":[[3],[3],[3]]} or {\"p\":[3],\"quat\":{\"w\":,\"x\":,\"y\":,\"z\":}}, and
  \"policy\":\"reject\"|\"keep-position\"|\"keep-approach\"|\"weighted\"   for poses five joints cannot take
  \"tolerance\":{\"position\":1e-9,\"angle\":1e-9}   of reject (m, rad)
  \"length\":0.3      of weighted: the distance in m that counts as much as a radian
  \"q_current\":[5]   the solution nearest to these is chosen; \"weights\":[5] to weigh joints

Answer: solutions (q, within_limits, base front|back, elbow up|down|straight), chosen (index; absent
when every solution is past a stop), residual from the pose asked for (position m, angle), reach_excess
(m, for theta1 and its opposite), singular (elbow, theta1-free, approach-free)."
    )]
    Ik(Flags),
    /// Joints -> Jacobian; joint rates <-> velocity of the gripper
    #[command(
        after_help = "Request: {\"q\":[5]}, and \"qd\":[5] for the velocity, or \"twist\":[6] = [v, w] for the rates;
  \"allowed\":1e-9   of the twist along the direction five joints lack

Answer: jacobian (6 rows, [v; w] in base axes, m and rad whatever --degrees says), singularity (elbow: sine,
base: distance), twist or qd."
    )]
    Jacobian(Flags),
    /// Joint motion -> torques, mass matrix, what an IMU on the tool reads
    #[command(
        after_help = "Request: {\"q\":[5],\"qd\":[5],\"qdd\":[5]}; missing rates and accelerations are zero; and
  \"gravity\":[0,0,-9.80665]   m/s^2, base axes
  \"tip\":{\"force\":[3],\"moment\":[3]}   what the tool does to the world, N and N m, tool axes
  \"payload\":{\"mass\":,\"r_og_b\":[3],\"inertia_cg\":[[3]x3]}   held, in the tool frame
  \"gripper\":true   the two-finger gripper is mounted

Answer: tau (N m), gravity_torques, mass_matrix, energy (J), gyro and accel of an IMU at the tool point."
    )]
    Dynamics(Flags),
    /// A path -> joints, rates, accelerations, poses, IMU readings in time
    #[command(after_help = "Request: one of
  {}                                             the simulator's own: every joint swings
  {\"points\":[[5],..]}                            rest to rest through joints, as fast as allowed
  {\"sinusoids\":[{\"centre\":,\"amplitude\":,\"angular_frequency\":,\"phase\":} x5]}   of each joint
  {\"line\":{\"from\":[5],\"to\":[5],\"duration\":}}    of the gripper: x, y, z, pitch, roll
  {\"waves\":[{..} x5]}                            of the gripper: x, y, z, pitch, roll
and \"q_start\":[5] (the branch nearest to it), \"duration\" (s; needed where the path has no end),
\"rate_hz\" (default 10), \"slow_down\":true (stretch time until no joint exceeds its fastest rate),
\"gravity\":[3], \"mount\":{\"r\":[3],\"quat\":{..}} (the IMU in the tool frame).

Pitch 0 points down, pi/2 forward. Frequencies and phases are angles too.

Answer: slow_down (factor), duration, samples of t, q, qd, qdd, p, quat, gyro, accel.")]
    Trajectory(Flags),
}

/// Flags of every question.
#[derive(Args, Debug, Clone, Copy)]
pub struct Flags {
    /// Every angle of joints, requests and answers in degrees
    #[arg(long)]
    pub degrees: bool,
    /// Answers as text for people; so they are when requests are typed
    #[arg(long)]
    pub table: bool,
}

/// Runs it.
///
/// # Errors
/// Standard input or output fails.
pub(super) fn run(command: &Youbot) -> Result<Outcome> {
    match command.what {
        What::Fk(flags) => filter(flags, kinematics::forward),
        What::Ik(flags) => filter(flags, kinematics::inverse),
        What::Jacobian(flags) => filter(flags, kinematics::jacobian),
        What::Dynamics(flags) => filter(flags, dynamics::answer),
        What::Trajectory(flags) => filter(flags, trajectory::answer),
    }
}

/// An answer, or why there is none.
type Answer = std::result::Result<Value, Refusal>;

fn filter<R: DeserializeOwned>(flags: Flags, answer: fn(&R, Unit) -> Answer) -> Result<Outcome> {
    let unit = if flags.degrees {
        Unit::Degrees
    } else {
        Unit::Radians
    };
    let answer = |request: R| answer(&request, unit);
    if flags.table || std::io::stdin().is_terminal() {
        filter::run_as(answer, table::text)
    } else {
        filter::run(answer)
    }
}

/// Unit of angles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Unit {
    Radians,
    Degrees,
}

impl Unit {
    fn read(self, angle: f64) -> f64 {
        match self {
            Unit::Radians => angle,
            Unit::Degrees => angle.to_radians(),
        }
    }
    fn say(self, angle: f64) -> f64 {
        match self {
            Unit::Radians => angle,
            Unit::Degrees => angle.to_degrees(),
        }
    }
}

/// `"preset"`
#[derive(Clone, Copy, Default, Deserialize, Serialize, Debug)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Preset {
    #[default]
    Seed,
    Urdf,
}

/// `"joints"`
#[derive(Clone, Copy, Default, Deserialize, Serialize, Debug)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Convention {
    #[default]
    Seed,
    Driver,
}

/// A quaternion by name, as everywhere.
#[derive(Clone, Copy, Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wxyz {
    w: f64,
    x: f64,
    y: f64,
    z: f64,
}

impl Wxyz {
    fn dcm<To, From>(self) -> std::result::Result<Dcm<To, From>, Refusal> {
        let q = Quaternion::try_from_wxyz([self.w, self.x, self.y, self.z]);
        q.map(|q| q.to_dcm())
            .map_err(|e| refusal(&ArmError::NotARotation(e)))
    }
}

/// The arm, the unit of angles and the convention of joints a request is in.
#[derive(Clone, Copy)]
struct Setting {
    arm: Arm,
    joints: Convention,
    unit: Unit,
}

impl Setting {
    fn new(preset: Preset, joints: Convention, unit: Unit) -> Setting {
        let arm = match preset {
            Preset::Seed => Arm::published(),
            Preset::Urdf => Arm::urdf(),
        };
        Setting { arm, joints, unit }
    }

    fn read(&self, q: [f64; 5]) -> std::result::Result<TableJoints, Refusal> {
        let q = q.map(|angle| self.unit.read(angle));
        match self.joints {
            Convention::Seed => TableJoints::new(q),
            Convention::Driver => DriverJoints::new(q).map(|u| self.arm.seed_joints(&u)),
        }
        .map_err(|e| refusal(&e))
    }

    fn read_motion(
        &self,
        q: [f64; 5],
        qd: [f64; 5],
        qdd: [f64; 5],
    ) -> std::result::Result<TableMotion, Refusal> {
        let zero = &self.arm.parameters().driver_zero;
        let (qd, qdd) = (
            qd.map(|w| self.unit.read(w)),
            qdd.map(|a| self.unit.read(a)),
        );
        let q = self.read(q)?;
        match self.joints {
            Convention::Seed => TableMotion::new(q, qd, qdd),
            Convention::Driver => {
                DriverMotion::new(q.to_driver(zero), qd, qdd).map(|m| m.to_seed(zero))
            }
        }
        .map_err(|e| refusal(&e))
    }

    fn say(&self, q: &TableJoints) -> [f64; 5] {
        let q = match self.joints {
            Convention::Seed => q.angles(),
            Convention::Driver => self.arm.driver_joints(q).angles(),
        };
        q.map(|angle| self.unit.say(angle))
    }

    /// Rates, accelerations and torques: the conventions differ by their sign.
    fn turned(&self, values: [f64; 5]) -> [f64; 5] {
        match self.joints {
            Convention::Seed => values,
            // Not -0.
            Convention::Driver => values.map(|x| 0.0 - x),
        }
    }

    fn say_rates(&self, rates: [f64; 5]) -> [f64; 5] {
        self.turned(rates).map(|w| self.unit.say(w))
    }
}

/// Why there is no answer, in words and as a word.
fn refusal(why: &ArmError) -> Refusal {
    Refusal {
        error: why.to_string(),
        reason: Some(why.code()),
    }
}

/// A rotation's quaternion and rows.
fn orientation<To, From>(c: &Dcm<To, From>) -> (Value, Value) {
    let [w, x, y, z] = Quaternion::from_dcm(c).wxyz();
    let rows: Vec<[f64; 3]> = c
        .as_matrix()
        .row_iter()
        .map(|r| [r[0], r[1], r[2]])
        .collect();
    (json!({ "w": w, "x": x, "y": y, "z": z }), json!(rows))
}
