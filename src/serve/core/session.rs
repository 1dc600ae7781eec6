//! One client's bytes -> samples to the hub, answers to its outbox. Sans-I/O.
//!
//! Apart from the transports because a conversation is the same over all of them, and apart from
//! the hub because it remembers what only matters to one client: which sensor it sent last, how
//! many lines in a row were bad, whether it has shown the token.

#[cfg(feature = "zenoh")]
mod decoded;
mod losing;
mod opening;
mod resetting;
mod turn;
mod unpacking;

use super::hub::{Client, Feedback, Hub, count};
use super::owned::Owned;
use super::stream::run::{Placed, SampleRun};
use crate::serve::guard::fault::Fault;
use crate::serve::guard::limits::Allowance;
use crate::serve::guard::log_throttle;
use crate::serve::guard::losses::Lost;
use crate::serve::guard::peer::Peer;
use crate::serve::protocol::upstream::{self, Event};
use crate::serve::protocol::wire::{self, Message};
use bytes::Bytes;
use opening::Opening;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::framing::Framer;
use strapd_recording::decode::{Bare, Line, LineDecoder};
use strapd_recording::text::MAX_NEAR;
use turn::{Held, Step};

/// Errors said at once before they are thinned.
const BURST: u32 = 64;
/// Unknown classes remembered, so that each is said once.
const MAX_TOLD: usize = 32;

/// Room for the work on one chunk of bytes; one per thread, so that an idle client holds none.
#[derive(Debug, Default)]
pub struct Scratch {
    samples: Vec<RawSample>,
    /// Stamps that are bare numbers, at their places.
    bare: Vec<Option<Bare>>,
    lines: Vec<(Option<u64>, usize)>,
    head: Option<Line>,
    /// The number of the run's first line, and its beginning.
    first: (u64, Vec<u8>),
    text: Vec<u8>,
}

/// Why a conversation was ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// Too many bad lines in a row.
    TooManyErrors,
    /// Absent or wrong token.
    Unauthorised,
    /// Beginning that is no object: somebody who speaks something else.
    NoObject,
}

impl End {
    /// Reason in words, for the log.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            End::TooManyErrors => "too many bad lines in a row",
            End::Unauthorised => "it has not shown the token",
            End::NoObject => "it did not begin with an object",
        }
    }

    /// Says in the log that somebody speaks something else, for whoever wonders where its samples are.
    pub(in crate::serve) fn warn_of(self, peer: &str) {
        if self == End::NoObject {
            log_throttle::warn(
                "no object",
                &format!(
                    "{peer} did not begin with a JSON object and was closed; samples by HTTP go to POST /samples at a ws-listen:// address"
                ),
            );
        }
    }
}

/// Side that has connected, and what follows from it.
#[derive(Debug)]
pub enum Side {
    /// A client of ours, who need not show a token when trusted.
    Client {
        /// Whether it has shown the token, or need not.
        trusted: bool,
    },
    /// Sender that is told nothing: what it asks for is passed over.
    Deaf {
        /// Whether it is trusted.
        trusted: bool,
    },
    /// A source we connected to: nobody who asks anything of us.
    Source(Box<Naming>),
}

/// Naming: how the lines of a source are read and its sensor is called.
#[derive(Debug)]
pub struct Naming {
    id: Option<String>,
    /// Name of a sensor that does not state one: the subject of its message does.
    subject: Option<String>,
    decoder: Option<LineDecoder>,
    /// Name in the lines of the sensor that is called `id` here, or that has no other name.
    called: Option<Origin>,
    events: Vec<Event>,
}

/// A sensor by what its lines say: `id`, and which of a device's sensors.
type Origin = (Option<String>, Option<String>);

impl Side {
    /// A source whose sensor is called `id` whatever it calls itself, and whose lines `decoder` reads
    /// where that is not the one of everybody.
    #[must_use]
    pub fn source(id: Option<String>, decoder: Option<LineDecoder>) -> Side {
        Side::Source(Box::new(Naming {
            id,
            subject: None,
            decoder,
            called: None,
            events: Vec::new(),
        }))
    }
}

impl Side {
    /// Whether it speaks for many sensors.
    fn is_broker(&self) -> bool {
        matches!(self, Side::Source(naming) if naming.subject.is_some())
    }

