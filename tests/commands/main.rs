//! Tests of the command line as its users meet it: every command over logs of every kind, and what it writes.
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![allow(
    clippy::duplicate_mod,
    reason = "the example's own modules, and those of the logs made here"
)]
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod accelerations;
mod advice;
mod allan;
mod bad_input;
mod broken_axes;
mod calibration;
mod check;
mod cli;
mod coarse_clocks;
mod containers;
mod earth_rate;
mod empty_topics;
mod fixtures;
mod folders;
mod formats;
mod heading_resets;
mod increments;
mod instants;
mod joined;
mod joined_formats;
mod layouts;
mod model;
#[cfg(unix)]
mod next;
mod other_programs;
mod packed;
#[cfg(unix)]
mod pages;
mod parquet;
mod parquet_in;
#[cfg(target_os = "linux")]
mod passes;
mod px4;
mod recover;
mod regularise;
mod relative;
mod release;
mod replay;
mod report;
mod rosbag2;
mod settings;
mod simulate;
mod sinks;
mod smoothing;
mod stamp_units;
mod streams;
mod tables;
mod temperatures;
mod trajectory;
mod transforms;
mod urls;
mod youbot;

#[path = "../made_databases/mod.rs"]
mod made_databases;
#[path = "../made_logs/mod.rs"]
mod made_logs;
#[path = "../mcap_logs/mod.rs"]
mod mcap_logs;
#[path = "../program/mod.rs"]
mod program;
#[path = "../replays/mod.rs"]
mod replays;
#[allow(dead_code, unreachable_pub)]
#[path = "../shared_data/mod.rs"]
mod shared_data;
#[allow(dead_code)]
#[path = "../../crates/recording/tests/recording/decode/writer.rs"]
mod writer;
