//! Samples by sensor -> attitudes to every client that watches. Pure but for locks; reads no clock.
//!
//! There is no task between: the task that has read a chunk from a socket locks the sensor the
//! samples are of, runs decode -> condition -> propagate -> encode on it, and leaves the bytes in
//! the clients' outboxes. Sensors run side by side on as many cores as there are; within one the
//! order is that of its lock.
//!
//! Long because the way of a run goes through all its locks, sensors and clients, and their order is seen only where it
//! stands together; what needs no lock of both is in the files below.

mod announce;
mod back_pressure;
mod complaints;
mod counters;
mod heading;
mod last_attitude;
mod logging;
mod places;
mod polling;
mod report;
mod resetting;
mod saving;
mod settings;
mod tables;
mod truth;

pub use back_pressure::Flood;
pub use complaints::Complaint;
use complaints::Complaints;
pub use counters::{Counters, count};
pub use places::TICK;
use polling::Polling;
use report::StateStatus;
pub use resetting::Asker;
pub use settings::Settings;
use tables::{ChannelTable, ClientTable, SensorTable, Simulation};

use super::channel::{Channel, Items};
use super::outbox::Outbox;
use super::outgoing::Outgoing;
use super::reading::{LineParameters, Reading};
use super::recorder::Handle;
use super::stream::run::{OrderedBy, SampleRun};
use super::stream::stamps::TimedSamples;
use super::stream::{Fate, SensorStream, live_plan};
use crate::error::{Error, Result};
use crate::serve::guard::admission::Token;
use crate::serve::guard::fault::{Fault, Kind};
use crate::serve::guard::limits::Limits;
use crate::serve::guard::log_throttle;
use crate::serve::guard::losses::{Losses, Lost};
use crate::serve::guard::peer::Peer;
use crate::serve::guard::places::Guest;
use crate::serve::protocol::chunk::Chunk;
use crate::serve::protocol::foxglove;
use crate::serve::protocol::wire;
use crate::sink::{Profile, Transforms};
use bytes::Bytes;
use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Instant;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::packed::Form;
use strapd_recording::decode::{self, LineDecoder, exact_name};
use strapd_recording::text::printable;

/// The middle of the daemon.
#[derive(Debug)]
pub struct Hub {
    sensors: SensorTable,
    clients: ClientTable,
    channels: ChannelTable,
    simulation: Simulation,
    reading: Arc<Reading>,
    lines: LineParameters,
    decode_options: decode::Options,
    limits: Limits,
    token: Option<Token>,
    recorder: Option<Handle>,
    outgoing: Vec<Arc<Outgoing>>,
    session: String,
    started: Instant,
    stopping: AtomicBool,
    /// Outcome of saving attitudes the last time; `None` when they are not saved.
    state: Mutex<Option<StateStatus>>,
    polling: Polling,
    /// Streams of which nothing is used.
    pub(in crate::serve) losses: Losses,
    /// Counters.
    pub counters: Counters,
}

/// A sensor and the client it comes from.
#[derive(Debug)]
pub struct Sensor {
    stream: SensorStream,
    /// Only one may send a sensor's samples at a time: two gyros in one attitude are no attitude.
    owner: Option<u64>,
    /// Connection that measures its heading from outside.
    heading_by: Option<u64>,
    /// Number, among all that was heard of sensors, of its last.
    heard: u64,
    /// Tick at which that was.
    heard_at: u64,
    /// Another one has its place.
    gave_way: bool,
}

/// Protocol of a client: what it is told, and how.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ClientProtocol {
    /// Lines.
    Lines(Profile),
    /// A message of ROS 2 for each attitude.
    #[cfg(feature = "zenoh")]
    Messages,
    /// Messages of the Foxglove protocol.
    Foxglove {
        /// Whether it can move a playback.
        controls: bool,
    },
}

/// One connection.
#[derive(Debug)]
pub struct Client {
    /// Number.
    pub number: u64,
    /// Peer.
    pub peer: Peer,
    /// Outbox: what waits for it.
    pub outbox: Outbox,
    /// Protocol: what it is told, and how.
    shape: ClientProtocol,
    since: Instant,
    /// Number of sensors that it sends.
    sensors: AtomicUsize,
    /// Whether it speaks for many: as many as there may be are its share.
    is_broker: AtomicBool,
    complaints: Complaints,
}

/// Answers to a sender about its samples.
#[derive(Clone, Debug, Default)]
pub struct Feedback {
    /// Notice that is no fault: a new run has begun.
    pub note: Option<Fault>,
    /// Faults of what was not used, the first time.
    pub faults: Vec<Fault>,
    /// Fault and count where none of the samples was used.
    pub lost: Option<(Fault, u64)>,
}

