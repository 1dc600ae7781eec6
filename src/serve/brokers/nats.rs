//! Subjects of NATS -> sessions; attitudes -> subjects of NATS. I/O.
//!
//! ```text
//! imu.* -> subscription -> session -> hub -> outbox -> publisher -> att.{id}
//!             lease <-> a bucket: who has these sensors, and their state
//! ```
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`address`] | what is written on the command line -> server, subject, files of secrets | pure, but for the files |
//! | `connection` | an address -> a connection that comes back | I/O |
//! | `subscription` | messages -> a session | I/O |
//! | `publisher` | an outbox -> messages | I/O |
//! | `lease` | a bucket <-> which worker has a partition, and the state of its sensors | I/O |
//! | [`tenure`] | the lease -> whether attitudes may leave; the outputs -> whether all have | locks |
//!
//! Over core NATS a message comes at most once. With a stream of JetStream nothing is lost: a worker reads
//! on from the number its state was saved at, and its state is saved only when every attitude of before is
//! stored. Who takes over makes the same attitudes, to the bit, passes over those that are stored, and
//! states with each what it expects to be the last of its subject: the server refuses anybody else's.

pub mod address;
mod connection;
mod lease;
mod publisher;
mod subscription;
pub mod tenure;

pub(in crate::serve) use publisher::send;
pub(in crate::serve) use subscription::keep;
