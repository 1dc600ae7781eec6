//! A socket of bytes both ways <-> a session. I/O.
//!
//! One task per client reads, works and writes: no hop between tasks, no buffer while it idles, and
//! a client that is worked for is not read from, which is how TCP slows a sender down.

mod talk;

use crate::serve::core::context::Context;
use crate::serve::core::hub::count;
use crate::serve::core::outbox::Outbox;
use crate::serve::core::read_buffer::with_read_buffer;
use crate::serve::core::session::Session;
use crate::serve::guard::peer::Peer;
use crate::serve::guard::places::Place;
use bytes::{Buf, Bytes};
use futures_util::FutureExt;
use std::collections::VecDeque;
use std::future::Future;
use std::io::{self, IoSlice};
use std::ops::ControlFlow;
use std::time::Duration;
use talk::Talk;
use tokio::io::Ready;
use tokio::time::timeout;

/// A stream socket of tokio.
pub(super) trait Duplex: Send + Sync + 'static {
    /// Waits until there may be something to read.
    fn readable(&self) -> impl Future<Output = io::Result<()>> + Send;
    /// Waits until there may be room to write.
    fn writable(&self) -> impl Future<Output = io::Result<()>> + Send;
    /// Reads what is there.
    fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize>;
    /// Writes what there is room for.
    fn try_write(&self, parts: &[IoSlice<'_>]) -> io::Result<usize>;
    /// Says that nothing more will be written.
    fn end(&self);
    /// Whether the other end has closed both ways, as far as the system knows.
    fn is_closed(&self) -> bool;
    /// Whether the system always knows. Of TCP it does not: who closes says no more than who ends its side alone,
    /// and its system answers keep-alive probes for a minute afterwards. What is written is answered with a reset.
    const SHOWS_CLOSE: bool;
    /// Breaks when what was written is not taken notice of for so long.
    fn expect_notice(&self, within: Duration);
}

/// Whether what waits for a socket to become writable found both its sides closed.
pub(super) fn is_closed(ready: impl Future<Output = io::Result<Ready>>) -> bool {
    matches!(ready.now_or_never(), Some(Ok(ready)) if ready.is_write_closed())
}

/// Attitudes taken from the outbox at once; with what one system call takes.
const TAKE: usize = 64 << 10;
/// System calls for one client before others have their turn.
const TURNS: usize = 16;
/// Chunks one system call takes.
const PARTS: usize = 64;
/// Time for which a client that is being closed is still read, so that our last words are not lost with a
/// reset.
const LINGER: Duration = Duration::from_millis(250);
/// Time by which what arrived before the end shows.
const SETTLE: Duration = Duration::from_millis(20);
/// Bytes read from a client at the end of the daemon: more than a socket's buffer holds.
const LAST_READ: usize = 16 << 20;

/// Why one was ended whose place another needed.
const MADE_ROOM: &str = "others needed its place";

/// Bytes on their way to one client.
#[derive(Debug, Default)]
struct Pending {
    parts: VecDeque<Bytes>,
    /// Bytes of attitudes among them; `None`: nothing was taken.
    attitudes: Option<usize>,
}

impl Pending {
    /// Takes more when all has left; says whether there is anything.
    fn fill(&mut self, outbox: &Outbox) -> bool {
        if self.parts.is_empty() {
            if let Some(attitudes) = self.attitudes.take() {
                outbox.written(attitudes);
            }
            let attitudes = outbox.take(TAKE, &mut self.parts);
            self.attitudes = (!self.parts.is_empty()).then_some(attitudes);
        }
        !self.parts.is_empty()
    }

    /// Writes what there is room for; says how much that was.
    fn write(&mut self, io: &impl Duplex) -> io::Result<usize> {
        let mut slices = [IoSlice::new(&[]); PARTS];
        let mut n = 0;
        for (slice, part) in slices.iter_mut().zip(&self.parts) {
            *slice = IoSlice::new(part);
            n += 1;
        }
        let written = io.try_write(slices.get(..n).unwrap_or_default())?;
        let mut left = written;
        while left > 0
            && let Some(first) = self.parts.front_mut()
        {
            let step = left.min(first.len());
            first.advance(step);
            left -= step;
            if first.is_empty() {
                self.parts.pop_front();
            }
        }
        while self.parts.front().is_some_and(Bytes::is_empty) {
            self.parts.pop_front();
        }
        Ok(written)
    }
}

/// Serves one client to the end of its conversation.
pub(super) async fn converse(io: impl Duplex, peer: Peer, context: Context, place: Place) {
    let Context {
        hub,
        mut running,
        reading,
        ..
    } = context;
    let mut session = Session::new(&hub, peer, false).reading(reading);
    let client = session.client().clone();
    place.serves(client.clone());
    let reason = {
        let mut talk = Talk::new(&io, &mut session, &mut running, &place);
        loop {
            if let ControlFlow::Break(reason) = talk.round().await {
                break reason;
            }
        }
    };
    // What it sent is no longer its own; only its last words are still to be said.
    drop(session);
    if let Some(reason) = reason {
        count(&hub.counters.closed, 1);
        tracing::debug!("{}: closed: {reason}", client.peer);
    }
}

/// Says the last words to a client that is not served.
pub(super) async fn dismiss(io: impl Duplex, words: Bytes) {
    // A fresh socket has room for a line; if not, nobody is owed more.
    let _ = io.try_write(&[IoSlice::new(&words)]);
    linger(&io).await;
}

/// Ends our side and reads what still comes for a moment: closing with unread bytes would reset
/// the connection, and the last words with it.
async fn linger(io: &impl Duplex) {
    io.end();
    let _ = timeout(LINGER, async {
        let mut left = LAST_READ;
        while left > 0 && io.readable().await.is_ok() {
            match with_read_buffer(|buffer, _| io.try_read(buffer)) {
                Ok(0) => return,
                Ok(n) => left = left.saturating_sub(n),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                Err(_) => return,
            }
        }
    })
    .await;
}

/// A client of an accepted stream, as a task.
pub(super) fn spawn<D: Duplex>(io: D, peer: Peer, context: Context, place: Place) {
    tokio::spawn(converse(io, peer, context, place));
}

/// Spawns, as [`spawn`], for one without a place.
pub(super) fn spawn_dismissal<D: Duplex>(io: D, context: &Context, words: Bytes) {
    let running = context.running.clone();
    tokio::spawn(async move {
        dismiss(io, words).await;
        drop(running);
    });
}

/// Shared by the sockets whose half can be shut through `socket2`.
pub(super) fn shut(socket: &socket2::SockRef<'_>) {
    // It may have gone already.
    let _ = socket.shutdown(std::net::Shutdown::Write);
}
