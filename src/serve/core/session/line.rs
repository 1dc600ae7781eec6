//! A line of a client -> samples gathered, or what it asks for done. Pure but for locks.

use super::opening::Opening;
use super::rows::Rows;
use super::{MAX_TOLD, Scratch, Session, Side, first_line_must_be_auth};
use crate::serve::core::hub::count;
use crate::serve::guard::fault::{Fault, Kind};
use crate::serve::protocol::filter::Filter;
use crate::serve::protocol::position::Action;
use crate::serve::protocol::upstream;
use crate::serve::protocol::wire::{self, Message, Reference};
use strapd_attitude::record::Nanos;
use strapd_recording::decode::Line;

impl Session {
    /// A line, with its number.
    pub(super) fn line(&mut self, said: (u64, &[u8]), received: Nanos, scratch: &mut Scratch) {
        let (number, line) = said;
        if !self.has_spoken() && self.opening == Opening::Text {
            if wire::is_request(line) {
                return self.refuse_opening(number, line);
            }
            self.opening = Opening::Over;
            self.rows = Rows::Open { is_strict: true };
        }
        if self.is_row(line) {
            return self.row(said, received, scratch);
        }
        if self.is_strict() {
            return self.refuse_opening(number, line);
        }
        let before = scratch.run.samples.len();
        let decoder = match &self.side {
            Side::Source(naming) => naming.decoder.as_ref(),
            Side::Client { .. } | Side::ListenOnly { .. } => None,
        };
        let decoder = decoder.unwrap_or(&self.reading.decoder);
        let samples = &mut scratch.run.samples;
        let read = wire::read_from(decoder, line, received, self.side.is_source(), samples);
        if !self.has_spoken() {
            if matches!(&read, Err(fault) if fault.kind == Kind::NoObject) {
                return self.refuse_opening(number, line);
            }
            self.opening = Opening::Over;
        }
        match read {
            Ok(Message::Auth(token)) if !self.side.is_source() => {
                self.step.asked = true;
                self.authorise(&token, number);
            }
            _ if !self.authorised => {
                scratch.run.samples.truncate(before);
                let mut fault = first_line_must_be_auth();
                // A request, as of the page before it asks for the token, brings no sample that is lost.
                let is_sample =
                    matches!(read, Ok(Message::Samples(_) | Message::Packed(..)) | Err(_));
                if !is_sample {
                    fault.kind = Kind::Request;
                }
                self.refuse(&fault, number);
            }
            Ok(Message::Samples(head)) => {
                self.settle_on_objects();
                self.gather(head, before, said, received, scratch);
            }
            Ok(Message::Packed(stream, head)) => {
                self.settle_on_objects();
                self.bind(stream, head, said, received, scratch);
            }
            Err(fault) if fault.kind == Kind::UnknownClass && self.side.is_source() => {
                self.note_event(line);
            }
            // Somebody newer than this daemon, or who has more than rates: never held against it.
            Err(fault) if matches!(fault.kind, Kind::UnknownClass | Kind::OtherSensor) => {
                self.say_once(&fault, number, line);
            }
            Err(fault) => self.bad(&fault, number, line, received, scratch),
            // Nobody there asks anything of us.
            Ok(_) if self.side.is_source() => self.note_event(line),
            Ok(Message::Reference(_)) if !self.hub.takes_samples() => {
                self.not_taken(said, before, received, scratch);
            }
            Ok(request) => {
                // What was sent before it is worked on before it.
                self.flush(received, scratch, usize::MAX);
                self.request(request, said, received, scratch);
            }
        }
    }

    /// A line that asks for something.
    fn request(
        &mut self,
        request: Message,
        said: (u64, &[u8]),
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        let (number, line) = said;
        self.step.asked |= !matches!(request, Message::Reference(_));
        match request {
            Message::Reset(asked) => return self.reset(asked, number, line),
            Message::Heading(measured) => {
                // Well said, if in vain: not held against it.
                return match self.hub.heading(measured, &self.client) {
                    Ok(()) => self.errors_in_a_row = 0,
                    Err(fault) => self.say(&fault.of(Kind::Request), number, line),
                };
            }
            Message::Watch(_) | Message::Poll if self.side.is_deaf() => {}
            Message::Watch(filter) => return self.watch(filter, said, received, scratch),
            Message::Poll => self.poll(),
            Message::Playback(action) => self.control(action, number, line),
            Message::Reference(found) => self.refer(&found, number, line, scratch),
            // These ask for nothing.
            Message::Auth(_) | Message::Samples(_) | Message::Packed(..) => {}
        }
        self.errors_in_a_row = 0;
    }

