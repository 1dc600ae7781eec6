//! TCP -> sessions. I/O.

use super::duplex::{self, Duplex};
use super::{accept, initial_kind, prepare};
use crate::serve::core::context::Context;
use crate::serve::guard::peer::Peer;
use std::future::Future;
use std::io::{self, IoSlice};
use std::time::Duration;
use tokio::io::Interest;
use tokio::net::{TcpListener, TcpStream};

impl Duplex for TcpStream {
    fn readable(&self) -> impl Future<Output = io::Result<()>> + Send {
        TcpStream::readable(self)
    }
    fn writable(&self) -> impl Future<Output = io::Result<()>> + Send {
        TcpStream::writable(self)
    }
    fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        TcpStream::try_read(self, buffer)
    }
    fn try_write(&self, parts: &[IoSlice<'_>]) -> io::Result<usize> {
        self.try_write_vectored(parts)
    }
    fn end(&self) {
        duplex::shut(&socket2::SockRef::from(self));
    }
    fn is_closed(&self) -> bool {
        duplex::is_closed(self.ready(Interest::WRITABLE))
    }
    const SHOWS_CLOSE: bool = false;
    fn expect_notice(&self, within: Duration) {
        expect_notice(self, within);
    }
}

/// Breaks a connection whose peer acknowledges nothing for so long, where the system can.
pub(super) fn expect_notice(stream: &TcpStream, within: Duration) {
    // Refused, it takes the system's own time.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    let _ = socket2::SockRef::from(stream).set_tcp_user_timeout(Some(within));
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    let _ = (stream, within);
}

pub(super) async fn serve(listener: TcpListener, context: Context) {
    let kind = initial_kind(&context.hub);
    accept(
        context,
        kind,
        || listener.accept(),
        |(stream, peer), context, place| {
            prepare(&stream);
            duplex::spawn(stream, Peer::at("tcp", peer), context, place);
        },
        |(stream, _), context, words| duplex::spawn_dismissal(stream, &context, words),
    )
    .await;
}
