//! Arguments that name the frames of attitudes, and the mounting that a recording states between two of them. I/O.
//!
//! Apart from the commands because a replay and the daemon take the same ones.

use crate::error::Result;
use crate::pipeline::mounting;
use crate::sink::{FrameNames, Transforms};
use clap::{Args, ValueEnum};
use strapd_attitude::estimate::EstimationSettings;
use strapd_recording::pool::Pool;
use strapd_recording::{Input, Selection};

/// Frames of the world, and transforms to it.
#[derive(Args, Debug, Clone)]
pub struct Frames {
    /// Transforms on /tf, of MCAP files and for viewers: from the world to the sensor, from the sensor to the world
    /// (where its frame has a parent already), or none
    #[arg(long, value_enum, default_value = "forward", help_heading = "Output")]
    pub tf: TransformsArg,
    /// Name of the world's frame in outputs [default: world]
    #[arg(long, value_name = "NAME", help_heading = "Output")]
    pub world_frame: Option<String>,
}

/// Frame of a robot whose attitude is wanted.
#[derive(Args, Debug, Clone, Default)]
pub struct BaseFrame {
    /// Give the attitude of this frame of the robot, on which the log's /tf_static says how the sensor is mounted:
    /// the sensor's own frame keeps its one parent
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "mount",
        help_heading = "Output"
    )]
    pub base_frame: Option<String>,
}

impl BaseFrame {
    /// Puts the mounting on that frame, where one is named, into the settings.
    ///
    /// # Errors
    /// Those of [`mounting::read`].
    pub(super) fn put(
        &self,
        settings: &mut EstimationSettings,
        (input, selection): (&Input, &Selection),
        pool: &Pool,
    ) -> Result<()> {
        if let Some(base) = &self.base_frame {
            settings.mount = Some(mounting::read(input, selection, base, pool)?);
        }
        Ok(())
    }
}

/// `--tf`.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum TransformsArg {
    /// The world is the parent.
    Forward,
    /// The sensor is the parent.
    Reverse,
    /// Absence of transforms.
    None,
}

impl Frames {
    /// The names, with that of the body.
    pub(super) fn names(&self, body: Option<String>) -> FrameNames {
        FrameNames {
            body,
            world: self.world_frame.clone(),
            transforms: match self.tf {
                TransformsArg::Forward => Transforms::Forward,
                TransformsArg::Reverse => Transforms::Reverse,
                TransformsArg::None => Transforms::None,
            },
        }
    }
}
