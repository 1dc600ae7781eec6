//! The bytes of a telemetry log -> blocks of records. I/O.
//!
//! Apart from [`crate::mavlink`], which does the work and knows no files.

use super::super::block::Block;
use super::super::input::{Input, Tape};
use super::super::problem::{ProblemKind, Problems};
use super::super::scan::{Facts, Item};
use crate::format::Format;
use crate::mavlink::{Fault, FaultKind, Step, Transcriber};
use crate::records::transcript::Transcript;
use std::io;

/// Bytes read at a time, and bytes of records worked on together.
const RUN: usize = 256 << 10;

/// The walk over a log.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    tape: Tape,
    transcriber: Transcriber,
    problems: Problems,
    /// Bytes that are needed to go on.
    need: usize,
    done: bool,
}

impl Scanner {
    pub(super) fn new(input: Input) -> Self {
        Scanner {
            tape: Tape::new(input, 0),
            transcriber: Transcriber::default(),
            problems: Problems::default(),
            need: 1,
            done: false,
        }
    }

    pub(super) fn position(&self) -> u64 {
        self.tape.position()
    }

    pub(super) fn next(&mut self) -> io::Result<Option<Item>> {
        let offset = self.tape.position();
        let mut to = Transcript::default();
        while !self.done && to.bytes.len() < RUN {
            let ahead = self.tape.available(self.need, RUN.max(self.need))?;
            let is_end = ahead.len() < self.need;
            let mut rest = ahead;
            self.need = 1;
            while !rest.is_empty() && to.bytes.len() < RUN {
                match self.transcriber.step(rest, is_end, &mut to) {
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
            for fault in self.transcriber.faults.drain(..) {
                told(fault, &mut self.problems);
            }
        }
        Ok(Block::of_records(offset, to.bytes).map(Item::Block))
    }

    pub(super) fn finish(self) -> (Facts, Problems) {
        let facts = Facts {
            format: Format::Tlog,
            ..Facts::default()
        };
        (facts, self.problems)
    }
}

fn told(fault: Fault, problems: &mut Problems) {
    let (kind, skipped, messages) = match fault.kind {
        FaultKind::Cut { need, have } => (ProblemKind::Truncated { need, have }, 0, None),
        FaultKind::Garbage { skipped } => (ProblemKind::Garbage { skipped }, 0, None),
        FaultKind::Checksum { length } => (ProblemKind::Checksum, length, Some(1)),
        FaultKind::TooMany => (ProblemKind::TooManyDefinitions, 0, None),
    };
    problems.add(fault.offset, kind, messages);
    problems.skip(skipped);
}
