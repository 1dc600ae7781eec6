//! Packets of a MicroStrain sensor (MIP) -> a sample. Pure.
//!
//! A packet is fields of one set; those of set 0x80 are read, and of set 0x82 the orientation. Delta angles are taken before rates, by the first packet
//! that has either. Axes are forward, right, down on the wire, accelerations in g.
//!
//! # Source
//! 3DM-GX5/CV7 Data Communications Protocol (MicroStrain by HBK): sets, fields, checksum. Numbers of fields as in the
//! maker's library (PyPI `pymscl` 68.4, `MipTypes`); the public crate of mcbridejc/microstrain-inertial reads the same.
//! An orientation q turns the vehicle to north, east, down: v_vehicle = q^-1 v_ned q (Data Communications Protocol, 0x82 0x03).

use super::Device;
use super::clock::{Counter, mean_force};
use super::frame::{Cut, may_begin};
use super::motion::Choice;
use super::numbers::{G, array, f32_be, four, scaled};
use super::orientation::{Orientation, of_angles, of_ned, unit};
use super::sample::{Sample, Taken};
use crate::records::imu::flu;
use strapd_attitude::record::SampleKind;

const MARK: [u8; 2] = [0x75, 0x65];
/// Set of the sensors.
const SENSORS: u8 = 0x80;
/// Set of the filter.
const FILTER: u8 = 0x82;
/// Nanoseconds of a tick of the internal clock: 62.5 kHz.
const TICK: u64 = 16_000;
/// Seconds of a week.
const WEEK: u64 = 604_800;
/// Seconds from 1970 to the beginning of GPS time.
const GPS: u64 = 315_964_800;
/// Flags of the field of overrange: axes of accelerometer and gyro.
const CLIPPED: u16 = 0x0077;

/// Cuts a packet.
pub(super) fn cut(bytes: &[u8]) -> Cut {
    if !may_begin(bytes, &MARK) {
        return Cut::No;
    }
    let Some(length) = bytes.get(3) else {
        return Cut::Need(4);
    };
    let end = 4 + usize::from(*length);
    let total = end + 2;
    match (bytes.get(..end), array(bytes, end)) {
        (Some(summed), Some(stated)) => {
            let set = bytes.get(2).copied().unwrap_or(0);
            match fletcher(summed) == stated {
                // Answers to commands are packets, too.
                true => Cut::Frame {
                    total,
                    tells: set >= SENSORS,
                },
                false => Cut::No,
            }
        }
        _ => Cut::Need(total),
    }
}

/// Fletcher's checksum in two bytes.
fn fletcher(bytes: &[u8]) -> [u8; 2] {
    bytes.iter().fold([0, 0], |[one, two]: [u8; 2], byte| {
        let one = one.wrapping_add(*byte);
        [one, two.wrapping_add(one)]
    })
}

/// A sensor.
#[derive(Debug)]
pub(super) struct Mip {
    ticks: Counter,
    motion: Choice,
    /// Time of the sample before.
    before: Option<u64>,
}

impl Default for Mip {
    fn default() -> Mip {
        Mip {
            ticks: Counter::of(32),
            motion: Choice::default(),
            before: None,
        }
    }
}

/// Contents of a packet.
#[derive(Debug, Default)]
struct Packet {
    reference: Option<u64>,
    gps: Option<u64>,
    internal: Option<u64>,
    angle: Option<[f64; 3]>,
    rate: Option<[f64; 3]>,
    force: Option<[f64; 3]>,
    velocity: Option<[f64; 3]>,
    field: Option<[f64; 3]>,
    quaternion: Option<Orientation>,
    angles: Option<Orientation>,
    is_clipped: bool,
}

