//! Messages of a subject -> a session. I/O.
//!
//! The last token of a message's subject names its sensor, unless its lines do. One session takes them
//! all; what a packed object's number means holds within its message alone.

use super::address::{From, LeaseKey, NatsAddress};
use super::connection::{in_words, keep_connecting};
use super::lease::{Document, Lease, worker_name};
use super::tenure::{LeaseState, LeaseWatch};
use crate::serve::brokers::{MAX_PAYLOAD, lost};
use crate::serve::core::hub::{Complaint, Hub};
use crate::serve::core::outgoing::Outgoing;
use crate::serve::core::read_buffer::{now, with_read_buffer};
use crate::serve::core::session::{Session, Side};
use crate::serve::guard::log_throttle;
use crate::serve::guard::redial::Redial;
use crate::serve::guard::shutdown::Running;
use async_nats::jetstream::consumer::DeliverPolicy;
use async_nats::jetstream::consumer::pull::{Ordered, OrderedConfig};
use async_nats::jetstream::{self, kv};
use async_nats::{Client, Event, Subscriber};
use bytes::Bytes;
use futures_util::StreamExt;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};
use strapd_recording::decode::exact_name;
use strapd_recording::text::printable;
use tokio::task::yield_now;
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

/// Interval at which the state is handed to the lease.
const EVERY: Duration = Duration::from_millis(400);
/// Time that the attitudes of before may take to be stored, so that the state can be.
const PATIENCE: Duration = Duration::from_millis(300);
/// Time in which at most one error is sent back.
const BETWEEN_ERRORS: Duration = Duration::from_secs(1);
/// Suffix of the message's subject to which errors go.
const ERRORS: &str = ".err";

/// Why reading has ended.
enum EndOfReading {
    /// The daemon ends.
    Asked,
    /// Somebody else has the sensors.
    Lost,
    /// Failure for now: it is tried again.
    Failed(String),
}

/// Parts of one subscription.
struct Reader {
    address: NatsAddress,
    outgoing: Arc<Outgoing>,
    hub: Arc<Hub>,
    tenancy: Arc<LeaseWatch>,
    client: Client,
    /// Number of the last message of the stream that was taken.
    sequence: Option<u64>,
    complained: Option<Instant>,
    /// The server of the outputs takes nothing.
    has_waited_in_vain: bool,
}

/// Reads until the daemon ends.
pub(in crate::serve) async fn keep(
    address: NatsAddress,
    outgoing: Arc<Outgoing>,
    (hub, tenancy): (Arc<Hub>, Arc<LeaseWatch>),
    mut running: Running,
) {
    let heard = {
        let (outgoing, peer) = (outgoing.clone(), address.place.to_string());
        move |event: &Event| hear(event, &outgoing, &peer)
    };
    outgoing.attempt();
    let said = |why: &str| {
        lost(&outgoing, why);
        outgoing.attempt();
    };
    let Some(client) = keep_connecting(&address, heard, said, &mut running).await else {
        return;
    };
    let mut reader = Reader {
        sequence: None,
        complained: None,
        has_waited_in_vain: false,
        address,
        outgoing,
        hub,
        tenancy,
        client,
    };
    match reader.address.lease.clone() {
        None => {
            reader.read_on(None, &mut running).await;
        }
        Some(key) => reader.take_turns(&key, &mut running).await,
    }
}

/// Hears an event of the connection.
fn hear(event: &Event, outgoing: &Outgoing, peer: &str) {
    match event {
        Event::Connected => {
            outgoing.connected(peer);
            let name = outgoing.name();
            log_throttle::info(&format!("{name} connected"), &format!("{name}: connected"));
        }
        Event::Disconnected => lost(outgoing, "the connection was lost"),
        Event::SlowConsumer(_) => {
            outgoing.complain("more came than was read; some of it is lost");
        }
        Event::ServerError(_) | Event::ClientError(_) => outgoing.complain(&event.to_string()),
        Event::LameDuckMode | Event::Draining | Event::Closed => {}
    }
}

