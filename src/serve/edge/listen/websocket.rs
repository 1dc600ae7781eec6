//! A WebSocket -> a session, or a viewer. I/O.
//!
//! One message is one line or several; every answer and attitude is a message of its own, so that a
//! page can hand it to `JSON.parse` as it is. Packed objects go in binary messages, one or more in each.

use crate::serve::core::hub::{Client, Flood, Hub, count};
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::Session;
use crate::serve::core::viewer::Viewer;
use crate::serve::edge::http::connection::Connection;
use crate::serve::guard::places::{Kind, Place};
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::foxglove::frames::{self, Framed};
use crate::serve::protocol::wire;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use bytes::Bytes;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, Stream, StreamExt};
use memchr::memchr_iter;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Poll;
use std::time::Duration;
use strapd_recording::decode::packed;
use tokio::task::yield_now;
use tokio::time::error::Elapsed;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep, timeout};

/// Longest message that is read: a line that is too long is still answered, up to here.
pub(crate) const MAX_MESSAGE: usize = 128 << 10;
/// Room for reading from one client.
pub(crate) const READ_BUFFER: usize = 4 << 10;
/// Bytes gathered for one write.
pub(crate) const WRITE_BUFFER: usize = 16 << 10;
/// Most bytes waiting for one write.
pub(crate) const MAX_WRITE_BUFFER: usize = 512 << 10;
/// Time that somebody who lost its place may take to hear it.
const LAST_WORDS: Duration = Duration::from_millis(250);
/// Attitudes taken from the outbox at once.
const TAKE: usize = 64 << 10;

/// Reason for which we ended a conversation; `None`: it ended by itself.
type Reason = Option<&'static str>;

/// Serves one WebSocket to the end of its conversation.
///
/// `foxglove`: it speaks Foxglove's protocol, and whether that which knows playback.
pub(crate) async fn converse(socket: WebSocket, connection: Connection, foxglove: Option<bool>) {
    let Connection {
        hub,
        peer,
        trusted,
        is_own_page,
        running,
        place,
        reading,
        ..
    } = connection;
    let session = match foxglove {
        None => Talk::Lines(Box::new(
            Session::new(&hub, peer, trusted)
                .of_own_page(is_own_page)
                .reading(reading),
        )),
        Some(controls) => Talk::Foxglove(Viewer::new(&hub, peer, controls)),
    };
    let client = session.client().clone();
    place.serves(client.clone());
    let (mut sink, stream) = socket.split();
    let closing = AtomicBool::new(false);
    let mut reading = Reading {
        has_place: session.is_authorised(),
        session,
        stream,
        running,
        hub: &hub,
        place: &place,
        opened: Instant::now(),
        flood: Flood::default(),
    };
    let writing = Writing {
        sink: &mut sink,
        hub: &hub,
        client: &client,
        closing: &closing,
        is_foxglove: foxglove.is_some(),
    };
    let drain = hub.limits().drain;
    let mut writer = Box::pin(writing.write_on());
    let close = || {
        closing.store(true, Ordering::Release);
        client.outbox.nudge();
    };
    let reason = tokio::select! {
        () = place.lost() => {
            client.outbox.reply(wire::error(&place.made_room(), 0, &[], 0));
            close();
            // It waited for nothing, so that this finds room, or it is owed none.
            let _ = timeout(LAST_WORDS, &mut writer).await;
            Some("others needed its place")
        }
        reason = reading.read_on() => {
            close();
            reason.or(timeout(drain, &mut writer).await.ok().flatten())
        }
        reason = &mut writer => reason,
    };
    drop(writer);
    drop(reading);
    let _ = timeout(drain, sink.close()).await;
    if let Some(reason) = reason {
        count(&hub.counters.closed, 1);
        tracing::debug!("{}: closed: {reason}", client.peer);
    }
}

/// Reading side of a conversation.
struct Reading<'c> {
    session: Talk,
    stream: SplitStream<WebSocket>,
    running: Running,
    hub: &'c Hub,
    place: &'c Place,
    /// Whether it has the place of one who converses.
    has_place: bool,
    opened: Instant,
    flood: Flood,
}

