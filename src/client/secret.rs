//! A file -> the token in it. Reads the file.

use crate::error::{Error, Result};
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;

/// A token shorter than this can be guessed.
const MIN_TOKEN: usize = 16;
/// A file longer than this is no token.
const MAX_TOKEN: u64 = 4096;

/// A token that is shown to others, or that others must show.
#[derive(Clone)]
pub struct Secret(String);

impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secret(..)")
    }
}

impl Secret {
    /// The first line of a file that nobody but its owner can read; `flag` names the file in what is
    /// said of it.
    ///
    /// # Errors
    /// It cannot be read, others can read it, or it holds no token of 16 bytes.
    pub fn read(flag: &str, path: &Path) -> Result<Secret> {
        Secret::no_shorter_than(MIN_TOKEN, flag, path)
    }

    /// The same, where somebody else has chosen it.
    ///
    /// # Errors
    /// It cannot be read, others can read it, or it holds nothing.
    #[cfg(any(feature = "nats", feature = "zenoh"))]
    pub fn of_others(flag: &str, path: &Path) -> Result<Secret> {
        Secret::no_shorter_than(1, flag, path)
    }

    fn no_shorter_than(least: usize, flag: &str, path: &Path) -> Result<Secret> {
        let open = |source| strapd_recording::Error::Open {
            path: path.to_owned(),
            source,
        };
        let refuse =
            |what: Diagnostic| Error::usage(what.at(format_args!("{flag} {}", path.display())));
        let metadata = std::fs::metadata(path).map_err(open)?;
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = metadata.permissions().mode() & 0o777;
            if mode & 0o077 != 0 {
                return Err(refuse(
                    Diagnostic::new(format!("others can read it (mode {mode:o})"))
                        .help(format!("chmod 600 {}", path.display())),
                ));
            }
        }
        if !metadata.is_file() || metadata.len() > MAX_TOKEN {
            return Err(refuse("is no file of one short line".into()));
        }
        let text = std::fs::read_to_string(path).map_err(open)?;
        let token = text.lines().next().unwrap_or_default().trim();
        if token.len() < least {
            return Err(refuse(
                Diagnostic::new(format!(
                    "holds {} bytes, a token has at least {least}",
                    token.len()
                ))
                .help("head -c 32 /dev/urandom | base64 > FILE"),
            ));
        }
        Ok(Secret(token.to_owned()))
    }

    /// Text that only its receiver may see.
    #[must_use]
    pub fn reveal(&self) -> &str {
        &self.0
    }
}
