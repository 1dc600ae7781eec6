//! The pure crate, judged from outside: conventions, conditioning, propagation, covariance, noise.
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used, unreachable_pub)]

mod allan;
mod condition;
mod conventions;
mod covariance;
mod properties;
mod rests;
mod sample_kind;
mod sensor_error;
mod settings;
#[path = "../../../../tests/shared_data/mod.rs"]
mod shared_data;
