//! Sockets -> sessions. I/O.
//!
//! One file per transport; the conversation is the same over all ([`crate::serve::core::session`]).

mod duplex;
mod http;
mod stalling;
mod stdin;
pub(crate) mod tcp;
mod udp;
pub(crate) mod websocket;

#[cfg(unix)]
mod passed;
#[cfg(unix)]
mod unix;

use crate::client::link;
use crate::error::{Error, Result};
use crate::serve::core::context::Context;
use crate::serve::core::hub::{Hub, count};
use crate::serve::guard::limits::Backoff;
use crate::serve::guard::places::{Kind, Place};
use crate::serve::protocol::wire;
use crate::sink::address::Listen;
#[cfg(unix)]
use crate::sink::address::Transport;
use bytes::Bytes;
use std::future::Future;
use std::io;

#[cfg(unix)]
pub use passed::Passed;
pub use stdin::read as read_stdin;

/// Bytes the kernel keeps for a client that does not read. By itself it would keep megabytes, which with
/// hundreds of such clients is more than it has for all connections together: then packets of those
/// who do read are dropped, and sent again only after a while.
const SEND_BUFFER: usize = 128 << 10;

/// Something that is listened on.
#[derive(Debug)]
pub enum Listener {
    /// Lines over TCP.
    Tcp(tokio::net::TcpListener),
    /// Lines in datagrams.
    Udp(tokio::net::UdpSocket),
    /// WebSocket and HTTP.
    WebSocket(tokio::net::TcpListener),
    /// Lines over a Unix socket.
    #[cfg(unix)]
    Unix(unix::Bound),
}

impl Listener {
    /// Begins to listen, and says where: port 0 has become a real one.
    ///
    /// # Errors
    /// [`Error::Bind`].
    pub async fn bind(
        listen: &Listen,
        #[cfg(unix)] passed: &mut Passed,
    ) -> Result<(Listener, Listen)> {
        let fail = |source| Error::Bind {
            address: listen.to_string().into(),
            source,
        };
        match listen {
            Listen::Tcp(address) => {
                let listener = tokio::net::TcpListener::bind(address).await.map_err(fail)?;
                let bound = Listen::Tcp(listener.local_addr().map_err(fail)?);
                Ok((Listener::Tcp(listener), bound))
            }
            Listen::WebSocket(address) => {
                let listener = tokio::net::TcpListener::bind(address).await.map_err(fail)?;
                let bound = Listen::WebSocket(listener.local_addr().map_err(fail)?);
                Ok((Listener::WebSocket(listener), bound))
            }
            Listen::Udp(address) => {
                let socket = tokio::net::UdpSocket::bind(address).await.map_err(fail)?;
                let bound = Listen::Udp(socket.local_addr().map_err(fail)?);
                Ok((Listener::Udp(socket), bound))
            }
            #[cfg(unix)]
            Listen::Unix(path) => {
                let bound = unix::Bound::new(path).map_err(fail)?;
                Ok((Listener::Unix(bound), listen.clone()))
            }
            #[cfg(unix)]
            Listen::Passed(transport, name) => {
                let socket = passed.take(*transport, name).map_err(fail)?;
                Listener::of(*transport, socket).map_err(fail)
            }
            #[cfg(not(unix))]
            Listen::Unix(_) | Listen::Passed(..) => Err(fail(io::ErrorKind::Unsupported.into())),
        }
    }

    /// A socket that was opened for us, and where it listens.
    #[cfg(unix)]
    fn of(transport: Transport, socket: passed::Socket) -> io::Result<(Listener, Listen)> {
        use passed::Socket;
        Ok(match socket {
            Socket::Tcp(socket) => {
                let socket = tokio::net::TcpListener::from_std(socket)?;
                let address = socket.local_addr()?;
                match transport {
                    Transport::WebSocket => {
                        (Listener::WebSocket(socket), Listen::WebSocket(address))
                    }
                    _ => (Listener::Tcp(socket), Listen::Tcp(address)),
                }
            }
            Socket::Udp(socket) => {
                let socket = tokio::net::UdpSocket::from_std(socket)?;
                let bound = Listen::Udp(socket.local_addr()?);
                (Listener::Udp(socket), bound)
            }
            Socket::Unix(socket) => {
                let (bound, path) = unix::Bound::passed(socket)?;
                (Listener::Unix(bound), Listen::Unix(path))
            }
        })
    }

    /// Serves until the daemon ends. It counts as running until its address is free again: who waits
    /// for the end may bind it at once.
    pub async fn serve(self, context: Context) {
        let mut until_free = context.running.clone();
        until_free.has_read();
        match self {
            Listener::Tcp(listener) => tcp::serve(listener, context).await,
            Listener::Udp(socket) => udp::serve(socket, context).await,
            Listener::WebSocket(listener) => http::serve(listener, context).await,
            #[cfg(unix)]
            Listener::Unix(bound) => unix::serve(bound, context).await,
        }
        drop(until_free);
    }
}

/// Accepts until the daemon ends; who comes is of this kind at first. A connection that finds no place is
/// handed to `refuse`, with what to say. An accept that fails (too many open files, mostly) is tried again,
/// ever more slowly.
async fn accept<S, A: Future<Output = io::Result<S>>>(
    context: Context,
    kind: Kind,
    mut next: impl FnMut() -> A,
    mut serve: impl FnMut(S, Context, Place),
    mut refuse: impl FnMut(S, Context, Bytes),
) {
    let mut backoff = Backoff::default();
    let mut running = context.running.clone();
    loop {
        let accepted = tokio::select! {
            accepted = next() => accepted,
            () = running.asked() => return,
        };
        match accepted {
            Ok(stream) => {
                backoff.worked();
                if let Some(place) = context.places.take(kind) {
                    count(&context.hub.counters.accepted, 1);
                    serve(stream, context.clone(), place);
                } else {
                    let fault = context.places.refusal(kind);
                    context.hub.turned_away(&fault);
                    let words = wire::error(&fault, 0, &[], 0);
                    refuse(stream, context.clone(), words);
                }
            }
            Err(why) => {
                let wait = backoff.failed();
                count(&context.hub.counters.accept_failures, 1);
                crate::serve::guard::log_throttle::warn(
                    "accept",
                    &format!("cannot accept a connection: {why}; trying again in {wait:?}"),
                );
                tokio::select! {
                    () = tokio::time::sleep(wait) => {}
                    () = running.asked() => return,
                }
            }
        }
    }
}

/// A connection as it was accepted is made ready.
fn prepare(stream: &tokio::net::TcpStream) {
    link::prepare(stream);
    // Refused, it is as large as ever.
    let _ = socket2::SockRef::from(stream).set_send_buffer_size(SEND_BUFFER);
    // While something is on its way nothing is probed: a peer that has vanished is given up after as long.
    tcp::expect_notice(stream, link::VANISHED);
}

/// Kind of a connection of lines before it has said anything.
fn initial_kind(hub: &Hub) -> Kind {
    match hub.token() {
        None => Kind::Served,
        Some(_) => Kind::Unproven,
    }
}
