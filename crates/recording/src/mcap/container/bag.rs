//! The bytes of a ROS 1 bag -> blocks of records. I/O.
//!
//! Apart from [`crate::bag`], which knows the records and no files. The index is used for nothing but what a killed
//! recorder's bag can do without: how many messages a lost chunk had, and how many there should be.

use super::super::Limits;
use super::super::block::{Block, Compression, Kind, Payload};
use super::super::channels::Fallback;
use super::super::input::{Input, LogFile, Tape};
use super::super::scan::{Facts, Item};
use super::Container;
use crate::bag::{self, Head, op};
use crate::format::Format;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::transcript::Transcript;
use crate::records::{HEAD, head_at, op as record_op};
use std::io;
use std::sync::Arc;

/// Number of bytes read to see a record's head and those that follow.
const PEEK: usize = 4 << 10;
/// Bytes searched at first, and at most at a time: where chunks and garbage take turns, the next chunk is near.
const FIRST: usize = 4 << 10;
const WINDOW: usize = 256 << 10;
/// Longest head of an index record that is believed.
const INDEX_HEAD: usize = 128;

/// The walk over a bag.
#[derive(Debug)]
pub(in super::super) struct Scanner {
    tape: Tape,
    limits: Limits,
    facts: Facts,
    problems: Problems,
    done: bool,
    /// The bag's own record was read; where it says that the index is, and how many chunks there are.
    index: Option<(u64, u32)>,
    /// Chunks the index tells of, and the messages in them.
    told: (u32, u64),
}

/// Fields of a head that are kept while the tape moves on.
struct RecordHead {
    op: u8,
    total: u64,
    data_at: usize,
    data_len: usize,
    compression: Option<Compression>,
    name: String,
    size: u32,
    count: u32,
    index: Option<(u64, u32)>,
}

impl RecordHead {
    fn of(head: &Head<'_>) -> RecordHead {
        let name = head.compression.unwrap_or_default();
        RecordHead {
            op: head.op,
            total: head.total() as u64,
            data_at: head.data_at,
            data_len: head.data_len,
            compression: Compression::of_bag(name),
            name: name.to_owned(),
            size: head.size.unwrap_or(0),
            count: head.count.unwrap_or(0),
            index: head.index_pos.zip(head.chunk_count),
        }
    }
}

impl Scanner {
    pub(super) fn new(input: Input, limits: Limits) -> Self {
        Scanner {
            tape: Tape::new(input, 0),
            limits,
            facts: Facts {
                format: Format::Bag,
                ..Facts::default()
            },
            problems: Problems::default(),
            done: false,
            index: None,
            told: (0, 0),
        }
    }

    /// The head of the record here; `None` at the end, and where none was and the next chunk was looked for.
    fn head(&mut self) -> io::Result<Option<RecordHead>> {
        let at = self.tape.position();
        let mut need = 4;
        loop {
            let ahead = self.tape.available(need, PEEK.max(need))?;
            let have = ahead.len();
            match bag::head(ahead) {
                Ok(head) => return Ok(Some(RecordHead::of(&head))),
                Err(Some(more)) if have >= need => need = more.max(need + 1),
                Err(Some(_)) => {
                    self.end(at, need as u64, have as u64);
                    return Ok(None);
                }
                Err(None) => {
                    self.lost(at, 0)?;
                    return Ok(None);
                }
            }
        }
    }

    fn end(&mut self, at: u64, need: u64, have: u64) {
        self.done = true;
        if have > 0 {
            let kind = ProblemKind::Truncated { need, have };
            self.problems.add(at, kind, None);
        } else if self.index.is_none_or(|(index, _)| index == 0) {
            self.problems.add(at, ProblemKind::NoIndex, None);
        } else if self.claimed().is_none() {
            self.problems.add(at, ProblemKind::NoFooter, None);
        }
    }

