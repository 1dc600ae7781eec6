//! `RESET` of a client -> the sensor, or why not. Pure but for locks.

use super::Session;
use crate::serve::core::hub::Asker;
use crate::serve::guard::fault::{Fault, Kind};
use crate::serve::protocol::wire::{self, Reset};

impl Session {
    /// Marks it as the WebSocket of a page of the daemon itself, which may begin any sensor's attitude anew.
    #[must_use]
    pub fn of_own_page(mut self, is_own: bool) -> Session {
        self.is_own_page = is_own;
        self
    }

    /// Begins a sensor's attitude anew, where its samples would be taken from here.
    pub(super) fn reset(&mut self, asked: Result<Reset, Fault>, number: u64, line: &[u8]) {
        let asker = if self.is_own_page {
            Asker::OwnPage
        } else {
            Asker::Client(self.client.number)
        };
        match self.hub.reset(asked, asker) {
            Ok((asked, done)) => {
                self.errors_in_a_row = 0;
                // Who is told nothing is not told this.
                if !self.side.is_deaf() {
                    self.client.outbox.reply(wire::reset_answer(&asked, &done));
                }
            }
            // Well said, if in vain: not held against it.
            Err(fault) => self.say(&fault.of(Kind::Request), number, line),
        }
    }
}
