//! A log -> the caller's items, once, in order, in parallel. I/O.
//!
//! A stage of its own because it is where order is made out of parallel work: blocks are handed to
//! the pool as they are found, taken back in file order, checked against the definitions
//! that came before them, merged by time, and passed to the consumer on the calling thread, which
//! works while the pool decodes ahead.

use super::block::{Block, Kind, Payload};
use super::bytes::{HEAD, head_at};
use super::channels::{Channel, Table};
use super::messages::{Message, Stop, Tally, pass};
use super::order::{Batch, Lookahead, Merger};
use super::problem::{ProblemKind, Problems};
use super::scan::{Item, Scanner};
use super::survey::{Survey, fallback};
use super::tape::Input;
use super::workers::{Done, Findings, Outcome, Shared, Ticket, place};
use super::{Reader, read_error};
use crate::error::{Error, Result};
use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Most blocks on their way at once.
const BLOCKS: usize = 256;

/// How a walk uses the machine. None of it changes what is delivered.
#[derive(Clone, Copy, Debug)]
pub struct WalkOptions<'p> {
    /// Where to decode. `None`, a pool of one thread, or a call from inside the pool: all on the
    /// calling thread.
    pub pool: Option<&'p rayon::ThreadPool>,
    /// Bytes of blocks, packed and unpacked, on their way at once; one block may always be.
    pub in_flight: usize,
    /// How far ahead to look for messages that belong earlier. This one does change what is
    /// delivered, when a log is out of order.
    pub lookahead: Lookahead,
}

impl Default for WalkOptions<'_> {
    fn default() -> Self {
        WalkOptions {
            pool: None,
            in_flight: 24 << 20,
            lookahead: Lookahead::default(),
        }
    }
}

/// What a walk met.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct WalkReport {
    /// Everything in the log, counted.
    pub survey: Survey,
    /// Items delivered.
    pub items: u64,
    /// Items delivered after one of a greater log time: disorder beyond the look-ahead.
    pub late: u64,
    /// Places in the file where the log time of the selected channels steps back.
    pub steps_back: u64,
    /// Whether the consumer ended it.
    pub stopped: bool,
}

/// Reads a log once.
///
/// `select` is asked about every channel once, in file order, when it is defined; `None` leaves it out.
/// `map` appends the items of one message; it runs on worker threads. `consume` gets
/// the items in order of log time, then place in the file, on the calling thread; it may take
/// or change the vector, whose memory is used again. Sequence and report are the same for any
/// number of threads, and for a file and a stream of the same bytes (but for what only a file
/// has: its size and the definitions in its summary).
///
/// # Errors
/// [`Error::Read`] when the input itself fails. Damage is no error: see [`Survey::problems`].
///
/// # Panics
/// Passes on a panic of `map`.
pub fn walk<T, D, S, M, C>(
    reader: Reader,
    options: &WalkOptions<'_>,
    mut select: S,
    map: M,
    mut consume: C,
) -> Result<WalkReport>
where
    T: Send,
    D: Send + Sync,
    S: FnMut(&Arc<Channel>) -> Option<D>,
    M: Fn(&D, &Message<'_>, &mut Vec<T>) + Sync,
    C: FnMut(&mut Vec<T>) -> ControlFlow<()>,
{
    let Reader { input, limits } = reader;
    let name = input.name().to_owned();
    let file_size = match &input {
        Input::File(file) => Some(file.len),
        Input::Stream { .. } => None,
    };
    let mut problems = Problems::default();
    let (has_summary, fallback) =
        fallback(&input, limits, &mut problems).map_err(|e| read_error(&name, 0, e))?;
    let is_stream = matches!(input, Input::Stream { .. });
    let shared = Shared::new(Table::new(fallback, limits.definitions), map);
    let mut course = Course {
        shared: &shared,
        select: &mut select,
        consume: &mut consume,
        scanner: Scanner::new(input, limits, false),
        merger: Merger::new(options.lookahead),
        tallies: Vec::new(),
        unknown: BTreeMap::new(),
        short: None,
        problems,
        items: 0,
        name,
    };
    let pool = options
        .pool
        .filter(|pool| pool.current_num_threads() > 1 && pool.current_thread_index().is_none());
    let flow = match pool {
        None => course.alone(),
        Some(pool) => pool.in_place_scope(|scope| {
            let shared = &shared;
            let mut spawn = |ticket: Ticket<T>| scope.spawn(move |_| ticket.redeem(shared));
            let flow = course.with_pool(options.in_flight, is_stream, &mut spawn);
            shared.cancelled.store(true, Ordering::Relaxed);
            flow
        }),
    };
    let stopped = flow?.is_break();
    let mut report = course.report(stopped);
    report.survey.has_summary = has_summary;
    report.survey.file_size = file_size;
    Ok(report)
}

/// A walk under way, on the calling thread.
struct Course<'w, T, D, M> {
    shared: &'w Shared<T, D, M>,
    select: &'w mut dyn FnMut(&Arc<Channel>) -> Option<D>,
    consume: &'w mut dyn FnMut(&mut Vec<T>) -> ControlFlow<()>,
    scanner: Scanner,
    merger: Merger<T>,
    tallies: Vec<Tally>,
    /// Messages without a channel, by id, and where the first was.
    unknown: BTreeMap<u16, (u64, u64)>,
    short: Option<(u64, u64)>,
    problems: Problems,
    items: u64,
    name: PathBuf,
}

