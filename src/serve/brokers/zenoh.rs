//! Keys of zenoh -> sessions; attitudes -> keys of zenoh. I/O.
//!
//! ```text
//! robot -> 0/** -> rings -> subscription -> session -> hub -> outbox -> publisher -> 0/{id}/attitude
//! ```
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`address`] | what is written on the command line -> endpoint, key, files of secrets | pure, but for the files |
//! | [`ros`] | keys, attachments and tokens of ROS 2 (rmw_zenoh) <-> what they say | pure |
//! | `robot` | messages of topics of ROS 2 -> samples | pure |
//! | [`rings`] | messages of many keys, as fast as they come -> as fast as they are taken | locks |
//! | `connection` | an address -> a connection, and when it is lost | I/O |
//! | `subscription` | messages -> a session | I/O |
//! | `publisher` | an outbox -> messages | I/O |
//!
//! Whoever publishes reliably is held up where a subscriber takes nothing. So what comes is taken at
//! once, on zenoh's own threads, into a ring for each key; the oldest give way, and are counted.

pub mod address;
mod connection;
mod publisher;
pub mod rings;
mod robot;
pub mod ros;
mod subscription;

pub(in crate::serve) use publisher::send;
pub(in crate::serve) use subscription::keep;
