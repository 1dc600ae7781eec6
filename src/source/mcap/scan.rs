//! Bytes in order -> blocks, and what the log says about itself. I/O.
//!
//! A stage of its own because it alone decides where records begin: every length is held against the
//! file and the limit before anything is allocated or skipped on its word, and where the
//! framing is lost it is found again at the next thing that can only be a chunk.

use super::Limits;
use super::block::{Block, Compression, Kind, Payload};
use super::bytes::{HEAD, head_at};
use super::problem::{ProblemKind, Problems};
use super::record::{ChunkHead, MAGIC, Record, op};
use super::resync;
use super::tape::{Held, Input, Tape};
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

/// Bytes of unchunked records worked on together.
const RUN: usize = 1 << 20;
/// What is read to see a chunk's head and the few records around it.
const PEEK: usize = 1 << 10;
/// Longest name of a compression that is believed.
const NAME: u32 = 32;
/// Bytes that may follow the known fields of a chunk record (the format may grow).
const SLACK: u64 = 1 << 10;

/// What a log says about itself outside its messages.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Facts {
    /// Profile in the header, such as `ros2`.
    pub profile: String,
    /// Library that wrote it, by the header.
    pub library: String,
    /// Chunks met, by compression.
    pub chunks: BTreeMap<Compression, u64>,
    /// Chunks without a CRC: their messages are used unverified.
    pub unverified_chunks: u64,
    /// Metadata records met.
    pub metadata: u64,
    /// Attachments met.
    pub attachments: u64,
}

/// The next thing in the log.
#[derive(Debug)]
pub(super) enum Item {
    Block(Block),
    /// A record that is neither chunk, message nor definition; only when asked for.
    Other {
        opcode: u8,
        offset: u64,
        body: Held,
    },
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Section {
    Data,
    /// After the end of data: schemas and channels here only repeat.
    Summary,
    /// After the footer.
    Footer,
}

/// The walk over top-level records.
#[derive(Debug)]
pub(super) struct Scanner {
    tape: Tape,
    limits: Limits,
    section: Section,
    /// Hand out every record ([`Item::Other`]).
    everything: bool,
    /// The last record that was skipped on the word of its length alone, for going back to
    /// when what follows it is garbage.
    trusted: Option<u64>,
    /// CRC of everything so far, while every byte has been seen (no chunk yet).
    crc: Option<crc32fast::Hasher>,
    done: bool,
    /// The end was reached, magic and all.
    complete: bool,
    /// Messages by the statistics of this log's summary.
    claimed: Option<u64>,
    /// The same of all logs joined in this input; `None` once one says nothing.
    claimed_in_all: Option<u64>,
    pub(super) facts: Facts,
    pub(super) problems: Problems,
}

impl Scanner {
    /// Starts behind the magic, which has been checked.
    pub(super) fn new(input: Input, limits: Limits, everything: bool) -> Self {
        let start = MAGIC.len() as u64;
        let mut tape = Tape::new(input, start);
        tape.seek(start);
        let mut crc = crc32fast::Hasher::new();
        crc.update(&MAGIC);
        Scanner {
            tape,
            limits,
            section: Section::Data,
            everything,
            trusted: None,
            crc: Some(crc),
            done: false,
            complete: false,
            claimed: None,
            claimed_in_all: Some(0),
            facts: Facts::default(),
            problems: Problems::default(),
        }
    }

    pub(super) fn tape(&self) -> &Tape {
        &self.tape
    }

    pub(super) fn recycle(&mut self, payload: Payload) {
        if let Payload::Held(held) = payload {
            self.tape.recycle(held);
        }
    }

    /// The next block, or `None` at the end.
    pub(super) fn next(&mut self) -> io::Result<Option<Item>> {
        while !self.done {
            if self.section == Section::Footer {
                self.after_footer()?;
                continue;
            }
            let at = self.tape.position();
            let ahead = self.tape.available(HEAD, PEEK)?;
            let Some((opcode, length)) = head_at(ahead, 0) else {
                let have = ahead.len() as u64;
                self.end(at, have);
                break;
            };
            let total = length.saturating_add(HEAD as u64);
            let item = match opcode {
                op::MESSAGE | op::SCHEMA | op::CHANNEL if self.section == Section::Data => {
                    self.run()?
                }
                op::CHUNK => self.chunk(at, length)?,
                // A message has no business in the summary: a changed byte made it one.
                0 | op::MESSAGE => self.lost(at, total)?,
                op::DATA_END | op::FOOTER if length > SLACK => self.lost(at, total)?,
                _ if !self.may_skip(opcode, length) => self.lost(at, total)?,
                _ => self.other(at, opcode, length)?,
            };
            if item.is_some() {
                return Ok(item);
            }
        }
        Ok(None)
    }

