//! An input of any container -> blocks of records, and what was wrong. I/O.
//!
//! A stage of its own so that the walk is one: containers differ in how they are cut, and in nothing behind that.

pub(super) mod bag;
pub(super) mod gpmf;
mod mavlink;
mod pages;
mod rosbag2;
mod streamed;
mod ulog;

use super::index::Passed;
use super::problem::Problems;
use super::scan::{Besides, Facts, Item, Scanner};
use super::{Payload, Reader};
use crate::format::Format;
use std::io;

/// The walk over an input, by its format.
#[derive(Debug)]
pub(super) enum Container {
    Mcap(Box<Scanner>),
    Ulog(Box<ulog::Scanner>),
    Bag(Box<bag::Scanner>),
    Rosbag2(Box<rosbag2::Scanner>),
    Gpmf(Box<gpmf::Scanner>),
    Tlog(Box<mavlink::Scanner>),
}

impl Container {
    pub(super) fn new(reader: Reader, besides: Besides) -> Self {
        let Reader {
            input,
            limits,
            format,
            beside,
            index: _,
        } = reader;
        match format {
            Format::Ulog => Container::Ulog(Box::new(ulog::Scanner::new(input))),
            Format::Bag => Container::Bag(Box::new(bag::Scanner::new(input, limits))),
            Format::Rosbag2 => {
                Container::Rosbag2(Box::new(rosbag2::Scanner::new(input, beside, limits)))
            }
            Format::Gpmf => Container::Gpmf(Box::new(gpmf::Scanner::new(input))),
            Format::Tlog => Container::Tlog(Box::new(mavlink::Scanner::new(input))),
            // Text is not opened here.
            Format::Mcap | Format::Lines | Format::Table | Format::Parquet => {
                Container::Mcap(Box::new(Scanner::new(input, limits, besides)))
            }
        }
    }

    /// Leaves out these chunks of an MCAP, which stand in this order.
    pub(super) fn pass_over_chunks(&mut self, passed: &[Passed]) {
        if let Container::Mcap(scanner) = self {
            scanner.pass_over_chunks(passed);
        }
    }

    /// The next block, or `None` at the end.
    pub(super) fn next(&mut self) -> io::Result<Option<Item>> {
        match self {
            Container::Mcap(scanner) => scanner.next(),
            Container::Ulog(scanner) => scanner.next(),
            Container::Bag(scanner) => scanner.next(),
            Container::Rosbag2(scanner) => scanner.next(),
            Container::Gpmf(scanner) => scanner.next(),
            Container::Tlog(scanner) => scanner.next(),
        }
    }

    /// Position it has come to, in bytes.
    pub(super) fn position(&self) -> u64 {
        match self {
            Container::Mcap(scanner) => scanner.tape().position(),
            Container::Ulog(scanner) => scanner.position(),
            Container::Bag(scanner) => scanner.tape().position(),
            Container::Rosbag2(scanner) => scanner.position(),
            Container::Gpmf(scanner) => scanner.position(),
            Container::Tlog(scanner) => scanner.position(),
        }
    }

    pub(super) fn recycle(&mut self, payload: Payload) {
        match self {
            Container::Mcap(scanner) => scanner.recycle(payload),
            Container::Ulog(scanner) => scanner.recycle(payload),
            Container::Bag(scanner) => scanner.recycle(payload),
            Container::Rosbag2(scanner) => scanner.recycle(payload),
            Container::Gpmf(_) | Container::Tlog(_) => {}
        }
    }

    /// Messages there should be, by what the log counts.
    pub(super) fn claimed(&self) -> Option<u64> {
        match self {
            Container::Mcap(scanner) => scanner.claimed(),
            Container::Ulog(_)
            | Container::Rosbag2(_)
            | Container::Gpmf(_)
            | Container::Tlog(_) => None,
            Container::Bag(scanner) => scanner.claimed(),
        }
    }

    /// Facts that the log states about itself, and what was wrong with it.
    pub(super) fn finish(self) -> (Facts, Problems) {
        match self {
            Container::Mcap(scanner) => (scanner.facts, scanner.problems),
            Container::Ulog(scanner) => scanner.finish(),
            Container::Bag(scanner) => scanner.finish(),
            Container::Rosbag2(scanner) => scanner.finish(),
            Container::Gpmf(scanner) => scanner.finish(),
            Container::Tlog(scanner) => scanner.finish(),
        }
    }
}
