//! An output on the command line -> where every attitude is sent. Pure but for reading files of secrets.

#[cfg(not(feature = "nats"))]
use super::source::without_nats;
#[cfg(not(feature = "zenoh"))]
use super::source::without_zenoh;
use super::source::{means_nats, means_zenoh};
use crate::error::{Error, Result};
#[cfg(feature = "nats")]
use crate::serve::brokers::nats::address::NatsAddress;
#[cfg(feature = "zenoh")]
use crate::serve::brokers::zenoh::address::ZenohAddress;
use crate::sink::Target;
use crate::sink::datagram::Protocol;
use strapd_attitude::diagnostic::Diagnostic;

/// Place to which every attitude is sent.
#[derive(Clone, Debug)]
pub enum Output {
    /// Somebody who listens ([`Target::Tcp`], [`Target::Udp`], [`Target::Protocol`]).
    Receiver(Target),
    /// Subjects of NATS.
    #[cfg(feature = "nats")]
    Nats(Box<NatsAddress>),
    /// Keys of zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh(Box<ZenohAddress>),
}

impl Output {
    /// Reads what the user wrote.
    ///
    /// # Errors
    /// [`Error::Usage`] with what is known; a broker is meant and was not built in.
    pub fn parse(text: &str) -> Result<Output> {
        if means_nats(text) {
            #[cfg(feature = "nats")]
            return NatsAddress::output(text).map(|address| Output::Nats(Box::new(address)));
            #[cfg(not(feature = "nats"))]
            return Err(without_nats("-o", text));
        }
        if means_zenoh(text) {
            #[cfg(feature = "zenoh")]
            return ZenohAddress::output(text).map(|address| Output::Zenoh(Box::new(address)));
            #[cfg(not(feature = "zenoh"))]
            return Err(without_zenoh("-o", text));
        }
        match Target::parse(text)? {
            target @ (Target::Tcp(_) | Target::Udp { .. } | Target::Protocol(_)) => Ok(Output::Receiver(target)),
            _ => Err(Error::usage(
                Diagnostic::new(format!(
                    "-o {text}: the daemon sends to tcp://HOST:PORT, udp://HOST:PORT[?profile=plotjuggler], {}",
                    Protocol::addresses()
                ))
                .help("--listen waits for watchers, --record FILE.mcap writes a file"),
            )),
        }
    }
}
