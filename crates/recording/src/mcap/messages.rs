//! The records of a block -> the caller's items, in the block's order. Pure.
//!
//! A stage of its own because it is the inner loop of every read: one pass over record heads,
//! one table look-up per message, no allocation but the items.

use super::channels::{Channel, NONE, Table};
use super::order::{Batch, PIECE};
use crate::records::problem::ProblemKind;
use crate::records::record::MessageRecord;
use crate::records::{HEAD, head_at, op};
use std::collections::BTreeMap;
use std::sync::Arc;

/// One message, borrowed from the block it lies in.
#[derive(Clone, Copy, Debug)]
pub struct Message<'a> {
    /// The channel it was published on.
    pub channel: &'a Arc<Channel>,
    /// The publisher's count.
    pub sequence: u32,
    /// Time at which it was recorded, ns.
    pub log_time: u64,
    /// Time at which it was published, ns.
    pub publish_time: u64,
    /// The payload.
    pub data: &'a [u8],
    /// Offset in the file of the chunk it is in, or of itself when it is in none.
    pub offset: u64,
    /// Offset of its record in the unpacked chunk; 0 when it is in none.
    pub inner: u64,
}

/// Totals of a channel's messages. Times are the least and the greatest log time, ns.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// Number of messages.
    pub messages: u64,
    /// Least log time.
    pub first: u64,
    /// Greatest log time.
    pub last: u64,
    /// Bytes of payload.
    pub bytes: u64,
}

impl Tally {
    #[inline]
    fn add(&mut self, log_time: u64, bytes: usize) {
        if self.messages == 0 {
            self.first = log_time;
            self.last = log_time;
        }
        self.first = self.first.min(log_time);
        self.last = self.last.max(log_time);
        self.messages += 1;
        self.bytes += bytes as u64;
    }

    pub(super) fn merge(&mut self, other: &Tally) {
        if other.messages == 0 {
            return;
        }
        if self.messages == 0 {
            *self = *other;
            return;
        }
        self.first = self.first.min(other.first);
        self.last = self.last.max(other.last);
        self.messages += other.messages;
        self.bytes += other.bytes;
    }
}

/// Totals of one block, by channel index.
#[derive(Debug, Default)]
pub(super) struct Met {
    tallies: Vec<Tally>,
    touched: Vec<(u16, u32)>,
    pub(super) unknown: BTreeMap<u16, u64>,
    pub(super) short: u64,
}

impl Met {
    /// Ids that were looked up and what they were taken for, with the channel's tally.
    pub(super) fn channels(&self) -> impl Iterator<Item = (u16, u32, Tally)> {
        self.touched.iter().map(|&(id, index)| {
            (
                id,
                index,
                self.tallies
                    .get(index as usize)
                    .copied()
                    .unwrap_or_default(),
            )
        })
    }

    /// Ready for the next block; the memory stays.
    pub(super) fn clear(&mut self) {
        for (_, index) in self.touched.drain(..) {
            if let Some(tally) = self.tallies.get_mut(index as usize) {
                *tally = Tally::default();
            }
        }
        self.unknown.clear();
        self.short = 0;
    }
}

/// Why a pass over a block's records stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Stop {
    End,
    /// Enough items for now; the next record is at this offset in the block.
    Full {
        at: usize,
    },
    /// A schema or channel record the table does not hold, at this offset in the block.
    Definition {
        at: usize,
    },
    /// A message, at this offset, on a channel only the summary defines.
    Adopt {
        at: usize,
        id: u16,
    },
    /// A record that runs over the end of the block.
    Broken {
        at: usize,
        length: u64,
    },
    /// Opcode 0, which no record has: what is here was never written as one.
    NoRecord {
        at: usize,
    },
}

impl Stop {
    /// Fault that ended a pass before the end of its records, and its place.
    pub(super) fn fault(self) -> Option<(ProblemKind, usize)> {
        match self {
            Stop::Broken { at, length } => {
                let kind = ProblemKind::InnerRecord {
                    at: at as u64,
                    length,
                };
                Some((kind, at))
            }
            Stop::NoRecord { at } => Some((ProblemKind::NoInnerRecord { at: at as u64 }, at)),
            Stop::End | Stop::Full { .. } | Stop::Definition { .. } | Stop::Adopt { .. } => None,
        }
    }
}

/// Place of a block: what its messages report as theirs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) offset: u64,
    pub(super) chunked: bool,
}

/// Maps every message from `from` on, up to the first thing that needs the table changed.
pub(super) fn pass<T, D>(
    records: &[u8],
    from: usize,
    place: Place,
    table: &Table<D>,
    map: &impl Fn(&D, &Message<'_>, &mut Vec<T>),
    met: &mut Met,
    batch: &mut Batch<T>,
) -> Stop {
    if met.tallies.len() < table.len() {
        met.tallies.resize(table.len(), Tally::default());
    }
    let mut at = from;
    loop {
        let Some((opcode, length)) = head_at(records, at) else {
            return if at == records.len() {
                Stop::End
            } else {
                Stop::Broken { at, length: 0 }
            };
        };
        let body_at = at + HEAD;
        let body = usize::try_from(length)
            .ok()
            .and_then(|n| records.get(body_at..body_at.checked_add(n)?));
        let Some(body) = body else {
            return Stop::Broken { at, length };
        };
        match opcode {
            0 => return Stop::NoRecord { at },
            op::MESSAGE => match MessageRecord::parse(body) {
                Some(m) => {
                    let index = table.lookup(m.channel_id);
                    let entry = table.entry(index);
                    if let (Some(entry), Some(tally)) = (entry, met.tallies.get_mut(index as usize))
                    {
                        if tally.messages == 0 {
                            met.touched.push((m.channel_id, index));
                        }
                        tally.add(m.log_time, m.data.len());
                        if let Some(choice) = &entry.choice {
                            let (offset, inner) = if place.chunked {
                                (place.offset, at as u64)
                            } else {
                                (place.offset + at as u64, 0)
                            };
                            let message = Message {
                                channel: &entry.channel,
                                sequence: m.sequence,
                                log_time: m.log_time,
                                publish_time: m.publish_time,
                                data: m.data,
                                offset,
                                inner,
                            };
                            map(choice, &message, &mut batch.items);
                            batch.stamp(m.log_time, m.data.len());
                            if batch.weight() >= PIECE {
                                let at = body_at + body.len();
                                return Stop::Full { at };
                            }
                        }
                    } else if table.can_adopt(m.channel_id) {
                        return Stop::Adopt {
                            at,
                            id: m.channel_id,
                        };
                    } else {
                        debug_assert_eq!(index, NONE);
                        *met.unknown.entry(m.channel_id).or_default() += 1;
                    }
                }
                None => met.short += 1,
            },
            op::SCHEMA | op::CHANNEL if !table.holds(opcode, body) => {
                return Stop::Definition { at };
            }
            _ => {}
        }
        at = body_at + body.len();
    }
}
