//! Blocks -> outcomes, on worker threads. I/O (each reads its own part of the file).
//!
//! A stage of its own because what workers find depends on definitions they may not have seen yet: an
//! outcome says which meaning of each channel id it used, and the walk, which sees blocks in file order,
//! accepts it or does the block again. So the result never depends on the number of threads.

use super::block::{Block, Buffers, Kind};
use super::channels::{NONE, Table};
use super::messages::{Message, Met, Place, Stop, Tally, pass};
use super::order::{Batch, Order};
use crate::records::problem::ProblemKind;
use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};

/// Batches kept for reuse, and the largest worth keeping.
const SPARE: usize = 64;
const SPARE_BYTES: usize = 4 << 20;

/// Weight of all items that may wait for their turn; a block of more is given back, and done when its turn has come.
const MOST_WAITING: usize = 4 << 20;

/// Memory that one worker needs and the next can use again.
#[derive(Debug, Default)]
pub(super) struct Bench {
    pub(super) buffers: Buffers,
    pub(super) met: Met,
}

/// State that all threads of a walk share.
#[derive(Debug)]
pub(super) struct Shared<T, D, M> {
    pub(super) table: RwLock<Table<D>>,
    pub(super) map: M,
    pub(super) cancelled: AtomicBool,
    order: Order,
    /// Weight of the items that workers have made, and the walk has not taken yet.
    waiting: AtomicUsize,
    benches: Mutex<Vec<Bench>>,
    batches: Mutex<Vec<Batch<T>>>,
}

