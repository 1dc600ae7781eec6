//! A page, a chart, a table made by a command -> a file that is whole or absent. I/O.

use super::output::{Flow, Output};
use crate::error::{Error, Result};
use std::io;
use std::path::{Path, PathBuf};

/// A text output, opened before the work so that a name that cannot be is refused at once. Dropped
/// without [`Document::write`], it leaves no file.
#[derive(Debug)]
pub struct Document(Output);

impl Document {
    /// Opens `name`; `-` is standard output.
    ///
    /// # Errors
    /// [`Error::OutputExists`] without `force`, [`Error::OutputIsInput`], [`Error::Write`].
    pub fn create(name: &Path, inputs: &[PathBuf], force: bool) -> Result<Document> {
        if name == Path::new("-") {
            return Ok(Document(Output::Stdout(io::stdout())));
        }
        Output::file(name, inputs, force).map(Document)
    }

    /// Writes all of it, syncs, and gives the file its name.
    ///
    /// # Errors
    /// [`Error::Write`]; [`Error::BrokenPipe`] when nobody reads it.
    pub fn write(mut self, text: &str) -> Result<()> {
        match self.0.write(text.as_bytes())? {
            Flow::Continue => match self.0.finish()? {
                Flow::Continue => Ok(()),
                Flow::Closed => Err(Error::BrokenPipe),
            },
            Flow::Closed => Err(Error::BrokenPipe),
        }
    }
}
