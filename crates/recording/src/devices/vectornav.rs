//! Binary and ASCII output of a VectorNav sensor -> a sample. Pure.
//!
//! A binary message says by bits which groups and fields it has, and their lengths say where each lies. Fields of groups
//! beyond the third are stepped over, but for the fourth and those after the sixth, whose lengths change. One quantity is
//! taken for the motion, by the first message that has any: rotations before rates, compensated ones before raw ones.
//! Axes are forward, right, down on the wire.
//!
//! # Source
//! VN-100 User Manual (UM001), "Binary Output Messages", "ASCII"; lengths and the checksum as in the public drivers
//! (tstellanova/vectornav_vn300, `vn300_common.c`). `DeltaTheta` is coning-compensated by the maker.

use super::Device;
use super::clock::mean_force;
use super::frame::{Cut, may_begin};
use super::motion::Choice;
use super::numbers::{array, f32_le, four, scaled};
use super::orientation::{Orientation, of_angles, of_ned, unit};
use super::sample::{Sample, Taken};
use crate::records::imu::flu;
use strapd_attitude::record::SampleKind;

/// Mark of a binary message.
const BINARY: u8 = 0xfa;
/// Mark of an ASCII message.
const TEXT: &[u8] = b"$VN";
/// Longest ASCII message.
const LONGEST_TEXT: usize = 256;
/// Groups whose fields have one length each.
const GROUPS: u8 = 0b0011_0111;

/// Bytes of the fields of groups 1 to 6; 0 of one that is none, or whose length changes.
const LENGTHS: [[u8; 16]; 6] = [
    [8, 8, 8, 12, 16, 12, 24, 12, 12, 24, 20, 28, 2, 4, 8, 0],
    [8, 8, 8, 2, 8, 8, 8, 4, 4, 1, 0, 0, 0, 0, 0, 0],
    [2, 12, 12, 12, 4, 4, 16, 12, 12, 12, 12, 2, 0, 0, 0, 0],
    [0; 16],
    [2, 12, 16, 36, 12, 12, 12, 12, 12, 12, 28, 24, 0, 0, 0, 0],
    [2, 24, 24, 12, 12, 12, 12, 12, 12, 4, 4, 68, 64, 0, 0, 0],
];

/// Cuts a message.
pub(super) fn cut(bytes: &[u8]) -> Cut {
    match bytes {
        [BINARY, ..] => cut_binary(bytes),
        [b'$', ..] if may_begin(bytes, TEXT) => cut_text(bytes),
        _ => Cut::No,
    }
}

fn cut_binary(bytes: &[u8]) -> Cut {
    let Some(groups) = bytes.get(1) else {
        return Cut::Need(2);
    };
    if *groups == 0 || groups & !GROUPS != 0 {
        return Cut::No;
    }
    let head = 2 + 2 * groups.count_ones() as usize;
    if bytes.len() < head {
        return Cut::Need(head);
    }
    let mut total = head + 2;
    for (group, fields) in groups_of(bytes) {
        for field in (0..16).filter(|field| fields >> field & 1 == 1) {
            match length_of(group, field) {
                0 => return Cut::No,
                length => total += length,
            }
        }
    }
    match bytes.get(1..total) {
        None => Cut::Need(total),
        // Over the checksum, too, it is 0.
        Some(summed) => Cut::checked(crc(summed) == 0 && total > head + 2, total),
    }
}

/// Groups of a message, counted from 0, with the bits of their fields.
fn groups_of(bytes: &[u8]) -> impl Iterator<Item = (usize, u16)> {
    let groups = bytes.get(1).copied().unwrap_or(0);
    let there = (0..8).filter(move |group| groups >> group & 1 == 1);
    there.enumerate().filter_map(|(nth, group)| {
        let fields = array(bytes, 2 + 2 * nth).map(u16::from_le_bytes)?;
        Some((group, fields))
    })
}

fn length_of(group: usize, field: usize) -> usize {
    let lengths = LENGTHS.get(group);
    usize::from(lengths.and_then(|of| of.get(field)).copied().unwrap_or(0))
}

/// CRC16-CCITT that begins with 0.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc: u16, byte| {
        let mut crc = crc.swap_bytes() ^ u16::from(*byte);
        crc ^= (crc & 0xff) >> 4;
        crc ^= crc << 12;
        crc ^ (crc & 0xff) << 5
    })
}

fn cut_text(bytes: &[u8]) -> Cut {
    let window = bytes.get(..LONGEST_TEXT).unwrap_or(bytes);
    let Some(end) = window.iter().position(|byte| *byte == b'\n') else {
        return match window.len() < LONGEST_TEXT {
            true => Cut::Need(bytes.len() + 1),
            false => Cut::No,
        };
    };
    let line = window.get(1..end).unwrap_or(&[]).trim_ascii_end();
    let mut parts = line.splitn(2, |byte| *byte == b'*');
    let (Some(summed), Some(stated)) = (parts.next(), parts.next()) else {
        return Cut::No;
    };
    let stated = std::str::from_utf8(stated).ok();
    let stated = stated.and_then(|text| Some((text.len(), u16::from_str_radix(text, 16).ok()?)));
    let holds = match stated {
        Some((2, sum)) => sum == u16::from(summed.iter().fold(0, |sum, byte| sum ^ byte)),
        Some((4, sum)) => sum == crc(summed),
        _ => false,
    };
    Cut::checked(holds, end + 1)
}

/// A sensor.
#[derive(Debug, Default)]
pub(super) struct VectorNav {
    motion: Choice,
    /// Time of the sample before.
    before: Option<u64>,
}

