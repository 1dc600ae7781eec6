//! Numbers of a frame -> a line of a daemon, or messages of a recording. Pure.
//!
//! Apart from the protocols so that none of them knows how a sample is told.

use crate::records::cdr::put;
use crate::records::imu;
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
    pub(super) fn add(&mut self, mut sample: Sample) {
        // A device that has not settled sends its orientation as none, and its rates all the same.
        let is_finite = |q: &[f64; 4]| q.iter().all(|number| number.is_finite());
        sample.orientation = sample.orientation.filter(is_finite);
        let vectors = [sample.rate, sample.force, sample.field];
        let mut numbers = vectors.iter().flatten().flatten();
        let is_some = sample.has_motion() || sample.orientation.is_some();
        if numbers.all(|number| number.is_finite()) && is_some {
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
    /// Whether it has what a filter takes: a rate or a field.
    pub(super) fn has_motion(&self) -> bool {
        self.rate.is_some() || self.field.is_some()
    }

    /// Appends the line that a daemon reads.
    pub(super) fn line(&self, id: &str, to: &mut Vec<u8>) {
        let vectors = [
            ("gyro", self.rate),
            ("accel", self.force),
            ("mag", self.field),
        ];
        imu::line(to, (id, self.time), &vectors, self.kind);
    }

    /// Writes the rate with what belongs to it in place of what is in `out`, as ROS's `Imu`.
    pub(super) fn imu(&self, rate: [f64; 3], out: &mut Vec<u8>) {
        let place = imu::imu(out, self.header(), rate, self.force);
        if let Some([w, x, y, z]) = self.orientation {
            // Behind it the first number of its covariance, which is no longer absent.
            let numbers = out.get_mut(place..).unwrap_or_default();
            put(numbers, imu::ORIENTATION, [x, y, z, w, 0.0]);
        }
    }

    /// Writes the orientation in place of what is in `out`, as ROS's `QuaternionStamped`.
    pub(super) fn attitude(&self, [w, x, y, z]: [f64; 4], out: &mut Vec<u8>) {
        imu::attitude(out, self.header(), [x, y, z, w]);
    }

    /// Writes the field in place of what is in `out`, as ROS's `MagneticField`.
    pub(super) fn magnetic(&self, field: [f64; 3], out: &mut Vec<u8>) {
        imu::field(out, self.header(), field);
    }

    fn header(&self) -> (u64, &'static str) {
        (self.time.unwrap_or(0), FRAME)
    }
}

/// Name of the frame.
const FRAME: &str = "sensor";
