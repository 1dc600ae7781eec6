//! ULog, the log of PX4 -> the records MCAP has for it. Pure.
//!
//! A stage of its own because the format has neither checksums nor an index: what is a record shows only in
//! what it says and in what follows. Bytes are pushed in any cut; what comes out depends on the bytes alone.
//!
//! ```text
//! bytes -> record (head, what it must look like) -> transcriber (definitions, messages, what was lost)
//!          format (its text -> sizes, and the same fields as a ROS 1 definition)
//! ```
//!
//! A message's bytes are those of a ROS 1 message of the same fields: packed, little-endian, nothing before an
//! array of fixed length. So the channels are told as such, and one decoder reads both.
//!
//! Layouts: <https://docs.px4.io/main/en/dev_log/ulog_file_format.html>.

mod format;
mod record;
mod transcriber;

pub(crate) use transcriber::Transcriber;

/// The first seven bytes of a file. A byte of version and the start's time follow.
pub(crate) const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";

/// Bytes before the first record.
pub(crate) const HEADER: usize = 16;
