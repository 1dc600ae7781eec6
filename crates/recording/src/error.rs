//! Why a log can not be read, or not as a whole, or holds no samples that were meant. Bad samples are not here: they are counted verdicts
//! ([`strapd_attitude::record::Verdict`]).

use crate::recognise::Foreign;
use std::path::PathBuf;
use strapd_attitude::setting::{FIELD, TOPIC};

/// A log that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened.
    #[error("{}: cannot open: {source}", path.display())]
    Open {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Reading failed part way.
    #[error("{}: reading at byte {offset}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Where in it.
        offset: u64,
        /// Why.
        source: std::io::Error,
    },
    /// The path is a directory.
    #[error("{}: is a directory\n  help: name the .mcap file inside it", path.display())]
    IsDirectory {
        /// Which.
        path: PathBuf,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty (0 bytes)", path.display())]
    Empty {
        /// Which file.
        path: PathBuf,
    },
    /// The first bytes are not the MCAP magic.
    #[error("{}: not an MCAP file: it begins with {found}, not with \\x89MCAP0\\r\\n", path.display())]
    NotMcap {
        /// Which file.
        path: PathBuf,
        /// The first bytes, escaped.
        found: String,
    },
    /// A table without the columns that are needed.
    #[error("{}: no table that can be read: {why}", path.display())]
    NotTable {
        /// Which file.
        path: PathBuf,
        /// What is missing, and what helps.
        why: String,
    },
    /// The input is of a known format that is not read.
    #[error("{}: is {}, which is not read\n  help: {}", path.display(), format.name, format.help(&path.to_string_lossy()))]
    NotRead {
        /// Which input.
        path: PathBuf,
        /// What it is, and the way in.
        format: Foreign,
    },
    /// A stream of what is read in any order could not be put into a file first.
    #[error(
        "{}: what comes only once is kept in {} to be read in any order: {source}\n  help: TMPDIR=FOLDER with room, or save it to a file first",
        path.display(), std::env::temp_dir().display()
    )]
    NoRoom {
        /// What it is called.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// What can be read once was to be looked at first.
    #[error("{}: a stream can not be surveyed before it is read", path.display())]
    NotTwice {
        /// What it is called.
        path: PathBuf,
    },
    /// The log holds nothing a rate can be read from.
    #[error("{}: no IMU topic: nothing in it carries a body rate with a stamp\n  it holds:{topics}\n  help: {} NAME with {} gyro=PATH names a rate in any message", path.display(), TOPIC, FIELD)]
    NoImuTopic {
        /// Which file.
        path: PathBuf,
        /// What is there, one indented line each.
        topics: String,
    },
    /// The log holds several IMU topics, or several publishers on one, and none was named.
    #[error("{}: several IMU topics or publishers, and they must not be mixed:{topics}\n  help: {} NAME takes one of them, {} all each of them", path.display(), TOPIC, TOPIC)]
    SeveralImuTopics {
        /// Which file.
        path: PathBuf,
        /// The candidates, one indented line each.
        topics: String,
    },
    /// The topic named is not in the log.
    #[error("{}: no topic `{topic}`\n  it holds:{topics}", path.display())]
    NoSuchTopic {
        /// Which file.
        path: PathBuf,
        /// The topic asked for.
        topic: String,
        /// What is there, one indented line each.
        topics: String,
    },
    /// A topic's messages can not be decoded.
    #[error("{}: {what}", path.display())]
    Unsupported {
        /// Which file.
        path: PathBuf,
        /// Topic, type, encoding, why, and the flag that helps.
        what: String,
    },
    /// A run over this input can not be carried out with these settings.
    #[error("{}: {}: {what}", path.display(), crate::text::printable(topic))]
    Topic {
        /// Which file.
        path: PathBuf,
        /// Which topic.
        topic: String,
        /// What, why, and the flag that helps.
        what: String,
    },
    /// The operating system gives no threads.
    #[error("cannot start {threads} threads: {source}\n  help: ask for fewer")]
    Threads {
        /// How many were asked for; 0 = one per core.
        threads: usize,
        /// Why not.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Result of reading.
pub type Result<T> = std::result::Result<T, Error>;
