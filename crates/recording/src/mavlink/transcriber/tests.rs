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
    read_by(Transcriber::default(), log, piece)
}

/// The same of a log, or of a capture.
fn read_by(
    mut transcriber: Transcriber,
    log: &[u8],
    piece: usize,
) -> (Vec<Vec<u8>>, Vec<ProblemKind>) {
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
    let (_, problems) = Box::new(transcriber).finish();
    let faults = problems.first().iter();
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

/// Frame of a capture: without a time, with the number it has among those of its sender.
fn bare(frame: &[u8], sequence: u8) -> Vec<u8> {
    let mut frame = frame[8..].to_vec();
    let (at, end) = match frame[0] {
        0xfe => (2, frame.len() - 2),
        _ => (4, frame.len() - 2 - 13 * usize::from(frame[2])),
    };
    frame[at] = sequence;
    let extra = if frame[at + 3] == 116 { 76 } else { 93 };
    let sum = checksum(&[&frame[1..end], &[extra]].concat());
    frame[end..end + 2].copy_from_slice(&sum.to_le_bytes());
    frame
}

/// Frame of a message that is not read, with another checksum than any that is.
fn unread(sequence: u8) -> Vec<u8> {
    let mut frame = framed(0, 2, 33, 104, &[5; 28])[8..].to_vec();
    frame[4] = sequence;
    frame
}

fn capture() -> Vec<Vec<u8>> {
    let frame = |n: u8| match n % 5 {
        0 => bare(&scaled(u32::from(n)), n),
        4 => unread(n),
        version => bare(&highres(u64::from(n), version), n),
    };
    (0..60).map(frame).collect()
}

#[test]
fn a_capture_has_the_frames_of_a_link_in_any_cut_and_the_clock_of_the_vehicle() {
    let log = capture().concat();
    let (messages, faults) = read_by(Transcriber::of_capture(), &log, log.len());
    assert_eq!((messages.len(), faults.len()), (48, 0), "{faults:?}");
    for piece in [1, 7, 100, 301] {
        let again = read_by(Transcriber::of_capture(), &log, piece);
        assert_eq!(again, (messages.clone(), vec![]), "{piece}");
    }
    // Channel, number, and the time in ns: the second is HIGHRES_IMU at 1 ms.
    let time = u64::from_le_bytes(*messages[1][6..].first_chunk().unwrap());
    assert_eq!(time, 1_000_000);
    // Joined within a frame.
    let (late, faults) = read_by(Transcriber::of_capture(), &log[20..], 64);
    assert_eq!(late.len(), 47);
    assert!(
        matches!(faults[..], [ProblemKind::Garbage { .. }]),
        "{faults:?}"
    );
}

#[test]
fn frames_that_a_capture_lacks_are_counted_and_late_ones_are_not() {
    let mut frames = capture();
    frames.swap(30, 31);
    drop(frames.drain(10..13));
    let (_, faults) = read_by(Transcriber::of_capture(), &frames.concat(), 64);
    // Of the two that changed places one was missing for a moment.
    let missing = |count| ProblemKind::FramesMissing { count };
    assert_eq!(faults, [missing(3), missing(1)]);
    // 256 frames are a turn of the counter.
    let turn: Vec<u8> = (0..700_u32)
        .flat_map(|n| bare(&scaled(n), n as u8))
        .collect();
    let (messages, faults) = read_by(Transcriber::of_capture(), &turn, 1000);
    assert_eq!((messages.len(), faults.len()), (700, 0));
}

#[test]
fn a_capture_is_known_by_two_frames_and_nothing_else_is_taken_for_one() {
    use super::super::frame::{is_capture, may_be_capture};
    let log = capture().concat();
    assert!(is_capture(&log) && is_capture(&log[..400]) && !is_capture(&log[1..]));
    assert!(may_be_capture(&log[..60]) && !may_be_capture(&log));
    // Of a vehicle whose first messages are none that are read.
    let others: Vec<u8> = (0..9).flat_map(unread).collect();
    assert!(is_capture(&others) && !is_capture(&[unread(1), unread(1)].concat().repeat(9)));
    let mut noise = 1_u32;
    let random: Vec<u8> = std::iter::repeat_with(|| {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (noise >> 24) as u8
    })
    .take(4096)
    .collect();
    for none in [
        &b"t,gx,gy,gz\n0,1,2,3\n"[..],
        &[0xfe; 4096],
        &[0xfd; 4096],
        &random,
        &[],
    ] {
        assert!(!is_capture(none));
        assert!(none.len() <= 2000 || !may_be_capture(none));
    }
}

#[test]
fn a_living_link_gives_a_line_with_the_last_byte_of_each_frame() {
    let frames = capture();
    let mut link = super::super::Link::default();
    let mut lines = Vec::new();
    // Noise before it, and one frame that does not come.
    link.push(&[0x55, 0xfe, 0x00, 0xfd], None, &mut lines);
    for (n, frame) in frames.iter().enumerate().filter(|(n, _)| *n != 21) {
        let before = lines.len();
        for byte in frame {
            assert_eq!(lines.len(), before, "{n}");
            link.push(&[*byte], Some("mav"), &mut lines);
        }
        assert_eq!(lines.len() > before, n % 5 != 4, "{n}");
    }
    assert_eq!(link.counts(), (59, 1));
    let text = String::from_utf8(lines).unwrap();
    assert_eq!(
        text.lines().next(),
        Some(
            "{\"id\":\"mav/SCALED_IMU2\",\"stamp\":{\"sec\":0,\"nsec\":0},\"gyro\":[0.01,0.02,-0.03],\"accel\":[9.80665,-0,9.80665]}"
        )
    );
    assert_eq!(text.lines().count(), 47);
}

#[test]
fn a_capture_is_known_in_a_file_and_in_a_stream() {
    use crate::format::Format;
    use crate::mcap::Reader;
    let log = capture().concat();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("link.bytes");
    std::fs::write(&path, &log).unwrap();
    let file = Reader::open(&path).unwrap();
    let stream = Reader::from_stream("link", Box::new(std::io::Cursor::new(log))).unwrap();
    assert_eq!([file.format(), stream.format()], [Format::Mavlink; 2]);
}

#[test]
fn attitudes_of_a_vehicle_are_orientations_however_they_are_said() {
    let floats = |values: &[f32]| -> Vec<u8> {
        values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect()
    };
    // Yaw 0.3, pitch 0.2, roll 0.1, north, east, down.
    let angles = [
        &7_u32.to_le_bytes()[..],
        &floats(&[0.1, 0.2, 0.3, 0.0, 0.0, 0.0]),
    ]
    .concat();
    let q = [0.983_347_4, 0.034_270_8, 0.106_020_5, 0.143_572_2];
    let turn = [&8_u32.to_le_bytes()[..], &floats(&q), &floats(&[0.0; 3])].concat();
    let log = [
        scaled(1),
        framed(START + 2, 2, 30, 39, &angles),
        framed(START + 3, 2, 31, 246, &turn),
    ]
    .concat();
    for piece in [1, 50, log.len()] {
        let (messages, faults) = read(&log, piece);
        assert!(faults.is_empty(), "{faults:?}");
        assert_eq!(messages.len(), 3);
        for message in &messages[1..] {
            let number = |at: usize| {
                let bytes = &message[message.len() - 32 + 8 * at..];
                f64::from_le_bytes(*bytes.first_chunk().unwrap())
            };
            // To the right about down is to the right about up reversed; nose up is about left reversed.
            let [w, x, y, z] = q.map(f64::from);
            for (at, expected) in [x, -y, -z, w].into_iter().enumerate() {
                assert!((number(at) - expected).abs() < 1e-6, "{at}: {}", number(at));
            }
        }
    }
}
