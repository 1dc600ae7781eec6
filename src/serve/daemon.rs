//! Settings -> a daemon that listens, and serves until it is told to stop. I/O.
//!
//! Apart from the rooms because it alone joins them: sockets, sources, brokers and the hub.

#[cfg(feature = "nats")]
use super::brokers::nats;
#[cfg(feature = "zenoh")]
use super::brokers::zenoh;
use super::core::context::Context;
use super::core::hub::{self, Hub};
use super::core::outgoing::Outgoing;
use super::core::read_buffer::now;
use super::core::reading::{LineParameters, Reading};
use super::edge::listen::Listener;
#[cfg(unix)]
use super::edge::listen::Passed;
use super::edge::output::Output;
use super::edge::source::Endpoint;
use super::edge::{connect, forward};
use super::guard::admission::{Web, is_loopback};
use super::guard::places::Places;
use super::guard::shutdown::Shutdown;
use crate::address::Address;
use crate::client::remote;
use crate::client::secret::Secret;
use crate::error::{Error, Result};
use crate::sink::address::Listen;
use std::future::Future;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;

/// An address to listen on, and how the lines that come there are read.
#[derive(Clone, Debug)]
pub struct Listening {
    /// Address.
    pub address: Listen,
    /// Parameters of the address.
    pub lines: LineParameters,
}

impl Listening {
    /// Reads what the user wrote: an address of [`Listen`] with `?id=`, `?columns=`, `?delimiter=`, `?where=` and
    /// `?stamp=arrival`.
    ///
    /// # Errors
    /// [`Error::Usage`] with what is known.
    pub fn parse(text: &str) -> Result<Listening> {
        let (address, query) = text.split_once('?').unwrap_or((text, ""));
        let refuse = |what: String| {
            let what = format!("--listen {}: {what}", Address::from(text));
            Error::usage(Diagnostic::new(what).help(LineParameters::HELP))
        };
        let parameters = remote::parameters(query)
            .ok_or_else(|| refuse("a `%` needs two digits after it".to_owned()))?;
        let mut names = parameters.iter().map(|(name, _)| name.as_str());
        if let Some(other) = names.find(|name| !LineParameters::KEYS.contains(name)) {
            let other = strapd_recording::text::printable(other);
            return Err(refuse(format!("there is no ?{other}=")));
        }
        Ok(Listening {
            address: Listen::parse(address)?,
            lines: LineParameters::parse(&parameters).map_err(refuse)?,
        })
    }
}

impl From<Listen> for Listening {
    fn from(address: Listen) -> Listening {
        Listening {
            address,
            lines: LineParameters::default(),
        }
    }
}

/// Settings of a daemon.
#[derive(Debug, Default)]
pub struct Settings {
    /// Settings of its hub.
    pub hub: hub::Settings,
    /// Token that links to the page carry: `--lan` alone hands it out.
    pub invitation: Option<Secret>,
    /// Addresses to listen on.
    pub listen: Vec<Listening>,
    /// Addresses to connect to for samples.
    pub sources: Vec<Endpoint>,
    /// Places where every attitude goes.
    pub outputs: Vec<Output>,
    /// Listen beyond loopback without a token all the same.
    pub allow_insecure_remote: bool,
    /// Names and pages that may use HTTP.
    pub web: Web,
    /// Sockets a service manager has opened.
    #[cfg(unix)]
    pub passed: Passed,
}

/// A daemon that listens, and serves when it is [run](Server::run).
#[derive(Debug)]
pub struct Server {
    hub: Arc<Hub>,
    web: Arc<Web>,
    listeners: Vec<(Listener, Arc<Reading>)>,
    bound: Vec<Listen>,
    sources: Vec<(Endpoint, Arc<Outgoing>)>,
    outputs: Vec<Output>,
}