    /// A chunk, or one record that is handled as a chunk of one.
    fn chunk(&mut self, at: u64, kept: &RecordHead) -> io::Result<Option<Item>> {
        let is_chunk = kept.op == op::CHUNK;
        let compression = if is_chunk {
            kept.compression
        } else {
            Some(Compression::None)
        };
        let (limit, size) = (self.limits.record, u64::from(kept.size));
        if kept.total > limit {
            // A stream cannot be asked whether it is that long, and a file is to give the same.
            self.lost(at, kept.total)?;
            return Ok(None);
        }
        let fault = match compression {
            None => Some(ProblemKind::UnknownCompression {
                name: kept.name.clone(),
            }),
            _ if size > limit => Some(ProblemKind::ChunkTooBig { size, limit }),
            _ => None,
        };
        let (Some(compression), None) = (compression, &fault) else {
            if let Some(kind) = fault {
                self.leave_out(at, kept.total, kind)?;
            }
            return Ok(None);
        };
        if is_chunk && kept.size == 0 && kept.data_len == 0 && self.has(kept.total + 1)? {
            // Its sizes were never filled in: the recorder was killed, and what was in it follows.
            let read_on = compression == Compression::None;
            let kind = ProblemKind::UnfinishedChunk { read_on };
            self.problems.add(at, kind, None);
            self.tape.skip(kept.total)?;
            return Ok(None);
        }
        let total = usize::try_from(kept.total).unwrap_or(usize::MAX);
        let start = if is_chunk { kept.data_at } else { 0 };
        let is_cut = !self.has(kept.total)?;
        if is_cut && self.resumes(at)? {
            // Not the end, but a damaged length: behind it there is a chunk.
            self.lost(at, kept.total)?;
            return Ok(None);
        }
        let payload = self.payload(at, start, kept.total)?;
        if is_cut {
            let have = self.tape.position().saturating_sub(at);
            let need = kept.total;
            self.problems
                .add(at, ProblemKind::Truncated { need, have }, None);
            self.done = true;
        }
        let indexed = if is_chunk { self.indexed()? } else { None };
        if is_chunk {
            *self.facts.chunks.entry(compression).or_default() += 1;
        }
        let size = if is_chunk { kept.size as usize } else { total };
        Ok(Some(Item::Block(Block {
            offset: at,
            kind: Kind::Bag {
                compression,
                size,
                is_cut,
                indexed,
            },
            payload,
        })))
    }

    /// Passes over a chunk that is not read, if all of it is there.
    fn leave_out(&mut self, at: u64, total: u64, kind: ProblemKind) -> io::Result<()> {
        if !self.has(total)? {
            self.lost(at, total)?;
            return Ok(());
        }
        self.pass_over(at, total)?;
        let messages = self.indexed()?;
        self.problems.add(at, kind, messages);
        self.problems.skip(total);
        Ok(())
    }

    /// The bytes behind `start` of what is `total` long, as far as they are there.
    fn payload(&mut self, at: u64, start: usize, total: u64) -> io::Result<Payload> {
        Ok(match self.tape.input() {
            Input::File(file) => {
                let file = Arc::clone(file);
                let have = self.tape.remaining().unwrap_or(0).min(total);
                self.tape.skip(have)?;
                Payload::At {
                    file,
                    offset: at + start as u64,
                    len: usize::try_from(have).unwrap_or(0).saturating_sub(start),
                }
            }
            Input::Stream { .. } => {
                let total = usize::try_from(total).unwrap_or(usize::MAX);
                let have = self.tape.available(total, total)?.len().min(total);
                let mut held = self.tape.hand_out(have);
                held.range.start = (held.range.start + start).min(held.range.end);
                Payload::Held(held)
            }
        })
    }

