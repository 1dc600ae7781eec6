//! Name of a file that is missing -> the nearest one beside it. I/O.
//!
//! Apart from the opening because a wrong letter in a name is an everyday error, and an error is no place to read folders.

use crate::text;
use std::io;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;

/// Files of a folder that are looked at.
const MOST: usize = 10_000;

/// The error of opening `path`, with the name that may have been meant.
pub(crate) fn named(path: &Path, source: io::Error) -> io::Error {
    if source.kind() != io::ErrorKind::NotFound {
        return source;
    }
    match nearest_file(path) {
        None => source,
        Some(near) => {
            let said = Diagnostic::new(source.to_string()).help(format!("there is {near}"));
            io::Error::new(io::ErrorKind::NotFound, said)
        }
    }
}

fn nearest_file(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_str()?;
    let folder = path.parent()?;
    let place = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let names = std::fs::read_dir(place).ok()?.take(MOST).flatten();
    let names = names.filter_map(|entry| entry.file_name().into_string().ok());
    let name = text::nearest(wanted, names)?;
    Some(folder.join(name).display().to_string())
}
