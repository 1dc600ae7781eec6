//! Lines, or datagrams of another program's protocol -> somebody who listens on a socket. I/O.
//!
//! Over TCP a slow reader slows the run down, as a pipe does; over UDP nobody is waited for. Either is
//! a sink of its own: when it fails it is said and that sink ends, the others go on.

use super::datagram::{Datagrams, Recipient};
use crate::error::{Error, Result};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Time that a connection may take to come about.
const CONNECT: Duration = Duration::from_secs(10);
/// A reader that takes nothing for so long will never take anything.
const STALLED: Duration = Duration::from_secs(30);
/// Time that the other side may take to read the rest and close.
const CLOSE: Duration = Duration::from_secs(2);
/// Code of a daemon's answer to who shows no token.
pub const UNAUTHORISED: &str = "unauthorised";
/// Longest answer that is looked at.
const MAX_ANSWER: u64 = 64 << 10;

/// Every address a `HOST:PORT` has.
pub(crate) fn resolve(name: &str, address: &str) -> Result<Vec<SocketAddr>> {
    let found = address.to_socket_addrs().map(Iterator::collect::<Vec<_>>);
    match found {
        Ok(found) if !found.is_empty() => Ok(found),
        Ok(_) => Err(connecting(
            name,
            io::Error::new(ErrorKind::NotFound, "the host has no address"),
        )),
        Err(source) => Err(connecting(name, source)),
    }
}

fn connecting(name: &str, source: io::Error) -> Error {
    Error::Connect {
        address: name.into(),
        source,
    }
}

/// A TCP connection that is written to.
#[derive(Debug)]
pub(super) struct Tcp {
    name: String,
    stream: TcpStream,
    /// Refusal of everything that was sent, if there was one; comes when the other side has closed.
    closed: Receiver<Option<String>>,
}

impl Tcp {
    /// Connects to `HOST:PORT`.
    ///
    /// # Errors
    /// [`Error::Connect`].
    pub(super) fn connect(address: &str) -> Result<Tcp> {
        let name = format!("tcp://{address}");
        let mut last = None;
        for place in resolve(&name, address)? {
            match TcpStream::connect_timeout(&place, CONNECT) {
                Ok(stream) => {
                    return Tcp::over(name.clone(), stream).map_err(|e| connecting(&name, e));
                }
                Err(why) => last = Some(why),
            }
        }
        Err(connecting(
            &name,
            last.unwrap_or_else(|| ErrorKind::NotFound.into()),
        ))
    }

    fn over(name: String, stream: TcpStream) -> io::Result<Tcp> {
        // A loss of comfort at most.
        let _ = stream.set_nodelay(true);
        stream.set_write_timeout(Some(STALLED))?;
        // What is answered must be read: unread bytes turn our close into a reset, which loses what
        // was sent last. And a daemon's ERROR is worth knowing.
        let answers = stream.try_clone()?;
        let (open, closed) = channel();
        let peer = name.clone();
        std::thread::Builder::new()
            .name("strapd-answers".to_owned())
            .spawn(move || {
                // Nobody waits for it where the run has ended.
                let _ = open.send(hear(&peer, answers));
            })?;
        Ok(Tcp {
            name,
            stream,
            closed,
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream
            .write_all(bytes)
            .map_err(|why| match why.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut => io::Error::new(
                    ErrorKind::TimedOut,
                    format!("it has taken nothing for {} s", STALLED.as_secs()),
                ),
                // It has gone: why, it may have said.
                _ => self.refusal().err().unwrap_or(why),
            })
    }

    /// Everything was written: waits for a moment until the other side has read it.
    ///
    /// # Errors
    /// The other side says that it took nothing, since it asks for a token.
    pub(super) fn finish(&self) -> io::Result<()> {
        // It may have gone already.
        let _ = self.stream.shutdown(Shutdown::Write);
        let taken = self.refusal();
        let _ = self.stream.shutdown(Shutdown::Both);
        taken
    }

    /// Waits for a moment until the other side has closed: an error where it has refused everything.
    fn refusal(&self) -> io::Result<()> {
        match self.closed.recv_timeout(CLOSE).ok().flatten() {
            Some(why) => Err(io::Error::new(ErrorKind::PermissionDenied, why)),
            None => Ok(()),
        }
    }
}

/// Reads what comes back to its end and says what is an error; returns the one that refused everything.
fn hear(name: &str, stream: TcpStream) -> Option<String> {
    let mut lines = BufReader::with_capacity(4 << 10, stream);
    let mut line = Vec::new();
    let (mut said, mut refused) = (0, None);
    loop {
        line.clear();
        match Read::take(&mut lines, MAX_ANSWER).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return refused,
            Ok(_) => {}
        }
        let Ok(answer) = serde_json::from_slice::<Answer>(&line) else {
            continue;
        };
        if answer.class != "ERROR" {
            continue;
        }
        if answer.code == UNAUTHORISED {
            refused = Some(format!(
                "it asks for a token and has taken nothing; write lines to standard output, and \
                 `strapd send - {name}` shows it"
            ));
        } else if said < 10 {
            said += 1;
            let words = strapd_recording::text::printable(&answer.message);
            tracing::warn!("{name}: {}: {words}", answer.code);
        }
    }
}

