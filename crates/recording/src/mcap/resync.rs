//! Bytes without framing -> the next thing that can only be a chunk. I/O.
//!
//! A stage of its own because it is a search, not a walk: a chunk's record length, the length and
//! name of its compression and its packed size must all agree, which random bytes do not.
//! Its CRC is checked afterwards like any other's.

use super::block::Compression;
use super::input::Tape;
use crate::records::record::{Body, ChunkHead};
use crate::records::{HEAD, head_at, op};
use std::io;

/// Bytes searched at a time.
const WINDOW: usize = 256 << 10;
/// Bytes searched first: where chunks and garbage take turns, the next chunk is near, and each search starts anew.
const FIRST: usize = 4 << 10;
/// Bytes needed to judge a candidate: head, fields, the longest name known.
const SIGNATURE: usize = HEAD + 40 + 4;

/// Moves to the next chunk at or after `from` (a stream: after the position). `false` when
/// there is none; the tape is then at its end.
pub(super) fn next_chunk(tape: &mut Tape, from: u64, limit: u64) -> io::Result<bool> {
    if tape.remaining().is_some() {
        tape.seek(from);
    } else {
        tape.skip(from.saturating_sub(tape.position()))?;
    }
    let mut window = FIRST;
    loop {
        let left = tape.remaining();
        let ahead = tape.available(window, window)?;
        let found = (0..ahead.len()).find(|&i| {
            ahead.get(i) == Some(&op::CHUNK)
                && ahead
                    .get(i..)
                    .and_then(|b| length(b, limit))
                    .is_some_and(|total| {
                        left.is_none_or(|left| total <= left.saturating_sub(i as u64))
                    })
        });
        let have = ahead.len();
        if let Some(i) = found {
            tape.skip(i as u64)?;
            return Ok(true);
        }
        if have < window {
            tape.skip(have as u64)?;
            return Ok(false);
        }
        tape.skip((have - SIGNATURE + 1) as u64)?;
        window = WINDOW.min(2 * window);
    }
}

/// Length of the chunk record that begins here, if one does.
fn length(data: &[u8], limit: u64) -> Option<u64> {
    let (_, length) = head_at(data, 0)?;
    let body = data.get(HEAD..)?;
    let body = body.get(..SIGNATURE - HEAD).unwrap_or(body);
    let head = ChunkHead::parse(body)?;
    let compression = Compression::named(head.compression)?;
    let sizes = match compression {
        Compression::None => head.compressed_size == head.uncompressed_size,
        _ => head.compressed_size > 0,
    };
    let agrees = sizes
        && head.compressed_size.max(head.uncompressed_size) <= limit
        && length == head.len().checked_add(head.compressed_size)?;
    agrees.then(|| length + HEAD as u64)
}
