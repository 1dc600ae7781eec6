//! MAVLink: frames whose lengths and checksums are right, with what each kind adds to them.

use super::{Changed, fixture, rearrange, renumber, scribble};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

#[derive(Clone)]
struct Frame {
    time: Vec<u8>,
    /// The bytes from the mark to the payload, whose length is the second.
    head: Vec<u8>,
    payload: Vec<u8>,
    /// The byte that its kind adds to the checksum.
    extra: u8,
}

fn checksum(frame: &Frame, extra: u8) -> u16 {
    let bytes = frame.head[1..].iter().chain(&frame.payload);
    bytes.chain([&extra]).fold(0xffff, |crc: u16, byte| {
        let byte = byte ^ (crc & 0xff) as u8;
        let byte = byte ^ byte << 4;
        let byte = u16::from(byte);
        crc >> 8 ^ byte << 8 ^ byte << 3 ^ byte >> 4
    })
}

fn parse(bytes: &[u8]) -> Vec<Frame> {
    let mut rest = bytes;
    let mut frames = Vec::new();
    while rest.len() > 20 && frames.len() < 80 {
        let head = match rest[8] {
            0xfe => 6,
            0xfd => 10,
            _ => break,
        };
        let length = usize::from(rest[9]);
        let end = 8 + head + length;
        if rest.len() < end + 2 {
            break;
        }
        let mut frame = Frame {
            time: rest[..8].to_vec(),
            head: rest[8..8 + head].to_vec(),
            payload: rest[8 + head..end].to_vec(),
            extra: 0,
        };
        let said = u16::from_le_bytes([rest[end], rest[end + 1]]);
        let extra = (0..=255).find(|extra| checksum(&frame, *extra) == said);
        frame.extra = extra.expect("a frame of the fixture is right");
        frames.push(frame);
        rest = &rest[end + 2..];
    }
    assert!(frames.len() > 20, "{}", frames.len());
    frames
}

pub(super) fn changes() -> Box<dyn Fn(&mut ChaCha8Rng) -> Changed> {
    let frames = parse(&fixture("ardupilot.tlog"));
    Box::new(move |rng| {
        let mut frames = frames.clone();
        for _ in 0..rng.random_range(1..8) {
            if frames.is_empty() {
                break;
            }
            let at = rng.random_range(0..frames.len());
            let frame = &mut frames[at];
            match rng.random_range(0..7) {
                0 => rearrange(&mut frames, rng),
                1 => super::renumber_big(&mut frame.time, 0, 8, rng),
                // Sequence, system, component, and flags of the second version.
                2 => renumber(&mut frame.head, rng.random_range(2..6), 1, rng),
                3 => renumber(&mut frame.payload, 0, 8, rng),
                4 => {
                    let at = 4 * rng.random_range(0..1 + frame.payload.len() / 4);
                    renumber(&mut frame.payload, at, 4, rng);
                }
                _ => scribble(&mut frame.payload, rng),
            }
        }
        let mut out = Vec::new();
        for mut frame in frames {
            frame.payload.truncate(255);
            frame.head[1] = frame.payload.len() as u8;
            let crc = checksum(&frame, frame.extra);
            out.extend(&frame.time);
            out.extend(&frame.head);
            out.extend(&frame.payload);
            out.extend(crc.to_le_bytes());
        }
        out.into()
    })
}
