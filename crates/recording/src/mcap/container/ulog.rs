//! The bytes of a ULog -> blocks of records. I/O.
//!
//! Apart from [`crate::ulog`], which does the work and knows no files.

use super::super::block::{Block, Payload};
use super::super::input::Input;
use super::super::problem::{ProblemKind, Problems};
use super::super::record::op;
use super::super::scan::{Facts, Item};
use super::streamed::Streamed;
use crate::format::Format;
use crate::records::transcript::Transcript;
use crate::ulog::{Fault, FaultKind, Transcriber};
use std::io;

/// Bytes read, and bytes of records worked on, together.
const RUN: usize = 1 << 20;

/// The walk over a ULog.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    log: Streamed,
    transcriber: Transcriber,
    problems: Problems,
    /// Memory of blocks that were used.
    spare: Vec<Vec<u8>>,
}

/// Blocks whose memory is kept: as many as are on their way with few threads.
const SPARE: usize = 8;

impl Scanner {
    pub(super) fn new(input: Input) -> Self {
        Scanner {
            log: Streamed::new(input),
            transcriber: Transcriber::default(),
            problems: Problems::default(),
            spare: Vec::new(),
        }
    }

    pub(super) fn position(&self) -> u64 {
        self.log.position()
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
        let offset = self.log.position();
        let mut to = Transcript {
            bytes: self.spare.pop().unwrap_or_default(),
        };
        let Scanner {
            log,
            transcriber,
            problems,
            ..
        } = self;
        log.next(RUN, &mut to, |rest, is_end, to| {
            let step = transcriber.step(rest, is_end, to);
            for fault in transcriber.faults.drain(..) {
                told(fault, problems);
            }
            step
        })?;
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
