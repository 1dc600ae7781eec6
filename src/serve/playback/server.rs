//! A replay or a simulation -> whoever connects: its server, on a thread of its own. I/O.
//!
//! The same listeners, sessions, outboxes and limits as the daemon's; what differs is that the samples
//! are the run's own, and that the run can be stopped, moved and begun anew ([`crate::serve::playback`]).
//! To the run it is an [`Audience`].

use super::controls::{Grant, Notice, Playback};
use super::estimated::Estimated;
use crate::error::{Error, Result};
use crate::pipeline::audience::{self, Audience};
use crate::serve::core::channel::health::Health;
use crate::serve::core::channel::{Channel, Items};
use crate::serve::core::hub::{Flood, Hub};
use crate::serve::daemon::{Server, Settings};
use crate::serve::guard::shutdown::Signals;
use crate::sink::address::Listen;
use crate::sink::{Content, Stream};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use strapd_attitude::estimate::Estimator;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};
use tokio::sync::oneshot;

/// Items handed out at once: well below what may wait for a client.
const AT_ONCE: usize = 256;

/// A run that is served.
#[derive(Debug)]
pub struct PlaybackServer {
    hub: Arc<Hub>,
    playback: Arc<Playback>,
    addresses: Vec<Listen>,
    streams: Mutex<Vec<Lane>>,
    /// Recorded orientations, by the stream they are beside; there is one from the first of them on.
    recorded: Mutex<BTreeMap<usize, Lane>>,
    /// Estimate from the samples of a simulation, for its page.
    estimated: Mutex<Estimated>,
    text: Mutex<Vec<u8>>,
    server: Mutex<Option<Serving>>,
    forever: bool,
}

#[derive(Debug)]
struct Serving {
    stop: oneshot::Sender<()>,
    thread: JoinHandle<bool>,
}

/// A stream of the run.
#[derive(Debug)]
struct Lane {
    channel: Arc<Channel>,
    /// Number of the next item.
    next: u64,
    /// Flood control of a run without a pace.
    flood: Flood,
    /// Added to the reset counts: those of the runs before this one.
    resets: u32,
    /// The last reset count, as it was sent.
    last_reset: u32,
}

impl Lane {
    fn new(channel: Arc<Channel>) -> Lane {
        Lane {
            channel,
            next: 0,
            flood: Flood::default(),
            resets: 0,
            last_reset: 0,
        }
    }
}

/// Fate of a run that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Another run.
    Again,
    /// End.
    Done,
}

impl PlaybackServer {
    /// Listens, on everything or on nothing. `forever`: after the end it stays, for who may want to go
    /// back, until a signal. `signals`: the first one ends the run in order, the second one at once.
    ///
    /// # Errors
    /// As [`Server::bind`].
    pub fn start(
        mut settings: Settings,
        playback: Playback,
        forever: bool,
        signals: bool,
    ) -> Result<PlaybackServer> {
        let playback = Arc::new(playback);
        settings.hub.timeline = Some(playback.clone());
        let failed = |e: std::io::Error| Error::usage(format!("cannot serve: {e}"));
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("strapd-cast")
            .enable_all()
            .build()
            .map_err(failed)?;
        let (server, signals) = runtime.block_on(async {
            let signals = signals.then(Signals::new).transpose().map_err(failed)?;
            Ok::<_, Error>((Server::bind(settings).await?, signals))
        })?;
        let (hub, addresses) = (server.hub().clone(), server.addresses().to_vec());
        let (stop, stopped) = oneshot::channel();
        let asked = playback.clone();
        let thread = std::thread::Builder::new()
            .name("strapd-cast".to_owned())
            .spawn(move || {
                let drained = runtime.block_on(serve(server, asked, stopped, signals));
                runtime.shutdown_background();
                drained
            })
            .map_err(failed)?;
        Ok(PlaybackServer {
            hub,
            playback,
            addresses,
            streams: Mutex::default(),
            recorded: Mutex::default(),
            estimated: Mutex::default(),
            text: Mutex::default(),
            server: Mutex::new(Some(Serving { stop, thread })),
            forever,
        })
    }

    /// Addresses on which it listens, with real ports.
    #[must_use]
    pub fn addresses(&self) -> &[Listen] {
        &self.addresses
    }

    /// Hub.
    #[must_use]
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// Position and controls of the run.
    #[must_use]
    pub fn playback(&self) -> &Arc<Playback> {
        &self.playback
    }

    /// Whether the run goes at a pace.
    #[must_use]
    pub fn is_paced(&self) -> bool {
        self.playback.is_controlled()
    }

    fn hand(&self, lane: &mut Lane, items: Items<'_>, shown: bool) {
        let mut seq = lane.next;
        lane.next += items.count() as u64;
        if !shown {
            return;
        }
        let mut text = lock(&self.text);
        for some in items.chunks(AT_ONCE) {
            self.hub.distribute(&lane.channel, seq, some, &mut text);
            if !self.is_paced() {
                lane.flood.hold();
                lane.flood.wait_in_thread(&self.hub);
            }
            seq += some.count() as u64;
        }
    }

