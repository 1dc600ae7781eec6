//! Problems of a file -> a bounded list that states where and how much was lost. Pure.
//!
//! A stage of its own because a damaged log must still be read to its end: nothing here is an
//! error, everything here is counted.

mod words;

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
