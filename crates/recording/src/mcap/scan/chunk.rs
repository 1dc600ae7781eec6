//! A chunk record -> a block, once its fields agree with each other and the file. I/O.
//!
//! A stage of its own because a chunk is the one record whose body is not read here: its sizes are
//! believed only where they are consistent, since everything after it hangs on them.

use super::super::block::{Block, Compression, Kind, Payload};
use super::super::input::Input;
use super::super::resync;
use super::{Item, OtherRecords, PEEK, SLACK, Scanner, Section};
use crate::records::problem::ProblemKind;
use crate::records::record::{Body, ChunkHead};
use crate::records::{HEAD, head_at, op};
use std::io;
use std::sync::Arc;

/// Number of bytes read ahead where chunks are small, so that one read serves many ...
const PEEK_SMALL: usize = 256 << 10;
/// ... which is when a chunk is shorter than this.
const SMALL: u64 = 32 << 10;
/// Longest name of a compression that is believed.
const NAME: u32 = 32;

impl Scanner {
    pub(super) fn chunk(&mut self, at: u64, length: u64) -> io::Result<Option<Item>> {
        self.section = Section::Data;
        let most = HEAD + 40 + NAME as usize;
        let peek = self.before_passed(self.peek);
        let ahead = self.tape.available(most, peek)?;
        let head = ahead.get(HEAD..).and_then(|body| {
            let body = body.get(..most - HEAD).unwrap_or(body);
            ChunkHead::parse(body)
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
        let fault = match (packed.max(size), compression) {
            (size, _) if size > limit => Some(ProblemKind::ChunkTooBig { size, limit }),
            (_, None) => Some(ProblemKind::UnknownCompression { name }),
            _ => None,
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
            self.problems.skip(total);
            return Ok(None);
        };
        self.peek = if total < SMALL { PEEK_SMALL } else { PEEK };
        let Some(payload) = self.payload(at, start, packed, total)? else {
            return self.lost(at, total);
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

    /// The bytes of a chunk of `total` whose `packed` ones begin behind `start`; `None` where they are not all there.
    fn payload(
        &mut self,
        at: u64,
        start: u64,
        packed: usize,
        total: u64,
    ) -> io::Result<Option<Payload>> {
        let all = usize::try_from(total).unwrap_or(usize::MAX);
        let copy = if total < SMALL {
            self.tape.copy_out(all)
        } else {
            None
        };
        let mut held = match (copy, self.tape.input()) {
            (Some(held), _) => held,
            (None, Input::File(file)) => {
                let (file, offset) = (Arc::clone(file), at + start);
                self.tape.skip(total)?;
                return Ok(Some(Payload::At {
                    file,
                    offset,
                    len: packed,
                }));
            }
            (None, Input::Stream { .. }) => {
                if self.tape.available(all, all)?.len() < all {
                    return Ok(None);
                }
                self.tape.hand_out(all)
            }
        };
        let start = usize::try_from(start).unwrap_or(usize::MAX);
        let from = held.range.start.saturating_add(start);
        held.range = from..from.saturating_add(packed);
        Ok(Some(Payload::Held(held)))
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
        } else {
            self.done = !resync::next_chunk(&mut self.tape, at + 1, self.limits.record)?;
            let skipped = self.tape.position().saturating_sub(at);
            self.problems.skip(skipped);
        }
        Ok(None)
    }

    /// Counts messages by the indexes that follow a chunk. The count is an estimate for a
    /// lost chunk, never used otherwise.
    fn indexed(&mut self) -> io::Result<Option<u64>> {
        let mut messages: Option<u64> = None;
        loop {
            let at = self.tape.position();
            let peek = self.before_passed(self.peek);
            if peek == 0 {
                return Ok(messages);
            }
            let head = head_at(self.tape.available(HEAD, peek)?, 0);
            let Some((op::MESSAGE_INDEX, length)) = head else {
                return Ok(messages);
            };
            let total = length.saturating_add(HEAD as u64);
            if self.besides == OtherRecords::Everything || !self.tape.may_have(total) {
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
}
