//! A stream -> a file without a name, which goes with this process. I/O.
//!
//! Apart from the reader because it is for containers alone whose order is not that of their bytes: a database, a video.

use super::read_error;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;

/// Bytes that are kept at most.
const MOST: u64 = 8 << 30;

/// Keeps a stream; `name` is what errors call it.
///
/// # Errors
/// [`Error::Read`]; [`Error::NoRoom`], also for a stream that is longer than is kept.
pub(super) fn of(name: &Path, mut from: impl Read) -> Result<File> {
    let no_room = |source| Error::NoRoom {
        path: name.to_owned(),
        source,
    };
    let mut file = tempfile::tempfile().map_err(no_room)?;
    let mut block = vec![0; 1 << 18];
    let mut have = 0;
    loop {
        let read = match from.read(&mut block) {
            Ok(0) => return Ok(file),
            Ok(read) => read,
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            Err(e) => return Err(read_error(name, have, e)),
        };
        have += read as u64;
        if have > MOST {
            let why = format!("more than {} GiB", MOST >> 30);
            return Err(no_room(std::io::Error::new(ErrorKind::FileTooLarge, why)));
        }
        file.write_all(block.get(..read).unwrap_or(&[]))
            .map_err(no_room)?;
    }
}
