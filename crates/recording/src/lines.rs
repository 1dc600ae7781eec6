//! Lines of JSON, or rows of a table, from a file or a stream -> what each holds. I/O.
//!
//! Apart from the decoders because it counts lines and bounds them: what a line holds is theirs to say.

use crate::decode::{Line, LineDecoder, MAX_LINE, Options, Undecodable};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::table::Table;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use strapd_attitude::record::{Nanos, RawSample};

/// A text of samples, being read.
#[derive(Debug)]
pub struct Lines<R> {
    name: PathBuf,
    input: BufReader<R>,
    form: Form,
    number: u64,
    offset: u64,
    line: Vec<u8>,
}

/// How a line is read.
#[derive(Debug)]
enum Form {
    Objects(LineDecoder),
    Rows(Table),
}

impl<R: Read> Lines<R> {
    /// Begins to read; of a table the first row. `name` is what errors call it.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::NotTable`] where the columns are not there.
    pub fn new(name: &Path, format: Format, input: R, options: &Options) -> Result<Lines<R>> {
        let mut lines = Lines {
            name: name.to_owned(),
            input: BufReader::with_capacity(1 << 16, input),
            form: Form::Objects(LineDecoder::new(options)),
            number: 0,
            offset: 0,
            line: Vec::new(),
        };
        if format == Format::Table {
            while lines.read()? && lines.is_blank() {}
            let table = Table::new(&lines.line).map_err(|why| Error::NotTable {
                path: name.to_owned(),
                why,
            })?;
            lines.form = Form::Rows(table);
        }
        Ok(lines)
    }

    /// What the next line holds; its samples are pushed. `None` at the end. Blank lines are passed over.
    ///
    /// # Errors
    /// [`Error::Read`].
    #[allow(clippy::should_implement_trait)]
    pub fn next(
        &mut self,
        samples: &mut Vec<RawSample>,
    ) -> Result<Option<std::result::Result<Line, Undecodable>>> {
        loop {
            if !self.read()? {
                return Ok(None);
            }
            if !self.is_blank() {
                break;
            }
        }
        Ok(Some(match &self.form {
            // A line has no time but the one in it.
            Form::Objects(decoder) => decoder.decode(&self.line, Nanos(0), samples),
            Form::Rows(table) => table.decode(&self.line, samples),
        }))
    }

    /// NDJSON or CSV.
    #[must_use]
    pub fn format(&self) -> Format {
        match self.form {
            Form::Objects(_) => Format::Lines,
            Form::Rows(_) => Format::Table,
        }
    }

    /// Whether the lines may hold orientations: of a table it is known.
    #[must_use]
    pub fn may_have_orientations(&self) -> bool {
        match &self.form {
            Form::Objects(_) => true,
            Form::Rows(table) => table.has_orientation(),
        }
    }

    /// The number of the line that was read last, from 1.
    #[must_use]
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Bytes read so far.
    #[must_use]
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Whether the next line may be long in coming: nothing of it is here.
    #[must_use]
    pub fn may_wait(&self) -> bool {
        self.input.buffer().is_empty()
    }

    /// Reads the next line, at most [`MAX_LINE`] and one byte of it; the rest of a longer one is
    /// skipped.
    fn read(&mut self) -> Result<bool> {
        self.line.clear();
        let (path, offset) = (&self.name, self.offset);
        let fail = |source| Error::Read {
            path: path.clone(),
            offset,
            source,
        };
        let limit = MAX_LINE as u64 + 1;
        let read = Read::take(&mut self.input, limit)
            .read_until(b'\n', &mut self.line)
            .map_err(fail)? as u64;
        self.number += 1;
        self.offset += read;
        if read == limit && self.line.last() != Some(&b'\n') {
            self.offset += self.input.skip_until(b'\n').map_err(fail)? as u64;
        }
        Ok(read > 0)
    }

    fn is_blank(&self) -> bool {
        self.line.iter().all(u8::is_ascii_whitespace)
    }
}
