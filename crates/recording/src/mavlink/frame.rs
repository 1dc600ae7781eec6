//! Bytes -> one frame. Pure.
//!
//! Apart because both versions of the protocol may take turns in one log, and end as the same here.

use super::message::checksum_of;

/// Bytes of the time before each frame.
const STAMP: usize = 8;
/// Longest frame with its time: 255 bytes of payload, signed.
pub(super) const LONGEST: usize = STAMP + 10 + 255 + 2 + 13;

/// Times that are believed, us: from 2001 to 2096.
const TIMES: std::ops::Range<u64> = 1_000_000_000_000_000..4_000_000_000_000_000;

/// A frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Frame<'a> {
    /// Time at which it was received, us since 1970.
    pub(super) time: u64,
    pub(super) system: u8,
    pub(super) component: u8,
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
        && match bytes.get(STAMP..) {
            Some([0xfe, ..]) => true,
            // Of the flags one is known.
            Some([0xfd, _, flags, ..]) => *flags <= 1,
            Some([0xfd, ..]) => true,
            _ => false,
        }
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
pub(super) fn frame(bytes: &[u8]) -> Result<Frame<'_>, Option<usize>> {
    const HEAD: usize = STAMP + 3;
    let head = bytes.get(..HEAD).ok_or(Some(HEAD))?;
    if !is_log(head) {
        return Err(None);
    }
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
    let length = usize::from(byte(STAMP + 1));
    let (before, signature) = match byte(STAMP) {
        0xfe => (6, 0),
        _ => (10, 13 * usize::from(byte(STAMP + 2) & 1)),
    };
    let total = STAMP + before + length + 2 + signature;
    let whole = bytes.get(..total).ok_or(Some(total))?;
    let at = STAMP + before;
    let (system, component, message) = match byte(STAMP) {
        0xfe => (byte(STAMP + 3), byte(STAMP + 4), u32::from(byte(STAMP + 5))),
        _ => {
            let number = [byte(STAMP + 7), byte(STAMP + 8), byte(STAMP + 9), 0];
            (byte(STAMP + 5), byte(STAMP + 6), u32::from_le_bytes(number))
        }
    };
    let sum = [byte(at + length), byte(at + length + 1)];
    let checked = match checksum_of(message) {
        None => Checked::Unknown,
        Some(extra) => {
            let bytes = whole.get(STAMP + 1..at + length).unwrap_or(&[]);
            let sum_of_all = add(
                bytes.iter().fold(0xffff, |sum, byte| add(sum, *byte)),
                extra,
            );
            match sum_of_all == u16::from_le_bytes(sum) {
                true => Checked::Right,
                false => Checked::Wrong,
            }
        }
    };
    Ok(Frame {
        time: whole
            .first_chunk()
            .map_or(0, |time| u64::from_be_bytes(*time)),
        system,
        component,
        message,
        payload: whole.get(at..at + length).unwrap_or(&[]),
        total,
        checked,
    })
}

/// Continues the checksum of MAVLink (X.25).
fn add(sum: u16, byte: u8) -> u16 {
    let mut own = byte ^ (sum & 0xff) as u8;
    own ^= own << 4;
    let own = u16::from(own);
    (sum >> 8) ^ (own << 8) ^ (own << 3) ^ (own >> 4)
}
