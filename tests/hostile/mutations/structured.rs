//! Recordings changed as their formats know them: lengths, sizes and checksums are right, and what they guard is not. A
//! change of a byte ends at the first checksum; one of these ends where a reader believes it.

mod bag;
mod columns;
mod database;
mod link;
mod log;
mod text;
mod ulog;
mod video;

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

/// A changed recording, and the file `-wal` beside it.
#[derive(Debug, Default)]
pub(super) struct Changed {
    pub(super) bytes: Vec<u8>,
    pub(super) wal: Option<Vec<u8>>,
}

impl From<Vec<u8>> for Changed {
    fn from(bytes: Vec<u8>) -> Changed {
        Changed { bytes, wal: None }
    }
}

/// The name of a format, and what changes its recordings.
type Format = (&'static str, Box<dyn Fn(&mut ChaCha8Rng) -> Changed>);

/// Every format, each with recordings of its own.
pub(super) struct Formats(Vec<Format>);

impl Formats {
    pub(super) fn new() -> Formats {
        Formats(vec![
            ("mcap", log::changes()),
            ("bag", bag::changes()),
            ("db3", database::changes()),
            ("ulog", ulog::changes()),
            ("tlog", link::changes()),
            ("gpmf", video::changes()),
            ("parquet", columns::changes()),
            ("text", text::changes()),
        ])
    }

    /// A changed recording of the format whose turn it is, or of the one that is asked for.
    pub(super) fn change(&self, nth: usize, rng: &mut ChaCha8Rng) -> Changed {
        let asked = std::env::var("STRAPD_MUTANTS_OF").ok();
        let of = |name: &String| self.0.iter().position(|(known, _)| known == name);
        let nth = asked.as_ref().and_then(of).unwrap_or(nth % self.0.len());
        loop {
            let changed = self.0[nth].1(rng);
            if changed.bytes.len() <= MOST {
                return changed;
            }
        }
    }
}

/// Bytes of a changed recording: what is repeated in what is repeated would be work by its size alone.
const MOST: usize = 256 << 10;

fn fixture(name: &str) -> Vec<u8> {
    let fixtures = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    std::fs::read(fixtures.join(name)).unwrap()
}

/// Another number instead of one: its neighbours, the ends of every width, or any.
fn number(was: u64, rng: &mut ChaCha8Rng) -> u64 {
    match rng.random_range(0..9) {
        0 => 0,
        1 => was.wrapping_add(1),
        2 => was.wrapping_sub(1),
        3 => u64::MAX >> rng.random_range(0..64),
        4 => 1 << rng.random_range(0..64),
        5 => was.wrapping_mul(rng.random_range(2..1000)),
        6 => was ^ 1 << rng.random_range(0..64),
        7 => rng.random_range(0..64),
        _ => rng.random(),
    }
}

/// Another number instead of that of `width` bytes at a place, the least first.
fn renumber(bytes: &mut [u8], at: usize, width: usize, rng: &mut ChaCha8Rng) {
    let Some(slot) = bytes.get_mut(at..at + width) else {
        return;
    };
    let mut was = [0; 8];
    was[..width].copy_from_slice(slot);
    slot.copy_from_slice(&number(u64::from_le_bytes(was), rng).to_le_bytes()[..width]);
}

/// The same, the greatest first.
fn renumber_big(bytes: &mut [u8], at: usize, width: usize, rng: &mut ChaCha8Rng) {
    let Some(slot) = bytes.get_mut(at..at + width) else {
        return;
    };
    let was = slot.iter().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
    slot.copy_from_slice(&number(was, rng).to_be_bytes()[8 - width..]);
}

/// Bytes somewhere in a body: others, fewer or more.
fn scribble(body: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    if body.is_empty() {
        return body.resize(rng.random_range(1..64), 0);
    }
    let at = rng.random_range(0..body.len());
    match rng.random_range(0..6) {
        0 => body.truncate(at),
        1 => body.extend(vec![rng.random::<u8>(); 1 << rng.random_range(0..12)]),
        2 => rng.fill_bytes(&mut body[at..]),
        3 => body[at] ^= 1 << rng.random_range(0..8),
        _ => {
            let width = [1, 2, 4, 8][rng.random_range(0..4)];
            let at = at / width * width;
            match rng.random() {
                true => renumber(body, at, width, rng),
                false => renumber_big(body, at, width, rng),
            }
        }
    }
}

/// Parts of a recording that were left out, doubled, moved, or said again and again.
fn rearrange<T: Clone>(parts: &mut Vec<T>, rng: &mut ChaCha8Rng) {
    if parts.is_empty() {
        return;
    }
    let (at, other) = (
        rng.random_range(0..parts.len()),
        rng.random_range(0..parts.len()),
    );
    match rng.random_range(0..5) {
        0 => drop(parts.remove(at)),
        1 => parts.swap(at, other),
        2 => {
            let part = parts[at].clone();
            parts.insert(other, part);
        }
        3 => parts.truncate(at.max(1)),
        _ => {
            let part = parts[at].clone();
            let times = 1 << rng.random_range(0..7);
            parts.splice(other..other, std::iter::repeat_n(part, times));
        }
    }
}
