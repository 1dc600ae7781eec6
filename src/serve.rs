//! Samples over sockets -> attitudes over sockets: the daemon. I/O.
//!
//! ```text
//! listen (sockets -> bytes) -> session (lines) -> hub (one estimator a sensor) -> outbox (a client's bytes)
//! ```
//!
//! | file | arrow | |
//! |---|---|---|
//! | [`wire`] | lines and packed objects (cut by [`strapd_recording::decode::framing`]) -> requests; answers -> lines | pure |
//! | [`stream`] | samples of one sensor -> attitudes | pure |
//! | [`channel`], [`last`] | a stream as clients know it; its last attitude, for who comes late | pure |
//! | [`playback`] | a replay or simulation served in place of sensors, and who moves it | I/O; locks |
//! | [`session`] | one client's lines -> hub, answers | sans-I/O |
//! | `owned` | the sensors one client sends -> hub, and again when they were put away | locks |
//! | [`hub`] | samples -> attitudes -> outboxes | locks |
//! | [`outbox`] | attitudes -> what one client gets, bounded | locks |
//! | [`recorder`] | what goes through -> MCAP files that survive a crash | a queue; I/O on threads of its own |
//! | [`state`] | attitudes <-> the file a restarted daemon goes on from | I/O |
//! | [`limits`], [`admission`], [`peer`], `strangers` | every bound; who may come in, and from where; who shows wrong tokens | pure |
//! | [`places`] | which connection has a place, and who gives it up | locks |
//! | [`foxglove`], [`viewer`] | the same for Foxglove's viewers: messages in place of lines | pure; sans-I/O |
//! | `page`, `top_page` | what a browser gets | pure |
//! | [`listen`], `http`, `samples` | sockets others come to; samples by `POST` | I/O |
//! | [`source`], [`connect`], [`upstream`]; `forward` | sockets others listen on: samples from there; attitudes to there | I/O |
//! | `nats` | subjects of a broker: samples from there, attitudes to there (feature `nats`) | I/O |
//! | `zenoh` | keys of a router, ROS 2 among them: likewise (feature `zenoh`) | I/O |
//! | `broker` | what both have in common | pure |
//! | [`shutdown`] | signals -> an orderly end | I/O |
//!
//! The wire is described in `docs/protocol.md`.

pub mod admission;
#[cfg(any(feature = "nats", feature = "zenoh"))]
mod broker;
pub mod channel;
pub mod chunk;
pub mod connect;
mod fault;
pub mod filter;
mod forward;
pub mod foxglove;
mod http;
pub mod hub;
pub mod last;
pub mod limits;
pub mod listen;
mod log_throttle;
mod losses;
#[cfg(feature = "nats")]
pub mod nats;
pub mod outbox;
mod outgoing;
mod owned;
mod page;
pub mod peer;
pub mod places;
pub mod playback;
pub mod recorder;
mod samples;
pub mod session;
pub mod shutdown;
pub mod source;
pub mod state;
mod strangers;
pub mod stream;
mod top_page;
pub mod upstream;
pub mod viewer;
pub mod wire;
#[cfg(feature = "zenoh")]
pub mod zenoh;

use crate::error::{Error, Result};
use crate::sink::Target;
use crate::sink::address::Listen;
use admission::{Token, Web, is_loopback};
use hub::Hub;
use limits::Limits;
use listen::{Context, Listener};
use places::Places;
use playback::position::Timeline;
use shutdown::Shutdown;
use source::Endpoint;
use std::collections::BTreeMap;
use std::future::Future;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Plan;

