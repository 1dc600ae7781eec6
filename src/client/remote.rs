//! `tcp://host:port`, `ws://host:port/path?query`, `unix:///path`, `udp-listen://host:port` -> where to
//! connect. Pure: names are looked up when connecting, so that one that is unknown today may be
//! known tomorrow.

use super::serial::SerialPlace;
use crate::address::Address;
use crate::error::{Error, Result};
use std::fmt;
use std::path::PathBuf;
use strapd_attitude::diagnostic::Diagnostic;

/// Address to connect to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Remote {
    /// Lines over TCP.
    Tcp(Place),
    /// A WebSocket.
    WebSocket {
        /// The machine.
        place: Place,
        /// Resource there: path and query, beginning with `/`.
        resource: Address,
    },
    /// Lines over a Unix socket.
    Unix(PathBuf),
    /// Datagrams that somebody sends here.
    UdpListen(Place),
    /// A serial port.
    Serial(SerialPlace),
}

/// A host, by name or number, and a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Host, without brackets.
    pub host: String,
    /// Port from 1, but for what is listened on.
    pub port: u16,
}

/// A parameter of a query: name and value, decoded.
pub type Parameter = (String, String);

const KNOWN: &str = "known: tcp://HOST:PORT, ws://HOST:PORT/PATH, unix:///PATH, udp-listen://HOST:PORT, serial:///dev/PORT?baud=RATE";
/// Longer than any address.
const MAX_BYTES: usize = 2048;

impl Remote {
    /// Whether a word is meant as one of these, rather than as a file.
    #[must_use]
    pub fn is_meant(text: &str) -> bool {
        text.contains("://")
    }

    /// Reads what the user wrote. A host left out is 127.0.0.1, a path left out of `ws://` is `/ws`,
    /// where a daemon answers.
    ///
    /// # Errors
    /// [`Error::Usage`] with what is known; a query where there can be none.
    pub fn parse(text: &str) -> Result<Remote> {
        let (remote, parameters) = Remote::with_parameters(text, |_| false)?;
        match parameters.first() {
            None => Ok(remote),
            Some((name, _)) => Err(Error::usage(
                Diagnostic::new(format!(
                    "{}: `?{name}=` means nothing here",
                    Address::from(text)
                ))
                .help(KNOWN),
            )),
        }
    }

    /// The same, and the parameters of its query. A WebSocket's query goes to its server, but for
    /// the parameters that are `ours`.
    ///
    /// # Errors
    /// [`Error::Usage`] with what is known.
    pub fn with_parameters(
        text: &str,
        ours: impl Fn(&str) -> bool,
    ) -> Result<(Remote, Vec<Parameter>)> {
        let refuse = |what: &str| {
            let shown = Address::from(text);
            Error::usage(Diagnostic::new(format!("{shown}: {what}")).help(KNOWN))
        };
        if text.len() > MAX_BYTES || text.chars().any(char::is_control) {
            return Err(Error::usage(
                Diagnostic::new(format!("{}: is no address", Address::from(text))).help(KNOWN),
            ));
        }
        let (scheme, rest) = text.split_once("://").ok_or_else(|| refuse("no scheme"))?;
        let (rest, _) = rest.split_once('#').unwrap_or((rest, ""));
        let (rest, query) = rest.split_once('?').unwrap_or((rest, ""));
        let mut parameters =
            parameters(query).ok_or_else(|| refuse("a `%` needs two digits after it"))?;
        let place = |authority: &str| Place::parse(authority).map_err(|what| refuse(&what));
        let bare = rest.strip_suffix('/').unwrap_or(rest);
        let remote = match scheme {
            "tcp" => Remote::Tcp(place(bare)?.connectable().map_err(refuse)?),
            "udp-listen" => Remote::UdpListen(place(bare)?),
            "unix" if rest.starts_with('/') => Remote::Unix(PathBuf::from(rest)),
            "unix" => return Err(refuse("an absolute path is needed")),
            "serial" => {
                let place = SerialPlace::parse(rest, &mut parameters);
                Remote::Serial(place.map_err(|what| refuse(&what))?)
            }
            "ws" => {
                let (authority, path) = match rest.find('/') {
                    Some(at) => rest.split_at(at),
                    None => (rest, ""),
                };
                let mut path = match path {
                    "" | "/" if query.is_empty() => "/ws".to_owned(),
                    "" => "/".to_owned(),
                    path => encoded(path, b"/%"),
                };
                for (n, (name, value)) in parameters.iter().filter(|(p, _)| !ours(p)).enumerate() {
                    path.push(if n == 0 { '?' } else { '&' });
                    path.push_str(&encoded(name, b""));
                    path.push('=');
                    path.push_str(&encoded(value, b""));
                }
                let place = place(authority)?.connectable().map_err(refuse)?;
                Remote::WebSocket {
                    place,
                    resource: path.into(),
                }
            }
            "wss" | "https" => {
                return Err(refuse(
                    "there is no encryption here; let a proxy or ssh -L carry it, and connect to its near end",
                ));
            }
            _ => return Err(refuse("unknown scheme")),
        };
        Ok((remote, parameters))
    }
}

