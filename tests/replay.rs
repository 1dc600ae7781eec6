//! Promise: a recorded log becomes attitude, end to end, whatever is wrong with it.
//!
//! Here the pipeline runs in this process; the command line is `cli.rs`, what must not change the
//! result is `streams.rs`.

#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "replay/bad_values.rs"]
mod bad_values;
#[path = "replay/clocks.rs"]
mod clocks;
#[path = "replay/cuts.rs"]
mod cuts;
#[path = "replay/hostile.rs"]
mod hostile;
mod made_logs;
#[path = "replay/outputs.rs"]
mod outputs;
#[path = "replay/publishers.rs"]
mod publishers;
#[path = "replay/recordings.rs"]
mod recordings;
mod replays;
#[allow(unreachable_pub)]
mod shared_data;
#[path = "replay/stated_times.rs"]
mod stated_times;
