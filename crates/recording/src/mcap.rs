//! Logs -> messages in a stable order: MCAP, and what is told as MCAP (ULog, bags of ROS 1 and of ROS 2 in SQLite).
//! I/O.
//!
//! A stage of its own because recordings come damaged, and general readers stop at the first
//! fault, believe every length, or do not look at checksums. Here every length is held
//! against the file and a limit before anything is allocated, a chunk's CRC is compared before its
//! messages are used, and what is bad is skipped, counted and told ([`Problems`]).
//!
//! ```text
//! tape -> scan -> blocks -> (workers: block -> messages -> items) -> order -> the caller
//! ```
//!
//! [`walk()`] reads a log once, in parallel, and hands over decoded items ordered by log time, then place
//! in the file; [`salvage()`] is the same walk for a copy; [`survey()`] says what is in it; [`list()`] gives
//! every record. Memory is bounded by
//! [`WalkOptions::in_flight`] and the largest chunk, whatever the size of the file.
//!
//! Layouts: MCAP specification, <https://mcap.dev/spec>.

mod attached;
mod block;
mod channels;
mod container;
mod index;
mod input;
mod kept;
mod list;
mod lz4;
mod messages;
mod order;
mod resync;
mod scan;
mod summary;
mod survey;
mod walk;
mod workers;

pub use crate::records::problem::{Problem, ProblemKind, Problems};
pub use crate::records::record::{
    AttachmentIndex, AttachmentRecord, Carried, ChannelRecord, ChunkHead, ChunkIndex, DataEnd,
    Entries, Footer, HeaderRecord, MessageIndex, MessageRecord, MetadataIndex, MetadataRecord,
    Record, SchemaRecord, Statistics, SummaryOffset,
};
pub use crate::records::{HEAD, MAGIC, op};
pub use block::Compression;
use block::Payload;
pub use channels::{Channel, Schema};
pub use list::{Listed, list};
pub use messages::{Message, Tally};
pub use order::{Lookahead, Order};
pub use scan::Facts;
pub(crate) use survey::OURS;
pub use survey::{ChannelSurvey, PassedChunks, Survey, survey};
pub use walk::{WalkOptions, WalkReport, salvage, walk};

use crate::error::{Error, Result};
use crate::format::{self, Format, LONGEST_MAGIC, Reading, is_video};
use crate::recognise::{self, Foreign};
use crate::remote_object::{self, Object};
use index::Index;
use input::{Input, LogFile};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Limits up to which the reader believes a file's length fields.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// Longest record that is loaded, and largest chunk that is unpacked, bytes. Attachments are
    /// stepped over, so they may be longer.
    pub record: u64,
    /// Bytes all schemas and channels may take together.
    pub definitions: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            record: 64 << 20,
            definitions: 64 << 20,
        }
    }
}

/// A log that has been opened and is one by its first bytes.
#[derive(Debug)]
pub struct Reader {
    input: Input,
    limits: Limits,
    format: Format,
    /// The files beside a database.
    beside: DatabaseSidecars,
    /// Index of the chunks of a remote object that need not be read.
    index: Option<Arc<Index>>,
}

/// Files that a recorder that was killed leaves beside a database.
#[derive(Clone, Debug, Default)]
struct DatabaseSidecars {
    /// The file `-wal`.
    wal: Option<Arc<LogFile>>,
    /// Whether there is a file `-journal` with pages as they were before a change that was not ended.
    has_journal: bool,
}