    /// Whether a chunk begins behind the record at `at`, which does not end within the input.
    fn resumes(&mut self, at: u64) -> io::Result<bool> {
        let mut window = FIRST;
        let mut from = 1;
        loop {
            let ahead = self.tape.available(window, 2 * window)?;
            let have = ahead.len();
            match bag::chunk_at(ahead.get(from..).unwrap_or(&[])) {
                Ok(_) => return Ok(true),
                Err(next) => from += next,
            }
            if have < window {
                return Ok(false);
            }
            // A file need not be held to be searched; of a stream no more is held than one record may take.
            if window as u64 > self.limits.record {
                return Ok(false);
            }
            window *= 2;
            debug_assert_eq!(self.tape.position(), at);
        }
    }

    /// Whether `total` more bytes, no more than one record may take, are there.
    fn has(&mut self, total: u64) -> io::Result<bool> {
        if let Some(left) = self.tape.remaining() {
            return Ok(total <= left.min(self.limits.record));
        }
        let most = total.min(self.limits.record);
        let most = usize::try_from(most).unwrap_or(usize::MAX);
        let have = self.tape.available(most, most)?.len() as u64;
        Ok(total <= have.min(self.limits.record))
    }

    /// Counts messages by the index records behind a chunk.
    fn indexed(&mut self) -> io::Result<Option<u64>> {
        let mut messages: Option<u64> = None;
        loop {
            let ahead = self.tape.available(INDEX_HEAD, PEEK)?;
            let Ok(head) = bag::head(ahead.get(..INDEX_HEAD).unwrap_or(ahead)) else {
                return Ok(messages);
            };
            let (kind, total) = (head.op, head.total() as u64);
            let count = u64::from(head.count.unwrap_or(0));
            if kind != op::INDEX || !self.has(total)? {
                return Ok(messages);
            }
            messages = Some(messages.unwrap_or(0).saturating_add(count));
            if self.tape.skip(total)? < total {
                return Ok(messages);
            }
        }
    }

    /// Adds up the messages of one chunk by the index: pairs of connection and count.
    fn chunk_info(&mut self, at: u64, kept: &RecordHead) -> io::Result<()> {
        let total = usize::try_from(kept.total).unwrap_or(usize::MAX);
        if self.has(kept.total)? {
            let ahead = self.tape.available(total, total)?;
            let pairs = ahead.get(kept.data_at..total).unwrap_or(&[]);
            let (pairs, _) = pairs.as_chunks::<8>();
            let count = |[_, _, _, _, count @ ..]: &[u8; 8]| u64::from(u32::from_le_bytes(*count));
            let n = usize::try_from(kept.count).unwrap_or(usize::MAX);
            let messages: u64 = pairs.iter().take(n).map(count).sum();
            self.told.0 = self.told.0.saturating_add(1);
            self.told.1 = self.told.1.saturating_add(messages);
        }
        self.pass_over(at, kept.total)
    }

    /// Moves over one record, on the word of its length.
    fn pass_over(&mut self, at: u64, total: u64) -> io::Result<()> {
        if total > self.limits.record || (!self.has(total)? && self.resumes(at)?) {
            return self.lost(at, total);
        }
        let have = self.tape.skip(total)?;
        if have < total {
            let kind = ProblemKind::Truncated { need: total, have };
            self.problems.add(at, kind, None);
            self.done = true;
        }
        Ok(())
    }

    /// Handles bytes at `at` that are no record, or go on behind the end: finds the next chunk, or ends.
    fn lost(&mut self, at: u64, total: u64) -> io::Result<()> {
        self.tape.skip(1)?;
        let mut window = FIRST;
        loop {
            let ahead = self.tape.available(window, 2 * window)?;
            let have = ahead.len();
            match bag::chunk_at(ahead) {
                Ok(next) => {
                    self.tape.skip(next as u64)?;
                    break;
                }
                Err(next) if have >= window => {
                    self.tape.skip(next as u64)?;
                    window = WINDOW.min(2 * window);
                }
                Err(_) => {
                    self.tape.skip(have as u64)?;
                    self.done = true;
                    break;
                }
            }
        }
        let skipped = self.tape.position().saturating_sub(at);
        let kind = if self.done && total > skipped {
            ProblemKind::Truncated {
                need: total,
                have: skipped,
            }
        } else {
            ProblemKind::Garbage { skipped }
        };
        self.problems.add(at, kind, None);
        Ok(())
    }
}

