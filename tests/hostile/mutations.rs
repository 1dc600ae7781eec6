//! Promise: no bytes from outside make anything panic, hang or lie. Every parser, fed with its
//! good inputs (`fuzz/seeds`) changed at random: the functions are those of the fuzzers in `fuzz/`.
//!
//! `cargo test` tries a few thousand cases of each, in seconds; `STRAPD_MUTATIONS=1000000 cargo test --release --test
//! hostile
//! mutations` as many, `STRAPD_MUTANTS=200000` as many changed logs through all commands, half of them changed as
//! their formats
//! know them; `STRAPD_MUTANTS_OF=db3` leaves it at those of one format. `.ci/run` and `.ci/full` say how many are
//! asked of a change.

#[cfg(target_os = "linux")]
mod commands;
#[cfg(target_os = "linux")]
mod structured;

use crate::meter::Meter;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Duration;

fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/seeds")
        .join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let seeds: Vec<_> = files
        .iter()
        .map(|file| std::fs::read(file).unwrap())
        .collect();
    assert!(!seeds.is_empty(), "{folder:?}");
    seeds
}

/// Up to seven changes of the kinds that hurt: bits, cuts, counts that promise the world, words of the format in
/// the wrong place, pieces of another input.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], rng: &mut ChaCha8Rng) {
    const WORDS: [&[u8]; 13] = [
        b"\n",
        b"{",
        b"}",
        b"]",
        b"\"",
        b"\\u",
        b"1e999",
        b"-0",
        b"null",
        b"\xff",
        b"\0\0\0\0",
        b"\xff\xff\xff\x7f",
        b"\xf8\x01\x30\0",
    ];
    for _ in 0..rng.random_range(1..8) {
        let at = rng.random_range(0..bytes.len() + 1);
        let end = (at + rng.random_range(0..20)).min(bytes.len());
        match rng.random_range(0..9) {
            0 | 1 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes.truncate(at),
            3 => bytes.insert(at, rng.random()),
            4 => bytes[at..end.min(at + 8)].fill(if rng.random() { 0xff } else { 0x7f }),
            5 => drop(bytes.drain(at..end)),
            6 => {
                let word = WORDS[rng.random_range(0..WORDS.len())];
                bytes.splice(at..at, word.iter().copied());
            }
            7 if !other.is_empty() => {
                let from = rng.random_range(0..other.len());
                let piece = &other[from..(from + rng.random_range(1..40)).min(other.len())];
                bytes.splice(at..end, piece.iter().copied());
            }
            _ => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
}

/// A whole number of the environment.
fn asked(name: &str) -> Option<usize> {
    let text = std::env::var(name).ok()?;
    let number = text.parse();
    Some(number.unwrap_or_else(|why| panic!("{name}={text}: {why}")))
}

fn survives(target: &str, cases: usize, parse: fn(&[u8])) {
    let seeds = seeds(target);
    for seed in &seeds {
        parse(seed);
    }
    // A fixed generator: the same bytes everywhere, every time.
    let mut rng = ChaCha8Rng::seed_from_u64(target.bytes().map(u64::from).sum());
    let mut slowest = Duration::ZERO;
    let mut meter = Meter::start();
    for case in 0..cases {
        let mut bytes = seeds[case % seeds.len()].clone();
        mutate(
            &mut bytes,
            &seeds[rng.random_range(0..seeds.len())],
            &mut rng,
        );
        if case % 50 == 0 {
            // Noise, now and then.
            bytes.truncate(200);
            rng.fill_bytes(&mut bytes);
        }
        let outcome = catch_unwind(AssertUnwindSafe(|| parse(&bytes)));
        let input = bytes.escape_ascii();
        assert!(outcome.is_ok(), "{target}, case {case}: {input}");
        // They take microseconds; a loop over a forged count would take minutes.
        let took = meter.lap(LONGEST, format_args!("{target}, case {case}: {input}"));
        slowest = slowest.max(took);
    }
    eprintln!("{target}: {cases} cases, the slowest {slowest:?}");
}

/// Processor time of one input.
const LONGEST: Duration = Duration::from_secs(20);

/// Number of cases for every parser, unless more are asked for: together within ten seconds of one core.
const CASES: usize = 4_000;

/// The cases of each parser.
fn cases() -> usize {
    asked("STRAPD_MUTATIONS").unwrap_or(CASES)
}

#[test]
fn cdr() {
    survives("cdr", cases(), crate::parsers::cdr);
}

#[test]
fn ros1() {
    survives("ros1", cases(), crate::parsers::ros1);
}

#[test]
fn json() {
    survives("json", cases(), crate::parsers::json);
}

#[test]
fn protobuf() {
    survives("protobuf", cases(), crate::parsers::protobuf);
}

#[test]
fn schemas() {
    survives("schema", cases(), crate::parsers::schema);
}

#[test]
fn lines() {
    survives("lines", cases(), crate::parsers::lines);
}

#[test]
fn tables() {
    // Each is read twice.
    survives("delimited", cases() / 3, crate::parsers::delimited);
}

#[test]
fn tables_by_columns() {
    // Each is put into a file first.
    survives("parquet", cases() / 4, crate::parsers::parquet);
}

/// Every beginning of one, and every one with a byte at its end.
#[test]
fn tables_by_columns_cut_anywhere() {
    for seed in seeds("parquet").iter().step_by(7) {
        for end in (0..seed.len()).step_by(3) {
            crate::parsers::parquet(&seed[..end]);
            let mut bytes = seed[..end].to_vec();
            bytes.extend_from_slice(&seed[seed.len() - 8..]);
            crate::parsers::parquet(&bytes);
        }
    }
}

#[test]
fn devices() {
    survives("devices", cases(), crate::parsers::devices);
}

#[test]
fn conversations() {
    survives("session", cases(), crate::parsers::session);
}

#[test]
fn viewers() {
    survives("foxglove", cases(), crate::parsers::foxglove);
}

#[test]
fn logs() {
    survives("mcap", cases(), crate::parsers::mcap);
}

/// The mutations reach both sides: what is accepted, and what is not.
#[test]
fn a_bug_would_be_found() {
    let found = catch_unwind(|| {
        survives("json", 2_000, |bytes| {
            assert!(!bytes.windows(5).any(|w| w == b"1e999"), "found");
        });
    });
    assert!(found.is_err());
}

/// And work that does not end in time, by what it uses; what only waits is not it.
#[cfg(target_os = "linux")]
#[test]
fn work_without_end_would_be_found() {
    let limit = Duration::from_millis(200);
    let mut meter = Meter::start();
    std::thread::sleep(2 * limit);
    assert!(meter.lap(limit, "a wait") >= 2 * limit);
    let used = crate::meter::spent().unwrap();
    // The second before is never held against it.
    while crate::meter::spent().unwrap() - used < Duration::from_millis(1400) {
        std::hint::black_box((0..10_000).sum::<u64>());
    }
    let found = catch_unwind(AssertUnwindSafe(|| meter.lap(limit, "a loop"))).unwrap_err();
    let said = found.downcast_ref::<String>().unwrap();
    assert!(
        said.starts_with("a loop: used 1.") && said.ends_with("CPU of 200ms"),
        "{said}"
    );
}
