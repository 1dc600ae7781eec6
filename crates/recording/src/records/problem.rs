//! Problems of a file -> a bounded list that states where and how much was lost. Pure.
//!
//! A stage of its own because a damaged log must still be read to its end: nothing here is an
//! error, everything here is counted.

use crate::records::op;
use std::fmt;

/// Number of problems kept in full; the rest are only counted, so that a hostile file
/// cannot fill memory with complaints.
const KEPT: usize = 100;

/// One thing that was wrong, and where.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Problem {
    /// Byte offset in the file of the record it concerns.
    pub offset: u64,
    /// Kind.
    pub kind: ProblemKind,
    /// Messages lost by it, where that is known (from the message index behind a chunk).
    pub messages: Option<u64>,
}

/// Kind of a problem of an MCAP file that can still be read on.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ProblemKind {
    /// The file ends inside a record.
    Truncated {
        /// Length of the record, with its nine bytes of head.
        need: u64,
        /// Bytes of it that are there.
        have: u64,
    },
    /// The file ends between two records, without a footer.
    NoFooter,
    /// The recorder was stopped before it wrote the index (ROS 1 bag).
    NoIndex,
    /// The writer died while writing this chunk: its length was never filled in.
    UnfinishedChunk {
        /// Whether its records were read all the same, unverified (uncompressed chunks only).
        read_on: bool,
    },
    /// Bytes that are no record; reading went on at the next chunk.
    Garbage {
        /// Bytes skipped.
        skipped: u64,
    },
    /// A record longer than the limit.
    RecordTooLong {
        /// Opcode.
        opcode: u8,
        /// Length.
        length: u64,
        /// The limit.
        limit: u64,
    },
    /// A chunk that would be larger than the limit when unpacked.
    ChunkTooBig {
        /// The size it declares.
        size: u64,
        /// The limit.
        limit: u64,
    },
    /// A chunk packed by a method other than none, lz4, zstd.
    UnknownCompression {
        /// Name as the file has it.
        name: String,
    },
    /// A chunk that does not unpack.
    Unpack {
        /// Reason that the decompressor gave.
        why: String,
    },
    /// A chunk that unpacks to another size than it declares.
    ChunkSize {
        /// Declared bytes.
        declared: u64,
        /// Actual bytes.
        actual: u64,
    },
    /// A chunk whose records are not those that were written.
    ChunkCrc {
        /// CRC-32 in the file.
        stored: u32,
        /// CRC-32 of what is there.
        computed: u32,
    },
    /// Unchunked records are not those that were written (known only once all were read).
    DataCrc {
        /// CRC-32 in the file.
        stored: u32,
        /// CRC-32 of what is there.
        computed: u32,
    },
    /// A record inside a chunk runs over the chunk's end; records before it were used.
    InnerRecord {
        /// Offset in the unpacked chunk.
        at: u64,
        /// Length of the record's body.
        length: u64,
    },
    /// Bytes inside a chunk that begin with opcode 0 and so are no record; records before them were used.
    NoInnerRecord {
        /// Offset in the unpacked chunk.
        at: u64,
    },
    /// Messages too short to hold a message header.
    ShortMessages,
    /// Messages on a channel that was never defined.
    UnknownChannel {
        /// Id.
        id: u16,
    },
    /// A schema or channel record whose lengths do not add up, or that is not UTF-8.
    BadDefinition {
        /// Opcode.
        opcode: u8,
    },
    /// Definitions beyond the memory limit for them; ignored.
    TooManyDefinitions,
    /// The channel names a schema that is not in the file.
    MissingSchema {
        /// The channel's topic.
        topic: String,
        /// The schema's id.
        schema_id: u16,
    },
    /// The id was given a second meaning; from here on the later one holds.
    Redefined {
        /// "channel" or "schema".
        what: &'static str,
        /// The id.
        id: u16,
        /// Topic or schema name before.
        was: String,
        /// Topic or schema name after.
        now: String,
    },
    /// The chunk that defined this channel is lost; the summary's definition was used.
    DefinedBySummary {
        /// The channel's topic.
        topic: String,
    },
    /// The statistics count more messages than were found: a record with messages in it was passed over
    /// as something else.
    Missing {
        /// Messages by the statistics.
        claimed: u64,
        /// Messages found.
        found: u64,
    },
    /// An attachment or metadata record that cannot be used; met only where these are copied.
    Attached {
        /// "attachment" or "metadata".
        what: &'static str,
        /// Why.
        why: &'static str,
    },
    /// A record of a type this program does not know, or without what its type must have, between records that
    /// have (ULog).
    WrongRecord {
        /// Type, a letter.
        kind: u8,
        /// Bytes of its body.
        length: u64,
    },
    /// The logger was too slow, and dropped what came within this time (ULog).
    Dropout {
        /// Duration, ms.
        millis: u16,
    },
    /// A feature this program does not know, without which the rest may be misread (ULog).
    UnknownFeature {
        /// Flags.
        bits: u64,
    },
    /// The first page of a database says no layout that there is.
    Database {
        /// Why.
        why: &'static str,
    },
    /// A database that ends before its last page.
    PagesMissing {
        /// Pages by its header.
        need: u32,
        /// Pages that are there.
        have: u32,
    },
    /// Pages behind those of the last transaction of a database: the recorder was stopped.
    PagesUncommitted {
        /// Number of pages.
        pages: u32,
    },
    /// A page of a database that cannot be read.
    Page {
        /// Number of the page, from 1.
        page: u32,
        /// Why.
        why: &'static str,
    },
    /// A row of a database that cannot be read, or is no message.
    Row {
        /// Why.
        why: &'static str,
    },
    /// A database without a table that is needed.
    NoTable {
        /// The table.
        name: &'static str,
    },
    /// The file beside a database with its last pages cannot be used, or not as a whole.
    Beside {
        /// Why.
        why: &'static str,
    },
    /// A video whose telemetry cannot be found, or not all of it.
    Video {
        /// Why.
        why: &'static str,
    },
    /// Telemetry of a camera that cannot be read.
    Telemetry {
        /// Description.
        why: &'static str,
    },
    /// A message whose checksum is wrong (MAVLink).
    Checksum,
    /// Frames that their sender has numbered, and that are not there (MAVLink).
    FramesMissing {
        /// Number of frames.
        count: u64,
    },
    /// Samples in which the device reports an axis at the end of its range.
    Clipped {
        /// Number of samples.
        count: u64,
    },
    /// A file beside a database says that a change of it was not ended.
    Journal,
    /// The summary at the end cannot be used; nothing is lost by that.
    BadSummary {
        /// Why.
        why: &'static str,
    },
}

