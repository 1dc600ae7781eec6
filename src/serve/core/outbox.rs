//! Encoded attitudes and replies -> the bytes one client gets, bounded. Pure but for the lock.
//!
//! A stage of its own because this is where a slow reader stops being anybody else's matter: its
//! queue has a cap, the oldest attitudes give way, what gave way is counted and said (`GAP`), and
//! replies (`STATUS`, `ERROR`, ...) are never dropped: when too many wait, the client is closed.
//!
//! Long because all of it is under one lock: what is queued, what gives way and what is owed agree at every moment.

use super::last_attitude::Last;
use crate::serve::protocol::chunk::{Chunk, Dropped, Encode, MAX_QUEUED, NOTE};
use crate::serve::protocol::filter::{Class, Filter};
use crate::serve::protocol::foxglove::frames;
use crate::serve::protocol::wire;
use crate::sink::Decimator;
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use strapd_attitude::record::{AttitudeSample, Nanos};
use strapd_recording::decode::packed::Form;
use tokio::sync::Notify;

/// Number of waiting pieces above which senders that can wait do.
const CROWDED: usize = MAX_QUEUED / 2;
/// Most replies waiting for one client.
pub const MAX_CONTROL: usize = 64;
/// Most bytes of replies waiting for one client, once there is more than one.
const MAX_CONTROL_BYTES: usize = 1 << 20;
/// Most bytes of announcements waiting for one client.
const MAX_ANNOUNCED: usize = 8 << 20;
/// Number of replies that have not left, or bytes of them, above which no more is taken from a
/// client.
const CROWDED_REPLIES: usize = MAX_CONTROL / 4;
const CROWDED_BYTES: usize = MAX_CONTROL_BYTES / 4;

/// Time between two notices of the time in the data, ns of it.
const BETWEEN_TIMES: i64 = 20_000_000;

/// Why a client was told nothing more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Full {
    /// More replies waited than may wait.
    Control,
}

impl Default for Outbox {
    fn default() -> Outbox {
        Outbox::new()
    }
}

/// Everything that waits for one client.
#[derive(Debug)]
pub struct Outbox {
    state: Mutex<State>,
    wake: Notify,
    /// Signal when replies have left.
    answered: Notify,
    /// Signal when there is room again.
    room: Arc<Notify>,
    /// Notice that attitudes were dropped; empty: none is given.
    gap: fn(&str, &Dropped) -> Bytes,
}

#[derive(Debug, Default)]
struct State {
    control: VecDeque<Bytes>,
    control_bytes: usize,
    /// Replies that were taken and have not left.
    leaving: usize,
    /// The answer to `POLL`: one at most, which may be larger than all others and is shared by all.
    status: StatusReply,
    data: VecDeque<Chunk>,
    /// Number of pieces that have ever left `data`.
    left: u64,
    /// Bytes of `data` and of what was taken and is not yet written.
    queued: usize,
    /// Last attitudes of streams that were not watched before, each behind the chunk with this number:
    /// apart from `data`, as there may be more of them than may wait there. No more than streams.
    lasts: VecDeque<(u64, Last)>,
    gaps: BTreeMap<Arc<str>, Dropped>,
    /// Number of notes in `data`.
    notes: usize,
    /// A note the data around which was dropped.
    stray: Option<Bytes>,
    watch: Option<Filter>,
    /// Subscriptions of a viewer by channel, and the other way.
    subscriptions: BTreeMap<u32, u32>,
    channels: BTreeMap<u32, u32>,
    /// Time it was told last.
    told: Option<Nanos>,
    decimators: HashMap<Arc<str>, Option<Decimator>>,
    full: Option<Full>,
    /// Whether it took nothing while it was waited for.
    is_stalled: bool,
    /// Labels of packed streams that wait, and announcements; apart from the replies, which may be too
    /// many.
    labels: Vec<Bytes>,
    label_bytes: usize,
    /// Streams whose label was said.
    labelled: BTreeSet<u32>,
    dropped: u64,
    sent: u64,
}