impl Guest for Client {
    fn is_watching(&self) -> bool {
        self.outbox.level().watching
    }
}

impl Client {
    /// Whether it is told things as Foxglove's viewers are.
    fn is_viewer(&self) -> bool {
        matches!(self.shape, ClientProtocol::Foxglove { .. })
    }

    /// Marks it as speaking for many: as many sensors as there may be are its share.
    pub fn speaks_for_many(&self) {
        self.is_broker.store(true, Ordering::Relaxed);
    }

    /// Counts a sensor less that it sends.
    pub fn let_go(&self) {
        self.sensors.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Number of these that are of the gyro.
#[must_use]
pub fn rates_in(samples: &[RawSample]) -> usize {
    samples.iter().filter(|s| !s.is_beside).count()
}

impl Hub {
    /// Makes one with nobody connected.
    ///
    /// # Errors
    /// [`Error::Usage`] when the plan is none for live streams.
    pub fn new(settings: Settings) -> Result<Hub> {
        let plan = live_plan(&settings.plan).map_err(Error::usage)?;
        let plans = settings
            .plans
            .iter()
            .map(|(id, plan)| {
                let live = live_plan(plan).map_err(|what| {
                    Error::usage(what.at(format_args!("sensor {}", printable(id))))
                })?;
                let name =
                    exact_name(id).map_err(|why| Error::usage(format!("[sensor.ID]: {why}")))?;
                Ok((name, live))
            })
            .collect::<Result<_>>()?;
        // No secret: it only tells a reader that the daemon was restarted.
        let session = RandomState::new().hash_one(std::process::id()) as u32;
        Ok(Hub {
            sensors: SensorTable::new(plan, plans, settings.saved),
            clients: ClientTable::default(),
            channels: ChannelTable {
                frames: settings.frames,
                ..ChannelTable::default()
            },
            simulation: Simulation {
                timeline: settings.timeline,
                brings_samples: settings.brings_samples,
                truths: Mutex::default(),
            },
            reading: Arc::new(Reading::new(&settings.decode, &settings.lines)),
            lines: settings.lines,
            decode_options: settings.decode,
            limits: settings.limits,
            token: settings.token,
            recorder: settings.recorder,
            outgoing: Vec::new(),
            session: format!("{session:08x}"),
            started: Instant::now(),
            stopping: AtomicBool::new(false),
            state: Mutex::default(),
            polling: Polling::default(),
            losses: Losses::default(),
            counters: Counters::default(),
        })
    }

    /// Connects to these for samples.
    #[must_use]
    pub fn fed_by(self, outgoing: Vec<Arc<Outgoing>>) -> Hub {
        Hub { outgoing, ..self }
    }

    /// The bounds.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The token clients must show, if there is one.
    #[must_use]
    pub fn token(&self) -> Option<&Token> {
        self.token.as_ref()
    }

    /// Decoder of the lines.
    #[must_use]
    pub fn decoder(&self) -> &LineDecoder {
        self.reading.decoder()
    }

    /// Way in which lines are read where their address says nothing else.
    #[must_use]
    pub(in crate::serve) fn reading(&self) -> &Arc<Reading> {
        &self.reading
    }

    /// Parameters of lines where their address says nothing else.
    #[must_use]
    pub(in crate::serve) fn lines(&self) -> &LineParameters {
        &self.lines
    }

    /// Whether the daemon was told the unit of rates.
    #[must_use]
    pub(in crate::serve) fn states_gyro_unit(&self) -> bool {
        self.sensors.plan_of("").states_gyro_unit()
    }

    /// Options by which lines are read.
    #[must_use]
    pub fn decode_options(&self) -> &decode::Options {
        &self.decode_options
    }

    /// The sources it connects to.
    #[must_use]
    pub fn outgoing(&self) -> &[Arc<Outgoing>] {
        &self.outgoing
    }

    /// Names this run of the daemon; a replay that begins anew gets another name.
    #[must_use]
    pub fn session(&self) -> String {
        match self.simulation.timeline.as_ref().map_or(0, |t| t.run()) {
            0 => self.session.clone(),
            run => format!("{}.{run}", self.session),
        }
    }

    /// Begins to shut down.
    pub fn stop(&self) {
        self.stopping.store(true, Ordering::Relaxed);
    }

    /// Whether it is shutting down.
    #[must_use]
    pub fn is_stopping(&self) -> bool {
        self.stopping.load(Ordering::Relaxed)
    }

    /// Somebody has connected.
    pub fn join(&self, peer: impl Into<Peer>) -> Arc<Client> {
        self.join_as(peer, ClientProtocol::Lines(Profile::Lines))
    }

    /// Joins as [`Hub::join`], for somebody who is told things in another way. A viewer is told at once who
    /// we are and what there is.
    pub fn join_as(&self, peer: impl Into<Peer>, shape: ClientProtocol) -> Arc<Client> {
        let outbox = match shape {
            ClientProtocol::Lines(Profile::Lines) => Outbox::new(),
            ClientProtocol::Lines(Profile::PlotJuggler | Profile::Records) => {
                Outbox::saying(|_, _| Bytes::new())
            }
            #[cfg(feature = "zenoh")]
            ClientProtocol::Messages => Outbox::saying(|_, _| Bytes::new()),
            ClientProtocol::Foxglove { .. } => Outbox::saying(foxglove::gap),
        }
        .telling(self.clients.room_made.clone());
        let channels = read(&self.channels.by_number);
        let info = match shape {
            ClientProtocol::Foxglove { controls } => Some((controls, self.server_info(controls))),
            _ => None,
        };
        if let Some((controls, info)) = &info {
            outbox.reply(info.clone());
            outbox.reply(foxglove::channels(
                channels.values().flat_map(|c| c.topics()),
                self.channels.frames.transforms != Transforms::None,
            ));
            if let Some(place) = self.where_it_is().filter(|_| *controls) {
                outbox.reply(foxglove::playback_state(&place, false, ""));
            }
        }
        let client = Arc::new(Client {
            number: self.clients.last.fetch_add(1, Ordering::Relaxed) + 1,
            peer: peer.into(),
            outbox,
            shape,
            since: Instant::now(),
            sensors: AtomicUsize::new(0),
            is_broker: AtomicBool::new(false),
            complaints: Complaints::default(),
        });
        write(&self.clients.by_number).insert(client.number, client.clone());
        // From here on it is told what changes; of what changed meanwhile it was not.
        if let Some((controls, info)) = info {
            let now = self.server_info(controls);
            if now != info {
                client.outbox.reply(now);
            }
        }
        client
    }

    /// Removes a client that has gone; its sensors may be sent by others.
    pub fn leave(&self, client: &Client, owned: &[Arc<Mutex<Sensor>>]) {
        write(&self.clients.by_number).remove(&client.number);
        if client.outbox.level().watching {
            self.watch_changed();
        }
        self.give_back(client, owned);
    }

    /// Lets others send its sensors and the truth.
    pub fn give_back(&self, client: &Client, owned: &[Arc<Mutex<Sensor>>]) {
        self.give_truth_back(client);
        for sensor in owned {
            let mut sensor = lock(sensor);
            if sensor.owner == Some(client.number) {
                // Nothing follows that would tell more.
                self.take_overdue(&mut sensor);
            }
        }
        // All at once, so that who looks for a place meanwhile sees all of them left, or none.
        let _sensors = read(&self.sensors.by_id);
        for sensor in owned {
            let mut sensor = lock(sensor);
            if sensor.owner == Some(client.number) {
                sensor.owner = None;
            }
        }
    }

    /// Somebody started or stopped watching.
    pub fn watch_changed(&self) {
        // The list is made under its own lock, so that the last one made is the newest.
        let mut watchers = write(&self.clients.watchers);
        *watchers = read(&self.clients.by_number)
            .values()
            .filter(|c| c.outbox.level().watching)
            .cloned()
            .collect();
    }

    /// Number of connected clients.
    #[must_use]
    pub fn connected(&self) -> usize {
        read(&self.clients.by_number).len()
    }

    /// Takes samples of a sensor and gives its attitudes to whoever watches. What the sender should
    /// hear of them comes back; `text` is room for encoding.
    ///
    /// # Errors
    /// The fault to answer with; none of the samples was used.
    pub fn publish(
        &self,
        sensor: &Mutex<Sensor>,
        run: &SampleRun<'_>,
        text: &mut Vec<u8>,
    ) -> std::result::Result<Feedback, Fault> {
        let mut sensor = lock(sensor);
        let id = sensor.stream.id().clone();
        let refuse = |code, kind, what: &str| Fault {
            id: Some(id.to_string()),
            kind,
            ..Fault::new(code, what)
        };
        if sensor.gave_way {
            return Err(refuse(
                "gave_way",
                Kind::GaveWay,
                "its place has just gone to another sensor; its next sample asks for one",
            ));
        }
        match sensor.owner {
            Some(owner) if owner != run.client && !self.is_left(&sensor) => {
                // Who prints lines and reads none would never hear of it.
                log_throttle::warn(
                    &format!("in use {id}"),
                    &format!(
                        "{id}: another connection sends samples of this id, too, and they are refused: give it an id of its own"
                    ),
                );
                return Err(refuse(
                    "id_in_use",
                    Kind::InUse,
                    "another connection sends the samples of this sensor; give this one an `id` of its own",
                ));
            }
            Some(owner) if owner == run.client => {}
            _ => {
                sensor.owner = Some(run.client);
                sensor.stream.meet();
            }
        }
        sensor.heard = self.sensors.heard.fetch_add(1, Ordering::Relaxed);
        sensor.heard_at = self.sensors.tick.load(Ordering::Relaxed);
        let anew = sensor.stream.understand(self.sensors.plan_of(&id), run)?;
        count(&self.counters.samples, rates_in(run.samples));
        let taken = sensor.stream.stamped(run);
        let (lines, samples) = match &taken {
            None => (run.lines, run.samples),
            Some(taken) => (&*taken.lines, &*taken.samples),
        };
        if sensor.stream.is_waiting() {
            self.sensors.stamps_wait.store(true, Ordering::Relaxed);
        }
        let place = (run.placed, run.first);
        let feedback = self.integrate(&mut sensor, lines, samples, place, text)?;
        let note = anew.or(feedback.note);
        Ok(Feedback { note, ..feedback })
    }

    /// Samples whose stamps are known -> attitudes.
    fn integrate(
        &self,
        sensor: &mut Sensor,
        lines: &[(Option<u64>, usize)],
        samples: &[RawSample],
        (placed, first): (OrderedBy, (u64, &[u8])),
        text: &mut Vec<u8>,
    ) -> std::result::Result<Feedback, Fault> {
        let id = &sensor.stream.id().clone();
        let plan = self.sensors.plan_of(id);
        let window = self.limits.state_window;
        let note = sensor.stream.join(plan, samples, window, placed)?;
        let mut rest = samples;
        let mut from = 0;
        for (seq, end) in lines {
            let (now, later) = rest.split_at(end.saturating_sub(from).min(rest.len()));
            sensor.stream.take(plan, *seq, now);
            (rest, from) = (later, *end);
        }
        if let Some(recorder) = &self.recorder
            && !samples.is_empty()
        {
            let rates = samples.iter().filter(|s| !s.is_beside);
            recorder.input(id, rates.copied().collect());
        }
        self.deliver(sensor, id, text);
        let lost = self.judge(sensor, id, first);
        let faults = sensor.stream.news();
        logging::log_doubts(&mut sensor.stream, plan, &faults);
        Ok(Feedback { note, faults, lost })
    }

    /// Whether samples of a sensor are used, for the log. `first`: the number and beginning of their line.
    fn judge(&self, sensor: &mut Sensor, id: &str, first: (u64, &[u8])) -> Option<(Fault, u64)> {
        match sensor.stream.fate() {
            Fate::Open => None,
            Fate::Used => {
                self.losses.over(id);
                None
            }
            Fate::Lost(fault, count) => {
                self.losses.add(&Lost {
                    source: id,
                    fault: &fault,
                    first,
                    count,
                    is_whole: !sensor.stream.has_attitudes(),
                });
                Some((fault, count))
            }
        }
    }

    /// Samples that wait for the unit of their stamps are taken by what is known.
    fn take_overdue(&self, sensor: &mut Sensor) {
        if !sensor.stream.is_waiting() {
            return;
        }
        let id = sensor.stream.id().clone();
        let TimedSamples { lines, samples } = sensor.stream.overdue();
        let stands = (OrderedBy::ByStamp, (0, &[][..]));
        let feedback = self.integrate(sensor, &lines, &samples, stands, &mut Vec::new());
        let (note, faults) = match feedback {
            Ok(feedback) => (feedback.note, feedback.faults),
            Err(fault) => (None, vec![fault]),
        };
        let clients = read(&self.clients.by_number);
        let owner = sensor.owner.and_then(|owner| clients.get(&owner));
        for fault in note.iter().chain(&faults) {
            log_throttle::info(&format!("run {id}"), &format!("{id}: {}", fault.message));
        }
        let Some(owner) = owner else { return };
        for said in note.iter().map(wire::note) {
            owner.outbox.reply(said);
        }
        for fault in &faults {
            owner.complain(fault, (0, &[]), 0);
        }
    }

    /// Ends waits. To be called again and again: nobody waits for long for the unit of a stamp
    /// ([`stream::stamps::LONGEST_WAIT`](super::stream::stamps::LONGEST_WAIT)).
    pub fn end_waits(&self, now: Nanos) {
        if !self.sensors.stamps_wait.swap(false, Ordering::Relaxed) {
            return;
        }
        let sensors: Vec<_> = read(&self.sensors.by_id).values().cloned().collect();
        for sensor in sensors {
            let mut sensor = lock(&sensor);
            if sensor.stream.is_overdue(now) {
                self.take_overdue(&mut sensor);
            }
            if sensor.stream.is_waiting() {
                self.sensors.stamps_wait.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Whether samples of any sensor wait for the unit of their stamps.
    #[cfg(feature = "nats")]
    #[must_use]
    pub fn is_anything_waiting(&self) -> bool {
        self.sensors.stamps_wait.load(Ordering::Relaxed)
    }

    /// A line that could not be read stood among the samples of this sensor.
    pub fn undecodable(&self, sensor: &Mutex<Sensor>, client: u64) {
        let mut sensor = lock(sensor);
        if sensor.owner == Some(client) {
            sensor.stream.take_undecodable();
        }
    }

    /// Attitudes that are ready -> outboxes.
    fn deliver(&self, sensor: &mut Sensor, id: &Arc<str>, text: &mut Vec<u8>) {
        let (first_seq, attitudes, channel) = sensor.stream.attitudes();
        if attitudes.is_empty() {
            return;
        }
        self.distribute(channel, first_seq, Items::Attitudes(attitudes), text);
        if let Some(recorder) = &self.recorder {
            recorder.attitude(id, first_seq, attitudes.to_vec());
        }
        sensor.stream.trim();
    }

    /// Items of a channel, from number `first_seq` on -> outboxes; `text` is room for encoding.
    pub fn distribute(
        &self,
        channel: &Channel,
        first_seq: u64,
        items: Items<'_>,
        text: &mut Vec<u8>,
    ) {
        // Encoded when the first asks, and shared by all.
        let mut encoded: [Option<Vec<Chunk>>; 4] = [None, None, None, None];
        // Locked to the end: who comes late finds all of these in it, or is among the watchers.
        let mut last = channel.last();
        let before = last.map(|(_, sample)| sample.stamp);
        let watchers = self.watchers();
        let now = std::cell::LazyCell::new(|| self.where_it_is().and_then(|place| place.at));
        for client in &*watchers {
            let profile = match client.shape {
                ClientProtocol::Lines(profile) => profile,
                #[cfg(feature = "zenoh")]
                ClientProtocol::Messages => {
                    if let Items::Attitudes(attitudes) = items {
                        client.outbox.offer(
                            channel.id(),
                            attitudes,
                            &mut |_| channel.messages(first_seq, attitudes),
                            &|_, kept| channel.last_message(kept),
                            first_seq,
                        );
                    }
                    continue;
                }
                ClientProtocol::Foxglove { .. } => {
                    client.outbox.offer_frames(
                        |wanted| {
                            let of = |channel| wanted.get(&channel).copied();
                            channel.frames(of, first_seq, items, self.clock(), before)
                        },
                        *now,
                    );
                    continue;
                }
            };
            let [lines, plot, records, packed] = &mut encoded;
            let mut shared = |form| {
                let kept = match (form, profile) {
                    (Form::Packed, _) => &mut *packed,
                    (Form::Lines, Profile::Lines) => &mut *lines,
                    (Form::Lines, Profile::PlotJuggler) => &mut *plot,
                    (Form::Lines, Profile::Records) => &mut *records,
                };
                kept.get_or_insert_with(|| channel.chunks(form, profile, first_seq, items, text))
                    .clone()
            };
            match items {
                Items::Attitudes(attitudes) => client.outbox.offer(
                    channel.id(),
                    attitudes,
                    &mut shared,
                    &|form, kept| channel.thinned(form, profile, kept),
                    first_seq,
                ),
                Items::Samples(_) => client.outbox.offer_samples(channel.id(), &mut shared),
            }
        }
        channel.passed(&mut last, first_seq, items);
        if matches!(items, Items::Attitudes(_)) {
            count(&self.counters.attitudes, items.count());
        }
    }

    /// Ends the recording's file and goes on in a new one; `false` when there is no recording.
    pub fn reopen_recording(&self) -> bool {
        if let Some(recorder) = &self.recorder {
            recorder.reopen();
        }
        self.recorder.is_some()
    }
}

// Nothing that is locked here is left half changed by a panic elsewhere.

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn read<T>(lock: &RwLock<T>) -> std::sync::RwLockReadGuard<'_, T> {
    lock.read().unwrap_or_else(PoisonError::into_inner)
}

fn write<T>(lock: &RwLock<T>) -> std::sync::RwLockWriteGuard<'_, T> {
    lock.write().unwrap_or_else(PoisonError::into_inner)
}
