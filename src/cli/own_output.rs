//! Recordings as they were named -> those that are not attitudes made before. I/O: looks at their first bytes.

use super::outputs::shown;
use crate::error::{Error, Result};
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::MadeBefore;

/// Leaves out of several recordings what strapd made of one, each with a line: a pattern of the shell takes both. Who names a
/// topic, or one file alone, means it.
///
/// # Errors
/// [`Error::Usage`]: nothing is left.
pub(super) fn without<P: AsRef<Path>>(named: Vec<P>, topic: Option<&str>) -> Result<Vec<P>> {
    if named.len() < 2 || topic.is_some() {
        return Ok(named);
    }
    let count = named.len();
    let mut left = Vec::new();
    for recording in named {
        let path = recording.as_ref();
        match MadeBefore::in_file(path) {
            None => left.push(recording),
            Some(made) => {
                let name = shown(&path.to_string_lossy());
                tracing::warn!("{name}: left out: {made}; alone, or with --topic NAME, it is read");
            }
        }
    }
    if left.is_empty() {
        return Err(Error::usage(
            Diagnostic::new(format!("none of these {count} files is a recording"))
                .help("name the recordings; attitudes are compared by strapd compare"),
        ));
    }
    Ok(left)
}
