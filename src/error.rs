//! Everything that can end a run. One flat enum; each variant says what, where, why, and the
//! flag that helps. Bad samples are not here: they are counted verdicts ([`crate::record::Verdict`]).

use std::path::PathBuf;

/// A run that could not be carried out.
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
    /// Writing failed (disk full, permission, ...).
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
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
    /// The output is already there.
    #[error("{}: already exists\n  help: --force replaces it", path.display())]
    OutputExists {
        /// Which file.
        path: PathBuf,
    },
    /// Output and input are the same file.
    #[error("{}: is the input; it will not be overwritten, not even with --force\n  help: give another name to -o", path.display())]
    OutputIsInput {
        /// Which file.
        path: PathBuf,
    },
    /// A combination of arguments that can not be.
    #[error("{0}")]
    Usage(String),
}

/// Result of a run.
pub type Result<T> = std::result::Result<T, Error>;
