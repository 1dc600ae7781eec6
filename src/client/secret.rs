//! A file -> the token in it. Reads the file.

use crate::error::{Error, Result};
use std::io::Write;
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

    /// A token of 128 random bits from the operating system, as text that needs no encoding in an address.
    ///
    /// # Errors
    /// The operating system gives no random bytes.
    pub fn random() -> Result<Secret> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes)
            .map_err(|e| Error::usage(format!("no random token can be made: {e}")))?;
        Ok(Secret(bytes.iter().map(|b| format!("{b:02x}")).collect()))
    }

    /// Writes it to a new file that nobody but its owner can read; a file that is there stays as it is.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep(&self, path: &Path) -> Result<()> {
        let mut open = std::fs::OpenOptions::new();
        open.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut open, 0o600);
        let written = open
            .open(path)
            .and_then(|mut file| writeln!(file, "{}", self.0));
        match written {
            Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => Err(Error::Write {
                path: path.to_owned(),
                source: e,
            }),
            _ => Ok(()),
        }
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
