//! Decoded blocks in file order -> batches in time order. Pure.
//!
//! A stage of its own because writers do not record in order: messages step back inside a chunk, and
//! chunks overlap. The order delivered is log time, then place in the file, as far as a
//! bounded look-ahead can give it; what comes later than that is delivered late and counted.
//! A block that begins after the one before it ended is passed on as it is, neither sorted nor copied.

use std::collections::VecDeque;

/// Look-ahead. The defaults hold a few MB.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Lookahead {
    /// Blocks seen before one is let go ...
    pub blocks: usize,
    /// ... or bytes of blocks, whichever comes first.
    pub bytes: usize,
    /// Items held back because blocks overlap, at most, in bytes.
    pub held_bytes: usize,
    /// ... or bytes of the items in those blocks: of empty messages, a hundred fit where one of use does.
    pub item_bytes: usize,
}

impl Lookahead {
    /// Every block is let go at once.
    pub(super) const NONE: Lookahead = Lookahead {
        blocks: 0,
        bytes: 0,
        held_bytes: 0,
        item_bytes: 0,
    };
}

impl Default for Lookahead {
    fn default() -> Self {
        Lookahead {
            blocks: 32,
            bytes: 4 << 20,
            held_bytes: 8 << 20,
            item_bytes: 24 << 20,
        }
    }
}

/// Order in which items are delivered.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Order {
    /// Order of log time, then place in the file, as far as the look-ahead reaches.
    #[default]
    LogTime,
    /// Order of place in the file.
    File,
}

/// Items and the log time of each.
#[derive(Debug)]
pub(super) struct Batch<T> {
    pub(super) items: Vec<T>,
    times: Vec<u64>,
    /// Number of times that the log time stepped back from one message to the next.
    steps_back: u64,
    /// Memory of the items, and of what they hold elsewhere, at most about, bytes.
    weight: usize,
}

/// Weight from which on the items of a block are passed on, and more are made of it only then.
pub(super) const PIECE: usize = 8 << 20;

/// Bytes that an item may have allocated beside the payload.
const ALLOCATED: usize = 64;

impl<T> Default for Batch<T> {
    fn default() -> Self {
        Batch {
            items: Vec::new(),
            times: Vec::new(),
            steps_back: 0,
            weight: 0,
        }
    }
}

impl<T> Batch<T> {
    /// Gives every item appended since the last call this log time; they were made of a payload of so many bytes.
    #[inline]
    pub(super) fn stamp(&mut self, log_time: u64, payload: usize) {
        if self.items.len() <= self.times.len() {
            // A `map` that removes items it was not given would break the pairing.
            self.times.truncate(self.items.len());
            return;
        }
        self.steps_back += u64::from(self.times.last().is_some_and(|t| *t > log_time));
        let own = (self.items.len() - self.times.len()).saturating_mul(size_of::<T>() + 8);
        self.weight = (self.weight + payload + ALLOCATED).saturating_add(own);
        self.times.resize(self.items.len(), log_time);
    }

    pub(super) fn clear(&mut self) {
        self.items.clear();
        self.times.clear();
        self.steps_back = 0;
        self.weight = 0;
    }

    pub(super) fn weight(&self) -> usize {
        self.weight
    }

    /// Memory behind it, bytes.
    pub(super) fn capacity_bytes(&self) -> usize {
        self.items.capacity().saturating_mul(size_of::<T>()) + self.times.capacity() * 8
    }

    fn bytes(&self) -> usize {
        self.items.len().saturating_mul(size_of::<T>() + 8)
    }

    /// Sorts by log time; equal times keep the block's order.
    pub(super) fn sort(&mut self) {
        if self.steps_back == 0 {
            return;
        }
        let mut keyed: Vec<(u64, T)> = self.times.drain(..).zip(self.items.drain(..)).collect();
        keyed.sort_by_key(|(time, _)| *time);
        for (time, item) in keyed {
            self.times.push(time);
            self.items.push(item);
        }
    }

    fn first(&self) -> Option<u64> {
        self.times.first().copied()
    }

    fn last(&self) -> Option<u64> {
        self.times.last().copied()
    }

    /// Moves the first `n` items to `out`.
    fn move_front(&mut self, n: usize, out: &mut Batch<T>) {
        let part = self.weight as u128 * n as u128 / self.items.len().max(1) as u128;
        let part = usize::try_from(part).unwrap_or(self.weight);
        self.weight -= part;
        out.weight += part;
        out.items.extend(self.items.drain(..n));
        out.times.extend(self.times.drain(..n));
    }

    /// Puts a later batch behind this one; the emptied one goes to `put`.
    pub(super) fn append(&mut self, mut later: Batch<T>, put: impl FnOnce(Batch<T>)) {
        if self.capacity_bytes() < later.capacity_bytes() && self.items.is_empty() {
            std::mem::swap(self, &mut later);
        } else {
            self.items.append(&mut later.items);
            self.times.append(&mut later.times);
            self.weight += std::mem::take(&mut later.weight);
        }
        put(later);
    }

