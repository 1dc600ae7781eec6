//! Frames of a BNO08x in UART-RVC mode, cut alone. Pure.
//!
//! Apart although nothing of them is read: who connects one is told what it is, instead of that nothing comes.
//!
//! # Source
//! BNO08X Data Sheet (CEVA), "UART-RVC protocol"; PyPI `adafruit-circuitpython-bno08x-rvc` 1.0.24 reads the same.

use super::frame::{Cut, may_begin, sum};

const MARK: [u8; 2] = [0xaa, 0xaa];
/// Bytes of a frame: mark, index, three angles, three accelerations, three reserved, sum.
const TOTAL: usize = 19;

/// Cuts a frame.
pub(super) fn cut(bytes: &[u8]) -> Cut {
    if !may_begin(bytes, &MARK) {
        return Cut::No;
    }
    match bytes.get(..TOTAL) {
        None => Cut::Need(TOTAL),
        Some([_, _, summed @ .., last]) => Cut::checked(sum(summed) == *last, TOTAL),
        Some(_) => Cut::No,
    }
}
