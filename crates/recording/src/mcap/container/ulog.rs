//! The bytes of a ULog -> blocks of records. I/O.
//!
//! Apart from [`crate::ulog`], which does the work and knows no files.

use super::super::block::{Block, Payload};
use super::super::input::{Input, Tape};
use super::super::problem::{ProblemKind, Problems};
use super::super::record::op;
use super::super::scan::{Facts, Item};
use crate::format::Format;
use crate::records::transcript::Transcript;
use crate::ulog::{Fault, FaultKind, Step, Transcriber};
use std::io;

/// Bytes read, and bytes of records worked on, together.
const RUN: usize = 1 << 20;

/// The walk over a ULog.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    tape: Tape,
    transcriber: Transcriber,
    problems: Problems,
    /// Bytes that are needed to go on.
    need: usize,
    done: bool,
    /// Memory of blocks that were used.
    spare: Vec<Vec<u8>>,
}

/// Blocks whose memory is kept: as many as are on their way with few threads.
const SPARE: usize = 8;

impl Scanner {
    pub(super) fn new(input: Input) -> Self {
        Scanner {
            tape: Tape::new(input, 0),
            transcriber: Transcriber::default(),
            problems: Problems::default(),
            need: 1,
            done: false,
            spare: Vec::new(),
        }
    }

    pub(super) fn tape(&self) -> &Tape {
        &self.tape
    }

    pub(super) fn recycle(&mut self, payload: Payload) {
        if let Payload::Held(mut held) = payload
            && self.spare.len() < SPARE
        {
            held.bytes.clear();
            self.spare.push(held.bytes);
        }
    }

    pub(super) fn next(&mut self) -> io::Result<Option<Item>> {
        let offset = self.tape.position();
        let mut to = Transcript {
            bytes: self.spare.pop().unwrap_or_default(),
        };
        while !self.done && to.bytes.len() < RUN {
            let ahead = self.tape.available(self.need, RUN.max(2 * self.need))?;
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
            format: Format::Ulog,
            library: self.transcriber.system(),
            ..Facts::default()
        };
        (facts, self.problems)
    }
}

fn told(fault: Fault, problems: &mut Problems) {
    let (kind, skipped) = match fault.kind {
        FaultKind::Cut { need, have } => (ProblemKind::Truncated { need, have }, 0),
        FaultKind::Garbage { skipped } => (ProblemKind::Garbage { skipped }, 0),
        FaultKind::Wrong { kind, length } => (ProblemKind::WrongRecord { kind, length }, length),
        FaultKind::Definition { kind } => {
            let opcode = if kind == b'F' {
                op::SCHEMA
            } else {
                op::CHANNEL
            };
            (ProblemKind::BadDefinition { opcode }, 0)
        }
        FaultKind::TooMany => (ProblemKind::TooManyDefinitions, 0),
        FaultKind::Dropout { millis } => (ProblemKind::Dropout { millis }, 0),
        FaultKind::Feature { bits } => (ProblemKind::UnknownFeature { bits }, 0),
    };
    problems.add(fault.offset, kind, None);
    problems.skip(skipped);
}
