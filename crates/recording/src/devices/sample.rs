//! Numbers of a frame -> a line of a daemon, or messages of a recording. Pure.
//!
//! Apart from the protocols so that none of them knows how a sample is told.

use crate::records::cdr::{Cdr, put};
use crate::records::imu;
use std::fmt::Write;
use strapd_attitude::record::SampleKind;

/// A sample in SI; x forward, y left, z up.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Sample {
    /// Number of the device, where a link carries several.
    pub(super) unit: Option<u8>,
    /// Time by the device's clock, ns; `None` where it has none.
    pub(super) time: Option<u64>,
    /// Meaning of the rate, where the protocol says it.
    pub(super) kind: Option<SampleKind>,
    /// Body rate, rad/s, or by its kind an angle, rad.
    pub(super) rate: Option<[f64; 3]>,
    /// Specific force, m/s^2.
    pub(super) force: Option<[f64; 3]>,
    /// Magnetic field, in the device's unit.
    pub(super) field: Option<[f64; 3]>,
    /// The device's own orientation `[w, x, y, z]`, sensor to east, north, up.
    pub(super) orientation: Option<[f64; 4]>,
}

/// Outcome of frames.
#[derive(Debug, Default)]
pub(crate) struct Taken {
    pub(super) samples: Vec<Sample>,
    /// Samples that the device has numbered, or begun, and that did not come.
    pub(super) missing: u64,
    /// Samples in which the device reports an axis at its end.
    pub(super) clipped: u64,
}

impl Taken {
    /// Adds a sample, if its numbers are some.
    pub(super) fn add(&mut self, sample: Sample) {
        let vectors = [sample.rate, sample.force, sample.field];
        let mut numbers = vectors.iter().flatten().flatten();
        if numbers.all(|number| number.is_finite())
            && (sample.rate.is_some() || sample.field.is_some())
        {
            self.samples.push(sample);
        }
    }
}

/// Name of a sensor of several on one link.
pub(super) fn name(of: &str, unit: Option<u8>) -> String {
    match unit {
        None => of.to_owned(),
        Some(unit) if unit.is_ascii_graphic() => format!("{of}/{}", char::from(unit)),
        Some(unit) => format!("{of}/{unit:02x}"),
    }
}

impl Sample {
    /// Appends the line that a daemon reads. Floats are the shortest decimals that read back to the same bits.
    pub(super) fn line(&self, id: &str, to: &mut Vec<u8>) {
        let mut line = format!("{{\"id\":{}", serde_json::Value::String(id.to_owned()));
        // A String takes every write.
        if let Some(time) = self.time {
            let (sec, nsec) = (time / 1_000_000_000, time % 1_000_000_000);
            let _ = write!(line, ",\"stamp\":{{\"sec\":{sec},\"nsec\":{nsec}}}");
        }
        let vectors = [
            ("gyro", self.rate),
            ("accel", self.force),
            ("mag", self.field),
        ];
        for (name, vector) in vectors {
            if let Some([x, y, z]) = vector {
                let _ = write!(line, ",\"{name}\":[{x},{y},{z}]");
            }
        }
        if let Some(kind) = self.kind {
            let _ = write!(line, ",\"sample_kind\":\"{}\"", kind.name());
        }
        line.push_str("}\n");
        to.extend_from_slice(line.as_bytes());
    }

    /// Writes the rate with what belongs to it in place of what is in `out`, as ROS's `Imu`.
    pub(super) fn imu(&self, rate: [f64; 3], out: &mut Vec<u8>) {
        imu::imu(out, (self.time.unwrap_or(0), FRAME), rate, self.force);
        if let Some([w, x, y, z]) = self.orientation {
            let (_, _, numbers) = imu::empty(Cdr::default(), FRAME);
            let numbers = out.get_mut(numbers..).unwrap_or_default();
            put(numbers, imu::ORIENTATION, [x, y, z, w, 0.0]);
        }
    }

    /// Writes the field in place of what is in `out`, as ROS's `MagneticField`.
    pub(super) fn magnetic(&self, field: [f64; 3], out: &mut Vec<u8>) {
        let mut cdr = Cdr::within(std::mem::take(out));
        let stamp = cdr.stamp();
        cdr.string(FRAME);
        // Of its covariance nothing is known: zeros.
        let numbers = cdr.numbers(3 + 9);
        *out = cdr.into_bytes();
        let time = self.time.unwrap_or(0);
        let secs = i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX);
        let nanos = (time % 1_000_000_000) as u32;
        let both = [secs.to_le_bytes(), nanos.to_le_bytes()].concat();
        if let Some(place) = out.get_mut(stamp..stamp + 8) {
            place.copy_from_slice(&both);
        }
        put(out.get_mut(numbers..).unwrap_or_default(), 0, field);
    }
}

/// Name of the frame.
const FRAME: &str = "sensor";
