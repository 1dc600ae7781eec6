//! A chunk of a ROS 1 bag -> the records MCAP has for it. I/O (reads what its caller has).
//!
//! Apart because it is told as it is unpacked: what is held is one record and what is told, and it ends where records
//! do.

use super::{Compression, PIECE, TOO_MANY, most_messages};
use crate::bag;
use crate::records::problem::ProblemKind;
use crate::records::transcript::Transcript;
use std::io::{self, BufRead, Read};

/// Bytes in the largest block of a bzip2 stream of each level.
const BZIP2_LEVEL: usize = 100_000;
/// Bytes of a block of bzip2 that a packed one may stand for. Runs of one byte were shortened before, so that an
/// image of one colour is far below it.
const BZIP2_BLOCK: usize = 1000;

/// Unpacks a chunk of `length` packed bytes no further than there are records, and tells them. The outer error is the
/// input's.
pub(super) fn open(
    (mut packed, length): (&mut dyn BufRead, usize),
    (compression, size, is_cut): (Compression, usize, bool),
    plain: &mut Vec<u8>,
    told: &mut Transcript,
) -> io::Result<Result<(), ProblemKind>> {
    let mut lz4;
    let mut bzip2;
    let is_packed = matches!(compression, Compression::Lz4 | Compression::Bzip2);
    if !is_packed && length != size && !is_cut {
        let (declared, actual) = (size as u64, length as u64);
        return Ok(Err(ProblemKind::ChunkSize { declared, actual }));
    }
    let size = if is_packed { size } else { length };
    let mut head = [0; 4];
    let decoder: &mut dyn Read = match compression {
        Compression::Lz4 => {
            lz4 = lz4_flex::frame::FrameDecoder::new(packed);
            &mut lz4
        }
        Compression::Bzip2 => {
            let have = fill(&mut packed, &mut head)?;
            if let [b'B', b'Z', b'h', level @ b'1'..=b'9'] = &mut head {
                // A block takes the time of its level whatever it is packed in: no more is granted than can be of use.
                let most = length.saturating_mul(BZIP2_BLOCK).min(size + size / 4);
                let needed = (most / BZIP2_LEVEL + 1).min(9) as u8;
                *level = (*level).min(b'0' + needed);
            }
            let head = head.get(..have).unwrap_or(&[]);
            bzip2 = bzip2::bufread::BzDecoder::new(head.chain(packed));
            &mut bzip2
        }
        Compression::None | Compression::Zstd => &mut packed,
    };
    let mut left = if is_packed {
        most_messages(length)
    } else {
        usize::MAX
    };
    plain.clear();
    let (mut have, mut is_end) = (0, false);
    while !is_end {
        let mut at = 0;
        let is_none = loop {
            match bag::next_record(plain, at) {
                Ok(end) => at = end,
                Err(is_none) => break is_none,
            }
            let Some(less) = left.checked_sub(1) else {
                let why = TOO_MANY.to_owned();
                return Ok(Err(ProblemKind::Unpack { why }));
            };
            left = less;
        };
        bag::transcribe(plain.get(..at).unwrap_or(&[]), is_cut, told);
        plain.drain(..at);
        if is_none && !plain.is_empty() {
            // Nothing behind this can be a record: of 2 kB of zeros, 64 MiB would be unpacked.
            if !is_packed && !is_cut {
                told.broken((plain.len() + size.saturating_sub(have)) as u64);
                return Ok(Ok(()));
            }
            break;
        }
        // One byte more would be one too many; this also verifies what checksum there is at the end.
        let more = PIECE.min((size - have).max(1));
        let begin = plain.len();
        plain.resize(begin + more, 0);
        let read = decoder.read(plain.get_mut(begin..).unwrap_or(&mut []));
        let n = *read.as_ref().unwrap_or(&0);
        plain.truncate(begin + n.min(size - have));
        match read {
            Ok(_) => {
                have += n;
                is_end = n == 0 || have > size;
            }
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(_) if is_cut => break,
            Err(e) if !is_packed => return Err(e),
            Err(e) => return Ok(Err(ProblemKind::Unpack { why: e.to_string() })),
        }
    }
    if is_end && have != size && !is_cut {
        let (declared, actual) = (size as u64, have as u64);
        return Ok(Err(ProblemKind::ChunkSize { declared, actual }));
    }
    bag::transcribe(plain, is_cut, told);
    Ok(Ok(()))
}

/// Fills `into` as far as there are bytes; how many.
fn fill(from: &mut dyn BufRead, into: &mut [u8]) -> io::Result<usize> {
    let mut have = 0;
    while let Some(rest) = into.get_mut(have..).filter(|rest| !rest.is_empty()) {
        match from.read(rest) {
            Ok(0) => break,
            Ok(n) => have += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(have)
}
