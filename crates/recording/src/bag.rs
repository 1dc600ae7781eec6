//! ROS 1 bags, version 2.0 -> the records MCAP has for them. Pure.
//!
//! A stage of its own because a bag's records are framed and told otherwise; what they say is the same: a connection
//! is a channel with its schema, a message has a time and a payload, and both lie in chunks. The index at the end is not
//! needed, since a recorder that was killed has written none.
//!
//! ```text
//! bytes -> record (head, fields) -> transcribe (the records of a chunk)
//! ```
//!
//! Layouts: <http://wiki.ros.org/Bags/Format/2.0>.

mod record;
mod transcribe;

pub(crate) use record::{Head, chunk_at, head, op};
pub(crate) use transcribe::{connection, next_record, transcribe};

/// The first line of a bag.
pub(crate) const MAGIC: [u8; 13] = *b"#ROSBAG V2.0\n";
