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

use std::io::{self, Read, Seek, SeekFrom};
use strapd_attitude::record::Nanos;

/// Instants of the frames of a video's picture, on the clock of its telemetry, by the times its track states. Where
/// frames are shown in another order than they are kept, these are the times of the latter.
///
/// # Errors
/// It cannot be read; else why there are none, in words.
pub(crate) fn frames(
    file: &mut (impl Read + Seek),
) -> io::Result<Result<Vec<Nanos>, &'static str>> {
    let size = file.seek(SeekFrom::End(0))?;
    let index = index(size, &mut |at, into| {
        file.seek(SeekFrom::Start(at))?;
        let mut have = 0;
        while have < into.len() {
            match file.read(&mut into[have..])? {
                0 => break,
                more => have += more,
            }
        }
        Ok(have)
    })?;
    Ok(index.and_then(|index| {
        let picture = Movie::picture(&index).ok_or("it has no track with a picture")?;
        // The clock is that of the telemetry, whose track says the same.
        let begins = Movie::of(&index).map_or(picture.begins(), |telemetry| telemetry.begins());
        let stamp = |frame: Sample| i64::try_from(begins.saturating_add(frame.at));
        // A frame has a byte at least.
        let frames = picture.take(usize::try_from(size).unwrap_or(usize::MAX));
        Ok(frames
            .map(|frame| Nanos(stamp(frame).unwrap_or(i64::MAX)))
            .collect())
    }))
}

/// The first bytes of a stream without a video around it.
pub(crate) const MAGIC: [u8; 5] = *b"DEVC\0";

/// Duration of a payload where none is stated, ns: cameras write one a second.
pub(crate) const SECOND: u64 = 1_000_000_000;

/// Longest payload that is read, bytes; those in use are a hundredth of that.
pub(crate) const LONGEST: u64 = 4 << 20;
