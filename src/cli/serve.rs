//! `strapd serve`: samples over sockets -> attitudes over sockets. I/O.

use super::estimation::Estimation;
use super::{Global, Outcome};
use crate::error::{Error, Result};
use crate::serve::address::{DEFAULTS, Listen};
use crate::serve::admission::{Token, Web};
use crate::serve::limits::Limits;
use crate::serve::shutdown::{self, Signals};
use crate::serve::{Server, Settings, listen};
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Samples in over sockets, attitude out to whoever watches.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  strapd serve                                           TCP on 127.0.0.1:4550, WebSocket and HTTP on 127.0.0.1:8765
  strapd serve --listen tcp-listen://127.0.0.1:0         a free port, named in the ready line
  strapd cat flight.mcap | strapd serve -                lines on standard input, too

Talk to it:
  echo '{\"class\":\"RATE\",\"id\":\"imu0\",\"stamp\":{\"sec\":1,\"nsec\":0},\"gyro\":[0.1,0,0]}' | nc 127.0.0.1 4550
  echo '{\"class\":\"WATCH\"}' | nc 127.0.0.1 4550             attitudes as they come
  curl 127.0.0.1:8765/metrics")]
pub struct Serve {
    /// - reads samples from standard input as well
    #[arg(value_name = "SOURCE")]
    pub sources: Vec<String>,
    /// Where to listen: tcp-listen://HOST:PORT, udp-listen://HOST:PORT, ws-listen://HOST:PORT (with
    /// HTTP), unix-listen:///PATH. May be given several times; port 0 takes a free one
    /// [default: tcp-listen://127.0.0.1:4550 and ws-listen://127.0.0.1:8765]
    #[arg(long, value_name = "URI")]
    pub listen: Vec<String>,
    /// Take what is not given as a flag or in the environment from this TOML file
    #[arg(long, value_name = "FILE", env = "STRAPD_CONFIG")]
    pub config: Option<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub estimation: Estimation,
    /// Ask every client for the token in this file (first line, mode 0600)
    #[arg(
        long,
        value_name = "FILE",
        help_heading = "Admission",
        env = "STRAPD_TOKEN_FILE"
    )]
    pub token_file: Option<PathBuf>,
    /// Listen where others can reach it without asking for a token
    #[arg(long, help_heading = "Admission")]
    pub allow_insecure_remote: bool,
    /// Let pages of this origin, such as `https://example.org`, connect. May be given several times
    #[arg(long, value_name = "ORIGIN", help_heading = "Admission")]
    pub allow_origin: Vec<String>,
    /// A name this machine is called in HTTP requests. May be given several times
    #[arg(long, value_name = "HOST", help_heading = "Admission")]
    pub allow_host: Vec<String>,
}

/// Runs it until a signal.
///
/// # Errors
/// An address can not be listened on, or the arguments can not be.
pub fn run(global: &Global, args: &Serve) -> Result<Outcome> {
    if let Some(other) = args.sources.iter().find(|s| *s != "-") {
        return Err(Error::Usage(format!(
            "serve {other}: only - (standard input) is a source\n  help: --listen waits for senders; strapd replay reads a log"
        )));
    }
    let settings = match &args.config {
        Some(file) => super::config::layered(file, std::env::args_os().collect())?.settings()?,
        None => args.settings()?,
    };
    let mut builder = tokio::runtime::Builder::new_multi_thread();
    if global.threads > 0 {
        builder.worker_threads(global.threads);
    }
    let runtime = builder
        .thread_name("strapd-serve")
        .enable_all()
        .build()
        .map_err(|e| Error::Usage(format!("--threads {}: {e}", global.threads)))?;
    let has_stdin = !args.sources.is_empty();
    let outcome = runtime.block_on(serve(settings, has_stdin));
    // A thread that waits for standard input would otherwise be waited for.
    runtime.shutdown_background();
    outcome
}

async fn serve(settings: Settings, has_stdin: bool) -> Result<Outcome> {
    // Signals first: from the ready line on, one drains.
    let signals = Signals::new().map_err(|e| Error::Usage(format!("signals: {e}")))?;
    let server = Server::bind(settings).await?;
    let addresses: Vec<String> = server.addresses().iter().map(ToString::to_string).collect();
    let hub = server.hub().clone();
    tracing::info!(session = hub.session(), "ready {}", addresses.join(" "));
    // Nobody may have started us that wants to know.
    let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
    if has_stdin {
        let hub = hub.clone();
        std::thread::spawn(move || listen::read_stdin(&hub, std::io::stdin().lock()));
    }
    let drained = server
        .run(async {
            let signal = shutdown::first(signals).await;
            tracing::info!("{}: shutting down", signal.name());
            let _ = sd_notify::notify(&[sd_notify::NotifyState::Stopping]);
        })
        .await;
    if !drained {
        tracing::warn!("not everything could be sent in time");
    }
    let of = |n: &std::sync::atomic::AtomicU64| n.load(Ordering::Relaxed);
    tracing::info!(
        "served {:.1} s: {} samples in, {} attitudes, {} bad lines",
        hub.uptime_secs(),
        of(&hub.counters.samples),
        of(&hub.counters.attitudes),
        of(&hub.counters.faults)
    );
    Ok(Outcome::Done)
}

impl Serve {
    /// The arguments, checked.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag; the token file can not be read.
    pub(crate) fn settings(&self) -> Result<Settings> {
        let given: Vec<&str> = if self.listen.is_empty() {
            DEFAULTS.to_vec()
        } else {
            self.listen.iter().map(String::as_str).collect()
        };
        Ok(Settings {
            plan: self.estimation.plan()?,
            plans: BTreeMap::new(),
            listen: given
                .into_iter()
                .map(Listen::parse)
                .collect::<Result<_>>()?,
            limits: Limits::default(),
            token: self.token_file.as_deref().map(Token::read).transpose()?,
            allow_insecure_remote: self.allow_insecure_remote,
            web: Web {
                hosts: self.allow_host.clone(),
                origins: self.allow_origin.clone(),
            },
            tap: None,
        })
    }
}
