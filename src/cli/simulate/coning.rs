//! `strapd simulate coning`. Pure.

use super::{Made, parameter, sampling::Common};
use crate::error::{Error, Result};
use clap::Args;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_bodies::motion::{self, Motion};
use strapd_bodies::synthetic::ForceSampling;

/// The axis runs round a cone: the worst case of attitude integration.
#[derive(Args, Debug)]
pub struct Coning {
    /// Half-angle of the cone, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 10.0,
        allow_negative_numbers = true
    )]
    pub half_angle_deg: f64,
    /// Turns round the cone a second
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 3.0,
        allow_negative_numbers = true
    )]
    pub frequency_hz: f64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

impl Coning {
    pub(super) fn made(&self) -> Result<Made> {
        let coning = motion::Coning::new(self.half_angle_deg.to_radians(), self.frequency_hz)
            .map_err(|e| {
                Error::usage(
                    Diagnostic::new(format!("simulate coning: {e}"))
                        .help("--half-angle-deg up to 180, --frequency-hz up to 15000"),
                )
            })?;
        Ok(Made {
            motion: Motion::Coning(coning),
            force: ForceSampling::Instant,
            gravity: None,
            parameters: vec![
                parameter("half_angle_deg", self.half_angle_deg),
                parameter("frequency_hz", self.frequency_hz),
            ],
            notes: Vec::new(),
        })
    }
}
