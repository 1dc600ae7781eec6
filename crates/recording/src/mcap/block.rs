//! A block of the log -> its records, unpacked and checked. I/O (reads its own part of the file).
//!
//! A stage of its own because it is what worker threads do, each with its own buffers: read,
//! unpack within declared bounds, compare the CRC. Nothing of a chunk is used before its CRC holds.

mod bag;

use super::input::{LogFile, OwnedBytes, Stretch};
use crate::records::problem::ProblemKind;
use crate::records::transcript::Transcript;
use crate::records::{HEAD, head_at, op};
use std::io::{self, BufReader};
use std::sync::Arc;

/// Buffers larger than this are given back after use, so that one large chunk does not stay.
const KEEP: usize = 8 << 20;

/// Cost of a block that has no bytes.
const NEXT_TO_NOTHING: usize = 4 << 10;

/// Compression of a chunk.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Compression {
    /// Not at all.
    None,
    /// LZ4 frame.
    Lz4,
    /// Zstandard.
    Zstd,
    /// bzip2, in bags of ROS 1.
    Bzip2,
}

impl Compression {
    pub(super) fn named(name: &str) -> Option<Self> {
        match name {
            "" => Some(Compression::None),
            "lz4" => Some(Compression::Lz4),
            "zstd" => Some(Compression::Zstd),
            _ => None,
        }
    }

    /// Compression by its name in a bag.
    pub(super) fn of_bag(name: &str) -> Option<Self> {
        match name {
            "none" => Some(Compression::None),
            "lz4" => Some(Compression::Lz4),
            "bz2" => Some(Compression::Bzip2),
            _ => None,
        }
    }

    /// The name in summaries.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Compression::None => "none",
            Compression::Lz4 => "lz4",
            Compression::Zstd => "zstd",
            Compression::Bzip2 => "bz2",
        }
    }
}

/// A stretch of the log whose records are worked on together.
#[derive(Debug)]
pub(super) struct Block {
    /// Offset in the file.
    pub(super) offset: u64,
    pub(super) kind: Kind,
    pub(super) payload: Payload,
}

#[derive(Debug)]
pub(super) enum Kind {
    /// Unchunked records, one after another; their framing has been checked.
    Run,
    /// Contents of another container, as records.
    Transcript,
    /// A chunk of a bag of ROS 1, or one record of it.
    Bag {
        compression: Compression,
        /// Unpacked size as declared, within the limit.
        size: usize,
        /// The input ends within it.
        is_cut: bool,
        /// Messages in it by the index behind it.
        indexed: Option<u64>,
    },
    /// The body of one record that a copy takes along: header, attachment, metadata.
    Attached { opcode: u8 },
    /// A chunk that is not read, and its size if it were: what is looked ahead at is the same as if it were.
    PassedOver { size: usize },
    Chunk {
        compression: Compression,
        /// Unpacked size as declared, within the limit.
        size: usize,
        crc: u32,
        /// Messages in it by the index behind it.
        indexed: Option<u64>,
    },
}

#[derive(Debug)]
pub(super) enum Payload {
    /// Bytes in the file; read by whoever works on it.
    At {
        file: Arc<LogFile>,
        offset: u64,
        len: usize,
    },
    Held(OwnedBytes),
}

impl Block {
    /// Block of what another container holds from `offset` on, as records; `None` of none.
    pub(super) fn of_records(offset: u64, bytes: Vec<u8>) -> Option<Block> {
        let range = 0..bytes.len();
        (!bytes.is_empty()).then_some(Block {
            offset,
            kind: Kind::Transcript,
            payload: Payload::Held(OwnedBytes { bytes, range }),
        })
    }

    /// Memory it may take while it is worked on.
    pub(super) fn cost(&self) -> usize {
        let packed = match &self.payload {
            Payload::At { len, .. } => *len,
            Payload::Held(held) => held.bytes.capacity(),
        };
        match self.kind {
            Kind::Chunk {
                compression, size, ..
            } if compression != Compression::None => packed + size,
            // What is told of it is a copy.
            Kind::Bag { size, .. } => packed + size,
            Kind::PassedOver { .. } => NEXT_TO_NOTHING,
            _ => packed,
        }
    }

