//! A table in Parquet -> what a build without the feature `parquet` says of it. Pure.

use crate::columns::Columns;
use std::convert::Infallible;
use std::io::{self, Read, Seek};
use std::marker::PhantomData;
use strapd_attitude::diagnostic::Diagnostic;

/// The four bytes at both ends.
pub(crate) const MAGIC: [u8; 4] = *b"PAR1";

/// Why a file is no table that is read.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// Failure to read it.
    #[expect(dead_code, reason = "nothing is read of it")]
    Read(io::Error),
    /// Refusal of its contents.
    Not(Diagnostic),
}

/// Rows, of which there are none.
#[derive(Debug)]
pub struct Rows<S>(Infallible, PhantomData<S>);

impl<S: Read + Seek> Rows<S> {
    /// # Errors
    /// Always.
    pub(crate) fn open(_: S, _: Option<&Columns>) -> Result<Rows<S>, Trouble> {
        let what = "a Parquet file: this strapd was built without the feature parquet";
        Err(Trouble::Not(Diagnostic::new(what).help(
            "build it with that feature; or duckdb -c \"copy (select epoch_ns(stamp) as stamp_ns, * exclude stamp from 'FILE') to 'log.csv'\" makes a table that is read, `stamp` being its column of times",
        )))
    }

    pub(crate) fn with_bits(self) -> Rows<S> {
        match self.0 {}
    }
}

impl<S> Read for Rows<S> {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        match self.0 {}
    }
}
