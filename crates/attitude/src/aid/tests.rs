#![allow(clippy::unwrap_used, reason = "tests")]

mod drift;
mod golden;
mod iron;
mod planar;
mod probes;