    /// Messages there should be, by the statistics; known only after a complete end.
    pub(super) fn claimed(&self) -> Option<u64> {
        self.claimed_in_all.filter(|_| self.done && self.complete)
    }

    /// Whether a record of this length can be stepped over. A stream can not be asked how long it
    /// is, so there only an attachment may be longer than the limit.
    fn may_skip(&self, opcode: u8, length: u64) -> bool {
        match self.tape.remaining() {
            Some(left) => length.saturating_add(HEAD as u64) <= left,
            None => length <= self.limits.record || opcode == op::ATTACHMENT,
        }
    }

    /// The input ended where a record should begin, or inside its nine bytes of head.
    fn end(&mut self, at: u64, have: u64) {
        self.done = true;
        if have > 0 {
            let need = HEAD as u64;
            self.problems
                .add(at, ProblemKind::Truncated { need, have }, None);
        } else {
            self.problems.add(at, ProblemKind::NoFooter, None);
        }
    }

    /// Expects the magic, then the end; or a further log, when several were joined.
    fn after_footer(&mut self) -> io::Result<()> {
        let at = self.tape.position();
        let ahead = self.tape.available(2 * MAGIC.len(), PEEK)?;
        let Some(rest) = ahead.strip_prefix(&MAGIC) else {
            let have = ahead.len() as u64;
            self.problems.add(
                at,
                ProblemKind::Truncated {
                    need: MAGIC.len() as u64,
                    have,
                },
                None,
            );
            self.done = true;
            return Ok(());
        };
        let again = rest.starts_with(&MAGIC);
        self.done = !again;
        self.complete = !again;
        let sum = self
            .claimed_in_all
            .zip(self.claimed.take())
            .map(|(a, b)| a.saturating_add(b));
        self.claimed_in_all = sum;
        self.section = Section::Data;
        self.crc = None;
        self.trusted = None;
        self.tape.skip(2 * MAGIC.len() as u64)?;
        Ok(())
    }

    /// Unchunked schemas, channels and messages: as many whole ones as make about [`RUN`] bytes.
    fn run(&mut self) -> io::Result<Option<Item>> {
        let at = self.tape.position();
        let mut want = RUN;
        loop {
            let ahead = self.tape.available(want, want)?;
            let mut n = 0;
            let mut next = None;
            while let Some((opcode, length)) = head_at(ahead, n) {
                if !matches!(opcode, op::MESSAGE | op::SCHEMA | op::CHANNEL) {
                    break;
                }
                let total = length.saturating_add(HEAD as u64);
                match usize::try_from(total) {
                    Ok(t) if t <= ahead.len() - n => n += t,
                    _ => {
                        next = Some((opcode, length, total));
                        break;
                    }
                }
            }
            if n > 0 {
                if let Some(crc) = &mut self.crc {
                    crc.update(ahead.get(..n).unwrap_or(&[]));
                }
                self.trusted = None;
                let payload = Payload::Held(self.tape.hand_out(n));
                return Ok(Some(Item::Block(Block {
                    offset: at,
                    kind: Kind::Run,
                    payload,
                })));
            }
            // The very first record does not fit into what was read.
            let Some((opcode, length, total)) = next else {
                return Ok(None);
            };
            let limit = self.limits.record;
            let have = ahead.len();
            let stream = self.tape.remaining().is_none();
            if !self.tape.may_have(total) || have < want || (stream && length > limit) {
                return self.lost(at, total);
            }
            if length > limit {
                self.problems.add(
                    at,
                    ProblemKind::RecordTooLong {
                        opcode,
                        length,
                        limit,
                    },
                    None,
                );
                self.pass_over(total)?;
                return Ok(None);
            }
            want = usize::try_from(total).unwrap_or(usize::MAX);
        }
    }

