//! Bytes in order -> blocks, and what the log says about itself. I/O.
//!
//! A stage of its own because it alone decides where records begin: every length is held against the
//! file and the limit before anything is allocated or skipped on its word, and where the
//! framing is lost it is found again at the next thing that can only be a chunk.

mod chunk;
mod facts;

use super::Limits;
use super::block::{Block, Compression, Kind, Payload};
use super::container::Container;
use super::index::Passed;
use super::input::{Input, OwnedBytes, Tape};
use super::resync;
use crate::format::Format;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::record::Record;
use crate::records::{HEAD, MAGIC, head_at, op};
use std::collections::{BTreeMap, VecDeque};
use std::io;

/// Bytes of unchunked records worked on together.
const RUN: usize = 1 << 20;
/// Number of bytes read to see a chunk's head and the few records around it.
const PEEK: usize = 1 << 10;
/// Bytes that may follow the known fields of a chunk record (the format may grow).
const SLACK: u64 = 1 << 10;

/// Metadata records up to this long are looked into; ours takes about 1 kB.
const METADATA_READ: u64 = 64 << 10;

/// Longest metadata record that is copied, unless the limit of all records is lower: it is held several
/// times over on its way into the copy, and those in use are a thousand times shorter.
const METADATA_COPIED: u64 = 8 << 20;

/// Facts that a log states about itself outside its messages.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Facts {
    /// Format of the container.
    pub format: Format,
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
    /// The first metadata record named `strapd`: what our own output says about its frames.
    pub provenance: BTreeMap<String, String>,
    /// Attachments met.
    pub attachments: u64,
}

/// Items handed out besides blocks of messages.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum OtherRecords {
    Nothing,
    /// Blocks of their own that a copy takes along: header, attachments, metadata.
    Attached,
    /// Every record, as [`Item::Other`].
    Everything,
}

/// The next thing in the log.
#[derive(Debug)]
pub(super) enum Item {
    Block(Block),
    /// A record that is neither chunk, message nor definition; only for [`OtherRecords::Everything`].
    Other {
        opcode: u8,
        offset: u64,
        body: OwnedBytes,
    },
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Section {
    Data,
    /// Summary, after the end of data: schemas and channels here only repeat.
    Summary,
    /// End, after the footer.
    Footer,
}

/// The walk over top-level records.
#[derive(Debug)]
pub(super) struct Scanner {
    tape: Tape,
    limits: Limits,
    section: Section,
    besides: OtherRecords,
    /// The last record that was skipped on the word of its length alone, for going back to
    /// when what follows it is garbage.
    trusted: Option<u64>,
    /// CRC of everything so far, while every byte has been seen (no chunk yet).
    crc: Option<crc32fast::Hasher>,
    done: bool,
    /// Distance to read ahead of a record's head.
    peek: usize,
    /// Chunks that are not read, in order.
    passed: VecDeque<Passed>,
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
    pub(super) fn new(input: Input, limits: Limits, besides: OtherRecords) -> Self {
        let start = MAGIC.len() as u64;
        let mut tape = Tape::new(input, start);
        tape.seek(start);
        let mut crc = crc32fast::Hasher::new();
        crc.update(&MAGIC);
        Scanner {
            tape,
            limits,
            section: Section::Data,
            besides,
            trusted: None,
            crc: Some(crc),
            done: false,
            peek: PEEK,
            passed: VecDeque::new(),
            complete: false,
            claimed: None,
            claimed_in_all: Some(0),
            facts: Facts::default(),
            problems: Problems::default(),
        }
    }

    /// A chunk that is not read, where the walk has come to one.
    fn passed_over(&mut self) -> io::Result<Option<Block>> {
        let at = self.tape.position();
        while self.passed.front().is_some_and(|next| next.at < at) {
            self.passed.pop_front();
        }
        let Some(next) = self.passed.front().copied().filter(|next| next.at == at) else {
            return Ok(None);
        };
        self.passed.pop_front();
        (self.section, self.crc, self.trusted) = (Section::Data, None, None);
        self.tape.skip(next.end.saturating_sub(at))?;
        if let Some(compression) = next.compression {
            *self.facts.chunks.entry(compression).or_default() += 1;
        }
        Ok(Some(Block {
            offset: at,
            kind: Kind::PassedOver {
                size: next.unpacked,
            },
            payload: Payload::Held(OwnedBytes::default()),
        }))
    }