impl Device for Mip {
    fn take(&mut self, frame: &[u8], to: &mut Taken) {
        let Some(&set @ (SENSORS | FILTER)) = frame.get(2) else {
            return;
        };
        let mut rest = frame.get(4..frame.len().saturating_sub(2)).unwrap_or(&[]);
        let mut packet = Packet::default();
        // A field's length counts its own two bytes of head.
        while let [length, ..] = rest {
            let Some((field, behind)) = rest.split_at_checked(usize::from(*length).max(1)) else {
                break;
            };
            if let [_, descriptor, data @ ..] = field {
                match set {
                    SENSORS => self.field(*descriptor, data, &mut packet),
                    _ => filtered(*descriptor, data, &mut packet),
                }
            }
            rest = behind;
        }
        to.clipped += u64::from(packet.is_clipped);
        self.tell(&packet, to);
    }
}

impl Mip {
    fn field(&mut self, descriptor: u8, data: &[u8], packet: &mut Packet) {
        let vector = || f32_be(data, 0);
        match descriptor {
            0x04 => packet.force = vector(),
            0x05 => packet.rate = vector(),
            0x06 => packet.field = vector(),
            0x07 => packet.angle = vector(),
            0x08 => packet.velocity = vector(),
            0x0a => packet.quaternion = of_wxyz(data),
            0x0c => packet.angles = of_roll_pitch_yaw(data),
            0x0e => {
                let count = array(data, 0).map(u32::from_be_bytes);
                let ticks = count.map(|n| self.ticks.goes_on(u64::from(n)));
                packet.internal = ticks.map(|ticks| ticks.saturating_mul(TICK));
            }
            0x12 | 0xd3 => packet.gps = gps(data),
            0x18 => {
                let flags = array(data, 0).map_or(0, u16::from_be_bytes);
                packet.is_clipped = flags & CLIPPED != 0;
            }
            0xd5 => packet.reference = array(data, 0).map(u64::from_be_bytes),
            _ => {}
        }
    }

    fn tell(&mut self, packet: &Packet, to: &mut Taken) {
        let motion = self.motion.of(&[
            (Some(SampleKind::DeltaAngle), packet.angle),
            (None, packet.rate),
        ]);
        let time = packet.reference.or(packet.gps).or(packet.internal);
        let mean = |velocity| mean_force(velocity, self.before, time);
        let force = packet.force.or_else(|| packet.velocity.and_then(mean));
        to.add(Sample {
            time,
            kind: motion.and_then(|(_, kind)| kind),
            rate: motion.map(|(rate, _)| flu(rate)),
            force: force.map(|force| flu(scaled(force, G))),
            field: packet.field.map(flu),
            orientation: packet.quaternion.or(packet.angles),
            unit: None,
        });
        if motion.is_some() {
            self.before = time;
        }
    }
}

/// Reads a field of the filter's set; an orientation is followed by whether it is valid.
fn filtered(descriptor: u8, data: &[u8], packet: &mut Packet) {
    let is_valid = |at| array(data, at).is_some_and(|flags| u16::from_be_bytes(flags) != 0);
    match descriptor {
        0x03 if is_valid(16) => packet.quaternion = of_wxyz(data),
        0x05 if is_valid(12) => packet.angles = of_roll_pitch_yaw(data),
        0x11 | 0xd3 => packet.gps = gps(data),
        0xd5 => packet.reference = array(data, 0).map(u64::from_be_bytes),
        _ => {}
    }
}

fn of_wxyz(data: &[u8]) -> Option<Orientation> {
    Some(of_ned(&unit(four(data, 0, f32::from_be_bytes)?)?))
}

fn of_roll_pitch_yaw(data: &[u8]) -> Option<Orientation> {
    Some(of_ned(&of_angles(f32_be(data, 0)?)?))
}

/// Nanoseconds since 1970, without leap seconds, of a time of week and a week; `None` of a time that cannot be.
fn gps(data: &[u8]) -> Option<u64> {
    let seconds = f64::from_be_bytes(array(data, 0)?);
    let week = u64::from(u16::from_be_bytes(array(data, 8)?));
    let fits = (0.0..WEEK as f64).contains(&seconds);
    let whole = GPS + week * WEEK;
    // In a week a step of f64 is 0.1 ns.
    fits.then(|| whole * 1_000_000_000 + (seconds * 1e9) as u64)
}