    /// Bytes of it as they lie in the file.
    pub(super) fn packed(&self) -> usize {
        match &self.payload {
            Payload::At { len, .. } => *len,
            Payload::Held(held) => held.range.len(),
        }
    }

    pub(super) fn indexed(&self) -> Option<u64> {
        match self.kind {
            Kind::Chunk { indexed, .. } | Kind::Bag { indexed, .. } => indexed,
            Kind::Run | Kind::Transcript | Kind::Attached { .. } | Kind::PassedOver { .. } => None,
        }
    }
}

/// Whether the CRC is over the bytes as they lie in the file.
fn plain_crc(kind: &Kind) -> bool {
    matches!(kind, Kind::Chunk { compression: Compression::None, crc, .. } if *crc != 0)
}

/// The buffers of one worker.
#[derive(Default)]
pub(super) struct Buffers {
    raw: Vec<u8>,
    plain: Vec<u8>,
    told: Transcript,
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl std::fmt::Debug for Buffers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Buffers({}, {})",
            self.raw.capacity(),
            self.plain.capacity()
        )
    }
}

/// Number of bytes read at a time: their CRC is taken while they are still in the cache.
const PIECE: usize = 128 << 10;

/// A slice of exactly `n` bytes of `buf`, which grows but is not shrunk or zeroed again.
fn room(buf: &mut Vec<u8>, n: usize) -> &mut [u8] {
    if buf.len() < n {
        // A fresh zeroed buffer, not `resize`: nothing of the old one is worth copying.
        *buf = vec![0; n];
    }
    buf.get_mut(..n).unwrap_or(&mut [])
}

/// Reads what lies at a place of a file, its CRC with it if that is wanted.
fn fetch(
    file: &LogFile,
    offset: u64,
    into: &mut [u8],
    mut crc: Option<&mut crc32fast::Hasher>,
) -> io::Result<Result<(), ProblemKind>> {
    let (need, mut have) = (into.len() as u64, 0);
    for piece in into.chunks_mut(PIECE) {
        let n = file.read_at(piece, offset + have)?;
        have += n as u64;
        if n < piece.len() {
            // The file was cut after the walk had seen its length.
            return Ok(Err(ProblemKind::Truncated { need, have }));
        }
        if let Some(crc) = &mut crc {
            crc.update(piece);
        }
    }
    Ok(Ok(()))
}

/// The records of a block, or why they cannot be used.
pub(super) type Opened<'a> = Result<&'a [u8], ProblemKind>;

