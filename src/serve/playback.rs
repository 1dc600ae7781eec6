//! A replay or a simulation that is served: its server, who may stop and move it, and the whole of it at once.

pub mod controls;
mod estimated;
pub mod overview;
pub mod server;
