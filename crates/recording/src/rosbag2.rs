//! Recordings of ROS 2 in SQLite (`.db3`) -> the records MCAP has for them. Pure, but for who has the pages.
//!
//! A stage of its own because [`crate::sqlite`] knows tables and no topics. What the tables say is what an MCAP of ROS 2
//! says: a topic is a channel, a row of `messages` a message, recorded at its `timestamp`. Before the fourth version of
//! the tables no definition of a type is in them: those every ROS has are given from here.
//!
//! ```text
//! tables -> topics (schemas, channels) -> bag (messages, what was lost)
//!                                      catalogue (leaves that no tree reaches any more)
//! ```

mod bag;
mod catalogue;
mod message;
mod topics;

pub(crate) use bag::{Bag, Fault, FaultKind};