impl Buffers {
    /// Reads, unpacks and checks a block.
    ///
    /// # Errors
    /// Only when the file itself cannot be read.
    pub(super) fn open<'a>(&'a mut self, block: &'a Block) -> io::Result<Opened<'a>> {
        let bag = match block.kind {
            Kind::Bag {
                compression,
                size,
                is_cut,
                ..
            } => Some((compression, size, is_cut)),
            _ => None,
        };
        self.told.bytes.clear();
        if let (Some(bag @ (Compression::None, ..)), Payload::At { file, offset, len }) =
            (bag, &block.payload)
        {
            let mut packed = BufReader::new(Stretch::of(file, *offset, *len));
            let told = bag::open((&mut packed, *len), bag, &mut self.plain, &mut self.told)?;
            return Ok(told.map(|()| self.told.bytes.as_slice()));
        }
        let mut seen = crc32fast::Hasher::new();
        let packed = match &block.payload {
            Payload::Held(held) => {
                let packed = held.as_slice();
                if plain_crc(&block.kind) {
                    seen.update(packed);
                }
                packed
            }
            Payload::At { file, offset, len } => {
                let raw = room(&mut self.raw, *len);
                let crc = plain_crc(&block.kind).then_some(&mut seen);
                if let Err(cut) = fetch(file, *offset, raw, crc)? {
                    return Ok(Err(cut));
                }
                raw
            }
        };
        if let Some(bag) = bag {
            let (mut bytes, length) = (packed, packed.len());
            let told = bag::open((&mut bytes, length), bag, &mut self.plain, &mut self.told)?;
            return Ok(told.map(|()| self.told.bytes.as_slice()));
        }
        let Kind::Chunk {
            compression,
            size,
            crc,
            ..
        } = block.kind
        else {
            return Ok(Ok(packed));
        };
        let unpacked = match compression {
            Compression::None if packed.len() == size => Ok(Unpacked::All(size)),
            Compression::None => {
                let (declared, actual) = (size as u64, packed.len() as u64);
                Err(ProblemKind::ChunkSize { declared, actual })
            }
            // No chunk of an MCAP is packed so.
            Compression::Bzip2 => {
                let name = compression.name().to_owned();
                Err(ProblemKind::UnknownCompression { name })
            }
            Compression::Lz4 | Compression::Zstd => {
                let plain = room(&mut self.plain, size);
                unpack(&mut self.zstd, compression, packed, plain, crc)
            }
        };
        let plain = match unpacked {
            Err(problem) => return Ok(Err(problem)),
            Ok(Unpacked::All(_)) if compression == Compression::None => packed,
            Ok(Unpacked::All(_)) => self.plain.get(..size).unwrap_or(&[]),
            // What follows the records says itself what it is.
            Ok(Unpacked::Records(end)) => return Ok(Ok(self.plain.get(..end).unwrap_or(&[]))),
        };
        if crc != 0 {
            let computed = match compression {
                Compression::None => seen.finalize(),
                _ => crc32fast::hash(plain),
            };
            if computed != crc {
                return Ok(Err(ProblemKind::ChunkCrc {
                    stored: crc,
                    computed,
                }));
            }
        }
        Ok(Ok(plain))
    }

    /// Lets go of what one large chunk needed.
    pub(super) fn trim(&mut self) {
        for buf in [&mut self.raw, &mut self.plain, &mut self.told.bytes] {
            if buf.capacity() > KEEP {
                *buf = Vec::new();
            }
        }
    }
}

/// Messages that a packed byte may stand for, and those that any chunk may have: two that differ in nothing but their
/// time take three bytes.
const MESSAGES_A_BYTE: usize = 4;
const MESSAGES_OF_ANY: usize = 64;
/// Bytes of the shortest message record of an MCAP, four of which a packed byte may stand for.
const LEAST_RECORD: usize = MESSAGES_A_BYTE * 31;

const TOO_MANY: &str = "it has more messages than so few bytes can tell apart";

/// Largest number of messages in a chunk of so many packed bytes.
pub(super) fn most_messages(packed: usize) -> usize {
    packed
        .saturating_mul(MESSAGES_A_BYTE)
        .saturating_add(MESSAGES_OF_ANY)
}

/// Whether there are more messages in a chunk than its packed bytes can tell apart: work for nothing, without end.
fn are_too_many(records: &[u8], packed: usize) -> bool {
    let mut left = most_messages(packed);
    let mut at = 0_usize;
    while let Some((opcode, length)) = head_at(records, at) {
        if opcode == op::MESSAGE {
            let Some(less) = left.checked_sub(1) else {
                return true;
            };
            left = less;
        }
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        at = (at + HEAD).saturating_add(length);
    }
    false
}

/// Bytes a packed one stands for from which on a chunk is looked at before it is unpacked: only zeros and the
/// like can be packed so.
const SUSPECT: usize = 1000;

/// Amount of a chunk that was unpacked.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Unpacked {
    /// All of it: so many bytes, or more than there is room for.
    All(usize),
    /// Records, up to and with the head of one with opcode 0, which none has.
    Records(usize),
}

