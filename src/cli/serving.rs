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

/// Input of a run that is to be served.
#[derive(Clone, Copy, Debug)]
pub(super) struct Played<'a> {
    /// Name of it.
    pub(super) name: &'a str,
    /// Whether it can be played again.
    pub(super) can_rewind: bool,
    /// Whether it brings samples beside attitudes.
    pub(super) brings_samples: bool,
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
    /// Starts the server, if a target listens. `speed` is what was given; `frames` names the frames of what is played.
    ///
    /// # Errors
    /// [`Error::Usage`] naming the flag; [`Error::Bind`].
    pub(super) fn start(
        &self,
        mut targets: Vec<Target>,
        speed: Option<&str>,
        played: Played<'_>,
        frames: &FrameNames,
    ) -> Result<Served> {
        targets.extend(self.page_target()?);
        let speed = self.speed(speed)?;
        let listen: Vec<Listen> = targets
            .iter()
            .filter_map(Target::listens)
            .cloned()
            .collect();
        self.check(&listen, speed, played)?;
        let cast = if listen.is_empty() {
            None
        } else {
            let playback = self.playback(played, speed, targets.len() - listen.len());
            let hub = hub::Settings {
                brings_samples: played.brings_samples,
                frames: frames.clone(),
                ..hub::Settings::default()
            };
            Some(Arc::new(self.start_cast(listen, playback, hub)?))
        };
        Ok(Served {
            targets,
            speed,
            cast,
            looping: self.looping,
            can_rewind: played.can_rewind,
            has_page: self.page.is_some(),
            overview: None,
        })
    }

    /// Target that `--page` stands for.
    fn page_target(&self) -> Result<Option<Target>> {
        let Some(page) = &self.page else {
            return Ok(None);
        };
        // A port alone is one of this machine.
        let of_here = if page.parse::<u16>().is_ok() { ":" } else { "" };
        let listen = Listen::parse_from("--page", &format!("ws-listen://{of_here}{page}"))?;
        Ok(Some(Target::Listen(listen)))
    }

    /// Speed of the run: what was given, else that of data where somebody is to look on.
    fn speed(&self, speed: Option<&str>) -> Result<Option<f64>> {
        match speed {
            Some(text) => replay::speed(text),
            None if self.page.is_some() || self.paused => Ok(Some(1.0)),
            None => Ok(None),
        }
    }

    /// Checks that what is asked for can be done.
    fn check(&self, listen: &[Listen], speed: Option<f64>, played: Played<'_>) -> Result<()> {
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
        if self.looping && !played.can_rewind {
            return Err(Error::usage(
                Diagnostic::new(format!("--loop: {} can be read only once", played.name))
                    .help("give it as a file"),
            ));
        }
        Ok(())
    }

    /// Position of the run and who may change it; `others` = targets that do not listen.
    fn playback(&self, played: Played<'_>, speed: Option<f64>, others: usize) -> Playback {
        // Nobody is to come too late; but a file beside, a stream and --loop go on without anybody.
        let is_awaited = self.page.is_some() && !played.brings_samples && played.can_rewind;
        let is_paused =
            self.paused || (is_awaited && others == 0 && !self.looping && speed.is_some());
        // Who connects has no need of the folder.
        let name = Path::new(played.name)
            .file_name()
            .map(|name| name.to_string_lossy());
        let name = name.as_deref().unwrap_or(played.name);
        let playback = Playback::new(name, speed, is_paused);
        playback.forward_only(if !played.can_rewind {
            Some("the input can be read only once, so there is no way back")
        } else if others > 0 {
            Some("the run also writes outputs that are not complete yet; there is a way back after the end")
        } else {
            None
        });
        playback
    }

    /// Starts the server, and says where it is.
    fn start_cast(
        &self,
        listen: Vec<Listen>,
        playback: Playback,
        hub: hub::Settings,
    ) -> Result<PlaybackServer> {
        let settings = Settings {
            hub,
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
        Ok(cast)
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
