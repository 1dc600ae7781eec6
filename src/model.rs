//! Mathematics: no I/O, no async, no clock, no logging, no randomness but a passed seed.

pub mod attitude;
pub mod frames;
