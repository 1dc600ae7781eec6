//! Bytes -> one frame. Pure.
//!
//! Apart because both versions of the protocol may take turns in one log, and end as the same here.

use super::message::checksum_of;
use crate::records::cut::Cut;
use std::collections::BTreeMap;

/// Bytes of the time before each frame of a log; a capture has none.
pub(super) const STAMP: usize = 8;
/// Longest frame with its time: 255 bytes of payload, signed.
pub(super) const LONGEST: usize = STAMP + 10 + 255 + 2 + 13;
/// Bytes by which the beginning of a frame is known, behind its time.
const MARKS: usize = 3;
/// Frames whose checksum is right by which a capture is known: two do not come about by chance.
const TELLING: usize = 2;
/// Frames, each behind another and with the next number of its sender, by which one is known whatever its messages are.
const COUNTED: usize = 4;

/// Times that are believed, us: from 2001 to 2096.
const TIMES: std::ops::Range<u64> = 1_000_000_000_000_000..4_000_000_000_000_000;

/// A frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Frame<'a> {
    /// Time at which it was received, us since 1970; 0 in a capture.
    pub(super) time: u64,
    pub(super) system: u8,
    pub(super) component: u8,
    /// Number among those of its component, modulo 256.
    pub(super) sequence: u8,
    pub(super) message: u32,
    /// Payload, without zeros at its end in the second version.
    pub(super) payload: &'a [u8],
    /// Bytes of all, with the time.
    pub(super) total: usize,
    pub(super) checked: Checked,
}

/// Verdict of its checksum.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Checked {
    Right,
    Wrong,
    /// Unknown: its message is none that is read.
    Unknown,
}

/// Whether a log begins so.
pub(crate) fn is_log(bytes: &[u8]) -> bool {
    let time = bytes.first_chunk().map(|time| u64::from_be_bytes(*time));
    time.is_some_and(|time| TIMES.contains(&time))
        && bytes.get(STAMP..).is_some_and(|rest| begins(rest, 0))
}

/// Whether a frame may begin so, behind `stamp` bytes of a time.
pub(super) fn begins(bytes: &[u8], stamp: usize) -> bool {
    match bytes {
        _ if stamp > 0 => is_log(bytes),
        [0xfe, ..] => true,
        // Of the flags one is known.
        [0xfd, _, flags, ..] => *flags <= 1,
        [0xfd, ..] => true,
        _ => false,
    }
}

/// Bytes of a capture by which it is known, so that a stream of it has to show no more.
const SHOWN: usize = 4 * LONGEST;

/// Whether a capture begins so: like a frame, and with right ones, or such as count, among what is shown.
pub(crate) fn is_capture(bytes: &[u8]) -> bool {
    let bytes = bytes.get(..SHOWN).unwrap_or(bytes);
    if !begins(bytes, 0) {
        return false;
    }
    let (mut at, mut right, mut counted) = (0, 0, 0);
    let mut last = BTreeMap::new();
    while let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
        at += match frame(rest, 0) {
            Ok(found) if found.checked != Checked::Wrong => {
                right += usize::from(found.checked == Checked::Right);
                let sender = (found.system, found.component);
                let before: Option<u8> = last.insert(sender, found.sequence);
                let is_next = before.is_some_and(|n| n.wrapping_add(1) == found.sequence);
                counted += usize::from(is_next);
                found.total
            }
            _ => 1,
        };
        if right >= TELLING || counted >= COUNTED {
            return true;
        }
    }
    false
}

/// Whether more bytes could make these the beginning of a capture.
pub(crate) fn may_be_capture(bytes: &[u8]) -> bool {
    bytes.len() < SHOWN && begins(bytes, 0) && !is_capture(bytes)
}

/// Whether more bytes could make these the beginning of a log.
pub(crate) fn may_be_log(bytes: &[u8]) -> bool {
    match bytes {
        [] | [0] => true,
        [0, second, ..] => bytes.len() <= STAMP && (0x03..=0x0e).contains(second),
        _ => false,
    }
}

/// The frame that begins here. `Err` says how many bytes are needed to tell, or `None` that it is none.
/// There are `stamp` bytes of a time before it.
pub(super) fn frame(bytes: &[u8], stamp: usize) -> Result<Frame<'_>, Option<usize>> {
    let marks = stamp + MARKS;
    let head = bytes.get(..marks).ok_or(Some(marks))?;
    if !begins(head, stamp) {
        return Err(None);
    }
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
    let length = usize::from(byte(stamp + 1));
    let (before, signature) = match byte(stamp) {
        0xfe => (6, 0),
        _ => (10, 13 * usize::from(byte(stamp + 2) & 1)),
    };
    let total = stamp + before + length + 2 + signature;
    let whole = bytes.get(..total).ok_or(Some(total))?;
    let at = stamp + before;
    let (sender, message) = match byte(stamp) {
        0xfe => (stamp + 2, u32::from(byte(stamp + 5))),
        _ => {
            let number = [byte(stamp + 7), byte(stamp + 8), byte(stamp + 9), 0];
            (stamp + 4, u32::from_le_bytes(number))
        }
    };
    let sum = [byte(at + length), byte(at + length + 1)];
    let checked = match checksum_of(message) {
        None => Checked::Unknown,
        Some(extra) => {
            let bytes = whole.get(stamp + 1..at + length).unwrap_or(&[]);
            match checksum(bytes, extra) == u16::from_le_bytes(sum) {
                true => Checked::Right,
                false => Checked::Wrong,
            }
        }
    };
    Ok(Frame {
        time: whole
            .first_chunk()
            .filter(|_| stamp == STAMP)
            .map_or(0, |time| u64::from_be_bytes(*time)),
        sequence: byte(sender),
        system: byte(sender + 1),
        component: byte(sender + 2),
        message,
        payload: whole.get(at..at + length).unwrap_or(&[]),
        total,
        checked,
    })
}

/// Cuts a frame of a link: one whose checksum is right, for none else is known to be one.
pub(crate) fn cut(bytes: &[u8]) -> Cut {
    match frame(bytes, 0) {
        Err(Some(need)) => Cut::Need(need),
        Err(None) => Cut::No,
        Ok(found) => match found.checked {
            Checked::Wrong => Cut::No,
            checked => Cut::Frame {
                total: found.total,
                tells: checked == Checked::Right,
            },
        },
    }
}

/// Checksum of a frame without its first byte; `extra` is the byte made of the fields of its message.
#[must_use]
pub fn checksum(bytes: &[u8], extra: u8) -> u16 {
    let sum = bytes.iter().fold(0xffff, |sum, byte| add(sum, *byte));
    add(sum, extra)
}

/// Continues the checksum of MAVLink (X.25).
fn add(sum: u16, byte: u8) -> u16 {
    let mut own = byte ^ (sum & 0xff) as u8;
    own ^= own << 4;
    let own = u16::from(own);
    (sum >> 8) ^ (own << 8) ^ (own << 3) ^ (own >> 4)
}
