//! The word after `-o` -> where the attitude goes, in which format. Pure.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// What a file or pipe is filled with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// An indexed MCAP file.
    Mcap,
    /// One `ATT` object per line.
    Ndjson,
    /// One row per sample under a header row.
    Csv,
}

/// Where the output goes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Target {
    /// A file; the format follows its extension.
    File {
        /// Which file.
        path: PathBuf,
        /// What it is filled with.
        format: Format,
    },
    /// NDJSON on standard output. The reader hanging up ends it quietly.
    Stdout,
    /// Counted and discarded.
    Null,
}

/// The list every message about an unknown sink ends with.
const KNOWN: &str = "known sinks: FILE.mcap, FILE.ndjson (or .jsonl), FILE.csv, - (NDJSON on standard output), null: (discard)";

/// Schemes that are sinks of the daemon, not of a finished replay.
const SOCKET_SCHEMES: [&str; 11] = [
    "tcp",
    "tcp-listen",
    "udp",
    "udp-listen",
    "unix",
    "unix-listen",
    "ws",
    "wss",
    "ws-listen",
    "http",
    "https",
];

impl Target {
    /// Reads what the user wrote after `-o`.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the known sinks.
    pub fn parse(text: &str) -> Result<Target> {
        match text {
            "-" => return Ok(Target::Stdout),
            "null:" => return Ok(Target::Null),
            "" => {
                return Err(Error::Usage(format!(
                    "-o: the name is empty\n  help: {KNOWN}"
                )));
            }
            _ => {}
        }
        if let Some((scheme, _)) = text.split_once("://") {
            return Err(Error::Usage(
                if SOCKET_SCHEMES.contains(&scheme.to_ascii_lowercase().as_str()) {
                    format!(
                        "-o {text}: this command does not write to sockets yet\n  help: write NDJSON to standard output with `-o -` and pipe it; {KNOWN}"
                    )
                } else {
                    format!("-o {text}: unknown scheme `{scheme}`\n  help: {KNOWN}")
                },
            ));
        }
        Target::from_path(Path::new(text))
    }

    /// A file whose extension, in any case, names the format.
    ///
    /// # Errors
    /// [`Error::Usage`] when the extension is missing or unknown.
    pub fn from_path(path: &Path) -> Result<Target> {
        let extension = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        let format = match extension.as_deref() {
            Some("mcap") => Format::Mcap,
            Some("ndjson" | "jsonl") => Format::Ndjson,
            Some("csv") => Format::Csv,
            Some(other) => {
                return Err(Error::Usage(format!(
                    "-o {}: unknown extension `.{other}`\n  help: {KNOWN}",
                    path.display()
                )));
            }
            None => {
                return Err(Error::Usage(format!(
                    "-o {}: no extension, so the format is unknown\n  help: {KNOWN}",
                    path.display()
                )));
            }
        };
        Ok(Target::File {
            path: path.to_path_buf(),
            format,
        })
    }

    /// What it is filled with; `None` for [`Target::Null`].
    #[must_use]
    pub fn format(&self) -> Option<Format> {
        match self {
            Target::File { format, .. } => Some(*format),
            Target::Stdout => Some(Format::Ndjson),
            Target::Null => None,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_in_any_case_names_the_format() {
        for (text, format) in [
            ("a.mcap", Format::Mcap),
            ("dir.csv/a.MCAP", Format::Mcap),
            ("a.ndjson", Format::Ndjson),
            ("a.b.jsonl", Format::Ndjson),
            ("./x/a.CSV", Format::Csv),
        ] {
            let target = Target::parse(text).unwrap();
            assert_eq!(target.format(), Some(format), "{text}");
        }
        assert_eq!(Target::parse("-").unwrap(), Target::Stdout);
        assert_eq!(Target::parse("null:").unwrap(), Target::Null);
    }

    #[test]
    fn what_is_not_a_sink_is_refused_with_the_list_of_those_that_are() {
        for text in ["", "out", "out.bag", "s3://b/x.mcap", ".mcap", "x.mcap/"] {
            match Target::parse(text) {
                Err(Error::Usage(message)) => {
                    assert!(message.contains("known sinks: FILE.mcap"), "{message}");
                }
                // Path::extension reads `x.mcap/` as `x.mcap`: a file name with a slash is the
                // opener's business.
                other => assert_eq!(text, "x.mcap/", "{other:?}"),
            }
        }
        let Err(Error::Usage(message)) = Target::parse("tcp://host:1") else {
            unreachable!("a socket is not a sink of replay")
        };
        assert!(
            message.contains("does not write to sockets yet"),
            "{message}"
        );
    }
}
