//! Late subscribers -> the last attitude of every stream they were not told of. Pure but for locks.

use super::{Client, ClientProtocol, Hub, read};
use crate::serve::core::channel::{Channel, Clock};
use crate::serve::core::last_attitude::{Last, Wanted};
use crate::serve::protocol::filter::Filter;
use crate::serve::protocol::foxglove::frames::{TRANSFORMS, stream_of};
use crate::sink::Profile;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Hub {
    /// A client starts (or with `None` stops) watching. Of each stream it did not watch before it gets
    /// the last attitude, where it wants that; of those that come, none is lost and none doubled.
    pub fn watch(&self, client: &Client, filter: Option<Filter>) {
        let since = client.outbox.queued_so_far();
        let before = client.outbox.watch(filter.clone());
        self.watch_changed();
        // What PlotJuggler reads has no place to say that it is the last.
        let has_status = client.shape == ClientProtocol::Lines(Profile::Lines);
        let Some(filter) = filter.filter(|f| f.last && has_status) else {
            return;
        };
        let takes =
            |filter: &Filter, channel: &Channel| filter.takes(channel.id(), channel.class());
        for channel in read(&self.channels.by_number).values() {
            if takes(&filter, channel) && !before.as_ref().is_some_and(|b| takes(b, channel)) {
                bring(client, channel, since, Wanted::Object(filter.form));
            }
        }
    }

    /// A viewer, which is among the watchers, has made these subscriptions, by channel, since `since`
    /// chunks were queued for it.
    pub fn subscribed(&self, client: &Client, made: BTreeMap<u32, u32>, since: u64) {
        let clock = self.clock();
        let channels = read(&self.channels.by_number);
        for (channel, subscription) in made {
            let wanted = Wanted::Message {
                channel,
                subscription,
                clock,
            };
            if channel == TRANSFORMS {
                for each in channels.values() {
                    bring(client, each, since, wanted);
                }
            } else if let Some(stream) = channels.get(&stream_of(channel)) {
                bring(client, stream, since, wanted);
            }
        }
    }

    /// Clock of the messages for viewers.
    pub(super) fn clock(&self) -> Clock {
        match &self.simulation.timeline {
            None => Clock::Log,
            Some(_) => Clock::Stamp,
        }
    }
}

/// The client is among the watchers already. So whatever of this stream is handed out after its lock
/// is free again goes to the client, too; and what was handed out before is no newer than the last.
fn bring(client: &Client, channel: &Arc<Channel>, since: u64, wanted: Wanted) {
    let last = channel.last();
    if let Some((seq, sample)) = *last {
        let last = Last::new(channel.clone(), seq, sample, wanted);
        client.outbox.offer_last(last, since);
    }
}