/// Unpacks a chunk that is packed, whose size is that of `plain`.
fn unpack(
    context: &mut Option<zstd::bulk::Decompressor<'static>>,
    compression: Compression,
    packed: &[u8],
    plain: &mut [u8],
    crc: u32,
) -> Result<Unpacked, ProblemKind> {
    let size = plain.len();
    let unpacked = match compression {
        Compression::Lz4 => unlz4(packed, plain, crc).map(Unpacked::All),
        _ if (1..=size / SUSPECT).contains(&packed.len()) => unzstd_records(packed, plain),
        _ => unzstd(context, packed, plain).map(Unpacked::All),
    };
    match unpacked {
        Ok(Unpacked::All(n)) if n != size => {
            let (declared, actual) = (size as u64, n as u64);
            Err(ProblemKind::ChunkSize { declared, actual })
        }
        Ok(Unpacked::All(_))
            if packed.len() < size / LEAST_RECORD && are_too_many(plain, packed.len()) =>
        {
            let why = TOO_MANY.to_owned();
            Err(ProblemKind::Unpack { why })
        }
        Ok(unpacked) => Ok(unpacked),
        Err(e) => Err(ProblemKind::Unpack { why: e.to_string() }),
    }
}

/// Unpacks piece by piece, and no further than there are records. Of 2 kB of zeros, 64 MiB would be unpacked,
/// and none of them used.
fn unzstd_records(packed: &[u8], plain: &mut [u8]) -> io::Result<Unpacked> {
    let mut left = most_messages(packed.len());
    let mut decoder = zstd::stream::read::Decoder::with_buffer(packed)?;
    let (mut have, mut at) = (0, 0_usize);
    loop {
        let known = plain.get(..have).unwrap_or(&[]);
        while let Some((opcode, rest)) = known.get(at..).and_then(<[u8]>::split_first)
            && let Some(length) = rest.first_chunk()
        {
            if *opcode == 0 {
                return Ok(Unpacked::Records(at + HEAD));
            }
            if *opcode == op::MESSAGE {
                left = left
                    .checked_sub(1)
                    .ok_or_else(|| io::Error::other(TOO_MANY))?;
            }
            let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
            at = (at + HEAD).saturating_add(length);
        }
        let end = plain.len().min(have + PIECE);
        let Some(piece) = plain.get_mut(have..end).filter(|piece| !piece.is_empty()) else {
            // One byte more would be one too many.
            let more = io::Read::read(&mut decoder, &mut [0])?;
            return Ok(Unpacked::All(have + more));
        };
        match io::Read::read(&mut decoder, piece)? {
            0 => return Ok(Unpacked::All(have)),
            n => have += n,
        }
    }
}

fn unzstd(
    context: &mut Option<zstd::bulk::Decompressor<'static>>,
    packed: &[u8],
    plain: &mut [u8],
) -> io::Result<usize> {
    if packed.is_empty() {
        return Ok(0);
    }
    let context = match context {
        Some(context) => context,
        None => context.insert(zstd::bulk::Decompressor::new()?),
    };
    context.decompress_to_buffer(packed, plain)
}

fn unlz4(packed: &[u8], plain: &mut [u8], crc: u32) -> io::Result<usize> {
    if packed.is_empty() {
        return Ok(0);
    }
    if crc != 0
        && let Some(n) = super::lz4::unpack(packed, plain)
    {
        return Ok(n);
    }
    // No chunk CRC: the frame's own checksums are all there is, so they are checked.
    let mut frame = lz4_flex::frame::FrameDecoder::new(packed);
    let mut done = 0;
    while let Some(rest) = plain.get_mut(done..).filter(|r| !r.is_empty()) {
        match io::Read::read(&mut frame, rest)? {
            0 => return Ok(done),
            n => done += n,
        }
    }
    // One byte more would be one too many; this read also verifies the checksum at the end.
    match io::Read::read(&mut frame, &mut [0])? {
        0 => Ok(done),
        _ => Ok(done + 1),
    }
}

#[cfg(test)]
mod tests;
