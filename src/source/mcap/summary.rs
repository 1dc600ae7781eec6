//! The end of a file -> its summary, if it can be believed. I/O.
//!
//! A stage of its own because a summary is a claim: it is used only when it is within the file, its CRC
//! holds, every record parses and every chunk it names lies before it.

use super::Limits;
use super::bytes::{HEAD, head_at};
use super::channels::Fallback;
use super::record::{Footer, MAGIC, Record, Statistics, op};
use super::tape::LogFile;
use std::collections::BTreeMap;
use std::io;

/// What the summary says, checked as far as it can be without reading the data.
#[derive(Debug, Default)]
pub(super) struct Summary {
    pub(super) definitions: Fallback,
    pub(super) statistics: Option<Statistics>,
    /// Chunks by compression name.
    pub(super) chunks: BTreeMap<String, u64>,
}

/// A summary, none (`Ok(None)`), or why there is one that can not be used.
pub(super) type Found = Result<Option<Summary>, &'static str>;

/// Reads the summary of a file.
///
/// # Errors
/// Only when the file itself can not be read.
pub(super) fn read(file: &LogFile, limits: Limits) -> io::Result<Found> {
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
    let len = footer_at - start;
    if len > limits.record {
        return Ok(Err("it is longer than the limit"));
    }
    let mut section = vec![0; usize::try_from(len).unwrap_or(0)];
    let have = file.read_at(&mut section, start)?;
    if have < section.len() {
        return Ok(Err("it is cut"));
    }
    if footer.summary_crc != 0 {
        let mut crc = crc32fast::Hasher::new();
        crc.update(&section);
        crc.update(end.get(..HEAD + Footer::LEN as usize - 4).unwrap_or(&[]));
        if crc.finalize() != footer.summary_crc {
            return Ok(Err("its CRC is wrong"));
        }
    }
    Ok(parse(&section, start))
}

fn parse(section: &[u8], start: u64) -> Found {
    const BROKEN: &str = "its records do not add up";
    let mut summary = Summary::default();
    let mut rest = section;
    while !rest.is_empty() {
        let (opcode, length) = head_at(rest, 0).ok_or(BROKEN)?;
        let end = usize::try_from(length)
            .ok()
            .and_then(|n| n.checked_add(HEAD))
            .ok_or(BROKEN)?;
        let body = rest.get(HEAD..end).ok_or(BROKEN)?;
        rest = rest.get(end..).ok_or(BROKEN)?;
        match Record::parse(opcode, body).ok_or(BROKEN)? {
            Record::Schema(s) => {
                summary.definitions.schemas.insert(s.id, body.to_owned());
            }
            Record::Channel(c) => {
                summary.definitions.channels.insert(c.id, body.to_owned());
            }
            Record::Statistics(s) => summary.statistics = Some(s),
            Record::ChunkIndex(c) => {
                let end = c.chunk_start_offset.checked_add(c.chunk_length);
                if end.is_none_or(|end| end > start) {
                    return Err("it names a chunk outside the data");
                }
                *summary.chunks.entry(c.compression.to_owned()).or_default() += 1;
            }
            _ => {}
        }
    }
    Ok(Some(summary))
}
