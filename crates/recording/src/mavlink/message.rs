//! The payload of a message -> a sample. Pure.
//!
//! Apart from the frames because here is all that is known of single messages: their numbers, their fields, their
//! units.

use crate::records::Bytes;
use crate::records::imu::{flu, nwu_of_ned};
use strapd_attitude::quaternion::{Quaternion, YawPitchRoll};

/// Standard gravity, m/s^2, of which forces are thousandths.
const MILLI_G: f64 = 9.806_65e-3;

/// A message that is read.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct MessageSpec {
    pub(super) name: &'static str,
    /// Number made of the fields that the checksum has beside the frame.
    extra: u8,
    form: Form,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Form {
    /// ms, then thousandths.
    Scaled,
    /// us, then the same, in what unit MAVLink does not say.
    Raw,
    /// us, then SI.
    HighRes,
    /// ms, then roll, pitch and yaw, rad.
    Angles,
    /// ms, then a rotation.
    Rotation,
    /// Looked at for its checksum alone.
    Other,
}

/// A sample of a message.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Sample {
    /// Time since the vehicle was switched on, or since 1970, ns.
    pub(super) time: u64,
    /// Index of the sensor, where the message states it.
    pub(super) sensor: u8,
    pub(super) content: Content,
}

/// Content of a sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Content {
    /// rad/s and m/s^2; x forward, y left, z up.
    Imu { rate: [f64; 3], force: [f64; 3] },
    /// Attitude of the vehicle by its own estimate, x, y, z, w: such a body to a world with x north, y west, z up.
    Attitude([f64; 4]),
}

/// Number, name, and so on.
const KNOWN: [(u32, MessageSpec); 8] = [
    (0, known("HEARTBEAT", 50, Form::Other)),
    (26, known("SCALED_IMU", 170, Form::Scaled)),
    (27, known("RAW_IMU", 144, Form::Raw)),
    (30, known("ATTITUDE", 39, Form::Angles)),
    (31, known("ATTITUDE_QUATERNION", 246, Form::Rotation)),
    (105, known("HIGHRES_IMU", 93, Form::HighRes)),
    (116, known("SCALED_IMU2", 76, Form::Scaled)),
    (129, known("SCALED_IMU3", 46, Form::Scaled)),
];

const fn known(name: &'static str, extra: u8, form: Form) -> MessageSpec {
    MessageSpec { name, extra, form }
}

/// A message by its number.
pub(super) fn of(number: u32) -> Option<MessageSpec> {
    let mut known = KNOWN.iter();
    known.find(|(n, _)| *n == number).map(|(_, known)| *known)
}

/// Number that its checksum needs beside the frame.
pub(super) fn checksum_of(number: u32) -> Option<u8> {
    of(number).map(|known| known.extra)
}

impl MessageSpec {
    /// The unit of its rates, where the protocol does not say it.
    pub(super) fn assumed(self) -> Option<&'static str> {
        (self.form == Form::Raw).then_some("mrad/s and mg, as ArduPilot sends them")
    }

    /// The sample in a payload, which lacks the zeros at its end; `None` for a message without one.
    pub(super) fn sample(self, payload: &[u8]) -> Option<Sample> {
        let mut whole = [0; 64];
        let length = payload.len().min(whole.len());
        whole
            .get_mut(..length)?
            .copy_from_slice(payload.get(..length)?);
        let mut bytes = Bytes::new(&whole);
        let time = match self.form {
            Form::Other => return None,
            Form::Scaled | Form::Angles | Form::Rotation => u64::from(bytes.u32()?) * 1_000_000,
            Form::Raw | Form::HighRes => bytes.u64()?.saturating_mul(1000),
        };
        let mut float = || Some(f64::from(f32::from_bits(bytes.u32()?)));
        let (force, rate) = match self.form {
            Form::Angles => {
                let (roll, pitch, yaw) = (float()?, float()?, float()?);
                let q = Quaternion::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll });
                return Some(attitude(time, q));
            }
            Form::Rotation => {
                let q = [float()?, float()?, float()?, float()?];
                return Some(attitude(time, Quaternion::assume_unit(q)));
            }
            Form::HighRes => {
                let mut vector = || Some([float()?, float()?, float()?]);
                (vector()?, vector()?)
            }
            _ => {
                let mut number = || Some(f64::from(bytes.u16()?.cast_signed()));
                let mut vector =
                    |unit: f64| Some([number()? * unit, number()? * unit, number()? * unit]);
                (vector(MILLI_G)?, vector(1e-3)?)
            }
        };
        let sensor = match self.form {
            // Behind three of the field, three pressures, a temperature, and which of them are new.
            Form::HighRes => *whole.get(62)?,
            Form::Raw => *whole.get(26)?,
            _ => 0,
        };
        // The protocol's axes are forward, right, down.
        let (rate, force) = (flu(rate), flu(force));
        Some(Sample {
            time,
            sensor,
            content: Content::Imu { rate, force },
        })
    }
}

/// The sample of an attitude.
fn attitude(time: u64, of_aviation: Quaternion<(), ()>) -> Sample {
    Sample {
        time,
        sensor: 0,
        content: Content::Attitude(nwu_of_ned(&of_aviation)),
    }
}
