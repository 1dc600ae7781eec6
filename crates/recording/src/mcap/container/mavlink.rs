//! The bytes of a telemetry log -> blocks of records. I/O.
//!
//! Apart from [`crate::mavlink`], which does the work and knows no files.

use super::super::block::Block;
use super::super::input::Input;
use super::super::problem::{ProblemKind, Problems};
use super::super::scan::{Facts, Item};
use super::streamed::Streamed;
use crate::format::Format;
use crate::mavlink::{Fault, FaultKind, Transcriber};
use crate::records::transcript::Transcript;
use std::io;

/// Bytes read at a time, and bytes of records worked on together.
const RUN: usize = 256 << 10;

/// The walk over a log.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    log: Streamed,
    transcriber: Transcriber,
    problems: Problems,
}

impl Scanner {
    pub(super) fn new(input: Input) -> Self {
        Scanner {
            log: Streamed::new(input),
            transcriber: Transcriber::default(),
            problems: Problems::default(),
        }
    }

    pub(super) fn position(&self) -> u64 {
        self.log.position()
    }

    pub(super) fn next(&mut self) -> io::Result<Option<Item>> {
        let offset = self.log.position();
        let mut to = Transcript::default();
        let Scanner {
            log,
            transcriber,
            problems,
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
