//! The first bytes of a recording, then its name -> which format it is. Pure but for [`Format::of_file`].
//!
//! Apart from the readers because it comes before all of them: files are called whatever somebody called them, and a
//! pipe has no name. What the bytes say wins over what the name says.

pub(crate) mod neighbour;

use crate::error::{Error, Result};
use crate::records::MAGIC;
pub use crate::records::transcript::HEAD;
use crate::records::transcript::Transcribe;
use crate::text::without_mark;
use crate::{bag, dataflash, delimited, devices, gpmf, mavlink, parquet, recognise, sqlite, ulog};
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
    /// Frames of MAVLink as they came over a link.
    Mavlink,
    /// Frames of an inertial sensor as they came over a link.
    Device,
    /// A log of ArduPilot's flight controllers.
    DataFlash,
    /// One JSON object per line.
    Lines,
    /// Rows of cells: the CSV that strapd writes itself, and other makers' tables.
    Table,
    /// The same rows stored by columns, in Parquet.
    Parquet,
    /// Format of this table's test.
    #[cfg(test)]
    Toy,
}

/// Reading of a format: who cuts its bytes into what.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reading {
    /// Objects, one a line.
    Lines,
    /// Rows of text under names.
    Rows,
    /// The same rows, stored by columns.
    Columns,
    /// Records of MCAP.
    Records,
    /// Records of a ROS 1 bag.
    Bag,
    /// Pages of SQLite.
    Database,
    /// Payloads of a camera, which an index may tell of.
    Telemetry,
    /// Bytes from front to end, transcribed to records by what this makes.
    Transcribed(fn() -> Box<dyn Transcribe>),
}

/// Facts of a format: all that the house knows of one before it is read.
#[derive(Debug)]
struct Row {
    format: Format,
    /// Name, as people call it.
    name: &'static str,
    /// First bytes that tell it by themselves; none where there are none.
    magic: &'static [u8],
    /// Whether it looks like this format, where no magic tells.
    looks_like: fn(&[u8]) -> bool,
    /// Whether more bytes could make it look so.
    may_look_like: fn(&[u8]) -> bool,
    /// Endings of names, for what the bytes do not tell.
    endings: &'static [&'static str],
    /// Whether it is read in another order than that of its bytes.
    is_read_anywhere: bool,
    reading: Reading,
}

/// Row of a log of records: what a row below leaves out.
const LOG: Row = Row {
    format: Format::Mcap,
    name: "MCAP",
    magic: &MAGIC,
    looks_like: never,
    may_look_like: never,
    endings: &["mcap"],
    is_read_anywhere: false,
    reading: Reading::Records,
};

/// The formats, in the order in which texts list them.
const ROWS: &[Row] = &[
    LOG,
    Row {
        format: Format::Ulog,
        name: "ULog",
        magic: &ulog::MAGIC,
        endings: &["ulg", "ulog"],
        reading: Reading::Transcribed(|| Box::new(ulog::Transcriber::default())),
        ..LOG
    },
    Row {
        format: Format::Bag,
        name: "ROS 1 bag",
        magic: &bag::MAGIC,
        endings: &["bag"],
        reading: Reading::Bag,
        ..LOG
    },
    Row {
        format: Format::Rosbag2,
        name: "rosbag2 SQLite",
        magic: &sqlite::MAGIC,
        endings: &["db3"],
        is_read_anywhere: true,
        reading: Reading::Database,
        ..LOG
    },
    Row {
        format: Format::Gpmf,
        name: "GPMF",
        magic: &gpmf::MAGIC,
        // Whether it has telemetry shows when it is opened.
        looks_like: is_video,
        endings: &[],
        is_read_anywhere: true,
        reading: Reading::Telemetry,
        ..LOG
    },
    Row {
        format: Format::Tlog,
        name: "MAVLink tlog",
        magic: &[],
        looks_like: mavlink::is_log,
        may_look_like: mavlink::may_be_log,
        endings: &["tlog"],
        reading: Reading::Transcribed(|| Box::new(mavlink::Transcriber::default())),
        ..LOG
    },
    Row {
        format: Format::Mavlink,
        name: "MAVLink capture",
        magic: &[],
        looks_like: mavlink::is_capture,
        may_look_like: mavlink::may_be_capture,
        // Nobody has one for it.
        endings: &[],
        reading: Reading::Transcribed(|| Box::new(mavlink::Transcriber::of_capture())),
        ..LOG
    },
    Row {
        format: Format::Device,
        name: "sensor capture",
        magic: &[],
        looks_like: devices::is_capture,
        may_look_like: devices::may_be_capture,
        // Nobody has one for it.
        endings: &[],
        reading: Reading::Transcribed(|| Box::new(devices::Transcriber::default())),
        ..LOG
    },
    Row {
        format: Format::DataFlash,
        name: "ArduPilot DataFlash",
        magic: &dataflash::MAGIC,
        // Others call theirs .bin, too.
        endings: &[],
        reading: Reading::Transcribed(|| Box::new(dataflash::Transcriber::default())),
        ..LOG
    },
    Row {
        format: Format::Lines,
        name: "NDJSON",
        magic: &[],
        looks_like: is_lines,
        endings: &["ndjson", "jsonl"],
        reading: Reading::Lines,
        ..LOG
    },
    Row {
        format: Format::Table,
        name: "CSV",
        magic: &[],
        looks_like: is_rows,
        endings: &["csv", "tsv", "gcsv", "tum"],
        reading: Reading::Rows,
        ..LOG
    },
    Row {
        format: Format::Parquet,
        name: "Parquet",
        magic: &parquet::MAGIC,
        endings: &["parquet"],
        is_read_anywhere: true,
        reading: Reading::Columns,
        ..LOG
    },
    #[cfg(test)]
    tests::TOY,
];