    fn chunk(&mut self, at: u64, length: u64) -> io::Result<Option<Item>> {
        self.section = Section::Data;
        let most = HEAD + 40 + NAME as usize;
        let ahead = self.tape.available(most, PEEK)?;
        let head = ahead.get(HEAD..).and_then(|body| {
            let body = body.get(..most - HEAD).unwrap_or(body);
            ChunkHead::parse(body).map(|(head, _)| head)
        });
        let total = length.saturating_add(HEAD as u64);
        let Some(head) = head else {
            return self.lost(at, total);
        };
        let start = HEAD as u64 + head.len();
        let (packed, size, crc) = (
            head.compressed_size,
            head.uncompressed_size,
            head.uncompressed_crc,
        );
        let compression = Compression::named(head.compression);
        if length == u64::MAX && packed == u64::MAX && compression.is_some() {
            return self.unfinished(at, start, compression);
        }
        let fields = head.len().saturating_add(packed);
        let name = head.compression.to_owned();
        if !self.tape.may_have(total) || fields > length || length - fields > SLACK {
            return self.lost(at, total);
        }
        self.crc = None;
        let limit = self.limits.record;
        let fault = if packed.max(size) > limit {
            Some(ProblemKind::ChunkTooBig {
                size: packed.max(size),
                limit,
            })
        } else if compression.is_none() {
            Some(ProblemKind::UnknownCompression { name })
        } else {
            None
        };
        let (Some(compression), None, Ok(size), Ok(packed)) = (
            compression,
            &fault,
            usize::try_from(size),
            usize::try_from(packed),
        ) else {
            self.pass_over(total)?;
            let messages = self.indexed()?;
            let kind = fault.unwrap_or(ProblemKind::ChunkTooBig {
                size: length,
                limit,
            });
            self.problems.add(at, kind, messages);
            return Ok(None);
        };
        let payload = match self.tape.input() {
            Input::File(file) => {
                let (file, offset) = (Arc::clone(file), at + start);
                self.tape.skip(total)?;
                Payload::At {
                    file,
                    offset,
                    len: packed,
                }
            }
            Input::Stream { .. } => {
                let all = usize::try_from(total).unwrap_or(usize::MAX);
                let have = self.tape.available(all, all)?.len();
                if have < all {
                    return self.lost(at, total);
                }
                let mut held = self.tape.hand_out(all);
                let from = held
                    .range
                    .start
                    .saturating_add(usize::try_from(start).unwrap_or(0));
                held.range = from..from.saturating_add(packed);
                Payload::Held(held)
            }
        };
        self.trusted = None;
        let indexed = self.indexed()?;
        *self.facts.chunks.entry(compression).or_default() += 1;
        self.facts.unverified_chunks += u64::from(crc == 0);
        let kind = Kind::Chunk {
            compression,
            size,
            crc,
            indexed,
        };
        Ok(Some(Item::Block(Block {
            offset: at,
            kind,
            payload,
        })))
    }

    /// A chunk whose length was never filled in: what is uncompressed is read as if unchunked.
    fn unfinished(
        &mut self,
        at: u64,
        start: u64,
        compression: Option<Compression>,
    ) -> io::Result<Option<Item>> {
        let read_on = compression == Some(Compression::None);
        self.problems
            .add(at, ProblemKind::UnfinishedChunk { read_on }, None);
        self.crc = None;
        self.trusted = None;
        if read_on {
            self.tape.skip(start)?;
        } else if !resync::next_chunk(&mut self.tape, at + 1, self.limits.record)? {
            self.done = true;
        }
        Ok(None)
    }

    /// Counts messages by the indexes that follow a chunk. The count is an estimate for a
    /// lost chunk, never used otherwise.
    fn indexed(&mut self) -> io::Result<Option<u64>> {
        let mut messages: Option<u64> = None;
        loop {
            let at = self.tape.position();
            let head = head_at(self.tape.available(HEAD, PEEK)?, 0);
            let Some((op::MESSAGE_INDEX, length)) = head else {
                return Ok(messages);
            };
            let total = length.saturating_add(HEAD as u64);
            if self.everything || !self.tape.may_have(total) {
                return Ok(messages);
            }
            messages = Some(
                messages
                    .unwrap_or(0)
                    .saturating_add(length.saturating_sub(6) / 16),
            );
            self.trusted = Some(at);
            if self.tape.skip(total)? < total {
                return Ok(messages);
            }
        }
    }

