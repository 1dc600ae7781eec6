//! Files and streams -> messages. I/O.
//!
//! A stage of its own because it is the only one that meets bytes nobody has checked:
//! whatever leaves it has a known length, a channel, and a place in a stable order.

pub mod mcap;
