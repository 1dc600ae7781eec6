//! Messages made after the format's description: by instance, old and new, damaged, in any cut.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::records::{HEAD as RECORD, head_at, op};

fn fmt(of: u8, name: &str, letters: &str, columns: &str, length: usize) -> Vec<u8> {
    let mut message = vec![0xa3, 0x95, 0x80, of, length as u8];
    for (text, room) in [(name, 4), (letters, 16), (columns, 64)] {
        let mut bytes = text.as_bytes().to_vec();
        bytes.resize(room, 0);
        message.extend(bytes);
    }
    message
}

/// Definitions as ArduPilot writes them, first that of definitions.
fn head() -> Vec<u8> {
    [
        fmt(0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        fmt(
            0x81,
            "IMU",
            "QBffffffIIfBBHH",
            "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
            54,
        ),
        fmt(
            0x82,
            "MAG",
            "QBhhhhhhhhhBI",
            "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S",
            35,
        ),
        fmt(
            0x83,
            "ATT",
            "QccccCCCCB",
            "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw,AEKF",
            28,
        ),
        fmt(0x84, "MSG", "QZ", "TimeUS,Message", 75),
    ]
    .concat()
}

fn imu(n: u64, instance: u8) -> Vec<u8> {
    let mut message = vec![0xa3, 0x95, 0x81];
    message.extend((n * 2500).to_le_bytes());
    message.push(instance);
    for value in [0.1, 0.2, 0.3, 1.0, 2.0, -9.8_f32] {
        message.extend((value + n as f32).to_le_bytes());
    }
    message.resize(54, 1);
    message
}

fn mag(n: u64) -> Vec<u8> {
    let mut message = vec![0xa3, 0x95, 0x82];
    message.extend((n * 2500).to_le_bytes());
    message.push(0);
    for value in [200_i16, -50, 400] {
        message.extend(value.to_le_bytes());
    }
    message.resize(35, 0);
    message
}

fn text(n: u64) -> Vec<u8> {
    let mut message = vec![0xa3, 0x95, 0x84];
    message.extend((n * 2500).to_le_bytes());
    message.extend(b"ArduCopter");
    message.resize(75, 0);
    message
}

fn log() -> Vec<u8> {
    let body = (0..40).flat_map(|n| match n % 8 {
        7 => text(n),
        6 => mag(n),
        _ => [imu(n, 0), imu(n, 1)].concat(),
    });
    [head(), body.collect()].concat()
}

/// Channel and bytes of each message, names of the channels, and faults; pushed in pieces.
fn read(log: &[u8], piece: usize) -> (Vec<Vec<u8>>, usize, Vec<ProblemKind>) {
    let (mut transcriber, mut to) = (Transcriber::default(), Transcript::default());
    let (mut from, mut have) = (0, 0);
    while from < log.len() {
        have = (have + piece).min(log.len());
        let is_end = have == log.len();
        while let ReadProgress::Used(n) = transcriber.step(&log[from..have], is_end, &mut to) {
            from += n;
            if from >= have {
                break;
            }
        }
    }
    let (mut messages, mut channels, mut at) = (Vec::new(), 0, 0);
    while let Some((opcode, length)) = head_at(&to.bytes, at) {
        let end = at + RECORD + length as usize;
        match opcode {
            op::MESSAGE => messages.push(to.bytes[at + RECORD..end].to_vec()),
            op::CHANNEL => channels += 1,
            _ => {}
        }
        at = end;
    }
    let (_, problems) = Box::new(transcriber).finish();
    let faults = problems.first().iter();
    (messages, channels, faults.map(|f| f.kind.clone()).collect())
}

#[test]
fn messages_are_found_by_the_names_of_their_columns_in_any_cut() {
    let log = log();
    let whole = read(&log, log.len());
    assert_eq!((whole.0.len(), whole.1), (30 * 2 + 5, 3));
    assert!(whole.2.is_empty(), "{:?}", whole.2);
    for piece in [1, 7, 100, 301] {
        assert_eq!(read(&log, piece), whole, "{piece}");
    }
    let double =
        |message: &[u8], at: usize| f64::from_le_bytes(*message[at..].first_chunk().unwrap());
    // Channel, sequence and two times; then the head of the message, of 28 bytes with what fills it up.
    let numbers = 22 + 28;
    let rate = [0, 8, 16].map(|at| double(&whole.0[0], numbers + 13 * 8 + at));
    assert_eq!(rate, [0.1_f32, -0.2, -0.3].map(f64::from));
    let force = [0, 8, 16].map(|at| double(&whole.0[0], numbers + 25 * 8 + at));
    assert_eq!(force, [1.0, -2.0, f64::from(9.8_f32)]);
    let field = whole.0.iter().find(|message| message[0] == 2).unwrap();
    let field = [0, 8, 16].map(|at| double(field, numbers + at));
    for (one, other) in field.into_iter().zip([2e-5, 5e-6, -4e-5]) {
        assert!((one - other).abs() < 1e-18);
    }
    let time = u64::from_le_bytes(*whole.0[3][6..].first_chunk().unwrap());
    assert_eq!(time, 2_500_000);
}

#[test]
fn damage_costs_what_it_touches_and_is_told() {
    let log = log();
    let (all, ..) = read(&log, log.len());
    let garbage = [
        &log[..head().len() + 54],
        &[0x55; 777],
        &log[head().len() + 54..],
    ]
    .concat();
    let (messages, _, faults) = read(&garbage, 64);
    // The message before it is not believed, as nothing follows it.
    assert_eq!(messages.len(), all.len() - 1);
    assert_eq!(faults, [ProblemKind::Garbage { skipped: 54 + 777 }]);
    for at in head().len()..head().len() + 3 * 108 {
        let mut changed = log.clone();
        changed[at] ^= 0x11;
        let (messages, ..) = read(&changed, 100);
        assert!(messages.len() + 2 >= all.len(), "{at}: {}", messages.len());
    }
    let mut told = 0;
    for cut in head().len() + 1..log.len() {
        let (messages, _, faults) = read(&log[..cut], 100);
        assert!(all.starts_with(&messages), "{cut}");
        told += usize::from(!faults.is_empty());
    }
    // Between messages nothing tells that another followed.
    assert!(told * 10 > (log.len() - head().len()) * 9);
}