impl Reader {
    /// Opens a log. What is not a regular file (a pipe, a device) is read as a stream.
    ///
    /// # Errors
    /// [`Error::Open`], [`Error::IsDirectory`], [`Error::Empty`], [`Error::NotMcap`], [`Error::Read`].
    pub fn open(path: &Path) -> Result<Reader> {
        let open = |source| Error::Open {
            path: path.to_owned(),
            source,
        };
        let file =
            File::open(path).map_err(|source| open(format::neighbour::named(path, source)))?;
        let meta = file.metadata().map_err(open)?;
        if meta.is_dir() {
            return Err(Error::IsDirectory {
                path: path.to_owned(),
            });
        }
        if !meta.is_file() {
            return Reader::from_stream(path, Box::new(file));
        }
        let reader = Reader::of_file(path, file)?;
        Ok(match reader.format.reading() {
            Reading::Database => Reader {
                beside: DatabaseSidecars::of(path),
                ..reader
            },
            _ => reader,
        })
    }

    /// Reads a regular file that is open, whatever its position; `name` is what errors call it.
    ///
    /// # Errors
    /// [`Error::Open`], [`Error::Empty`], [`Error::NotMcap`], [`Error::Read`].
    pub fn of_file(name: &Path, file: File) -> Result<Reader> {
        let path = name;
        let meta = file.metadata().map_err(|source| Error::Open {
            path: path.to_owned(),
            source,
        })?;
        let file = LogFile::new(path, file, meta.len());
        Ok(Reader {
            format: format_of(&file)?,
            input: Input::File(Arc::new(file)),
            limits: Limits::default(),
            beside: DatabaseSidecars::default(),
            index: None,
        })
    }

    /// Reads an object that is elsewhere; `name` is what errors call it.
    ///
    /// # Errors
    /// [`Error::Empty`], [`Error::NotMcap`], [`Error::Read`].
    pub fn of_object(name: &Path, object: Arc<dyn Object>) -> Result<Reader> {
        let file = Arc::new(LogFile::of_object(name, Arc::clone(&object)));
        let (format, limits) = (format_of(&file)?, Limits::default());
        let index = match format {
            Format::Mcap => {
                let found = summary::read(&file, limits);
                let found = found.map_err(|e| read_error(name, 0, e))?;
                found.ok().flatten().and_then(|summary| summary.index)
            }
            _ => None,
        };
        // With an index each walk says what it reads.
        if index.is_none() {
            object.expect(remote_object::whole(object.as_ref()), AHEAD);
        }
        Ok(Reader {
            format,
            input: Input::File(file),
            limits,
            beside: DatabaseSidecars::default(),
            index: index.map(Arc::new),
        })
    }

    /// Reads a log from a stream; `name` is what errors call it. What is read in another order than that of its bytes
    /// is first put into a file without a name.
    ///
    /// # Errors
    /// [`Error::Empty`], [`Error::NotMcap`], [`Error::Read`], [`Error::NoRoom`].
    pub fn from_stream(name: impl Into<PathBuf>, from: Box<dyn Read + Send>) -> Result<Reader> {
        let (name, mut from) = (name.into(), from);
        let mut magic = Vec::with_capacity(MAGIC.len());
        // Eight tell a format, or that more have to.
        let mut more = MAGIC.len();
        while more > 0 {
            let have = magic.len();
            let read = from.by_ref().take(more as u64).read_to_end(&mut magic);
            read.map_err(|e| read_error(&name, 0, e))?;
            // Bytes of a sensor may begin within a frame, and say what they are behind that.
            let tells_nothing = magic.len() < format::HEAD && Format::of_log(&magic).is_none();
            let is_open = magic.len() > have && (tells_nothing || Format::may_be_log(&magic));
            more = match LONGEST_MAGIC.checked_sub(magic.len()) {
                _ if !is_open => 0,
                None | Some(0) => SHOWN_MORE,
                Some(rest) => rest,
            };
        }
        let Some(format) = Format::of_log(&magic) else {
            let known = recognise::marked(&magic, &[]);
            return Err(refused(&name, &magic, known));
        };
        // Of an MCAP the walk begins behind the magic.
        if format != Format::Mcap {
            from = Box::new(std::io::Cursor::new(magic).chain(from));
        }
        if format.is_read_anywhere() {
            return Reader::of_file(&name, kept::of(&name, from)?);
        }
        Ok(Reader {
            input: Input::Stream { name, from },
            limits: Limits::default(),
            format,
            beside: DatabaseSidecars::default(),
            index: None,
        })
    }

