//! Sources -> sessions: connects out, and again and again. I/O.
//!
//! One task per source. Whatever keeps it from its samples (an unknown name, a refused connection, a
//! peer that goes) is a warning and another attempt, never the end: a sensor that is switched on
//! after the daemon is the normal case. Its lines take the same way as those of a connection that
//! was accepted.

use super::source::{Protocol, Source};
use crate::client::link::{Heard, Link};
use crate::client::remote::Remote;
use crate::client::serial::{Legibility, PortLoad, SerialPlace};
use crate::serve::core::hub::{Flood, Hub};
use crate::serve::core::outgoing::Outgoing;
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::{End, Session, Side};
use crate::serve::guard::log_throttle;
use crate::serve::guard::redial::Redial;
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::upstream::Event;
use futures_util::FutureExt;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::task::yield_now;
use tokio::time::{sleep, timeout};

/// Longest message of a WebSocket that is read.
const MAX_MESSAGE: usize = 128 << 10;
/// A connection that stood so long was a good one: the waits begin anew.
const STEADY: Duration = Duration::from_secs(1);
/// Time after which it is judged whether the bytes of a serial port can be read.
const LEGIBLE: Duration = Duration::from_secs(2);
/// Asks a daemon for its samples: a simulation has some.
const RATES: &str = r#"{"class":"WATCH","streams":["RATE"],"packed":true}"#;
/// Asks a daemon that has none for its attitudes.
/// The last one of each is no sample.
const ATTITUDES: &str = r#"{"class":"WATCH","streams":["ATT"],"last":false,"packed":true}"#;

/// Stays connected until the daemon ends.
pub(in crate::serve) async fn keep(
    source: Source,
    outgoing: Arc<Outgoing>,
    hub: Arc<Hub>,
    mut running: Running,
) {
    let name = &source.name;
    // The token of a stream goes in its first line instead.
    let token = source.token.as_ref().map(|t| t.reveal());
    let mut redial = Redial::default();
    loop {
        outgoing.attempt();
        let connecting = Link::connect(&source.remote, token, MAX_MESSAGE);
        let connected = tokio::select! {
            connected = connecting => connected,
            () = running.asked() => return,
        };
        let why = match connected {
            Ok(link) => {
                let began = Instant::now();
                outgoing.connected(link.peer());
                log_throttle::info(&format!("{name} connected"), &format!("{name}: connected"));
                let Some(why) = converse(link, &source, &outgoing, &hub, &mut running).await else {
                    return;
                };
                if began.elapsed() >= STEADY {
                    redial = Redial::default();
                }
                why
            }
            Err(why) => why,
        };
        outgoing.lost(&why);
        log_throttle::warn(
            &format!("{name} lost"),
            &format!("{name}: {why}; trying again until it is there"),
        );
        tokio::select! {
            () = tokio::time::sleep(redial.failed()) => {}
            () = running.asked() => return,
        }
    }
}

/// Listens to one connection. Returns why it ended, `None` when the daemon ends.
async fn converse(
    link: Link,
    source: &Source,
    outgoing: &Outgoing,
    hub: &Arc<Hub>,
    running: &mut Running,
) -> Option<String> {
    let side = Side::source(source.id.clone(), source.decoder(hub.decode_options()));
    let reading = source.reading(hub.decode_options(), hub.lines());
    let mut talk = Talk {
        link,
        source,
        outgoing,
        hub,
        session: Session::with(hub, source.name.clone(), side).reading(Arc::new(reading)),
        bytes: Vec::new(),
        asked: source.protocol == Protocol::Strapd,
        asked_again: false,
        flood: Flood::default(),
        legibility: serial(source).map(|_| Legibility::default()),
        load: PortLoad::default(),
    };
    talk.go_on(running).await.err()
}

/// Conversation with a peer.
struct Talk<'c> {
    link: Link,
    source: &'c Source,
    outgoing: &'c Outgoing,
    hub: &'c Arc<Hub>,
    session: Session,
    /// Bytes heard last.
    bytes: Vec<u8>,
    /// Whether samples were asked for, and attitudes because it has none.
    asked: bool,
    asked_again: bool,
    flood: Flood,
    /// Bytes of a serial port, until it is known whether they can be read.
    legibility: Option<Legibility>,
    /// Bytes of a serial port against its rate.
    load: PortLoad,
}

