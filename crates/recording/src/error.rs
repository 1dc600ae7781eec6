//! Why a log cannot be read, or not as a whole, or holds no samples that were meant. Bad samples are not here: they
//! are counted verdicts ([`strapd_attitude::record::Verdict`]).

use crate::decode::defining;
use crate::recognise::Foreign;
use std::fmt;
use std::path::{Path, PathBuf};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::{COLUMNS, FIELD, TOPIC};

/// A log that could not be read.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened.
    Open {
        /// Path of the file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Reading failed part way.
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Offset in it.
        offset: u64,
        /// Why.
        source: std::io::Error,
    },
    /// The path is a directory.
    IsDirectory {
        /// Path.
        path: PathBuf,
    },
    /// The file has no bytes.
    Empty {
        /// Path of the file.
        path: PathBuf,
    },
    /// Object at an address that cannot be had.
    Unreached {
        /// The address, as it is printed.
        path: PathBuf,
        /// Why, and what helps.
        what: Diagnostic,
    },
    /// The first bytes are not the MCAP magic.
    NotMcap {
        /// Path of the file.
        path: PathBuf,
        /// The first bytes, escaped.
        found: String,
    },
    /// A table without the columns that are needed.
    NotTable {
        /// Path of the file.
        path: PathBuf,
        /// Description of what is missing, and what helps.
        why: Diagnostic,
    },
    /// The input is of a known format that is not read.
    NotRead {
        /// Path of the input.
        path: PathBuf,
        /// Format that it is, and the way in.
        format: Foreign,
    },
    /// A stream of what is read in any order could not be put into a file first.
    NoRoom {
        /// Name of the input.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// Input that can be read once and was to be looked at first.
    NotTwice {
        /// Name of the input.
        path: PathBuf,
    },
    /// The log holds nothing a rate can be read from.
    NoImuTopic {
        /// Path of the file.
        path: PathBuf,
        /// Topics that exist, one indented line each.
        topics: String,
        /// Messages of a type that nothing defines, so that no value in them has a name.
        undefined: Option<String>,
    },
    /// The log holds several IMU topics, or several publishers on one, and none was named.
    SeveralImuTopics {
        /// Path of the file.
        path: PathBuf,
        /// The candidates, one indented line each.
        topics: String,
    },
    /// The topic named is not in the log.
    NoSuchTopic {
        /// Path of the file.
        path: PathBuf,
        /// The topic asked for.
        topic: String,
        /// Topics that exist, one indented line each.
        topics: String,
    },
    /// A topic's messages cannot be decoded.
    Unsupported {
        /// Path of the file.
        path: PathBuf,
        /// Topic, type, encoding, why, and what helps.
        what: Diagnostic,
    },
    /// A run over this input cannot be carried out with these settings.
    Topic {
        /// Path of the file.
        path: PathBuf,
        /// Name of the topic.
        topic: String,
        /// Diagnostic: what, why, and what helps.
        what: Diagnostic,
    },
    /// The operating system gives no threads.
    Threads {
        /// Number asked for; 0 = one per core.
        threads: usize,
        /// Why not.
        source: rayon::ThreadPoolBuildError,
    },
}

impl Error {
    /// The same in one line, without the topics that there are.
    #[must_use]
    pub fn unlisted(&self) -> Diagnostic {
        match self {
            Error::NoImuTopic {
                path, undefined, ..
            } => no_imu_topic(path, "", undefined.as_deref()),
            Error::SeveralImuTopics { path, .. } => several_imu_topics(path, ""),
            other => Diagnostic::from(other),
        }
    }

    /// Error for what cannot be read of this file.
    #[must_use]
    pub fn unsupported(path: &Path, what: impl Into<Diagnostic>) -> Error {
        Error::Unsupported {
            path: path.to_owned(),
            what: what.into(),
        }
    }
}

