//! Lines of JSON with packed objects between them, or rows of a table, from a file or a stream -> what each holds. I/O.
//!
//! Apart from the decoders because it counts lines and bounds them: what a line holds is theirs to say.

mod beside;
mod packed;
mod table_stream;

pub use table_stream::{HeldRow, TableStream};

use crate::columns::RowSelection;
use crate::decode::packed::{HEAD, MARK, length};
use crate::decode::{Line, LineDecoder, MAX_LINE, Options, Undecodable};
use crate::delimited::{Opening, SampledLine, Table};
use crate::error::{Error, Result};
use crate::format::Format;
use beside::SidecarFile;
use packed::Numbers;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use strapd_attitude::record::{Declared, Nanos, RawSample};

/// A text of samples, being read.
#[derive(Debug)]
pub struct Lines<R> {
    name: PathBuf,
    input: BufReader<R>,
    format: Format,
    form: Form,
    /// The line that was read last, and that was given last, from 1.
    last_read: u64,
    current: u64,
    offset: u64,
    line: Vec<u8>,
    /// Rows of a table that were looked at before, with their numbers.
    held: VecDeque<SampledLine>,
    /// Files of the same recording with forces or fields, and what is next in this one.
    beside: Vec<SidecarFile<R>>,
    next: Option<Next>,
    /// Beginning of the input, as far as it had come.
    head: Vec<u8>,
}

/// Bytes of the beginning that are kept.
pub(crate) const HEAD_KEPT: usize = 4096;

/// Contents of a line, and its samples; `None` at the end.
type Next = (
    Option<std::result::Result<Line, Undecodable>>,
    Vec<RawSample>,
);