impl ProblemKind {
    /// Whether messages are, or may be, missing or wrong because of it.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        !matches!(
            self,
            ProblemKind::Redefined { .. }
                | ProblemKind::DefinedBySummary { .. }
                | ProblemKind::MissingSchema { .. }
                | ProblemKind::Attached { .. }
                | ProblemKind::BadSummary { .. }
        )
    }
}

impl fmt::Display for ProblemKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ProblemKind::Truncated { need, have } => {
                write!(f, "the file is cut: a record of {need} bytes has {have}")
            }
            ProblemKind::NoFooter => write!(f, "the file is cut: it ends without a footer"),
            ProblemKind::NoIndex => {
                write!(f, "the recorder was stopped: the bag ends without an index")
            }
            ProblemKind::UnfinishedChunk { read_on: true } => {
                write!(
                    f,
                    "the writer stopped inside this chunk; its records are read unverified"
                )
            }
            ProblemKind::UnfinishedChunk { read_on: false } => {
                write!(f, "the writer stopped inside this chunk; it cannot be read")
            }
            ProblemKind::Garbage { skipped } => {
                write!(f, "no record here; {skipped} bytes skipped")
            }
            ProblemKind::RecordTooLong {
                opcode,
                length,
                limit,
            } => {
                write!(
                    f,
                    "record 0x{opcode:02x} of {length} bytes, limit {limit}; skipped"
                )
            }
            ProblemKind::ChunkTooBig { size, limit } => {
                write!(f, "chunk of {size} bytes, limit {limit}; skipped")
            }
            ProblemKind::UnknownCompression { name } => {
                write!(
                    f,
                    "chunk packed with {name:?}, not none, lz4 or zstd; skipped"
                )
            }
            ProblemKind::Unpack { why } => write!(f, "chunk does not unpack ({why}); skipped"),
            ProblemKind::ChunkSize { declared, actual } => {
                write!(
                    f,
                    "chunk declares {declared} bytes and holds {actual}; skipped"
                )
            }
            ProblemKind::ChunkCrc { stored, computed } => {
                write!(
                    f,
                    "chunk CRC is {computed:08x}, not {stored:08x} as written; skipped"
                )
            }
            ProblemKind::DataCrc { stored, computed } => write!(
                f,
                "data CRC is {computed:08x}, not {stored:08x} as written: messages may be wrong"
            ),
            ProblemKind::InnerRecord { at, length } => write!(
                f,
                "record of {length} bytes at {at} runs over the end of its chunk; the rest skipped"
            ),
            ProblemKind::NoInnerRecord { at } => write!(
                f,
                "no record at {at} in its chunk (opcode 0); the rest skipped"
            ),
            ProblemKind::ShortMessages => write!(f, "messages shorter than a message header"),
            ProblemKind::UnknownChannel { id } => {
                write!(f, "messages on channel {id}, which is not defined")
            }
            ProblemKind::BadDefinition { opcode } => {
                let what = if *opcode == op::SCHEMA {
                    "schema"
                } else {
                    "channel"
                };
                write!(f, "{what} record that cannot be read")
            }
            ProblemKind::TooManyDefinitions => {
                write!(f, "more schemas and channels than fit the limit; ignored")
            }
            ProblemKind::MissingSchema { topic, schema_id } => {
                write!(
                    f,
                    "{topic:?} names schema {schema_id}, which is not in the file"
                )
            }
            ProblemKind::Redefined { what, id, was, now } => {
                write!(f, "{what} {id} was {was:?} and is {now:?} from here on")
            }
            ProblemKind::DefinedBySummary { topic } => {
                write!(
                    f,
                    "{topic:?} is defined by the summary alone; its own definition is lost"
                )
            }
            ProblemKind::Missing { claimed, found } => {
                write!(
                    f,
                    "the statistics count {claimed} messages, {found} were found"
                )
            }
            ProblemKind::Attached { what, why } => write!(f, "{what} record skipped: {why}"),
            ProblemKind::WrongRecord { kind, length } => write!(
                f,
                "a record of type {:?} with {length} bytes that cannot be used; skipped",
                char::from(*kind)
            ),
            ProblemKind::Dropout { millis } => {
                write!(f, "logger dropout: what came within {millis} ms is missing")
            }
            ProblemKind::UnknownFeature { bits } => write!(
                f,
                "the log needs a feature this program does not know (flags {bits:#x})"
            ),
            ProblemKind::Database { why } => write!(f, "the database cannot be read: {why}"),
            ProblemKind::PagesMissing { need, have } => {
                write!(f, "the file is cut: of {need} pages {have} are there")
            }
            ProblemKind::PagesUncommitted { pages } => write!(
                f,
                "the recorder was stopped: {pages} pages are of no finished transaction; messages in them are read all the same"
            ),
            ProblemKind::Page { page, why } => {
                write!(f, "page {page} of the database cannot be read: {why}")
            }
            ProblemKind::Row { why } => write!(f, "a row cannot be read: {why}; skipped"),
            ProblemKind::NoTable { name } => {
                write!(f, "the database has no table {name:?} that can be read")
            }
            ProblemKind::Beside { why } => {
                write!(f, "the file -wal beside the database: {why}")
            }
            ProblemKind::Video { why } => {
                write!(f, "the telemetry of the video cannot be read: {why}")
            }
            ProblemKind::Telemetry { why } => {
                write!(f, "telemetry that cannot be read: {why}; skipped")
            }
            ProblemKind::Checksum => write!(f, "the checksum of a message is wrong; skipped"),
            ProblemKind::FramesMissing { count } => {
                write!(f, "{count} frames that the sender has numbered are missing")
            }
            ProblemKind::Clipped { count } => write!(
                f,
                "the device reports {count} samples with an axis at the end of its range"
            ),
            ProblemKind::Journal => write!(
                f,
                "a file -journal beside the database says that it is in the middle of a change; `sqlite3 FILE .tables` puts it right"
            ),
            ProblemKind::BadSummary { why } => write!(f, "the summary cannot be used: {why}"),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at byte {}: {}", self.offset, self.kind)?;
        match self.messages {
            Some(1) => write!(f, " (1 message)"),
            Some(n) => write!(f, " ({n} messages)"),
            None => Ok(()),
        }
    }
}

