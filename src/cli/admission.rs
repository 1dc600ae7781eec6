//! Flags of who may connect. I/O: reads the token file.

use crate::client::secret::Secret;
use crate::error::Result;
use crate::serve::Settings;
use crate::serve::core::hub;
use crate::serve::guard::admission::{Token, Web};
use crate::serve::guard::limits::Limits;
use clap::Args;
use std::path::PathBuf;

/// Most clients that can be asked for.
const MAX_CLIENTS: u64 = 100_000;

/// Clients that may connect.
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
    /// Most clients at once that send or watch; each is an open file. One more is told `too_many_clients`, unless
    /// somebody gives way who has ended its side, or sent and watched nothing for a minute
    #[arg(long, value_name = "N", default_value_t = Limits::default().connections, env = "STRAPD_MAX_CLIENTS", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=MAX_CLIENTS))]
    pub max_clients: usize,
}

impl Admission {
    /// Applies them to these settings. Where the page `is_lan`, a token is made if none is given.
    ///
    /// # Errors
    /// The token file cannot be read, or holds none.
    pub(super) fn apply(&self, settings: Settings, is_lan: bool) -> Result<Settings> {
        let secret = match &self.token_file {
            Some(path) => Some(Secret::read("--token-file", path)?),
            None if is_lan && !self.allow_insecure_remote => Some(Secret::random()?),
            None => None,
        };
        Ok(Settings {
            hub: hub::Settings {
                token: secret.as_ref().map(|secret| Token::new(secret.reveal())),
                limits: settings.hub.limits.of_clients(self.max_clients),
                ..settings.hub
            },
            invitation: secret.filter(|_| is_lan),
            allow_insecure_remote: self.allow_insecure_remote,
            web: Web {
                hosts: self.allow_host.clone(),
                origins: self.allow_origin.clone(),
            },
            ..settings
        })
    }
}
