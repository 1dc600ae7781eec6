//! Numbers of a state that another process has saved -> whether one can have known them. Pure.
//!
//! In one place because every stage asks the same of them: a file may say anything, and what is calculated with a
//! number out of it must neither overflow nor stay wrong without an end.

/// Largest number of a state, SI units. Beyond what decades of operation add up to (30,000 years in s, 1000 rad/s for
/// 30 years in rad, nothing known of the heading at 10^11 gaps in rad^2), and so small that the products of a
/// dozen such numbers are finite.
pub const LARGEST: f64 = 1e12;
/// Rounding of a variance of zero, and share by which a correlation may exceed one for the same reason.
const ROUNDING: f64 = 1e-12;
const ROUNDING_SHARE: f64 = 1e-6;

/// Whether each is a number no larger than [`LARGEST`].
pub(crate) fn are_numbers<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> bool {
    numbers.into_iter().all(|number| number.abs() <= LARGEST)
}

/// Whether it is a time, a sum of squares or a length.
pub(crate) fn is_amount(number: f64) -> bool {
    (0.0..=LARGEST).contains(&number)
}

/// Whether it is a rotation, w, x, y, z.
#[must_use]
pub fn is_unit(q: &[f64; 4]) -> bool {
    let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    (norm - 1.0).abs() < 1e-6
}

/// Whether the numbers xx, xy, xz, yy, yz, zz are a covariance: no variance below zero, no correlation above one.
#[must_use]
pub fn is_covariance(&[xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> bool {
    let is_variance = |v: f64| (-ROUNDING..=LARGEST).contains(&v);
    let is_within = |both: f64, a: f64, b: f64| {
        both.powi(2) <= a.max(0.0) * b.max(0.0) * (1.0 + ROUNDING_SHARE) + ROUNDING
    };
    [xx, yy, zz].into_iter().all(is_variance)
        && is_within(xy, xx, yy)
        && is_within(xz, xx, zz)
        && is_within(yz, yy, zz)
}