impl Place {
    /// `HOST:PORT`; a host left out is 127.0.0.1.
    pub(crate) fn parse(text: &str) -> std::result::Result<Place, String> {
        if text.contains('@') {
            return Err(
                "no user or password goes into an address; --token-file FILE shows a token".into(),
            );
        }
        let (host, port) = match text.strip_prefix('[') {
            Some(rest) => rest
                .split_once(']')
                .and_then(|(host, port)| Some((host, port.strip_prefix(':')?))),
            None => text.split_once(':'),
        }
        .ok_or_else(|| "a port is needed".to_owned())?;
        let port = port
            .parse::<u16>()
            .map_err(|_| format!("`{port}` is no port"))?;
        let odd = |c: char| c.is_whitespace() || (c == ':' && !text.starts_with('['));
        if host.contains(odd) {
            return Err("is no host with a port (an IPv6 address goes in brackets)".into());
        }
        let host = if host.is_empty() { "127.0.0.1" } else { host };
        Ok(Place {
            host: host.to_owned(),
            port,
        })
    }

    fn connectable(self) -> std::result::Result<Place, &'static str> {
        if self.port == 0 {
            return Err("nobody listens on port 0");
        }
        Ok(self)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.host.contains(':') {
            true => write!(f, "[{}]:{}", self.host, self.port),
            false => write!(f, "{}:{}", self.host, self.port),
        }
    }
}

impl fmt::Display for Remote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Remote::Tcp(place) => write!(f, "tcp://{place}"),
            Remote::WebSocket { place, resource } => write!(f, "ws://{place}{resource}"),
            Remote::Unix(path) => write!(f, "unix://{}", path.display()),
            Remote::UdpListen(place) => write!(f, "udp-listen://{place}"),
            Remote::Serial(place) => place.fmt(f),
        }
    }
}

/// The parameters of a query, decoded; `None` where a `%` is no escape.
pub(crate) fn parameters(query: &str) -> Option<Vec<Parameter>> {
    query
        .split('&')
        .filter(|part| !part.is_empty())
        .map(|part| {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            Some((decoded(name)?, decoded(value)?))
        })
        .collect()
}

fn decoded(text: &str) -> Option<String> {
    let mut out = Vec::new();
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        out.push(match byte {
            b'%' => {
                let digit = |b: u8| char::from(b).to_digit(16);
                let (high, low) = (digit(bytes.next()?)?, digit(bytes.next()?)?);
                u8::try_from(high * 16 + low).ok()?
            }
            other => other,
        });
    }
    String::from_utf8(out).ok()
}

/// Everything a URI does not take as it is becomes `%XX`, but for what is in `kept`.
pub(crate) fn encoded(text: &str, kept: &[u8]) -> String {
    let mut out = String::new();
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) || kept.contains(&byte) {
            out.push(char::from(byte));
        } else {
            out.push_str(&format!("%{byte:02X}"));
        }
    }
    out
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_written_as_it_is_read() {
        for text in [
            "tcp://127.0.0.1:4550",
            "tcp://[::1]:4550",
            "tcp://no-such-host.invalid:1",
            "ws://phone.local:8080/sensor/connect",
            "unix:///run/strapd.sock",
            "udp-listen://127.0.0.1:0",
            "serial:///dev/ttyUSB0",
            "serial:///dev/serial/by-id/usb-1a86?baud=9600",
        ] {
            assert_eq!(Remote::parse(text).unwrap().to_string(), text);
        }
        assert_eq!(
            Remote::parse("tcp://:7").unwrap().to_string(),
            "tcp://127.0.0.1:7"
        );
        for text in ["ws://h:1", "ws://h:1/"] {
            assert_eq!(Remote::parse(text).unwrap().to_string(), "ws://h:1/ws");
        }
    }

    #[test]
    fn what_is_no_address_is_refused_with_what_is_known() {
        for text in [
            "",
            "4550",
            "tcp://",
            "tcp://host",
            "tcp://host:99999",
            "tcp://host:0",
            "tcp://::1:80",
            "tcp://a b:80",
            "tcp://user:secret@host:80",
            "tcp://h:1?x=%zz",
            "tcp://h:1?x=1",
            "unix://relative",
            "wss://h:1/",
            "ftp://h:1",
            "tcp://h\u{1b}[31m:1",
        ] {
            let said = Remote::parse(text).unwrap_err().to_string();
            assert!(said.contains("known: tcp://"), "{text}: {said}");
            assert!(!said.contains('\u{1b}'));
        }
    }

    #[test]
    fn a_query_goes_to_the_server_but_for_our_part_of_it() {
        let phone =
            r#"ws://phone:8080/sensors/connect?types=["android.sensor.gyroscope","b"]&id=left"#;
        let (remote, parameters) = Remote::with_parameters(phone, |p| p == "id").unwrap();
        let asked = |remote: &Remote| match remote {
            Remote::WebSocket { resource, .. } => resource.typed().to_owned(),
            _ => String::new(),
        };
        assert_eq!(
            asked(&remote),
            "/sensors/connect?types=%5B%22android.sensor.gyroscope%22%2C%22b%22%5D"
        );
        let printed = "ws://phone:8080/sensors/connect?types=...";
        assert_eq!(remote.to_string(), printed);
        assert!(!format!("{remote:?}").contains("gyroscope"));
        assert_eq!(parameters[1], ("id".to_owned(), "left".to_owned()));
        // What was escaped already is not escaped twice.
        let (remote, _) = Remote::with_parameters("ws://h:1/a%20b?c=%5B", |_| false).unwrap();
        assert_eq!(asked(&remote), "/a%20b?c=%5B");
    }
}