impl Reader {
    /// Reads while the sensors are ours, and waits while they are somebody else's.
    async fn take_turns(&mut self, key: &LeaseKey, running: &mut Running) {
        let worker = worker_name(&self.hub.session());
        let mut redial = Redial::default();
        self.tenancy.set(LeaseState::None { number: 0 });
        self.outgoing.place(|place| place.is_held = Some(false));
        loop {
            let taken = tokio::select! {
                taken = self.acquire(key, &worker) => taken,
                () = running.asked() => return,
            };
            let (lease, document) = match taken {
                Ok(taken) => taken,
                Err(why) => {
                    lost(&self.outgoing, &why);
                    tokio::select! {
                        () = sleep(redial.failed()) => continue,
                        () = running.asked() => return,
                    }
                }
            };
            redial = Redial::default();
            let lease = Arc::new(lease);
            self.sequence = document.sequence;
            let ids: BTreeSet<String> = document.sensors.keys().cloned().collect();
            log_throttle::info(
                "lease",
                &format!(
                    "{}: {} is ours, {} sensors with it",
                    self.outgoing.name(),
                    key.key,
                    ids.len()
                ),
            );
            self.hub.restore(document.sensors);
            self.outgoing.place(|place| {
                place.is_held = Some(true);
                place.turns += 1;
            });
            let keeping = tokio::spawn(lease.clone().keep(self.tenancy.clone()));
            let ended = self.read_on(Some((&lease, ids)), running).await;
            keeping.abort();
            self.outgoing.place(|place| place.is_held = Some(false));
            if ended {
                lease.release(&self.tenancy).await;
                return;
            }
            self.tenancy.forget();
            self.outgoing
                .complain(&format!("{} is another worker's now", key.key));
        }
    }

    async fn acquire(&self, key: &LeaseKey, worker: &str) -> Result<(Lease, Document), String> {
        let context = jetstream::new(self.client.clone());
        let store = match context.get_key_value(&key.bucket).await {
            Ok(store) => store,
            Err(_) => {
                let config = kv::Config {
                    bucket: key.bucket.clone(),
                    ..kv::Config::default()
                };
                let made = context.create_key_value(config).await;
                made.map_err(|e| in_words(&e))?
            }
        };
        Lease::acquire(store, &key.key, worker, &self.tenancy).await
    }

    /// Reads, and again after what failed, until the daemon ends (`true`) or the lease does.
    async fn read_on(
        &mut self,
        lease: Option<(&Arc<Lease>, BTreeSet<String>)>,
        running: &mut Running,
    ) -> bool {
        let side = Side::broker(self.address.id.clone());
        let mut session = Session::with(&self.hub, self.outgoing.name().to_owned(), side);
        let mut redial = Redial::default();
        let mut ids = BTreeSet::new();
        let lease = lease.map(|(lease, restored)| {
            ids = restored;
            lease.clone()
        });
        let ended = loop {
            let began = Instant::now();
            match self
                .read(&mut session, lease.as_ref(), &mut ids, running)
                .await
            {
                EndOfReading::Asked => break true,
                EndOfReading::Lost => break false,
                EndOfReading::Failed(why) => {
                    if began.elapsed() > Duration::from_secs(5) {
                        redial = Redial::default();
                    }
                    lost(&self.outgoing, &why);
                    tokio::select! {
                        () = sleep(redial.failed()) => {}
                        () = running.asked() => break true,
                    }
                }
            }
        };
        if let (true, Some(lease)) = (ended, &lease) {
            self.checkpoint(&session, lease, &mut ids).await;
        }
        if !ended {
            ids.extend(session.sensors().cloned());
            drop(session);
            self.hub.forget(&ids);
        }
        ended
    }

