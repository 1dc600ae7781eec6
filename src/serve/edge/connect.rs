//! Sources -> sessions: connects out, and again and again. I/O.
//!
//! One task per source. Whatever keeps it from its samples (an unknown name, a refused connection, a
//! peer that goes) is a warning and another attempt, never the end: a sensor that is switched on
//! after the daemon is the normal case. Its lines take the same way as those of a connection that
//! was accepted.

use super::source::{Protocol, Source};
use crate::client::link::{Heard, Link};
use crate::client::remote::Remote;
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
use tokio::time::timeout;

/// Longest message of a WebSocket that is read.
const MAX_MESSAGE: usize = 128 << 10;
/// A connection that stood so long was a good one: the waits begin anew.
const STEADY: Duration = Duration::from_secs(1);
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
    mut link: Link,
    source: &Source,
    outgoing: &Outgoing,
    hub: &Arc<Hub>,
    running: &mut Running,
) -> Option<String> {
    let side = Side::source(source.id.clone(), source.decoder(hub.decode_options()));
    let mut session = Session::with(hub, source.name.clone(), side);
    let mut bytes = Vec::new();
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
                        take(&mut session, &heard, &bytes, outgoing).await;
                    }
                };
                let _ = timeout(hub.limits().drain / 2, rest).await;
                return None;
            }
        };
        let ended = match heard {
            Ok(heard) => {
                take(&mut session, &heard, &bytes, outgoing).await;
                match heard {
                    Heard::Bytes | Heard::Message => None,
                    Heard::Closed(None) => Some("the peer has closed the connection".to_owned()),
                    Heard::Closed(Some(words)) => Some(format!("the peer has closed: {words}")),
                }
            }
            Err(why) if why.kind() == io::ErrorKind::Interrupted => None,
            Err(why) => Some(why.to_string()),
        };
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
