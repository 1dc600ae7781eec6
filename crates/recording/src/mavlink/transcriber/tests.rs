//! Frames made after the protocol's description: both versions, signed, damaged, in any cut.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::records::{HEAD, head_at, op};

/// Checksum as the protocol's own implementations have it, bit by bit.
fn checksum(bytes: &[u8]) -> u16 {
    let mut sum = 0xffff_u16;
    for byte in bytes {
        sum ^= u16::from(*byte);
        for _ in 0..8 {
            let low = sum & 1;
            sum = (sum >> 1) ^ (0x8408 * low);
        }
    }
    sum
}

fn framed(time: u64, version: u8, number: u32, extra: u8, payload: &[u8]) -> Vec<u8> {
    let length = payload.len() as u8;
    let [a, b, c, _] = number.to_le_bytes();
    let own = match version {
        1 => vec![length, 9, 7, 1, a],
        _ => vec![length, u8::from(version == 3), 0, 9, 7, 1, a, b, c],
    };
    let own = [own, payload.to_vec()].concat();
    let sum = checksum(&[&own[..], &[extra]].concat());
    let magic = if version == 1 { 0xfe } else { 0xfd };
    let mut frame = [&time.to_be_bytes()[..], &[magic], &own, &sum.to_le_bytes()].concat();
    if version == 3 {
        frame.extend([7; 13]);
    }
    frame
}

const START: u64 = 1_700_000_000_000_000;

fn highres(n: u64, version: u8) -> Vec<u8> {
    let numbers: Vec<u8> = (1..=9)
        .flat_map(|k| (k as f32 * 0.5).to_le_bytes())
        .collect();
    let payload = [&(n * 1000).to_le_bytes()[..], &numbers].concat();
    framed(START + n * 1000, version, 105, 93, &payload)
}

fn scaled(n: u32) -> Vec<u8> {
    let numbers: Vec<u8> = [1000_i16, 0, -1000, 10, -20, 30]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let payload = [&n.to_le_bytes()[..], &numbers].concat();
    framed(START + u64::from(n), 2, 116, 76, &payload)
}

/// Messages and faults, pushed in pieces.
fn read(log: &[u8], piece: usize) -> (Vec<Vec<u8>>, Vec<ProblemKind>) {
    let mut transcriber = Transcriber::default();
    let mut to = Transcript::default();
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
    let mut messages = Vec::new();
    let mut at = 0;
    while let Some((opcode, length)) = head_at(&to.bytes, at) {
        let end = at + HEAD + length as usize;
        if opcode == op::MESSAGE {
            messages.push(to.bytes[at + HEAD..end].to_vec());
        }
        at = end;
    }
    let faults = transcriber.problems.first().iter();
    let faults = faults.map(|fault| fault.kind.clone()).collect();
    (messages, faults)
}

#[test]
fn frames_of_both_versions_signed_or_not_are_read_in_any_cut() {
    let log: Vec<u8> = (0..60)
        .flat_map(|n| match n % 4 {
            0 => scaled(n as u32),
            version => highres(n, version as u8),
        })
        .collect();
    let (messages, faults) = read(&log, log.len());
    assert_eq!(messages.len(), 60);
    assert!(faults.is_empty(), "{faults:?}");
    for piece in [1, 7, 100, 301] {
        assert_eq!(
            read(&log, piece),
            (messages.clone(), faults.clone()),
            "{piece}"
        );
    }
    let doubles =
        |message: &[u8], at: usize| f64::from_le_bytes(*message[at..].first_chunk().unwrap());
    // Id, sequence and two times; then the head of the message, of 28 bytes with what fills it up.
    let rate = 22 + 28 + 13 * 8;
    let [x, y, z] = [0, 8, 16].map(|at| doubles(&messages[0], rate + at));
    assert_eq!([x, y, z], [10.0 * 1e-3, 20.0 * 1e-3, -30.0 * 1e-3]);
    let force = rate + 12 * 8;
    assert_eq!(doubles(&messages[0], force), 9.80665);
    assert_eq!(doubles(&messages[0], force + 16), 9.80665);
    let [x, y, z] = [0, 8, 16].map(|at| doubles(&messages[1], rate + at));
    assert_eq!([x, y, z], [2.0, -2.5, -3.0]);
}

#[test]
fn a_changed_byte_costs_its_own_frame_and_is_counted() {
    let log: Vec<u8> = (0..40).flat_map(|n| highres(n, 2)).collect();
    let (all, _) = read(&log, log.len());
    let one = log.len() / 40;
    for at in one * 20..one * 21 {
        let mut changed = log.clone();
        changed[at] ^= 0x11;
        let (messages, faults) = read(&changed, log.len());
        // The time before a frame has no checksum, and another number makes another message, that is not read.
        let is_unseen = at < one * 20 + 8 || (15..18).contains(&(at - one * 20));
        let lost = all.len() - messages.len();
        assert!(lost <= 1 + usize::from(at == one * 20 + 9), "{at}: {lost}");
        assert!(
            is_unseen || (lost > 0 && !faults.is_empty()),
            "{at}: {faults:?}"
        );
    }
}

#[test]
fn garbage_between_frames_and_a_cut_are_told() {
    let log = [
        &highres(1, 2)[..],
        &[0x55; 777],
        &highres(2, 1),
        &[0, 5, 7],
        &highres(3, 2),
    ]
    .concat();
    let (messages, faults) = read(&log, 50);
    assert_eq!(messages.len(), 3);
    let garbage = |skipped| ProblemKind::Garbage { skipped };
    assert_eq!(faults, [garbage(777), garbage(3)]);
    // Up to where its magic stands, what is left of the last tells nothing.
    for cut in 1..highres(3, 2).len() {
        let (messages, faults) = read(&log[..log.len() - cut], 50);
        assert_eq!(
            (messages.len(), faults.len()),
            (2, 3 - usize::from(cut >= 56)),
            "{cut}: {faults:?}"
        );
    }
}