/// A panic elsewhere ends the walk anyway; until then what it left is no less valid.
fn lock<X>(mutex: &Mutex<X>) -> MutexGuard<'_, X> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T, D, M> Shared<T, D, M> {
    pub(super) fn new(table: Table<D>, map: M, order: Order) -> Self {
        Shared {
            table: RwLock::new(table),
            map,
            cancelled: AtomicBool::new(false),
            order,
            waiting: AtomicUsize::new(0),
            benches: Mutex::default(),
            batches: Mutex::default(),
        }
    }

    pub(super) fn bench(&self) -> Bench {
        lock(&self.benches).pop().unwrap_or_default()
    }

    pub(super) fn put_bench(&self, mut bench: Bench) {
        bench.buffers.trim();
        bench.met.clear();
        lock(&self.benches).push(bench);
    }

    pub(super) fn batch(&self) -> Batch<T> {
        lock(&self.batches).pop().unwrap_or_default()
    }

    /// Brings a block's batch into the order asked for.
    pub(super) fn arrange(&self, batch: &mut Batch<T>) {
        if self.order == Order::LogTime {
            batch.sort();
        }
    }

    pub(super) fn put_batch(&self, mut batch: Batch<T>) {
        batch.clear();
        let mut batches = lock(&self.batches);
        if batches.len() < SPARE && batch.capacity_bytes() <= SPARE_BYTES {
            batches.push(batch);
        }
    }

    /// Weight of the items that wait for their turn.
    pub(super) fn waiting(&self) -> usize {
        self.waiting.load(Ordering::Relaxed)
    }

    fn wait(&self, piece: &Piece<T>) -> usize {
        let weight = piece.batch.weight();
        weight + self.waiting.fetch_add(weight, Ordering::Relaxed)
    }

    /// Takes pieces that waited.
    pub(super) fn take(&self, pieces: &[Piece<T>]) {
        let weight = pieces.iter().map(|piece| piece.batch.weight()).sum();
        self.waiting.fetch_sub(weight, Ordering::Relaxed);
    }

    /// Runs `look` on the table as it is now.
    pub(super) fn with_table<R>(&self, look: impl FnOnce(&Table<D>) -> R) -> R {
        look(&self.table.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Runs `change` on the table; only the walk itself does, in file order.
    pub(super) fn change_table<R>(&self, change: impl FnOnce(&mut Table<D>) -> R) -> R {
        change(&mut self.table.write().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Results of a block, in a form that can be checked and added up.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// Channel ids, what they were taken for, and their messages.
    pub(super) channels: Vec<(u16, u32, Tally)>,
    pub(super) unknown: BTreeMap<u16, u64>,
    pub(super) short: u64,
}

impl Findings {
    pub(super) fn of(met: &mut Met) -> Self {
        Findings {
            channels: met.channels().collect(),
            unknown: std::mem::take(&mut met.unknown),
            short: met.short,
        }
    }

    /// Whether every id still means what it was taken for.
    pub(super) fn hold<D>(&self, table: &Table<D>) -> bool {
        self.channels
            .iter()
            .all(|(id, index, _)| table.lookup(*id) == *index)
            && self
                .unknown
                .keys()
                .all(|id| table.lookup(*id) == NONE && !table.can_adopt(*id))
    }
}

/// Items of a block, all or some, and the bytes of its records they were made of.
#[derive(Debug)]
pub(super) struct Piece<T> {
    pub(super) batch: Batch<T>,
    pub(super) bytes: usize,
}

impl<T> Default for Piece<T> {
    fn default() -> Self {
        Piece {
            batch: Batch::default(),
            bytes: 0,
        }
    }
}

/// Outcome of a block.
#[derive(Debug)]
pub(super) enum Done<T> {
    Walked {
        pieces: Vec<Piece<T>>,
        findings: Findings,
        /// Fault that ended the pass early, and bytes of the block behind it.
        fault: Option<(ProblemKind, u64)>,
    },
    /// The block cannot be used.
    Bad(ProblemKind),
    /// Block that changes the table, so that it has to be done in file order.
    InOrder,
    /// The file cannot be read.
    Failed(io::Error),
}

pub(super) fn place(block: &Block) -> Place {
    Place {
        offset: block.offset,
        chunked: !matches!(block.kind, Kind::Run | Kind::Attached { .. }),
    }
}

impl<T, D, M> Shared<T, D, M>
where
    M: Fn(&D, &Message<'_>, &mut Vec<T>),
{
    /// Does a block as far as the table allows.
    pub(super) fn work(&self, block: &Block) -> Done<T> {
        // What is attached goes to the caller, between the blocks around it.
        if self.cancelled.load(Ordering::Relaxed) || matches!(block.kind, Kind::Attached { .. }) {
            return Done::InOrder;
        }
        let mut bench = self.bench();
        let done = match bench.buffers.open(block) {
            Err(e) => Done::Failed(e),
            Ok(Err(kind)) => Done::Bad(kind),
            Ok(Ok(records)) => {
                let mut pieces = Vec::new();
                let stop = self.pieces(records, place(block), &mut bench.met, &mut pieces);
                let fault = stop
                    .fault()
                    .map(|(kind, at)| (kind, records.len().saturating_sub(at) as u64));
                match stop {
                    Stop::End | Stop::Broken { .. } | Stop::NoRecord { .. } => Done::Walked {
                        pieces,
                        findings: Findings::of(&mut bench.met),
                        fault,
                    },
                    Stop::Full { .. } | Stop::Definition { .. } | Stop::Adopt { .. } => {
                        self.take(&pieces);
                        for piece in pieces {
                            self.put_batch(piece.batch);
                        }
                        Done::InOrder
                    }
                }
            }
        };
        self.put_bench(bench);
        done
    }
}

impl<T, D, M> Shared<T, D, M>
where
    M: Fn(&D, &Message<'_>, &mut Vec<T>),
{
    /// Makes the items of a block, as long as they need not be too many at once; why that ended.
    fn pieces(
        &self,
        records: &[u8],
        place: Place,
        met: &mut Met,
        pieces: &mut Vec<Piece<T>>,
    ) -> Stop {
        let mut from = 0;
        loop {
            let mut batch = self.batch();
            let stop = self
                .with_table(|table| pass(records, from, place, table, &self.map, met, &mut batch));
            self.arrange(&mut batch);
            let end = match stop {
                Stop::Full { at } => at,
                _ => records.len(),
            };
            let bytes = end.saturating_sub(from);
            let piece = Piece { batch, bytes };
            let waiting = self.wait(&piece);
            pieces.push(piece);
            if !matches!(stop, Stop::Full { .. }) || waiting > MOST_WAITING {
                return stop;
            }
            from = end;
        }
    }
}

/// Blocks on their way: whatever happens to the worker, the walk hears of them.
#[derive(Debug)]
pub(super) struct Ticket<T> {
    number: u64,
    blocks: Vec<Block>,
    to: Option<Sender<Outcome<T>>>,
}

/// A worker's answer, block by block; `None` when the caller's `map` panicked, which itself
/// travels through the pool.
#[derive(Debug)]
pub(super) struct Outcome<T> {
    pub(super) number: u64,
    pub(super) done: Option<Vec<(Block, Done<T>)>>,
}

impl<T> Ticket<T> {
    pub(super) fn new(number: u64, blocks: Vec<Block>, to: Sender<Outcome<T>>) -> Self {
        Ticket {
            number,
            blocks,
            to: Some(to),
        }
    }

    pub(super) fn redeem<D, M>(mut self, shared: &Shared<T, D, M>)
    where
        M: Fn(&D, &Message<'_>, &mut Vec<T>),
    {
        let blocks = std::mem::take(&mut self.blocks);
        let done = blocks
            .into_iter()
            .map(|block| {
                let done = shared.work(&block);
                (block, done)
            })
            .collect();
        self.answer(Some(done));
    }

    fn answer(&mut self, done: Option<Vec<(Block, Done<T>)>>) {
        if let Some(to) = self.to.take() {
            // The walk may have ended early; then nobody waits for this.
            let _ = to.send(Outcome {
                number: self.number,
                done,
            });
        }
    }
}

impl<T> Drop for Ticket<T> {
    fn drop(&mut self) {
        self.answer(None);
    }
}
