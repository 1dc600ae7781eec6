//! One client's bytes -> samples to the hub, answers to its outbox. Sans-I/O.
//!
//! Apart from the transports because a conversation is the same over all of them, and apart from
//! the hub because it remembers what only matters to one client: which sensor it sent last, how
//! many lines in a row were bad, whether it has shown the token.

#[cfg(feature = "zenoh")]
mod decoded;
mod line;
mod link;
mod losing;
mod opening;
mod resetting;
mod rows;
mod side;
mod turn;
mod unpacking;

use super::hub::{Client, Complaint, Feedback, Hub, count};
use super::owned::Owned;
use super::reading::Reading;
use super::run_builder::RunBuilder;
use super::stream::run::SampleRun;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::limits::Allowance;
use crate::serve::guard::log_throttle;
use crate::serve::guard::peer::Peer;
use crate::serve::protocol::upstream::Event;
use crate::serve::protocol::wire;
use crate::sink::UNAUTHORISED;
use bytes::Bytes;
use opening::Opening;
use rows::Rows;
pub use side::Side;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};
use strapd_attitude::record::Nanos;
use strapd_recording::decode::Line;
use strapd_recording::decode::framing::Framer;
use strapd_recording::devices::Link;
use turn::{PendingBytes, WorkSlice};

/// Errors said at once before they are thinned.
const BURST: u32 = 64;
/// Faults remembered that are said once, and events of a source that nobody has asked for yet.
const MAX_TOLD: usize = 32;

/// Room for the work on one chunk of bytes; one per thread, so that an idle client holds none.
#[derive(Debug, Default)]
pub struct Scratch {
    run: RunBuilder,
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
    /// Lines that are neither objects nor rows of a table.
    NoTable,
}

impl End {
    /// Reason in words, for the log.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            End::TooManyErrors => "too many bad lines in a row",
            End::Unauthorised => "it has not shown the token",
            End::NoObject => "it did not begin with an object or a table",
            End::NoTable => "its lines are neither objects nor rows of a table",
        }
    }

    /// Says in the log that somebody speaks something else, for whoever wonders where its samples are.
    pub(in crate::serve) fn warn_of(self, peer: &str) {
        if self == End::NoObject {
            log_throttle::warn(
                "no object",
                &format!(
                    "{peer} did not begin with a JSON object or a table and was closed; samples by HTTP go to POST /samples at a ws-listen:// address"
                ),
            );
        }
    }
}

