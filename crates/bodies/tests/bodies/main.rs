//! Bodies and what turns with them: golden vectors, errata of the sources, and the propagator against exact motions.
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used, unreachable_pub)]

mod accuracy;
mod carried;
mod field;
mod inertia;
mod motions;
#[path = "../../../../tests/shared_data/mod.rs"]
mod shared_data;
mod top;
mod youbot;