/// Settings of a daemon.
#[derive(Debug, Default)]
pub struct Settings {
    /// Options by which lines are read, for every sensor: that is done before it is known whose they are.
    pub decode: strapd_recording::decode::Options,
    /// Settings by which samples are understood and integrated.
    pub plan: Plan,
    /// Settings for sensors that are understood in another way, by `id`.
    pub plans: BTreeMap<String, Plan>,
    /// Addresses to listen on.
    pub listen: Vec<Listen>,
    /// Addresses to connect to for samples.
    pub sources: Vec<Endpoint>,
    /// The bounds.
    pub limits: Limits,
    /// Token that clients must show.
    pub token: Option<Token>,
    /// Listen beyond loopback without a token all the same.
    pub allow_insecure_remote: bool,
    /// Names and pages that may use HTTP.
    pub web: Web,
    /// Recorder of everything that goes through.
    pub recorder: Option<recorder::Handle>,
    /// The attitudes sensors had before the daemon was restarted.
    pub saved: state::Sensors,
    /// Sockets a service manager has opened.
    #[cfg(unix)]
    pub passed: listen::Passed,
    /// Receivers to call and send every attitude to ([`Target::Tcp`], [`Target::Udp`]).
    pub outputs: Vec<Target>,
    /// Places in NATS where every attitude goes.
    #[cfg(feature = "nats")]
    pub nats: Vec<nats::address::NatsAddress>,
    /// Places in zenoh where every attitude goes.
    #[cfg(feature = "zenoh")]
    pub zenoh: Vec<zenoh::address::ZenohAddress>,
    /// The replay that is served; no samples are taken then.
    pub timeline: Option<Arc<dyn Timeline>>,
    /// Whether what is served brings samples beside attitudes: clients may ask for them before the first stream is
    /// there.
    pub brings_samples: bool,
}

/// A daemon that listens, and serves when it is [run](Server::run).
#[derive(Debug)]
pub struct Server {
    hub: Arc<Hub>,
    web: Arc<Web>,
    listeners: Vec<Listener>,
    bound: Vec<Listen>,
    outputs: Vec<Target>,
    #[cfg(feature = "nats")]
    nats: Vec<nats::address::NatsAddress>,
    #[cfg(feature = "zenoh")]
    zenoh: Vec<zenoh::address::ZenohAddress>,
}

impl Settings {
    /// Checks what can be judged without binding anything.
    ///
    /// # Errors
    /// [`Error::Usage`] when a plan is none for live streams, or an address is open to others and no
    /// token is asked for.
    pub fn check(self) -> Result<()> {
        for listen in &self.listen {
            Reach::of(&self).check(listen)?;
        }
        Hub::new(self).map(|_| ())
    }
}

impl Server {
    /// Listens on everything, or on nothing.
    ///
    /// # Errors
    /// [`Error::Usage`] when the plan is none for live streams or an address is open to others and
    /// no token is asked for; [`Error::Bind`].
    pub async fn bind(mut settings: Settings) -> Result<Server> {
        for listen in &settings.listen {
            Reach::of(&settings).check(listen)?;
        }
        let listen = std::mem::take(&mut settings.listen);
        let reach = Reach::of(&settings);
        #[cfg(unix)]
        let mut passed = std::mem::take(&mut settings.passed);
        let web = std::mem::take(&mut settings.web);
        let outputs = std::mem::take(&mut settings.outputs);
        #[cfg(feature = "nats")]
        let nats = std::mem::take(&mut settings.nats);
        #[cfg(feature = "zenoh")]
        let zenoh = std::mem::take(&mut settings.zenoh);
        let hub = Hub::new(settings)?;
        let mut listeners = Vec::new();
        let mut bound = Vec::new();
        for listen in &listen {
            let (listener, address) = Listener::bind(
                listen,
                #[cfg(unix)]
                &mut passed,
            )
            .await?;
            // Where a socket that was passed listens is known only now.
            reach.check(&address)?;
            listeners.push(listener);
            bound.push(address);
        }
        Ok(Server {
            hub: Arc::new(hub),
            web: Arc::new(web),
            listeners,
            bound,
            outputs,
            #[cfg(feature = "nats")]
            nats,
            #[cfg(feature = "zenoh")]
            zenoh,
        })
    }

    /// Addresses on which it listens, with real ports.
    #[must_use]
    pub fn addresses(&self) -> &[Listen] {
        &self.bound
    }