impl Reading<'_> {
    async fn read_on(&mut self) -> Reason {
        loop {
            let patience = self.patience();
            let message = tokio::select! {
                message = next(&mut self.stream, &mut self.flood, patience) => message,
                () = self.running.asked() => {
                    self.last_read().await;
                    return None;
                }
            };
            match message {
                Err(_) => return Some("nothing was heard from it for too long"),
                Ok(None | Some(Err(_) | Ok(Message::Close(_)))) => return None,
                Ok(Some(Ok(message))) => {
                    self.session.take_all(&message, self.hub).await;
                    if payload(&message).is_some() {
                        self.place.heard();
                    }
                }
            }
            if !self.takes_its_place() {
                return Some("there is no place for it");
            }
            self.flood.wait(self.hub).await;
            if self.session.is_over() {
                self.say_last_words().await;
                return Some("bad lines or no token");
            }
        }
    }

    /// Time within which something is to be heard.
    fn patience(&self) -> Duration {
        let limits = self.hub.limits();
        match self.session.has_spoken() {
            true => limits.ping * 2 + limits.ping / 3,
            false => limits.first_line.saturating_sub(self.opened.elapsed()),
        }
    }

    /// The daemon ends: what has arrived is still taken.
    async fn last_read(&mut self) {
        let rest = async {
            while let Some(Ok(message)) = ready(&mut self.stream).await {
                self.session.take_all(&message, self.hub).await;
            }
        };
        let _ = timeout(self.hub.limits().drain / 2, rest).await;
        self.running.has_read();
        self.running.asked_to_send().await;
    }

    /// Whether there is a place for it, once it has shown that it may converse.
    fn takes_its_place(&mut self) -> bool {
        if !self.session.is_authorised() || std::mem::replace(&mut self.has_place, true) {
            return true;
        }
        let Err(fault) = self.place.become_of(Kind::Served, true) else {
            return true;
        };
        self.hub.turned_away(&fault);
        let words = wire::error(&fault, 0, &[], 0);
        self.session.client().outbox.reply(words);
        false
    }

    async fn say_last_words(&mut self) {
        if let Some((delay, words)) = self.session.last_words() {
            tokio::select! {
                () = sleep(delay) => {}
                () = self.running.asked() => {}
            }
            self.session.client().outbox.reply(words);
        }
    }
}

/// The next message: what is there already, or what comes in time.
async fn next(
    stream: &mut SplitStream<WebSocket>,
    flood: &mut Flood,
    patience: Duration,
) -> Result<Option<Result<Message, axum::Error>>, Elapsed> {
    let there = ready(stream).await;
    let said = there.as_ref().and_then(|m| payload(m.as_ref().ok()?));
    flood.message(there.is_some(), said.map_or(0, |(bytes, _)| bytes.len()));
    match there {
        Some(message) => Ok(Some(message)),
        None => timeout(patience, stream.next()).await,
    }
}

/// Writing side of a conversation.
struct Writing<'c> {
    sink: &'c mut SplitSink<WebSocket, Message>,
    hub: &'c Hub,
    client: &'c Client,
    /// Nothing more is read: what it is owed is the last.
    closing: &'c AtomicBool,
    is_foxglove: bool,
}

impl Writing<'_> {
    async fn write_on(self) -> Reason {
        let limits = self.hub.limits();
        let outbox = &self.client.outbox;
        let mut pings = interval_at(Instant::now() + limits.ping, limits.ping);
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut parts = VecDeque::new();
        loop {
            let attitudes = outbox.take(TAKE, &mut parts);
            if parts.is_empty() {
                if self.closing.load(Ordering::Acquire) && !outbox.owes_answer() {
                    return None;
                }
                tokio::select! {
                    () = outbox.filled() => {}
                    _ = pings.tick() => {
                        let ping = self.sink.send(Message::Ping(Bytes::new()));
                        if !matches!(timeout(limits.no_progress, ping).await, Ok(Ok(()))) {
                            return Some("it took nothing for too long");
                        }
                    }
                }
                continue;
            }
            if outbox.full().is_some() {
                return Some("it does not read the replies to what it sends");
            }
            let bytes: usize = parts.iter().map(Bytes::len).sum();
            let sending = send(self.sink, &mut parts, self.is_foxglove);
            match timeout(limits.no_progress, sending).await {
                Ok(Ok(())) => {
                    outbox.written(attitudes);
                    count(&self.hub.counters.bytes_out, bytes);
                }
                Ok(Err(_)) => return None,
                Err(_) => return Some("it took nothing for too long"),
            }
        }
    }
}

