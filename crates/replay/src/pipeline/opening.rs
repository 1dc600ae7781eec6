//! Source named on a command line -> a recording that can be read again, its warnings logged. I/O.
//!
//! Apart from the reader because that logs nothing itself: it hands out what is to be known as it comes.

use crate::address::Address;
use crate::error::Result;
use std::path::{Path, PathBuf};
use strapd_recording::{Input, Warn};

/// Opens what a command line names.
///
/// # Errors
/// As [`Input::open`].
pub fn open(path: &Path) -> Result<Input> {
    Ok(Input::open(path, &warn())?)
}

/// Opens what is at an address.
///
/// # Errors
/// As [`Input::open`].
pub(super) fn elsewhere(address: &Address) -> Result<Input> {
    open(Path::new(address.typed()))
}

/// Opens several files as one recording.
///
/// # Errors
/// As [`Input::joined`].
pub(super) fn joined(paths: &[PathBuf]) -> Result<Input> {
    Ok(Input::joined(paths, &warn())?)
}

/// Logs what is to be known of a recording.
pub(super) fn warn() -> Warn {
    Warn::by(|what| tracing::warn!("{what}"))
}
