//! Promise: a replay or a simulation that is served reaches whoever connects with the bytes of `-o -`,
//! and whoever it is sent to; a client can stop it, move it and begin it anew, and no bit changes by it.
//!
//! Real sockets on loopback, port 0, every wait bounded.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[allow(dead_code)]
#[path = "serve/client.rs"]
mod client;
#[allow(dead_code)]
#[path = "serve/daemon.rs"]
mod daemon;

mod commands;

#[path = "cast/control.rs"]
mod control;
#[path = "cast/lines.rs"]
mod lines;
#[path = "cast/sent.rs"]
mod sent;
#[path = "cast/viewers.rs"]
mod viewers;
#[path = "cast/watched.rs"]
mod watched;
