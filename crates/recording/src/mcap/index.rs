//! A summary's index of chunks -> which of them need not be read. Pure.
//!
//! For what is elsewhere alone, where what is not read is not fetched: on a disk a walk over everything is as fast,
//! and sees
//! damage wherever it is. An index is a claim, so it is used only where it is proved by another: the summary's CRC
//! holds, chunks
//! stand in order and do not overlap, and the messages of every channel, counted by the lengths of the chunks' own
//! indexes, are
//! exactly those that the statistics count. Then no message of a wanted topic can be outside the chunks that are
//! read, unless both lie alike; and what is read is held against the index ([`PassedOver::agrees`]).

use super::Limits;
use super::block::Compression;
use super::channels::Fallback;
use crate::records::record::{ChunkIndex, Statistics};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Bytes of an index of messages beside 16 for each: opcode, length, channel, length of the entries.
const MESSAGE_INDEX: u64 = 15;
/// Size of a chunk beside its records and the name of its compression.
const CHUNK_HEAD: u64 = 9 + 40;
/// Number of bytes that may be read behind a stretch to see what follows.
const BEHIND: u64 = 1 << 10;

/// The chunks of a log, by their place.
#[derive(Debug)]
pub(super) struct Index {
    chunks: Vec<Indexed>,
    counts: BTreeMap<u16, u64>,
    times: Option<(u64, u64)>,
    size: u64,
}

#[derive(Clone, Debug)]
struct Indexed {
    at: u64,
    /// End behind the indexes of its messages.
    end: u64,
    unpacked: usize,
    compression: Option<Compression>,
    /// Messages of each channel.
    messages: Vec<(u16, u64)>,
}

/// A chunk that is not read, with the indexes behind it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Passed {
    pub(super) at: u64,
    pub(super) end: u64,
    pub(super) unpacked: usize,
    pub(super) compression: Option<Compression>,
}

/// Parts that a walk leaves out, and what it should meet.
#[derive(Debug)]
pub(super) struct PassedOver {
    wanted: BTreeSet<u16>,
    /// Wanted messages in each chunk that is read.
    met: BTreeMap<u64, u64>,
    /// Chunks in order of place.
    pub(super) chunks: Vec<Passed>,
    pub(super) counts: BTreeMap<u16, u64>,
    pub(super) times: Option<(u64, u64)>,
}

/// Entry of the summary about one chunk; `None` where it cannot be.
fn indexed(of: &ChunkIndex<'_>, limits: Limits) -> Option<Indexed> {
    let at = of.chunk_start_offset;
    let records = at.checked_add(of.chunk_length)?;
    let end = records.checked_add(of.message_index_length)?;
    let least = of.compressed_size.checked_add(CHUNK_HEAD)?;
    if least > of.chunk_length || of.compressed_size.max(of.uncompressed_size) > limits.record {
        return None;
    }
    let mut places = of.message_index_offsets.clone();
    places.sort_unstable_by_key(|(_, place)| *place);
    let behind = places.iter().skip(1).map(|(_, place)| *place);
    let ends: Vec<u64> = behind.chain([end]).collect();
    // They stand behind the chunk, one behind the other.
    if places.first().map_or(end, |(_, first)| *first) != records {
        return None;
    }
    let mut messages: Vec<(u16, u64)> = Vec::new();
    for ((channel, place), end) in places.iter().zip(ends) {
        let entries = end.checked_sub(*place)?.checked_sub(MESSAGE_INDEX)?;
        if entries % 16 != 0 || messages.iter().any(|(other, _)| other == channel) {
            return None;
        }
        messages.push((*channel, entries / 16));
    }
    Some(Indexed {
        at,
        end,
        unpacked: usize::try_from(of.uncompressed_size).ok()?,
        compression: Compression::named(of.compression),
        messages,
    })
}

/// The chunks that a summary names, as it is read.
#[derive(Debug, Default)]
pub(super) struct ChunkList {
    chunks: Vec<Indexed>,
    is_wrong: bool,
}

