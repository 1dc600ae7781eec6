//! GoPro's telemetry, in a video and alone: boxes and items whose sizes are right.

use super::{Changed, fixture, number, rearrange, renumber_big, scribble};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A box of a video: its kind, and what is in it.
#[derive(Clone)]
struct Part {
    kind: [u8; 4],
    bytes: Vec<u8>,
    inner: Vec<Part>,
}

fn leaf(kind: &[u8; 4], words: &[u32]) -> Part {
    Part {
        kind: *kind,
        bytes: words.iter().flat_map(|word| word.to_be_bytes()).collect(),
        inner: Vec::new(),
    }
}

fn above(kind: &[u8; 4], inner: Vec<Part>) -> Part {
    Part {
        kind: *kind,
        bytes: Vec::new(),
        inner,
    }
}

fn written(parts: &[Part], out: &mut Vec<u8>) {
    for part in parts {
        let at = out.len();
        out.extend([0; 4]);
        out.extend(part.kind);
        out.extend(&part.bytes);
        written(&part.inner, out);
        let length = (out.len() - at) as u32;
        out[at..at + 4].copy_from_slice(&length.to_be_bytes());
    }
}

/// A video of one track of these payloads, one in each run.
fn video(payloads: &[Vec<u8>]) -> Vec<Part> {
    let count = payloads.len() as u32;
    let mut data = above(b"mdat", Vec::new());
    let mut places = vec![0, count];
    for payload in payloads {
        // Behind the first box and the head of this.
        places.push((20 + 8 + data.bytes.len()) as u32);
        data.bytes.extend(payload);
    }
    let sizes = payloads.iter().map(|payload| payload.len() as u32);
    let sizes: Vec<u32> = [0, 0, count].into_iter().chain(sizes).collect();
    let mut kind = leaf(b"stsd", &[0, 1, 16]);
    kind.bytes.extend(b"gpmd");
    kind.bytes.extend([0; 8]);
    let tables = vec![
        kind,
        leaf(b"stts", &[0, 1, count, 1001]),
        leaf(b"stsc", &[0, 1, 1, 1, 1]),
        leaf(b"stsz", &sizes),
        leaf(b"stco", &places),
    ];
    let clock = [0, 3_800_000_000, 3_800_000_000, 1000, count * 1001, 0];
    let media = vec![
        leaf(b"mdhd", &clock),
        above(b"minf", vec![above(b"stbl", tables)]),
    ];
    let track = vec![leaf(b"tkhd", &[0; 21]), above(b"mdia", media)];
    let index = vec![leaf(b"mvhd", &clock), above(b"trak", track)];
    let mut first = leaf(b"ftyp", &[0, 0, 0]);
    first.bytes[..4].copy_from_slice(b"mp41");
    first.bytes[8..].copy_from_slice(b"mp41");
    vec![first, data, above(b"moov", index)]
}

fn change_parts(parts: &mut Vec<Part>, rng: &mut ChaCha8Rng) {
    if parts.is_empty() {
        return;
    }
    let at = rng.random_range(0..parts.len());
    let part = &mut parts[at];
    match rng.random_range(0..12) {
        0 => rearrange(parts, rng),
        1 => {
            part.kind =
                *[b"stco", b"co64", b"stsz", b"moov", b"free", b"trak"][rng.random_range(0..6)]
        }
        2 => scribble(&mut part.bytes, rng),
        3..=9 if !part.inner.is_empty() => change_parts(&mut part.inner, rng),
        _ => {
            let words = part.bytes.len().min(400) / 4;
            renumber_big(&mut part.bytes, 4 * rng.random_range(0..words + 1), 4, rng);
        }
    }
}

/// An item of telemetry.
#[derive(Clone)]
struct Item {
    key: [u8; 4],
    kind: u8,
    size: u8,
    bytes: Vec<u8>,
    inner: Vec<Item>,
}

fn items(bytes: &[u8]) -> Vec<Item> {
    let mut rest = bytes;
    let mut found = Vec::new();
    while let Some((head, behind)) = rest.split_first_chunk::<8>() {
        let count = usize::from(u16::from_be_bytes([head[6], head[7]]));
        let length = usize::from(head[5]) * count;
        let Some(own) = behind.get(..length) else {
            break;
        };
        let nested = head[4] == 0;
        found.push(Item {
            key: *head.first_chunk().unwrap(),
            kind: head[4],
            size: head[5],
            bytes: if nested { Vec::new() } else { own.to_vec() },
            inner: if nested { items(own) } else { Vec::new() },
        });
        rest = behind.get(length.next_multiple_of(4)..).unwrap_or(&[]);
    }
    found
}

fn told(items: &[Item], out: &mut Vec<u8>) {
    for item in items {
        let mut own = item.bytes.clone();
        told(&item.inner, &mut own);
        // As far as its count can say.
        let size = usize::from(item.size.max(1));
        let mut size = size;
        if own.len() / size > 65_535 {
            size = 255;
        }
        let count = (own.len() / size).min(65_535);
        own.truncate(count * size);
        out.extend(item.key);
        out.extend([item.kind, size as u8]);
        out.extend((count as u16).to_be_bytes());
        own.resize(own.len().next_multiple_of(4), 0);
        out.extend(own);
    }
}

fn change_items(items: &mut Vec<Item>, rng: &mut ChaCha8Rng) {
    if items.is_empty() {
        return;
    }
    let at = rng.random_range(0..items.len());
    let item = &mut items[at];
    match rng.random_range(0..12) {
        0 => rearrange(items, rng),
        1 => item.kind = b"\0bBcdfFGjJlLqQsSUx?"[rng.random_range(0..19)],
        2 => item.size = number(u64::from(item.size), rng) as u8,
        3 => {
            item.key = *[
                b"DEVC", b"STRM", b"GYRO", b"ACCL", b"SCAL", b"STMP", b"TICK",
            ][rng.random_range(0..7)]
        }
        4 => scribble(&mut item.bytes, rng),
        5..=10 if !item.inner.is_empty() => change_items(&mut item.inner, rng),
        _ => {
            let width = [1, 2, 4, 8][rng.random_range(0..4)];
            renumber_big(&mut item.bytes, 0, width, rng);
        }
    }
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let payloads = ["gopro_hero6.raw", "gopro_fusion.raw"].map(|name| items(&fixture(name)));
    Box::new(move |rng| {
        let whole = &payloads[rng.random_range(0..payloads.len())];
        let mut told_all = Vec::new();
        for _ in 0..rng.random_range(1..4) {
            let mut changed = whole.clone();
            for _ in 0..rng.random_range(0..4) {
                change_items(&mut changed, rng);
            }
            let mut payload = Vec::new();
            told(&changed, &mut payload);
            told_all.push(payload);
        }
        if rng.random_range(0..3) == 0 {
            return told_all.concat().into();
        }
        let mut parts = video(&told_all);
        for _ in 0..rng.random_range(0..4) {
            change_parts(&mut parts, rng);
        }
        let mut out = Vec::new();
        written(&parts, &mut out);
        out.into()
    })
}