/// State of an answer that is made for all who ask.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum StatusReply {
    /// Nobody has asked.
    #[default]
    Not,
    /// Requested.
    For,
    /// Built, and waiting.
    Made(Bytes),
    /// Built and taken, and not left yet.
    Taken,
}

/// Contents of a client's outbox, for `STATUS`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Level {
    /// Whether attitudes are sent to it.
    pub watching: bool,
    /// Bytes of attitudes waiting.
    pub queued: usize,
    /// Attitudes sent so far.
    pub sent: u64,
    /// Attitudes dropped so far.
    pub dropped: u64,
}

impl Outbox {
    /// Empty, watching nothing.
    #[must_use]
    pub fn new() -> Outbox {
        Outbox::saying(wire::gap)
    }

    /// The same, for somebody to whom `gap` says what was dropped; empty: nothing is said.
    #[must_use]
    pub fn saying(gap: fn(&str, &Dropped) -> Bytes) -> Outbox {
        Outbox {
            state: Mutex::default(),
            wake: Notify::new(),
            answered: Notify::new(),
            room: Arc::default(),
            gap,
        }
    }

    /// The same, telling `room` whenever there is room again.
    #[must_use]
    pub fn telling(mut self, room: Arc<Notify>) -> Outbox {
        self.room = room;
        self
    }