fn no_imu_topic(path: &Path, listed: &str, undefined: Option<&str>) -> Diagnostic {
    Diagnostic::new(format!(
        "{}: no IMU topic: nothing in it carries a body rate with a stamp{listed}",
        path.display()
    ))
    .help(match undefined {
        Some(kind) => defining(kind),
        None => format!("{TOPIC} NAME with {FIELD} gyro=PATH names a rate in any message"),
    })
}

fn several_imu_topics(path: &Path, listed: &str) -> Diagnostic {
    Diagnostic::new(format!(
        "{}: several IMU topics or publishers, and they must not be mixed{listed}",
        path.display()
    ))
    .help(format!(
        "{TOPIC} NAME takes one of them, {TOPIC} all each of them"
    ))
}

/// Message of an error of the system, with the help that may be in it.
fn why(source: &std::io::Error) -> Diagnostic {
    let own = source.get_ref().and_then(|why| why.downcast_ref());
    own.cloned()
        .unwrap_or_else(|| Diagnostic::new(source.to_string()))
}

impl From<&Error> for Diagnostic {
    fn from(error: &Error) -> Diagnostic {
        match error {
            Error::Open { path, source } => {
                why(source).at(format_args!("{}: cannot open", path.display()))
            }
            Error::Read {
                path,
                offset,
                source,
            } => why(source).at(format_args!("{}: reading at byte {offset}", path.display())),
            Error::IsDirectory { path } => {
                Diagnostic::new(format!("{}: is a directory", path.display()))
                    .help("name the .mcap file inside it")
            }
            Error::Empty { path } => {
                Diagnostic::new(format!("{}: the file is empty (0 bytes)", path.display()))
            }
            Error::NotMcap { path, found } => Diagnostic::new(format!(
                "{}: no format that is read: it begins with {found}",
                path.display()
            ))
            .help(format!("an MCAP file begins with \\x89MCAP0\\r\\n; of a table the first line names the columns, or {COLUMNS} does")),
            Error::NotTable { path, why } => why.clone().at(format_args!(
                "{}: no table that can be read",
                path.display()
            )),
            Error::NotRead { path, format } => Diagnostic::new(format!(
                "{}: is {}, which is not read",
                path.display(),
                format.name
            ))
            .help(format.help(&path.to_string_lossy())),
            Error::NoRoom { path, source } => Diagnostic::new(format!(
                "{}: what comes only once is kept in {} to be read in any order: {source}",
                path.display(),
                std::env::temp_dir().display()
            ))
            .help("TMPDIR=FOLDER with room, or save it to a file first"),
            Error::NotTwice { path } => Diagnostic::new(format!(
                "{}: a stream cannot be surveyed before it is read",
                path.display()
            )),
            Error::NoImuTopic {
                path,
                topics,
                undefined,
            } => no_imu_topic(
                path,
                &format!("\n  it holds:{topics}"),
                undefined.as_deref(),
            ),
            Error::SeveralImuTopics { path, topics } => {
                several_imu_topics(path, &format!(":{topics}"))
            }
            Error::NoSuchTopic {
                path,
                topic,
                topics,
            } => Diagnostic::new(format!(
                "{}: no topic `{topic}`\n  it holds:{topics}",
                path.display()
            )),
            Error::Unsupported { path, what } | Error::Unreached { path, what } => {
                what.clone().at(path.display())
            }
            Error::Topic { path, topic, what } => what.clone().at(format_args!(
                "{}: {}",
                path.display(),
                crate::text::printable(topic)
            )),
            Error::Threads { threads, source } => {
                Diagnostic::new(format!("cannot start {threads} threads: {source}"))
                    .help("ask for fewer")
            }
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Open { source, .. }
            | Error::Read { source, .. }
            | Error::NoRoom { source, .. } => Some(source),
            Error::Threads { source, .. } => Some(source),
            _ => None,
        }
    }
}

/// Result of reading.
pub type Result<T> = std::result::Result<T, Error>;
