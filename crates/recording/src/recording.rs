//! A recording of any kind -> what is in it, and its samples in order. I/O.
//!
//! A room of its own because whoever wants samples asks the same things first, whatever the container: what it is,
//! which
//! topics carry rates, whose they are, and how each message is read. [`opened::Recording`] is all of it at once; a
//! program that does more with messages than to take samples (`strapd-replay`) walks it with routes of its own.
//!
//! ```text
//! path, stream -> input -> opened (survey, first messages, sources) -> topics -> samples
//!     folder, archive, line_input, text_log: beside it                  topic_plan, channel_route: on the workers
//! what comes once -> incoming -> messages, lines
//! lines, whether they come once or more often -> line_reader -> text_channels, text_log
//! ```
//!
//! | file | |
//! |---|---|
//! | [`input`], `folder`, `archive`, `line_input`, [`incoming`] | what can be read again, the recording in a folder or in a ZIP, lines and rows, what comes once |
//! | [`opened`], `first_messages`, [`text_log`], `text_channels`, [`log_channel`], [`payload_type`], [`sources`], `turns` | what is in a log, or in a text; the channels of a text; what a channel can serve as; the type of its payloads; who speaks on a topic |
//! | `line_reader`, `sample_cache` | the samples of lines, sensor by sensor; those of a text, kept for the next walk |
//! | [`selection`], [`topics`], [`log_topics`], [`beside`], [`decoders`] | what is wanted, the choice of topics, what belongs to their samples, how messages are read |
//! | [`channel_route`], [`held`], `bare_stamps`, [`stated_nanos`], [`early_besides`] | what becomes of messages; those that wait for the unit of their stamps, or for their sensor |
//! | [`instants`] | when attitudes are wanted beside the samples: frames, stamps of a topic, rows |
//! | [`static_transforms`], `message_reader` | how frames of a robot lie in each other |
//! | `samples`, [`topic_plan`], [`topic_reading`] | how a topic is read, and which messages are its own; all samples that are selected, one topic |
//! | [`own_output`] | whether it is none, but what strapd made of one |
//! | [`warn`] | who is told what is no error |

mod archive;
mod bare_stamps;
pub mod beside;
pub mod channel_route;
pub mod decoders;
pub mod early_besides;
mod first_messages;
mod folder;
pub mod held;
pub mod incoming;
pub mod input;
pub mod instants;
mod line_input;
mod line_reader;
pub mod log_channel;
pub mod log_topics;
mod message_reader;
pub mod opened;
pub mod own_output;
mod parts;
pub mod payload_type;
mod sample_cache;
mod samples;
pub mod selection;
mod several;
pub mod sources;
pub mod stated_nanos;
pub mod static_transforms;
mod text_channels;
pub mod text_log;
pub mod topic_plan;
pub mod topic_reading;
pub mod topics;
mod turns;
pub mod warn;