/// Length of the longest magic.
pub(crate) const LONGEST_MAGIC: usize = {
    let (mut longest, mut at) = (0, 0);
    while at < ROWS.len() {
        if ROWS[at].magic.len() > longest {
            longest = ROWS[at].magic.len();
        }
        at += 1;
    }
    longest
};

/// Mark of a video, behind four bytes.
const VIDEO: &[u8] = b"ftyp";

impl Format {
    /// The formats that are read, in the order in which texts list them.
    pub const ALL: [Format; ROWS.len()] = {
        let (mut all, mut at) = ([Format::Mcap; ROWS.len()], 0);
        while at < ROWS.len() {
            all[at] = ROWS[at].format;
            at += 1;
        }
        all
    };

    /// The names of [`Format::ALL`], separated by commas: the list of every help text and message.
    #[must_use]
    pub fn names() -> String {
        Format::ALL.map(Format::name).join(", ")
    }

    fn row(self) -> &'static Row {
        let mut rows = ROWS.iter();
        rows.find(|row| row.format == self).unwrap_or(&LOG)
    }

    /// Name of the format, as people call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Reader that cuts it.
    pub(crate) fn reading(self) -> Reading {
        self.row().reading
    }

    /// Whether it is read as text, lines or rows; everything else is a log of messages on channels.
    #[must_use]
    pub fn is_text(self) -> bool {
        matches!(self.reading(), Reading::Lines) || self.is_table()
    }

    /// Whether it is rows under names.
    #[must_use]
    pub fn is_table(self) -> bool {
        matches!(self.reading(), Reading::Rows | Reading::Columns)
    }

    /// The log of messages on channels of which these are the first bytes.
    #[must_use]
    pub(crate) fn of_log(head: &[u8]) -> Option<Format> {
        Format::of_bytes(head).filter(|format| !format.is_text())
    }

    /// Whether more bytes behind these could make one of [`Format::of_log`].
    #[must_use]
    pub(crate) fn may_be_log(head: &[u8]) -> bool {
        ROWS.iter().any(|row| {
            let is_part = row.magic.len() > head.len() && row.magic.starts_with(head);
            is_part || (row.may_look_like)(head)
        })
    }

    /// Whether it is read in another order than that of its bytes, so that a stream of it is first put into a file.
    #[must_use]
    pub fn is_read_anywhere(self) -> bool {
        self.row().is_read_anywhere
    }

    /// The format of which these are the first bytes; `None` where they tell nothing.
    #[must_use]
    pub fn of_bytes(head: &[u8]) -> Option<Format> {
        let is_marked = |row: &&Row| !row.magic.is_empty() && head.starts_with(row.magic);
        let looks_so = |row: &&Row| (row.looks_like)(head);
        let mut rows = ROWS.iter();
        let found = rows.find(is_marked).or_else(|| ROWS.iter().find(looks_so));
        found.map(|row| row.format)
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
        let has = |row: &&Row| {
            let mut known = row.endings.iter();
            known.any(|known| ending.eq_ignore_ascii_case(known))
        };
        ROWS.iter().find(has).map(|row| row.format)
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

fn never(_: &[u8]) -> bool {
    false
}

/// Whether it begins like an object or a list of them.
fn is_lines(head: &[u8]) -> bool {
    let text = without_mark(head).trim_ascii_start();
    matches!(text.first(), Some(b'{' | b'['))
}

/// Whether it begins with a header, perhaps behind other lines.
fn is_rows(head: &[u8]) -> bool {
    let text = without_mark(head).trim_ascii_start();
    let is_cut = head.len() >= HEAD && !text.ends_with(b"\n");
    let mut lines = text.split(|b| *b == b'\n');
    if is_cut {
        lines.next_back();
    }
    delimited::may_be_table(text)
        && lines
            .take(delimited::MOST_HEAD_LINES)
            .any(|line| delimited::is_header(line, None))
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
    !Format::may_be_log(head)
        && (Format::of_bytes(head).is_some()
            || (!lines.is_empty() && !delimited::may_be_table(lines) && !has_controls(head)))
}

/// Whether there are bytes that no text has: frames may follow, within one of which it begins.
fn has_controls(head: &[u8]) -> bool {
    head.iter()
        .any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace())
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
    let file = File::open(path).map_err(|source| fail(neighbour::named(path, source)))?;
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

#[cfg(test)]
mod tests;
