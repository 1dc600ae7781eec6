//! A replay or a simulation that is served: its flags, and its server. I/O.

use super::admission::Admission;
use super::{Outcome, replay};
use crate::error::{Error, Result};
use crate::pipeline::audience::Audience;
use crate::pipeline::replay as pipeline;
use crate::pipeline::request::ReplayRequest;
use crate::serve::Settings;
use crate::serve::core::hub;
use crate::serve::playback::controls::Playback;
use crate::serve::playback::overview::Overview;
use crate::serve::playback::server::{Next, PlaybackServer};
use crate::sink::address::Listen;
use crate::sink::{FrameNames, Target};
use clap::Args;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::pool::Pool;

/// Address of the page when none is given: beside the daemon's.
const PAGE: &str = "127.0.0.1:8766";

/// Way by which a run is served to whoever connects.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Serving (-o tcp-listen://, unix-listen://, ws-listen://)")]
pub struct Serving {
    /// Serve at this address (or at this port of this machine) as -o ws-listen:// does, at --speed 1 unless said otherwise, and stay
    /// after the end until Ctrl-C. A replay of a file waits at its start for who plays it (not with -o or --loop).
    /// Without --page a run ends at its end
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = PAGE, require_equals = true)]
    pub page: Option<String>,
    /// Wait at the start until a client asks to play; at --speed 1 unless said otherwise
    #[arg(long)]
    pub paused: bool,
    /// Begin again at the end, until Ctrl-C
    #[arg(long = "loop")]
    pub looping: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub admission: Admission,
}

/// A run to be served, and how.
#[derive(Debug)]
pub(super) struct Served {
    /// Targets.
    pub(super) targets: Vec<Target>,
    /// Speed.
    pub(super) speed: Option<f64>,
    /// Server, where there is somebody to serve.
    cast: Option<Arc<PlaybackServer>>,
    looping: bool,
    can_rewind: bool,
    has_page: bool,
    overview: Option<Looking>,
}