    /// Gathers the samples from `before` on, of a line of this head.
    pub(super) fn gather(
        &mut self,
        mut head: Line,
        before: usize,
        said: (u64, &[u8]),
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        let new = scratch.run.samples.get(before..).unwrap_or_default();
        if let Side::Source(naming) = &mut self.side
            && let Err(fault) = naming.name(&mut head, wire::are_beside(new))
        {
            count(&self.hub.counters.refused_samples, new.len());
            scratch.run.samples.truncate(before);
            self.say(&fault, said.0, said.1);
            return self.lose(&fault, said.0, said.1);
        }
        if head.id.is_none() {
            head.id.clone_from(&self.reading.id);
        }
        if !self.hub.takes_samples() {
            return self.not_taken(said, before, received, scratch);
        }
        self.errors_in_a_row = 0;
        if !scratch.run.goes_on_in(&head) {
            self.flush(received, scratch, before);
        }
        scratch.run.add(head, said);
    }

    /// Binds this number of packed samples to what a line with this head states.
    fn bind(
        &mut self,
        stream: u32,
        mut head: Line,
        said: (u64, &[u8]),
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        // Of one that may not be mixed with another each sample is refused.
        let named = match &mut self.side {
            Side::Source(naming) => naming.name(&mut head, false),
            Side::Client { .. } | Side::ListenOnly { .. } => Ok(()),
        };
        let head = named.map(|()| head).map_err(Box::new);
        self.bind_or_say(stream, head, said, received, scratch);
    }

    /// Notes what a source says of itself.
    fn note_event(&mut self, line: &[u8]) {
        if let Side::Source(naming) = &mut self.side
            && naming.events.len() < MAX_TOLD
        {
            naming.events.extend(upstream::read(line));
        }
    }

    fn watch(
        &mut self,
        filter: Option<Filter>,
        (number, line): (u64, &[u8]),
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        self.errors_in_a_row = 0;
        let offered = self.hub.classes();
        let absent = filter.iter().flat_map(|f| &f.classes).flatten();
        if let Some(class) = absent.copied().find(|c| !offered.contains(c)) {
            let fault = Fault::new(
                "bad_watch",
                format!("there is no stream `{}` here; there is: ATT", class.name()),
            );
            return self.bad(&fault.of(Kind::Request), number, line, received, scratch);
        }
        // The answer comes before the first attitude.
        let answer = wire::watching(filter.as_ref(), &offered);
        self.client.outbox.reply(answer);
        self.hub.watch(&self.client, filter);
        // What changed between the greeting and this was told to those who watched already.
        if self.hub.place() != self.place {
            self.tell_place();
        }
    }

    /// Tells where the replay is, if there is one.
    pub(super) fn tell_place(&mut self) {
        self.place = self.hub.place();
        if let Some(place) = &self.place {
            self.client.outbox.reply(place.clone());
        }
    }

    fn control(&mut self, action: Action, number: u64, line: &[u8]) {
        match self.hub.control(self.client.number, action) {
            Ok(()) => self.tell_place(),
            // Well said, if in vain: not held against it.
            Err(fault) => self.say(&fault.of(Kind::Request), number, line),
        }
    }

    fn refer(&mut self, found: &Reference, number: u64, line: &[u8], scratch: &mut Scratch) {
        let client = self.client.number;
        if let Err(fault) = self.hub.refer(client, found, &mut scratch.text) {
            self.say_once(&fault, number, line);
        }
    }

    /// Samples came, from `before` on, where none are taken.
    pub(super) fn not_taken(
        &mut self,
        (number, line): (u64, &[u8]),
        before: usize,
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        let samples = &mut scratch.run.samples;
        count(&self.hub.counters.refused_samples, samples.len() - before);
        samples.truncate(before);
        self.bad(&wire::samples_not_taken(), number, line, received, scratch);
    }
}
