//! A log that is read from its front to its end -> records, a stretch at a time. I/O.
//!
//! Apart from what the formats make of their bytes: how far to read ahead, and when a log ends, is the same for each.

use super::super::input::{Input, Tape};
use crate::records::transcript::{Step, Transcript};
use std::io;

/// A log under way.
#[derive(Debug)]
pub(super) struct Streamed {
    tape: Tape,
    /// Bytes that are needed to go on.
    need: usize,
    done: bool,
}

impl Streamed {
    pub(super) fn new(input: Input) -> Streamed {
        Streamed {
            tape: Tape::new(input, 0),
            need: 1,
            done: false,
        }
    }

    pub(super) fn position(&self) -> u64 {
        self.tape.position()
    }

    /// Steps until there are `run` bytes of records, or to the end. `step` is given the bytes behind those that were
    /// used, and whether the log ends with them.
    ///
    /// # Errors
    /// Only when the input itself cannot be read.
    pub(super) fn next(
        &mut self,
        run: usize,
        to: &mut Transcript,
        mut step: impl FnMut(&[u8], bool, &mut Transcript) -> Step,
    ) -> io::Result<()> {
        while !self.done && to.bytes.len() < run {
            let ahead = self.tape.available(self.need, run.max(2 * self.need))?;
            let is_end = ahead.len() < self.need;
            let mut rest = ahead;
            self.need = 1;
            while !rest.is_empty() && to.bytes.len() < run {
                match step(rest, is_end, to) {
                    Step::Used(n) => rest = rest.get(n..).unwrap_or(&[]),
                    Step::Need(n) => {
                        self.need = n.max(rest.len() + 1);
                        break;
                    }
                }
            }
            self.done = is_end && rest.is_empty();
            let used = ahead.len() - rest.len();
            self.tape.skip(used as u64)?;
        }
        Ok(())
    }
}
