//! Promise: what goes in over a socket comes out as attitude over a socket, the same bits as from a
//! file; what is wrong is answered, counted and never stops anybody else.
//!
//! Real sockets on loopback, port 0, every wait bounded.

pub(crate) mod client;
pub(crate) mod daemon;

mod admission;
pub(crate) mod aiding;
mod arrivals;
mod bad_lines;
mod bare_stamps;
mod besides;
mod cat;
mod clients;
mod clock_doubts;
mod config;
mod connecting;
mod devices;
mod documentation;
mod doubts;
mod faults;
mod frames;
mod heading;
mod intervals;
mod late;
mod leaving;
mod limits;
mod losses;
mod opening;
mod operations;
mod other_programs;
mod packaging;
mod packed;
mod places;
mod posting;
mod recipes;
mod recording;
mod reference;
mod resetting;
mod rows;
mod runs;
mod same_bytes;
mod secrets;
mod sending;
mod serial;
mod slow_readers;
mod stamp_units;
mod state;
mod storms;
mod strangers;
mod tls;
mod transports;
mod watch;
