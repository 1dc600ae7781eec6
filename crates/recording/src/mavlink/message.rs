//! The payload of a message -> a sample. Pure.
//!
//! Apart from the frames because here is all that is known of single messages: their numbers, their fields, their
//! units.

use crate::records::Bytes;
use crate::records::imu::flu;

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
    /// rad/s; x forward, y left, z up.
    pub(super) rate: [f64; 3],
    /// m/s^2.
    pub(super) force: [f64; 3],
}

/// Number, name, and so on.
const KNOWN: [(u32, MessageSpec); 6] = [
    (0, known("HEARTBEAT", 50, Form::Other)),
    (26, known("SCALED_IMU", 170, Form::Scaled)),
    (27, known("RAW_IMU", 144, Form::Raw)),
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
        let mut sample = Sample {
            time: 0,
            sensor: 0,
            rate: [0.0; 3],
            force: [0.0; 3],
        };
        match self.form {
            Form::Other => return None,
            Form::Scaled => sample.time = u64::from(bytes.u32()?) * 1_000_000,
            Form::Raw | Form::HighRes => sample.time = bytes.u64()?.saturating_mul(1000),
        }
        if self.form == Form::HighRes {
            let mut number = || Some(f64::from(f32::from_bits(bytes.u32()?)));
            let mut vector = || Some([number()?, number()?, number()?]);
            (sample.force, sample.rate) = (vector()?, vector()?);
            // Behind three of the field, three pressures, a temperature, and which of them are new.
            sample.sensor = *whole.get(62)?;
        } else {
            let mut number = || Some(f64::from(bytes.u16()?.cast_signed()));
            let mut vector =
                |unit: f64| Some([number()? * unit, number()? * unit, number()? * unit]);
            (sample.force, sample.rate) = (vector(MILLI_G)?, vector(1e-3)?);
            if self.form == Form::Raw {
                sample.sensor = *whole.get(26)?;
            }
        }
        // The protocol's axes are forward, right, down.
        (sample.rate, sample.force) = (flu(sample.rate), flu(sample.force));
        Some(sample)
    }
}
