//! A file, a folder, an archive, a pipe or standard input -> what can be read as often as is needed. I/O.
//!
//! Apart from the log because it comes before anything is known of one: where the bytes are, and what they are. What
//! comes only once is put into a file of its own that has no name and goes with this process: who looks twice sees the
//! same bytes, and what is said of a log does not depend on how it came.

mod stream;

use super::archive::{self, Unpacked};
use super::folder::{self, Folder};
use super::line_input;
use super::parts::say_left_out;
use super::several;
use super::warn::Warn;
use crate::address::Address;
use crate::decode::{Options, Wanted};
use crate::delimited::Table;
use crate::error::{Error, Result};
use crate::format::{Format, open};
use crate::lines::Lines;
use crate::mcap::Reader;
use crate::parquet::{Rows, Trouble};
use crate::remote_object::{self, Object, ObjectBytes, RemoteSource};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::JOIN;

/// Bytes of a stream that are kept at most.
pub(super) const MOST: u64 = 8 << 30;
/// Bytes of a text elsewhere that are fetched before they are read.
const TEXT_AHEAD: u64 = 32 << 20;

/// Source of a recording.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Source {
    /// A file: an MCAP, or NDJSON by its extension.
    File(PathBuf),
    /// Several files that continue each other, in any order.
    Parts(Vec<PathBuf>),
    /// Standard input: MCAP or NDJSON, told apart by the first bytes.
    Stdin,
    /// Object at an address.
    Elsewhere(Address),
}

impl Source {
    /// `-`, an address or a path.
    #[must_use]
    pub fn parse(text: &str) -> Source {
        if text == "-" {
            Source::Stdin
        } else if let Some(address) = remote_object::meant(text) {
            Source::Elsewhere(address)
        } else {
            Source::File(PathBuf::from(text))
        }
    }

    /// The files on this machine that it is in.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        match self {
            Source::File(path) => vec![path.clone()],
            Source::Parts(paths) => paths.clone(),
            Source::Stdin | Source::Elsewhere(_) => Vec::new(),
        }
    }

    /// Name for messages.
    #[must_use]
    pub fn name(&self) -> PathBuf {
        match self {
            Source::File(path) => path.clone(),
            Source::Parts(paths) => several::title(paths),
            Source::Stdin => PathBuf::from("standard input"),
            Source::Elsewhere(address) => PathBuf::from(address.place()),
        }
    }
}

/// Input that is read again, beside files that have a name.
#[derive(Clone, Debug)]
enum Rereadable {
    /// Copy of what came only once.
    File(Arc<File>),
    /// Object elsewhere.
    Object(Arc<dyn Object>),
}

/// The bytes of an input, in any order.
#[derive(Debug)]
pub enum Bytes {
    /// File on this machine.
    File(File),
    /// Elsewhere.
    Object(ObjectBytes),
    /// The rows of a table that is stored otherwise, as text; in their order alone.
    Rows(Box<Rows<Bytes>>),
}

impl Read for Bytes {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self {
            Bytes::File(file) => file.read(into),
            Bytes::Object(object) => object.read(into),
            Bytes::Rows(rows) => rows.read(into),
        }
    }
}

impl Seek for Bytes {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Bytes::File(file) => file.seek(to),
            Bytes::Object(object) => object.seek(to),
            Bytes::Rows(_) => Err(io::ErrorKind::NotSeekable.into()),
        }
    }
}

/// A recording that can be read again.
#[derive(Clone, Debug)]
pub struct Input {
    source: Source,
    name: PathBuf,
    kept: Option<Rereadable>,
    format: Format,
    /// Tables of the same recording.
    beside: Vec<PathBuf>,
    /// Table of the orientations in the same folder.
    orientation: Option<PathBuf>,
    /// The files it is in, where it is in several.
    parts: Vec<PathBuf>,
    /// Folder that `name` and its parts lie in, where it came as an archive.
    unpacked: Option<Arc<Unpacked>>,
    warn: Warn,
}

