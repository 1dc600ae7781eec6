//! Everything that can end a run. One flat enum; each variant says what, where and why, and apart from that what
//! helps ([`Diagnostic`]). Bad samples are not here: they are counted verdicts ([`strapd_attitude::record::Verdict`]).

use crate::address::Address;
use std::path::{Path, PathBuf};
use std::{fmt, io};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::SpoolError;
use strapd_attitude::setting::{FORCE, LISTEN};

/// A run that could not be carried out.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A log could not be read.
    Recording(strapd_recording::Error),
    /// Writing failed (disk full, permission, ...).
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Lack of room for the samples of a recording that is smoothed.
    Spool(SpoolError),
    /// The output is already there.
    OutputExists {
        /// Path of the file.
        path: PathBuf,
    },
    /// Output and input are the same file.
    OutputIsInput {
        /// Path of the file.
        path: PathBuf,
    },
    /// Standard output was closed by its reader; ends the run quietly.
    BrokenPipe,
    /// An address cannot be listened on.
    Bind {
        /// Address.
        address: Address,
        /// Why.
        source: io::Error,
    },
    /// Nobody takes what is sent there.
    Connect {
        /// Address.
        address: Address,
        /// Why.
        source: io::Error,
    },
    /// A daemon cannot be reached, or has gone.
    Remote {
        /// Address.
        address: Address,
        /// Diagnostic: what, and what it said before.
        what: Diagnostic,
    },
    /// A combination of arguments that cannot be.
    Usage(Diagnostic),
}

impl From<&Error> for Diagnostic {
    fn from(error: &Error) -> Diagnostic {
        match error {
            Error::Recording(error) => error.into(),
            Error::Write { path, source } => {
                caused(format_args!("{}: cannot write", path.display()), source)
            }
            Error::Spool(error) => Diagnostic::new(error.to_string()).help(
                "make room in the folder of the output, or in that of temporary files (TMPDIR)",
            ),
            Error::OutputExists { path } => {
                Diagnostic::new(format!("{}: already exists", path.display()))
                    .help(format!("{FORCE} replaces it"))
            }
            Error::OutputIsInput { path } => Diagnostic::new(format!(
                "{}: is the input; it will not be overwritten, not even with {FORCE}",
                path.display()
            ))
            .help("give another name to -o"),
            Error::BrokenPipe => Diagnostic::new("the reader of standard output has gone"),
            Error::Bind { address, source } => {
                let what = caused(format_args!("cannot listen on {address}"), source);
                match source.kind() {
                    io::ErrorKind::AddrInUse => what.help(format!(
                        "is another strapd running there? {LISTEN} takes another address; port 0 takes a free port and shows it"
                    )),
                    io::ErrorKind::PermissionDenied => {
                        what.help("ports below 1024 need a privilege; take a higher one")
                    }
                    _ => what,
                }
            }
            Error::Connect { address, source } => {
                Diagnostic::new(format!("cannot connect to {address}: {source}")).help(
                    "somebody has to listen there first: strapd serve, nc -l PORT, PlotJuggler's UDP server",
                )
            }
            Error::Remote { address, what } => what.clone().at(address),
            Error::Usage(what) => what.clone(),
        }
    }
}

/// Diagnostic of what failed and why; where the cause is one of ours, with its help.
fn caused(what: fmt::Arguments<'_>, source: &io::Error) -> Diagnostic {
    let own = source.get_ref().and_then(|why| why.downcast_ref());
    let why = own.cloned();
    why.unwrap_or_else(|| Diagnostic::new(source.to_string()))
        .at(what)
}

/// Text with the help on a line of its own.
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Diagnostic::from(self).fmt(f)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Recording(error) => error.source(),
            Error::Write { source, .. }
            | Error::Bind { source, .. }
            | Error::Connect { source, .. } => Some(source),
            Error::Spool(error) => Some(error),
            Error::OutputExists { .. }
            | Error::OutputIsInput { .. }
            | Error::BrokenPipe
            | Error::Remote { .. }
            | Error::Usage(_) => None,
        }
    }
}

impl From<strapd_recording::Error> for Error {
    fn from(error: strapd_recording::Error) -> Error {
        Error::Recording(error)
    }
}

impl From<SpoolError> for Error {
    fn from(error: SpoolError) -> Error {
        Error::Spool(error)
    }
}

/// Result of a run.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A combination of arguments that cannot be.
    #[cold]
    #[inline(never)]
    pub fn usage(what: impl Into<Diagnostic>) -> Error {
        Error::Usage(what.into())
    }

    /// Error for what cannot be read of this file.
    pub(crate) fn unsupported(path: &Path, what: impl Into<Diagnostic>) -> Error {
        strapd_recording::Error::unsupported(path, what).into()
    }

    /// A failed write to something that has a name but no path; a closed pipe is told apart.
    #[must_use]
    pub fn writing(name: &str, source: io::Error) -> Error {
        if source.kind() == io::ErrorKind::BrokenPipe {
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
