//! A packet of Xsens' MTData2 -> a sample. Pure.
//!
//! A device sends what it was told to: rates, rotations over the interval (`DeltaQ`), or both, several of them at several
//! frequencies. One of them is taken, by the first packet that has any, the rotations before the rates: they hold what
//! the axis did between two packets. Axes are x forward, y left, z up where the sensor's frame was not turned.
//!
//! # Source
//! MT Low Level Communication Protocol Documentation (MT0101P), "MTData2": identifiers, number formats, coordinate
//! systems, `StatusWord`. Captures with decoded numbers: testdata of github.com/einride/xsens-go (MIT).

use super::Device;
use super::clock::{Counter, Packets, mean_force};
use super::frame::{Cut, LONGEST, may_begin, sum};
use super::motion::Choice;
use super::numbers::array;
use super::sample::{Sample, Taken};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::SampleKind;

/// Preamble, bus and message.
const MARK: [u8; 3] = [0xfa, 0xff, 0x36];
/// Longest data that are believed; the longest packets of an MTi have a tenth of it.
const LONGEST_DATA: usize = 2048;
/// Length that says that the length is in the next two bytes.
const EXTENDED: u8 = 0xff;
/// Flags of [`Item::Status`] that say that an axis of accelerometer or gyro is at its end.
const CLIPPED: u32 = 0x3f << 8;
/// Nanoseconds of a step of `SampleTimeFine`.
const FINE: u64 = 100_000;

/// Cuts a packet.
pub(super) fn cut(bytes: &[u8]) -> Cut {
    if !may_begin(bytes, &MARK) {
        return Cut::No;
    }
    let (head, length) = match bytes {
        [_, _, _, EXTENDED, high, low, ..] => (6, usize::from(u16::from_be_bytes([*high, *low]))),
        [_, _, _, EXTENDED, ..] => return Cut::Need(6),
        [_, _, _, length, ..] => (4, usize::from(*length)),
        _ => return Cut::Need(4),
    };
    let total = head + length + 1;
    if length > LONGEST_DATA || total > LONGEST {
        return Cut::No;
    }
    match bytes.get(1..total) {
        None => Cut::Need(total),
        Some(summed) => Cut::checked(sum(summed) == 0, total),
    }
}

/// A sensor.
#[derive(Debug)]
pub(super) struct Xsens {
    packets: Packets,
    clock: Counter,
    motion: Choice,
    /// Time of the sample before, and whether nothing is missing since.
    before: Option<u64>,
}

impl Default for Xsens {
    fn default() -> Xsens {
        Xsens {
            packets: Packets::default(),
            clock: Counter::of(32),
            motion: Choice::default(),
            before: None,
        }
    }
}

/// Contents of a packet.
#[derive(Debug, Default)]
struct Packet {
    time: Option<u64>,
    delta_q: Option<[f64; 4]>,
    rate: Option<[f64; 3]>,
    rate_hr: Option<[f64; 3]>,
    force: Option<[f64; 3]>,
    velocity: Option<[f64; 3]>,
    field: Option<[f64; 3]>,
    orientation: Option<[f64; 4]>,
    is_clipped: bool,
}

impl Device for Xsens {
    fn take(&mut self, frame: &[u8], to: &mut Taken) {
        let head = if frame.get(3) == Some(&EXTENDED) {
            6
        } else {
            4
        };
        let end = frame.len().saturating_sub(1);
        let mut rest = frame.get(head..end).unwrap_or(&[]);
        let mut packet = Packet::default();
        while let [high, low, length, data @ ..] = rest {
            let Some((item, behind)) = data.split_at_checked(usize::from(*length)) else {
                break;
            };
            self.item(u16::from_be_bytes([*high, *low]), item, &mut packet, to);
            rest = behind;
        }
        to.clipped += u64::from(packet.is_clipped);
        self.tell(&packet, to);
    }
}

impl Xsens {
    fn item(&mut self, id: u16, data: &[u8], packet: &mut Packet, to: &mut Taken) {
        let form = id & 3;
        let vector = || numbers::<3>(data, form);
        match id & 0xfff0 {
            0x1020 => {
                if let Some(number) = array(data, 0).map(u16::from_be_bytes) {
                    let missing = self.packets.missing(number);
                    to.missing += missing;
                    if missing > 0 {
                        self.before = None;
                    }
                }
            }
            0x1060 => {
                let count = array(data, 0).map(u32::from_be_bytes);
                packet.time = count.map(|n| self.clock.goes_on(u64::from(n)).saturating_mul(FINE));
            }
            // East, north, up; what was turned into another world is left out.
            0x2010 if id & 0xc == 0 => packet.orientation = numbers::<4>(data, form),
            0x4010 => packet.velocity = vector(),
            0x4020 => packet.force = vector(),
            0x4040 => packet.force = packet.force.or_else(vector),
            0x8020 => packet.rate = vector(),
            0x8030 => packet.delta_q = numbers::<4>(data, form),
            0x8040 => packet.rate_hr = vector(),
            0xc020 => packet.field = vector(),
            0xe020 => {
                let word = array(data, 0).map_or(0, u32::from_be_bytes);
                packet.is_clipped = word & CLIPPED != 0;
            }
            _ => {}
        }
    }

    fn tell(&mut self, packet: &Packet, to: &mut Taken) {
        let motion = self.motion.of(&[
            (
                Some(SampleKind::Rotation),
                packet.delta_q.and_then(rotation_vector),
            ),
            (None, packet.rate),
            (None, packet.rate_hr),
        ]);
        let Some((rate, kind)) = motion else {
            return self.tell_rest(packet, to);
        };
        let mean = |velocity| mean_force(velocity, self.before, packet.time);
        to.add(Sample {
            unit: None,
            time: packet.time,
            kind,
            rate: Some(rate),
            force: packet.force.or_else(|| packet.velocity.and_then(mean)),
            field: packet.field,
            orientation: packet.orientation,
        });
        self.before = packet.time;
    }

    /// Tells field and orientation of a packet without motion.
    fn tell_rest(&self, packet: &Packet, to: &mut Taken) {
        to.add(Sample {
            time: packet.time,
            field: packet.field,
            orientation: packet.orientation,
            ..Sample::default()
        });
    }
}

/// Numbers in one of the four forms: f32, fixed point with 20 or 32 bits behind the point, f64.
fn numbers<const N: usize>(data: &[u8], form: u16) -> Option<[f64; N]> {
    let size = match form {
        0 | 1 => 4,
        2 => 6,
        _ => 8,
    };
    let mut out = [0.0; N];
    for (n, value) in out.iter_mut().enumerate() {
        let at = n * size;
        *value = match form {
            0 => f64::from(f32::from_be_bytes(array(data, at)?)),
            1 => f64::from(i32::from_be_bytes(array(data, at)?)) / f64::from(1 << 20),
            // The fraction comes first, then the whole part.
            2 => {
                let fraction = u32::from_be_bytes(array(data, at)?);
                let whole = i16::from_be_bytes(array(data, at + 4)?);
                f64::from(whole) + f64::from(fraction) / 4_294_967_296.0
            }
            _ => f64::from_be_bytes(array(data, at)?),
        };
    }
    (data.len() == N * size).then_some(out)
}

/// Rotation vector of a quaternion `[w, x, y, z]`; `None` of one that is no rotation.
fn rotation_vector(wxyz: [f64; 4]) -> Option<[f64; 3]> {
    let norm = wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
    let turn = Quaternion::<(), ()>::try_from_wxyz(wxyz).ok()?;
    let is_unit = (0.9..1.1).contains(&norm);
    is_unit.then(|| turn.rotation_vector().0.into())
}