/// Answer of a daemon, as far as it is looked at.
#[derive(serde::Deserialize)]
struct Answer {
    class: String,
    #[serde(default)]
    code: String,
    #[serde(default)]
    message: String,
}

/// Datagrams to one place.
#[derive(Debug)]
pub(super) struct Udp {
    name: String,
    socket: UdpSocket,
    /// Datagrams nobody took, as far as that is told.
    refused: u64,
}

impl Udp {
    /// Sends to `HOST:PORT`, called `name` in messages.
    ///
    /// # Errors
    /// [`Error::Connect`]: there is no such place.
    pub(super) fn to(name: &str, address: &str) -> Result<Udp> {
        let name = name.to_owned();
        let place = resolve(&name, address)?.into_iter().next();
        let place = place.ok_or_else(|| connecting(&name, ErrorKind::NotFound.into()))?;
        let own: SocketAddr = match place {
            SocketAddr::V4(_) => ([0, 0, 0, 0], 0).into(),
            SocketAddr::V6(_) => ([0; 16], 0).into(),
        };
        let socket = UdpSocket::bind(own)
            .and_then(|socket| socket.connect(place).map(|()| socket))
            .map_err(|e| connecting(&name, e))?;
        Ok(Udp {
            name,
            socket,
            refused: 0,
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// One datagram for each line.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut lines = bytes.split_inclusive(|b| *b == b'\n');
        lines.try_for_each(|line| self.send(line))
    }

    fn send(&mut self, datagram: &[u8]) -> io::Result<()> {
        match self.socket.send(datagram) {
            Ok(_) => Ok(()),
            // The answer to an earlier one: nobody listens, yet.
            Err(why) if why.kind() == ErrorKind::ConnectionRefused => {
                self.refused += 1;
                Ok(())
            }
            Err(why) => Err(why),
        }
    }

    /// Everything was written.
    pub(super) fn finish(self) {
        if self.refused > 0 {
            tracing::warn!(
                "{}: at least {} datagrams found nobody listening",
                self.name,
                self.refused
            );
        }
    }
}

/// Datagrams to another program, and what it answers.
#[derive(Debug)]
pub(super) struct Conversation {
    udp: Udp,
    datagrams: Datagrams,
    /// Whether answers are read, and signs of life sent.
    converses: bool,
}

impl Conversation {
    /// Begins to send there.
    ///
    /// # Errors
    /// [`Error::Connect`]: there is no such place.
    pub(super) fn with(recipient: &Recipient) -> Result<Conversation> {
        let name = recipient.to_string();
        let udp = Udp::to(&name, &recipient.address)?;
        Ok(Conversation {
            udp,
            datagrams: Datagrams::new(recipient),
            converses: recipient.converses(),
        })
    }

    pub(super) fn name(&self) -> &str {
        self.udp.name()
    }

    /// Sends what records, time and answers ask for.
    pub(super) fn write(&mut self, records: &[u8]) -> io::Result<()> {
        if self.converses {
            self.hear()?;
            self.datagrams.tick(Instant::now());
        }
        self.datagrams.take(records);
        while let Some(datagram) = self.datagrams.ready() {
            self.udp.send(&datagram)?;
        }
        Ok(())
    }

    /// Takes the answers that are there, and waits for none.
    fn hear(&mut self) -> io::Result<()> {
        let mut said = [0; 1500];
        self.udp.socket.set_nonblocking(true)?;
        // What cannot be received says that nobody listens, which is counted where it is sent.
        while let Ok(length) = self.udp.socket.recv(&mut said) {
            let said = said.get(..length).unwrap_or(&[]);
            self.datagrams.hear(said, Instant::now());
        }
        self.udp.socket.set_nonblocking(false)
    }

    /// Everything was written.
    pub(super) fn finish(mut self) {
        if self.converses
            && self.hear().is_ok()
            && let Some(words) = self.datagrams.unanswered()
        {
            tracing::warn!("{words}");
        }
        self.udp.finish();
    }
}
