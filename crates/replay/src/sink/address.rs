//! The word after `--listen` -> what to listen on. Pure but for looking up a host's name.

use crate::address::Address;
use crate::error::{Error, Result};
use std::fmt::Display;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::LISTEN;

/// Something to listen on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Listen {
    /// Lines over TCP.
    Tcp(SocketAddr),
    /// Lines in datagrams; samples in only.
    Udp(SocketAddr),
    /// Lines over a Unix socket.
    Unix(PathBuf),
    /// WebSocket, with `/healthz` and `/metrics` beside it.
    WebSocket(SocketAddr),
    /// A socket the service manager has opened already, by its name or number, and what is spoken there.
    Passed(Transport, String),
}

/// Transport of a socket.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Lines over TCP.
    Tcp,
    /// Lines in datagrams.
    Udp,
    /// Lines over a Unix socket.
    Unix,
    /// WebSocket and HTTP.
    WebSocket,
}

impl Transport {
    fn scheme(self) -> &'static str {
        match self {
            Transport::Tcp => "tcp-listen",
            Transport::Udp => "udp-listen",
            Transport::Unix => "unix-listen",
            Transport::WebSocket => "ws-listen",
        }
    }

    fn named(scheme: &str) -> Option<Transport> {
        Some(match scheme {
            "tcp-listen" => Transport::Tcp,
            "udp-listen" => Transport::Udp,
            "unix-listen" => Transport::Unix,
            "ws-listen" | "http-listen" => Transport::WebSocket,
            _ => return None,
        })
    }
}

/// Addresses on which `strapd serve` listens by default.
pub const DEFAULTS: [&str; 2] = ["tcp-listen://127.0.0.1:4550", "ws-listen://127.0.0.1:8765"];

/// Addresses on which it listens where its page is for the network: lines stay on this machine.
pub const LAN: [&str; 2] = ["tcp-listen://127.0.0.1:4550", "ws-listen://0.0.0.0:8765"];

const KNOWN: &str = "known: tcp-listen://HOST:PORT, udp-listen://HOST:PORT, ws-listen://HOST:PORT (and HTTP), unix-listen:///PATH; port 0 takes a free one; fd:NAME for HOST:PORT is a socket of that name (or number) from the service manager";

impl Listen {
    /// Reads what the user wrote. A host left out is 127.0.0.1.
    ///
    /// # Errors
    /// [`Error::Usage`] with what is known.
    pub fn parse(text: &str) -> Result<Listen> {
        Listen::parse_from(LISTEN, text)
    }

    /// The same, written behind another flag.
    ///
    /// # Errors
    /// As [`Listen::parse`].
    pub fn parse_from(what: impl Display, text: &str) -> Result<Listen> {
        let refuse = |why: &str| {
            let shown = Address::from(text);
            Error::usage(Diagnostic::new(format!("{what} {shown}: {why}")).help(KNOWN))
        };
        let (scheme, rest) = text.split_once("://").ok_or_else(|| refuse("no scheme"))?;
        let address = || -> Result<SocketAddr> {
            let rest = rest.strip_suffix('/').unwrap_or(rest);
            let full = if rest.starts_with(':') {
                format!("127.0.0.1{rest}")
            } else {
                rest.to_owned()
            };
            let mut found = full
                .to_socket_addrs()
                .map_err(|e| refuse(&format!("no address with a port: {e}")))?;
            found
                .next()
                .ok_or_else(|| refuse("the host has no address"))
        };
        let transport = Transport::named(scheme).ok_or_else(|| refuse("unknown scheme"))?;
        if let Some(name) = rest.strip_prefix("fd:") {
            return Ok(Listen::Passed(transport, name.to_owned()));
        }
        match transport {
            Transport::Tcp => address().map(Listen::Tcp),
            Transport::Udp => address().map(Listen::Udp),
            Transport::WebSocket => address().map(Listen::WebSocket),
            Transport::Unix if rest.starts_with('/') => Ok(Listen::Unix(PathBuf::from(rest))),
            Transport::Unix => Err(refuse("an absolute path is needed")),
        }
    }

    /// The address others could reach, if it is one.
    #[must_use]
    pub fn ip(&self) -> Option<IpAddr> {
        match self {
            Listen::Tcp(a) | Listen::Udp(a) | Listen::WebSocket(a) => Some(a.ip()),
            // Of a socket passed nothing is known before it is taken.
            Listen::Unix(_) | Listen::Passed(..) => None,
        }
    }
}

impl std::fmt::Display for Listen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Listen::Tcp(a) => write!(f, "tcp-listen://{a}"),
            Listen::Udp(a) => write!(f, "udp-listen://{a}"),
            Listen::WebSocket(a) => write!(f, "ws-listen://{a}"),
            Listen::Unix(path) => write!(f, "unix-listen://{}", path.display()),
            Listen::Passed(transport, name) => write!(f, "{}://fd:{name}", transport.scheme()),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_is_listened_on_is_written_as_it_is_read() {
        for text in [
            "tcp-listen://127.0.0.1:4550",
            "udp-listen://[::1]:9",
            "ws-listen://0.0.0.0:8765",
            "unix-listen:///run/strapd.sock",
            "ws-listen://fd:web",
        ] {
            assert_eq!(Listen::parse(text).unwrap().to_string(), text);
        }
        let local = Listen::parse("tcp-listen://:7").unwrap();
        assert!(local.ip().unwrap().is_loopback());
        for text in [
            "",
            "4550",
            "tcp://1.2.3.4:5",
            "tcp-listen://1.2.3.4",
            "unix-listen://x",
            "tcp-listen://1.2.3.4:99999",
        ] {
            let said = Listen::parse(text).unwrap_err().to_string();
            assert!(said.contains("known: tcp-listen"), "{text}: {said}");
        }
    }
}
