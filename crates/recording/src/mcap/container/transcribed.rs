//! A log that is read from its front to its end, of whatever format -> blocks of records. I/O.
//!
//! Apart from what a format makes of its bytes ([`Transcribe`]), which knows no files: how far to read ahead, and when a
//! log ends, is the same for each.

use super::super::Payload;
use super::super::block::Block;
use super::super::input::{Input, Tape};
use super::super::scan::{Facts, Item};
use super::{Container, Spare};
use crate::format::Format;
use crate::records::problem::Problems;
use crate::records::transcript::{Transcribe, Transcript};
use std::io;

/// The walk over a log.
#[derive(Debug)]
pub(super) struct Transcribed {
    tape: Tape,
    format: Format,
    transcriber: Box<dyn Transcribe>,
    /// Bytes that are needed to go on.
    need: usize,
    done: bool,
    spare: Spare,
}

impl Transcribed {
    pub(super) fn new(input: Input, format: Format, transcriber: Box<dyn Transcribe>) -> Self {
        Transcribed {
            tape: Tape::new(input, 0),
            format,
            transcriber,
            need: 1,
            done: false,
            spare: Spare::default(),
        }
    }
}

impl Container for Transcribed {
    fn next(&mut self) -> io::Result<Option<Item>> {
        let offset = self.tape.position();
        let run = self.transcriber.run();
        let mut to = Transcript {
            bytes: self.spare.take(),
        };
        while !self.done && to.bytes.len() < run {
            let ahead = self.tape.available(self.need, run.max(2 * self.need))?;
            let is_end = ahead.len() < self.need;
            let (used, need) = self.transcriber.steps(ahead, is_end, &mut to);
            self.need = need;
            self.done = is_end && used == ahead.len();
            self.tape.skip(used as u64)?;
        }
        Ok(Block::of_records(offset, to.bytes).map(Item::Block))
    }

    fn position(&self) -> u64 {
        self.tape.position()
    }

    fn recycle(&mut self, payload: Payload) {
        self.spare.put(payload);
    }

    fn finish(self: Box<Self>) -> (Facts, Problems) {
        let (library, problems) = self.transcriber.finish();
        let facts = Facts {
            format: self.format,
            library,
            ..Facts::default()
        };
        (facts, problems)
    }
}
