//! ROS 1 bags: fields of heads, records in chunks, and indices, whose sizes are right.

use super::{Changed, fixture, number, rearrange, scribble};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
const CHUNK: u8 = 5;

#[derive(Clone)]
struct Record {
    /// Names and values.
    fields: Vec<(Vec<u8>, Vec<u8>)>,
    data: Vec<u8>,
    /// The records of a chunk, instead of its data.
    inner: Vec<Record>,
}

impl Record {
    fn op(&self) -> u8 {
        let op = self.fields.iter().find(|(name, _)| name == b"op");
        op.and_then(|(_, value)| value.first().copied())
            .unwrap_or(0)
    }
}

fn sized(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

fn parse(bytes: &[u8]) -> Vec<Record> {
    let mut rest = bytes;
    let mut records = Vec::new();
    while let Some((head, behind)) = sized(rest)
        && let Some((data, behind)) = sized(behind)
    {
        rest = behind;
        let (mut left, mut fields) = (head, Vec::new());
        while let Some((field, behind)) = sized(left) {
            left = behind;
            let at = field.iter().position(|b| *b == b'=').unwrap();
            fields.push((field[..at].to_vec(), field[at + 1..].to_vec()));
        }
        let mut record = Record {
            fields,
            data: data.to_vec(),
            inner: Vec::new(),
        };
        if record.op() == CHUNK {
            record.inner = parse(&std::mem::take(&mut record.data));
        }
        records.push(record);
    }
    records
}

fn written(records: &[Record], is_packed: bool) -> Vec<u8> {
    let mut out = Vec::new();
    for record in records {
        let (mut fields, mut data) = (record.fields.clone(), record.data.clone());
        if record.op() == CHUNK {
            data = written(&record.inner, false);
            let size = (data.len() as u32).to_le_bytes();
            for (name, value) in &mut fields {
                match name.as_slice() {
                    b"size" => *value = size.to_vec(),
                    b"compression" if is_packed => *value = b"lz4".to_vec(),
                    _ => {}
                }
            }
            if is_packed {
                (_, data) = super::super::commands::packed(&data, 2);
            }
        }
        let mut head = Vec::new();
        for (name, value) in &fields {
            head.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
            head.extend(name);
            head.push(b'=');
            head.extend(value);
        }
        out.extend((head.len() as u32).to_le_bytes());
        out.extend(head);
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(data);
    }
    out
}

fn change(records: &mut Vec<Record>, rng: &mut ChaCha8Rng) {
    if records.is_empty() {
        return;
    }
    let at = rng.random_range(0..records.len());
    let record = &mut records[at];
    match rng.random_range(0..8) {
        0 => rearrange(records, rng),
        1 => scribble(&mut record.data, rng),
        2 => rearrange(&mut record.fields, rng),
        3..=5 if !record.inner.is_empty() => change(&mut record.inner, rng),
        _ if !record.fields.is_empty() => {
            let which = rng.random_range(0..record.fields.len());
            let value = &mut record.fields[which].1;
            match value.len() {
                width @ 1..=8 => super::renumber(value, 0, width, rng),
                _ => scribble(value, rng),
            }
            if rng.random_range(0..20) == 0 {
                value.resize(number(value.len() as u64, rng) as usize % 70_000, b'x');
            }
        }
        _ => {}
    }
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let whole = fixture("constant_rate_none.bag");
    let mut records = parse(&whole[MAGIC.len()..]);
    // A few messages of each chunk show all that many do.
    for record in &mut records {
        record.inner.truncate(20);
    }
    // What fills the bag's own record up shows nothing.
    records[0].data.truncate(16);
    Box::new(move |rng| {
        let mut records = records.clone();
        for _ in 0..rng.random_range(1..5) {
            change(&mut records, rng);
        }
        [MAGIC, &written(&records, rng.random())].concat().into()
    })
}
