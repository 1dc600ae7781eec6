//! Parquet: values of the footer, and of the heads of pages, in Thrift's compact protocol, whose lengths are right.

use super::{Changed, number, rearrange};
use crate::mutations::seeds;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A value of Thrift's compact protocol.
#[derive(Clone)]
enum Value {
    /// A truth value: its kind says which.
    Flag,
    Byte(u8),
    Whole(u64),
    Double([u8; 8]),
    Bytes(Vec<u8>),
    List(u8, Vec<Value>),
    Fields(Vec<(u8, u64, Value)>),
}

fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (byte, behind) = rest.split_first()?;
        *rest = behind;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

fn put_varint(mut n: u64, out: &mut Vec<u8>) {
    while n > 0x7f {
        out.push(n as u8 | 0x80);
        n >>= 7;
    }
    out.push(n as u8);
}

fn take<'b>(rest: &mut &'b [u8], n: usize) -> Option<&'b [u8]> {
    let (own, behind) = rest.split_at_checked(n)?;
    *rest = behind;
    Some(own)
}

fn value(kind: u8, rest: &mut &[u8], in_list: bool) -> Option<Value> {
    Some(match kind {
        1 | 2 if in_list => Value::Byte(take(rest, 1)?[0]),
        1 | 2 => Value::Flag,
        3 => Value::Byte(take(rest, 1)?[0]),
        4..=6 => Value::Whole(varint(rest)?),
        7 => Value::Double(take(rest, 8)?.try_into().ok()?),
        8 => {
            let length = varint(rest)? as usize;
            Value::Bytes(take(rest, length)?.to_vec())
        }
        9 | 10 => {
            let head = take(rest, 1)?[0];
            let count = match head >> 4 {
                15 => varint(rest)?,
                few => u64::from(few),
            };
            let all = (0..count).map(|_| value(head & 15, rest, true));
            Value::List(head & 15, all.collect::<Option<_>>()?)
        }
        12 => {
            let mut fields = Vec::new();
            let mut id = 0;
            loop {
                let head = take(rest, 1)?[0];
                if head == 0 {
                    return Some(Value::Fields(fields));
                }
                id = match head >> 4 {
                    // Zigzag.
                    0 => varint(rest)? >> 1,
                    step => id + u64::from(step),
                };
                fields.push((head & 15, id, value(head & 15, rest, false)?));
            }
        }
        _ => return None,
    })
}

fn put(value: &Value, out: &mut Vec<u8>) {
    match value {
        Value::Flag => {}
        Value::Byte(byte) => out.push(*byte),
        Value::Whole(n) => put_varint(*n, out),
        Value::Double(bytes) => out.extend(bytes),
        Value::Bytes(bytes) => {
            put_varint(bytes.len() as u64, out);
            out.extend(bytes);
        }
        Value::List(kind, all) => {
            out.push(0xf0 | kind);
            put_varint(all.len() as u64, out);
            all.iter().for_each(|value| put(value, out));
        }
        Value::Fields(fields) => {
            for (kind, id, value) in fields {
                out.push(*kind);
                put_varint(id << 1, out);
                put(value, out);
            }
            out.push(0);
        }
    }
}

fn change(value: &mut Value, rng: &mut ChaCha8Rng) {
    match value {
        Value::Flag => {}
        Value::Byte(byte) => *byte = number(u64::from(*byte), rng) as u8,
        Value::Whole(n) => *n = number(*n, rng),
        Value::Double(bytes) => *bytes = rng.random(),
        Value::Bytes(bytes) => super::scribble(bytes, rng),
        Value::List(_, all) => match rng.random_range(0..8) {
            0 => rearrange(all, rng),
            _ if all.is_empty() => {}
            _ => {
                let at = rng.random_range(0..all.len());
                change(&mut all[at], rng);
            }
        },
        Value::Fields(fields) => match rng.random_range(0..12) {
            0 => rearrange(fields, rng),
            _ if fields.is_empty() => {}
            _ => {
                let at = rng.random_range(0..fields.len());
                change(&mut fields[at].2, rng);
            }
        },
    }
}

/// A file apart: what is before its footer, and that.
fn parse(bytes: &[u8]) -> Option<(Vec<u8>, Value)> {
    let size: [u8; 4] = bytes[bytes.len() - 8..][..4].try_into().ok()?;
    let begin = bytes.len() - 8 - u32::from_le_bytes(size) as usize;
    let footer = value(12, &mut &bytes[begin..bytes.len() - 8], false)?;
    Some((bytes[..begin].to_vec(), footer))
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let seeds = seeds("parquet");
    let files: Vec<_> = seeds.iter().filter_map(|bytes| parse(bytes)).collect();
    assert!(files.len() > 10);
    Box::new(move |rng| {
        let (mut pages, mut footer) = files[rng.random_range(0..files.len())].clone();
        for _ in 0..rng.random_range(1..5) {
            change(&mut footer, rng);
        }
        if rng.random_range(0..3) == 0 {
            // The head of a page stands at the beginning, and where dictionaries end.
            let mut rest = &pages[4..];
            if let Some(mut head) = value(12, &mut rest, false) {
                change(&mut head, rng);
                let mut changed = pages[..4].to_vec();
                put(&head, &mut changed);
                changed.extend(rest);
                pages = changed;
            }
        }
        let mut out = pages;
        let begin = out.len();
        put(&footer, &mut out);
        let size = (out.len() - begin) as u32;
        out.extend(size.to_le_bytes());
        out.extend(b"PAR1");
        out.into()
    })
}
