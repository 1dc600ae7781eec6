//! Words of clients -> sensors -> attitudes for clients: the daemon without a socket. Locks; sans-I/O.
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`session`] | one client's lines -> hub, answers | sans-I/O |
//! | [`viewer`] | the same for Foxglove's viewers: messages in place of lines | sans-I/O |
//! | `owned` | the sensors one client sends -> hub, and again when they were put away | locks |
//! | [`reading`] | parameters of an address -> how the lines of its connections are read | pure |
//! | [`hub`] | samples -> attitudes -> outboxes | locks |
//! | `run_builder` | lines of one sensor -> a run of its samples | pure |
//! | [`stream`] | samples of one sensor -> attitudes | pure |
//! | [`channel`], [`last_attitude`] | a stream as clients know it; its last attitude, for who comes late | pure |
//! | [`outbox`] | attitudes -> what one client gets, bounded | locks |
//! | [`recorder`] | what goes through -> MCAP files that survive a crash | a queue; I/O on threads of its own |
//! | [`state`] | attitudes <-> the file a restarted daemon goes on from | I/O |
//! | `outgoing` | a source that is connected to, and how that stands | locks |
//! | `read_buffer` | a thread's room for one read and the work on it | reads the clock |
//! | [`context`] | what every task of a listener, source or output needs | |

pub mod channel;
pub mod context;
pub mod hub;
pub mod last_attitude;
pub mod outbox;
pub(super) mod outgoing;
pub(super) mod owned;
pub(super) mod read_buffer;
pub mod reading;
pub mod recorder;
pub(super) mod run_builder;
pub mod session;
pub mod state;
pub mod stream;
pub mod viewer;
