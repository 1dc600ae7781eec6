//! The other end of a socket: connecting to a daemon, or to whatever sends samples. I/O.
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`remote`] | the word on the command line -> where to connect | pure |
//! | [`link`] | bytes and messages both ways, over any transport | I/O |
//! | [`watcher`] | what a daemon says -> attitudes, state, complaints | I/O |
//! | [`attitude`] | an `ATT` object -> numbers; nothing in it is trusted | pure |
//!
//! `serve` connects out to its sources through [`link`] too; `cat` and `watch` do.

pub mod attitude;
pub mod link;
pub mod remote;
pub mod watcher;