    async fn read(
        &mut self,
        session: &mut Session,
        lease: Option<&Arc<Lease>>,
        ids: &mut BTreeSet<String>,
        running: &mut Running,
    ) -> EndOfReading {
        let subscribed = tokio::select! {
            subscribed = self.subscribe() => subscribed,
            () = running.asked() => return EndOfReading::Asked,
        };
        let mut messages = match subscribed {
            Ok(messages) => messages,
            Err(why) => return EndOfReading::Failed(why),
        };
        self.outgoing.connected(&self.address.place.to_string());
        let mut tick = interval(EVERY);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut tenure = self.tenancy.changes();
        let tenancy = self.tenancy.clone();
        loop {
            let is_crowded = self.waits() && tenancy.is_crowded();
            let is_lost = async {
                let is_lost =
                    |t: &LeaseState| lease.is_some() && matches!(t, LeaseState::None { .. });
                // Whoever sets it lives as long as we do.
                let _ = tenure.wait_for(is_lost).await.map(|_| ());
            };
            tokio::select! {
                biased;
                () = running.asked() => return EndOfReading::Asked,
                () = is_lost => return EndOfReading::Lost,
                _ = tick.tick(), if lease.is_some() => {
                    if let Some(lease) = lease {
                        self.checkpoint(session, lease, ids).await;
                    }
                }
                has_room = tenancy.has_room(PATIENCE), if is_crowded => {
                    self.has_waited_in_vain = !has_room;
                }
                message = messages.next(), if !is_crowded => match message {
                    Ok(Some(message)) => {
                        self.take(session, &message).await;
                        self.sequence = message.sequence.or(self.sequence);
                        self.outgoing.place(|place| {
                            (place.sequence, place.lag) = (self.sequence, message.lag);
                        });
                    }
                    Ok(None) => return EndOfReading::Failed("the subscription has ended".to_owned()),
                    Err(why) => return EndOfReading::Failed(why),
                },
            }
        }
    }

    /// Whether to wait until the outputs have room. A stream keeps what comes meanwhile; without one, a
    /// server that takes nothing is waited for once.
    fn waits(&mut self) -> bool {
        self.has_waited_in_vain &= self.tenancy.is_crowded();
        self.address.stream.is_some() || !self.has_waited_in_vain
    }

    async fn subscribe(&mut self) -> Result<Messages, String> {
        let subject = self.address.subject.clone();
        let Some(name) = &self.address.stream else {
            let subscriber = self.client.subscribe(subject).await;
            let subscriber = subscriber.map_err(|e| in_words(&e))?;
            return Ok(Messages::Core(subscriber));
        };
        let context = jetstream::new(self.client.clone());
        let stream = context.get_stream(name).await;
        let stream = stream.map_err(|e| format!("stream {name}: {}", in_words(&e)))?;
        let deliver_policy = match (self.sequence, self.address.from) {
            (Some(last), _) => {
                let state = &stream.cached_info().state;
                if state.first_sequence > last + 1 {
                    self.outgoing.complain(&format!(
                        "stream {name} no longer has what follows message {last}: it begins at {}",
                        state.first_sequence
                    ));
                }
                DeliverPolicy::ByStartSequence {
                    start_sequence: last + 1,
                }
            }
            // By its number, so that what comes while we are away, or before the first state is saved, is not missed.
            (None, From::New) => {
                let last = stream.cached_info().state.last_sequence;
                self.sequence = Some(last);
                DeliverPolicy::ByStartSequence {
                    start_sequence: last + 1,
                }
            }
            (None, From::All) => DeliverPolicy::All,
            (None, From::Sequence(start_sequence)) => {
                DeliverPolicy::ByStartSequence { start_sequence }
            }
        };
        let config = OrderedConfig {
            filter_subject: subject,
            deliver_policy,
            ..OrderedConfig::default()
        };
        let consumer = stream.create_consumer(config).await;
        let consumer = consumer.map_err(|e| format!("stream {name}: {}", in_words(&e)))?;
        let messages = consumer.messages().await;
        let messages = messages.map_err(|e| format!("stream {name}: {}", in_words(&e)))?;
        Ok(Messages::Stream(Box::new(messages)))
    }