    /// Hub.
    #[must_use]
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// Serves until `stop` ends, then drains: what has arrived is worked on, what waits is sent, for
    /// no longer than [`Limits::drain`]. Says whether everything ended in that time.
    pub async fn run(self, stop: impl Future<Output = ()>) -> bool {
        let shutdown = Shutdown::default();
        let places = Arc::new(Places::new(*self.hub.limits()));
        let context = || Context {
            hub: self.hub.clone(),
            web: self.web.clone(),
            places: places.clone(),
            running: shutdown.running(),
        };
        let answering = tokio::spawn(self.hub.clone().keep_answering());
        for listener in self.listeners {
            tokio::spawn(listener.serve(context()));
        }
        for target in self.outputs {
            tokio::spawn(forward::send(target, context()));
        }
        #[cfg(feature = "nats")]
        let tenancy = Arc::new(nats::tenure::Tenancy::default());
        #[cfg(feature = "nats")]
        for address in self.nats {
            tokio::spawn(nats::send(address, context(), tenancy.clone()));
        }
        #[cfg(feature = "zenoh")]
        for address in self.zenoh {
            tokio::spawn(zenoh::send(address, context()));
        }
        for outgoing in self.hub.outgoing() {
            let (outgoing, hub) = (outgoing.clone(), self.hub.clone());
            match outgoing.endpoint().clone() {
                Endpoint::Source(source) => {
                    tokio::spawn(connect::keep(*source, outgoing, hub, shutdown.running()));
                }
                #[cfg(feature = "nats")]
                Endpoint::Nats(address) => {
                    let middle = (hub, tenancy.clone());
                    tokio::spawn(nats::keep(*address, outgoing, middle, shutdown.running()));
                }
                #[cfg(feature = "zenoh")]
                Endpoint::Zenoh(address) => {
                    tokio::spawn(zenoh::keep(*address, outgoing, hub, shutdown.running()));
                }
            }
        }
        let waits = tokio::spawn(end_waits(self.hub.clone()));
        stop.await;
        waits.abort();
        self.hub.stop();
        let limit = self.hub.limits().drain;
        // What is left of the limit is for who saves and goes.
        let drained = tokio::time::timeout(limit * 9 / 10, shutdown.drain(limit / 2)).await;
        answering.abort();
        drained.is_ok()
    }
}

/// Sees to it that samples do not wait for ever for the unit of their stamps.
async fn end_waits(hub: Arc<Hub>) {
    let mut tick = tokio::time::interval(hub::TICK);
    loop {
        tick.tick().await;
        hub.forget_silent();
        hub.end_waits(listen::now());
        hub.losses.tick();
    }
}

/// Reach of an address: who may connect to us.
#[derive(Clone, Copy, Debug)]
struct Reach {
    has_token: bool,
    allow_insecure_remote: bool,
    /// Flag by which an address is given.
    flag: &'static str,
}

impl Reach {
    fn of(settings: &Settings) -> Reach {
        Reach {
            has_token: settings.token.is_some(),
            allow_insecure_remote: settings.allow_insecure_remote,
            flag: match settings.timeline {
                Some(_) => "-o",
                None => "--listen",
            },
        }
    }

    /// Refuses an address others can reach, unless clients must show a token.
    fn check(self, listen: &Listen) -> Result<()> {
        let is_open = listen.ip().is_some_and(|ip| !is_loopback(ip));
        // A datagram shows no token that others on the way could not read and send again.
        let is_guarded = self.has_token && !matches!(listen, Listen::Udp(_));
        if is_open && !is_guarded && !self.allow_insecure_remote {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "{} {listen}: others can reach this address, and nothing keeps them out",
                    self.flag
                ))
                .help(
                    "--token-file FILE asks clients for a token (not over UDP); --allow-insecure-remote listens all the same; 127.0.0.1 is this machine alone",
                )
            ));
        }
        Ok(())
    }
}
