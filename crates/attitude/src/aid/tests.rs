#![allow(clippy::unwrap_used, reason = "tests")]

mod golden;
mod iron;
mod planar;
mod probes;
