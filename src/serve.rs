//! Samples over sockets -> attitudes over sockets: the daemon. I/O.
//!
//! ```text
//! edge (sockets -> bytes) -> session (lines) -> hub (one estimator a sensor) -> outbox (a client's bytes) -> edge
//! ```
//!
//! Seven rooms, each using only those above it in this table; `.ci/circles` holds it:
//!
//! | room | what is in it | |
//! |---|---|---|
//! | [`guard`] | who may come in, how much of everything there may be, and the orderly end | locks |
//! | [`protocol`] | what is said on the wire: lines, packed objects, Foxglove's messages, positions of a playback | pure |
//! | [`core`] | sessions, sensors, what each client gets, what is recorded and saved | locks; sans-I/O |
//! | `brokers` | subjects of NATS and keys of zenoh (features `nats`, `zenoh`) | I/O |
//! | [`edge`] | sockets others come to, sources we go to, HTTP and its pages | I/O |
//! | [`daemon`] | settings -> all of these, running | I/O |
//! | [`playback`] | a replay or simulation served in place of sensors, and who moves it | I/O; locks |
//!
//! The wire is described in `docs/protocol.md`.

#[cfg(any(feature = "nats", feature = "zenoh"))]
pub mod brokers;
pub mod core;
pub mod daemon;
pub mod edge;
pub mod guard;
pub mod playback;
pub mod protocol;

pub use daemon::{Listening, Server, Settings};
