//! A sample of containers and links that have layouts of their own -> the bytes of ROS's messages, or a line. Of
//! `sensor_msgs/msg/Imu` also the places of its numbers. Pure.
//!
//! Apart from who reads and who writes it, so that the places are said once: the decoders, the containers whose samples
//! have layouts of their own, which are told as this, and the outputs.

use super::cdr::{Cdr, put, stamped};
use std::fmt::Write;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::SampleKind;

/// The type.
pub(crate) const TYPE: &str = "sensor_msgs/msg/Imu";

/// Places among the f64 behind the header: the orientation (x, y, z, w), the rate and the specific force, each with its
/// covariance behind it, whose first number is -1 where it is absent (REP-145).
pub const ORIENTATION: usize = 0;
/// The covariance of the orientation.
pub const ORIENTATION_COVARIANCE: usize = ORIENTATION + 4;
/// The body rate, rad/s.
pub const RATE: usize = ORIENTATION_COVARIANCE + 9;
/// The covariance of the rate.
pub const RATE_COVARIANCE: usize = RATE + 3;
/// The specific force, m/s^2.
pub const FORCE: usize = RATE_COVARIANCE + 9;
/// The covariance of the specific force.
pub const FORCE_COVARIANCE: usize = FORCE + 3;
/// Number of them.
pub const NUMBERS: usize = FORCE_COVARIANCE + 9;

/// A message of zeros, with the places of its stamp and of its numbers.
#[must_use]
pub fn empty(mut cdr: Cdr, frame_id: &str) -> (Vec<u8>, usize, usize) {
    let stamp = cdr.stamp();
    cdr.string(frame_id);
    let numbers = cdr.numbers(NUMBERS);
    (cdr.into_bytes(), stamp, numbers)
}

/// Writes a message in place of what is in `out`: stamp in ns, rate in rad/s, force in m/s^2, no orientation. Returns the
/// place of its numbers.
pub(crate) fn imu(
    out: &mut Vec<u8>,
    header: (u64, &str),
    rate: [f64; 3],
    force: Option<[f64; 3]>,
) -> usize {
    let place = stamped(out, header, NUMBERS);
    let numbers = out.get_mut(place..).unwrap_or_default();
    put(numbers, ORIENTATION + 3, [1.0, -1.0]);
    put(numbers, RATE, rate);
    match force {
        Some(force) => put(numbers, FORCE, force),
        None => put(numbers, FORCE_COVARIANCE, [-1.0]),
    }
    place
}

/// Type of a magnetic field.
pub(crate) const FIELD_TYPE: &str = "sensor_msgs/msg/MagneticField";

/// Writes a magnetic field in place of what is in `out`. Of its covariance nothing is known: zeros.
pub(crate) fn field(out: &mut Vec<u8>, header: (u64, &str), field: [f64; 3]) {
    let place = stamped(out, header, 3 + 9);
    put(out.get_mut(place..).unwrap_or_default(), 0, field);
}

/// Type of an attitude alone.
pub(crate) const ATTITUDE_TYPE: &str = "geometry_msgs/msg/QuaternionStamped";

/// Writes an attitude, x, y, z, w, in place of what is in `out`.
pub(crate) fn attitude(out: &mut Vec<u8>, header: (u64, &str), q: [f64; 4]) {
    let place = stamped(out, header, 4);
    put(out.get_mut(place..).unwrap_or_default(), 0, q);
}

/// A body with x forward, y right, z down to a world with x north, y east, z down, as one with y left and z up to a world
/// with y west and z up, x, y, z, w.
pub(crate) fn nwu_of_ned(q: &Quaternion<(), ()>) -> [f64; 4] {
    let [w, x, y, z] = q.wxyz();
    [x, -y, -z, w]
}

/// Forward, right, down as forward, left, up.
pub(crate) fn flu([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -y, -z]
}

/// Appends a sample as a line that a daemon reads: its sensor, its stamp in ns, vectors by their names, and what it is.
/// Floats are the shortest decimals that read back to the same bits.
pub(crate) fn line(
    to: &mut Vec<u8>,
    (id, time): (&str, Option<u64>),
    vectors: &[(&str, Option<[f64; 3]>)],
    kind: Option<SampleKind>,
) {
    let mut line = format!("{{\"id\":{}", serde_json::Value::String(id.to_owned()));
    // A String takes every write.
    if let Some(time) = time {
        let (sec, nsec) = (time / 1_000_000_000, time % 1_000_000_000);
        let _ = write!(line, ",\"stamp\":{{\"sec\":{sec},\"nsec\":{nsec}}}");
    }
    for (name, vector) in vectors {
        if let Some([x, y, z]) = vector {
            let _ = write!(line, ",\"{name}\":[{x},{y},{z}]");
        }
    }
    if let Some(kind) = kind {
        let _ = write!(line, ",\"sample_kind\":\"{}\"", kind.name());
    }
    line.push_str("}\n");
    to.extend_from_slice(line.as_bytes());
}
