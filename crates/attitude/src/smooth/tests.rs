#![allow(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

mod golden;
mod input;
mod leaning;
mod logs;
mod other_class;
mod planar;
mod robustness;
mod sensitivity;
mod slopes;
mod spans;
