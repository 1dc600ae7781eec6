//! A log -> the caller's items, once, in order, in parallel. I/O.
//!
//! A stage of its own because it is where order is made out of parallel work: blocks are handed to
//! the pool as they are found, taken back in file order, checked against the definitions
//! that came before them, merged by time, and passed to the consumer on the calling thread, which
//! works while the pool decodes ahead.

mod state;

use super::channels::{Channel, Table};
use super::container::scan;
use super::input::Input;
use super::messages::Message;
use super::order::{Batch, Lookahead, Merger, Order};
use super::scan::OtherRecords;
use super::survey::{Survey, fallback};
use super::workers::{Shared, Ticket};
use super::{Reader, read_error};
use crate::error::Result;
use crate::records::problem::Problems;
use crate::records::record::Record;
use state::Course;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Use of the machine by a walk. What is delivered, and in which order, does not depend on it but
/// for `lookahead`.
#[derive(Clone, Copy, Debug)]
pub struct WalkOptions<'p> {
    /// Pool to decode in. `None`, a pool of one thread, or a call from inside the pool: all on the
    /// calling thread.
    pub pool: Option<&'p rayon::ThreadPool>,
    /// Bytes of blocks, packed and unpacked, on their way at once; one block may always be.
    pub in_flight: usize,
    /// Small blocks are handed to a worker together, up to this many bytes: a hand-over costs as
    /// much as some hundred messages.
    pub hand_over: usize,
    /// Small batches are passed on together, at least this many items, but for the last.
    pub batch: usize,
    /// Look-ahead for messages that belong earlier.
    pub lookahead: Lookahead,
    /// Whether to look ahead at all.
    pub order: Order,
    /// Whether only the first message of each channel matters: of what is elsewhere, no more is fetched then.
    pub only_firsts: bool,
}

impl WalkOptions<'_> {
    /// [`WalkOptions::in_flight`] where a log is read to its end.
    pub const IN_FLIGHT: usize = 32 << 20;
}

impl Default for WalkOptions<'_> {
    fn default() -> Self {
        WalkOptions {
            pool: None,
            in_flight: WalkOptions::IN_FLIGHT,
            hand_over: 256 << 10,
            batch: 1024,
            lookahead: Lookahead::default(),
            order: Order::default(),
            only_firsts: false,
        }
    }
}

/// Report of a walk.
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
/// [`Error::Read`](crate::error::Error::Read) when the input itself fails. Damage is no error: see
/// [`Survey::problems`].
///
/// # Panics
/// Passes on a panic of `map`.
pub fn walk<T, D, S, M, C>(
    reader: Reader,
    options: &WalkOptions<'_>,
    select: S,
    map: M,
    consume: C,
) -> Result<WalkReport>
where
    T: Send,
    D: Send + Sync,
    S: FnMut(&Arc<Channel>) -> Option<D>,
    M: Fn(&D, &Message<'_>, &mut Vec<T>) + Sync,
    C: FnMut(&mut Vec<T>) -> ControlFlow<()>,
{
    travel(
        reader,
        options,
        select,
        map,
        consume,
        OtherRecords::Nothing,
        |_| {},
    )
}

/// A walk that also hands out what else a copy needs: `attached` gets every header, attachment and
/// metadata record that is intact, on the calling thread. With [`Order::File`] and a `batch` of 1
/// it comes after the items of all blocks before it and before those of all blocks behind it; so does
/// the question about a channel (`select`), but for the items of the block that defines it.
///
/// # Errors
/// [`Error::Read`](crate::error::Error::Read) when the input itself fails.
///
/// # Panics
/// Passes on a panic of `map`.
pub fn salvage<T, D, S, M, C, A>(
    reader: Reader,
    options: &WalkOptions<'_>,
    select: S,
    map: M,
    consume: C,
    attached: A,
) -> Result<WalkReport>
where
    T: Send,
    D: Send + Sync,
    S: FnMut(&Arc<Channel>) -> Option<D>,
    M: Fn(&D, &Message<'_>, &mut Vec<T>) + Sync,
    C: FnMut(&mut Vec<T>) -> ControlFlow<()>,
    A: FnMut(Record<'_>),
{
    travel(
        reader,
        options,
        select,
        map,
        consume,
        OtherRecords::Attached,
        attached,
    )
}

fn travel<T, D, S, M, C, A>(
    reader: Reader,
    options: &WalkOptions<'_>,
    mut select: S,
    map: M,
    mut consume: C,
    besides: OtherRecords,
    mut attached: A,
) -> Result<WalkReport>
where
    T: Send,
    D: Send + Sync,
    S: FnMut(&Arc<Channel>) -> Option<D>,
    M: Fn(&D, &Message<'_>, &mut Vec<T>) + Sync,
    C: FnMut(&mut Vec<T>) -> ControlFlow<()>,
    A: FnMut(Record<'_>),
{
    let (name, file_size, limits) = (reader.name().to_owned(), reader.size(), reader.limits);
    let mut problems = Problems::default();
    let (has_summary, fallback) =
        fallback(&reader, &mut problems).map_err(|e| read_error(&name, 0, e))?;
    let is_stream = file_size.is_none();
    let mut table = Table::new(fallback, limits.definitions);
    let index = reader
        .index
        .clone()
        .filter(|_| besides == OtherRecords::Nothing);
    let passed = index.map(|index| {
        let wanted = table.adopt_all(&mut select, &mut problems);
        let passed = index.passed_over(wanted, options.only_firsts);
        if let Input::File(file) = &reader.input
            && let Some(object) = file.object()
        {
            object.expect(index.rest(&passed.chunks), options.in_flight as u64);
        }
        passed
    });
    let shared = Shared::new(table, map, options.order);
    let lookahead = match options.order {
        Order::LogTime => options.lookahead,
        Order::File => Lookahead::NONE,
    };
    let mut course = Course {
        shared: &shared,
        select: &mut select,
        consume: &mut consume,
        attached: &mut attached,
        scanner: {
            let mut scanner = scan(reader, besides);
            if let Some(passed) = &passed {
                scanner.pass_over_chunks(&passed.chunks);
            }
            scanner
        },
        passed,
        merger: Merger::new(lookahead),
        tallies: Vec::new(),
        unknown: BTreeMap::new(),
        short: None,
        problems,
        small: Batch::default(),
        least: options.batch,
        hand_over: options.hand_over,
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
            let flow = course.with_pool(
                pool.current_num_threads(),
                options.in_flight,
                is_stream,
                &mut spawn,
            );
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