/// Everything that was wrong with a file, in file order.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Problems {
    first: Vec<Problem>,
    total: u64,
    losses: u64,
    messages: u64,
    skipped: u64,
}

impl Problems {
    pub(crate) fn add(&mut self, offset: u64, kind: ProblemKind, messages: Option<u64>) {
        self.total += 1;
        self.losses += u64::from(kind.is_loss());
        self.messages = self.messages.saturating_add(messages.unwrap_or(0));
        match &kind {
            ProblemKind::Garbage { skipped } => self.skip(*skipped),
            ProblemKind::Truncated { have, .. } => self.skip(*have),
            _ => {}
        }
        if self.first.len() < KEPT {
            self.first.push(Problem {
                offset,
                kind,
                messages,
            });
        }
    }

    /// Bytes the last problem made unusable, where its own fields do not say.
    pub(crate) fn skip(&mut self, bytes: u64) {
        self.skipped = self.skipped.saturating_add(bytes);
    }

    pub(crate) fn merge(&mut self, other: Problems) {
        self.total += other.total;
        self.losses += other.losses;
        self.messages = self.messages.saturating_add(other.messages);
        self.skipped = self.skipped.saturating_add(other.skipped);
        self.first.extend(other.first);
        self.first.sort_by_key(|p| p.offset);
        self.first.truncate(KEPT);
    }

    /// The first hundred, by offset.
    #[must_use]
    pub fn first(&self) -> &[Problem] {
        &self.first
    }

    /// Number of problems.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Number of these that lose, or may falsify, messages ([`ProblemKind::is_loss`]).
    #[must_use]
    pub fn losses(&self) -> u64 {
        self.losses
    }

    /// Messages known to be lost; a lower bound, since a lost chunk without an index cannot be counted.
    #[must_use]
    pub fn messages_lost(&self) -> u64 {
        self.messages
    }

    /// Bytes of the file that were not used because of them; inside a chunk, of its unpacked records.
    #[must_use]
    pub fn bytes_skipped(&self) -> u64 {
        self.skipped
    }

    /// Whether nothing was wrong.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.total == 0
    }
}
