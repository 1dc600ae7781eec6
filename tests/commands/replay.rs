//! Promise: a recorded log becomes attitude, end to end, whatever is wrong with it.
//!
//! Here the pipeline runs in this process; the command line is `cli.rs`, what must not change the
//! result is `streams.rs`.

mod bad_values;
mod clocks;
mod cuts;
mod hostile;
mod in_memory;
mod outputs;
mod prepared;
mod publishers;
mod recordings;
mod stated_times;