/// Contents of a message, of each quantity the best.
#[derive(Debug, Default)]
struct Message {
    time: Option<u64>,
    gps_time: Option<u64>,
    delta_theta: Option<[f64; 3]>,
    rate: Option<[f64; 3]>,
    raw_rate: Option<[f64; 3]>,
    force: Option<[f64; 3]>,
    raw_force: Option<[f64; 3]>,
    velocity: Option<[f64; 3]>,
    field: Option<[f64; 3]>,
    raw_field: Option<[f64; 3]>,
    quaternion: Option<Orientation>,
    angles: Option<Orientation>,
    is_clipped: bool,
}

/// Flags of `SensSat` of accelerometer and gyro.
const CLIPPED: u16 = 0x3f << 3;

impl Device for VectorNav {
    fn take(&mut self, frame: &[u8], to: &mut Taken) {
        let message = match frame.first() {
            Some(&BINARY) => binary(frame),
            _ => text(frame).unwrap_or_default(),
        };
        to.clipped += u64::from(message.is_clipped);
        self.tell(&message, to);
    }
}

impl VectorNav {
    fn tell(&mut self, message: &Message, to: &mut Taken) {
        let motion = self.motion.of(&[
            (Some(SampleKind::Rotation), message.delta_theta),
            (None, message.rate),
            (None, message.raw_rate),
        ]);
        let time = message.time.or(message.gps_time);
        let mean = |velocity| mean_force(velocity, self.before, time);
        let force = message.force.or(message.raw_force);
        to.add(Sample {
            time,
            kind: motion.and_then(|(_, kind)| kind),
            rate: motion.map(|(rate, _)| flu(rate)),
            force: force.or_else(|| message.velocity.and_then(mean)).map(flu),
            field: message.field.or(message.raw_field).map(flu),
            orientation: message.quaternion.or(message.angles),
            unit: None,
        });
        if motion.is_some() {
            self.before = time;
        }
    }
}

fn binary(frame: &[u8]) -> Message {
    let groups = frame.get(1).map_or(0, |groups| groups.count_ones());
    let mut at = 2 + 2 * groups as usize;
    let mut message = Message::default();
    for (group, fields) in groups_of(frame) {
        for field in (0..16).filter(|field| fields >> field & 1 == 1) {
            read(group + 1, field, frame, at, &mut message);
            at += length_of(group, field);
        }
    }
    message
}

/// Reads the field of a group at its place.
fn read(group: usize, field: usize, frame: &[u8], at: usize, to: &mut Message) {
    let vector = |at| f32_le(frame, at);
    let time = || array(frame, at).map(u64::from_le_bytes);
    // Behind their interval, in degrees.
    let angles = || vector(at + 4).map(|angles| scaled(angles, 1f64.to_radians()));
    match (group, field) {
        (1 | 2, 0) => to.time = time(),
        (1 | 2, 1) => to.gps_time = time(),
        (1, 3) | (5, 1) => to.angles = vector(at).and_then(of_yaw_pitch_roll),
        (1, 4) | (5, 2) => to.quaternion = four(frame, at, f32::from_le_bytes).and_then(of_xyzw),
        (1, 5) | (3, 10) => to.rate = vector(at),
        (1, 8) | (3, 9) => to.force = vector(at),
        (1, 9) => (to.raw_force, to.raw_rate) = (vector(at), vector(at + 12)),
        (1, 10) | (3, 8) => to.field = vector(at),
        (1, 11) => (to.delta_theta, to.velocity) = (angles(), vector(at + 16)),
        (3, 1) => to.raw_field = vector(at),
        (3, 2) => to.raw_force = vector(at),
        (3, 3) => to.raw_rate = vector(at),
        (3, 6) => to.delta_theta = angles(),
        (3, 7) => to.velocity = vector(at),
        (3, 11) => {
            let flags = array(frame, at).map_or(0, u16::from_le_bytes);
            to.is_clipped = flags & CLIPPED != 0;
        }
        _ => {}
    }
}

/// Orientation of angles in degrees.
fn of_yaw_pitch_roll([yaw, pitch, roll]: [f64; 3]) -> Option<Orientation> {
    let q = of_angles(scaled([roll, pitch, yaw], 1f64.to_radians()))?;
    Some(of_ned(&q))
}

/// Orientation of a quaternion whose scalar is the last.
fn of_xyzw([x, y, z, w]: [f64; 4]) -> Option<Orientation> {
    Some(of_ned(&unit([w, x, y, z])?))
}

/// Message of an ASCII line that has field, force and rate one after another, some behind an orientation.
fn text(frame: &[u8]) -> Option<Message> {
    let text = std::str::from_utf8(frame).ok()?;
    let (body, _) = text.split_once('*')?;
    let mut cells = body.split(',');
    let skipped = match cells.next()? {
        "$VNYMR" => 3,
        "$VNQMR" => 4,
        "$VNIMU" => 0,
        _ => return None,
    };
    let numbers: Vec<f64> = cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    let at = |n: usize| {
        numbers
            .get(skipped + n..)
            .and_then(<[f64]>::first_chunk)
            .copied()
    };
    let angles = numbers.first_chunk().copied().filter(|_| skipped == 3);
    let quaternion = numbers.first_chunk().copied().filter(|_| skipped == 4);
    Some(Message {
        field: at(0),
        force: at(3),
        rate: at(6),
        angles: angles.and_then(of_yaw_pitch_roll),
        quaternion: quaternion.and_then(of_xyzw),
        ..Message::default()
    })
}
