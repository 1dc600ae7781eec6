//! Arguments that name the frames of attitudes. Pure.
//!
//! Apart from the commands because a replay and the daemon take the same ones.

use crate::sink::{FrameNames, Transforms};
use clap::{Args, ValueEnum};

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
