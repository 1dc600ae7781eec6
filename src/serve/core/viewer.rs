//! One Foxglove viewer's messages -> its subscriptions, answers to its outbox. Sans-I/O.
//!
//! What [`super::session`] is for lines.

use super::hub::{Client, ClientProtocol, Hub, count};
use crate::serve::guard::limits::Allowance;
use crate::serve::guard::peer::Peer;
use crate::serve::protocol::foxglove::{self, Level, MAX_SUBSCRIPTIONS, Request};
use crate::serve::protocol::position::Action;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// Errors said at once before they are thinned.
const BURST: u32 = 16;

/// One conversation.
#[derive(Debug)]
pub struct Viewer {
    hub: Arc<Hub>,
    client: Arc<Client>,
    errors: Allowance,
    in_a_row: u32,
}

impl Viewer {
    /// Somebody has connected; `controls`: its sub-protocol knows playback. Says who we are and what
    /// there is.
    #[must_use]
    pub fn new(hub: &Arc<Hub>, peer: impl Into<Peer>, controls: bool) -> Viewer {
        let client = hub.join_as(peer, ClientProtocol::Foxglove { controls });
        Viewer {
            hub: hub.clone(),
            client,
            errors: Allowance::new(BURST),
            in_a_row: 0,
        }
    }

    /// The client, with its outbox.
    #[must_use]
    pub fn client(&self) -> &Arc<Client> {
        &self.client
    }

    /// Whether it is to be closed: too many messages in a row that ask for nothing there is.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.in_a_row > self.hub.limits().errors_in_a_row
    }

    /// The next message.
    pub fn message(&mut self, bytes: &[u8], is_text: bool) {
        count(&self.hub.counters.bytes_in, bytes.len());
        count(&self.hub.counters.lines, 1);
        let read = if is_text {
            foxglove::read_text(bytes)
        } else {
            foxglove::read_binary(bytes)
        };
        let done = read.and_then(|request| self.take(request));
        match done {
            Ok(()) => self.in_a_row = 0,
            Err(what) => {
                self.in_a_row += 1;
                self.say(&what);
            }
        }
    }

    fn take(&mut self, request: Request) -> Result<(), String> {
        let outbox = &self.client.outbox;
        let watched = outbox.level().watching;
        match request {
            Request::Subscribe(list) => {
                let since = outbox.queued_so_far();
                let (mut made, mut refused) = (BTreeMap::new(), Vec::new());
                for (subscription, channel) in list {
                    if self.hub.has_channel(channel)
                        && outbox.subscribe(channel, subscription, MAX_SUBSCRIPTIONS)
                    {
                        made.insert(channel, subscription);
                    } else {
                        refused.push(channel);
                    }
                }
                if !watched {
                    self.hub.watch_changed();
                }
                self.hub.subscribed(&self.client, made, since);
                match refused.first() {
                    None => Ok(()),
                    Some(first) => Err(format!(
                        "subscribe: there is no channel {first}, or it is subscribed to already ({} such)",
                        refused.len()
                    )),
                }
            }
            Request::Unsubscribe(list) => {
                for subscription in list {
                    outbox.unsubscribe(subscription);
                }
                if watched && !outbox.level().watching {
                    self.hub.watch_changed();
                }
                Ok(())
            }
            Request::Playback(actions, name) => {
                let did_seek = actions.iter().any(|a| matches!(a, Action::Seek(_)));
                for action in actions {
                    self.hub
                        .control(self.client.number, action)
                        .map_err(|fault| fault.message)?;
                }
                if let Some(place) = self.hub.where_it_is() {
                    outbox.reply(foxglove::playback_state(&place, did_seek, &name));
                }
                Ok(())
            }
        }
    }

    fn say(&mut self, what: &str) {
        count(&self.hub.counters.faults, 1);
        if self.errors.take(Instant::now()).is_some() {
            self.client
                .outbox
                .reply(foxglove::status(Level::Error, what));
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.hub.leave(&self.client, &[]);
    }
}
