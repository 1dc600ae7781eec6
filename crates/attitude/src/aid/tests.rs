#![allow(clippy::unwrap_used, reason = "tests")]

mod accelerated;
mod clipped;
mod drift;
mod golden;
mod iron;
mod other_class;
mod outside_heading;
mod planar;
mod probes;