impl Input {
    /// Opens what a command line names: a file, a folder of one recording, a pipe, `-`, or an address. A stream is
    /// read to its end.
    ///
    /// # Errors
    /// It cannot be opened or read, or is empty; a folder of no recording or of several; there is no room for a
    /// stream; nothing at an address, or no way there.
    pub fn open(path: &Path, warn: &Warn) -> Result<Input> {
        match Source::parse(&path.to_string_lossy()) {
            source @ Source::Stdin => Input::keep(source, std::io::stdin(), warn),
            Source::Elsewhere(address) => Input::of_address(address, warn),
            _ if is_pipe(path) => Input::of_stream(path, open(path)?, warn),
            source if path.is_dir() => {
                let folder = folder::of(path, warn)?;
                Ok(Input::of_folder(source, folder, warn))
            }
            source if archive::is_zip(path) => {
                let unpacked = archive::unpack(path)?;
                let folder = folder::of(unpacked.path(), warn).map_err(|why| match why {
                    Error::Unsupported { what, .. } => Error::unsupported(path, what),
                    other => other,
                })?;
                let mut input = Input::of_folder(source, folder, warn);
                if input.parts.is_empty() {
                    // Opened, so that messages need not name a folder that nobody knows.
                    input.kept = Some(Rereadable::File(Arc::new(open(&input.name)?)));
                    input.name = unpacked.name_of(path, &input.name);
                }
                input.unpacked = Some(Arc::new(unpacked));
                Ok(input)
            }
            source => Ok(Input {
                source,
                name: path.to_owned(),
                kept: None,
                format: recognised(path, warn)?,
                beside: Vec::new(),
                orientation: None,
                parts: Vec::new(),
                unpacked: None,
                warn: warn.clone(),
            }),
        }
    }

