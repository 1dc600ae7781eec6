//! Errors that a sensor adds to the truth: measured in a recording ([`allan`]), added on purpose ([`sensor_error`]).
//! Pure.
//!
//! A stage of its own because both speak of the same terms with the same sizes: what one puts in, the other
//! has to find again.

pub mod allan;
pub mod sensor_error;
