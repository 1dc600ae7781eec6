//! Finished bytes -> an object in a store, whole or not at all. I/O, by whoever knows the way.
//!
//! Apart from the other outputs because a store takes an object as a whole: what is written goes into a file without
//! a name, and
//! is brought there when it is complete. A run that ends before leaves nothing in the store. This crate knows no way
//! itself; a program that does says so once ([`upload_by`]).

use crate::address::Address;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::PathBuf;
use std::sync::OnceLock;
use strapd_attitude::diagnostic::Diagnostic;

/// Schemes of addresses that are written to.
pub(super) const SCHEMES: [&str; 3] = ["s3", "gs", "az"];

/// Way by which objects are put into stores. What it fails with does not begin with the address, and holds no part of
/// it that is not printed.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Whether an object is there already, or none can be written.
    pub exists: fn(&Address) -> std::result::Result<bool, Diagnostic>,
    /// Puts the bytes of a file there, as a whole, over what is there.
    pub put: fn(&Address, File) -> std::result::Result<(), Diagnostic>,
}

static WAY: OnceLock<Way> = OnceLock::new();

/// Says how objects are put into stores, once for this process.
///
/// # Errors
/// It was said before.
pub fn upload_by(way: Way) -> std::result::Result<(), Way> {
    WAY.set(way)
}

/// Whether anybody knows the way.
pub(super) fn is_possible() -> bool {
    WAY.get().is_some()
}

/// An object that is being made.
#[derive(Debug)]
pub(super) struct Upload {
    file: File,
    address: Address,
    /// Name in messages.
    pub(super) shown: PathBuf,
    force: bool,
}

impl Upload {
    /// Asks whether the place is free, and begins.
    ///
    /// # Errors
    /// [`Error::OutputExists`]; [`Error::Write`]: the store does not answer, or says no; there is no room for a file.
    pub(super) fn begin(address: &Address, force: bool) -> Result<Upload> {
        let shown = PathBuf::from(address.place());
        let fail = |source| Error::Write {
            path: shown.clone(),
            source,
        };
        let way = WAY
            .get()
            .ok_or_else(|| fail(io::ErrorKind::Unsupported.into()))?;
        let exists = (way.exists)(address).map_err(|why| fail(io::Error::other(why)))?;
        if exists && !force {
            return Err(Error::OutputExists { path: shown });
        }
        let file = tempfile::tempfile().map_err(|why| {
            let what = format!(
                "it is kept in {} until it is whole: {why}",
                std::env::temp_dir().display()
            );
            fail(io::Error::other(
                Diagnostic::new(what).help("TMPDIR=FOLDER with room, or write a file first"),
            ))
        })?;
        Ok(Upload {
            file,
            address: address.clone(),
            shown,
            force,
        })
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)
    }

    /// Brings it there.
    ///
    /// # Errors
    /// As [`Upload::begin`]; nothing is there then.
    pub(super) fn finish(mut self) -> Result<()> {
        let fail = |source| Error::Write {
            path: self.shown.clone(),
            source,
        };
        self.file.rewind().map_err(fail)?;
        let way = WAY
            .get()
            .ok_or_else(|| fail(io::ErrorKind::Unsupported.into()))?;
        // Somebody may have been there meanwhile.
        let exists = (way.exists)(&self.address).map_err(|why| fail(io::Error::other(why)))?;
        if exists && !self.force {
            return Err(Error::OutputExists { path: self.shown });
        }
        (way.put)(&self.address, self.file).map_err(|why| Error::Write {
            path: self.shown,
            source: io::Error::other(why),
        })
    }
}