    /// A broker, whose messages are of many sensors, or all of the one that is called `id` here.
    #[cfg(any(test, feature = "nats", feature = "zenoh"))]
    #[must_use]
    pub fn broker(id: Option<String>) -> Side {
        let mut side = Side::source(id, None);
        if let Side::Source(naming) = &mut side {
            naming.subject = Some(String::new());
        }
        side
    }
}

impl Naming {
    /// Gives a line's sensor its name here. What comes beside the gyro belongs to it (`is_beside`).
    fn name(&mut self, head: &mut Line, is_beside: bool) -> Result<(), Fault> {
        if self.id.is_none() && head.id.is_some() {
            return Ok(());
        }
        if let Some(subject) = &self.subject {
            head.id = Some(self.id.as_ref().unwrap_or(subject).clone());
            return Ok(());
        }
        let mut origin = (head.id.clone(), head.sensor.clone());
        let called = if is_beside {
            origin.1 = self.called.as_ref().and_then(|called| called.1.clone());
            self.called.as_ref().unwrap_or(&origin)
        } else {
            self.called.get_or_insert_with(|| origin.clone())
        };
        if *called != origin {
            let name = |(id, sensor): &Origin| {
                id.clone()
                    .or(sensor.clone())
                    .unwrap_or_else(|| "one without a name".to_owned())
            };
            return Err(Fault::new(
                "several_sensors",
                format!(
                    "the source sends several sensors ({} and {}), which must not be mixed; leave ?id= away where they have ids of their own, or ask for one of them",
                    name(called),
                    name(&origin)
                ),
            ));
        }
        if self.id.is_some() {
            head.id.clone_from(&self.id);
        }
        Ok(())
    }
}

/// One conversation.
#[derive(Debug)]
pub struct Session {
    hub: Arc<Hub>,
    client: Arc<Client>,
    framer: Framer,
    side: Side,
    authorised: bool,
    /// Whether its pages are our own.
    is_own_page: bool,
    opening: Opening,
    errors_in_a_row: u32,
    errors: Allowance,
    told: BTreeSet<String>,
    /// Some of its samples were taken.
    has_sent: bool,
    /// The sensors it sends.
    owned: Owned,
    /// Meaning of packed samples by number, as lines would state it.
    bound: BTreeMap<u32, Result<Line, Box<Fault>>>,
    step: Step,
    /// Bytes that wait for the next step.
    held: Option<Held>,
    /// Words it is told at the end, after a while.
    last_words: Option<(Duration, Bytes)>,
    end: Option<End>,
}

impl Session {
    /// Somebody has connected, who need not show a token when `trusted`. Greets.
    #[must_use]
    pub fn new(hub: &Arc<Hub>, peer: impl Into<Peer>, trusted: bool) -> Session {
        Session::with(hub, peer, Side::Client { trusted })
    }

    /// Begins with somebody who has connected, or to whom we have. Greets.
    #[must_use]
    pub fn with(hub: &Arc<Hub>, peer: impl Into<Peer>, side: Side) -> Session {
        let client = hub.join(peer);
        if side.is_broker() {
            client.speaks_for_many();
        }
        client.outbox.reply(wire::version(&hub.session()));
        let (authorised, opening) = match side {
            Side::Client { trusted } => (trusted || hub.token().is_none(), Opening::Blank),
            // A datagram stands alone, and whom to listen to otherwise was chosen here.
            Side::Deaf { trusted } => (trusted || hub.token().is_none(), Opening::Over),
            Side::Source(_) => (true, Opening::Over),
        };
        if let Some(place) = hub.place().filter(|_| authorised) {
            client.outbox.reply(place);
        }
        Session {
            authorised,
            is_own_page: false,
            opening,
            side,
            hub: hub.clone(),
            client,
            framer: Framer::new(),
            errors_in_a_row: 0,
            errors: Allowance::new(BURST),
            told: BTreeSet::new(),
            has_sent: false,
            owned: Owned::default(),
            bound: BTreeMap::new(),
            step: Step::default(),
            held: None,
            last_words: None,
            end: None,
        }
    }

    /// The client, with its outbox.
    #[must_use]
    pub fn client(&self) -> &Arc<Client> {
        &self.client
    }

