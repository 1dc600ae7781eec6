//! An input of any container -> blocks of records, and what was wrong. I/O.
//!
//! A stage of its own so that the walk is one: containers differ in how they are cut, and in nothing behind that.

pub(super) mod bag;
pub(super) mod gpmf;
mod pages;
mod rosbag2;
mod transcribed;

use super::index::Passed;
use super::scan::{Facts, Item, OtherRecords, Scanner};
use super::{Payload, Reader};
use crate::format::Reading;
use crate::records::problem::Problems;
use std::io;

/// Walk over an input.
pub(super) trait Container {
    /// The next block, or `None` at the end.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    fn next(&mut self) -> io::Result<Option<Item>>;

    /// Position it has come to, in bytes.
    fn position(&self) -> u64;

    /// Facts that the log states about itself, and what was wrong with it.
    fn finish(self: Box<Self>) -> (Facts, Problems);

    /// Takes the memory of a block that was used.
    fn recycle(&mut self, _: Payload) {}

    /// Leaves out these chunks, which stand in this order.
    fn pass_over_chunks(&mut self, _: &[Passed]) {}

    /// Messages there should be, by what the log counts.
    fn claimed(&self) -> Option<u64> {
        None
    }
}

// By its name: the vtable of every one of them would hold code that prints all its fields.
impl std::fmt::Debug for dyn Container {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Container")
    }
}

/// Begins the walk over an input.
pub(super) fn scan(reader: Reader, besides: OtherRecords) -> Box<dyn Container> {
    let Reader {
        input,
        limits,
        format,
        beside,
        index: _,
    } = reader;
    match format.reading() {
        Reading::Transcribed(make) => {
            Box::new(transcribed::Transcribed::new(input, format, make()))
        }
        Reading::Bag => Box::new(bag::Scanner::new(input, limits)),
        Reading::Database => Box::new(rosbag2::Scanner::new(input, beside, limits)),
        Reading::Telemetry => Box::new(gpmf::Scanner::new(input)),
        // Text is not opened here.
        Reading::Records | Reading::Lines | Reading::Rows | Reading::Columns => {
            Box::new(Scanner::new(input, limits, besides))
        }
    }
}

/// Blocks whose memory is kept: as many as are on their way with few threads.
const SPARE: usize = 8;

/// Memory of blocks that were used.
#[derive(Debug, Default)]
struct Spare(Vec<Vec<u8>>);

impl Spare {
    /// Memory for a block: used before, if there is any.
    fn take(&mut self) -> Vec<u8> {
        self.0.pop().unwrap_or_default()
    }

    fn put(&mut self, payload: Payload) {
        if let Payload::Held(mut held) = payload
            && self.0.len() < SPARE
        {
            held.bytes.clear();
            self.0.push(held.bytes);
        }
    }
}
