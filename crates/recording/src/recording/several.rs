//! Files that are said to be one recording -> whether they can be. I/O: asks what they are.
//!
//! Apart from the parts because nothing is opened yet: what comes only once or was given twice is told before a
//! second of reading.

use crate::error::{Error, Result};
use crate::remote_object;
use crate::text::printable;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::JOIN;

/// Parts of a recording. Who has more has an archive.
const MOST: usize = 1000;

/// Checks what is given as the parts of a recording; the order is found later.
///
/// # Errors
/// A part comes only once, is a folder, or is given twice.
pub(super) fn checked(paths: &[PathBuf]) -> Result<()> {
    if paths.len() > MOST {
        let first = paths.first().map(|first| shown(first)).unwrap_or_default();
        return Err(Error::unsupported(
            &first,
            Diagnostic::new(format!(
                "{} files are to be joined, of at most {MOST}",
                paths.len()
            ))
            .help("a part of them at a time"),
        ));
    }
    let mut known: Vec<(PathBuf, &PathBuf)> = Vec::new();
    for path in paths {
        if let Some(address) = remote_object::meant(&path.to_string_lossy()) {
            return Err(Error::unsupported(
                Path::new(&address.place()),
                Diagnostic::new("is elsewhere, and parts are read from files")
                    .help(format!("save it to a file; {JOIN} takes files")),
            ));
        }
        let found = std::fs::metadata(path);
        let is_folder = found.as_ref().is_ok_and(Metadata::is_dir);
        let is_stream = found.is_ok_and(|found| !found.is_file()) && !is_folder;
        if path.as_os_str() == "-" || is_stream {
            return Err(Error::unsupported(
                path,
                Diagnostic::new("comes only once, and parts are read twice")
                    .help(format!("save it to a file; {JOIN} takes files")),
            ));
        }
        if is_folder {
            return Err(Error::unsupported(
                path,
                Diagnostic::new("a folder").help(format!(
                    "{JOIN} takes the files in it; that of a rosbag2 recording needs no {JOIN}"
                )),
            ));
        }
        let place = std::fs::canonicalize(path).map_err(|source| Error::Open {
            path: path.clone(),
            source,
        })?;
        if let Some((_, other)) = known.iter().find(|(known, _)| *known == place) {
            return Err(Error::unsupported(
                path,
                Diagnostic::new(format!(
                    "given twice (as {} too)",
                    printable(&other.display().to_string())
                ))
                .help("leave one out"),
            ));
        }
        known.push((place, path));
    }
    Ok(())
}

/// A part as it is printed, though it should be none.
fn shown(path: &Path) -> PathBuf {
    match remote_object::meant(&path.to_string_lossy()) {
        Some(address) => PathBuf::from(address.place()),
        None => path.to_owned(),
    }
}

/// Name of several files together.
pub(super) fn title(paths: &[PathBuf]) -> PathBuf {
    match paths {
        [] => PathBuf::new(),
        [one] => shown(one),
        [first, rest @ ..] => {
            let first = shown(first);
            PathBuf::from(format!("{} and {} more", first.display(), rest.len()))
        }
    }
}