    /// The hub.
    #[must_use]
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// Lets others send its sensors: nothing more comes of it.
    pub fn give_back(&mut self) {
        self.owned.give_back(&self.hub, &self.client);
    }

    /// Names the sensor of what comes next, where it does not; no number of a packed stream is bound.
    #[cfg(any(test, feature = "nats", feature = "zenoh"))]
    pub fn of_subject(&mut self, id: &str) {
        self.bound.clear();
        if let Side::Source(naming) = &mut self.side
            && let Some(subject) = &mut naming.subject
        {
            id.clone_into(subject);
        }
    }

    /// The sensors it has sent.
    #[cfg(feature = "nats")]
    pub fn sensors(&self) -> impl Iterator<Item = &String> {
        self.owned.ids()
    }

    /// The sensor that the subject names, for packed samples whose number is not bound.
    fn head_of_subject(&self) -> Option<Line> {
        Some(Line {
            id: Some(self.subject()?),
            ..Line::default()
        })
    }

    /// Whether it has shown the token, or need not.
    #[must_use]
    pub fn is_authorised(&self) -> bool {
        self.authorised
    }

    /// Words still to be sent to it, and how long to wait before.
    pub fn last_words(&mut self) -> Option<(Duration, Bytes)> {
        self.last_words.take()
    }

    /// Whether a first line has come.
    #[must_use]
    pub fn has_spoken(&self) -> bool {
        self.opening == Opening::Over
    }

    /// Events that a source has reported of itself since this was called last.
    pub fn events(&mut self) -> Vec<Event> {
        match &mut self.side {
            Side::Source(naming) => std::mem::take(&mut naming.events),
            Side::Client { .. } | Side::Deaf { .. } => Vec::new(),
        }
    }

