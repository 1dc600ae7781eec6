//! A recording -> attitudes: wires what the crates below give. I/O.
//!
//! ```text
//! request -> log (what is in it) -> channel_choice -> estimate::Preparation -> session_builder
//!         -> channel_route (messages -> items, on the workers) -> session -> delivery -> sink
//! ```
//!
//! | file | |
//! |---|---|
//! | `replay`, `replay_stream`, `stream_topic` | the same run over a file, and over what comes once; the topic of that |
//! | `logged` | the recording that a command line names, what is to be known of it logged |
//! | `channel_choice` | which topics are read, under which names, held against which reference |
//! | `replay_start`, `session_builder`, `session`, `delivery`, `pace`, `position`, `audience` | a run under way: what waits, what goes out, when, and who may stop it |
//! | `inspection`, `check`, `each`, `history`, `sample_kinds`, `attitude_track` | looking at a log, and holding it against others |
//! | `in_memory`, `samples` | for a program: the attitudes of a replay; those of samples that it holds itself |
//! | `mend` | settings that the recording itself corrects, where that is asked for |
//! | `unmet` | what was asked for and could not be done |
//! | `recover`, `simulate`, `summarise`, `provenance` | the other runs, and what is said at their end |

pub mod attitude_track;
pub mod audience;
mod channel_choice;
pub mod check;
mod delivery;
mod history;
pub mod in_memory;
pub mod inspection;
pub(crate) mod mend;
pub mod mounting;
pub mod opening;
pub mod pace;
pub mod position;
pub mod provenance;
mod recorded;
pub mod recover;
pub mod replay;
mod replay_start;
mod replay_stream;
mod replay_topics;
pub mod request;
mod sample_kinds;
pub mod samples;
mod session;
pub mod session_builder;
pub mod simulate;
mod stream_topic;
mod summarise;
mod unmet;