/// One conversation.
#[derive(Debug)]
pub struct Session {
    hub: Arc<Hub>,
    client: Arc<Client>,
    framer: Framer,
    /// Reader of its bytes, where they are no lines.
    link: Option<Link>,
    side: Side,
    reading: Arc<Reading>,
    rows: Rows,
    authorised: bool,
    /// Whether its pages are our own.
    is_own_page: bool,
    /// Line of where the replay is, as it was told last in answer.
    place: Option<Bytes>,
    opening: Opening,
    errors_in_a_row: u32,
    errors: Allowance,
    told: BTreeSet<String>,
    /// The sensors it sends.
    owned: Owned,
    /// Meaning of packed samples by number, as lines would state it.
    bound: BTreeMap<u32, Result<Line, Box<Fault>>>,
    step: WorkSlice,
    /// Whether nothing more comes.
    has_ended: bool,
    /// Bytes that wait for the next step.
    held: Option<PendingBytes>,
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
        if !matches!(side, Side::Client { .. }) {
            client.keep_complaints();
        }
        client.outbox.reply(wire::version(&hub.session()));
        let (authorised, opening) = match side {
            Side::Client { trusted } => (trusted || hub.token().is_none(), Opening::Blank),
            // A datagram stands alone, and whom to listen to otherwise was chosen here.
            Side::ListenOnly { trusted } => (trusted || hub.token().is_none(), Opening::Over),
            Side::Source(_) => (true, Opening::Over),
        };
        let place = hub.place().filter(|_| authorised);
        if let Some(place) = &place {
            client.outbox.reply(place.clone());
        }
        let reading = hub.reading().clone();
        Session {
            rows: Rows::taken(reading.takes_rows() && side.takes_rows() && hub.takes_samples()),
            reading,
            has_ended: false,
            authorised,
            is_own_page: false,
            place,
            opening,
            side,
            hub: hub.clone(),
            client,
            framer: Framer::new(),
            link: None,
            errors_in_a_row: 0,
            errors: Allowance::new(BURST),
            told: BTreeSet::new(),
            owned: Owned::default(),
            bound: BTreeMap::new(),
            step: WorkSlice::default(),
            held: None,
            last_words: None,
            end: None,
        }
    }

    /// The same, whose lines are read in this way.
    #[must_use]
    pub fn reading(mut self, reading: Arc<Reading>) -> Session {
        let are_taken = reading.takes_rows() && self.side.takes_rows();
        self.rows = Rows::taken(are_taken && self.hub.takes_samples());
        self.link = Link::of(reading.protocol);
        self.reading = reading;
        self
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

    /// Complaints since this was called last, of one whose answers are read here; all else that it would be told goes
    /// nowhere.
    pub fn complaints(&mut self) -> Vec<Complaint> {
        self.client.outbox.discard(&mut VecDeque::new());
        self.client.complaints()
    }

    /// Whether some of its samples were taken.
    #[must_use]
    pub fn has_sent(&self) -> bool {
        self.owned.has_sent()
    }

    /// Events that a source has reported of itself since this was called last.
    pub fn events(&mut self) -> Vec<Event> {
        match &mut self.side {
            Side::Source(naming) => std::mem::take(&mut naming.events),
            Side::Client { .. } | Side::ListenOnly { .. } => Vec::new(),
        }
    }

    /// Why it is over, if it is. What waits in the outbox may still be sent.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.end
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
        match self.subject().or_else(|| losing::stated(line)) {
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
            self.client.complain(&fault, (number, &[]), 0);
            self.end = Some(End::TooManyErrors);
        }
    }

    /// Says what holds for many lines once.
    fn say_once(&mut self, fault: &Fault, number: u64, near: &[u8]) {
        if self.told.len() < MAX_TOLD && self.told.insert(fault.message.clone()) {
            self.say(fault, number, near);
        }
    }

    fn say(&mut self, fault: &Fault, number: u64, near: &[u8]) {
        count(&self.hub.counters.faults, 1);
        self.step.worked = true;
        if let Some(suppressed) = self.errors.take(Instant::now()) {
            self.step.answered = true;
            self.client.complain(fault, (number, near), suppressed);
        }
    }

    fn authorise(&mut self, token: &str, number: u64) {
        self.errors_in_a_row = 0;
        match self.hub.token() {
            Some(expected) if !self.authorised => {
                match expected.judge(token, self.client.peer.address(), Instant::now()) {
                    Ok(()) => {
                        self.authorised = true;
                        self.tell_place();
                    }
                    Err(denied) => {
                        count(&self.hub.counters.faults, 1);
                        count(&self.hub.counters.refused, 1);
                        let words = wire::error(&denied.fault, number, &[], 0);
                        self.last_words = Some((denied.delay, words));
                        self.end = Some(End::Unauthorised);
                    }
                }
            }
            _ => {}
        }
    }

    /// Refuses somebody who has shown no token.
    fn refuse(&mut self, fault: &Fault, number: u64) {
        count(&self.hub.counters.faults, 1);
        count(&self.hub.counters.refused, 1);
        // Nothing of the line is repeated: it may hold a token with a slip.
        self.client.complain(fault, (number, &[]), 0);
        self.lose(fault, number, &[]);
        self.end = Some(End::Unauthorised);
    }

    /// Hands the first `until` samples gathered to the hub: a run of one sensor.
    fn flush(&mut self, received: Nanos, scratch: &mut Scratch, until: usize) {
        let Some(run) = scratch.run.run(self.client.number, received, until) else {
            return;
        };
        self.step.worked = true;
        // A device without a clock has no other time.
        let lacks_stamps = self.link.as_ref().is_some_and(Link::may_lack_stamps);
        let run = SampleRun {
            by_arrival: self.reading.by_arrival || lacks_stamps,
            ..run
        };
        let news = self
            .owned
            .publish(&self.hub, &self.client, &run, &mut scratch.text);
        match news {
            Ok(Feedback { note, faults, .. }) => {
                if let Some(note) = note {
                    self.client.outbox.reply(wire::note(&note));
                }
                for fault in faults {
                    self.say(&fault, 0, &[]);
                }
            }
            Err(fault) => self.say(&fault, 0, &[]),
        }
        scratch.run.clear(until);
    }
}

fn first_line_must_be_auth() -> Fault {
    Fault::new(
        UNAUTHORISED,
        "the first line must be {\"class\":\"AUTH\",\"token\":\"...\"}",
    )
}

impl Drop for Session {
    fn drop(&mut self) {
        self.owned.leave(&self.hub, &self.client);
    }
}
