//! Frames of each sender -> how many are missing, and what its sensors are called. Pure.
//!
//! Apart from who reads them because a capture and a living link count and name alike.

use super::frame::Frame;
use std::collections::BTreeMap;

/// Number of the next frame of each sender: system, component.
#[derive(Debug, Default)]
pub(super) struct Sequences(BTreeMap<(u8, u8), u8>);

impl Sequences {
    /// Number of frames that are missing before this one; of one that comes late, or twice, none.
    pub(super) fn missing(&mut self, found: &Frame<'_>) -> u8 {
        let sender = (found.system, found.component);
        let missing = match self.0.get(&sender) {
            Some(expected) => found.sequence.wrapping_sub(*expected),
            None => 0,
        };
        if missing > u8::MAX / 2 {
            return 0;
        }
        self.0.insert(sender, found.sequence.wrapping_add(1));
        missing
    }
}

/// Topic of a sensor: the name of its message, its index where that is not 0, and its sender where that is not the first.
pub(super) fn topic(name: &str, sensor: u8, own: (u8, u8), first: (u8, u8)) -> String {
    let mut topic = name.to_owned();
    if sensor > 0 {
        topic = format!("{topic}/{sensor}");
    }
    if own != first {
        topic = format!("{}.{}/{topic}", own.0, own.1);
    }
    topic
}
