//! `sensor_msgs/msg/Imu`: the places of its numbers, and a rate and a force -> its bytes in CDR. Pure.
//!
//! Apart from who reads and who writes it, so that the places are said once: the decoders, the containers whose samples
//! have layouts of their own, which are told as this, and the outputs.

use super::cdr::{Cdr, put};

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

/// Writes a message in place of what is in `out`: stamp in ns, rate in rad/s, force in m/s^2, no orientation.
pub(crate) fn imu(
    out: &mut Vec<u8>,
    (time, frame): (u64, &str),
    rate: [f64; 3],
    force: Option<[f64; 3]>,
) {
    let (mut message, stamp, numbers) = empty(Cdr::within(std::mem::take(out)), frame);
    let secs = i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX);
    let nanos = (time % 1_000_000_000) as u32;
    if let Some(place) = message.get_mut(stamp..stamp + 8) {
        place[..4].copy_from_slice(&secs.to_le_bytes());
        place[4..].copy_from_slice(&nanos.to_le_bytes());
    }
    let numbers = message.get_mut(numbers..).unwrap_or_default();
    put(numbers, ORIENTATION + 3, [1.0, -1.0]);
    put(numbers, RATE, rate);
    match force {
        Some(force) => put(numbers, FORCE, force),
        None => put(numbers, FORCE_COVARIANCE, [-1.0]),
    }
    *out = message;
}
