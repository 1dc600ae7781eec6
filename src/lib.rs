//! The command and the daemon `strapd`: gyro samples in, attitude you can trust out.
//!
//! One function is public, [`main`]. What it is made of is in the crates below it, each with a page of its own:
//!
//! ```text
//! strapd-recording -> strapd-attitude <- strapd-bodies
//!            \               |               /
//!                      strapd-replay
//!                            |
//!               serve, client, report -> cli      here
//! ```
//!
//! | module | arrow | |
//! |---|---|---|
//! | `serve` | the daemon: samples in over sockets, attitude out | I/O |
//! | `client` | the other end: a daemon, or whatever sends samples -> lines | I/O |
//! | `report` | a run -> its page | pure |
//! | `store` | an address -> what is there, read as a file is (feature `object-store`) | I/O |
//! | `cli` | arguments -> a run -> what is printed | I/O |
//!
//! Reading order: `strapd_attitude::estimate`, `strapd_replay::pipeline::replay`, then one module. Tests, benches, examples and fuzzers see
//! inside by the feature `inside`; nobody else is to.

#![allow(
    unreachable_pub,
    reason = "what is public here is so for the feature `inside`"
)]

// Written out: what a macro declares, rustfmt does not see.
#[cfg(not(feature = "inside"))]
mod cli;
#[cfg(feature = "inside")]
#[doc(hidden)]
pub mod cli;
#[cfg(not(feature = "inside"))]
mod client;
#[cfg(feature = "inside")]
#[doc(hidden)]
pub mod client;
#[cfg(not(feature = "inside"))]
mod report;
#[cfg(feature = "inside")]
#[doc(hidden)]
pub mod report;
#[cfg(not(feature = "inside"))]
mod serve;
#[cfg(feature = "inside")]
#[doc(hidden)]
pub mod serve;

#[cfg(all(feature = "object-store", not(feature = "inside")))]
mod store;
#[cfg(all(feature = "object-store", feature = "inside"))]
#[doc(hidden)]
pub mod store;

#[cfg(feature = "inside")]
#[doc(hidden)]
pub use strapd_replay::{address, config, error, inspection, pipeline, sink};
#[cfg(not(feature = "inside"))]
use strapd_replay::{address, config, error, pipeline, sink};

#[cfg(not(feature = "inside"))]
mod size_limit;
#[cfg(feature = "inside")]
#[doc(hidden)]
pub mod size_limit;

mod web;

use clap::Parser;
use std::process::ExitCode;

/// Parses the arguments, starts the diagnostics, runs, and says the outcome as an exit code.
#[must_use]
pub fn main() -> ExitCode {
    // What a library says helps is a flag here.
    let as_flag =
        |name: &str, f: &mut std::fmt::Formatter<'_>| write!(f, "--{}", name.replace('_', "-"));
    let _ = strapd_attitude::setting::name_settings(as_flag);
    #[cfg(feature = "object-store")]
    let _ = strapd_recording::remote_object::reach_by(store::reach);
    #[cfg(feature = "object-store")]
    let _ = sink::upload::upload_by(store::upload::WAY);
    let cli = cli::Cli::try_parse().unwrap_or_else(|error| cli::borrowed::explained(error).exit());
    cli::start_diagnostics(&cli.global);
    size_limit::make_size_limit_an_error();
    match cli::run(cli) {
        Ok(outcome) => outcome.into(),
        Err(error) if error.is_broken_pipe() => ExitCode::SUCCESS,
        Err(error) => {
            cli::say_error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}
