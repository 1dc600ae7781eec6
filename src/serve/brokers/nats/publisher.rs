//! An outbox -> messages, each sensor under its own subject. I/O.

use super::address::NatsAddress;
use super::connection::{in_words, keep_connecting};
use super::tenure::{LeaseState, LeaseWatch};
use crate::serve::brokers::{Batch, TAKE, gathered, warn};
use crate::serve::core::context::Context;
use crate::serve::core::hub::{Client as Watcher, ClientProtocol, Hub, count};
use crate::serve::guard::shutdown::Running;
use crate::serve::protocol::filter::Filter;
use async_nats::connection::State;
use async_nats::jetstream::context::{Context as JetStream, PublishErrorKind};
use async_nats::jetstream::message::PublishMessage;
use async_nats::jetstream::stream::LastRawMessageErrorKind;
use async_nats::jetstream::{self};
use async_nats::{Client, Event};
use bytes::{Bytes, BytesMut};
use futures_util::future::join_all;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::time::{sleep, timeout};

/// Time that a server may take for them.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two attempts to store what could not be.
const AGAIN: Duration = Duration::from_millis(100);
/// Most sensors whose last message is remembered; what is forgotten is looked up again.
const MOST: usize = 200_000;
/// Interval of looking whether attitudes may leave.
const LOOK: Duration = Duration::from_millis(5);

/// Publishes every attitude until the daemon ends.
pub(in crate::serve) async fn send(
    address: NatsAddress,
    context: Context,
    tenancy: Arc<LeaseWatch>,
) {
    let Context {
        hub, mut running, ..
    } = context;
    let watcher = hub.join_as(
        address.name.clone(),
        ClientProtocol::Lines(Default::default()),
    );
    tenancy.add(&watcher);
    hub.watch(&watcher, Some(Filter::default()));
    let name = address.name.clone();
    // What a server refuses it says here alone: who may not publish there, first of all.
    let heard = move |event: &Event| match event {
        Event::Disconnected => warn(&name, "the connection was lost"),
        Event::ServerError(_) | Event::ClientError(_) => warn(&name, &event.to_string()),
        _ => {}
    };
    let said = |why: &str| warn(&address.name, why);
    let Some(client) = keep_connecting(&address, heard, said, &mut running).await else {
        return hub.leave(&watcher, &[]);
    };
    let mut publisher = Publisher {
        jetstream: address
            .stream
            .is_some()
            .then(|| jetstream::new(client.clone())),
        lasts: BTreeMap::new(),
        number: 0,
        client,
        address,
        hub: hub.clone(),
        tenancy,
    };
    publisher.run(&watcher, &mut running).await;
    let _ = timeout(PATIENCE, publisher.client.flush()).await;
    hub.leave(&watcher, &[]);
}

struct Publisher {
    address: NatsAddress,
    client: Client,
    jetstream: Option<JetStream>,
    hub: Arc<Hub>,
    tenancy: Arc<LeaseWatch>,
    /// Number of the tenure to which `lasts` belongs.
    number: u64,
    /// The last message of each subject, as far as it is known.
    lasts: BTreeMap<Arc<str>, Stored>,
}

/// Message stored under a subject.
#[derive(Clone, Copy, Debug, Default)]
struct Stored {
    /// Number of the message in its stream.
    sequence: u64,
    /// The last attitude in it.
    last: Option<Place>,
}

/// Place of an attitude of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
struct Place {
    seq: u64,
    stamp: Stamp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
struct Stamp {
    sec: i64,
    nsec: i64,
}

impl Place {
    fn of(line: &[u8]) -> Option<Place> {
        serde_json::from_slice(line).ok()
    }

    /// Whether an attitude at this place is stored already, where `last` is.
    fn is_behind(self, last: Place) -> bool {
        self.seq <= last.seq && self.stamp <= last.stamp
    }
}

fn lines(bytes: &[u8]) -> impl DoubleEndedIterator<Item = &[u8]> {
    bytes.split(|b| *b == b'\n').filter(|line| !line.is_empty())
}

impl Publisher {
    async fn run(&mut self, watcher: &Watcher, running: &mut Running) {
        let (mut asked, mut chunks) = (None, Vec::new());
        loop {
            let bytes = watcher.outbox.take_chunks(TAKE, &mut chunks);
            if chunks.is_empty() {
                if asked == Some(true) {
                    return;
                }
                tokio::select! {
                    () = watcher.outbox.filled() => {}
                    () = running.asked_further(asked.is_some()) => {
                        asked = Some(asked.is_some());
                        running.has_read();
                    }
                }
                continue;
            }
            let batches = gathered(std::mem::take(&mut chunks));
            // A daemon that ends waits no longer than its limit for us.
            self.publish(batches).await;
            watcher.outbox.written(bytes);
        }
    }

    /// Publishes while that is permitted; what belongs to a tenure that is over is dropped.
    async fn publish(&mut self, mut batches: Vec<Batch>) {
        let number = self.tenancy.now().number();
        if number != self.number || self.lasts.len() > MOST {
            self.number = number;
            self.lasts.clear();
        }
        while !batches.is_empty() {
            let tenure = self.tenancy.now();
            if tenure.number() != number || matches!(tenure, LeaseState::None { .. }) {
                return;
            }
            let is_there = self.client.connection_state() == State::Connected;
            if !is_there || !tenure.permits(Instant::now()) {
                sleep(LOOK).await;
                continue;
            }
            let outcome = match self.jetstream.clone() {
                None => self.send(&batches).await.map(|()| Vec::new()),
                Some(jetstream) => self.store(&jetstream, batches.clone()).await,
            };
            batches = match outcome {
                Ok(left) => left,
                Err(why) => {
                    warn(&self.address.name, &why);
                    batches
                }
            };
            if !batches.is_empty() {
                sleep(AGAIN).await;
            }
        }
    }

