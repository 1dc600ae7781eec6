//! A stream -> a file without a name that is read as often as is needed. I/O.
//!
//! Apart from the other inputs because these are where they were: of what comes only once nothing is left but what is
//! kept here.

use super::{Input, MOST, Rereadable, Source};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::recording::warn::Warn;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;

impl Input {
    pub(super) fn keep(source: Source, mut from: impl Read, warn: &Warn) -> Result<Input> {
        let name = source.name();
        let mut file = tempfile::tempfile().map_err(|e| no_room(&name, &e))?;
        let mut block = vec![0; 1 << 18];
        let mut head = Vec::new();
        let mut have = 0;
        loop {
            let read = match from.read(&mut block) {
                Ok(0) => break,
                Ok(read) => read,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(source) => {
                    return Err(Error::Read {
                        path: name,
                        offset: have,
                        source,
                    });
                }
            };
            let room = usize::try_from(MOST - have).unwrap_or(usize::MAX);
            let taken = block.get(..read.min(room)).unwrap_or_default();
            let wanted = crate::format::HEAD.saturating_sub(head.len());
            head.extend_from_slice(taken.get(..wanted.min(taken.len())).unwrap_or_default());
            file.write_all(taken).map_err(|e| no_room(&name, &e))?;
            have += taken.len() as u64;
            if taken.len() < read {
                warn.say(&format!(
                    "{}: only the first {} GiB were looked at; save it to a file to look at all of it",
                    name.display(),
                    MOST >> 30
                ));
                break;
            }
        }
        if have == 0 {
            return Err(Error::Empty { path: name });
        }
        let named = || Format::of_name(&name);
        Ok(Input {
            format: Format::of_bytes(&head)
                .or_else(named)
                .or_else(|| Format::of_shape(&head))
                .unwrap_or(Format::Mcap),
            kept: Some(Rereadable::File(Arc::new(file))),
            source,
            name,
            beside: Vec::new(),
            orientation: None,
            parts: Vec::new(),
            unpacked: None,
            warn: warn.clone(),
        })
    }
}

fn no_room(name: &Path, why: &std::io::Error) -> Error {
    Error::Unsupported {
        path: name.to_owned(),
        what: Diagnostic::new(format!(
            "what comes only once is kept in {} to be looked at twice: {why}",
            std::env::temp_dir().display()
        ))
        .help("TMPDIR=FOLDER with room, or save it to a file first"),
    }
}
