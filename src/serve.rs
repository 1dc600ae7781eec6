//! The daemon: samples that come in while it runs. I/O.

pub mod recorder;