    /// Signal whenever there is room again.
    #[cfg(feature = "nats")]
    #[must_use]
    pub fn room(&self) -> &Arc<Notify> {
        &self.room
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Every change of the state is whole before anything in it could panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts or stops the attitudes. Returns what was watched before.
    pub fn watch(&self, filter: Option<Filter>) -> Option<Filter> {
        let mut state = self.state();
        state.decimators.clear();
        let takes = |id: &str| filter.as_ref().is_some_and(|f| f.takes(id, Class::Att));
        state.lasts.retain(|(_, last)| takes(last.id()));
        std::mem::replace(&mut state.watch, filter)
    }

    /// Number of chunks of attitudes that were ever queued.
    #[must_use]
    pub fn queued_so_far(&self) -> u64 {
        self.state().queued_so_far()
    }

    /// Queues the last attitude of a stream behind the attitudes that wait; not where some of it were
    /// queued behind the first `since` chunks. It is never dropped.
    pub fn offer_last(&self, last: Last, since: u64) {
        let mut state = self.state();
        let known = since.saturating_sub(state.left) as usize;
        if state.data.iter().skip(known).any(|c| c.id == *last.id()) {
            return;
        }
        let behind = state.queued_so_far();
        state.lasts.push_back((behind, last));
        drop(state);
        self.wake.notify_one();
    }

    /// Queues a reply (whole lines). A client with too many of them waiting is closed instead.
    pub fn reply(&self, line: Bytes) {
        let mut state = self.state();
        let over = state.control.len() >= MAX_CONTROL
            || (!state.control.is_empty() && state.control_bytes + line.len() > MAX_CONTROL_BYTES);
        if over {
            state.full = Some(Full::Control);
        } else {
            state.control_bytes += line.len();
            state.control.push_back(line);
        }
        drop(state);
        self.wake.notify_one();
    }

    /// Queues what everybody is told of the streams there are. It may come a thousand times at once, which
    /// is no fault of the client's.
    pub fn announce(&self, line: Bytes) {
        self.state().label(line);
        self.wake.notify_one();
    }

    /// The state is asked for, and its answer is to come. `false`: it was before, and has not left.
    pub fn ask(&self) -> bool {
        let status = &mut self.state().status;
        let is_first = *status == StatusReply::Not;
        if is_first {
            *status = StatusReply::For;
        }
        is_first
    }

    /// Queues the answer to who has [asked](Outbox::ask).
    pub fn answer(&self, line: Bytes) {
        self.state().status = StatusReply::Made(line);
        self.wake.notify_one();
    }

    /// Whether an answer is to come, or has not left.
    #[must_use]
    pub fn owes_answer(&self) -> bool {
        self.state().status != StatusReply::Not
    }

    /// Whether so many replies wait that no more may be asked for.
    #[must_use]
    pub fn is_full(&self) -> bool {
        let state = self.state();
        state.control.len() + state.leaving >= CROWDED_REPLIES
            || state.control_bytes >= CROWDED_BYTES
    }

    /// Waits until replies have left, since this was called last.
    pub async fn answered(&self) {
        self.answered.notified().await;
    }

    /// Queues a note (whole lines) behind the attitudes that wait, to be read at its place among
    /// them. The last one is never dropped. A `tick` is left out while another waits.
    pub fn note(&self, line: Bytes, tick: bool) {
        let mut state = self.state();
        if tick && (state.notes > 0 || state.stray.is_some()) {
            return;
        }
        state.notes += 1;
        state.push(Chunk {
            id: NOTE.into(),
            first_seq: 0,
            count: 0,
            bytes: line,
            label: None,
        });
        drop(state);
        self.wake.notify_one();
    }

    /// Drops the attitudes that wait, unsaid: the client asked to be elsewhere.
    pub fn forget(&self) {
        let mut state = self.state();
        let waiting: usize = state.data.iter().map(|c| c.bytes.len()).sum();
        state.queued = state.queued.saturating_sub(waiting);
        state.left = state.queued_so_far();
        state.data.clear();
        state.lasts.clear();
        state.gaps.clear();
        state.notes = 0;
        state.stray = None;
    }

    /// Offers attitudes of stream `id`, in order; `shared` gives them encoded, and is asked only when
    /// the client takes them all. `encode` encodes those a client takes of them, with their numbers.
    pub fn offer(
        &self,
        id: &Arc<str>,
        samples: &[AttitudeSample],
        shared: &mut dyn FnMut(Form) -> Vec<Chunk>,
        encode: &Encode<'_>,
        first_seq: u64,
    ) {
        let mut state = self.state();
        let Some(filter) = &state.watch else { return };
        if !filter.takes(id, Class::Att) {
            return;
        }
        let form = filter.form;
        match filter.rate_hz {
            None => {
                for chunk in shared(form) {
                    state.push(chunk);
                }
            }
            Some(rate_hz) => {
                let decimator = state
                    .decimators
                    .entry(id.clone())
                    .or_insert_with(|| Decimator::new(rate_hz));
                let kept: Vec<_> = (first_seq..)
                    .zip(samples)
                    .filter_map(|(seq, sample)| match decimator {
                        Some(decimator) => decimator.keep(sample).map(|kept| (seq, kept)),
                        None => Some((seq, *sample)),
                    })
                    .collect();
                if kept.is_empty() {
                    return;
                }
                state.push(encode(form, &kept));
            }
        }
        drop(state);
        self.wake.notify_one();
    }

    /// Offers samples of stream `id`, in order and encoded; they are never thinned.
    pub fn offer_samples(&self, id: &Arc<str>, shared: &mut dyn FnMut(Form) -> Vec<Chunk>) {
        let mut state = self.state();
        let Some(filter) = state.watch.as_ref().filter(|w| w.takes(id, Class::Rate)) else {
            return;
        };
        for chunk in shared(filter.form) {
            state.push(chunk);
        }
        drop(state);
        self.wake.notify_one();
    }

    /// A viewer subscribes to a channel. `false`: it has already, or has `most` subscriptions.
    pub fn subscribe(&self, channel: u32, subscription: u32, most: usize) -> bool {
        let state = &mut *self.state();
        let is_new = state.subscriptions.len() < most
            && !state.subscriptions.contains_key(&channel)
            && !state.channels.contains_key(&subscription);
        if is_new {
            state.subscriptions.insert(channel, subscription);
            state.channels.insert(subscription, channel);
        }
        is_new
    }

    /// A viewer ends a subscription.
    pub fn unsubscribe(&self, subscription: u32) {
        let state = &mut *self.state();
        if let Some(channel) = state.channels.remove(&subscription) {
            state.subscriptions.remove(&channel);
            state.lasts.retain(|(_, last)| !last.is_for(channel));
        }
    }

    /// A stream is no more: what is remembered of it goes.
    pub fn forget_stream(&self, id: &str, number: u32, channels: &[u32]) {
        let state = &mut *self.state();
        state.decimators.remove(id);
        state.labelled.remove(&number);
        for channel in channels {
            if let Some(subscription) = state.subscriptions.remove(channel) {
                state.channels.remove(&subscription);
            }
        }
    }

    /// Offers messages to a viewer, made for its subscriptions. `now`: what time it is in the data,
    /// where it wants to know.
    pub fn offer_frames(
        &self,
        make: impl FnOnce(&BTreeMap<u32, u32>) -> Vec<Chunk>,
        now: Option<Nanos>,
    ) {
        let mut state = self.state();
        let mut chunks = make(&state.subscriptions);
        let Some(last) = chunks.last_mut() else {
            return;
        };
        if let Some(now) = now
            && state
                .told
                .is_none_or(|told| now.since(told).abs() >= BETWEEN_TIMES)
        {
            state.told = Some(now);
            last.bytes = [&last.bytes[..], &frames::time(now)].concat().into();
        }
        for chunk in chunks {
            state.push(chunk);
        }
        drop(state);
        self.wake.notify_one();
    }

    /// Moves up to about `most` bytes out: replies first, then what was dropped, then attitudes. The last
    /// one of a stream comes before what was dropped of it.
    /// Returns how many bytes of attitudes are among them; give them back to [`Outbox::written`].
    pub fn take(&self, most: usize, out: &mut VecDeque<Bytes>) -> usize {
        let mut state = self.state();
        state.leaving += state.control.len();
        out.extend(state.control.drain(..));
        state.control_bytes = 0;
        if matches!(state.status, StatusReply::Made(_))
            && let StatusReply::Made(line) =
                std::mem::replace(&mut state.status, StatusReply::Taken)
        {
            out.push_back(line);
        }
        out.extend(state.stray.take());
        out.extend(state.labels.drain(..));
        state.label_bytes = 0;
        let mut taken = 0;
        loop {
            let is_last = state.is_turn_of_last();
            if !is_last {
                for (id, dropped) in std::mem::take(&mut state.gaps) {
                    out.push_back((self.gap)(&id, &dropped));
                }
            }
            if taken >= most {
                return taken;
            }
            let chunk = match is_last {
                true => state.pop_last(out),
                false => state.pop(),
            };
            let Some(chunk) = chunk else {
                // There is none for that channel.
                if is_last {
                    continue;
                }
                return taken;
            };
            taken += chunk.bytes.len();
            state.sent += chunk.count;
            state.notes -= usize::from(chunk.is_note());
            out.push_back(chunk.bytes);
        }
    }

    /// The same for whom attitudes alone are sent, stream by stream: replies go nowhere.
    #[cfg(any(feature = "nats", feature = "zenoh"))]
    pub fn take_chunks(&self, most: usize, out: &mut Vec<Chunk>) -> usize {
        let mut state = self.state();
        state.control.clear();
        state.control_bytes = 0;
        state.gaps.clear();
        state.labels.clear();
        state.label_bytes = 0;
        let mut taken = 0;
        while taken < most
            && let Some(chunk) = state.pop()
        {
            taken += chunk.bytes.len();
            state.sent += chunk.count;
            out.push(chunk);
        }
        taken
    }

    /// Moves everything out: what is told to nobody, or read here.
    pub fn discard(&self, out: &mut VecDeque<Bytes>) {
        let attitudes = self.take(usize::MAX, out);
        self.written(attitudes);
    }

    /// All that was taken has left, this many bytes of attitudes among it.
    pub fn written(&self, bytes: usize) {
        let mut state = self.state();
        let had_replies = state.leaving > 0 || state.status == StatusReply::Taken;
        state.leaving = 0;
        if state.status == StatusReply::Taken {
            state.status = StatusReply::Not;
        }
        if bytes > 0 {
            state.queued = state.queued.saturating_sub(bytes);
            state.is_stalled = false;
        }
        drop(state);
        if had_replies {
            self.answered.notify_one();
        }
        if bytes > 0 {
            self.room.notify_waiters();
        }
    }

    /// Whether more would soon be too much for it, and it may be waited for.
    #[must_use]
    pub fn is_crowded(&self) -> bool {
        let state = self.state();
        state.queued > CROWDED && !state.is_stalled
    }

    /// Gives up waiting for it until it takes something.
    pub fn lose_patience(&self) {
        let mut state = self.state();
        state.is_stalled = state.queued > CROWDED;
    }

    /// Whether nothing waits.
    #[cfg(test)]
    fn is_empty(&self) -> bool {
        let state = self.state();
        state.control.is_empty()
            && !matches!(state.status, StatusReply::Made(_))
            && state.data.is_empty()
            && state.lasts.is_empty()
            && state.gaps.is_empty()
            && state.stray.is_none()
            && state.labels.is_empty()
    }

    /// Why the client must be closed, if it must.
    #[must_use]
    pub fn full(&self) -> Option<Full> {
        self.state().full
    }

    /// Contents.
    #[must_use]
    pub fn level(&self) -> Level {
        let state = self.state();
        Level {
            watching: state.watch.is_some() || !state.subscriptions.is_empty(),
            queued: state.queued,
            sent: state.sent,
            dropped: state.dropped,
        }
    }

    /// Wakes whoever waits in [`Outbox::filled`], though nothing was queued.
    pub fn nudge(&self) {
        self.wake.notify_one();
    }

    /// Waits until something is queued.
    pub async fn filled(&self) {
        self.wake.notified().await;
    }
}

impl State {
    fn label(&mut self, line: Bytes) {
        self.label_bytes += line.len();
        if self.label_bytes > MAX_ANNOUNCED {
            self.full = Some(Full::Control);
        } else {
            self.labels.push(line);
        }
    }

