//! TCP -> sessions. I/O.

use super::duplex::{self, Duplex};
use super::{Context, accept};
use std::future::Future;
use std::io::{self, IoSlice};
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};

/// A peer that has vanished is noticed after 15 + 3 * 5 s.
const IDLE: Duration = Duration::from_secs(15);
const PROBE: Duration = Duration::from_secs(5);
const PROBES: u32 = 3;

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
}

pub(super) async fn serve(listener: TcpListener, context: Context) {
    accept(
        context,
        || listener.accept(),
        |(stream, peer), context, place| {
            prepare(&stream);
            duplex::spawn(stream, name(peer), context, place);
        },
        |(stream, _), context| duplex::spawn_dismissal(stream, &context),
    )
    .await;
}

/// Small messages leave at once, and silence is probed. Neither can be refused with more than a
/// loss of comfort.
pub(crate) fn prepare(stream: &TcpStream) {
    let _ = stream.set_nodelay(true);
    let keepalive = socket2::TcpKeepalive::new().with_time(IDLE);
    #[cfg(unix)]
    let keepalive = keepalive.with_interval(PROBE).with_retries(PROBES);
    let _ = socket2::SockRef::from(stream).set_tcp_keepalive(&keepalive);
}

fn name(peer: SocketAddr) -> String {
    format!("tcp://{peer}")
}
