//! The first bytes of a recording, then its name -> which format it is. Pure but for [`Format::of_file`].
//!
//! Apart from the readers because it comes before all of them: files are called whatever somebody called them, and a
//! pipe has no name. What the bytes say wins over what the name says.

use crate::delimited;
use crate::error::{Error, Result};
use crate::gpmf;
use crate::mavlink;
use crate::parquet;
use crate::recognise;
use crate::text::without_mark;
use std::fs::File;
use std::io::{BufRead, Read, Seek, SeekFrom};
use std::path::Path;

/// A format of recordings.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Format {
    /// MCAP.
    #[default]
    Mcap,
    /// ULog, the log of PX4.
    Ulog,
    /// A bag of ROS 1.
    Bag,
    /// A recording of ROS 2 in SQLite.
    Rosbag2,
    /// GPMF, the telemetry of GoPro's cameras, alone or in a video.
    Gpmf,
    /// A telemetry log of a ground station: frames of MAVLink with times.
    Tlog,
    /// One JSON object per line.
    Lines,
    /// Rows of cells: the CSV that strapd writes itself, and other makers' tables.
    Table,
    /// The same rows stored by columns, in Parquet.
    Parquet,
}

/// The eight bytes at both ends of an MCAP.
pub const MCAP_MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// The first bytes of a ULog.
pub(crate) const ULOG_MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// The first bytes of a bag of ROS 1.
pub(crate) const BAG_MAGIC: [u8; 13] = *b"#ROSBAG V2.0\n";
/// The first bytes of an SQLite database.
pub(crate) const SQLITE_MAGIC: [u8; 16] = *b"SQLite format 3\0";

/// Bytes that tell a format by themselves, at the beginning.
const MAGICS: [(&[u8], Format); 6] = [
    (&MCAP_MAGIC, Format::Mcap),
    (&ULOG_MAGIC, Format::Ulog),
    (&BAG_MAGIC, Format::Bag),
    (&SQLITE_MAGIC, Format::Rosbag2),
    (&gpmf::MAGIC, Format::Gpmf),
    (&parquet::MAGIC, Format::Parquet),
];

/// Mark of a video, behind four bytes.
const VIDEO: &[u8] = b"ftyp";

/// The longest of them.
pub(crate) const LONGEST_MAGIC: usize = SQLITE_MAGIC.len();

/// Endings of names, for what the bytes do not tell.
const ENDINGS: [(&str, Format); 12] = [
    ("mcap", Format::Mcap),
    ("ulg", Format::Ulog),
    ("ulog", Format::Ulog),
    ("bag", Format::Bag),
    ("db3", Format::Rosbag2),
    ("tlog", Format::Tlog),
    ("ndjson", Format::Lines),
    ("jsonl", Format::Lines),
    ("csv", Format::Table),
    ("tsv", Format::Table),
    ("gcsv", Format::Table),
    ("parquet", Format::Parquet),
];

/// Bytes that are looked at: the first line of a table is shorter.
pub(crate) const HEAD: usize = 4096;

impl Format {
    /// The formats that are read, in the order in which texts list them.
    pub const ALL: [Format; 9] = [
        Format::Mcap,
        Format::Ulog,
        Format::Bag,
        Format::Rosbag2,
        Format::Gpmf,
        Format::Tlog,
        Format::Lines,
        Format::Table,
        Format::Parquet,
    ];

    /// The names of [`Format::ALL`], separated by commas: the list of every help text and message.
    #[must_use]
    pub fn names() -> String {
        Format::ALL.map(Format::name).join(", ")
    }

