//! A source that is connected to, and how the connection stands. Locks.

use crate::serve::guard::log_throttle;
use std::fmt::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A source and how it stands.
#[derive(Debug)]
pub struct Outgoing {
    /// Address, for people.
    name: String,
    /// Id of its sensor here, if one was given.
    id: Option<String>,
    /// Whether it is a router, of whose keys `STATUS` tells.
    #[cfg(feature = "zenoh")]
    is_router: bool,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// Peer that answered, while connected.
    peer: Option<String>,
    /// Time at which it was connected or lost.
    since: Instant,
    attempts: u64,
    connections: u64,
    last_error: Option<String>,
    #[cfg(feature = "nats")]
    stream: StreamPlace,
    #[cfg(feature = "zenoh")]
    keys: KeysSeen,
}

/// Place up to which a stream of a broker has been read, and whether we may read it.
#[cfg(feature = "nats")]
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::serve) struct StreamPlace {
    /// Number of the last message that was taken.
    pub(in crate::serve) sequence: Option<u64>,
    /// Number of messages behind that.
    pub(in crate::serve) lag: Option<u64>,
    /// Whether the partition is ours, where there is a lease of it.
    pub(in crate::serve) is_held: Option<bool>,
    /// Number of times it has become ours.
    pub(in crate::serve) turns: u64,
}

/// Keys met at a router.
#[cfg(feature = "zenoh")]
#[derive(Clone, Debug, Default)]
struct KeysSeen {
    /// The publishers of ROS 2 that say they are there, by their tokens.
    topics: std::collections::BTreeMap<String, TopicSeen>,
    /// Messages that gave way to later ones.
    lost: u64,
    /// Messages that were too long.
    refused: u64,
    /// Lines of the log about publishers in a minute, and when that began.
    said: (Option<Instant>, u32),
}

/// A publisher of a topic of ROS 2.
#[cfg(feature = "zenoh")]
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub(in crate::serve) struct TopicSeen {
    /// The topic.
    pub(in crate::serve) topic: String,
    /// Node to which it belongs.
    pub(in crate::serve) node: String,
    /// Domain.
    pub(in crate::serve) domain: String,
}

/// Most publishers that are remembered.
#[cfg(feature = "zenoh")]
const MOST_TOPICS: usize = 10_000;
/// Lines of the log about them in a minute.
#[cfg(feature = "zenoh")]
const MOST_TOPIC_LINES: u32 = 32;
#[cfg(feature = "zenoh")]
const MINUTE: std::time::Duration = std::time::Duration::from_secs(60);

impl Outgoing {
    /// Not yet connected.
    #[must_use]
    pub fn new(name: &str, id: Option<&str>) -> Outgoing {
        Outgoing {
            name: name.to_owned(),
            id: id.map(str::to_owned),
            #[cfg(feature = "zenoh")]
            is_router: false,
            state: Mutex::new(State {
                peer: None,
                since: Instant::now(),
                attempts: 0,
                connections: 0,
                last_error: None,
                #[cfg(feature = "nats")]
                stream: StreamPlace::default(),
                #[cfg(feature = "zenoh")]
                keys: KeysSeen::default(),
            }),
        }
    }

    /// Makes it a router of zenoh.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn of_router(self) -> Outgoing {
        Outgoing {
            is_router: true,
            ..self
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // A State is whole after every statement.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// State for `STATUS`.
    #[must_use]
    pub fn status(&self) -> serde_json::Value {
        let state = self.state();
        #[cfg(not(feature = "nats"))]
        let stream = serde_json::Value::Null;
        #[cfg(feature = "nats")]
        let stream = serde_json::json!({
            "sequence": state.stream.sequence, "lag": state.stream.lag,
            "held": state.stream.is_held, "turns": state.stream.turns,
        });
        let status = serde_json::json!({
            "uri": self.name(), "id": self.id,
            "connected": state.peer.is_some(), "peer": state.peer,
            "since_s": state.since.elapsed().as_secs_f64(),
            "attempts": state.attempts, "connections": state.connections,
            "last_error": state.last_error, "stream": stream,
        });
        #[cfg(feature = "zenoh")]
        let mut status = status;
        #[cfg(feature = "zenoh")]
        if self.is_router
            && let Some(fields) = status.as_object_mut()
        {
            let topics: Vec<_> = state.keys.topics.values().collect();
            let seen = serde_json::json!({
                "topics": topics, "lost": state.keys.lost, "refused": state.keys.refused,
            });
            fields.insert("zenoh".to_owned(), seen);
        }
        status
    }

    /// Address, for people.
    pub(in crate::serve) fn name(&self) -> &str {
        &self.name
    }

    /// Changes the place up to which it has been read.
    #[cfg(feature = "nats")]
    pub(in crate::serve) fn place(&self, change: impl FnOnce(&mut StreamPlace)) {
        change(&mut self.state().stream);
    }

    /// A publisher is there (`Some`), or has gone. `false`: that was known.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn topic(&self, token: &str, seen: Option<TopicSeen>) -> bool {
        let topics = &mut self.state().keys.topics;
        match seen {
            None => topics.remove(token).is_some(),
            Some(seen) if topics.len() < MOST_TOPICS => {
                topics.insert(token.to_owned(), seen).is_none()
            }
            Some(_) => false,
        }
    }

