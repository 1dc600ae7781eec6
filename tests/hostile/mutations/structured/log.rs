//! MCAP: records whose lengths are right, in chunks whose sizes and checksums are, before a footer whose checksum is.

use super::{Changed, number, rearrange, renumber, scribble};
use crate::made_logs::{bytes, logged, motion};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use strapd_recording::mcap::{MAGIC, op};

#[derive(Clone)]
struct Record {
    opcode: u8,
    body: Vec<u8>,
    /// The records of a chunk, instead of the end of its body.
    inner: Vec<Record>,
}

/// Bytes of a chunk's body before the size of its records.
const CHUNK_HEAD: usize = 16;

fn parse(bytes: &[u8]) -> Vec<Record> {
    let mut rest = bytes;
    let mut records = Vec::new();
    while let Some((head, behind)) = rest.split_first_chunk::<9>() {
        let length = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        let Some((body, behind)) = behind.split_at_checked(length) else {
            break;
        };
        rest = behind;
        let (mut body, mut inner) = (body.to_vec(), Vec::new());
        if head[0] == op::CHUNK {
            // They are not packed.
            inner = parse(&body[CHUNK_HEAD + 8 + 4 + 4 + 8..]);
            body.truncate(CHUNK_HEAD);
        }
        let opcode = head[0];
        records.push(Record {
            opcode,
            body,
            inner,
        });
    }
    records
}

fn put(out: &mut Vec<u8>, opcode: u8, body: &[u8]) {
    out.push(opcode);
    out.extend((body.len() as u64).to_le_bytes());
    out.extend(body);
}

fn chunk(record: &Record, packing: usize) -> Vec<u8> {
    let mut plain = Vec::new();
    for inner in &record.inner {
        put(&mut plain, inner.opcode, &inner.body);
    }
    let (name, packed) = super::super::commands::packed(&plain, packing);
    let mut body = record.body.clone();
    body.extend((plain.len() as u64).to_le_bytes());
    body.extend(crc32fast::hash(&plain).to_le_bytes());
    body.extend((name.len() as u32).to_le_bytes());
    body.extend(name.as_bytes());
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    body
}

/// The log, its footer saying where the summary is, and checksums of data and summary.
fn written(records: &[Record], packing: usize) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    let mut summary = 0;
    for record in records {
        match record.opcode {
            op::CHUNK => {
                let body = chunk(record, packing);
                put(&mut out, op::CHUNK, &body);
            }
            op::DATA_END => {
                let crc = crc32fast::hash(&out);
                put(&mut out, op::DATA_END, &crc.to_le_bytes());
                summary = out.len();
            }
            op::FOOTER => {
                let mut body = record.body.clone();
                body.resize(20, 0);
                body[..8].copy_from_slice(&(summary as u64).to_le_bytes());
                let begin = out.len();
                put(&mut out, op::FOOTER, &body);
                let crc = crc32fast::hash(&out[summary.min(begin)..begin + 9 + 16]);
                let end = out.len();
                out[end - 4..].copy_from_slice(&crc.to_le_bytes());
            }
            opcode => put(&mut out, opcode, &record.body),
        }
    }
    out.extend(MAGIC);
    out
}

/// A field of a record of this kind: where, and of how many bytes.
fn field(opcode: u8, rng: &mut ChaCha8Rng) -> (usize, usize) {
    let fields: &[(usize, usize)] = match opcode {
        op::MESSAGE => &[(0, 2), (2, 4), (6, 8), (14, 8), (22, 4), (26, 4)],
        op::CHANNEL => &[(0, 2), (2, 2), (4, 4)],
        op::SCHEMA => &[(0, 2), (2, 4)],
        op::CHUNK => &[(0, 8), (8, 8)],
        op::CHUNK_INDEX => &[(0, 8), (8, 8), (16, 8), (24, 8), (32, 4)],
        op::MESSAGE_INDEX => &[(0, 2), (2, 4), (6, 8), (14, 8)],
        op::STATISTICS => &[
            (0, 8),
            (8, 2),
            (10, 4),
            (14, 4),
            (18, 4),
            (22, 4),
            (26, 8),
            (34, 8),
        ],
        op::FOOTER => &[(8, 8)],
        _ => &[(0, 1), (0, 4), (0, 8)],
    };
    fields[rng.random_range(0..fields.len())]
}

fn change(records: &mut Vec<Record>, rng: &mut ChaCha8Rng) {
    if records.is_empty() {
        return;
    }
    let at = rng.random_range(0..records.len());
    match rng.random_range(0..8) {
        0 => rearrange(records, rng),
        1 => records[at].opcode = number(u64::from(records[at].opcode), rng) as u8,
        2 => scribble(&mut records[at].body, rng),
        3 | 4 if !records[at].inner.is_empty() => change(&mut records[at].inner, rng),
        _ => {
            let (place, width) = field(records[at].opcode, rng);
            renumber(&mut records[at].body, place, width, rng);
        }
    }
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let samples = motion(60);
    let mut two = logged("/imu/data_raw", &samples);
    two.extend(logged("/other", &samples[..30]));
    let logs = [
        parse(&bytes(Some(None), 4096, &two)[MAGIC.len()..]),
        parse(&bytes(None, 0, &two)[MAGIC.len()..]),
    ];
    Box::new(move |rng| {
        let mut records = logs[rng.random_range(0..logs.len())].clone();
        for _ in 0..rng.random_range(1..5) {
            change(&mut records, rng);
        }
        written(&records, rng.random_range(0..3)).into()
    })
}
