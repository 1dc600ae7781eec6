//! A recording -> attitudes, and what is said of the run. I/O.
//!
//! ```text
//! request -> log (what is in it) -> choice of channels -> preparation -> estimators -> attitudes -> outputs
//!                                                                                  \-> summary, findings
//! ```
//!
//! | module | arrow | |
//! |---|---|---|
//! | [`config`] | how samples are to be understood and integrated, checked | pure |
//! | [`pipeline`] | a recording -> attitudes: replay, tracks, what a log holds | I/O |
//! | [`sink`] | attitude -> MCAP, NDJSON, CSV, sockets | I/O |
//! | [`summary`] | a run -> its numbers, for people and for machines | pure |
//! | [`inspection`] | what looking at a log tells of its topics | pure |
//! | [`findings`] | what is known about a log -> what is wrong with it, and what helps | pure |
//! | [`info`] | what looking at a recording told -> JSON, and the command to run next | pure |
//! | [`shell`] | words of a command -> what a shell takes for them | pure |
//! | [`error`] | everything that can end a run | pure |
//!
//! What the command, the daemon and the Python wheel share: no async runtime, no arguments, no terminal.

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod config;
pub mod error;
mod field_watch;
mod finding;
pub mod findings;
pub mod info;
pub mod inspection;
pub mod pipeline;
pub mod shell;
pub mod sink;
pub mod summary;

pub use strapd_recording::address;
