//! First bytes of a capture, or of a link -> the protocol of its frames. Pure.
//!
//! Apart from the readers because several protocols are tried on the same bytes. One is known by frames whose checksum
//! holds, never by a mark alone: three of them, which are most of what came since the first.

use super::frame::{Cut, LONGEST};
use super::{Opens, PROTOCOLS, Protocol};

/// Frames by which a protocol is known: so many do not come about by chance.
const TELLING: u64 = 3;

/// Trial of one protocol on bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trial {
    /// Bytes looked at.
    at: usize,
    /// Place of the first frame that tells.
    first: Option<usize>,
    tells: u64,
    /// Bytes of frames since the first that tells.
    covered: usize,
}

impl Trial {
    /// Looks at more of the bytes; returns where the protocol was known, if it is.
    pub(super) fn go_on(&mut self, protocol: &Protocol, bytes: &[u8]) -> Option<usize> {
        while let Some(rest) = bytes.get(self.at..).filter(|rest| !rest.is_empty()) {
            match (protocol.cut)(rest) {
                Cut::Need(_) => return None,
                Cut::No => self.at += 1,
                Cut::Frame { total, tells } => {
                    self.tells += u64::from(tells);
                    if tells {
                        self.first.get_or_insert(self.at);
                    }
                    self.at += total.max(1);
                    self.covered += if self.first.is_some() { total } else { 0 };
                    let since = self.at - self.first.unwrap_or(0);
                    if self.tells >= TELLING && 2 * self.covered > since {
                        return Some(self.at);
                    }
                }
            }
        }
        None
    }

    /// Forgets so many bytes at the beginning.
    pub(super) fn forget(&mut self, bytes: usize) {
        if self.first.is_some_and(|first| first < bytes) {
            (self.first, self.tells, self.covered) = (None, 0, 0);
        }
        self.at = self.at.saturating_sub(bytes);
        self.first = self.first.map(|first| first.saturating_sub(bytes));
    }
}

/// Protocol of a capture that begins so: of several the one that is known first.
pub(super) fn recognised(bytes: &[u8]) -> Option<&'static Protocol> {
    let devices = PROTOCOLS
        .iter()
        .filter(|protocol| matches!(protocol.opens, Opens::Device(_)));
    let known = devices.filter_map(|protocol| {
        let at = Trial::default().go_on(protocol, bytes)?;
        Some((at, protocol))
    });
    known
        .min_by_key(|(at, _)| *at)
        .map(|(_, protocol)| protocol)
}

/// Whether a capture begins so.
pub(crate) fn is_capture(bytes: &[u8]) -> bool {
    recognised(bytes).is_some()
}

/// Bytes that are waited for where the first are like those of a frame.
const SHOWN: usize = 3 * LONGEST / 2;

/// Whether more bytes could make these the beginning of a capture: they begin with a frame.
pub(crate) fn may_be_capture(bytes: &[u8]) -> bool {
    let begins = |protocol: &&Protocol| match (protocol.cut)(bytes) {
        Cut::No => false,
        Cut::Need(_) | Cut::Frame { .. } => matches!(protocol.opens, Opens::Device(_)),
    };
    bytes.len() < SHOWN
        && !bytes.is_empty()
        && PROTOCOLS.iter().any(|protocol| begins(&protocol))
        && !is_capture(bytes)
}
