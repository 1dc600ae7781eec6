//! `strapd simulate top`. Pure.

use super::{Made, parameter, sampling::Common};
use crate::cli::model::top_flags::TopFlags;
use crate::error::{Error, Result};
use clap::Args;
use strapd_bodies::motion::Motion;
use strapd_bodies::synthetic::ForceSampling;

/// A heavy symmetric top on a fixed pivot: spins, precesses, nods.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd simulate top -o top.mcap                             the document's: cusped, 20 Hz, 54.57 deg
  strapd simulate top --case steady-slow --duration 60 -o top.mcap
  strapd simulate top --euler 0,90,0 --euler-rates 40,0,3600 -o wheel.mcap")]
pub struct Top {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub top: TopFlags,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

impl Top {
    pub(super) fn made(&self) -> Result<Made> {
        let refused = |e| Error::usage(format!("simulate top: {e}"));
        let top = self.top.body()?;
        let start = self.top.start(&top)?;
        let motion = top.exact(&start).map_err(refused)?;
        Ok(Made {
            motion: Motion::HeavyBody(Box::new(motion)),
            force: ForceSampling::Instant,
            gravity: Some(top.gravity()),
            parameters: self
                .top
                .parameters()
                .into_iter()
                .map(|(name, value)| parameter(name, value))
                .collect(),
            notes: TopFlags::notes(&top, &start),
        })
    }
}