    /// `want` bytes, or as many as there are before a chunk that is not read.
    fn before_passed(&self, want: usize) -> usize {
        let next = self.passed.front().map(|next| next.at);
        let left = next.and_then(|next| next.checked_sub(self.tape.position()));
        left.and_then(|left| usize::try_from(left).ok())
            .map_or(want, |left| want.min(left))
    }

    /// Whether a record of this length can be stepped over. A stream cannot be asked how long it
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
        let mut want = self.before_passed(RUN);
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
                self.problems.skip(total);
                self.pass_over(total)?;
                return Ok(None);
            }
            want = usize::try_from(total).unwrap_or(usize::MAX);
        }
    }

    /// Whether a record without messages is read for what it says.
    fn is_wanted(&self, opcode: u8, length: u64) -> bool {
        self.besides == OtherRecords::Everything
            || match opcode {
                op::METADATA => length <= METADATA_READ,
                opcode => matches!(opcode, op::HEADER | op::DATA_END | op::STATISTICS),
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
        let attached = self.besides == OtherRecords::Attached
            && matches!(opcode, op::HEADER | op::ATTACHMENT | op::METADATA);
        let wanted = attached || self.is_wanted(opcode, length);
        let limit = match opcode {
            op::METADATA if attached => self.limits.record.min(METADATA_COPIED),
            _ => self.limits.record,
        };
        if !wanted || length > limit {
            if attached {
                let kind = ProblemKind::RecordTooLong {
                    opcode,
                    length,
                    limit,
                };
                self.problems.add(at, kind, None);
                self.problems.skip(total);
            }
            self.pass_over(total)?;
            return Ok(None);
        }
        let all = usize::try_from(total).unwrap_or(usize::MAX);
        let ahead = self.tape.available(all, all)?;
        if ahead.len() < all {
            return self.lost(at, total);
        }
        if let Some(record) = ahead
            .get(HEAD..all)
            .and_then(|body| Record::parse(opcode, body))
        {
            let (facts, claimed) = (&mut self.facts, &mut self.claimed);
            if let Some(kind) = facts::learn(record, facts, claimed, &mut self.crc) {
                self.problems.add(at, kind, None);
            }
        }
        if !attached && self.besides != OtherRecords::Everything {
            self.pass_over(total)?;
            return Ok(None);
        }
        self.count(all);
        self.trusted = Some(at);
        let mut body = self.tape.hand_out(all);
        body.range.start += HEAD;
        Ok(Some(if attached {
            Item::Block(Block {
                offset: at,
                kind: Kind::Attached { opcode },
                payload: Payload::Held(body),
            })
        } else {
            Item::Other {
                opcode,
                offset: at,
                body,
            }
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

    /// Handles bytes at `at` that cannot be a record of `total` bytes: finds the next chunk, or ends.
    fn lost(&mut self, at: u64, total: u64) -> io::Result<Option<Item>> {
        let left = self
            .tape
            .remaining()
            .unwrap_or(self.tape.available(1, 1)?.len() as u64);
        let from = self.trusted.take().unwrap_or(at);
        self.crc = None;
        // What was read ahead is given up; where that happens often, little is read ahead.
        self.peek = PEEK;
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

impl Container for Scanner {
    fn next(&mut self) -> io::Result<Option<Item>> {
        while !self.done {
            if self.section == Section::Footer {
                self.after_footer()?;
                continue;
            }
            if let Some(block) = self.passed_over()? {
                return Ok(Some(Item::Block(block)));
            }
            let at = self.tape.position();
            let peek = self.before_passed(self.peek);
            let ahead = self.tape.available(HEAD, peek)?;
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

    fn pass_over_chunks(&mut self, passed: &[Passed]) {
        self.passed = passed.iter().copied().collect();
    }

    /// Messages there should be, by the statistics; known only after a complete end.
    fn claimed(&self) -> Option<u64> {
        self.claimed_in_all.filter(|_| self.done && self.complete)
    }
}
