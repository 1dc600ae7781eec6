//! A problem -> a sentence for people. Pure.
//!
//! Apart from the kinds because another wording changes nothing of what is counted as lost.

use super::{Problem, ProblemKind};
use crate::records::op;
use std::fmt;

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