    /// The same log with other limits.
    #[must_use]
    pub fn with_limits(self, limits: Limits) -> Reader {
        Reader { limits, ..self }
    }

    /// Format.
    #[must_use]
    pub fn format(&self) -> Format {
        self.format
    }

    /// The path, or the name given to the stream.
    #[must_use]
    pub fn name(&self) -> &Path {
        self.input.name()
    }

    /// Bytes of a file; unknown for a stream.
    #[must_use]
    pub fn size(&self) -> Option<u64> {
        match &self.input {
            Input::File(file) => Some(file.len),
            Input::Stream { .. } => None,
        }
    }

    /// A second reader of the same file; `None` for a stream, which can be read once.
    #[must_use]
    pub fn again(&self) -> Option<Reader> {
        match &self.input {
            Input::File(file) => Some(Reader {
                input: Input::File(Arc::clone(file)),
                limits: self.limits,
                format: self.format,
                beside: self.beside.clone(),
                index: self.index.clone(),
            }),
            Input::Stream { .. } => None,
        }
    }
}

impl DatabaseSidecars {
    fn of(path: &Path) -> DatabaseSidecars {
        let journal = DatabaseSidecars::file(path, "-journal");
        let has_journal = journal.is_some_and(|file| {
            let mut head = [0; JOURNAL_MAGIC.len()];
            file.read_at(&mut head, 0).is_ok() && head == JOURNAL_MAGIC
        });
        DatabaseSidecars {
            wal: DatabaseSidecars::file(path, "-wal"),
            has_journal,
        }
    }

    fn file(path: &Path, ending: &str) -> Option<Arc<LogFile>> {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        let file = File::open(&name).ok()?;
        let meta = file.metadata().ok().filter(std::fs::Metadata::is_file)?;
        Some(Arc::new(LogFile::new(Path::new(&name), file, meta.len())))
    }
}

/// Bytes of a stream that are looked at next, where its first ones tell too little.
const SHOWN_MORE: usize = 256;

/// Bytes of an object that are fetched before they are asked for.
const AHEAD: u64 = WalkOptions::IN_FLIGHT as u64;

/// The first bytes of a journal that is to be rolled back.
const JOURNAL_MAGIC: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

fn read_error(path: &Path, offset: u64, source: std::io::Error) -> Error {
    Error::Read {
        path: path.to_owned(),
        offset,
        source,
    }
}

/// Format of the log in a file; if none, both of its ends tell what it is.
fn format_of(file: &LogFile) -> Result<Format> {
    let read = |at: u64, most: usize| {
        let mut bytes = vec![0; most];
        let have = file
            .read_at(&mut bytes, at)
            .map_err(|e| read_error(&file.path, at, e))?;
        bytes.truncate(have);
        Ok(bytes)
    };
    let head = read(0, format::HEAD)?;
    if let Some(format) = Format::of_log(&head)
        && (!is_video(&head)
            || container::gpmf::has_track(file).map_err(|e| read_error(&file.path, 0, e))?)
    {
        return Ok(format);
    }
    let last = file.len.saturating_sub(recognise::LAST as u64);
    let (first, last) = (read(0, recognise::FIRST)?, read(last, recognise::LAST)?);
    Err(refused(
        &file.path,
        &first,
        recognise::foreign(&first, &last),
    ))
}

/// Why an input that begins with these bytes is not read.
fn refused(path: &Path, first: &[u8], known: Option<Foreign>) -> Error {
    let path = path.to_owned();
    if first.is_empty() {
        return Error::Empty { path };
    }
    if let Some(format) = known {
        return Error::NotRead { path, format };
    }
    let first = first.get(..MAGIC.len()).unwrap_or(first);
    let found = first.escape_ascii().to_string();
    Error::NotMcap { path, found }
}
