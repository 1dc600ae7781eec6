//! The end of a file -> its summary, if it can be believed. I/O.
//!
//! A stage of its own because a summary is a claim: it is used only when it is within the file, its CRC
//! holds, every record parses and every chunk it names lies before it.

use super::Limits;
use super::channels::Fallback;
use super::index::{ChunkList, Index};
use super::input::{Input, LogFile, Tape};
use crate::records::record::{Body, Footer, Record, Statistics};
use crate::records::{HEAD, MAGIC, head_at, op};
use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

/// Number of bytes read of it at a time.
const WINDOW: usize = 256 << 10;

const BROKEN: &str = "its records do not add up";

/// Contents of the summary, checked as far as it can be without reading the data.
#[derive(Debug, Default)]
pub(super) struct Summary {
    pub(super) definitions: Fallback,
    pub(super) statistics: Option<Statistics>,
    /// Chunks by compression name.
    pub(super) chunks: BTreeMap<String, u64>,
    /// Ranges gathered of a remote object.
    gathered: Option<ChunkList>,
    /// Index of what need not be read.
    pub(super) index: Option<Index>,
    /// Bytes of definitions so far.
    bytes: usize,
}

/// A summary, none (`Ok(None)`), or why there is one that cannot be used.
pub(super) type SummaryResult = Result<Option<Summary>, &'static str>;

/// Reads the summary of a file.
///
/// # Errors
/// Only when the file itself cannot be read.
pub(super) fn read(file: &Arc<LogFile>, limits: Limits) -> io::Result<SummaryResult> {
    const END: usize = HEAD + Footer::LEN as usize + MAGIC.len();
    let Some(footer_at) = file
        .len
        .checked_sub(END as u64)
        .filter(|at| *at >= MAGIC.len() as u64)
    else {
        return Ok(Ok(None));
    };
    let mut end = [0; END];
    if file.read_at(&mut end, footer_at)? < END || !end.ends_with(&MAGIC) {
        return Ok(Ok(None));
    }
    let footer = match head_at(&end, 0) {
        Some((op::FOOTER, Footer::LEN)) => end.get(HEAD..).and_then(Footer::parse),
        _ => None,
    };
    let Some(footer) = footer else {
        return Ok(Err("the footer is not where it should be"));
    };
    let start = footer.summary_start;
    if start == 0 {
        return Ok(Ok(None));
    }
    if start < MAGIC.len() as u64 || start > footer_at {
        return Ok(Err("it begins outside the file"));
    }
    let mut tape = Tape::new(Input::File(Arc::clone(file)), start);
    let mut crc = crc32fast::Hasher::new();
    let mut summary = Summary {
        gathered: file.object().map(|_| ChunkList::default()),
        ..Summary::default()
    };
    while tape.position() < footer_at {
        let left = footer_at - tape.position();
        // Record by record: the section of a long log may be larger than what should be in memory.
        let head = head_at(tape.available(HEAD, WINDOW)?, 0);
        let total = head.map(|(_, length)| length.saturating_add(HEAD as u64));
        let (Some((opcode, length)), Some(total)) = (head, total.filter(|total| *total <= left))
        else {
            return Ok(Err(BROKEN));
        };
        let (true, Ok(all)) = (length <= limits.record, usize::try_from(total)) else {
            return Ok(Err("a record of it is longer than the limit"));
        };
        let ahead = tape.available(all, all.max(WINDOW))?;
        let Some((record, body)) = ahead.get(..all).and_then(|r| Some((r, r.get(HEAD..)?))) else {
            return Ok(Err("it is cut"));
        };
        crc.update(record);
        if let Err(why) = summary.take_in(opcode, body, start, limits) {
            return Ok(Err(why));
        }
        tape.skip(total)?;
    }
    crc.update(end.get(..HEAD + Footer::LEN as usize - 4).unwrap_or(&[]));
    if footer.summary_crc != 0 && crc.finalize() != footer.summary_crc {
        return Ok(Err("its CRC is wrong"));
    }
    if footer.summary_crc != 0
        && let (Some(gathered), Some(statistics)) = (summary.gathered.take(), &summary.statistics)
    {
        let index = gathered.index(statistics, start);
        summary.index = index.filter(|index| index.is_defined_by(&summary.definitions));
    }
    Ok(Ok(Some(summary)))
}

impl Summary {
    fn take_in(
        &mut self,
        opcode: u8,
        body: &[u8],
        start: u64,
        limits: Limits,
    ) -> Result<(), &'static str> {
        match Record::parse(opcode, body).ok_or(BROKEN)? {
            Record::Schema(s) => {
                self.bytes = self.bytes.saturating_add(body.len());
                self.definitions.schemas.insert(s.id, body.to_owned());
            }
            Record::Channel(c) => {
                self.bytes = self.bytes.saturating_add(body.len());
                self.definitions.channels.insert(c.id, body.to_owned());
            }
            Record::Statistics(s) => self.statistics = Some(s),
            Record::ChunkIndex(c) => {
                let end = c.chunk_start_offset.checked_add(c.chunk_length);
                if end.is_none_or(|end| end > start) {
                    return Err("it names a chunk outside the data");
                }
                // A log has three kinds; more than a few is not a log.
                if self.chunks.len() > 16 {
                    return Err("it names too many compressions");
                }
                *self.chunks.entry(c.compression.to_owned()).or_default() += 1;
                self.bytes = match &self.gathered {
                    Some(_) => self.bytes.saturating_add(body.len()),
                    None => self.bytes,
                };
                if let Some(gathered) = &mut self.gathered {
                    gathered.add(&c, limits);
                }
            }
            _ => {}
        }
        if self.bytes > limits.definitions {
            return Err("its definitions are longer than the limit");
        }
        Ok(())
    }
}
