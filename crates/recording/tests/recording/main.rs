//! Logs, whole, damaged and hostile: what is read of them, and that nothing in them is believed.
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used, unreachable_pub)]

mod another_reader;
mod conformance;
mod containers;
mod decode;
mod delimited;
mod gpmf;
#[path = "../../../../tests/made_databases/mod.rs"]
mod made_databases;
mod mavlink;
mod mcap_damage;
#[path = "../../../../tests/mcap_logs/mod.rs"]
mod mcap_logs;
mod mcap_reader;
#[path = "../../../../tests/meter/mod.rs"]
mod meter;
mod relative_error;
mod rosbag2;
mod samples;
#[path = "../../../../tests/shared_data/mod.rs"]
mod shared_data;
