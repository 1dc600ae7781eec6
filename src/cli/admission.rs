//! Who may connect, as flags. I/O: reads the token file.

use crate::error::Result;
use crate::serve::Settings;
use crate::serve::admission::{Token, Web};
use clap::Args;
use std::path::PathBuf;

/// Who may connect.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Admission")]
pub struct Admission {
    /// Ask every client for the token in this file (first line, mode 0600)
    #[arg(long, value_name = "FILE", env = "STRAPD_TOKEN_FILE")]
    pub token_file: Option<PathBuf>,
    /// Listen where others can reach it without asking for a token
    #[arg(long)]
    pub allow_insecure_remote: bool,
    /// Let pages of this origin, such as `https://example.org`, connect. May be given several times
    #[arg(long, value_name = "ORIGIN")]
    pub allow_origin: Vec<String>,
    /// A name this machine is called in HTTP requests. May be given several times
    #[arg(long, value_name = "HOST")]
    pub allow_host: Vec<String>,
}

impl Admission {
    /// These settings, and who may connect.
    ///
    /// # Errors
    /// The token file can not be read, or holds none.
    pub(super) fn apply(&self, settings: Settings) -> Result<Settings> {
        Ok(Settings {
            token: self.token_file.as_deref().map(Token::read).transpose()?,
            allow_insecure_remote: self.allow_insecure_remote,
            web: Web {
                hosts: self.allow_host.clone(),
                origins: self.allow_origin.clone(),
            },
            ..settings
        })
    }
}
