//! Parameters that no motion of a body can have. Pure.
//!
//! Below the bodies, which refuse them, and the motions, which are made of bodies.

use std::fmt;

/// A motion cannot have this parameter.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MotionError {
    /// Name of the parameter.
    pub what: &'static str,
    /// Value as given.
    pub value: f64,
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cannot be {}", self.what, self.value)
    }
}

impl std::error::Error for MotionError {}

/// The value, when it is a number of size at most `most`.
pub(crate) fn within(what: &'static str, value: f64, most: f64) -> Result<f64, MotionError> {
    if value.abs() <= most {
        Ok(value)
    } else {
        Err(MotionError { what, value })
    }
}

/// The largest rate or angular frequency taken, rad/s: ten times what any gyro reads.
pub(crate) const FASTEST: f64 = 1e5;