    /// The table of orientations beside this one, of a folder or an archive whose recorder wrote one.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn orientation(&self) -> Result<Option<Input>> {
        let Some(path) = &self.orientation else {
            return Ok(None);
        };
        let mut found = Input::open(path, &self.warn)?;
        if let (Some(unpacked), Source::File(archive)) = (&self.unpacked, &self.source) {
            found.kept = Some(Rereadable::File(Arc::new(open(path)?)));
            found.name = unpacked.name_of(archive, path);
            found.unpacked = Some(Arc::clone(unpacked));
        }
        Ok(Some(found))
    }

    fn of_folder(source: Source, found: Folder, warn: &Warn) -> Input {
        Input {
            source,
            name: found.main,
            kept: None,
            format: found.format,
            beside: found.beside,
            orientation: found.orientation,
            parts: found.parts,
            unpacked: None,
            warn: warn.clone(),
        }
    }

    fn of_address(address: Address, warn: &Warn) -> Result<Input> {
        let name = PathBuf::from(address.place());
        let found = remote_object::find(&address).map_err(|what| Error::Unreached {
            path: name.clone(),
            what,
        })?;
        let source = Source::Elsewhere(address);
        let object = match found {
            RemoteSource::Stream(from) => return Input::keep(source, from, warn),
            RemoteSource::Object(object) if object.size() == 0 => {
                return Err(Error::Empty { path: name });
            }
            RemoteSource::Object(object) => object,
        };
        let mut bytes = ObjectBytes::new(Arc::clone(&object));
        let format = Format::of_seekable(&name, &mut bytes, object.size())?;
        let format = checked(&name, format, warn);
        if format.is_text() {
            object.expect(remote_object::whole(object.as_ref()), TEXT_AHEAD);
        }
        Ok(Input {
            source,
            name,
            kept: Some(Rereadable::Object(object)),
            format,
            beside: Vec::new(),
            orientation: None,
            parts: Vec::new(),
            unpacked: None,
            warn: warn.clone(),
        })
    }

    /// Opens several files that continue each other, in any order.
    ///
    /// # Errors
    /// One cannot be opened, comes only once, is a folder or given twice, or is of another format than the first.
    pub fn joined(paths: &[PathBuf], warn: &Warn) -> Result<Input> {
        several::checked(paths)?;
        let is_empty = |path: &PathBuf| std::fs::metadata(path).is_ok_and(|found| found.len() == 0);
        let (empty, paths): (Vec<_>, Vec<_>) = paths.iter().cloned().partition(is_empty);
        match (empty.first(), paths.is_empty()) {
            (Some(path), true) => return Err(Error::Empty { path: path.clone() }),
            _ => empty.iter().for_each(|path| say_left_out(path, warn)),
        }
        let mut formats = Vec::new();
        for path in &paths {
            let format = recognised(path, warn)?;
            if let Some((first, other)) = formats.first().filter(|(_, other)| *other != format) {
                let first: &PathBuf = first;
                return Err(Error::Unsupported {
                    path: path.clone(),
                    what: Diagnostic::new(format!(
                        "{}, and {} is {}: parts of one recording have the same format",
                        format.name(),
                        first.display(),
                        Format::name(*other)
                    ))
                    .help(format!(
                        "name them without {JOIN}: each has an attitude of its own; of logs of one device strapd recover makes MCAPs"
                    )),
                });
            }
            formats.push((path.clone(), format));
        }
        Ok(Input {
            name: several::title(&paths),
            kept: None,
            format: formats.first().map_or(Format::Mcap, |(_, format)| *format),
            beside: Vec::new(),
            orientation: None,
            source: Source::Parts(paths.clone()),
            parts: paths,
            unpacked: None,
            warn: warn.clone(),
        })
    }

    /// Reads a stream to its end; `name` is what errors call it.
    ///
    /// # Errors
    /// It cannot be read, or is empty; there is no room for it.
    pub fn of_stream(name: &Path, from: impl Read, warn: &Warn) -> Result<Input> {
        Input::keep(Source::File(name.to_owned()), from, warn)
    }

    /// Source it came from.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Name in messages.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// The files it is in, where it is in several.
    #[must_use]
    pub fn parts(&self) -> &[PathBuf] {
        &self.parts
    }

    /// Receiver of warnings about it.
    pub(super) fn warn(&self) -> &Warn {
        &self.warn
    }

    /// Format.
    #[must_use]
    pub fn format(&self) -> Format {
        self.format
    }

    /// Bytes, from the first. Only one such reader of what came once is used at a time.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn bytes(&self) -> Result<Bytes> {
        self.is_one_file()?;
        let kept = match &self.kept {
            None => return Ok(Bytes::File(open(&self.name)?)),
            Some(Rereadable::Object(object)) => {
                return Ok(Bytes::Object(ObjectBytes::new(Arc::clone(object))));
            }
            Some(Rereadable::File(kept)) => kept,
        };
        let again = kept.try_clone().and_then(|mut file| {
            file.rewind()?;
            Ok(file)
        });
        again.map(Bytes::File).map_err(|source| Error::Open {
            path: self.name.clone(),
            source,
        })
    }

    /// Lines or rows as text, from the first: of what is stored otherwise, made of it.
    ///
    /// # Errors
    /// As [`Input::bytes`]; it is no table that is read.
    pub fn text(&self, options: &Options) -> Result<Bytes> {
        let bytes = self.bytes()?;
        if self.format != Format::Parquet {
            return Ok(bytes);
        }
        let rows = Rows::open(bytes, options.columns.as_ref()).map_err(|why| match why {
            Trouble::Read(source) => Error::Read {
                path: self.name.clone(),
                offset: 0,
                source,
            },
            Trouble::Not(what) => Error::Unsupported {
                path: self.name.clone(),
                what,
            },
        })?;
        Ok(Bytes::Rows(Box::new(rows)))
    }

    /// Whoever reads bytes must not take those of one part for all.
    fn is_one_file(&self) -> Result<()> {
        match self.parts.len() {
            0 => Ok(()),
            parts => Err(Error::Unsupported {
                path: self.name.clone(),
                what: Diagnostic::new(format!(
                    "a recording in {parts} files, and here it has to be one"
                ))
                .help("strapd replay makes one of them"),
            }),
        }
    }

    /// Bytes as an MCAP.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn mcap(&self) -> Result<Reader> {
        self.is_one_file()?;
        match (&self.kept, self.bytes()?) {
            (None, _) => Reader::open(&self.name),
            (Some(Rereadable::Object(object)), _) => {
                Reader::of_object(&self.name, Arc::clone(object))
            }
            (_, Bytes::File(kept)) => Reader::of_file(&self.name, kept),
            (_, Bytes::Object(_) | Bytes::Rows(_)) => Reader::open(&self.name),
        }
    }

    /// Whether it is a table that strapd wrote.
    ///
    /// # Errors
    /// It cannot be read, or is no table.
    pub fn is_own_table(&self, options: &Options) -> Result<bool> {
        let lines = self
            .lines(&Options::default())
            .or_else(|_| self.lines(options))?;
        Ok(lines.table().is_some_and(Table::is_own))
    }

    /// Bytes as lines or rows.
    ///
    /// # Errors
    /// As `line_input::open`.
    pub fn lines(&self, options: &Options) -> Result<Lines<Bytes>> {
        let bytes = match self.text(options)? {
            Bytes::Rows(rows) => Bytes::Rows(Box::new(rows.with_bits())),
            other => other,
        };
        let lines = line_input::open(&self.name, self.format, bytes, options)?;
        let of_forces = Options {
            wanted: Wanted::Forces,
            ..Options::default()
        };
        self.beside.iter().try_fold(lines, |lines, beside| {
            let other = line_input::open(
                beside,
                Format::Table,
                Bytes::File(open(beside)?),
                &of_forces,
            )?;
            lines.with(other)
        })
    }
}

/// Format of a file, by its first bytes; a name that stands for another is warned of. What nobody knows is taken for an
/// MCAP, whose reader says what is wrong with it.
///
/// # Errors
/// As [`Format::of_file`].
fn recognised(path: &Path, warn: &Warn) -> Result<Format> {
    Ok(checked(path, Format::of_file(path)?, warn))
}

/// Format to take a file for, whether its format is known or not.
fn checked(path: &Path, format: Option<Format>, warn: &Warn) -> Format {
    let format = format.unwrap_or(Format::Mcap);
    if let Some(said) = format.contradiction(path) {
        warn.say(&format!("{}: {said}", path.display()));
    }
    format
}

/// Whether a path names what can be read only once: a named pipe, a shell's `<(...)`, a device.
pub fn is_pipe(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}
