//! A sample as the sweep wants it.

use nalgebra::Vector3;

/// Number of samples on both sides of a gap that tell how the rate goes on.
pub(super) const BESIDE: usize = 5;
/// A sample as the sweep wants it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub stamp: i64,
    /// Time since the one before, s.
    pub secs: f64,
    /// Mean since the one before, rad/s.
    pub rate: Vector3<f64>,
    pub force: Vector3<f64>,
    /// NaN where none was measured.
    pub field: Vector3<f64>,
    /// Index of the one of the input, or of the one it comes before.
    pub input: u64,
    pub is_input: bool,
    /// Nothing is known of the time before it.
    pub is_after_break: bool,
    /// A gap before it was bridged.
    pub is_bridged: bool,
    /// Whether the rate is that of the end of the gyro's range.
    pub is_saturated: bool,
    /// Variance of the rotation that this leaves about each axis of the body, rad^2.
    pub clipped: Vector3<f64>,
    /// Variance that a gap before it, and motion faster than the samples, leave of attitude and velocity: rad^2,
    /// (m/s)^2.
    pub doubt: [f64; 2],
}
