//! Promise: the model library answers at the command line what it answers in Rust, one line a request.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]

mod commands;
#[path = "model_commands/inertia.rs"]
mod inertia;
#[allow(unreachable_pub)]
mod shared_data;
#[path = "model_commands/top.rs"]
mod top;
