//! A message of an x-IMU3 -> a sample. Pure.
//!
//! Messages end with a line feed, in binary (stuffed) and in ASCII alike, and have no checksum: one is believed by its
//! first byte and its exact length, or its number of fields. A multiplexer puts `^` and a channel before the messages of
//! each device on one link. Axes are x forward, y left, z up as on the case.
//!
//! # Source
//! The maker's own implementation, crate `ximu3` 1.9.1 (x-io Technologies, MIT): identifiers, layouts, stuffing; the
//! x-IMU3 User Manual for units.

use super::Device;
use super::frame::Cut;
use super::numbers::{G, array, scaled};
use super::orientation::{Orientation, of_angles, of_nwu, unit};
use super::sample::{Sample, Taken};

/// Mark of the multiplexer.
const MUX: u8 = b'^';
/// End of a message.
const END: u8 = b'\n';
/// Escape, and what stands for end and escape behind it.
const ESCAPE: u8 = 0xdb;
const ESCAPED_END: u8 = 0xdc;
const ESCAPED_ESCAPE: u8 = 0xdd;
/// Longest message, stuffed.
const LONGEST_MESSAGE: usize = 512;

/// Letters of messages, and how many numbers each has.
const MESSAGES: [(u8, usize); 12] = [
    (b'I', 6),
    (b'M', 3),
    (b'H', 3),
    (b'Q', 4),
    (b'R', 9),
    (b'A', 3),
    (b'L', 7),
    (b'E', 7),
    (b'U', 4),
    (b'T', 1),
    (b'B', 3),
    (b'W', 2),
];
/// Letters of messages of text.
const TEXTS: [u8; 5] = *b"NFSCY";

/// Cuts a message.
pub(super) fn cut(bytes: &[u8]) -> Cut {
    let (skipped, message) = match bytes {
        [MUX, _, message @ ..] => (2, message),
        [MUX] => return Cut::Need(3),
        message => (0, message),
    };
    let Some(first) = message.first() else {
        return Cut::Need(bytes.len() + 1);
    };
    let letter = first & 0x7f;
    let is_known = MESSAGES.iter().any(|(of, _)| *of == letter) || TEXTS.contains(&letter);
    // In ASCII a comma and a digit follow.
    let is_ascii = *first < 0x80;
    let fits = match message {
        [_, comma, digit, ..] => !is_ascii || (*comma == b',' && digit.is_ascii_digit()),
        [_, comma] => !is_ascii || *comma == b',',
        _ => true,
    };
    if !is_known || !fits {
        return Cut::No;
    }
    let window = message.get(..LONGEST_MESSAGE).unwrap_or(message);
    let Some(end) = window.iter().position(|byte| *byte == END) else {
        return match window.len() < LONGEST_MESSAGE {
            true => Cut::Need(bytes.len() + 1),
            false => Cut::No,
        };
    };
    let body = window.get(..end).unwrap_or(window);
    let total = skipped + end + 1;
    match is_whole(letter, is_ascii, body) {
        true => Cut::Frame {
            total,
            tells: matches!(letter, b'I' | b'M' | b'Q'),
        },
        false => Cut::No,
    }
}

/// Whether a message has what its letter says.
fn is_whole(letter: u8, is_ascii: bool, body: &[u8]) -> bool {
    let mut known = MESSAGES.iter();
    let count = known.find(|(of, _)| *of == letter).map(|(_, count)| *count);
    match (count, is_ascii) {
        (Some(count), true) => text_numbers(body).is_some_and(|(_, found)| found.len() == count),
        (Some(count), false) => unstuffed(body).is_some_and(|body| body.len() == 9 + 4 * count),
        (None, true) => body.is_ascii(),
        (None, false) => unstuffed(body).is_some_and(|body| body.len() >= 9),
    }
}

/// Time in us and numbers of a message in ASCII.
fn text_numbers(body: &[u8]) -> Option<(u64, Vec<f64>)> {
    let text = std::str::from_utf8(body).ok()?;
    let mut cells = text.trim_end_matches('\r').split(',');
    cells.next()?;
    let time = cells.next()?.parse().ok()?;
    let numbers = cells.map(|cell| cell.parse().ok().filter(|n: &f64| n.is_finite()));
    Some((time, numbers.collect::<Option<_>>()?))
}

/// Bytes of a message without stuffing.
fn unstuffed(body: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(body.len());
    let mut bytes = body.iter();
    while let Some(byte) = bytes.next() {
        out.push(match byte {
            &ESCAPE => match *bytes.next()? {
                ESCAPED_END => END,
                ESCAPED_ESCAPE => ESCAPE,
                _ => return None,
            },
            byte => *byte,
        });
    }
    Some(out)
}

/// A sensor, or several behind a multiplexer.
#[derive(Debug)]
pub(super) struct Ximu3;

impl Device for Ximu3 {
    fn take(&mut self, frame: &[u8], to: &mut Taken) {
        let (unit, message) = match frame {
            [MUX, unit, message @ ..] => (Some(*unit), message),
            message => (None, message),
        };
        let Some((&END, body)) = message.split_last() else {
            return;
        };
        let Some(sample) = sample(body) else {
            return;
        };
        to.add(Sample { unit, ..sample });
    }
}

/// The sample of a message, if it has one.
fn sample(body: &[u8]) -> Option<Sample> {
    let first = *body.first()?;
    let (time, numbers) = match first < 0x80 {
        true => {
            let (time, numbers) = text_numbers(body)?;
            // As binary, so that both give the same bits.
            (time, numbers.iter().map(|n| *n as f32).collect())
        }
        false => {
            let body = unstuffed(body)?;
            let numbers = body.get(9..)?.chunks_exact(4);
            let numbers: Vec<f32> = numbers
                .map_while(|four| Some(f32::from_le_bytes(array(four, 0)?)))
                .collect();
            (u64::from_le_bytes(array(&body, 1)?), numbers)
        }
    };
    let numbers: Vec<f64> = numbers.into_iter().map(f64::from).collect();
    let head = numbers.first_chunk().copied()?;
    let sample = Sample {
        time: Some(time.saturating_mul(1000)),
        ..Sample::default()
    };
    match first & 0x7f {
        // deg/s and g.
        b'I' => Some(Sample {
            rate: Some(scaled(head, 1f64.to_radians())),
            force: numbers.last_chunk().map(|force| scaled(*force, G)),
            ..sample
        }),
        // Its unit is that of its calibration, in which the Earth's field is 1.
        b'M' => Some(Sample {
            field: Some(head),
            ..sample
        }),
        letter => Some(Sample {
            orientation: Some(orientation(letter, &numbers)?),
            ..sample
        }),
    }
}

/// Orientation of a message of the device's own filter, to north, west, up as it leaves the factory. Of its five forms it
/// sends one; the matrix is left out.
fn orientation(letter: u8, numbers: &[f64]) -> Option<Orientation> {
    let q = match letter {
        b'Q' | b'L' | b'E' => unit(numbers.first_chunk().copied()?)?,
        b'A' => of_angles(scaled(numbers.first_chunk().copied()?, 1f64.to_radians()))?,
        _ => return None,
    };
    Some(of_nwu(&q))
}
