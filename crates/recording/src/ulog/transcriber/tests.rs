#![allow(clippy::unwrap_used)]

use super::*;
use crate::records::problem::Problem;

fn record(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut out = (body.len() as u16).to_le_bytes().to_vec();
    out.push(kind);
    out.extend_from_slice(body);
    out
}

fn header() -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.push(1);
    out.extend(5_000_u64.to_le_bytes());
    out
}

fn definitions() -> Vec<u8> {
    let format = b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;uint8_t[4] _padding0;";
    [
        header(),
        record(b'B', &[0; 40]),
        record(b'I', b"\x10char[3] sys_namePX4"),
        record(b'F', format),
        record(b'A', b"\0\x07\0sensor_combined"),
        record(b'A', b"\x01\x08\0sensor_combined"),
    ]
    .concat()
}

fn message(id: u16, n: u64) -> Vec<u8> {
    let mut body = id.to_le_bytes().to_vec();
    body.extend((10_000 + 4_000 * n).to_le_bytes());
    for axis in 0..3 {
        body.extend((n as f32 + axis as f32).to_le_bytes());
    }
    body.extend(4_000_u32.to_le_bytes());
    record(b'D', &body)
}

/// Pushes `log` in pieces of `cut` bytes; the records and faults that come out.
fn read(log: &[u8], cut: usize) -> (Vec<u8>, Problems, Transcriber) {
    let mut transcriber = Transcriber::default();
    let mut to = Transcript::default();
    let (mut from, mut until) = (0, cut.min(log.len()));
    loop {
        let ahead = &log[from..until];
        let is_end = until == log.len();
        if ahead.is_empty() && is_end {
            return (to.bytes, transcriber.problems.clone(), transcriber);
        }
        match transcriber.step(ahead, is_end, &mut to) {
            ReadProgress::Used(n) => {
                assert!(n > 0 && n <= ahead.len(), "{n} of {}", ahead.len());
                from += n;
            }
            ReadProgress::Need(n) => {
                assert!(!is_end && n > ahead.len(), "{n}, have {}", ahead.len());
                until = (until + cut).min(log.len());
            }
        }
    }
}

/// Times of the messages told, by channel.
fn messages(records: &[u8]) -> Vec<(u16, u64)> {
    let mut rest = records;
    let mut found = Vec::new();
    while let Some((kind, tail)) = rest.split_first() {
        let length = u64::from_le_bytes(*tail.first_chunk().unwrap()) as usize;
        let body = &tail[8..8 + length];
        if *kind == 5 {
            let time = u64::from_le_bytes(*body[6..].first_chunk().unwrap());
            found.push((u16::from_le_bytes([body[0], body[1]]), time));
        }
        rest = &tail[8 + length..];
    }
    found
}

fn log(n: u64) -> Vec<u8> {
    let mut log = definitions();
    for k in 0..n {
        log.extend(message(7, k));
        if k % 3 == 0 {
            log.extend(message(8, k));
        }
    }
    log
}

