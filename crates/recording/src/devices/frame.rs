//! Sums and marks -> whether a frame is whole. Pure.
//!
//! Apart from the protocols because several of them have these in common.

pub(super) use crate::records::cut::Cut;

/// Longest frame of any protocol.
pub(super) const LONGEST: usize = 2_100;

/// Sum of bytes, modulo 256.
pub(super) fn sum(bytes: &[u8]) -> u8 {
    bytes
        .iter()
        .fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

/// Whether the bytes begin with `mark`, as far as both go.
pub(super) fn may_begin(bytes: &[u8], mark: &[u8]) -> bool {
    bytes.iter().zip(mark).all(|(byte, mark)| byte == mark)
}
