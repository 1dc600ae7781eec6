//! Sources -> sessions: connects out, and again and again. I/O.
//!
//! One task per source. Whatever keeps it from its samples (an unknown name, a refused connection, a
//! peer that goes) is a warning and another attempt, never the end: a sensor that is switched on
//! after the daemon is the normal case. Its lines take the same way as those of a connection that
//! was accepted.

use super::hub::{Flood, Hub};
use super::listen::{in_room, now};
use super::log_throttle;
use super::outgoing::Outgoing;
use super::session::{End, Session, Side};
use super::shutdown::Running;
use super::source::{Protocol, Source};
use super::upstream::Event;
use crate::client::link::{Heard, Link};
use crate::client::remote::Remote;
use bytes::Bytes;
use futures_util::FutureExt;
use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::task::yield_now;
use tokio::time::timeout;

/// Longest message of a WebSocket that is read.
const MAX_MESSAGE: usize = 128 << 10;
/// The first wait before another attempt.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// The longest.
const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// A connection that stood so long was a good one: the waits begin anew.
const STEADY: Duration = Duration::from_secs(1);
/// Asks a daemon for its samples: a simulation has some.
const RATES: &str = r#"{"class":"WATCH","streams":["RATE"],"packed":true}"#;
/// Asks a daemon that has none for its attitudes.
/// The last one of each is no sample.
const ATTITUDES: &str = r#"{"class":"WATCH","streams":["ATT"],"last":false,"packed":true}"#;

/// Wait before another attempt: ever longer, and never in step with others who lost the
/// same peer at the same time.
#[derive(Debug, Default)]
pub(super) struct Redial {
    failures: u32,
    chance: RandomState,
}

impl Redial {
    pub(super) fn failed(&mut self) -> Duration {
        let whole = FIRST_WAIT * (1 << self.failures.min(6));
        let part = self.chance.hash_one(self.failures) % 512;
        self.failures = self.failures.saturating_add(1);
        // Between three and five quarters.
        let wait = whole.min(LONGEST_WAIT) * (768 + part as u32) / 1024;
        wait.min(LONGEST_WAIT)
    }
}

/// Stays connected until the daemon ends.
pub(super) async fn keep(
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
                    redial.failures = 0;
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
    mut link: Link,
    source: &Source,
    outgoing: &Outgoing,
    hub: &Arc<Hub>,
    running: &mut Running,
) -> Option<String> {
    let side = Side::source(source.id.clone(), source.decoder(hub.decode_options()));
    let mut session = Session::with(hub, source.name.clone(), side);
    let mut bytes = Vec::new();
    let mut said = VecDeque::new();
    let mut asked = source.protocol == Protocol::Strapd;
    let mut asked_again = false;
    let is_web = matches!(source.remote, Remote::WebSocket { .. });
    let mut flood = Flood::default();
    let mut first = Vec::new();
    if let (Some(token), false) = (&source.token, is_web) {
        first.push(serde_json::json!({"class": "AUTH", "token": token.reveal()}).to_string());
    }
    if asked {
        first.push(RATES.to_owned());
    }
    for line in first {
        if let Err(why) = link.send(&line).await {
            return Some(why.to_string());
        }
    }
    loop {
        let next = async {
            let there = link.read(&mut bytes).now_or_never();
            flood.message(there.is_some(), bytes.len());
            match there {
                Some(heard) => heard,
                None => link.read(&mut bytes).await,
            }
        };
        let heard = tokio::select! {
            heard = next => heard,
            () = running.asked() => {
                // What has arrived is still taken.
                let rest = async {
                    while let Some(Ok(heard @ (Heard::Bytes | Heard::Message))) =
                        link.read(&mut bytes).now_or_never()
                    {
                        take(&mut session, &heard, &bytes, &mut said).await;
                    }
                };
                let _ = timeout(hub.limits().drain / 2, rest).await;
                return None;
            }
        };
        let ended = match heard {
            Ok(heard) => {
                take(&mut session, &heard, &bytes, &mut said).await;
                match heard {
                    Heard::Bytes | Heard::Message => None,
                    Heard::Closed(None) => Some("the peer has closed the connection".to_owned()),
                    Heard::Closed(Some(words)) => Some(format!("the peer has closed: {words}")),
                }
            }
            Err(why) if why.kind() == io::ErrorKind::Interrupted => None,
            Err(why) => Some(why.to_string()),
        };
        // What a client would be told is for our own log.
        for line in said.drain(..) {
            if let Some(Event::Complained(what)) = super::upstream::read(&line) {
                outgoing.complain(&what);
            }
        }
        for event in session.events() {
            match event {
                Event::Greeted(run) if run == hub.session() => {
                    return Some("is this daemon itself".to_owned());
                }
                Event::Greeted(_) => {
                    if source.protocol == Protocol::Auto
                        && !std::mem::replace(&mut asked, true)
                        && let Err(why) = link.send(RATES).await
                    {
                        return Some(why.to_string());
                    }
                }
                Event::Complained(what)
                    if asked && !asked_again && what.starts_with("bad_watch") =>
                {
                    asked_again = true;
                    if let Err(why) = link.send(ATTITUDES).await {
                        return Some(why.to_string());
                    }
                }
                Event::Complained(what) => outgoing.complain(&what),
                Event::Dropped(n) => {
                    outgoing.complain(&format!("we were too slow for {n} of its attitudes"));
                }
            }
        }
        match session.end() {
            Some(End::TooManyErrors) => return Some("too many bad lines in a row".to_owned()),
            Some(End::Unauthorised) => return Some("unauthorised".to_owned()),
            Some(End::NoObject) => return Some("it speaks something else".to_owned()),
            None => {}
        }
        if ended.is_some() {
            return ended;
        }
        flood.wait(hub).await;
    }
}

/// Takes what was heard, step by step; `said`: what a client would be told of it.
async fn take(session: &mut Session, heard: &Heard, bytes: &[u8], said: &mut VecDeque<Bytes>) {
    in_room(|_, scratch| match heard {
        Heard::Bytes => session.bytes(bytes, now(), scratch),
        Heard::Message => session.message(bytes, now(), scratch),
        Heard::Closed(_) => session.finish(now(), scratch),
    });
    loop {
        session.client().outbox.discard(said);
        if !session.is_held() {
            return;
        }
        yield_now().await;
        in_room(|_, scratch| session.go_on(scratch));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attempts_come_ever_later_and_at_least_every_five_seconds() {
        let mut redial = Redial::default();
        let waits: Vec<f64> = (0..100).map(|_| redial.failed().as_secs_f64()).collect();
        for (n, wait) in waits.iter().enumerate() {
            let whole = (0.1 * 2f64.powi(n.min(6) as i32)).min(5.0);
            // A nanosecond for what a Duration rounds.
            assert!(
                (0.75 * whole - 1e-9..=1.25 * whole).contains(wait),
                "{n}: {wait}"
            );
            assert!(*wait <= 5.0);
        }
        assert!(waits.windows(2).skip(10).any(|w| w[0] != w[1]), "no jitter");
        let mut other = Redial::default();
        let others: Vec<f64> = (0..100).map(|_| other.failed().as_secs_f64()).collect();
        assert_ne!(waits, others, "two of them in step");
        redial.failures = 0;
        assert!(redial.failed() < Duration::from_millis(130));
    }
}