/// The run that makes the overview of a recording.
#[derive(Debug)]
struct Looking {
    overview: Arc<Overview>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Looking {
    fn drop(&mut self) {
        self.overview.stop();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Serving {
    /// Starts the server, if a target listens. `speed` is what was given; `source` what is played, whether it can be
    /// played again, and whether it brings samples beside attitudes; `frames` names its frames.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag; [`Error::Bind`].
    pub(super) fn start(
        &self,
        mut targets: Vec<Target>,
        speed: Option<&str>,
        (source, can_rewind, brings_samples): (&str, bool, bool),
        frames: &FrameNames,
    ) -> Result<Served> {
        if let Some(page) = &self.page {
            // A port alone is one of this machine.
            let of_here = if page.parse::<u16>().is_ok() { ":" } else { "" };
            targets.push(Target::Listen(Listen::parse_from(
                "--page",
                &format!("ws-listen://{of_here}{page}"),
            )?));
        }
        let speed = match speed {
            Some(text) => replay::speed(text)?,
            None if self.page.is_some() || self.paused => Some(1.0),
            None => None,
        };
        let listen: Vec<Listen> = targets
            .iter()
            .filter_map(Target::listens)
            .cloned()
            .collect();
        for (given, flag) in [(self.paused, "--paused"), (self.looping, "--loop")] {
            if given && listen.is_empty() {
                return Err(Error::usage(
                    Diagnostic::new(format!("{flag}: nobody is served"))
                        .help("--page, or -o ws-listen://127.0.0.1:8766"),
                ));
            }
        }
        if self.paused && speed.is_none() {
            return Err(Error::usage(
                Diagnostic::new("--paused: a run at --speed max is not controlled")
                    .help("--speed 1"),
            ));
        }
        if self.looping && !can_rewind {
            return Err(Error::usage(
                Diagnostic::new(format!("--loop: {source} can be read only once"))
                    .help("give it as a file"),
            ));
        }
        let cast = if listen.is_empty() {
            None
        } else {
            let others = targets.len() - listen.len();
            // Nobody is to come too late; but a file beside, a stream and --loop go on without anybody.
            let is_awaited = self.page.is_some() && !brings_samples && can_rewind;
            let is_paused =
                self.paused || (is_awaited && others == 0 && !self.looping && speed.is_some());
            // Who connects has no need of the folder.
            let name = Path::new(source)
                .file_name()
                .map(|name| name.to_string_lossy());
            let name = name.as_deref().unwrap_or(source);
            let playback = Playback::new(name, speed, is_paused);
            playback.forward_only(if !can_rewind {
                Some("the input can be read only once, so there is no way back")
            } else if others > 0 {
                Some("the run also writes outputs that are not complete yet; there is a way back after the end")
            } else {
                None
            });
            let settings = Settings {
                hub: hub::Settings {
                    brings_samples,
                    frames: frames.clone(),
                    ..hub::Settings::default()
                },
                listen: listen.into_iter().map(Into::into).collect(),
                ..Settings::default()
            };
            let settings = self.admission.apply(settings, false)?;
            let cast = PlaybackServer::start(settings, playback, self.page.is_some(), true)?;
            let addresses: Vec<String> = cast.addresses().iter().map(ToString::to_string).collect();
            tracing::info!(
                session = cast.hub().session(),
                "ready {}",
                addresses.join(" ")
            );
            if self.page.is_some()
                && let Some(Listen::WebSocket(page)) = cast.addresses().last()
            {
                tracing::info!("page http://{page}/");
            }
            Some(Arc::new(cast))
        };
        Ok(Served {
            targets,
            speed,
            cast,
            looping: self.looping,
            can_rewind,
            has_page: self.page.is_some(),
            overview: None,
        })
    }
}

impl Served {
    /// Audience of the run.
    pub(super) fn audience(&self) -> Option<Arc<dyn Audience>> {
        let cast = self.cast.clone()?;
        Some(cast)
    }

    /// Looks through the whole recording of `run` beside the run itself, for a page; what it says is said by the run.
    pub(super) fn look_through(&mut self, run: &ReplayRequest, threads: usize) {
        let Some(cast) = self.cast.as_ref().filter(|cast| cast.is_paced()) else {
            return;
        };
        if !(self.has_page && self.can_rewind) {
            return;
        }
        let overview = Arc::new(Overview::default());
        let request = ReplayRequest {
            targets: Vec::new(),
            audience: Some(overview.clone()),
            speed: None,
            copy_input: false,
            ..run.clone()
        };
        cast.playback().set_overview(overview.clone());
        let found = overview.clone();
        let look = move || {
            let silent = tracing::subscriber::NoSubscriber::default();
            let run = || {
                let pool = Pool::new(threads)?;
                pipeline::run(&request, &pool, &mut |_| {})
            };
            // Why it fails the run that is played says.
            let _ = tracing::subscriber::with_default(silent, run);
            found.complete();
        };
        let thread = std::thread::Builder::new().name("strapd-overview".to_owned());
        match thread.spawn(look) {
            Ok(thread) => {
                let thread = Some(thread);
                self.overview = Some(Looking { overview, thread });
            }
            Err(why) => tracing::warn!("no overview of the recording: no thread: {why}"),
        }
    }

    /// Runs once, and again as often as a client or `--loop` asks for it: then with `true`, to those
    /// who are connected alone. The result is that of the first run.
    ///
    /// # Errors
    /// Those of a run.
    pub(super) fn run<T>(&self, mut once: impl FnMut(bool) -> Result<T>) -> Result<(T, Outcome)> {
        let first = once(false)?;
        let Some(cast) = &self.cast else {
            return Ok((first, Outcome::Done));
        };
        let mut outcome = Outcome::Done;
        let others: Vec<&Target> = self
            .targets
            .iter()
            .filter(|t| t.listens().is_none())
            .collect();
        if cast.playback().is_stopped()
            && others
                .iter()
                .any(|t| matches!(t, Target::File { .. } | Target::Store { .. }))
        {
            tracing::warn!("stopped before the end: the files were not written");
            outcome = Outcome::Failed;
        }
        // Whatever else was written is complete now.
        if !others.is_empty() && self.can_rewind {
            cast.playback().forward_only(None);
        }
        while cast.next(self.looping) == Next::Again {
            once(true)?;
        }
        if !cast.finish() {
            tracing::warn!("not everything could be sent in time");
        }
        Ok((first, outcome))
    }
}