impl Container for Scanner {
    fn next(&mut self) -> io::Result<Option<Item>> {
        if self.tape.position() == 0 {
            self.tape.skip(bag::MAGIC.len() as u64)?;
        }
        while !self.done {
            let at = self.tape.position();
            let Some(kept) = self.head()? else { continue };
            let item = match kept.op {
                op::CHUNK => self.chunk(at, &kept)?,
                // Outside of chunks: in the index, or where the recorder was killed inside one.
                op::MESSAGE | op::CONNECTION => self.chunk(at, &kept)?,
                op::BAG | op::INDEX => {
                    self.index = kept.index.or(self.index);
                    self.pass_over(at, kept.total)?;
                    None
                }
                op::CHUNK_INFO => {
                    self.chunk_info(at, &kept)?;
                    None
                }
                _ => {
                    self.lost(at, kept.total)?;
                    None
                }
            };
            if item.is_some() {
                return Ok(item);
            }
        }
        Ok(None)
    }

    fn position(&self) -> u64 {
        self.tape.position()
    }

    fn finish(self: Box<Self>) -> (Facts, Problems) {
        (self.facts, self.problems)
    }

    fn recycle(&mut self, payload: Payload) {
        if let Payload::Held(held) = payload {
            self.tape.recycle(held);
        }
    }

    /// Messages by the index, where it tells of every chunk.
    fn claimed(&self) -> Option<u64> {
        let (chunks, messages) = self.told;
        let is_whole = self.index.is_some_and(|(at, n)| at > 0 && n == chunks);
        is_whole.then_some(messages)
    }
}

/// The connections in a bag's index, for chunks that are lost; none where there is no index that can be read.
///
/// # Errors
/// Only when the file itself cannot be read.
pub(in super::super) fn definitions(file: &Arc<LogFile>, limits: Limits) -> io::Result<Fallback> {
    let mut found = Fallback::default();
    let mut tape = Tape::new(Input::File(Arc::clone(file)), bag::MAGIC.len() as u64);
    let own = bag::head(tape.available(PEEK, PEEK)?).ok();
    let Some(start) = own.and_then(|own| own.index_pos).filter(|at| *at > 0) else {
        return Ok(found);
    };
    tape.seek(start);
    let mut bytes = 0;
    let mut to = Transcript::default();
    loop {
        let ahead = tape.available(PEEK, PEEK)?;
        let Ok(Some(total)) = bag::head(ahead).map(|head| {
            let is_index = matches!(head.op, op::CONNECTION | op::CHUNK_INFO);
            is_index.then(|| head.total())
        }) else {
            return Ok(found);
        };
        bytes += total;
        if bytes > limits.definitions {
            return Ok(found);
        }
        let ahead = tape.available(total, total.max(PEEK))?;
        let (Ok(head), Some(record)) = (bag::head(ahead), ahead.get(..total)) else {
            return Ok(found);
        };
        to.bytes.clear();
        let data = record.get(head.data_at..).unwrap_or(&[]);
        if head.op == op::CONNECTION && bag::connection(&head, data, &mut to).is_some() {
            let mut rest = to.bytes.as_slice();
            while let Some((opcode, length)) = head_at(rest, 0) {
                let end = HEAD + usize::try_from(length).unwrap_or(0);
                let body = rest.get(HEAD..end).unwrap_or(&[]);
                let id = body.first_chunk().map_or(0, |id| u16::from_le_bytes(*id));
                let of = match opcode {
                    record_op::SCHEMA => &mut found.schemas,
                    _ => &mut found.channels,
                };
                of.insert(id, body.to_owned());
                rest = rest.get(end..).unwrap_or(&[]);
            }
        }
        tape.skip(total as u64)?;
    }
}
