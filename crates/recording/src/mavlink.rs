//! Telemetry logs of ground stations (`.tlog`, MAVLink) and captured bytes of a link -> the records MCAP has for them.
//! Pure.
//!
//! A stage of its own because a log is nothing but frames as they came over the air, each behind the time it was
//! received; a capture is the same without times, and has those of the vehicle alone. What a frame is shows in its checksum, which is known for the messages that are read; of others the next
//! frame has to follow.
//!
//! ```text
//! bytes -> frame (head, checksum) -> message (samples in SI, x forward, y left, z up) -> transcriber (channels, what was lost)
//! ```
//!
//! Layouts: <https://mavlink.io/en/guide/serialization.html>, <https://mavlink.io/en/messages/common.html>.

mod frame;
mod link;
mod message;
mod sequence;
mod transcriber;

pub use frame::checksum;
pub(crate) use frame::{cut, is_capture, is_log, may_be_capture, may_be_log};
pub use link::Link;
pub(crate) use transcriber::Transcriber;