    /// One message -> samples, step by step.
    async fn take(&mut self, session: &mut Session, message: &Message) {
        // Our own answers.
        if message.subject.ends_with(ERRORS) {
            return;
        }
        if message.payload.len() > MAX_PAYLOAD {
            let what = format!(
                "a payload of {} bytes, at most {MAX_PAYLOAD} are read",
                message.payload.len()
            );
            self.outgoing.complain(&what);
            return;
        }
        let token = message.subject.rsplit('.').next().unwrap_or_default();
        let name = match &self.address.id {
            Some(id) => Ok(id.clone()),
            None => exact_name(token),
        };
        match name {
            Ok(name) => session.of_subject(&name),
            Err(why) => {
                let subject = printable(&message.subject);
                return self.outgoing.complain(&format!("{subject}: {why}"));
            }
        }
        with_read_buffer(|_, scratch| session.message(&message.payload, now(), scratch));
        let mut complaint = None;
        loop {
            let first = session.complaints().into_iter().next();
            complaint = complaint.or(first);
            if !session.is_held() {
                break;
            }
            yield_now().await;
            while self.waits() && self.tenancy.is_crowded() {
                self.has_waited_in_vain = !self.tenancy.has_room(PATIENCE).await;
            }
            with_read_buffer(|_, scratch| session.go_on(scratch));
        }
        if let Some(complaint) = complaint {
            self.answer(message, complaint).await;
        }
    }

    /// Says to who listens what is wrong with the messages of a subject.
    async fn answer(&mut self, message: &Message, complaint: Complaint) {
        let what = complaint.fault.in_words();
        self.outgoing
            .complain(&format!("{}: {what}", printable(&message.subject)));
        if self
            .complained
            .is_some_and(|t| t.elapsed() < BETWEEN_ERRORS)
        {
            return;
        }
        self.complained = Some(Instant::now());
        let subject = format!("{}{ERRORS}", message.subject);
        // Nobody waits for it.
        let _ = timeout(PATIENCE, self.client.publish(subject, complaint.answer)).await;
    }

    /// Hands the state to the lease, once every attitude made of it is stored.
    async fn checkpoint(&self, session: &Session, lease: &Lease, ids: &mut BTreeSet<String>) {
        ids.extend(session.sensors().cloned());
        // Samples that wait for the unit of their stamps are in no state.
        if self.hub.is_anything_waiting() || !self.tenancy.has_published(PATIENCE).await {
            return;
        }
        let mut sensors = self.hub.saved();
        sensors.retain(|id, _| ids.contains(id));
        lease.save(self.sequence, sensors);
    }
}

/// A message, whichever way it came.
struct Message {
    subject: async_nats::Subject,
    payload: Bytes,
    /// Number in the stream.
    sequence: Option<u64>,
    /// Number of further messages in the stream.
    lag: Option<u64>,
}

enum Messages {
    Core(Subscriber),
    Stream(Box<Ordered>),
}

impl Messages {
    async fn next(&mut self) -> Result<Option<Message>, String> {
        match self {
            Messages::Core(subscriber) => Ok(subscriber.next().await.map(|message| Message {
                subject: message.subject,
                payload: message.payload,
                sequence: None,
                lag: None,
            })),
            Messages::Stream(ordered) => match ordered.next().await {
                None => Ok(None),
                Some(Err(why)) => Err(in_words(&why)),
                Some(Ok(message)) => {
                    let info = message.info().map_err(|e| e.to_string())?;
                    let (sequence, lag) = (info.stream_sequence, info.pending);
                    let message = message.message;
                    Ok(Some(Message {
                        subject: message.subject,
                        payload: message.payload,
                        sequence: Some(sequence),
                        lag: Some(lag),
                    }))
                }
            },
        }
    }
}
