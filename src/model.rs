//! Mathematics: no I/O, no async, no clock, no logging, no randomness but a passed seed.
//!
//! [`frames`] says what a rotation joins, [`attitude`] how it is held and moved.

pub mod allan;
pub mod attitude;
pub mod dh;
mod double_double;
mod elliptic;
pub mod frames;
pub mod imu_error;
pub mod inertia;
pub mod motion;
pub(crate) mod quaternion_kernel;
pub mod rigid_body;
pub mod top;
pub mod youbot;