    /// Both in one, in order; on equal times `self`'s come first.
    fn merge(&mut self, mut later: Batch<T>) -> Batch<T> {
        let mut out = Batch {
            weight: self.weight + later.weight,
            ..Batch::default()
        };
        out.items.reserve(self.items.len() + later.items.len());
        out.times.reserve(self.times.len() + later.times.len());
        let mut right = later.times.drain(..).zip(later.items.drain(..)).peekable();
        for (time, item) in self.times.drain(..).zip(self.items.drain(..)) {
            while let Some((t, i)) = right.next_if(|(t, _)| *t < time) {
                out.times.push(t);
                out.items.push(i);
            }
            out.times.push(time);
            out.items.push(item);
        }
        for (t, i) in right {
            out.times.push(t);
            out.items.push(i);
        }
        out
    }
}

#[derive(Debug)]
struct QueuedBatch<T> {
    batch: Batch<T>,
    blocks: usize,
    bytes: usize,
}

/// Puts batches that are each in order into one order.
#[derive(Debug)]
pub(super) struct Merger<T> {
    lookahead: Lookahead,
    window: VecDeque<QueuedBatch<T>>,
    /// Blocks and bytes behind the front of the window.
    blocks: usize,
    bytes: usize,
    weight: usize,
    /// Greatest log time taken in.
    greatest: Option<u64>,
    /// Greatest log time let go.
    reached: Option<u64>,
    late: u64,
    steps_back: u64,
}

impl<T> Merger<T> {
    pub(super) fn new(lookahead: Lookahead) -> Self {
        Merger {
            lookahead,
            window: VecDeque::new(),
            blocks: 0,
            bytes: 0,
            weight: 0,
            greatest: None,
            reached: None,
            late: 0,
            steps_back: 0,
        }
    }

    /// Items delivered after one of a greater log time.
    pub(super) fn late(&self) -> u64 {
        self.late
    }

    /// Places where the log time of the file steps back.
    pub(super) fn steps_back(&self) -> u64 {
        self.steps_back
    }

    /// Takes the batch of the next block of the file, sorted, and the block's size.
    pub(super) fn push(&mut self, batch: Batch<T>, bytes: usize) {
        self.steps_back += batch.steps_back;
        self.steps_back += u64::from(batch.first().is_some_and(|f| Some(f) < self.greatest));
        self.greatest = self.greatest.max(batch.last());
        if !self.window.is_empty() {
            self.blocks += 1;
            self.bytes += bytes;
            self.weight += batch.weight;
        }
        self.window.push_back(QueuedBatch {
            batch,
            blocks: 1,
            bytes,
        });
    }

    fn pop_front(&mut self) -> Option<Batch<T>> {
        let gone = self.window.pop_front()?;
        if let Some(next) = self.window.front() {
            self.blocks = self.blocks.saturating_sub(next.blocks);
            self.bytes = self.bytes.saturating_sub(next.bytes);
            self.weight = self.weight.saturating_sub(next.batch.weight);
        }
        Some(gone.batch)
    }

    /// The next batch that may be let go; `last` when no block follows. `spare` lends memory.
    pub(super) fn pop(
        &mut self,
        last: bool,
        spare: &mut dyn FnMut() -> Batch<T>,
    ) -> Option<Batch<T>> {
        loop {
            let front = self.window.front_mut()?;
            let (Some(first), Some(end)) = (front.batch.first(), front.batch.last()) else {
                // Nothing of interest in this block, but its buffer may be worth keeping.
                let empty = self.pop_front()?;
                if empty.capacity_bytes() > 0 {
                    return Some(empty);
                }
                continue;
            };
            let ahead = &self.lookahead;
            let full = self.blocks >= ahead.blocks
                || self.bytes >= ahead.bytes
                || self.weight >= ahead.item_bytes;
            let overflow = front.batch.bytes() > self.lookahead.held_bytes && front.blocks > 1;
            if !(last || full || overflow) {
                return None;
            }
            // Nothing that follows is earlier than this; on equal times the front is earlier in the file.
            let follows = self
                .window
                .iter()
                .skip(1)
                .filter_map(|w| w.batch.first())
                .min();
            let follows = follows.filter(|f| *f < end);
            let front = self.window.front_mut()?;
            let ready = match follows {
                _ if overflow && !full && !last => front.batch.times.len() / 2,
                None => {
                    let whole = self.pop_front()?;
                    return Some(self.let_go(whole));
                }
                Some(follows) if first <= follows => {
                    front.batch.times.partition_point(|t| *t <= follows)
                }
                Some(_) => 0,
            };
            if ready > 0 {
                let mut out = spare();
                front.batch.move_front(ready, &mut out);
                return Some(self.let_go(out));
            }
            let mut front = self.window.pop_front()?;
            let next = self.window.pop_front()?;
            self.blocks = self.blocks.saturating_sub(next.blocks);
            self.bytes = self.bytes.saturating_sub(next.bytes);
            self.weight = self.weight.saturating_sub(next.batch.weight);
            self.window.push_front(QueuedBatch {
                batch: front.batch.merge(next.batch),
                blocks: front.blocks + next.blocks,
                bytes: front.bytes + next.bytes,
            });
        }
    }

    fn let_go(&mut self, batch: Batch<T>) -> Batch<T> {
        if let (Some(reached), Some(first)) = (self.reached, batch.first())
            && first < reached
        {
            self.late += batch.times.partition_point(|t| *t < reached) as u64;
        }
        self.reached = self.reached.max(batch.last());
        batch
    }
}

#[cfg(test)]
mod tests;
