//! `strapd simulate MOTION -o SINK...`: a synthetic gyro with exact truth. I/O.
//!
//! A motion is a subcommand, a file of flags and a row in `Simulate::made`.

mod carried;
mod coning;
mod random;
mod rigid_body;
mod sampling;
mod top;
mod youbot;

use super::progress::Reporter;
use super::{Global, Outcome, outputs, print};
use crate::error::{Error, Result};
use crate::pipeline::position::Position;
use crate::pipeline::simulate;
use clap::{Args, Subcommand};
use sampling::Common;
use std::io::Write;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_bodies::motion::{Carrier, Motion};
use strapd_bodies::synthetic::ForceSampling;
use strapd_recording::pool::Pool;

/// Samples of a synthetic gyro whose true attitude is known exactly.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd simulate top -o top.mcap                        the published top, cusped, 2000 Hz
  strapd simulate top --case looping --duration 60 -o top.ndjson
  strapd simulate coning --half-angle-deg 1 --frequency-hz 10 --rate-hz 400 -o coning.mcap
  strapd simulate walking --worn foot --rate-hz 200 --duration 120 --noise consumer_mems -o walk.mcap
  strapd simulate top -o truth.mcap -o - | strapd replay - -o est.mcap \\
    && strapd compare est.mcap truth.mcap                how good is the integration?
  strapd simulate top --speed 1 -o tcp://127.0.0.1:4550  feeds a strapd serve
  strapd simulate top --page                             in a browser, with play, pause and seek")]
pub struct Simulate {
    /// Motion
    #[command(subcommand)]
    pub motion: Which,
}

/// The motions.
#[derive(Subcommand, Debug)]
pub enum Which {
    /// A heavy symmetric top on a fixed pivot: spins, precesses, nods
    Top(top::Top),
    /// Any rigid body about a fixed point, free or under gravity
    RigidBody(rigid_body::RigidBody),
    /// The axis runs round a cone: the worst case of attitude integration
    Coning(coning::Coning),
    /// An IMU on the gripper of the KUKA youBot's arm
    Youbot(youbot::Youbot),
    /// Sums of sines about each axis, up to a highest frequency
    Random(random::Random),
    /// A person who walks, turns off, stops now and then
    Walking(carried::Gait),
    /// A person who runs
    Running(carried::Gait),
    /// A cart on a circle of 10 m at 4 m/s
    Circling(carried::Carried),
    /// The tool of an arm with two links: from place to place, with rests
    Arm(carried::Carried),
    /// A car in town: pulls away, brakes, turns, stands, its engine running
    Car(carried::Carried),
    /// A machine that shakes: 6 m/s^2 on each axis from 12 to 45 Hz
    Vibration(carried::Carried),
    /// A drone, whose force stays along its own z axis
    Drone(carried::Carried),
    /// A thing in a hand, turned every way, laid down now and then
    Hand(carried::Carried),
    /// A boat on waves of six to twelve seconds
    Boat(carried::Carried),
}

/// A motion, and what is to be said about it.
#[derive(Debug)]
struct Made {
    motion: Motion,
    /// Meaning of a reading of the accelerometer unless the user states one.
    force: ForceSampling,
    /// m/s^2, downwards, where the motion itself depends on it.
    gravity: Option<f64>,
    /// Parameters that were asked for, as they will stand in the metadata.
    parameters: Vec<(String, String)>,
    /// Things to know about it.
    notes: Vec<String>,
}

impl Simulate {
    /// Name, common flags and motion.
    fn made(&self) -> Result<(&'static str, &Common, Made)> {
        Ok(match &self.motion {
            Which::Top(m) => ("top", &m.common, m.made()?),
            Which::RigidBody(m) => ("rigid-body", &m.common, m.made()?),
            Which::Coning(m) => ("coning", &m.common, m.made()?),
            Which::Youbot(m) => ("youbot", &m.common, m.made()?),
            Which::Random(m) => ("random", &m.common, m.made()?),
            Which::Walking(m) => ("walking", &m.common, m.made(Carrier::Walking)),
            Which::Running(m) => ("running", &m.common, m.made(Carrier::Running)),
            Which::Circling(m) => ("circling", &m.common, m.made(Carrier::Circling)),
            Which::Arm(m) => ("arm", &m.common, m.made(Carrier::Arm)),
            Which::Car(m) => ("car", &m.common, m.made(Carrier::Car)),
            Which::Vibration(m) => ("vibration", &m.common, m.made(Carrier::Vibration)),
            Which::Drone(m) => ("drone", &m.common, m.made(Carrier::Drone)),
            Which::Hand(m) => ("hand", &m.common, m.made(Carrier::Hand)),
            Which::Boat(m) => ("boat", &m.common, m.made(Carrier::Boat)),
        })
    }
}

/// Runs it.
///
/// # Errors
/// Flags that cannot be; outputs that cannot be written.
pub fn run(global: &Global, args: &Simulate) -> Result<Outcome> {
    let (name, common, made) = args.made()?;
    let on_stdout = common.outputs.iter().any(|o| o == "-");
    if global.json && on_stdout {
        return Err(Error::usage(
            Diagnostic::new("--json and -o - would both write to stdout")
                .help("give the samples a file name"),
        ));
    }
    outputs::check_distinct(&common.outputs, &[name.to_owned()])?;
    let pool = Pool::new(global.threads)?;
    let (mut simulation, served) = common.simulation(name, made)?;
    let (summary, mut outcome) = served.run(|again| {
        if again {
            simulation
                .targets
                .retain(|target| target.listens().is_some());
        }
        let mut reporter = Reporter::new(global, name);
        let watch = &mut |position: &Position| reporter.update(position);
        let result = simulate::run(simulation.clone(), &pool, watch);
        reporter.finish();
        result
    })?;
    if !summary.broken.is_empty() && outcome == Outcome::Done {
        outcome = Outcome::Lossy;
    }
    if summary.reader_gone {
        return Ok(outcome);
    }
    if global.quiet {
        for warning in summary.warnings() {
            tracing::warn!("{name}: {warning}");
        }
    } else if global.json || on_stdout {
        // A stderr that is gone leaves nobody to tell.
        let _ = std::io::stderr().write_all(summary.text().as_bytes());
    } else {
        print(&summary.text())?;
    }
    if global.json {
        print(&format!("{}\n", summary.json()))?;
    }
    Ok(outcome)
}

/// A flag's value as it stands in the metadata.
fn parameter(name: &str, value: impl std::fmt::Display) -> (String, String) {
    (name.to_owned(), value.to_string())
}