    fn queued_so_far(&self) -> u64 {
        self.left + self.data.len() as u64
    }

    fn pop(&mut self) -> Option<Chunk> {
        let chunk = self.data.pop_front()?;
        self.left += 1;
        Some(chunk)
    }

    /// Whether everything before the next last attitude has left.
    fn is_turn_of_last(&self) -> bool {
        let next = self.lasts.front();
        next.is_some_and(|(behind, _)| *behind <= self.left)
    }

    /// The next last attitude, behind the label of its stream.
    fn pop_last(&mut self, out: &mut VecDeque<Bytes>) -> Option<Chunk> {
        while self.is_turn_of_last() {
            let (_, last) = self.lasts.pop_front()?;
            let Some(chunk) = last.chunk() else {
                continue;
            };
            if let Some((number, label)) = &chunk.label
                && self.labelled.insert(*number)
            {
                out.push_back(label.clone());
            }
            self.queued += chunk.bytes.len();
            return Some(chunk);
        }
        None
    }

    fn push(&mut self, chunk: Chunk) {
        if let Some((number, label)) = &chunk.label
            && self.labelled.insert(*number)
        {
            self.label(label.clone());
        }
        self.queued += chunk.bytes.len();
        self.data.push_back(chunk);
        while self.queued > MAX_QUEUED
            && let Some(oldest) = self.pop()
        {
            self.queued -= oldest.bytes.len();
            if oldest.is_note() {
                self.notes -= 1;
                self.stray = Some(oldest.bytes);
                continue;
            }
            self.dropped += oldest.count;
            let last_seq = oldest.first_seq + oldest.count.saturating_sub(1);
            let dropped = self.gaps.entry(oldest.id).or_insert(Dropped {
                count: 0,
                first_seq: oldest.first_seq,
                last_seq,
            });
            dropped.count += oldest.count;
            dropped.last_seq = last_seq;
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
