//! Recordings of every kind -> samples, with no byte believed before it is checked.
//!
//! ```
//! use std::{ops::ControlFlow, path::Path};
//! use strapd_recording::{Error, Recording, Selection, Warn, pool::Pool};
//!
//! let pool = Pool::new(0)?; // a thread per core; how many changes no bit
//! let selection = Selection::default(); // its only IMU; a topic, and where values lie in its messages
//! let warn = Warn::by(|what| eprintln!("{what}"));
//! let recording = Recording::open(Path::new("../../fixtures/xsens_mti.mcap"), &selection, &pool, &warn)?;
//! let lost = recording.samples(&selection, &pool, |topic, sample, _meaning| {
//!     println!("{topic} {:?} {:?}", sample.header, sample.gyro); // rad/s; x forward, y left, z up
//!     Ok::<_, Error>(ControlFlow::Continue(()))
//! })?;
//! # Ok::<(), Error>(())
//! ```
//!
//! MCAP, ULog, ROS 1 bags, lines of JSON, tables, a folder of one of them, a pipe, `-`, or an address:
//! `examples/samples_of_a_recording.rs` is the whole program.
//!
//! ```text
//! file, stream -> format -> mcap  -> decode            -> recording -> RawSample
//!                        -> lines -> decode, delimited
//!             parquet -> lines
//!                                   text, error: beside it
//! ```
//!
//! | module | arrow | |
//! |---|---|---|
//! | [`recording`] | a recording of any kind -> what is in it, and its samples in order | I/O |
//! | [`mcap`] | MCAP logs, whole or damaged -> messages in a stable order | I/O |
//! | [`mod@format`] | first bytes and name -> which format | pure |
//! | [`lines`] | lines of JSON, rows of a table -> what each holds | I/O |
//! | [`attitude_line`] | a line that says an attitude -> numbers | pure |
//! | [`delimited`] | rows of a table, strapd's own or another maker's -> raw samples | pure |
//! | `columns` | what columns of tables are called, and what a user says of them | pure |
//! | `parquet` | tables in Parquet -> the rows of a table, as text | I/O |
//! | [`records`] | records as MCAP has them, read and written, which other containers are transcribed to | pure |
//! | `bag` | ROS 1 bags -> the records MCAP has for them | pure |
//! | `sqlite` | an SQLite database, read only -> the rows of its tables | pure |
//! | `rosbag2` | recordings of ROS 2 in SQLite -> the records MCAP has for them | pure |
//! | `gpmf` | telemetry of GoPro's cameras, alone or in a video -> the records MCAP has for it | pure |
//! | [`mavlink`] | telemetry logs of ground stations -> the records MCAP has for them | pure |
//! | [`devices`] | frames of inertial sensors, live or captured -> lines, or the records MCAP has for them | pure |
//! | `dataflash` | logs of ArduPilot's flight controllers -> the records MCAP has for them | pure |
//! | `ulog` | ULog, the log of PX4 -> the records MCAP has for it | pure |
//! | [`decode`] | bytes of one message, one line, one packed object -> raw samples | pure |
//! | [`recognise`] | first bytes of an input -> what it is, and the way in where it is not read | pure |
//! | [`address`] | an address -> the one form in which it is printed | pure |
//! | [`remote_object`] | an address -> what is read there as a file is | I/O |
//! | [`text`] | outside text -> what a terminal may show | pure |
//! | [`pool`] | workers shared by reading, integrating and writing; how many changes no bit | |
//! | [`error`] | why a log cannot be read | |

#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod address;
pub mod attitude_line;
mod bag;
mod columns;
mod dataflash;
mod decimal;
pub mod decode;
pub mod delimited;
pub mod devices;
pub mod error;
pub mod format;
mod gpmf;
pub mod json_fault;
pub mod lines;
pub mod mavlink;
pub mod mcap;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(not(feature = "parquet"))]
#[path = "parquet/absent.rs"]
mod parquet;
pub mod pool;
pub mod recognise;
pub mod recording;
pub mod records;
pub mod remote_object;
mod rosbag2;
mod sqlite;
pub mod text;
mod ulog;

pub use error::{Error, Result};
pub use recording::input::{Input, Source};
pub use recording::opened::Recording;
pub use recording::own_output::MadeBefore;
pub use recording::selection::{Selection, TopicBeside};
pub use recording::warn::Warn;