    /// Why it is over, if it is. What waits in the outbox may still be sent.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.end
    }

    fn line(&mut self, number: u64, line: &[u8], received: Nanos, scratch: &mut Scratch) {
        let before = scratch.samples.len();
        let (decoder, is_source) = match &self.side {
            Side::Source(naming) => (naming.decoder.as_ref().unwrap_or(self.hub.decoder()), true),
            Side::Client { .. } | Side::Deaf { .. } => (self.hub.decoder(), false),
        };
        let mut read = wire::read_from(decoder, line, received, is_source, &mut scratch.samples);
        if let Side::Source(naming) = &mut self.side {
            match &mut read {
                Ok(Message::Samples(head)) => {
                    let new = scratch.samples.get(before..).unwrap_or_default();
                    if let Err(fault) = naming.name(head, wire::are_beside(new)) {
                        count(
                            &self.hub.counters.refused_samples,
                            scratch.samples.len() - before,
                        );
                        scratch.samples.truncate(before);
                        self.say(&fault, number, line);
                        self.lose(&fault, number, line);
                        return;
                    }
                }
                // Of one that may not be mixed with another each sample is refused.
                Ok(Message::Packed(stream, head)) => {
                    let (stream, mut head) = (*stream, std::mem::take(head));
                    let named = naming.name(&mut head, false);
                    let head = named.map(|()| head).map_err(Box::new);
                    return self.bind_or_say(stream, head, (number, line), received, scratch);
                }
                // What a daemon says of itself; nobody there asks anything of us.
                Ok(_)
                | Err(Fault {
                    code: "unknown_class",
                    ..
                }) => {
                    if naming.events.len() < MAX_TOLD {
                        naming.events.extend(upstream::read(line));
                    }
                    return;
                }
                Err(_) => {}
            }
        }
        self.step.asked |= matches!(
            read,
            Ok(Message::Watch(_)
                | Message::Poll
                | Message::Reset(_)
                | Message::Playback(_)
                | Message::Auth(_))
        );
        if !self.has_spoken() {
            if matches!(&read, Err(fault) if fault.code == "bad_json") {
                return self.refuse_opening(number, line);
            }
            self.opening = Opening::Over;
        }
        match read {
            Ok(Message::Auth(token)) => self.authorise(&token, number),
            Ok(_) | Err(_) if !self.authorised => {
                scratch.samples.truncate(before);
                self.refuse(&first_line_must_be_auth(), number);
            }
            Ok(Message::Samples(_) | Message::Reference(_)) if !self.hub.takes_samples() => {
                self.not_taken(number, line, before, received, scratch);
            }
            Ok(Message::Samples(mut head)) => {
                self.errors_in_a_row = 0;
                let seq = head.seq;
                let bare = std::mem::take(&mut head.bare);
                if !goes_on(scratch, &head) {
                    self.flush(received, scratch, before);
                    scratch.begin(head, number, line);
                }
                if !bare.is_empty() {
                    let first = scratch.lines.last().map_or(0, |(_, end)| *end);
                    scratch.bare.resize(first, None);
                    scratch.bare.extend(bare);
                }
                scratch.lines.push((seq, scratch.samples.len()));
            }
            Ok(Message::Packed(stream, head)) => {
                self.bind_or_say(stream, Ok(head), (number, line), received, scratch);
            }
            Ok(Message::Watch(_) | Message::Poll) if matches!(self.side, Side::Deaf { .. }) => {
                self.errors_in_a_row = 0;
            }
            Ok(Message::Watch(filter)) => {
                self.errors_in_a_row = 0;
                self.flush(received, scratch, usize::MAX);
                let offered = self.hub.classes();
                let absent = filter.iter().flat_map(|f| &f.classes).flatten();
                if let Some(class) = absent.copied().find(|c| !offered.contains(c)) {
                    let fault = Fault::new(
                        "bad_watch",
                        format!("there is no stream `{}` here; there is: ATT", class.name()),
                    );
                    return self.bad(&fault, number, line, received, scratch);
                }
                // The answer comes before the first attitude.
                let answer = wire::watching(filter.as_ref(), &offered);
                self.client.outbox.reply(answer);
                self.hub.watch(&self.client, filter);
            }
            Ok(Message::Poll) => {
                self.errors_in_a_row = 0;
                self.flush(received, scratch, usize::MAX);
                self.poll();
            }
            Ok(Message::Reset(asked)) => {
                // It holds for what comes after it.
                self.flush(received, scratch, usize::MAX);
                self.reset(asked, number, line);
            }
            Ok(Message::Playback(action)) => {
                self.errors_in_a_row = 0;
                self.flush(received, scratch, usize::MAX);
                match self.hub.control(self.client.number, action) {
                    Ok(()) => {
                        if let Some(place) = self.hub.place() {
                            self.client.outbox.reply(place);
                        }
                    }
                    // Well said, if in vain: not held against it.
                    Err(fault) => self.say(&fault, number, line),
                }
            }
            Ok(Message::Reference(found)) => {
                self.errors_in_a_row = 0;
                self.flush(received, scratch, usize::MAX);
                if let Err(fault) = self
                    .hub
                    .refer(self.client.number, &found, &mut scratch.text)
                    && self.told.len() < MAX_TOLD
                    && self.told.insert(fault.message.clone())
                {
                    self.say(&fault, number, line);
                }
            }
            Err(fault) if matches!(fault.code, "unknown_class" | "other_sensor") => {
                // Somebody newer than this daemon, or who has more than rates: said once, never held
                // against it.
                if self.told.len() < MAX_TOLD && self.told.insert(fault.message.clone()) {
                    self.say(&fault, number, line);
                }
            }
            Err(fault) => self.bad(&fault, number, line, received, scratch),
        }
    }

    /// Samples came, from `before` on, where none are taken.
    fn not_taken(
        &mut self,
        number: u64,
        line: &[u8],
        before: usize,
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        count(
            &self.hub.counters.refused_samples,
            scratch.samples.len() - before,
        );
        scratch.samples.truncate(before);
        self.bad(&wire::samples_not_taken(), number, line, received, scratch);
    }

    /// A line that is no good: said, counted, and after too many in a row the end.
    fn bad(
        &mut self,
        fault: &Fault,
        number: u64,
        line: &[u8],
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        self.flush(received, scratch, usize::MAX);
        match self.subject() {
            Some(subject) => self.owned.undecodable_of(&subject, &self.hub, &self.client),
            None => self.owned.undecodable(&self.hub, &self.client),
        }
        self.say(fault, number, line);
        self.lose(fault, number, line);
        self.errors_in_a_row += 1;
        // One bad sensor behind a broker is not all of them.
        if self.side.is_broker() {
            return;
        }
        if self.errors_in_a_row > self.hub.limits().errors_in_a_row {
            let fault = Fault::new(
                "too_many_errors",
                format!(
                    "{} bad lines in a row; the connection is closed",
                    self.errors_in_a_row
                ),
            );
            self.client
                .outbox
                .reply(wire::error(&fault, number, &[], 0));
            self.end = Some(End::TooManyErrors);
        }
    }

    fn say(&mut self, fault: &Fault, number: u64, near: &[u8]) {
        count(&self.hub.counters.faults, 1);
        self.step.worked = true;
        if let Some(suppressed) = self.errors.take(Instant::now()) {
            self.step.answered = true;
            self.client
                .outbox
                .reply(wire::error(fault, number, near, suppressed));
        }
    }

    fn authorise(&mut self, token: &str, number: u64) {
        self.errors_in_a_row = 0;
        match self.hub.token() {
            Some(expected) if !self.authorised => {
                match expected.judge(token, self.client.peer.address(), Instant::now()) {
                    Ok(()) => {
                        self.authorised = true;
                        if let Some(place) = self.hub.place() {
                            self.client.outbox.reply(place);
                        }
                    }
                    Err(denied) => {
                        count(&self.hub.counters.faults, 1);
                        let words = wire::error(&denied.fault, number, &[], 0);
                        self.last_words = Some((denied.delay, words));
                        self.end = Some(End::Unauthorised);
                    }
                }
            }
            _ => {}
        }
    }

    fn refuse(&mut self, fault: &Fault, number: u64) {
        count(&self.hub.counters.faults, 1);
        // Nothing of the line is repeated: it may hold a token with a slip.
        self.client.outbox.reply(wire::error(fault, number, &[], 0));
        self.lose(fault, number, &[]);
        self.end = Some(End::Unauthorised);
    }

    /// Hands the first `until` samples gathered to the hub: a run of one sensor.
    fn flush(&mut self, received: Nanos, scratch: &mut Scratch, until: usize) {
        let Some(head) = scratch.head.take() else {
            return;
        };
        self.step.worked = true;
        let until = until.min(scratch.samples.len());
        let run = SampleRun {
            client: self.client.number,
            head: &head,
            received,
            placed: Placed::ByStamp,
            lines: &scratch.lines,
            samples: scratch.samples.get(..until).unwrap_or_default(),
            bare: &scratch.bare,
            first: (scratch.first.0, &scratch.first.1),
        };
        let news = self
            .owned
            .publish(&self.hub, &self.client, &run, &mut scratch.text);
        match news {
            Ok(Feedback { note, faults, .. }) => {
                self.has_sent = true;
                self.hub.losses.over(&self.client.peer.name);
                if let Some(note) = note {
                    let id = run.id();
                    log_throttle::info(&format!("run {id}"), &format!("{id}: {}", note.message));
                    self.client.outbox.reply(wire::note(&note));
                }
                for fault in faults {
                    self.say(&fault, 0, &[]);
                }
            }
            Err(fault) => {
                count(&self.hub.counters.refused_samples, run.samples.len());
                self.say(&fault, 0, &[]);
                self.hub.losses.add(&Lost {
                    source: run.id(),
                    fault: &fault,
                    first: run.first,
                    count: run.samples.len() as u64,
                    // Another may send it as it should.
                    is_whole: fault.code != "id_in_use",
                });
            }
        }
        scratch.samples.drain(..until);
        // Those of a line that is still to come are not there yet.
        scratch.bare.clear();
        scratch.lines.clear();
    }
}

impl Scratch {
    /// A run begins with this line.
    fn begin(&mut self, head: Line, number: u64, line: &[u8]) {
        self.head = Some(head);
        self.first.0 = number;
        self.first.1.clear();
        let near = line.get(..line.len().min(MAX_NEAR)).unwrap_or_default();
        self.first.1.extend_from_slice(near);
    }
}

/// Whether a sample with this head belongs to the run that is gathered.
fn goes_on(scratch: &Scratch, head: &Line) -> bool {
    let run = scratch.head.as_ref();
    run.is_some_and(|run| run.goes_on_in(head))
}

fn first_line_must_be_auth() -> Fault {
    Fault::new(
        "unauthorised",
        "the first line must be {\"class\":\"AUTH\",\"token\":\"...\"}",
    )
}

impl Drop for Session {
    fn drop(&mut self) {
        self.owned.leave(&self.hub, &self.client);
    }
}