impl Settings {
    /// Checks what can be judged without binding anything.
    ///
    /// # Errors
    /// [`Error::Usage`] when a plan is none for live streams, or an address is open to others and no
    /// token is asked for.
    pub fn check(self) -> Result<()> {
        for listening in &self.listen {
            Reach::of(&self).check(&listening.address)?;
        }
        Hub::new(self.hub).map(|_| ())
    }
}

impl Server {
    /// Listens on everything, or on nothing.
    ///
    /// # Errors
    /// [`Error::Usage`] when the plan is none for live streams or an address is open to others and
    /// no token is asked for; [`Error::Bind`].
    pub async fn bind(settings: Settings) -> Result<Server> {
        let reach = Reach::of(&settings);
        for listening in &settings.listen {
            reach.check(&listening.address)?;
        }
        let options = settings.hub.decode.clone();
        let by_default = settings.hub.lines.clone();
        #[cfg(unix)]
        let mut passed = settings.passed;
        let sources: Vec<_> = settings
            .sources
            .into_iter()
            .map(|endpoint| {
                let outgoing = Arc::new(endpoint.outgoing());
                (endpoint, outgoing)
            })
            .collect();
        let outgoing = sources.iter().map(|(_, outgoing)| outgoing.clone());
        let hub = Hub::new(settings.hub)?.fed_by(outgoing.collect());
        let mut listeners = Vec::new();
        let mut bound = Vec::new();
        for listening in &settings.listen {
            let lines = listening.lines.clone().or(&by_default);
            let reading = Arc::new(Reading::new(&options, &lines));
            let (listener, address) = Listener::bind(
                &listening.address,
                #[cfg(unix)]
                &mut passed,
            )
            .await?;
            // Where a socket that was passed listens is known only now.
            reach.check(&address)?;
            listeners.push((listener, reading));
            bound.push(address);
        }
        Ok(Server {
            hub: Arc::new(hub),
            web: Arc::new(settings.web),
            listeners,
            bound,
            sources,
            outputs: settings.outputs,
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
        let context = |reading: &Arc<Reading>| Context {
            hub: self.hub.clone(),
            web: self.web.clone(),
            places: places.clone(),
            reading: reading.clone(),
            running: shutdown.running(),
        };
        let usual = self.hub.reading();
        let answering = tokio::spawn(self.hub.clone().keep_answering());
        for (listener, reading) in self.listeners {
            tokio::spawn(listener.serve(context(&reading)));
        }
        #[cfg(feature = "nats")]
        let tenancy = Arc::new(nats::tenure::LeaseWatch::default());
        for output in self.outputs {
            match output {
                Output::Receiver(target) => tokio::spawn(forward::send(target, context(usual))),
                #[cfg(feature = "nats")]
                Output::Nats(address) => {
                    tokio::spawn(nats::send(*address, context(usual), tenancy.clone()))
                }
                #[cfg(feature = "zenoh")]
                Output::Zenoh(address) => tokio::spawn(zenoh::send(*address, context(usual))),
            };
        }
        for (endpoint, outgoing) in self.sources {
            let (hub, running) = (self.hub.clone(), shutdown.running());
            match endpoint {
                Endpoint::Source(source) => {
                    tokio::spawn(connect::keep(*source, outgoing, hub, running))
                }
                #[cfg(feature = "nats")]
                Endpoint::Nats(address) => {
                    let middle = (hub, tenancy.clone());
                    tokio::spawn(nats::keep(*address, outgoing, middle, running))
                }
                #[cfg(feature = "zenoh")]
                Endpoint::Zenoh(address) => {
                    tokio::spawn(zenoh::keep(*address, outgoing, hub, running))
                }
            };
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

/// Sees to it that samples do not wait forever for the unit of their stamps.
async fn end_waits(hub: Arc<Hub>) {
    let mut tick = tokio::time::interval(hub::TICK);
    loop {
        tick.tick().await;
        hub.forget_silent();
        hub.end_waits(now());
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
            has_token: settings.hub.token.is_some(),
            allow_insecure_remote: settings.allow_insecure_remote,
            flag: match settings.hub.timeline {
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