/// Form in which a line is read.
#[derive(Debug)]
enum Form {
    /// Objects of JSON, and packed ones.
    Objects(LineDecoder, Numbers),
    Rows(Box<Table>),
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
            format,
            form: Form::Objects(
                LineDecoder::new(options).with_besides().with_log_times(),
                Numbers::default(),
            ),
            last_read: 0,
            current: 0,
            offset: 0,
            line: Vec::new(),
            held: VecDeque::new(),
            beside: Vec::new(),
            next: None,
            head: Vec::new(),
        };
        lines.keep_head()?;
        if format.is_table() {
            let stem = name.file_stem().unwrap_or_default().to_string_lossy();
            let options = options.clone().for_file(name);
            let mut opening = Opening::new(&options, &stem);
            while lines.read()? && opening.take(&lines.line) {}
            let (table, rows) = opening.finish().map_err(|why| Error::NotTable {
                path: name.to_owned(),
                why,
            })?;
            lines.form = Form::Rows(Box::new(table));
            lines.held = rows.into();
        }
        Ok(lines)
    }

    /// Reads the next line, of this file or of those beside it, in the order of their stamps; its samples are pushed.
    /// What a line holds that is of no gyro is marked so ([`RawSample::is_beside`]). `None` at the end. Blank lines are
    /// passed over.
    ///
    /// # Errors
    /// [`Error::Read`].
    #[allow(clippy::should_implement_trait)]
    pub fn next(
        &mut self,
        samples: &mut Vec<RawSample>,
    ) -> Result<Option<std::result::Result<Line, Undecodable>>> {
        if self.beside.is_empty() {
            return self.next_own(samples);
        }
        let (line, found) = self.next_of_all()?;
        samples.extend(found);
        Ok(line)
    }

    fn next_own(
        &mut self,
        samples: &mut Vec<RawSample>,
    ) -> Result<Option<std::result::Result<Line, Undecodable>>> {
        loop {
            if !self.next_line()? {
                return Ok(None);
            }
            if !self.is_blank() {
                break;
            }
        }
        Ok(Some(match &mut self.form {
            Form::Objects(_, numbers) if self.line.first() == Some(&MARK) => {
                numbers.decode(&self.line, samples)
            }
            Form::Objects(decoder, numbers) => {
                // A line has no times but those in it.
                let line = decoder.decode(&self.line, Nanos(0), samples);
                line.and_then(|line| numbers.learn(&line, &self.line).map(|()| line))
            }
            Form::Rows(table) => table.decode(&self.line, samples),
        }))
    }

    /// NDJSON, CSV or Parquet.
    #[must_use]
    pub fn format(&self) -> Format {
        self.format
    }

    /// First bytes, as far as they had come when it was opened.
    #[must_use]
    pub(crate) fn head(&self) -> &[u8] {
        &self.head
    }

    fn keep_head(&mut self) -> Result<()> {
        loop {
            match self.input.fill_buf() {
                Ok(first) => {
                    let kept = first.get(..HEAD_KEPT).unwrap_or(first);
                    self.head = kept.to_vec();
                    return Ok(());
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(source) => {
                    return Err(Error::Read {
                        path: self.name.clone(),
                        offset: 0,
                        source,
                    });
                }
            }
        }
    }

    /// The table that the lines are rows of.
    #[must_use]
    pub fn table(&self) -> Option<&Table> {
        match &self.form {
            Form::Objects(..) => None,
            Form::Rows(table) => Some(table),
        }
    }

    /// Notes for the reader of its tables.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let own = self.table().map(Table::notes).unwrap_or_default();
        let others = self.beside.iter().flat_map(SidecarFile::notes);
        own.iter().cloned().chain(others).collect()
    }

    /// Rows of its table that are read, and the count of those that are not.
    #[must_use]
    pub(crate) fn selection(&self) -> Option<&RowSelection> {
        self.table().map(Table::selection)
    }

    /// Meaning of all samples that is declared before the first: the names of a table may state units.
    #[must_use]
    pub fn declared(&self) -> Declared {
        let mut declared = self
            .table()
            .map(Table::declared)
            .cloned()
            .unwrap_or_default();
        let mut of_others = self.beside.iter().map(SidecarFile::declared);
        declared.accel_unit = declared
            .accel_unit
            .or_else(|| of_others.find_map(|d| d.accel_unit));
        declared
    }

    /// The number of the line that was given last, from 1.
    #[must_use]
    pub fn number(&self) -> u64 {
        self.current
    }

    /// Bytes read so far.
    #[must_use]
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Whether the next line may be long in coming: nothing of it is here.
    #[must_use]
    pub fn may_wait(&self) -> bool {
        self.held.is_empty() && self.beside.is_empty() && self.input.buffer().is_empty()
    }

    /// The next line: one that was looked at before, or from the input.
    fn next_line(&mut self) -> Result<bool> {
        if let Some(held) = self.held.front_mut().filter(|held| held.times > 1) {
            (self.current, self.line) = (held.number, held.line.clone());
            held.number += 1;
            held.times -= 1;
            return Ok(true);
        }
        if let Some(held) = self.held.pop_front() {
            (self.current, self.line) = (held.number, held.line);
            return Ok(true);
        }
        let is_there = self.read()?;
        self.current = self.last_read;
        Ok(is_there)
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
        // No line of UTF-8 begins so; a row of a table in Latin-1 may.
        let may_be_packed = matches!(self.form, Form::Objects(..));
        if may_be_packed && begins_with(&mut self.input, MARK).map_err(fail)? {
            let read = read_object(&mut self.input, &mut self.line).map_err(fail)?;
            self.last_read += 1;
            self.offset += read;
            return Ok(true);
        }
        let limit = MAX_LINE as u64 + 1;
        let read = Read::take(&mut self.input, limit)
            .read_until(b'\n', &mut self.line)
            .map_err(fail)? as u64;
        self.last_read += 1;
        self.offset += read;
        if read == limit && self.line.last() != Some(&b'\n') {
            self.offset += self.input.skip_until(b'\n').map_err(fail)? as u64;
        }
        Ok(read > 0)
    }

    fn is_blank(&self) -> bool {
        // Of a longer one, what comes behind may be anything.
        self.line.len() <= MAX_LINE && self.line.iter().all(u8::is_ascii_whitespace)
    }
}

fn begins_with(input: &mut impl BufRead, mark: u8) -> std::io::Result<bool> {
    loop {
        match input.fill_buf() {
            Ok(bytes) => return Ok(bytes.first() == Some(&mark)),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
}

/// A packed object as long as it says; of one that says no length it can have the beginning, and what is behind it is
/// skipped up to the next line. How many bytes that were.
fn read_object(input: &mut impl BufRead, object: &mut Vec<u8>) -> std::io::Result<u64> {
    let mut more = |count: usize, object: &mut Vec<u8>| {
        let read = Read::take(&mut *input, count as u64).read_to_end(object)?;
        Ok::<bool, std::io::Error>(read == count)
    };
    let is_there = more(4, object)?;
    match length(object).filter(|n| is_there && *n >= HEAD) {
        Some(length) => {
            more(length - 4, object)?;
            Ok(object.len() as u64)
        }
        None => Ok(object.len() as u64 + input.skip_until(b'\n')? as u64),
    }
}