    /// Whether another line of the log about one of them may be written: some in a minute.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn may_say_topic(&self, now: Instant) -> bool {
        let (minute, lines) = &mut self.state().keys.said;
        if minute.is_none_or(|begun| now.saturating_duration_since(begun) >= MINUTE) {
            (*minute, *lines) = (Some(now), 0);
        }
        *lines = lines.saturating_add(1);
        *lines <= MOST_TOPIC_LINES
    }

    /// Nothing is known of who is there.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn forget_topics(&self) {
        self.state().keys.topics.clear();
    }

    /// Messages gave way to later ones, as `what` says.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn lost_messages(&self, count: u64, what: &str) {
        self.state().keys.lost += count;
        self.complain_of("lost messages", what);
    }

    /// A message was too long, as `what` says.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn refused_message(&self, what: &str) {
        self.state().keys.refused += 1;
        self.complain_of("too long", what);
    }

    /// Another attempt begins.
    pub(in crate::serve) fn attempt(&self) {
        self.state().attempts += 1;
    }

    /// Notes that this peer has answered.
    pub(in crate::serve) fn connected(&self, peer: &str) {
        let mut state = self.state();
        state.peer = Some(peer.to_owned());
        state.since = Instant::now();
        state.connections += 1;
    }

    /// Not connected, for this reason.
    pub(in crate::serve) fn lost(&self, why: &str) {
        let mut state = self.state();
        if state.peer.take().is_some() {
            state.since = Instant::now();
        }
        state.last_error = Some(why.to_owned());
    }

    /// Something is wrong with what comes; the connection lives.
    pub(in crate::serve) fn complain(&self, what: &str) {
        self.complain_of("says", what);
    }

    /// The same of a cause that others are not to hide.
    pub(in crate::serve) fn complain_of(&self, cause: &str, what: &str) {
        self.state().last_error = Some(what.to_owned());
        let name = self.name();
        log_throttle::warn(&format!("{name} {cause}"), &format!("{name}: {what}"));
    }
}

/// The metrics of the sources, as Prometheus text.
pub(in crate::serve) fn exposition(out: &mut String, all: &[Arc<Outgoing>]) {
    /// Name, kind, help, and the value of one source.
    type Family = (&'static str, &'static str, &'static str, fn(&State) -> u64);
    let families: &[Family] = &[
        (
            "outgoing_connected",
            "gauge",
            "Whether a source is connected.",
            |s| u64::from(s.peer.is_some()),
        ),
        (
            "outgoing_attempts_total",
            "counter",
            "Attempts to connect to a source.",
            |s| s.attempts,
        ),
        (
            "outgoing_connections_total",
            "counter",
            "Connections made to a source.",
            |s| s.connections,
        ),
        #[cfg(feature = "zenoh")]
        (
            "outgoing_lost_messages_total",
            "counter",
            "Messages of a source that gave way to later ones before they were read.",
            |s| s.keys.lost,
        ),
        #[cfg(feature = "zenoh")]
        (
            "outgoing_refused_messages_total",
            "counter",
            "Messages of a source that were too long.",
            |s| s.keys.refused,
        ),
        #[cfg(feature = "zenoh")]
        (
            "outgoing_topics",
            "gauge",
            "Publishers of ROS 2 that say they are there.",
            |s| s.keys.topics.len() as u64,
        ),
    ];
    if all.is_empty() {
        return;
    }
    for (name, kind, help, value) in families {
        // A String takes every write.
        let _ = write!(
            out,
            "# HELP strapd_{name} {help}\n# TYPE strapd_{name} {kind}\n"
        );
        for outgoing in all {
            let uri = outgoing.name().replace('\\', "\\\\").replace('"', "\\\"");
            let _ = writeln!(
                out,
                "strapd_{name}{{uri=\"{uri}\"}} {}",
                value(&outgoing.state())
            );
        }
    }
}