    /// The run has ended, of itself or because it was told to. Waits where there is to be waited for
    /// somebody who wants to go back.
    #[must_use]
    pub fn next(&self, looping: bool) -> Next {
        if self.playback.ended() {
            if looping {
                for lane in &mut *lock(&self.streams) {
                    lane.resets = lane.last_reset.saturating_add(1);
                }
                self.playback.again();
            } else {
                self.hub.announce(false, None);
                if !self.forever || !self.playback.wait_for_restart() {
                    return Next::Done;
                }
            }
        }
        if self.playback.begin_anew() {
            self.hub.tell_viewers();
            self.hub.announce(false, None);
            Next::Again
        } else {
            Next::Done
        }
    }

    /// Sends what waits, for no longer than the limit, and closes. Says whether all was sent.
    pub fn finish(&self) -> bool {
        self.playback.stop();
        let Some(Serving { stop, thread }) = lock(&self.server).take() else {
            return true;
        };
        // It has stopped already, after a signal.
        let _ = stop.send(());
        thread.join().unwrap_or(false)
    }
}

impl Audience for PlaybackServer {
    // The streams are those of the run before, if there was one.
    fn begin(&self, streams: &[Stream]) {
        for lane in lock(&self.recorded).values_mut() {
            lane.next = 0;
            lane.channel.begin_anew();
        }
        lock(&self.estimated).begin();
        let mut lanes = lock(&self.streams);
        if lanes.len() == streams.len() {
            for lane in &mut *lanes {
                lane.next = 0;
                lane.channel.begin_anew();
            }
            return;
        }
        for stream in streams.iter().skip(lanes.len()) {
            lanes.push(Lane::new(self.hub.declare(stream)));
        }
    }

    fn length(&self, secs: f64) {
        self.playback.length(secs);
    }

    fn turn(&self, count: usize, due: &dyn Fn(usize) -> Nanos) -> Option<audience::Grant> {
        let of = |count, is_shown| Some(audience::Grant { count, is_shown });
        loop {
            let (grant, notice) = self.playback.grant((0..count).map(due));
            if notice == Notice::Begun {
                self.hub.tell_viewers();
            }
            if notice != Notice::Nothing {
                self.hub.announce(notice == Notice::Tick, None);
            }
            match grant {
                Grant::Show(0) if count > 0 => {}
                Grant::Show(n) => return of(n, true),
                Grant::Mute(n) => return of(n, false),
                Grant::End => return None,
            }
        }
    }

    fn attitudes(&self, stream: usize, samples: &[AttitudeSample], shown: bool) {
        let mut lanes = lock(&self.streams);
        let Some(lane) = lanes.get_mut(stream) else {
            return;
        };
        if let Some(last) = samples.last() {
            lane.last_reset = last.reset_count.saturating_add(lane.resets);
            if !shown {
                self.playback.passed(last.stamp);
            }
        }
        if lane.resets == 0 {
            return self.hand(lane, Items::Attitudes(samples), shown);
        }
        let counted: Vec<AttitudeSample> = samples
            .iter()
            .map(|sample| AttitudeSample {
                reset_count: sample.reset_count.saturating_add(lane.resets),
                ..*sample
            })
            .collect();
        self.hand(lane, Items::Attitudes(&counted), shown);
    }

    fn samples(&self, stream: usize, samples: &[RawSample], shown: bool) {
        let mut lanes = lock(&self.streams);
        let Some(lane) = lanes.get_mut(stream) else {
            return;
        };
        self.hand(lane, Items::Samples(samples), shown);
        if let (true, Content::Samples(kind)) = (self.forever, lane.channel.stream().content) {
            let of = (&*self.hub, lane.channel.id());
            let text = &mut lock(&self.text);
            lock(&self.estimated).take(of, kind, samples, shown, text);
        }
    }

    fn known(&self, stream: usize, estimator: &Estimator) {
        if let Some(lane) = lock(&self.streams).get(stream) {
            lane.channel.known(Health::of(estimator));
        }
    }

    // The page draws them; who watches lines gets what `-o -` says.
    fn wants_recorded(&self) -> bool {
        self.forever
    }

    fn recorded(&self, of: usize, stream: &Stream, samples: &[AttitudeSample], shown: bool) {
        let mut lanes = lock(&self.recorded);
        let lane = lanes
            .entry(of)
            .or_insert_with(|| Lane::new(self.hub.declare(stream)));
        self.hand(lane, Items::Attitudes(samples), shown);
    }

    fn is_cut(&self) -> bool {
        self.playback.is_cut()
    }
}

impl Drop for PlaybackServer {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Serves until the run has ended, or a signal has ended it.
async fn serve(
    server: Server,
    playback: Arc<Playback>,
    mut stopped: oneshot::Receiver<()>,
    signals: Option<Signals>,
) -> bool {
    let limit = server.hub().limits().drain;
    let mut at_once = None;
    let drained = server
        .run(async {
            let Some(mut signals) = signals else {
                let _ = stopped.await;
                return;
            };
            tokio::select! {
                _ = &mut stopped => {}
                signal = signals.first(|| false) => {
                    tracing::info!("{}: stopping", signal.name());
                    playback.stop();
                    // A run that waits for its input does not notice.
                    if tokio::time::timeout(limit / 2, &mut stopped).await.is_err() {
                        at_once = Some(signal);
                    }
                }
            }
        })
        .await;
    if let Some(signal) = at_once {
        std::process::exit(signal.exit_code());
    }
    drained
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
