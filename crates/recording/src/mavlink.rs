//! Telemetry logs of ground stations (`.tlog`, MAVLink) -> the records MCAP has for them. Pure.
//!
//! A stage of its own because a log is nothing but frames as they came over the air, each behind the time it was
//! received. What a frame is shows in its checksum, which is known for the messages that are read; of others the next
//! frame has to follow.
//!
//! ```text
//! bytes -> frame (head, checksum) -> message (samples in SI, x forward, y left, z up) -> transcriber (channels, what was lost)
//! ```
//!
//! Layouts: <https://mavlink.io/en/guide/serialization.html>, <https://mavlink.io/en/messages/common.html>.

mod frame;
mod message;
mod transcriber;

pub(crate) use frame::{is_log, may_be_log};
pub(crate) use transcriber::Transcriber;
