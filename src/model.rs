//! Mathematics: no I/O, no async, no clock, no logging, no randomness but a passed seed.

pub mod attitude;
mod double_double;
mod elliptic;
pub mod frames;
pub mod inertia;
mod quaternion_kernel;
pub mod motion;
pub mod rigid_body;
pub mod top;
