//! The gyro error model: presets, text, bad input.
#![cfg(feature = "random")]
#![allow(clippy::unwrap_used)]

#[path = "imu_error/parameters.rs"]
mod parameters;
