//! Message records -> one compressed, indexed chunk. Pure.

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::io::{self, Write};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::mcap::{ChunkHead, Entries, MessageIndex, MessageRecord};

/// Compression of chunks.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Compression {
    /// Not at all.
    None,
    /// LZ4 frames: faster than zstd to read, larger.
    Lz4,
    /// Zstandard, level 1: level 3 takes half as long again and saves nothing on these messages.
    #[default]
    Zstd,
}

impl Compression {
    /// The name in the file and on the command line; MCAP writes "none" as nothing.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Compression::None => "none",
            Compression::Lz4 => "lz4",
            Compression::Zstd => "zstd",
        }
    }

    pub(super) fn in_file(self) -> &'static str {
        match self {
            Compression::None => "",
            other => other.name(),
        }
    }
}

impl std::str::FromStr for Compression {
    type Err = Error;
    fn from_str(text: &str) -> Result<Compression> {
        [Compression::None, Compression::Lz4, Compression::Zstd]
            .into_iter()
            .find(|c| c.name() == text)
            .ok_or_else(|| {
                Error::usage(
                    Diagnostic::new(format!("unknown compression `{text}`"))
                        .help("none, lz4 or zstd"),
                )
            })
    }
}

/// The level of zstd: see [`Compression::Zstd`].
const ZSTD_LEVEL: i32 = 1;

/// Place of the messages of one channel within the chunk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lane(usize);

/// A chunk being filled, then sealed. Buffers and the compressor are kept for the next one.
#[derive(Default)]
pub(in crate::sink) struct Chunk {
    pub(super) plain: Vec<u8>,
    lanes: BTreeMap<u16, usize>,
    /// Message index entries, as they go into the file: log time, offset; both u64.
    entries: Vec<Vec<u8>>,
    times: Option<(u64, u64)>,
    pub(in crate::sink) stamps_out_of_range: u64,
    zstd: Option<zstd::bulk::Compressor<'static>>,
    sealed: Sealed,
}

/// Bytes that a sealed chunk puts into the file.
#[derive(Default)]
pub(super) struct Sealed {
    /// The chunk record up to its data.
    pub(super) head: Vec<u8>,
    /// The data, packed; empty when they are stored as they are.
    packed: Vec<u8>,
    stored: bool,
    /// The message index records behind it.
    pub(super) tail: Vec<u8>,
    /// Channel, offset of its message index within `tail`, messages.
    pub(super) index: Vec<(u16, u64, u64)>,
}

/// Buffers larger than this are not kept: one copied message may have been 64 MiB.
const KEEP_BYTES: usize = 4 << 20;

impl Chunk {
    /// Empties it, keeping the memory.
    pub(in crate::sink) fn clear(&mut self) {
        for buffer in [&mut self.plain, &mut self.sealed.packed] {
            buffer.clear();
            buffer.shrink_to(KEEP_BYTES);
        }
        self.lanes.clear();
        self.entries.clear();
        self.times = None;
        self.stamps_out_of_range = 0;
        self.sealed.index.clear();
    }

    pub(in crate::sink) fn is_empty(&self) -> bool {
        self.plain.is_empty()
    }

    /// Uncompressed bytes so far.
    pub(in crate::sink) fn plain_len(&self) -> usize {
        self.plain.len()
    }

    /// The lane of a channel, made when it has none yet.
    pub(super) fn lane(&mut self, channel: u16) -> Lane {
        let next = self.entries.len();
        let lane = *self.lanes.entry(channel).or_insert(next);
        if lane == next {
            self.entries.push(Vec::new());
        }
        Lane(lane)
    }

    /// Notes that the message record about to be appended to `plain` is of this lane.
    pub(super) fn note(&mut self, lane: Lane, log_time: u64) {
        let mut entry = [0; Entries::LEN];
        entry[..8].copy_from_slice(&log_time.to_le_bytes());
        entry[8..].copy_from_slice(&(self.plain.len() as u64).to_le_bytes());
        self.entries[lane.0].extend_from_slice(&entry);
        self.times = Some(match self.times {
            Some((first, last)) => (first.min(log_time), last.max(log_time)),
            None => (log_time, log_time),
        });
    }

    /// Appends a whole message.
    pub(super) fn push(
        &mut self,
        channel: u16,
        sequence: u32,
        log_time: u64,
        publish_time: u64,
        data: &[u8],
    ) {
        let lane = self.lane(channel);
        self.note(lane, log_time);
        let head = MessageRecord::head(channel, sequence, (log_time, publish_time), data.len());
        self.plain.extend_from_slice(&head);
        self.plain.extend_from_slice(data);
    }

    /// Compresses, checks and indexes what has been pushed.
    ///
    /// # Errors
    /// The compressor's own, which means that memory ran out.
    pub(in crate::sink) fn seal(&mut self, compression: Compression) -> io::Result<()> {
        let sealed = &mut self.sealed;
        sealed.stored = compression == Compression::None;
        match compression {
            Compression::None => {}
            Compression::Lz4 => {
                sealed.packed.clear();
                let packed = std::mem::take(&mut sealed.packed);
                let mut encoder = lz4_flex::frame::FrameEncoder::new(packed);
                encoder.write_all(&self.plain)?;
                sealed.packed = encoder.finish().map_err(io::Error::other)?;
            }
            Compression::Zstd => {
                if self.zstd.is_none() {
                    self.zstd = Some(zstd::bulk::Compressor::new(ZSTD_LEVEL)?);
                }
                if let Some(zstd) = &mut self.zstd {
                    sealed.packed.clear();
                    sealed
                        .packed
                        .reserve(zstd::zstd_safe::compress_bound(self.plain.len()));
                    zstd.compress_to_buffer(&self.plain, &mut sealed.packed)?;
                }
            }
        }
        let stored_len = if sealed.stored {
            self.plain.len()
        } else {
            sealed.packed.len()
        };

        sealed.tail.clear();
        sealed.index.clear();
        for (channel, lane) in &self.lanes {
            let entries = &self.entries[*lane];
            let messages = (entries.len() / Entries::LEN) as u64;
            sealed
                .index
                .push((*channel, sealed.tail.len() as u64, messages));
            let index = MessageIndex {
                channel_id: *channel,
                entries: Entries(entries),
            };
            index.push(&mut sealed.tail);
        }

        let (start, end) = self.times.unwrap_or_default();
        sealed.head.clear();
        let head = ChunkHead {
            message_start_time: start,
            message_end_time: end,
            uncompressed_size: self.plain.len() as u64,
            uncompressed_crc: crc32fast::hash(&self.plain),
            compression: compression.in_file(),
            compressed_size: stored_len as u64,
        };
        // The record goes on with the data: its length counts them.
        head.push_with(stored_len as u64, &mut sealed.head);
        Ok(())
    }

    /// The parts to be written, in order.
    pub(in crate::sink) fn parts(&self) -> [&[u8]; 3] {
        let data = if self.sealed.stored {
            &self.plain
        } else {
            &self.sealed.packed
        };
        [&self.sealed.head, data, &self.sealed.tail]
    }

    pub(super) fn sealed(&self) -> &Sealed {
        &self.sealed
    }

    pub(super) fn times(&self) -> (u64, u64) {
        self.times.unwrap_or_default()
    }
}

impl std::fmt::Debug for Chunk {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Chunk")
            .field("plain_bytes", &self.plain.len())
            .field("channels", &self.lanes.len())
            .finish_non_exhaustive()
    }
}
