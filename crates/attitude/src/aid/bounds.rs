//! Bound of what a state may hold that was saved by somebody else. Pure.

/// Largest sum over an interval between corrections, speed, position or field, SI units.
pub(super) const LARGEST: f64 = 1e9;