impl ChunkList {
    pub(super) fn add(&mut self, of: &ChunkIndex<'_>, limits: Limits) {
        match indexed(of, limits) {
            Some(chunk) if chunk.compression.is_some() => self.chunks.push(chunk),
            _ => self.is_wrong = true,
        }
    }

    /// The index, if it can be used: all its chunks lie before `summary`, and hold what the statistics count.
    pub(super) fn index(mut self, statistics: &Statistics, summary: u64) -> Option<Index> {
        self.chunks.sort_unstable_by_key(|chunk| chunk.at);
        let mut before = super::MAGIC.len() as u64;
        let mut counts = BTreeMap::<u16, u64>::new();
        for chunk in &self.chunks {
            if chunk.at < before {
                return None;
            }
            before = chunk.end;
            for (channel, n) in &chunk.messages {
                let count = counts.entry(*channel).or_default();
                *count = count.checked_add(*n)?;
            }
        }
        counts.retain(|_, n| *n > 0);
        let mut claimed: BTreeMap<u16, u64> =
            statistics.channel_message_counts.iter().copied().collect();
        claimed.retain(|_, n| *n > 0);
        let chunks = u64::from(statistics.chunk_count);
        let is_proved = !self.is_wrong
            && before <= summary
            && self.chunks.len() as u64 == chunks
            && counts == claimed
            && counts.values().sum::<u64>() == statistics.message_count;
        is_proved.then_some(Index {
            chunks: self.chunks,
            counts,
            times: (statistics.message_count > 0)
                .then_some((statistics.message_start_time, statistics.message_end_time)),
            size: summary,
        })
    }
}

impl Index {
    /// Whether the summary says what every channel is.
    pub(super) fn is_defined_by(&self, definitions: &Fallback) -> bool {
        let mut channels = self.counts.keys();
        channels.all(|id| definitions.channels.contains_key(id))
    }

    /// Parts that a walk leaves out which wants these channels; of `only_firsts`, which wants the first message of
    /// each, more.
    pub(super) fn passed_over(&self, wanted: BTreeSet<u16>, only_firsts: bool) -> PassedOver {
        let mut open = wanted.clone();
        let (mut met, mut chunks) = (BTreeMap::new(), Vec::new());
        for chunk in &self.chunks {
            let here = chunk.messages.iter().filter(|(_, n)| *n > 0);
            let is_read = here.clone().any(|(channel, _)| open.contains(channel));
            if !is_read {
                chunks.push(Passed {
                    at: chunk.at,
                    end: chunk.end,
                    unpacked: chunk.unpacked,
                    compression: chunk.compression,
                });
                continue;
            }
            let of_wanted = here.clone().filter(|(channel, _)| wanted.contains(channel));
            met.insert(chunk.at, of_wanted.map(|(_, n)| n).sum());
            if only_firsts {
                here.for_each(|(channel, _)| {
                    open.remove(channel);
                });
            }
        }
        PassedOver {
            wanted,
            met,
            chunks,
            counts: self.counts.clone(),
            times: self.times,
        }
    }

    /// Ranges read of the log up to its summary where these chunks are not, in order, with a little behind each
    /// stretch.
    pub(super) fn rest(&self, passed: &[Passed]) -> Vec<Range<u64>> {
        let (mut rest, mut at) = (Vec::new(), 0);
        for chunk in passed {
            if chunk.at > at {
                rest.push(at..chunk.at.saturating_add(BEHIND));
            }
            at = chunk.end;
        }
        rest.push(at..self.size.saturating_add(BEHIND));
        rest
    }
}

impl PassedOver {
    pub(super) fn is_wanted(&self, channel: u16) -> bool {
        self.wanted.contains(&channel)
    }

    /// Whether a chunk held as many wanted messages as it should have.
    pub(super) fn agrees(&self, at: u64, found: u64) -> bool {
        self.met.get(&at).is_none_or(|claimed| *claimed == found)
    }

    /// Bytes that were not read.
    pub(super) fn bytes(&self) -> u64 {
        self.chunks.iter().map(|chunk| chunk.end - chunk.at).sum()
    }
}

#[cfg(test)]
mod tests;