    /// Sends by core NATS: who listens gets them, once at most.
    async fn send(&self, batches: &[Batch]) -> Result<(), String> {
        for (id, bytes) in batches {
            let subject = self.address.subject_of(id);
            let sent = self.client.publish(subject, bytes.clone()).await;
            sent.map_err(|e| in_words(&e))?;
            count(&self.hub.counters.bytes_out, bytes.len());
        }
        let flushed = timeout(PATIENCE, self.client.flush()).await;
        flushed
            .map_err(|_| "the server takes nothing".to_owned())?
            .map_err(|e| in_words(&e))
    }

    /// Into a stream: each on what is known to be the last of its subject. Those that were not stored come
    /// back.
    async fn store(
        &mut self,
        jetstream: &JetStream,
        batches: Vec<Batch>,
    ) -> Result<Vec<Batch>, String> {
        let name = self.address.stream.clone().unwrap_or_default();
        let mut wanted = Vec::with_capacity(batches.len());
        for (id, bytes) in batches {
            let stored = match self.lasts.get(&id) {
                Some(stored) => *stored,
                None => {
                    let found = self.stored(jetstream, &name, &id).await?;
                    self.lasts.insert(id.clone(), found);
                    found
                }
            };
            let bytes = match stored.last {
                Some(last) => unstored(&bytes, last),
                None => bytes,
            };
            if !bytes.is_empty() {
                wanted.push((id, bytes, stored.sequence));
            }
        }
        let all = wanted.into_iter().map(|(id, bytes, sequence)| {
            let place = lines(&bytes).next_back().and_then(Place::of);
            let mut message = PublishMessage::build()
                .payload(bytes.clone())
                .expected_stream(&name)
                .expected_last_subject_sequence(sequence);
            if let Some(Place { stamp, .. }) = place {
                message = message.message_id(format!("{id}-{}.{:09}", stamp.sec, stamp.nsec));
            }
            let subject = self.address.subject_of(&id);
            async move {
                let answer = async { jetstream.send_publish(subject, message).await?.await };
                (id, bytes, place, timeout(PATIENCE, answer).await)
            }
        });
        let (mut left, mut failure) = (Vec::new(), None);
        for (id, bytes, last, answer) in join_all(all).await {
            match answer {
                Ok(Ok(ack)) => {
                    count(&self.hub.counters.bytes_out, bytes.len());
                    let sequence = ack.sequence;
                    self.lasts.insert(id, Stored { sequence, last });
                }
                failed => {
                    // Stored by another worker, or by us and the answer was lost: looked up.
                    self.lasts.remove(&id);
                    match failed {
                        Ok(Err(e)) if e.kind() == PublishErrorKind::WrongLastSequence => {}
                        Ok(Err(e)) => failure = Some(in_words(&e)),
                        _ => failure = Some("no answer".to_owned()),
                    }
                    left.push((id, bytes));
                }
            }
        }
        if let Some(why) = failure {
            warn(&self.address.name, &why);
        }
        Ok(left)
    }

    /// Reads what is stored under the subject of a sensor.
    async fn stored(&self, jetstream: &JetStream, name: &str, id: &str) -> Result<Stored, String> {
        let stream = jetstream.get_stream_no_info(name).await;
        let stream = stream.map_err(|e| format!("stream {name}: {}", in_words(&e)))?;
        let subject = self.address.subject_of(id);
        match stream.get_last_raw_message_by_subject(&subject).await {
            Ok(message) => Ok(Stored {
                sequence: message.sequence,
                last: lines(&message.payload).next_back().and_then(Place::of),
            }),
            Err(e) if e.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(Stored::default()),
            Err(e) => Err(format!("stream {name}: {}", in_words(&e))),
        }
    }
}

/// The attitudes that are not among those stored up to `last`.
fn unstored(bytes: &Bytes, last: Place) -> Bytes {
    let is_new = |line: &&[u8]| Place::of(line).is_none_or(|place| !place.is_behind(last));
    // Seldom: after another worker, or an answer that was lost.
    match lines(bytes).next() {
        Some(first) if is_new(&first) => bytes.clone(),
        _ => {
            let mut kept = BytesMut::new();
            for line in lines(bytes).filter(is_new) {
                kept.extend_from_slice(line);
                kept.extend_from_slice(b"\n");
            }
            kept.freeze()
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn line(seq: u64, sec: i64) -> String {
        format!(
            "{{\"class\":\"ATT\",\"id\":\"a\",\"seq\":{seq},\"stamp\":{{\"sec\":{sec},\"nsec\":5}},\"q\":[1,0,0,0]}}\n"
        )
    }

    #[test]
    fn only_what_is_not_stored_is_published_and_a_new_run_is_new() {
        let last = Place::of(line(7, 70).as_bytes()).unwrap();
        let of = |places: &[(u64, i64)]| -> Bytes {
            let text: String = places.iter().map(|(seq, sec)| line(*seq, *sec)).collect();
            text.into()
        };
        assert_eq!(
            unstored(&of(&[(6, 60), (7, 70), (8, 80)]), last),
            of(&[(8, 80)])
        );
        assert_eq!(
            unstored(&of(&[(8, 80), (9, 90)]), last),
            of(&[(8, 80), (9, 90)])
        );
        assert_eq!(unstored(&of(&[(5, 50)]), last), of(&[]));
        // Counted anew, at later times; and the clock was set back.
        for other in [of(&[(0, 71), (1, 72)]), of(&[(8, 1), (9, 2)])] {
            assert_eq!(unstored(&other, last), other);
        }
    }
}
