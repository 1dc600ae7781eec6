//! Promise: a replay or a simulation that is served reaches whoever connects with the bytes of `-o -`,
//! and whoever it is sent to; a client can stop it, move it and begin it anew, and no bit changes by it.
//!
//! Real sockets on loopback, port 0, every wait bounded.

mod control;
mod lines;
mod sent;
mod viewers;
mod watched;
