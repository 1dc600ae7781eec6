//! The word after `--listen` -> what to listen on. Pure but for looking up a host's name.

use crate::error::{Error, Result};
use std::fmt::{self, Display};
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

/// What is spoken on a socket.
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

/// What `strapd serve` listens on when nothing is said.
pub const DEFAULTS: [&str; 2] = ["tcp-listen://127.0.0.1:4550", "ws-listen://127.0.0.1:8765"];

const KNOWN: &str = "known: tcp-listen://HOST:PORT, udp-listen://HOST:PORT, ws-listen://HOST:PORT (and HTTP), unix-listen:///PATH; port 0 takes a free one; fd:NAME for HOST:PORT is a socket of that name (or number) from the service manager";

/// An address as somebody typed it, which may hold a password or a key. It is printed, logged and written in one form alone:
/// without user and password, and with `...` in the place of the values behind its `?`.
#[derive(Clone, PartialEq, Eq)]
pub struct Address(String);

impl Address {
    /// With everything, for who connects there.
    #[must_use]
    pub fn typed(&self) -> &str {
        &self.0
    }
}

impl<T: Into<String>> From<T> for Address {
    fn from(typed: T) -> Address {
        Address(typed.into())
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&without_secrets(&self.0))
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

/// Work grows with the text.
fn without_secrets(text: &str) -> String {
    let text = strapd_recording::text::printable(text);
    let (scheme, rest) = match text.split_once("://") {
        Some((scheme, rest)) => (format!("{scheme}://"), rest),
        None => (String::new(), text.as_str()),
    };
    let (rest, query) = match rest.split_once(['?', '#']) {
        Some((rest, query)) => (rest, Some(query)),
        None => (rest, None),
    };
    // A password may hold any sign: all before the last `@` may be of it, of a query that is none too.
    let (rest, query) = match query.and_then(|query| query.rsplit_once('@')) {
        Some((_, host)) if !rest.contains('/') => {
            let (host, query) = host
                .split_once('?')
                .map_or((host, None), |(h, q)| (h, Some(q)));
            (format!("...@{host}"), query)
        }
        _ => match rest.rsplit_once('@') {
            Some((_, host)) => (format!("...@{host}"), query),
            None => (rest.to_owned(), query),
        },
    };
    let mut out = scheme + &rest;
    for (n, part) in query
        .unwrap_or_default()
        .split('&')
        .filter(|part| !part.is_empty())
        .enumerate()
    {
        out.push(if n == 0 { '?' } else { '&' });
        match part.split_once('=') {
            Some((name, _)) => {
                out.push_str(name);
                out.push_str("=...");
            }
            None => out.push_str("..."),
        }
    }
    out
}

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
    fn an_address_is_printed_without_what_nobody_is_to_see() {
        for (text, printed) in [
            ("tcp://host:1", "tcp://host:1"),
            ("tcp://ada:s3cret@host:1", "tcp://...@host:1"),
            ("tcp://ada:s3/cr@et@host:1", "tcp://...@host:1"),
            ("tcp://ada:s3?cr=et@host:1", "tcp://...@host:1"),
            ("ada:s3cret@host:1", "...@host:1"),
            (
                "ws://h:1/a/b?type=x&key=s3cret",
                "ws://h:1/a/b?type=...&key=...",
            ),
            ("ws://h:1/a?s3cret", "ws://h:1/a?..."),
            ("ws://h:1/a#s3cret", "ws://h:1/a?..."),
            ("ws://u:s3cret@h:1/?k=s3cret", "ws://...@h:1/?k=..."),
            ("unix:///run/x.sock", "unix:///run/x.sock"),
            ("?=s3cret", "?=..."),
            ("", ""),
        ] {
            assert_eq!(Address::from(text).to_string(), printed, "{text}");
        }
        assert!(
            !Address::from("tcp://\u{1b}[31m:1")
                .to_string()
                .contains('\u{1b}')
        );
    }

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
