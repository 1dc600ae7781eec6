//! A walk under way: blocks in file order -> batches for the consumer. I/O.
//!
//! A stage of its own because here parallel work becomes a sequence again: workers answer in any
//! order, and each answer is taken when its block's turn has come.

use super::super::attached::intact;
use super::super::block::{Block, Kind};
use super::super::channels::{Channel, Table};
use super::super::container::Container;
use super::super::index::PassedOver;
use super::super::messages::{Message, Stop, Tally, pass};
use super::super::order::{Batch, Merger};
use super::super::read_error;
use super::super::scan::Item;
use super::super::survey::Survey;
use super::super::workers::{Done, Findings, Outcome, Piece, Shared, Ticket, place};
use super::WalkReport;
use crate::error::{Error, Result};
use crate::records::problem::{ProblemKind, Problems};
use crate::records::record::Record;
use crate::records::{HEAD, head_at};
use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use strapd_attitude::diagnostic::Diagnostic;

/// Groups of blocks on their way for each thread: enough that none waits, few enough that what one
/// thread wrote is still in a cache when another reads it (measured: 6 blocks of 1 MiB beat 24
/// by a tenth).
const GROUPS_PER_THREAD: usize = 3;

/// A walk under way, on the calling thread.
pub(super) struct Course<'w, T, D, M> {
    pub(super) shared: &'w Shared<T, D, M>,
    pub(super) select: &'w mut dyn FnMut(&Arc<Channel>) -> Option<D>,
    pub(super) consume: &'w mut dyn FnMut(&mut Vec<T>) -> ControlFlow<()>,
    pub(super) attached: &'w mut dyn FnMut(Record<'_>),
    pub(super) scanner: Box<dyn Container>,
    pub(super) merger: Merger<T>,
    pub(super) tallies: Vec<Tally>,
    /// Messages without a channel, by id, and where the first was.
    pub(super) unknown: BTreeMap<u16, (u64, u64)>,
    pub(super) short: Option<(u64, u64)>,
    pub(super) problems: Problems,
    /// Ripe items too few to be worth passing on.
    pub(super) small: Batch<T>,
    pub(super) least: usize,
    pub(super) hand_over: usize,
    pub(super) items: u64,
    /// Parts left out by an index.
    pub(super) passed: Option<PassedOver>,
    pub(super) name: PathBuf,
}

