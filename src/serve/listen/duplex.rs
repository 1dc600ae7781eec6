//! A socket of bytes both ways <-> a session. I/O.
//!
//! One task per client reads, works and writes: no hop between tasks, no buffer while it idles, and
//! a client that is worked for is not read from, which is how TCP slows a sender down.

use super::{Context, in_room, now};
use crate::serve::hub::{Flood, count};
use crate::serve::session::Session;
use crate::serve::shutdown::Running;
use crate::serve::subscriber::Outbox;
use crate::serve::wire::{self, Fault};
use bytes::{Buf, Bytes};
use std::collections::VecDeque;
use std::future::Future;
use std::io::{self, IoSlice};
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

/// A stream socket of tokio.
pub(super) trait Duplex: Send + Sync + 'static {
    /// Until there may be something to read.
    fn readable(&self) -> impl Future<Output = io::Result<()>> + Send;
    /// Until there may be room to write.
    fn writable(&self) -> impl Future<Output = io::Result<()>> + Send;
    /// Reads what is there.
    fn try_read(&self, buffer: &mut [u8]) -> io::Result<usize>;
    /// Writes what there is room for.
    fn try_write(&self, parts: &[IoSlice<'_>]) -> io::Result<usize>;
    /// Says that nothing more will be written.
    fn end(&self);
}

/// Attitudes taken from the outbox at once; with what one system call takes.
const TAKE: usize = 64 << 10;
/// System calls for one client before others have their turn.
const TURNS: usize = 16;
/// Chunks one system call takes.
const PARTS: usize = 64;
/// What is still read of a client that is being closed, so that our last words are not lost with a
/// reset.
const LINGER: Duration = Duration::from_millis(250);
/// What arrived before the end shows by then.
const SETTLE: Duration = Duration::from_millis(20);
/// Bytes read from a client at the end of the daemon: more than a socket's buffer holds.
const LAST_READ: usize = 16 << 20;

/// What is on its way to one client.
#[derive(Debug, Default)]
struct Pending {
    parts: VecDeque<Bytes>,
    /// Bytes of attitudes among them.
    attitudes: usize,
}

impl Pending {
    /// Takes more when all has left; says whether there is anything.
    fn fill(&mut self, outbox: &Outbox) -> bool {
        if self.parts.is_empty() {
            outbox.written(std::mem::take(&mut self.attitudes));
            self.attitudes = outbox.take(TAKE, &mut self.parts);
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
pub(super) async fn converse(io: impl Duplex, peer: String, context: Context) {
    let Context {
        hub, mut running, ..
    } = context;
    let mut session = Session::new(&hub, peer, false);
    let client = session.client().clone();
    let reason = talk(&io, &mut session, &mut running).await;
    // What it sent is no longer its own; only its last words are still to be said.
    drop(session);
    if let Some(reason) = reason {
        count(&hub.counters.closed, 1);
        tracing::debug!("{}: closed: {reason}", client.peer);
    }
}

/// The conversation. Returns why we ended it, if we did.
async fn talk(
    io: &impl Duplex,
    session: &mut Session,
    running: &mut Running,
) -> Option<&'static str> {
    let client = session.client().clone();
    let hub = session.hub().clone();
    let outbox = &client.outbox;
    let limits = *hub.limits();
    let opened = Instant::now();
    let mut progress = opened;
    let mut pending = Pending::default();
    let mut reading = true;
    let mut flood = Flood::default();
    let mut closing = None;
    let mut stopping = false;
    let mut tick = interval(limits.tick());
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        // Write what there is without asking: there nearly always is room.
        let mut blocked = false;
        let mut turns = 0;
        while pending.fill(outbox) {
            // A client that takes as fast as is made must not keep this task from all else.
            if turns == TURNS {
                break;
            }
            turns += 1;
            match pending.write(io) {
                Ok(n) => {
                    count(&hub.counters.bytes_out, n);
                    progress = Instant::now();
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    blocked = true;
                    break;
                }
                Err(_) => return closing.flatten(),
            }
        }
        if closing.is_some() {
            running.has_read();
        }
        if outbox.full().is_some() && closing.is_none() {
            return Some("it does not read the replies to what it sends");
        }
        let hurry = turns == TURNS && !blocked;
        if !blocked
            && !hurry
            && let Some(reason) = closing
        {
            linger(io).await;
            return reason;
        }
        if !blocked {
            // Nothing waits: the clock of progress stands still.
            progress = Instant::now();
        }
        tokio::select! {
            () = flood.wait(&hub), if flood.must_wait() => {}
            ready = io.readable(), if reading && !flood.must_wait() => {
                let read = ready.and_then(|()| in_room(|buffer, scratch| {
                    let most = flood.most(buffer.len());
                    let n = io.try_read(buffer.get_mut(..most).unwrap_or_default())?;
                    flood.read(n, most);
                    session.bytes(buffer.get(..n).unwrap_or_default(), now(), scratch);
                    Ok(n)
                }));
                match read {
                    Ok(0) => {
                        reading = false;
                        in_room(|_, scratch| session.finish(now(), scratch));
                        // Whoever sent a request and nothing more still wants the answers.
                        if !outbox.level().watching {
                            closing = Some(None);
                        }
                    }
                    Ok(_) => {}
                    Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                    Err(_) => return None,
                }
                if session.end().is_some() {
                    reading = false;
                    closing = Some(Some("bad lines or no token"));
                }
            }
            ready = io.writable(), if blocked => {
                if ready.is_err() {
                    return None;
                }
            }
            () = outbox.filled(), if !blocked && !hurry => {}
            () = tokio::task::yield_now(), if hurry => {}
            _ = tick.tick() => {
                if blocked && progress.elapsed() >= limits.no_progress {
                    return Some("it took nothing for too long");
                }
                if reading && !session.has_spoken() && opened.elapsed() >= limits.first_line {
                    let fault = Fault::new("first_line_timeout", "no line came in time; the connection is closed");
                    outbox.reply(wire::error(&fault, 0, &[], 0));
                    reading = false;
                    closing = Some(Some("no first line"));
                }
            }
            () = running.asked_further(stopping), if closing.is_none() => {
                if stopping {
                    closing = Some(None);
                    continue;
                }
                // What has arrived is still taken, also what the kernel has and the reactor has not yet
                // told of.
                let _ = timeout(SETTLE, io.readable()).await;
                let mut left = LAST_READ;
                while reading && left > 0 {
                    let read = in_room(|buffer, scratch| {
                        let n = io.try_read(buffer)?;
                        session.bytes(buffer.get(..n).unwrap_or_default(), now(), scratch);
                        io::Result::Ok(n)
                    });
                    match read {
                        Ok(n) if n > 0 && session.end().is_none() => left = left.saturating_sub(n),
                        _ => break,
                    }
                }
                reading = false;
                stopping = true;
                running.has_read();
            }
        }
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
            match in_room(|buffer, _| io.try_read(buffer)) {
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
pub(super) fn spawn<D: Duplex>(
    io: D,
    peer: String,
    context: Context,
    place: tokio::sync::OwnedSemaphorePermit,
) {
    tokio::spawn(async move {
        converse(io, peer, context).await;
        drop(place);
    });
}

/// As [`spawn`] for one without a place.
pub(super) fn spawn_dismissal<D: Duplex>(io: D, context: &Context) {
    let words = super::too_many_clients(&context.hub);
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
