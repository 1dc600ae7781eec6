//! The daemon and its pages: samples in over sockets, attitude out, in front of clients of every temper.
#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod broker;
mod cast;
mod mqtt;
mod nats;
mod page;
mod recorder;
mod serve;
mod zenoh;

#[path = "../made_logs/mod.rs"]
mod made_logs;
#[path = "../program/mod.rs"]
mod program;
#[allow(dead_code, unreachable_pub)]
#[path = "../shared_data/mod.rs"]
mod shared_data;
