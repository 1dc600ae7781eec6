//! `strapd info FILE`.

use super::{Global, Outcome};
use crate::error::Result;
use clap::Args;

/// What a log holds.
#[derive(Args, Debug)]
pub struct Info {
    /// file
    pub file: std::path::PathBuf,
}

/// Runs it.
///
/// # Errors
/// x
pub fn run(_: &Global, _: &Info) -> Result<Outcome> {
    Ok(Outcome::Done)
}