impl<T, D, M> Course<'_, T, D, M>
where
    M: Fn(&D, &Message<'_>, &mut Vec<T>),
{
    fn alone(&mut self) -> Result<ControlFlow<()>> {
        while let Some(block) = self.next_block()? {
            let batch = self.in_order(&block)?;
            if self.deliver(batch, block)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(self.let_go(true))
    }

    fn with_pool(
        &mut self,
        in_flight: usize,
        is_stream: bool,
        spawn: &mut dyn FnMut(Ticket<T>),
    ) -> Result<ControlFlow<()>> {
        let (to, from): (Sender<Outcome<T>>, Receiver<Outcome<T>>) = channel();
        let mut queue = VecDeque::<Option<Outcome<T>>>::new();
        let mut first = 0u64;
        let mut cost = 0usize;
        let mut staged = None;
        let mut ended = false;
        loop {
            while !ended && queue.len() < BLOCKS {
                let block = match staged.take() {
                    Some(block) => block,
                    None => match self.next_block()? {
                        Some(block) => block,
                        None => {
                            ended = true;
                            break;
                        }
                    },
                };
                if queue.is_empty() && self.shared.with_table(Table::is_empty) {
                    // No channel is known: the next definition would send every block back.
                    let batch = self.in_order(&block)?;
                    if self.deliver(batch, block)?.is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                    continue;
                }
                if !queue.is_empty() && cost + block.cost() > in_flight {
                    staged = Some(block);
                    break;
                }
                cost += block.cost();
                let number = first + queue.len() as u64;
                queue.push_back(None);
                spawn(Ticket::new(number, block, to.clone()));
                if is_stream {
                    // What is done need not wait for what the stream has not sent yet.
                    for outcome in from.try_iter() {
                        put(&mut queue, first, outcome);
                    }
                    if matches!(queue.front(), Some(Some(_))) {
                        break;
                    }
                }
            }
            while let Some(None) = queue.front() {
                // `to` lives here, so this waits until a worker answers; every ticket does.
                let Ok(outcome) = from.recv() else { break };
                put(&mut queue, first, outcome);
            }
            let Some(outcome) = queue.pop_front() else {
                break;
            };
            first += 1;
            let Some(Outcome {
                block: Some(block),
                done,
                ..
            }) = outcome
            else {
                continue;
            };
            cost = cost.saturating_sub(block.cost());
            let batch = match done {
                Done::Panicked => return Ok(ControlFlow::Break(())),
                Done::Failed(e) => return Err(self.failed(block.offset, e)),
                Done::Bad(kind) => {
                    self.problems.add(block.offset, kind, block.indexed());
                    Batch::default()
                }
                Done::Walked {
                    batch,
                    findings,
                    fault,
                } if self.shared.with_table(|table| findings.hold(table)) => {
                    if let Some(kind) = fault {
                        self.problems.add(block.offset, kind, None);
                    }
                    self.add_up(findings, block.offset);
                    batch
                }
                Done::Walked { batch, .. } => {
                    self.shared.put_batch(batch);
                    self.in_order(&block)?
                }
                Done::InOrder => self.in_order(&block)?,
            };
            if self.deliver(batch, block)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(self.let_go(true))
    }

    fn next_block(&mut self) -> Result<Option<Block>> {
        match self.scanner.next() {
            Ok(Some(Item::Block(block))) => Ok(Some(block)),
            Ok(_) => Ok(None),
            Err(e) => Err(self.failed(self.scanner.tape().position(), e)),
        }
    }

    fn failed(&self, offset: u64, e: io::Error) -> Error {
        read_error(&self.name, offset, e)
    }

    /// Does a block whose predecessors are all done, taking in its definitions.
    fn in_order(&mut self, block: &Block) -> Result<Batch<T>> {
        let mut bench = self.shared.bench();
        let mut batch = self.shared.batch();
        let offset = block.offset;
        match bench.buffers.open(block) {
            Err(e) => return Err(self.failed(offset, e)),
            Ok(Err(kind)) => self.problems.add(offset, kind, block.indexed()),
            Ok(Ok(records)) => {
                let mut from = 0;
                loop {
                    let stop = self.shared.with_table(|table| {
                        let (map, met) = (&self.shared.map, &mut bench.met);
                        pass(records, from, place(block), table, map, met, &mut batch)
                    });
                    let (select, problems) = (&mut *self.select, &mut self.problems);
                    match stop {
                        Stop::End => break,
                        Stop::Broken { at, length } => {
                            let kind = ProblemKind::InnerRecord {
                                at: at as u64,
                                length,
                            };
                            problems.add(offset, kind, None);
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
                self.add_up(findings, offset);
                batch.sort();
            }
        }
        self.shared.put_bench(bench);
        Ok(batch)
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

    /// Puts a batch in order and lets go of what is ripe.
    fn deliver(&mut self, batch: Batch<T>, block: Block) -> Result<ControlFlow<()>> {
        // Not `Block::cost`: this has to be the same for a file and a stream.
        let bytes = match (&block.kind, &block.payload) {
            (Kind::Chunk { size, .. }, _) => *size,
            (Kind::Run, Payload::Held(held)) => held.range.len(),
            (Kind::Run, Payload::At { len, .. }) => *len,
        };
        self.scanner.recycle(block.payload);
        self.merger.push(batch, bytes);
        Ok(self.let_go(false))
    }

    fn let_go(&mut self, last: bool) -> ControlFlow<()> {
        let shared = self.shared;
        while let Some(mut batch) = self.merger.pop(last, &mut || shared.batch()) {
            if !batch.items.is_empty() {
                self.items += batch.items.len() as u64;
                (self.consume)(&mut batch.items)?;
            }
            shared.put_batch(batch);
        }
        ControlFlow::Continue(())
    }

    fn report(mut self, stopped: bool) -> WalkReport {
        for (id, (offset, n)) in std::mem::take(&mut self.unknown) {
            self.problems
                .add(offset, ProblemKind::UnknownChannel { id }, Some(n));
        }
        if let Some((offset, n)) = self.short {
            self.problems
                .add(offset, ProblemKind::ShortMessages, Some(n));
        }
        let (claimed, end) = (self.scanner.claimed(), self.scanner.tape().position());
        self.problems.merge(self.scanner.problems);
        let mut survey = Survey {
            facts: self.scanner.facts,
            problems: self.problems,
            ..Survey::default()
        };
        self.shared.with_table(|table| {
            self.tallies.resize(table.len(), Tally::default());
            survey.add_up(table.channels().zip(self.tallies.iter().copied()));
        });
        // Messages without a channel or a head are among those counted as lost.
        let found = survey
            .messages
            .saturating_add(survey.problems.messages_lost());
        if let Some(claimed) = claimed.filter(|claimed| *claimed != found && !stopped) {
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

/// Puts an outcome where its block stands in the queue, whose front is number `first`.
fn put<T>(queue: &mut VecDeque<Option<Outcome<T>>>, first: u64, outcome: Outcome<T>) {
    let place = outcome
        .number
        .checked_sub(first)
        .and_then(|n| usize::try_from(n).ok());
    if let Some(slot) = place.and_then(|n| queue.get_mut(n)) {
        *slot = Some(outcome);
    }
}
