//! Mathematics: no I/O, no async, no clock, no logging, no randomness but a passed seed.
//!
//! [`frames`] says what a rotation joins, [`attitude`] how it is held and moved.

pub mod attitude;
pub mod frames;
