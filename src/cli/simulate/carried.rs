//! `strapd simulate walking`, `running`, `circling`, `arm`, `car`, `vibration`, `drone`, `hand`, `boat`. Pure.

use super::sampling::{Common, GRAVITY};
use super::{Made, parameter};
use clap::{Args, ValueEnum};
use strapd_bodies::motion::{Carrier, Motion, Worn};
use strapd_bodies::synthetic::ForceSampling;

/// A sensor that somebody or something carries: it accelerates, and begins at rest.
#[derive(Args, Debug)]
pub struct Carried {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

impl Carried {
    pub(super) fn made(&self, carrier: Carrier) -> Made {
        made(carrier, &self.common, Vec::new())
    }
}

/// Place where a person wears it.
#[derive(ValueEnum, Clone, Copy, PartialEq, Eq, Debug)]
pub enum WornArg {
    /// Waist
    Waist,
    /// Hand of a swinging arm
    Hand,
    /// Foot
    Foot,
}

/// A person who goes: stands for 3 s, then walks or runs, turning off every ten seconds or so.
#[derive(Args, Debug)]
pub struct Gait {
    /// Place where the sensor is worn
    #[arg(long, value_enum, default_value = "waist")]
    pub worn: WornArg,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

impl Gait {
    pub(super) fn made(&self, carrier: fn(Worn) -> Carrier) -> Made {
        let (worn, name) = match self.worn {
            WornArg::Waist => (Worn::Waist, "waist"),
            WornArg::Hand => (Worn::Hand, "hand"),
            WornArg::Foot => (Worn::Foot, "foot"),
        };
        made(carrier(worn), &self.common, vec![parameter("worn", name)])
    }
}

fn made(carrier: Carrier, common: &Common, parameters: Vec<(String, String)>) -> Made {
    Made {
        motion: Motion::Carried(Box::new(carrier.motion(common.seed, GRAVITY))),
        force: ForceSampling::AsGyro,
        gravity: None,
        parameters,
        notes: Vec::new(),
    }
}
