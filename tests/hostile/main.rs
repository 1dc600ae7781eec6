//! Inputs nobody well-meaning sends: changed logs through every command, and parsers whose work is to grow with the
//! input.
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[cfg(unix)]
mod growth;
mod mutations;

#[cfg(unix)]
#[path = "../made_databases/mod.rs"]
mod made_databases;
#[path = "../made_logs/mod.rs"]
mod made_logs;
#[path = "../meter/mod.rs"]
mod meter;
#[path = "../../fuzz/parsers.rs"]
mod parsers;
