//! Sockets a service manager has opened -> sockets. I/O.
//!
//! Socket activation (`sd_listen_fds(3)`): the manager listens from boot on and hands its sockets over, so
//! that no client is turned away while the daemon starts, and the daemon needs no right to bind.

use crate::sink::address::Transport;
use listenfd::ListenFd;
use std::io;
use std::net::{TcpListener, UdpSocket};
use std::os::unix::net::UnixListener;
use strapd_attitude::diagnostic::Diagnostic;

/// Samples that were passed, until they are taken.
pub struct Passed {
    sockets: ListenFd,
    names: Vec<String>,
}

impl std::fmt::Debug for Passed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Passed")
            .field("names", &self.names)
            .finish()
    }
}

impl Default for Passed {
    /// Nothing.
    fn default() -> Passed {
        Passed {
            sockets: ListenFd::empty(),
            names: Vec::new(),
        }
    }
}

/// One socket, checked to be what it is to be.
pub(super) enum Socket {
    Tcp(TcpListener),
    Udp(UdpSocket),
    Unix(UnixListener),
}

impl Passed {
    /// Looks once, before there are threads: the variables are gone afterwards.
    #[must_use]
    pub fn from_env() -> Passed {
        let names = std::env::var("LISTEN_FDNAMES").unwrap_or_default();
        Passed {
            sockets: ListenFd::from_env(),
            names: names.split(':').map(str::to_owned).collect(),
        }
    }

    /// The socket with this name, or number from 0 on, for this transport.
    pub(super) fn take(&mut self, transport: Transport, name: &str) -> io::Result<Socket> {
        let place = self
            .names
            .iter()
            .position(|known| known == name)
            .or_else(|| name.parse().ok());
        let taken = place.map_or(Ok(None), |place| match transport {
            Transport::Tcp | Transport::WebSocket => self
                .sockets
                .take_tcp_listener(place)
                .map(|s| s.map(Socket::Tcp)),
            Transport::Udp => self
                .sockets
                .take_udp_socket(place)
                .map(|s| s.map(Socket::Udp)),
            Transport::Unix => self
                .sockets
                .take_unix_listener(place)
                .map(|s| s.map(Socket::Unix)),
        })?;
        let socket = taken.ok_or_else(|| {
            let there = match self.sockets.len() {
                0 => "none was passed".to_owned(),
                n => format!("{n} were passed, named {}", self.names.join(", ")),
            };
            io::Error::new(
                io::ErrorKind::NotFound,
                Diagnostic::new(format!("no such socket from the service manager: {there}"))
                    .help("FileDescriptorName= in a .socket unit names it"),
            )
        })?;
        match &socket {
            Socket::Tcp(s) => s.set_nonblocking(true)?,
            Socket::Udp(s) => s.set_nonblocking(true)?,
            Socket::Unix(s) => s.set_nonblocking(true)?,
        }
        Ok(socket)
    }
}
