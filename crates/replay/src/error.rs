//! Everything that can end a run. One flat enum; each variant says what, where, why, and the
//! flag that helps. Bad samples are not here: they are counted verdicts ([`strapd_attitude::record::Verdict`]).

use std::path::PathBuf;
use strapd_attitude::setting::{FORCE, LISTEN};

/// A run that could not be carried out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A log could not be read.
    #[error(transparent)]
    Recording(#[from] strapd_recording::Error),
    /// Writing failed (disk full, permission, ...).
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// There is no room for the samples of a recording that is smoothed.
    #[error(
        "{0}\n  help: make room in the folder of the output, or in that of temporary files (TMPDIR)"
    )]
    Spool(#[from] strapd_attitude::estimate::SpoolError),
    /// The output is already there.
    #[error("{}: already exists\n  help: {} replaces it", path.display(), FORCE)]
    OutputExists {
        /// Which file.
        path: PathBuf,
    },
    /// Output and input are the same file.
    #[error("{}: is the input; it will not be overwritten, not even with {}\n  help: give another name to -o", path.display(), FORCE)]
    OutputIsInput {
        /// Which file.
        path: PathBuf,
    },
    /// Standard output was closed by its reader; ends the run quietly.
    #[error("the reader of standard output has gone")]
    BrokenPipe,
    /// An address can not be listened on.
    #[error("cannot listen on {address}: {source}{}", bind_help(source))]
    Bind {
        /// Where.
        address: String,
        /// Why.
        source: std::io::Error,
    },
    /// Nobody takes what is sent there.
    #[error(
        "cannot connect to {address}: {source}\n  help: somebody has to listen there first: strapd serve, nc -l PORT, PlotJuggler's UDP server"
    )]
    Connect {
        /// Where.
        address: String,
        /// Why.
        source: std::io::Error,
    },
    /// A daemon can not be reached, or has gone.
    #[error("{address}: {what}")]
    Remote {
        /// Where.
        address: String,
        /// What, and what it said before.
        what: String,
    },
    /// A combination of arguments that can not be.
    #[error("{0}")]
    Usage(String),
}

fn bind_help(source: &std::io::Error) -> String {
    match source.kind() {
        std::io::ErrorKind::AddrInUse => {
            format!(
                "\n  help: is another strapd running there? {LISTEN} takes another address; port 0 takes a free port and shows it"
            )
        }
        std::io::ErrorKind::PermissionDenied => {
            "\n  help: ports below 1024 need a privilege; take a higher one".to_owned()
        }
        _ => String::new(),
    }
}

/// Result of a run.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A failed write to something that has a name but no path; a closed pipe is told apart.
    #[must_use]
    pub fn writing(name: &str, source: std::io::Error) -> Error {
        if source.kind() == std::io::ErrorKind::BrokenPipe {
            Error::BrokenPipe
        } else {
            Error::Write {
                path: PathBuf::from(name),
                source,
            }
        }
    }

    /// Whether the run ended because its reader had enough (`| head`): not a failure.
    #[must_use]
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Error::BrokenPipe)
    }

    /// The process's exit code: 2 for bad arguments, 1 for everything else.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            _ => 1,
        }
    }
}