#[test]
fn definitions_become_channels_and_messages_keep_their_time() {
    let (records, faults, transcriber) = read(&log(6), usize::MAX);
    assert!(faults.is_empty(), "{faults:?}");
    assert_eq!(transcriber.system(), "PX4");
    let found = messages(&records);
    assert_eq!(found.len(), 8);
    assert_eq!(
        found[..3],
        [(7, 10_000_000), (8, 10_000_000), (7, 14_000_000)]
    );
    let text = String::from_utf8_lossy(&records);
    for words in [
        "ulog/sensor_combined",
        "uint64 timestamp\nfloat32[3] gyro_rad\nuint32 gyro_integral_dt\n",
        "sensor_combined/1",
        "ros1msg",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(!text.contains("padding"));
}

#[test]
fn pushed_in_any_cut_a_damaged_log_gives_the_same_records_and_faults() {
    let mut bytes = log(40_000);
    for at in [900_000, 1_200_000, 1_200_100] {
        bytes[at..at + 40].fill(0xff);
    }
    bytes.drain(300_000..300_007);
    let whole = read(&bytes, usize::MAX);
    assert!(whole.1.total() >= 3, "{:?}", whole.1);
    for cut in [977, 70_001, 1 << 20] {
        let cut_up = read(&bytes, cut);
        assert!(cut_up.0 == whole.0, "records differ at {cut}");
        assert_eq!(cut_up.1, whole.1);
    }
}

#[test]
fn a_log_cut_anywhere_gives_its_whole_messages_and_says_that_it_was_cut() {
    let whole = log(30);
    let ends: Vec<usize> = {
        let mut at = definitions().len();
        let mut ends = vec![];
        while at < whole.len() {
            let (length, _) = head(&whole[at..]).unwrap();
            at += HEAD + length;
            ends.push(at);
        }
        ends
    };
    for cut in definitions().len()..whole.len() {
        let (records, faults, _) = read(&whole[..cut], usize::MAX);
        let expected = ends.iter().filter(|end| **end <= cut).count();
        assert_eq!(messages(&records).len(), expected, "{cut}");
        let is_between = ends.contains(&cut) || cut == definitions().len();
        let is_said = faults
            .first()
            .iter()
            .any(|f| matches!(f.kind, ProblemKind::Truncated { .. }));
        assert_eq!(is_said, !is_between, "{cut}: {faults:?}");
    }
}

#[test]
fn behind_damage_every_record_from_the_next_on_is_found() {
    let whole = log(300);
    let start = definitions().len();
    let all = messages(&read(&whole, usize::MAX).0);
    for (at, n) in [
        (start, 1),
        (start + 1, 1),
        (start + 2, 1),
        (start + 700, 40),
        (start + 33, 500),
    ] {
        let mut bytes = whole.clone();
        bytes[at..at + n].fill(0xee);
        let (records, faults, _) = read(&bytes, usize::MAX);
        let found = messages(&records);
        let lost = all.len() - found.len();
        assert!(lost <= n / 29 + 2, "{lost} lost by {n} bytes at {at}");
        assert_eq!(found.last(), all.last());
        assert!(!faults.is_empty());
    }
}

#[test]
fn a_record_of_an_unknown_type_is_stepped_over_and_dropouts_are_told() {
    let mut bytes = definitions();
    bytes.extend(message(7, 0));
    bytes.extend(record(b'Z', &[9; 300]));
    bytes.extend(message(7, 1));
    bytes.extend(record(b'O', &62_u16.to_le_bytes()));
    bytes.extend(message(7, 2));
    bytes.extend(message(99, 2));
    bytes.extend(message(7, 3));
    let (records, faults, _) = read(&bytes, usize::MAX);
    let ids: Vec<u16> = messages(&records).iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [7, 7, 7, 99, 7]);
    let kinds = faults.first().iter().map(|f| f.kind.clone());
    let kinds: Vec<ProblemKind> = kinds.collect();
    let strange = ProblemKind::WrongRecord {
        kind: b'Z',
        length: 300,
    };
    assert_eq!(kinds, [strange, ProblemKind::Dropout { millis: 62 }]);
}

#[test]
fn what_was_appended_later_is_read_behind_a_record_it_cuts() {
    let mut flags = [0; 40];
    flags[8] = 1;
    let head = [header(), record(b'B', &flags)].concat();
    let place = head.len() - 24;
    let mut bytes = definitions().split_off(header().len() + HEAD + 40);
    bytes.splice(0..0, head);
    bytes.extend(message(7, 0));
    bytes.extend(&message(7, 1)[..9]);
    let start = bytes.len() as u64;
    bytes[place..place + 8].copy_from_slice(&start.to_le_bytes());
    bytes.extend(message(7, 2));
    bytes.extend(message(7, 3));
    for cut in [1, 50, usize::MAX] {
        let (records, faults, _) = read(&bytes, cut);
        assert_eq!(messages(&records).len(), 3, "{cut}");
        assert_eq!(faults.total(), 1, "{faults:?}");
        assert_eq!(faults.first()[0].offset, start - 9);
    }
}

#[test]
fn definitions_that_spell_out_to_millions_of_fields_are_refused_within_a_bound() {
    let mut bytes = header();
    let wide = |name: &str, of: &str| {
        let fields: String = (0..200).map(|n| format!("{of} x{n};")).collect();
        record(b'F', format!("{name}:{fields}").as_bytes())
    };
    for (name, of) in [("a", "b"), ("b", "c"), ("c", "d"), ("d", "e")] {
        bytes.extend(wide(name, of));
    }
    bytes.extend(record(b'F', b"e:"));
    for _ in 0..1000 {
        bytes.extend(record(b'A', b"\0\x07\0a"));
    }
    let (records, faults, transcriber) = read(&bytes, usize::MAX);
    assert_eq!((transcriber.steps, records.len()), (0, 0));
    let is_one = |f: &Problem| f.kind == ProblemKind::TooManyDefinitions;
    assert!(faults.first().iter().all(is_one));
    assert_eq!(faults.total(), 1000);
}
