//! `strapd simulate random`. Pure.

use super::{Made, parameter, sampling::Common};
use crate::error::{Error, Result};
use clap::Args;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_bodies::motion::{BandLimited, Motion};
use strapd_bodies::synthetic::ForceSampling;

/// Sums of sines about each axis, up to a highest frequency.
#[derive(Args, Debug)]
pub struct Random {
    /// Root mean square of the rate about each axis, rad/s
    #[arg(
        long,
        value_name = "RAD_S",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub rms: f64,
    /// Highest frequency, Hz
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 5.0,
        allow_negative_numbers = true
    )]
    pub f_max: f64,
    /// Sines about each axis
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub sines: usize,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub common: Common,
}

impl Random {
    pub(super) fn made(&self) -> Result<Made> {
        for (flag, value) in [("--rms", self.rms), ("--f-max", self.f_max)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::usage(format!("{flag} {value}: 0 or more is needed")));
            }
        }
        if self.sines == 0 {
            return Err(Error::usage(format!(
                "--sines 0: 1 to {} are needed",
                BandLimited::MOST_SINES
            )));
        }
        let motion = BandLimited::random(self.common.seed, self.rms, self.f_max, self.sines)
            .map_err(|e| {
                Error::usage(
                    Diagnostic::new(format!("simulate random: {e}")).help(format!(
                        "--sines up to {}, --f-max up to 15000",
                        BandLimited::MOST_SINES
                    )),
                )
            })?;
        Ok(Made {
            motion: Motion::BandLimited(Box::new(motion)),
            force: ForceSampling::Instant,
            gravity: None,
            parameters: vec![
                parameter("rms_rad_s", self.rms),
                parameter("f_max_hz", self.f_max),
                parameter("sines", self.sines),
            ],
            notes: Vec::new(),
        })
    }
}