    /// Any record that carries no messages.
    fn other(&mut self, at: u64, opcode: u8, length: u64) -> io::Result<Option<Item>> {
        let total = length.saturating_add(HEAD as u64);
        match opcode {
            op::METADATA => self.facts.metadata += 1,
            op::ATTACHMENT => self.facts.attachments += 1,
            op::DATA_END => self.section = Section::Summary,
            op::FOOTER => self.section = Section::Footer,
            _ => {}
        }
        let wanted =
            self.everything || matches!(opcode, op::HEADER | op::DATA_END | op::STATISTICS);
        if !wanted || length > self.limits.record {
            self.pass_over(total)?;
            return Ok(None);
        }
        let all = usize::try_from(total).unwrap_or(usize::MAX);
        let ahead = self.tape.available(all, all)?;
        if ahead.len() < all {
            return self.lost(at, total);
        }
        match ahead
            .get(HEAD..all)
            .and_then(|body| Record::parse(opcode, body))
        {
            Some(Record::Header { profile, library }) if self.facts.profile.is_empty() => {
                self.facts.profile = profile.to_owned();
                self.facts.library = library.to_owned();
            }
            Some(Record::Statistics(s)) => self.claimed = Some(s.message_count),
            Some(Record::DataEnd {
                data_section_crc: stored,
            }) if stored != 0 => {
                if let Some(computed) = self.crc.take().map(crc32fast::Hasher::finalize)
                    && computed != stored
                {
                    self.problems
                        .add(at, ProblemKind::DataCrc { stored, computed }, None);
                }
            }
            _ => {}
        }
        if !self.everything {
            self.pass_over(total)?;
            return Ok(None);
        }
        self.count(all);
        self.trusted = Some(at);
        let mut body = self.tape.hand_out(all);
        body.range.start += HEAD;
        Ok(Some(Item::Other {
            opcode,
            offset: at,
            body,
        }))
    }

    fn count(&mut self, n: usize) {
        if let Some(crc) = &mut self.crc
            && let Ok(ahead) = self.tape.available(n, n)
        {
            crc.update(ahead.get(..n).unwrap_or(ahead));
        }
    }

    /// Moves over one record, on the word of its length.
    fn pass_over(&mut self, total: u64) -> io::Result<()> {
        let at = self.tape.position();
        match usize::try_from(total) {
            Ok(n) if n <= RUN && self.crc.is_some() => {
                self.tape.available(n, n)?;
                self.count(n);
            }
            _ => self.crc = None,
        }
        self.trusted = Some(at);
        let have = self.tape.skip(total)?;
        if have < total {
            self.problems
                .add(at, ProblemKind::Truncated { need: total, have }, None);
            self.done = true;
        }
        Ok(())
    }

    /// What stands at `at` can not be a record of `total` bytes: find the next chunk, or end.
    fn lost(&mut self, at: u64, total: u64) -> io::Result<Option<Item>> {
        let left = self
            .tape
            .remaining()
            .unwrap_or(self.tape.available(1, 1)?.len() as u64);
        let from = self.trusted.take().unwrap_or(at);
        self.crc = None;
        if self.section != Section::Data {
            // Nothing but repetition follows the end of data.
            let kind = if self.tape.may_have(total) {
                ProblemKind::BadSummary {
                    why: "it holds bytes that are no record",
                }
            } else {
                ProblemKind::Truncated {
                    need: total,
                    have: left,
                }
            };
            self.problems.add(at, kind, None);
            self.done = true;
            return Ok(None);
        }
        if resync::next_chunk(&mut self.tape, from + 1, self.limits.record)? {
            let skipped = self.tape.position().saturating_sub(from);
            self.problems
                .add(from, ProblemKind::Garbage { skipped }, None);
        } else {
            self.problems.add(
                at,
                ProblemKind::Truncated {
                    need: total,
                    have: left,
                },
                None,
            );
            self.done = true;
        }
        Ok(None)
    }
}
