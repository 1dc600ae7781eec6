//! GPMF, the telemetry of GoPro's cameras, alone or as a track of a video -> the records MCAP has for it. Pure.
//!
//! A stage of its own because a camera writes one payload a second, with hundreds of samples and no stamp for any of
//! them: what a sample is, and when, comes from the payload's place in the track and from what it says of itself.
//!
//! ```text
//! video -> movie (where payloads lie, and when) -> klv (keys, numbers) -> stream (samples, axes) -> transcriber
//! (stamps, messages) ```
//!
//! Layouts: <https://github.com/gopro/gpmf-parser>, its README; ISO 14496-12 for the boxes of a video.

mod klv;
mod movie;
mod stream;
mod transcriber;

pub(crate) use klv::{HEAD as ITEM_HEAD, length as item_length, next_device};
pub(crate) use movie::{Lasts, Movie, Sample, index};
pub(crate) use transcriber::Transcriber;

/// The first bytes of a stream without a video around it.
pub(crate) const MAGIC: [u8; 5] = *b"DEVC\0";

/// Duration of a payload where none is stated, ns: cameras write one a second.
pub(crate) const SECOND: u64 = 1_000_000_000;

/// Longest payload that is read, bytes; those in use are a hundredth of that.
pub(crate) const LONGEST: u64 = 4 << 20;