/// Sends parts of an outbox, each message of its own kind.
async fn send(
    sink: &mut SplitSink<WebSocket, Message>,
    parts: &mut VecDeque<Bytes>,
    is_foxglove: bool,
) -> Result<(), axum::Error> {
    for part in parts.drain(..) {
        if is_foxglove {
            for message in frames::messages(&part) {
                sink.feed(match message {
                    Framed::Text(line) => text(line),
                    Framed::Binary(bytes) => Message::Binary(bytes),
                })
                .await?;
            }
        } else if packed::is_packed(&part) {
            sink.feed(Message::Binary(part)).await?;
        } else {
            for line in lines(&part) {
                sink.feed(text(line)).await?;
            }
        }
    }
    sink.flush().await
}

/// Conversation with a client.
enum Talk {
    Lines(Box<Session>),
    Foxglove(Viewer),
}

impl Talk {
    fn client(&self) -> &Arc<Client> {
        match self {
            Talk::Lines(session) => session.client(),
            Talk::Foxglove(viewer) => viewer.client(),
        }
    }

    /// Whether it need not be waited for to say something first.
    fn has_spoken(&self) -> bool {
        match self {
            Talk::Lines(session) => session.has_spoken(),
            // Its handshake has said what it is.
            Talk::Foxglove(_) => true,
        }
    }

    fn is_over(&self) -> bool {
        match self {
            Talk::Lines(session) => session.end().is_some(),
            Talk::Foxglove(viewer) => viewer.is_over(),
        }
    }

    /// Whether it has shown the token, or need not: a viewer does so before it is one.
    fn is_authorised(&self) -> bool {
        match self {
            Talk::Lines(session) => session.is_authorised(),
            Talk::Foxglove(_) => true,
        }
    }

    fn last_words(&mut self) -> Option<(Duration, Bytes)> {
        match self {
            Talk::Lines(session) => session.last_words(),
            Talk::Foxglove(_) => None,
        }
    }

    /// Takes a message, step by step, as fast as the client reads the answers.
    async fn take_all(&mut self, message: &Message, hub: &Hub) {
        let Some((bytes, is_text)) = payload(message) else {
            return;
        };
        let client = self.client().clone();
        match self {
            Talk::Lines(session) => {
                let turn = hub.turn(session.is_asking()).await;
                with_read_buffer(|_, scratch| session.message(bytes, now(), scratch));
                drop(turn);
                while session.is_held() {
                    if !session.may_go_on() {
                        client.outbox.answered().await;
                        continue;
                    }
                    yield_now().await;
                    let _turn = hub.turn(session.is_asking()).await;
                    with_read_buffer(|_, scratch| session.go_on(scratch));
                }
            }
            Talk::Foxglove(viewer) => {
                // All it can say are requests.
                yield_now().await;
                let turn = hub.turn(true).await;
                viewer.message(bytes, is_text);
                drop(turn);
                while client.outbox.is_full() {
                    client.outbox.answered().await;
                }
            }
        }
    }
}

/// Payload of a message, and whether it is text.
fn payload(message: &Message) -> Option<(&[u8], bool)> {
    match message {
        Message::Text(text) => Some((text.as_bytes(), true)),
        Message::Binary(bytes) => Some((bytes, false)),
        Message::Ping(_) | Message::Pong(_) | Message::Close(_) => None,
    }
}

/// Everything we say in text is JSON, and so UTF-8.
fn text(line: Bytes) -> Message {
    Message::Text(Utf8Bytes::try_from(line).unwrap_or_default())
}

/// The next item if it is there already.
async fn ready<S: Stream + Unpin>(stream: &mut S) -> Option<S::Item> {
    poll_fn(|cx| match Pin::new(&mut *stream).poll_next(cx) {
        Poll::Ready(item) => Poll::Ready(item),
        Poll::Pending => Poll::Ready(None),
    })
    .await
}

/// The lines of a chunk, without their ends; they share its memory.
fn lines(chunk: &Bytes) -> impl Iterator<Item = Bytes> {
    let mut from = 0;
    memchr_iter(b'\n', chunk).map(move |end| {
        let line = chunk.slice(from..end);
        from = end + 1;
        line
    })
}
