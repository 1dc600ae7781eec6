//! The files of a recording of ROS 2 in SQLite -> blocks of records. I/O.
//!
//! Apart from [`crate::rosbag2`], which does the work and knows no files. A database is read in the order of its
//! tables, not of its bytes, so a stream of one was put into a file before it comes here.

use super::super::block::{Block, Payload};
use super::super::input::{Input, LogFile};
use super::super::scan::{Facts, Item};
use super::super::{DatabaseSidecars, Limits};
use super::pages::FilePages;
use super::{Container, Spare};
use crate::format::Format;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::Transcript;
use crate::rosbag2::{Bag, Fault, FaultKind};
use std::io;
use std::sync::Arc;

/// Bytes of records worked on together.
const RUN: usize = 1 << 20;

/// The walk over a recording.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    /// Files to be opened: the database, and those beside it.
    files: Option<(Arc<LogFile>, DatabaseSidecars)>,
    limits: Limits,
    open: Option<(FilePages, Bag)>,
    problems: Problems,
    distribution: String,
    /// Position in the file of the records given last.
    position: u64,
    spare: Spare,
}

impl Scanner {
    pub(super) fn new(input: Input, beside: DatabaseSidecars, limits: Limits) -> Self {
        let files = match input {
            Input::File(file) => Some((file, beside)),
            Input::Stream { .. } => None,
        };
        debug_assert!(files.is_some(), "who opens a stream keeps it in a file");
        Scanner {
            files,
            limits,
            open: None,
            problems: Problems::default(),
            distribution: String::new(),
            position: 0,
            spare: Spare::default(),
        }
    }

    fn begin(
        &mut self,
        file: Arc<LogFile>,
        beside: DatabaseSidecars,
        to: &mut Transcript,
    ) -> io::Result<()> {
        let mut faults = Vec::new();
        let opened = FilePages::open(file, beside.wal, &mut faults)?;
        if beside.has_journal {
            self.problems.add(0, ProblemKind::Journal, None);
        }
        for fault in faults {
            let kind = ProblemKind::Beside { why: fault.why };
            self.problems.add(fault.offset, kind, None);
        }
        match opened {
            Err(why) => self.problems.add(0, ProblemKind::Database { why }, None),
            Ok((mut pages, header)) => {
                let limits = (self.limits.record, self.limits.definitions);
                let mut bag = Bag::open(&mut pages, header, limits, to)?;
                for fault in bag.faults.drain(..) {
                    told(fault, &pages, &mut self.problems);
                }
                self.distribution = std::mem::take(&mut bag.distribution);
                self.open = Some((pages, bag));
            }
        }
        Ok(())
    }
}

impl Container for Scanner {
    fn next(&mut self) -> io::Result<Option<Item>> {
        let mut to = Transcript {
            bytes: self.spare.take(),
        };
        if let Some((file, beside)) = self.files.take() {
            self.begin(file, beside, &mut to)?;
        }
        let offset = self.position;
        while let Some((pages, bag)) = &mut self.open
            && to.bytes.len() < RUN
        {
            let goes_on = bag.next(pages, &mut to)?;
            for fault in bag.faults.drain(..) {
                told(fault, pages, &mut self.problems);
            }
            self.position = pages.offset(bag.page());
            if !goes_on {
                self.open = None;
            }
        }
        Ok(Block::of_records(offset, to.bytes).map(Item::Block))
    }

    fn position(&self) -> u64 {
        self.position
    }

    fn recycle(&mut self, payload: Payload) {
        self.spare.put(payload);
    }

    fn finish(self: Box<Self>) -> (Facts, Problems) {
        let library = match self.distribution.as_str() {
            "" => "rosbag2".to_owned(),
            name => format!("rosbag2 of ROS 2 {name}"),
        };
        let facts = Facts {
            format: Format::Rosbag2,
            library,
            ..Facts::default()
        };
        (facts, self.problems)
    }
}

fn told(fault: Fault, pages: &FilePages, problems: &mut Problems) {
    let kind = match fault.kind {
        FaultKind::Cut { need, have } => ProblemKind::PagesMissing { need, have },
        FaultKind::Uncommitted { pages } => ProblemKind::PagesUncommitted { pages },
        FaultKind::Page { page, why } => ProblemKind::Page { page, why },
        FaultKind::Row { why } => ProblemKind::Row { why },
        FaultKind::NoTable { name } => ProblemKind::NoTable { name },
        FaultKind::TooMany => ProblemKind::TooManyDefinitions,
    };
    problems.add(pages.offset(fault.page), kind, fault.messages);
}
