//! A recording -> attitudes: wires what the crates below give. I/O.
//!
//! ```text
//! request -> log (what is in it) -> channel_choice -> estimate::Preparation -> session_builder
//!         -> channel_route (messages -> items, on the workers) -> session -> delivery -> sink
//! ```
//!
//! | file | |
//! |---|---|
//! | `replay`, `replay_stream`, `lines` | the same run over a file, a stream that comes once, and lines |
//! | `input`, `line_input`, `folder`, `text_log`, `bare_stamps`, `early_besides`, `topic_reading` | what can be read again, the recording in a folder, the log in a text, one topic of a log |
//! | `log`, `log_channel`, `sources`, `topics`, `channel_choice`, `decoders`, `channel_route` | which channels are read, as what, by which decoder |
//! | `replay_start`, `session_builder`, `session`, `delivery`, `pace`, `position`, `audience` | a run under way: what waits, what goes out, when, and who may stop it |
//! | `inspection`, `check`, `each`, `history`, `sample_kinds`, `attitude_track` | looking at a log, and holding it against others |
//! | `in_memory` | the attitudes of a replay for a program that asks for them |
//! | `recover`, `simulate`, `summarise`, `provenance` | the other runs, and what is said at their end |

pub mod attitude_track;
pub mod audience;
mod bare_stamps;
pub mod beside;
mod channel_choice;
pub mod channel_route;
pub mod check;
pub mod decoders;
mod delivery;
mod each;
pub mod early_besides;
mod folder;
mod held;
mod history;
pub mod in_memory;
pub mod input;
pub mod inspection;
mod line_input;
mod lines;
pub mod log;
pub mod log_channel;
pub mod pace;
pub mod position;
pub mod provenance;
pub mod recover;
pub mod replay;
mod replay_start;
mod replay_stream;
pub mod request;
mod sample_kinds;
mod session;
pub mod session_builder;
pub mod simulate;
mod sources;
mod summarise;
mod text_log;
pub mod topic_reading;
pub mod topics;