    /// Name of the format, as people call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Format::Mcap => "MCAP",
            Format::Ulog => "ULog",
            Format::Bag => "ROS 1 bag",
            Format::Rosbag2 => "rosbag2 SQLite",
            Format::Gpmf => "GPMF",
            Format::Tlog => "MAVLink tlog",
            Format::Lines => "NDJSON",
            Format::Table => "CSV",
            Format::Parquet => "Parquet",
        }
    }

    /// Whether it is read as text, lines or rows; everything else is a log of messages on channels.
    #[must_use]
    pub fn is_text(self) -> bool {
        self == Format::Lines || self.is_table()
    }

    /// Whether it is rows under names.
    #[must_use]
    pub fn is_table(self) -> bool {
        matches!(self, Format::Table | Format::Parquet)
    }

    /// The log of messages on channels of which these are the first bytes.
    #[must_use]
    pub(crate) fn of_magic(head: &[u8]) -> Option<Format> {
        let mut known = MAGICS.iter();
        known
            .find(|(magic, _)| head.starts_with(magic))
            .map(|(_, format)| *format)
            // Whether it has telemetry shows when it is opened.
            .or_else(|| is_video(head).then_some(Format::Gpmf))
            .or_else(|| mavlink::is_log(head).then_some(Format::Tlog))
    }

    /// Whether more bytes behind these could make one of [`Format::of_magic`].
    #[must_use]
    pub(crate) fn may_be_magic(head: &[u8]) -> bool {
        let mut known = MAGICS.iter();
        known.any(|(magic, _)| magic.len() > head.len() && magic.starts_with(head))
            || mavlink::may_be_log(head)
    }

    /// Whether it is read in another order than that of its bytes, so that a stream of it is first put into a file.
    #[must_use]
    pub fn is_read_anywhere(self) -> bool {
        matches!(self, Format::Rosbag2 | Format::Gpmf | Format::Parquet)
    }

    /// The format of which these are the first bytes; `None` where they tell nothing.
    #[must_use]
    pub fn of_bytes(head: &[u8]) -> Option<Format> {
        if let Some(format) = Format::of_magic(head) {
            return Some(format);
        }
        let text = without_mark(head).trim_ascii_start();
        if matches!(text.first(), Some(b'{' | b'[')) {
            return Some(Format::Lines);
        }
        let is_cut = head.len() >= HEAD && !text.ends_with(b"\n");
        let mut lines = text.split(|b| *b == b'\n');
        if is_cut {
            lines.next_back();
        }
        let is_table = delimited::may_be_table(text)
            && lines
                .take(delimited::MOST_HEAD_LINES)
                .any(|line| delimited::is_header(line, None));
        is_table.then_some(Format::Table)
    }

    /// The format that bytes look like, where neither they nor the name say more: text in cells, whose columns the user
    /// may name.
    #[must_use]
    pub fn of_shape(head: &[u8]) -> Option<Format> {
        delimited::is_text_of_cells(head).then_some(Format::Table)
    }

    /// The format that a name's ending stands for.
    #[must_use]
    pub fn of_name(path: &Path) -> Option<Format> {
        let ending = path.extension()?;
        let mut known = ENDINGS.iter();
        known
            .find(|(known, _)| ending.eq_ignore_ascii_case(known))
            .map(|(_, format)| *format)
    }

    /// The format of a regular file: by its first bytes, and where these tell nothing by its name.
    ///
    /// # Errors
    /// It cannot be opened or read, is a directory, or empty; it is of a format that is known and not read.
    pub fn of_file(path: &Path) -> Result<Option<Format>> {
        let mut file = open(path)?;
        let length = file.metadata().map_err(|source| Error::Read {
            path: path.to_owned(),
            offset: 0,
            source,
        });
        Format::of_seekable(path, &mut file, length?.len())
    }

    /// The same of what is open at its beginning and has a length.
    ///
    /// # Errors
    /// As [`Format::of_file`].
    pub(crate) fn of_seekable(
        path: &Path,
        file: &mut (impl Read + Seek),
        length: u64,
    ) -> Result<Option<Format>> {
        let fail = |source| Error::Read {
            path: path.to_owned(),
            offset: 0,
            source,
        };
        let mut head = Vec::new();
        let first = file.by_ref().take(HEAD as u64).read_to_end(&mut head);
        first.map_err(fail)?;
        if let Some(format) = Format::of_bytes(&head)
            && (!is_video(&head) || has_telemetry(file, length).map_err(fail)?)
        {
            return Ok(Some(format));
        }
        // What an archive holds is said at its end.
        let last = length.saturating_sub(recognise::LAST as u64);
        let mut tail = Vec::new();
        file.seek(SeekFrom::Start(last)).map_err(fail)?;
        let read = file.take(recognise::LAST as u64).read_to_end(&mut tail);
        read.map_err(fail)?;
        if let Some(format) = recognise::marked(&head, &tail) {
            let path = path.to_owned();
            return Err(Error::NotRead { path, format });
        }
        Ok(Format::of_name(path).or_else(|| Format::of_shape(&head)))
    }

    /// Warning about a file whose name stands for another format than its bytes.
    #[must_use]
    pub fn contradiction(self, path: &Path) -> Option<String> {
        let named = Format::of_name(path).filter(|named| *named != self)?;
        Some(format!(
            "it is called {}, but holds {}, and is read as that",
            named.name(),
            self.name()
        ))
    }
}

/// Whether it begins like a video.
pub(crate) fn is_video(head: &[u8]) -> bool {
    head.get(4..8) == Some(VIDEO)
}

/// Whether a video has a track of telemetry, or may have had one and is cut.
fn has_telemetry(file: &mut (impl Read + Seek), length: u64) -> std::io::Result<bool> {
    let index = gpmf::index(length, &mut |at, into| {
        file.seek(SeekFrom::Start(at))?;
        let mut have = 0;
        while let Some(rest) = into.get_mut(have..).filter(|rest| !rest.is_empty()) {
            match file.read(rest) {
                Ok(0) => break,
                Ok(n) => have += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(have)
    })?;
    Ok(index.is_ok_and(|index| gpmf::Movie::of(&index).is_some()))
}

/// Reads the first bytes of a stream, no more than are needed: a sender of lines may wait for an answer before the
/// second. Empty when nothing comes.
///
/// # Errors
/// The stream cannot be read.
pub(crate) fn head_of(input: &mut impl BufRead) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    while head.len() < HEAD && !tells_enough(&head) {
        let wanted = HEAD - head.len();
        let found = match input.fill_buf() {
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            found => found?,
        };
        let taken = found.len().min(wanted);
        if taken == 0 {
            break;
        }
        head.extend_from_slice(found.get(..taken).unwrap_or_default());
        input.consume(taken);
    }
    Ok(head)
}

/// Whether more bytes would tell no more.
fn tells_enough(head: &[u8]) -> bool {
    let text = without_mark(head).trim_ascii_start();
    // What stands before the header of a table is text, too; lines of objects begin with one soon.
    let whole = text.iter().rposition(|b| *b == b'\n');
    let lines = text
        .get(..whole.map_or(0, |end| end + 1))
        .unwrap_or_default();
    !Format::may_be_magic(head)
        && (Format::of_bytes(head).is_some()
            || (!lines.is_empty() && !delimited::may_be_table(lines)))
}

/// Opens a file to be read from its beginning.
///
/// # Errors
/// It is missing, a directory, or empty.
pub fn open(path: &Path) -> Result<File> {
    let fail = |source| Error::Open {
        path: path.to_owned(),
        source,
    };
    let file = File::open(path).map_err(fail)?;
    let metadata = file.metadata().map_err(fail)?;
    if metadata.is_dir() {
        return Err(Error::IsDirectory {
            path: path.to_owned(),
        });
    }
    if metadata.is_file() && metadata.len() == 0 {
        return Err(Error::Empty {
            path: path.to_owned(),
        });
    }
    Ok(file)
}
