//! Bytes -> the head of one record, and whether its body is what its type says. Pure.
//!
//! Apart from the walk because the format has no checksum: that something is a record shows only in such marks,
//! and the same marks are asked of a record in its place and of bytes behind damage.

use super::format::{Layout, is_name, size_of};

/// Bytes before a record's body: its length and its type.
pub(super) const HEAD: usize = 3;

/// Longest record, with its head.
pub(super) const LONGEST: usize = HEAD + u16::MAX as usize;

/// Contents of a synchronisation record.
const SYNC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];

/// Number of bytes of a text that are looked at: the marks of a record must cost the same however long it is.
const LOOK: usize = 64;

/// Length of the body and type, where there are as many bytes.
pub(super) fn head(data: &[u8]) -> Option<(usize, u8)> {
    let [low, high, kind] = *data.first_chunk::<HEAD>()?;
    Some((usize::from(u16::from_le_bytes([low, high])), kind))
}

/// Look of a record.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum RecordVerdict {
    /// Body with the marks of its type.
    Whole,
    /// A message of a kind that nothing has defined.
    Unknown(u16),
    /// A type this program does not know; which is stepped over if what follows is a record.
    Strange,
    /// Known type, without its marks.
    Wrong,
}

/// Look of the record of this type and body; `layout` is that of the messages of an id.
pub(super) fn look(kind: u8, body: &[u8], layout: impl Fn(u16) -> Option<Layout>) -> RecordVerdict {
    let whole = match kind {
        b'D' => match id(body) {
            None => false,
            Some(id) => match layout(id) {
                None => return RecordVerdict::Unknown(id),
                Some(layout) => (layout.least..=layout.size).contains(&(body.len() - 2)),
            },
        },
        b'B' => body.len() >= 40,
        b'F' => body.iter().take(LOOK).any(|b| *b == b':') && is_text(body),
        b'A' => body.get(3..).is_some_and(|name| {
            name.len() <= 255 && std::str::from_utf8(name).is_ok_and(|name| is_name(name, b"_-/"))
        }),
        b'R' | b'O' => body.len() == 2,
        b'S' => body == SYNC,
        b'I' => is_pair(body, true),
        // Of a text in several parts, pyulog writes the length of one of them to all.
        b'M' => body
            .split_first()
            .is_some_and(|(_, pair)| is_pair(pair, false)),
        b'Q' => body
            .split_first()
            .is_some_and(|(_, pair)| is_pair(pair, true)),
        b'P' => is_pair(body, true) && pair(body).is_some_and(|(_, value)| value.len() == 4),
        b'L' => is_said(body, 9),
        b'C' => is_said(body, 11),
        _ => return RecordVerdict::Strange,
    };
    if whole {
        RecordVerdict::Whole
    } else {
        RecordVerdict::Wrong
    }
}

/// The id a record is about.
pub(super) fn id(body: &[u8]) -> Option<u16> {
    body.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
}

/// Name with type, and value: `char[3] sys_name`, `PX4`.
pub(super) fn pair(body: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = body.split_first()?;
    let (key, value) = rest.split_at_checked(usize::from(*length))?;
    Some((std::str::from_utf8(key).ok()?, value))
}

/// Whether it is a name with type and value, of the `exact` length the type says.
fn is_pair(body: &[u8], exact: bool) -> bool {
    pair(body).is_some_and(|(key, value)| {
        let Some((kind, name)) = key.split_once(' ') else {
            return false;
        };
        let (kind, many) = match kind.split_once('[') {
            None => (kind, Some(1)),
            Some((kind, many)) => (kind, many.strip_suffix(']').and_then(|n| n.parse().ok())),
        };
        // A name may be of any characters that can be seen.
        let proper = !name.is_empty() && is_text(name.as_bytes());
        let size = size_of(kind)
            .zip(many)
            .map(|(size, n): (usize, usize)| size.saturating_mul(n));
        proper && size.is_some_and(|size| !exact || size == value.len())
    })
}

/// A level as a digit, what else stands before the text, and the text.
fn is_said(body: &[u8], head: usize) -> bool {
    let level = body.first().is_some_and(|b| (b'0'..=b'7').contains(b));
    level && body.get(head..).is_some_and(is_text)
}

/// Whether its beginning is text, without characters that move a cursor but for a few.
fn is_text(bytes: &[u8]) -> bool {
    let beginning = bytes.get(..LOOK).unwrap_or(bytes);
    let odd = |b: &u8| (*b < b' ' && !b"\t\r\n\x1b".contains(b)) || *b == 0x7f;
    // Some loggers end a text with a zero.
    let beginning = beginning.strip_suffix(&[0]).unwrap_or(beginning);
    !beginning.iter().any(odd)
}
