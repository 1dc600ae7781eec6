#![allow(clippy::unwrap_used, reason = "tests")]

mod golden;
mod iron;
mod probes;
