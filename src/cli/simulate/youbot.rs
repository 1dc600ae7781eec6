//! `strapd simulate youbot`. Pure but for reading the path's file.

use super::{Made, parameter, sampling::Common};
use crate::cli::model::youbot::{Unit, trajectory};
use crate::error::{Error, Result};
use clap::Args;
use std::io::Read;
use std::path::{Path, PathBuf};
use strapd_bodies::motion::Motion;
use strapd_bodies::synthetic::ForceSampling;

/// Longest file taken for a path, bytes.
const LONGEST: u64 = 1 << 22;

/// An IMU on the gripper of the KUKA youBot's arm: the truth is its forward kinematics.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd simulate youbot -o arm.mcap                        every joint swings between its stops
  strapd simulate youbot --trajectory path.json -o arm.mcap

The file holds one JSON object, as `strapd model youbot trajectory --help` describes it:
  {\"points\":[[0,0,0,0,0],[90,-20,60,45,-100]],\"mount\":{\"r\":[0,0.03,0]}}      with --degrees

World: z up along the arm's first axis, x forward. Body: the IMU's axes.")]
pub struct Youbot {
    /// The path, a JSON file; without it every joint swings
    #[arg(long, value_name = "FILE")]
    pub trajectory: Option<PathBuf>,
    /// Angles in that file are in degrees
    #[arg(long)]
    pub degrees: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

impl Youbot {
    pub(super) fn made(&self) -> Result<Made> {
        let unit = if self.degrees {
            Unit::Degrees
        } else {
            Unit::Radians
        };
        let (text, name) = match &self.trajectory {
            None => ("{}".to_owned(), "demonstration".to_owned()),
            Some(path) => {
                let text = read(path)?;
                (text, path.display().to_string())
            }
        };
        let refused = |why: String| Error::usage(format!("simulate youbot: {name}: {why}"));
        let prepared = trajectory::from_json(&text, unit, self.common.duration).map_err(refused)?;
        let [x, y, z] = prepared.gravity;
        if x != 0.0 || y != 0.0 {
            return Err(refused(format!(
                "gravity {x},{y},{z}: only along z here, the world's z points up"
            )));
        }
        let mut notes = Vec::new();
        if prepared.duration < self.common.duration {
            notes.push(format!(
                "the path ends at {} s, and the arm stands from there on; --duration",
                prepared.duration
            ));
        }
        let mut parameters = vec![parameter("slow_down", prepared.factor)];
        if self.trajectory.is_some() {
            // What was driven, not where it lay: the same path is the same bytes.
            let spec: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
            parameters.push(parameter("trajectory", spec));
            parameters.push(parameter("degrees", self.degrees));
        }
        Ok(Made {
            motion: Motion::Gripper(Box::new(prepared.gripper)),
            force: ForceSampling::Instant,
            gravity: Some(-z),
            parameters,
            notes,
        })
    }
}

/// The file's text: a path is short, and whatever is longer is not one.
fn read(path: &Path) -> Result<String> {
    let fail = |source| strapd_recording::Error::Read {
        path: path.to_owned(),
        offset: 0,
        source,
    };
    let mut text = String::new();
    let file = std::fs::File::open(path).map_err(fail)?;
    file.take(LONGEST + 1)
        .read_to_string(&mut text)
        .map_err(fail)?;
    if text.len() as u64 > LONGEST {
        return Err(Error::usage(format!(
            "--trajectory {}: longer than {LONGEST} bytes, which no path is",
            path.display()
        )));
    }
    Ok(text)
}