impl<T, D, M> Course<'_, T, D, M>
where
    M: Fn(&D, &Message<'_>, &mut Vec<T>),
{
    pub(super) fn alone(&mut self) -> Result<ControlFlow<()>> {
        while let Some(block) = self.next_block()? {
            if self.in_order(block)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(self.let_go(true))
    }

    pub(super) fn with_pool(
        &mut self,
        threads: usize,
        in_flight: usize,
        is_stream: bool,
        spawn: &mut dyn FnMut(Ticket<T>),
    ) -> Result<ControlFlow<()>> {
        let (to, from): (Sender<Outcome<T>>, Receiver<Outcome<T>>) = channel();
        // One slot for each group on its way, in file order, with its cost.
        let mut queue = VecDeque::<(usize, Option<Outcome<T>>)>::new();
        let mut first = 0u64;
        let mut cost = 0usize;
        let mut staged = None;
        let mut ended = false;
        loop {
            while !ended && queue.len() < threads * GROUPS_PER_THREAD {
                let group = match staged.take() {
                    Some(group) => group,
                    None => self.gather()?,
                };
                ended = group.is_empty();
                if ended {
                    break;
                }
                if queue.is_empty() && self.shared.with_table(Table::is_empty) {
                    // No channel is known: the next definition would send every block back.
                    for block in group {
                        if self.in_order(block)?.is_break() {
                            return Ok(ControlFlow::Break(()));
                        }
                    }
                    continue;
                }
                let more = group.iter().map(Block::cost).sum::<usize>();
                if !queue.is_empty() && cost + more + self.shared.waiting() > in_flight {
                    staged = Some(group);
                    break;
                }
                cost += more;
                let number = first + queue.len() as u64;
                queue.push_back((more, None));
                spawn(Ticket::new(number, group, to.clone()));
                if is_stream {
                    // What is done need not wait for what the stream has not sent yet.
                    for outcome in from.try_iter() {
                        put(&mut queue, first, outcome);
                    }
                    if matches!(queue.front(), Some((_, Some(_)))) {
                        break;
                    }
                }
            }
            while let Some((_, None)) = queue.front() {
                // `to` lives here, so this waits until a worker answers; every ticket does.
                let Ok(outcome) = from.recv() else { break };
                put(&mut queue, first, outcome);
            }
            let Some((less, outcome)) = queue.pop_front() else {
                break;
            };
            first += 1;
            cost = cost.saturating_sub(less);
            let Some(done) = outcome.and_then(|outcome| outcome.done) else {
                return Ok(ControlFlow::Break(()));
            };
            for (block, done) in done {
                if self.accept(block, done)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(self.let_go(true))
    }

    /// The next blocks that are handed over together; none at the end.
    fn gather(&mut self) -> Result<Vec<Block>> {
        let (mut group, mut cost) = (Vec::new(), 0);
        while cost < self.hand_over
            && let Some(block) = self.next_block()?
        {
            cost += block.cost();
            group.push(block);
        }
        Ok(group)
    }

    /// Takes a worker's answer, or does the block again where it rests on other definitions.
    fn accept(&mut self, block: Block, done: Done<T>) -> Result<ControlFlow<()>> {
        match done {
            Done::Failed(e) => Err(self.failed(block.offset, e)),
            Done::Bad(kind) => {
                self.unusable(&block, kind);
                Ok(self.deliver(Vec::new(), block))
            }
            Done::Walked {
                pieces,
                findings,
                fault,
            } => {
                self.shared.take(&pieces);
                if !self.shared.with_table(|table| findings.hold(table)) {
                    for piece in pieces {
                        self.shared.put_batch(piece.batch);
                    }
                    return self.in_order(block);
                }
                match fault {
                    Some((kind, unread)) => {
                        self.problems.add(block.offset, kind, None);
                        self.problems.skip(unread);
                    }
                    None => self.agrees(&block, &findings)?,
                }
                self.add_up(findings, block.offset);
                Ok(self.deliver(pieces, block))
            }
            Done::InOrder => self.in_order(block),
        }
    }

    fn next_block(&mut self) -> Result<Option<Block>> {
        match self.scanner.next() {
            Ok(Some(Item::Block(block))) => Ok(Some(block)),
            Ok(_) => Ok(None),
            Err(e) => Err(self.failed(self.scanner.position(), e)),
        }
    }

    fn failed(&self, offset: u64, e: io::Error) -> Error {
        read_error(&self.name, offset, e)
    }

    /// Does a block whose predecessors are all done, taking in its definitions.
    fn in_order(&mut self, block: Block) -> Result<ControlFlow<()>> {
        let mut bench = self.shared.bench();
        let mut piece = Piece {
            batch: self.shared.batch(),
            bytes: 0,
        };
        let (offset, mut left) = (block.offset, size(&block));
        match bench.buffers.open(&block) {
            Ok(Ok(body)) if matches!(block.kind, Kind::Attached { .. }) => {
                self.attach(&block, body);
            }
            Err(e) => return Err(self.failed(offset, e)),
            Ok(Err(kind)) => self.unusable(&block, kind),
            Ok(Ok(records)) => {
                let (mut from, mut begin) = (0, 0);
                let mut is_whole = true;
                let mut flow = ControlFlow::Continue(());
                while flow.is_continue() {
                    let stop = self.shared.with_table(|table| {
                        let (map, met) = (&self.shared.map, &mut bench.met);
                        let batch = &mut piece.batch;
                        pass(records, from, place(&block), table, map, met, batch)
                    });
                    let (select, problems) = (&mut *self.select, &mut self.problems);
                    match stop {
                        Stop::End => break,
                        Stop::Full { at } => {
                            let mut full = Piece {
                                batch: std::mem::replace(&mut piece.batch, self.shared.batch()),
                                bytes: at - begin,
                            };
                            self.shared.arrange(&mut full.batch);
                            flow = self.push(full, &mut left);
                            (from, begin) = (at, at);
                        }
                        Stop::Broken { .. } | Stop::NoRecord { .. } => {
                            if let Some((kind, at)) = stop.fault() {
                                problems.add(offset, kind, None);
                                problems.skip((records.len() - at) as u64);
                            }
                            is_whole = false;
                            break;
                        }
                        Stop::Definition { at } => {
                            let Some((opcode, length)) = head_at(records, at) else {
                                break;
                            };
                            let end = (at + HEAD).saturating_add(length as usize);
                            let Some(body) = records.get(at + HEAD..end) else {
                                break;
                            };
                            self.shared.change_table(|table| {
                                table.define(opcode, body, offset, select, problems);
                            });
                            from = end;
                        }
                        Stop::Adopt { at, id } => {
                            self.shared
                                .change_table(|table| table.adopt(id, offset, select, problems));
                            from = at;
                        }
                    }
                }
                let findings = Findings::of(&mut bench.met);
                if is_whole && flow.is_continue() {
                    self.agrees(&block, &findings)?;
                }
                self.add_up(findings, offset);
                if flow.is_break() {
                    return Ok(flow);
                }
                self.shared.arrange(&mut piece.batch);
            }
        }
        self.shared.put_bench(bench);
        piece.bytes = left;
        self.scanner.recycle(block.payload);
        Ok(self.push(piece, &mut left))
    }

    /// Holds a chunk against the index by which others are left out.
    fn agrees(&self, block: &Block, findings: &Findings) -> Result<()> {
        let (Some(passed), Kind::Chunk { .. }) = (&self.passed, &block.kind) else {
            return Ok(());
        };
        let channels = self.shared.with_table(|table| {
            let wanted = findings.channels.iter().filter(|(id, index, _)| {
                passed.is_wanted(*id) && table.entry(*index).is_some_and(|e| e.choice.is_some())
            });
            wanted.map(|(_, _, tally)| tally.messages).sum()
        });
        if passed.agrees(block.offset, channels) {
            return Ok(());
        }
        let why = Diagnostic::new("its index of chunks is not what is there")
            .help("save it to a file: of a file all is read");
        Err(self.failed(block.offset, io::Error::other(why)))
    }

    /// Counts a block none of whose messages can be used.
    fn unusable(&mut self, block: &Block, kind: ProblemKind) {
        let told = matches!(kind, ProblemKind::Truncated { .. });
        self.problems.add(block.offset, kind, block.indexed());
        if !told {
            self.problems.skip(block.packed() as u64);
        }
    }

    /// Hands a record to the caller, if it is what was written.
    fn attach(&mut self, block: &Block, body: &[u8]) {
        let Kind::Attached { opcode } = block.kind else {
            return;
        };
        match intact(opcode, body) {
            Ok(record) => (self.attached)(record),
            Err(kind) => {
                self.problems.add(block.offset, kind, None);
                self.problems.skip(body.len() as u64);
            }
        }
    }

    fn add_up(&mut self, findings: Findings, offset: u64) {
        for (_, index, tally) in findings.channels {
            let index = index as usize;
            if self.tallies.len() <= index {
                self.tallies.resize(index + 1, Tally::default());
            }
            if let Some(sum) = self.tallies.get_mut(index) {
                sum.merge(&tally);
            }
        }
        for (id, n) in findings.unknown {
            self.unknown.entry(id).or_insert((offset, 0)).1 += n;
        }
        if findings.short > 0 {
            self.short.get_or_insert((offset, 0)).1 += findings.short;
        }
    }

    /// Puts the pieces of a block in order and lets go of what is ripe.
    fn deliver(&mut self, mut pieces: Vec<Piece<T>>, block: Block) -> ControlFlow<()> {
        let mut left = size(&block);
        self.scanner.recycle(block.payload);
        let mut last = pieces.pop().unwrap_or_default();
        for piece in pieces {
            self.push(piece, &mut left)?;
        }
        last.bytes = left;
        self.push(last, &mut left)
    }

    /// Puts a piece in order, of a block of which so many bytes are left, and lets go of what is ripe.
    fn push(&mut self, piece: Piece<T>, left: &mut usize) -> ControlFlow<()> {
        let bytes = piece.bytes.min(*left);
        *left -= bytes;
        self.merger.push(piece.batch, bytes);
        self.let_go(false)
    }

    fn let_go(&mut self, last: bool) -> ControlFlow<()> {
        let shared = self.shared;
        while let Some(batch) = self.merger.pop(last, &mut || shared.batch()) {
            if batch.items.len() >= self.least {
                self.pass_on(None)?;
                self.pass_on(Some(batch))?;
            } else {
                self.small.append(batch, |empty| shared.put_batch(empty));
                if self.small.items.len() >= self.least {
                    self.pass_on(None)?;
                }
            }
        }
        if last {
            self.pass_on(None)?;
        }
        ControlFlow::Continue(())
    }

    /// Gives a batch, or the small ones gathered so far, to the consumer.
    fn pass_on(&mut self, batch: Option<Batch<T>>) -> ControlFlow<()> {
        let mut batch = batch.unwrap_or_else(|| std::mem::take(&mut self.small));
        let mut flow = ControlFlow::Continue(());
        if !batch.items.is_empty() {
            self.items += batch.items.len() as u64;
            flow = (self.consume)(&mut batch.items);
        }
        self.shared.put_batch(batch);
        flow
    }

    pub(super) fn report(mut self, stopped: bool) -> WalkReport {
        for (id, (offset, n)) in std::mem::take(&mut self.unknown) {
            self.problems
                .add(offset, ProblemKind::UnknownChannel { id }, Some(n));
        }
        if let Some((offset, n)) = self.short {
            self.problems
                .add(offset, ProblemKind::ShortMessages, Some(n));
        }
        let (claimed, end) = (self.scanner.claimed(), self.scanner.position());
        let (facts, problems) = self.scanner.finish();
        self.problems.merge(problems);
        let mut survey = Survey {
            facts,
            problems: self.problems,
            ..Survey::default()
        };
        self.shared.with_table(|table| {
            self.tallies.resize(table.len(), Tally::default());
            survey.add_up(table.channels().zip(self.tallies.iter().copied()));
        });
        if let Some(passed) = &self.passed {
            survey.pass_over(passed);
        }
        // Messages without a channel or a head are among those counted as lost.
        let found = survey
            .messages
            .saturating_add(survey.problems.messages_lost());
        // Where chunks are left out, those that were lost may be counted among what is left out, too.
        let may_differ = self.passed.is_some() && found > survey.messages;
        if let Some(claimed) = claimed.filter(|n| *n != found && !stopped && !may_differ) {
            let (kind, lost) = match claimed.checked_sub(found) {
                Some(lost) => (
                    ProblemKind::Missing {
                        claimed,
                        found: survey.messages,
                    },
                    Some(lost),
                ),
                None => (
                    ProblemKind::BadSummary {
                        why: "it counts fewer messages",
                    },
                    None,
                ),
            };
            survey.problems.add(end, kind, lost);
        }
        WalkReport {
            survey,
            items: self.items,
            late: self.merger.late(),
            steps_back: self.merger.steps_back(),
            stopped,
        }
    }
}

/// Size that a block counts for in the look-ahead. Not `Block::cost`: this has to be the same for a file and a stream.
fn size(block: &Block) -> usize {
    match block.kind {
        Kind::Chunk { size, .. } | Kind::Bag { size, .. } | Kind::PassedOver { size } => size,
        Kind::Run | Kind::Transcript | Kind::Attached { .. } => block.packed(),
    }
}

/// Puts an outcome where its group stands in the queue, whose front is number `first`.
fn put<T>(queue: &mut VecDeque<(usize, Option<Outcome<T>>)>, first: u64, outcome: Outcome<T>) {
    let place = outcome
        .number
        .checked_sub(first)
        .and_then(|n| usize::try_from(n).ok());
    if let Some((_, slot)) = place.and_then(|n| queue.get_mut(n)) {
        *slot = Some(outcome);
    }
}
