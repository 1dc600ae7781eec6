//! strapd: gyro samples in, attitude you can trust out.
//!
//! The folders are the data flow:
//!
//! ```text
//! source -> decode -> condition -> propagate -> sink      wired by pipeline
//!                          model: the mathematics beside it, pure
//! ```
//!
//! | module | arrow | |
//! |---|---|---|
//! | [`record`] | what crosses the borders between stages | pure |
//! | `source` | files and streams -> messages | I/O |
//! | `decode` | bytes of one message -> raw samples | pure |
//! | [`condition`] | raw samples -> SI, body axes, in order, finite | pure |
//! | [`propagate`] | rates -> attitude: the hot loop | pure |
//! | [`aid`] | specific force, field -> corrections of attitude and sensor | pure |
//! | `sink` | attitude -> MCAP, NDJSON, CSV | I/O |
//! | `pipeline` | the stages wired: replay, tracks, what a log holds | I/O |
//! | `serve` | the daemon: samples in over sockets, attitude out | I/O |
//! | `client` | the other end: a daemon, or whatever sends samples -> lines | I/O |
//! | [`compare`] | two attitudes -> how far apart | pure |
//! | `config`, `report`, `cli` | arguments -> a run -> its summary | |
//! | [`model`] | frames, attitude, rigid body, top, inertia, the youBot's arm, motions with exact truth | pure |
//!
//! Reading order: [`record`], `pipeline::estimator`, then one stage.
//! Without the default feature `service` the crate is the modules with links above, on nalgebra alone.

pub mod cli;
pub mod client;
pub mod config;

pub mod error;
pub mod pipeline;
pub mod report;
pub mod serve;
pub mod sink;
