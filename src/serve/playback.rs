//! A replay or a simulation that is served: its server, and who may stop and move it.

pub mod controls;
mod estimated;
pub mod server;
