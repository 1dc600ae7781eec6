//! Messages that were read elsewhere -> samples to the hub, as those of lines. Pure.

use super::{Scratch, Session};
use crate::serve::core::hub::count;
use crate::serve::guard::fault::Fault;
use crate::serve::guard::losses::Lost;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::Line;

impl Session {
    /// Consecutive samples of one sensor. `messages`: the sender's number of each message, and where its
    /// samples end.
    pub fn samples(
        &mut self,
        id: &str,
        messages: &[(Option<u64>, usize)],
        samples: &[RawSample],
        received: Nanos,
        scratch: &mut Scratch,
    ) {
        count(&self.hub.counters.lines, messages.len());
        if samples.is_empty() {
            return;
        }
        self.errors_in_a_row = 0;
        let head = Line {
            id: Some(id.to_owned()),
            ..Line::default()
        };
        scratch.run.fill(head, messages, samples);
        self.flush(received, scratch, usize::MAX);
    }

    /// A message of this sensor that could not be read.
    pub fn unreadable(&mut self, id: &str, what: &str) {
        self.owned.undecodable_of(id, &self.hub, &self.client);
        self.unused(what);
        self.hub.losses.add(&Lost {
            source: id,
            fault: &Fault::new("undecodable", what),
            first: (0, &[]),
            count: 1,
            is_whole: !self.has_sent(),
        });
    }

    /// A message that is passed over, which is said elsewhere.
    pub fn refused(&mut self) {
        count(&self.hub.counters.lines, 1);
        count(&self.hub.counters.faults, 1);
    }

    /// A message that is no sensor's here.
    pub fn unused(&mut self, what: &str) {
        count(&self.hub.counters.lines, 1);
        self.complain(what);
    }

    /// Something is wrong beside a message that is used.
    pub fn complain(&mut self, what: &str) {
        self.say(&Fault::new("bad_message", what), 0, &[]);
    }
}
