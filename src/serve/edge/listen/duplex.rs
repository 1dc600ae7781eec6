//! A socket of bytes both ways <-> a session. I/O.
//!
//! One task per client reads, works and writes: no hop between tasks, no buffer while it idles, and
//! a client that is worked for is not read from, which is how TCP slows a sender down.

use crate::client::link;
use crate::serve::core::context::Context;
use crate::serve::core::hub::{Flood, count};
use crate::serve::core::outbox::Outbox;
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::Session;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::peer::Peer;
use crate::serve::guard::places::{Kind, Place};
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::wire;
use bytes::{Buf, Bytes};
use futures_util::FutureExt;
use std::collections::VecDeque;
use std::future::{Future, ready};
use std::io::{self, IoSlice};
use std::time::Duration;
use tokio::io::Ready;
use tokio::task::yield_now;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout};

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
        hub, mut running, ..
    } = context;
    let mut session = Session::new(&hub, peer, false);
    let client = session.client().clone();
    place.serves(client.clone());
    let reason = talk(&io, &mut session, &mut running, &place).await;
    // What it sent is no longer its own; only its last words are still to be said.
    drop(session);
    if let Some(reason) = reason {
        count(&hub.counters.closed, 1);
        tracing::debug!("{}: closed: {reason}", client.peer);
    }
}

/// The conversation. Returns why we ended it, if we did.
async fn talk<D: Duplex>(
    io: &D,
    session: &mut Session,
    running: &mut Running,
    place: &Place,
) -> Option<&'static str> {
    let client = session.client().clone();
    let hub = session.hub().clone();
    let outbox = &client.outbox;
    let limits = *hub.limits();
    let opened = Instant::now();
    let mut progress = opened;
    let mut pending = Pending::default();
    let mut reading = true;
    // It has said that it sends nothing more.
    let mut has_ended = false;
    let mut gave_back = false;
    let mut written = opened;
    let mut flood = Flood::default();
    let mut closing = None;
    let mut has_place = session.is_authorised();
    // What is still read of it at the end of the daemon.
    let mut last_read: Option<usize> = None;
    let mut tick = interval(limits.tick());
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        if let Some(end) = session.end()
            && closing.is_none()
        {
            reading = false;
            closing = Some(Some(end.reason()));
            end.warn_of(&client.peer.name);
            if let Some((delay, words)) = session.last_words() {
                tokio::select! {
                    () = sleep(delay) => {}
                    () = place.lost() => return Some(MADE_ROOM),
                    () = running.asked() => {}
                }
                outbox.reply(words);
            }
        }
        if session.is_authorised() && !has_place && closing.is_none() {
            has_place = true;
            if let Err(fault) = place.become_of(Kind::Served, true) {
                hub.turned_away(&fault);
                outbox.reply(wire::error(&fault, 0, &[], 0));
                reading = false;
                closing = Some(Some("there is no place for it"));
            }
        }
        let held = session.is_held();
        if has_ended && !held && !gave_back {
            gave_back = true;
            io.expect_notice(link::VANISHED.saturating_sub(limits.ping));
            session.give_back();
            place.only_watches();
        }
        // Whoever sent a request and nothing more still wants the answers.
        if has_ended && !held && closing.is_none() && !outbox.level().watching {
            closing = Some(None);
        }
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
                    written = progress;
                }
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    blocked = true;
                    break;
                }
                Err(_) => return closing.flatten(),
            }
        }
        if closing.is_some() || (last_read.is_some() && !reading && !held) {
            running.has_read();
        }
        if outbox.full().is_some() && closing.is_none() {
            return Some("it does not read the replies to what it sends");
        }
        let hurry = turns == TURNS && !blocked;
        if !blocked
            && !hurry
            && let Some(reason) = closing
            && !outbox.owes_answer()
        {
            linger(io).await;
            return reason;
        }
        if !blocked {
            // Nothing waits: the clock of progress stands still.
            progress = Instant::now();
        }
        let reads = reading && !held && !flood.must_wait();
        tokio::select! {
            () = flood.wait(&hub), if flood.must_wait() && !held => {}
            () = ready(()), if held && closing.is_none() && session.may_go_on() => {
                yield_now().await;
                let _turn = hub.turn(session.is_asking()).await;
                with_read_buffer(|_, scratch| session.go_on(scratch));
            }
            readable = io.readable(), if reads && last_read.is_none() => {
                let _turn = hub.turn(session.is_asking()).await;
                let read = readable.and_then(|()| with_read_buffer(|buffer, scratch| {
                    let most = flood.most(buffer.len());
                    let n = io.try_read(buffer.get_mut(..most).unwrap_or_default())?;
                    flood.read(n, most);
                    session.bytes(buffer.get(..n).unwrap_or_default(), now(), scratch);
                    Ok(n)
                }));
                match read {
                    Ok(0) => {
                        reading = false;
                        has_ended = true;
                        with_read_buffer(|_, scratch| session.finish(now(), scratch));
                    }
                    Ok(_) => place.heard(),
                    Err(e) if e.kind() == io::ErrorKind::WouldBlock => {}
                    Err(_) => return None,
                }
            }
            // What has arrived is still taken, also what the kernel has and the reactor has not yet told
            // of.
            () = ready(()), if reading && !held && last_read.is_some() => {
                yield_now().await;
                let _turn = hub.turn(session.is_asking()).await;
                let read = with_read_buffer(|buffer, scratch| {
                    let n = io.try_read(buffer)?;
                    session.bytes(buffer.get(..n).unwrap_or_default(), now(), scratch);
                    io::Result::Ok(n)
                });
                let left = last_read.unwrap_or(0);
                match read {
                    Ok(n) if n > 0 && n < left => last_read = Some(left - n),
                    Ok(0) => {
                        reading = false;
                        with_read_buffer(|_, scratch| session.finish(now(), scratch));
                    }
                    _ => reading = false,
                }
            }
            ready = io.writable(), if blocked => {
                if ready.is_err() {
                    return None;
                }
            }
            () = outbox.filled(), if !blocked && !hurry => {}
            () = yield_now(), if hurry => {}
            () = place.lost() => {
                outbox.reply(wire::error(&place.made_room(), 0, &[], 0));
                if pending.fill(outbox) {
                    // What has no room now comes too late.
                    let _ = pending.write(io);
                }
                return Some(MADE_ROOM);
            }
            _ = tick.tick() => {
                if has_ended && io.is_closed() {
                    return None;
                }
                if has_ended && !D::SHOWS_CLOSE && !blocked && written.elapsed() >= limits.ping {
                    outbox.reply(wire::heartbeat(limits.ping));
                }
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
            () = running.asked_further(last_read.is_some()), if closing.is_none() => {
                if last_read.is_some() {
                    closing = Some(None);
                } else {
                    let _ = timeout(SETTLE, io.readable()).await;
                    last_read = Some(LAST_READ);
                }
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