impl Talk<'_> {
    /// Converses until the daemon ends.
    ///
    /// # Errors
    /// Why it ended before.
    async fn go_on(&mut self, running: &mut Running) -> Result<(), String> {
        self.introduce().await?;
        let judged = sleep(LEGIBLE);
        tokio::pin!(judged);
        loop {
            let heard = tokio::select! {
                heard = next(&mut self.link, &mut self.bytes, &mut self.flood) => heard,
                () = &mut judged, if self.legibility.is_some() => {
                    self.judge_bytes();
                    continue;
                }
                () = running.asked() => {
                    self.last_read().await;
                    return Ok(());
                }
            };
            let ended = self.hear(heard).await;
            self.answer().await?;
            match self.session.end() {
                Some(End::TooManyErrors | End::NoTable) if self.unreadable().is_some() => {
                    return Err(self.unreadable().unwrap_or_default());
                }
                Some(End::TooManyErrors) => return Err("too many bad lines in a row".to_owned()),
                Some(End::Unauthorised) => return Err("unauthorised".to_owned()),
                Some(End::NoObject) => return Err("it speaks something else".to_owned()),
                Some(End::NoTable) => {
                    return Err("its lines are neither objects nor rows of a table".to_owned());
                }
                None => {}
            }
            if let Some(why) = ended {
                return Err(why);
            }
            self.flood.wait(self.hub).await;
        }
    }

    /// Reports a serial port of which nothing came, or nothing that can be read.
    fn judge_bytes(&mut self) {
        let (Some(seen), Some(place)) = (self.legibility.take(), serial(self.source)) else {
            return;
        };
        // What is no text is read by its frames, which say so themselves.
        let has_lines = self.source.lines.protocol.is_lines();
        if seen.is_text() || (!has_lines && seen.bytes() > 0) {
            return;
        }
        let what = match seen.bytes() {
            0 => "connected, and nothing came in 2 s: does the board send?".to_owned(),
            bytes => place.unreadable(bytes),
        };
        self.outgoing.complain_of("bytes", &what);
    }

    /// Words for a serial port whose bytes are no text.
    fn unreadable(&self) -> Option<String> {
        let has_lines = self.source.lines.protocol.is_lines();
        let seen = self.legibility.as_ref();
        let seen = seen.filter(|seen| has_lines && !seen.is_text())?;
        Some(serial(self.source)?.unreadable(seen.bytes()))
    }

    async fn say(&mut self, line: &str) -> Result<(), String> {
        self.link.send(line).await.map_err(|why| why.to_string())
    }

    /// Shows the token, where the connection itself has not, and asks for samples.
    async fn introduce(&mut self) -> Result<(), String> {
        let is_web = matches!(self.source.remote, Remote::WebSocket { .. });
        if let (Some(token), false) = (&self.source.token, is_web) {
            let line = serde_json::json!({"class": "AUTH", "token": token.reveal()}).to_string();
            self.say(&line).await?;
        }
        if self.asked {
            self.say(RATES).await?;
        }
        Ok(())
    }

    /// Takes what was heard. Returns why nothing more comes.
    async fn hear(&mut self, heard: io::Result<Heard>) -> Option<String> {
        match heard {
            Ok(heard) => {
                if let Some(seen) = &mut self.legibility {
                    seen.take(&self.bytes);
                }
                if let Some(place) = serial(self.source)
                    && let Some(what) = self.load.take(place, self.bytes.len(), Instant::now())
                {
                    self.outgoing.complain_of("baud", &what);
                }
                take(&mut self.session, &heard, &self.bytes, self.outgoing).await;
                match heard {
                    Heard::Bytes | Heard::Message => None,
                    Heard::Closed(None) => Some("the peer has closed the connection".to_owned()),
                    Heard::Closed(Some(words)) => Some(format!("the peer has closed: {words}")),
                }
            }
            Err(why) if why.kind() == io::ErrorKind::Interrupted => None,
            Err(why) => Some(why.to_string()),
        }
    }

    /// The daemon ends: what has arrived is still taken.
    async fn last_read(&mut self) {
        let drain = self.hub.limits().drain;
        let rest = async {
            while let Some(Ok(heard @ (Heard::Bytes | Heard::Message))) =
                self.link.read(&mut self.bytes).now_or_never()
            {
                take(&mut self.session, &heard, &self.bytes, self.outgoing).await;
            }
        };
        let _ = timeout(drain / 2, rest).await;
    }

    /// Answers what the peer says about itself and about what it was asked for.
    async fn answer(&mut self) -> Result<(), String> {
        for event in self.session.events() {
            match event {
                Event::Greeted(run) if run == self.hub.session() => {
                    return Err("is this daemon itself".to_owned());
                }
                Event::Greeted(_) => {
                    let is_open = self.source.protocol == Protocol::Auto;
                    if is_open && !std::mem::replace(&mut self.asked, true) {
                        self.say(RATES).await?;
                    }
                }
                Event::Complained(what)
                    if self.asked && !self.asked_again && what.starts_with("bad_watch") =>
                {
                    self.asked_again = true;
                    self.say(ATTITUDES).await?;
                }
                Event::Complained(what) => self.outgoing.complain(&what),
                Event::Dropped(n) => {
                    let what = format!("we were too slow for {n} of its attitudes");
                    self.outgoing.complain(&what);
                }
            }
        }
        Ok(())
    }
}

/// The port of a source that is one.
fn serial(source: &Source) -> Option<&SerialPlace> {
    match &source.remote {
        Remote::Serial(place) => Some(place),
        _ => None,
    }
}

/// Returns what is heard next: what is there already, or what comes.
async fn next(link: &mut Link, bytes: &mut Vec<u8>, flood: &mut Flood) -> io::Result<Heard> {
    let there = link.read(bytes).now_or_never();
    flood.message(there.is_some(), bytes.len());
    match there {
        Some(heard) => heard,
        None => link.read(bytes).await,
    }
}

/// Takes what was heard, step by step; what a client would be told of it is for our own log.
async fn take(session: &mut Session, heard: &Heard, bytes: &[u8], outgoing: &Outgoing) {
    with_read_buffer(|_, scratch| match heard {
        Heard::Bytes => session.bytes(bytes, now(), scratch),
        Heard::Message => session.message(bytes, now(), scratch),
        Heard::Closed(_) => session.finish(now(), scratch),
    });
    loop {
        for complaint in session.complaints() {
            outgoing.complain(&complaint.fault.in_words());
        }
        if !session.is_held() {
            return;
        }
        yield_now().await;
        with_read_buffer(|_, scratch| session.go_on(scratch));
    }
}
