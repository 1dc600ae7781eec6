//! Announcements beside attitudes: which streams there are, and where a replay is. Pure but for locks.

use super::{ClientProtocol, Hub, lock, read, write};
use crate::serve::core::channel::Channel;
use crate::serve::guard::fault::Fault;
use crate::serve::protocol::filter::Class;
use crate::serve::protocol::foxglove;
use crate::serve::protocol::foxglove::frames::{TRANSFORMS, stream_of};
use crate::serve::protocol::position::{Action, Part, Position};
use crate::serve::protocol::wire;
use crate::sink::{Profile, Stream, Transforms};
use bytes::Bytes;
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl Hub {
    /// Whether clients may send samples: a replay has its own.
    #[must_use]
    pub fn takes_samples(&self) -> bool {
        self.simulation.timeline.is_none()
    }

    /// Classes that can be watched.
    #[must_use]
    pub fn classes(&self) -> Vec<Class> {
        let mut classes: Vec<Class> = read(&self.channels.by_number)
            .values()
            .map(|c| c.class())
            .collect();
        classes.push(Class::Att);
        classes.extend(self.simulation.brings_samples.then_some(Class::Rate));
        classes.sort_unstable();
        classes.dedup();
        classes
    }

    /// The labels of a sensor, with the frames that were asked for. The world has one parent at most: of all sensors whose
    /// transforms lead to it the first one's stay.
    pub(super) fn named(&self, labels: &Stream) -> Stream {
        let mut named = labels.clone();
        self.channels.frames.name(&mut named);
        let is_reverse = |stream: &Stream| stream.transforms == Transforms::Reverse;
        if is_reverse(&named) {
            let channels = read(&self.channels.by_number);
            if let Some(first) = channels.values().find(|c| is_reverse(c.stream())) {
                tracing::warn!(
                    id = %named.id,
                    "no transforms of it: with --tf reverse the world is a child of {} already",
                    first.child()
                );
                named.transforms = Transforms::None;
            }
        }
        named
    }

    /// A further stream; viewers are told.
    pub fn declare(&self, stream: &Stream) -> Arc<Channel> {
        let mut channels = write(&self.channels.by_number);
        let child = lock(&self.channels.child_frames).take(stream);
        let number = self.channels.last.fetch_add(1, Ordering::Relaxed) + 1;
        let channel = Arc::new(Channel::new(number, stream, child));
        channels.insert(number, channel.clone());
        // Under the lock: who joins meanwhile finds it in the list, and is not told twice.
        let clients = read(&self.clients.by_number);
        let mut viewers = clients.values().filter(|c| c.is_viewer()).peekable();
        if viewers.peek().is_some() {
            let said = foxglove::channels(channel.topics(), false);
            viewers.for_each(|viewer| viewer.outbox.announce(said.clone()));
        }
        drop(clients);
        channel
    }

    /// Whether a viewer can subscribe to it.
    #[must_use]
    pub fn has_channel(&self, number: u32) -> bool {
        number == TRANSFORMS
            || read(&self.channels.by_number)
                .get(&stream_of(number))
                .is_some_and(|c| c.has(number))
    }

    /// Position of the replay; `None` where there is none to be controlled.
    #[must_use]
    pub fn where_it_is(&self) -> Option<Position> {
        self.simulation.timeline.as_ref()?.position()
    }

    /// The same as a line.
    #[must_use]
    pub fn place(&self) -> Option<Bytes> {
        Some(wire::playback(&self.where_it_is()?, &self.session()))
    }

    /// Curves of a part of the whole recording that is played; `None` where there are none.
    #[must_use]
    pub fn overview(&self, part: &Part) -> Option<serde_json::Value> {
        self.simulation.timeline.as_ref()?.overview(part)
    }

    /// The replay has begun, so that it can be controlled, or begun anew as another session: viewers are told.
    pub fn tell_viewers(&self) {
        // Before the clients are locked: `control` locks the playback first, then them.
        let (plain, controlling) = (self.server_info(false), self.server_info(true));
        for client in read(&self.clients.by_number).values() {
            if let ClientProtocol::Foxglove { controls } = client.shape {
                let info = if controls { &controlling } else { &plain };
                client.outbox.reply(info.clone());
            }
        }
    }

    pub(super) fn server_info(&self, controls: bool) -> Bytes {
        foxglove::server_info(&self.session(), self.where_it_is().as_ref(), controls)
    }

    /// A client asks for something of the replay; all others that watch are told.
    ///
    /// # Errors
    /// The fault to answer with.
    pub fn control(&self, client: u64, action: Action) -> std::result::Result<(), Fault> {
        let timeline = self.simulation.timeline.as_ref().ok_or_else(|| {
            Fault::new(
                "nothing_to_play",
                "samples come as they come here; strapd replay LOG -o ws-listen://... can be controlled",
            )
        })?;
        timeline.ask(action, &mut || {
            for client in read(&self.clients.by_number).values() {
                client.outbox.forget();
            }
        })?;
        self.announce(false, Some(client));
        Ok(())
    }

    /// Tells whoever watches where the replay is. A `tick` is left out where one waits already.
    pub fn announce(&self, tick: bool, but: Option<u64>) {
        let Some(place) = self.where_it_is() else {
            return;
        };
        let line = wire::playback(&place, &self.session());
        let clients = read(&self.clients.by_number);
        for client in clients.values().filter(|c| Some(c.number) != but) {
            match client.shape {
                ClientProtocol::Lines(Profile::Lines) if client.outbox.level().watching => {
                    client.outbox.note(line.clone(), tick);
                }
                ClientProtocol::Foxglove { controls: true } => {
                    let state = foxglove::playback_state(&place, false, "");
                    client.outbox.note(state, tick);
                }
                _ => {}
            }
        }
    }

    /// The streams of a replay, for `STATUS`; those of sensors say more themselves.
    pub(super) fn own_streams(&self) -> Vec<serde_json::Value> {
        match &self.simulation.timeline {
            None => Vec::new(),
            Some(_) => read(&self.channels.by_number)
                .values()
                .map(|c| c.status())
                .collect(),
        }
    }
}
