//! One stream as clients know it: its name, its lines, how much of it there was. Pure.
//!
//! Apart from where its samples come from: a sensor of the daemon and a stream of a replay reach
//! whoever watches in the same way.

pub(in crate::serve) mod health;

use crate::serve::protocol::chunk::Chunk;
use crate::serve::protocol::filter::Class;
use crate::serve::protocol::foxglove::frames;
use crate::serve::protocol::wire;
use crate::sink::json::Objects;
use crate::sink::payload::{Payloads, Topic};
use crate::sink::{Content, Profile, Stream};
use bytes::Bytes;
use health::Health;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};
use strapd_recording::decode::packed::{self, Form};

/// Bytes of one shared chunk of lines, about: small beside an outbox, so that little is dropped at once.
const CHUNK_BYTES: usize = 16 << 10;

/// A stream.
#[derive(Debug)]
pub struct Channel {
    id: Arc<str>,
    stream: Stream,
    lines: Objects,
    plot: Objects,
    records: Objects,
    /// Number in packed objects, and the line that announces it.
    label: (u32, Bytes),
    /// Number of its first channel for viewers.
    number: u32,
    payloads: Payloads,
    /// The child of its transform.
    child: String,
    /// Number of the attitude handed out last, and itself.
    last: Mutex<Option<(u64, AttitudeSample)>>,
    sent: AtomicU64,
    /// Health of a stream that something estimates here, and that is no sensor's.
    health: Mutex<Option<Box<Health>>>,
}

/// Clock whose time a message is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Time at which it was logged or received.
    Log,
    /// Stamp: what a playback shows and is moved by.
    Stamp,
}

/// Consecutive items of a stream, oldest first.
#[derive(Clone, Copy, Debug)]
pub enum Items<'a> {
    /// Attitudes.
    Attitudes(&'a [AttitudeSample]),
    /// Samples of a sensor.
    Samples(&'a [RawSample]),
}

impl Items<'_> {
    /// Number of items.
    #[must_use]
    pub fn count(&self) -> usize {
        match self {
            Items::Attitudes(items) => items.len(),
            Items::Samples(items) => items.len(),
        }
    }

    /// The same in pieces of at most `most`.
    pub fn chunks(&self, most: usize) -> impl Iterator<Item = Items<'_>> + use<'_> {
        let pieces = |n: usize| (0..n).step_by(most.max(1));
        pieces(self.count()).map(move |from| {
            let until = (from + most.max(1)).min(self.count());
            match self {
                Items::Attitudes(items) => Items::Attitudes(&items[from..until]),
                Items::Samples(items) => Items::Samples(&items[from..until]),
            }
        })
    }
}

impl Channel {
    /// Number `number`, named and labelled as `stream` says; its transform has this child.
    #[must_use]
    pub fn new(number: u32, stream: &Stream, child: String) -> Channel {
        Channel {
            id: stream.id.as_str().into(),
            stream: stream.clone(),
            lines: Objects::new(stream, Profile::Lines),
            plot: Objects::new(stream, Profile::PlotJuggler),
            records: Objects::new(stream, Profile::Records),
            label: (number, wire::packed_stream(number, stream)),
            number: frames::channel_of(number),
            payloads: Payloads::new(stream, &child),
            child,
            last: Mutex::new(None),
            sent: AtomicU64::new(0),
            health: Mutex::new(None),
        }
    }

    /// The child of its transform.
    #[must_use]
    pub fn child(&self) -> &str {
        &self.child
    }

    /// Number.
    #[must_use]
    pub fn number(&self) -> u32 {
        self.label.0
    }

    /// Name.
    #[must_use]
    pub fn id(&self) -> &Arc<str> {
        &self.id
    }

    /// Labels.
    #[must_use]
    pub fn stream(&self) -> &Stream {
        &self.stream
    }

    /// Class of its lines.
    #[must_use]
    pub fn class(&self) -> Class {
        match self.stream.content {
            Content::Attitude | Content::Truth => Class::Att,
            Content::Samples(_) => Class::Rate,
        }
    }

    /// Number of the attitude handed out last, and itself. Locked while items are handed out: who sees
    /// it sees all of them passed, or none.
    pub(in crate::serve) fn last(&self) -> MutexGuard<'_, Option<(u64, AttitudeSample)>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Items from number `first_seq` on were offered to clients; `last` is that of this channel.
    pub(in crate::serve) fn passed(
        &self,
        last: &mut Option<(u64, AttitudeSample)>,
        first_seq: u64,
        items: Items<'_>,
    ) {
        self.sent.fetch_add(items.count() as u64, Ordering::Relaxed);
        if let Items::Attitudes([before @ .., newest]) = items {
            *last = Some((first_seq + before.len() as u64, *newest));
        }
    }

    /// Another run begins: what was last in the one before is none of its.
    pub(in crate::serve) fn begin_anew(&self) {
        *self.last() = None;
        *self.health() = None;
    }

    fn health(&self) -> MutexGuard<'_, Option<Box<Health>>> {
        self.health.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the health of its samples up to now.
    pub(in crate::serve) fn known(&self, health: Health) {
        *self.health() = Some(Box::new(health));
    }

    /// Number and topic of each of its channels for viewers.
    pub(crate) fn topics(&self) -> impl Iterator<Item = (u32, Topic)> + use<> {
        (self.number..).zip(Payloads::topics(&self.stream))
    }

    /// Whether one of its channels for viewers has this number.
    pub(in crate::serve) fn has(&self, channel: u32) -> bool {
        self.topics().any(|(number, _)| number == channel)
    }

    /// The messages of items from number `first_seq` on for a viewer with these subscriptions, by channel.
    /// `previous`: stamp of the attitude before them; a transform with the same is not sent again.
    pub(in crate::serve) fn frames(
        &self,
        of: impl Fn(u32) -> Option<u32>,
        first_seq: u64,
        items: Items<'_>,
        clock: Clock,
        mut previous: Option<Nanos>,
    ) -> Vec<Chunk> {
        let own = of(self.number);
        let beside = of(self.number + 1).filter(|_| self.has(self.number + 1));
        let transform = of(frames::TRANSFORMS).filter(|_| self.stream.has_transforms());
        if own.is_none() && beside.is_none() && transform.is_none() {
            return Vec::new();
        }
        let mut out = Vec::new();
        let push = |out: &mut Vec<u8>, subscription, time, payload: &dyn Fn(&mut Vec<u8>)| {
            if let Some(subscription) = subscription {
                let from = frames::open(out, subscription, time);
                let opened = out.len();
                payload(out);
                // What is not known of this item is no message.
                if out.len() == opened {
                    out.truncate(from);
                } else {
                    frames::close(out, from);
                }
            }
        };
        let mut chunks = Vec::new();
        let mut from = first_seq;
        let end = first_seq + items.count() as u64;
        for (n, seq) in (first_seq..end).enumerate() {
            match items {
                Items::Attitudes(items) => {
                    let item = &items[n];
                    let time = match clock {
                        Clock::Log => item.log,
                        Clock::Stamp => item.stamp,
                    };
                    push(&mut out, own, time, &|out| {
                        self.payloads.attitude(out, item)
                    });
                    // A repeat of a stamp is what tf2 warns about.
                    if previous.replace(item.stamp) != Some(item.stamp) {
                        push(&mut out, transform, time, &|out| {
                            self.payloads.transform(out, item)
                        });
                    }
                    push(&mut out, beside, time, &|out| {
                        self.payloads.beside(out, item)
                    });
                }
                Items::Samples(items) => {
                    let item = &items[n];
                    push(&mut out, own, item.log, &|out| {
                        self.payloads.sample(out, item)
                    });
                }
            }
            if out.len() >= CHUNK_BYTES || (seq + 1 == end && !out.is_empty()) {
                chunks.push(Chunk {
                    id: self.id.clone(),
                    first_seq: from,
                    count: seq + 1 - from,
                    bytes: std::mem::take(&mut out).into(),
                    label: None,
                });
                from = seq + 1;
            }
        }
        chunks
    }

    /// Line in `STATUS`.
    pub(in crate::serve) fn status(&self) -> serde_json::Value {
        let status = serde_json::json!({
            "id": &*self.id, "class": self.class().name(), "sent": self.sent.load(Ordering::Relaxed),
            "world": self.stream.world_axes, "body": self.stream.body_axes,
        });
        let Some(health) = self.health().clone() else {
            return status;
        };
        let last = self.last().map(|(_, last)| last);
        health.beside(status, last.as_ref())
    }

    fn objects(&self, profile: Profile) -> &Objects {
        match profile {
            Profile::Lines => &self.lines,
            Profile::PlotJuggler => &self.plot,
            Profile::Records => &self.records,
        }
    }

    fn chunk(&self, form: Form, first_seq: u64, count: u64, bytes: Bytes) -> Chunk {
        Chunk {
            id: self.id.clone(),
            first_seq,
            count,
            bytes,
            label: (form == Form::Packed).then(|| self.label.clone()),
        }
    }

    fn push_attitude(
        &self,
        out: &mut Vec<u8>,
        form: Form,
        profile: Profile,
        seq: u64,
        sample: &AttitudeSample,
    ) {
        match form {
            Form::Lines => self.objects(profile).push_attitude(out, seq, sample),
            Form::Packed => packed::push_attitude(out, self.label.0, seq, sample),
        }
    }

    /// The objects of those attitudes a client takes, at least one, with their numbers.
    pub(super) fn thinned(
        &self,
        form: Form,
        profile: Profile,
        attitudes: &[(u64, AttitudeSample)],
    ) -> Chunk {
        let mut bytes = Vec::new();
        for (seq, sample) in attitudes {
            self.push_attitude(&mut bytes, form, profile, *seq, sample);
        }
        let first_seq = attitudes.first().map_or(0, |(seq, _)| *seq);
        self.chunk(form, first_seq, attitudes.len() as u64, bytes.into())
    }

    /// Attitudes from number `first_seq` on as messages of ROS 2, `sensor_msgs/msg/Imu` in CDR, each by itself.
    #[cfg(feature = "zenoh")]
    pub(in crate::serve) fn messages(
        &self,
        first_seq: u64,
        attitudes: &[AttitudeSample],
    ) -> Vec<Chunk> {
        let numbered = (first_seq..).zip(attitudes);
        numbered
            .map(|(seq, attitude)| {
                let mut message = Vec::new();
                self.payloads.attitude(&mut message, attitude);
                self.chunk(Form::Lines, seq, 1, message.into())
            })
            .collect()
    }

    /// The last of some attitudes, likewise.
    #[cfg(feature = "zenoh")]
    pub(super) fn last_message(&self, attitudes: &[(u64, AttitudeSample)]) -> Chunk {
        let last = attitudes.last();
        let mut messages = last.map(|(seq, attitude)| self.messages(*seq, &[*attitude]));
        let message = messages.as_mut().and_then(Vec::pop);
        message.unwrap_or_else(|| self.chunk(Form::Lines, 0, 0, Bytes::new()))
    }

    /// The objects of items from number `first_seq` on; `text` is room for encoding.
    pub(in crate::serve) fn chunks(
        &self,
        form: Form,
        profile: Profile,
        first_seq: u64,
        items: Items<'_>,
        text: &mut Vec<u8>,
    ) -> Vec<Chunk> {
        let mut chunks = Vec::new();
        let mut from = first_seq;
        text.clear();
        let mut cut = |text: &mut Vec<u8>, until: u64| {
            let bytes = Bytes::copy_from_slice(text);
            chunks.push(self.chunk(form, from, until - from, bytes));
            text.clear();
            from = until;
        };
        let end = first_seq + items.count() as u64;
        for (n, seq) in (first_seq..end).enumerate() {
            match (items, form) {
                (Items::Attitudes(items), _) => {
                    self.push_attitude(text, form, profile, seq, &items[n]);
                }
                (Items::Samples(items), Form::Lines) => {
                    self.objects(profile).push_raw(text, seq, &items[n]);
                }
                (Items::Samples(items), Form::Packed) => {
                    packed::push_sample(text, self.label.0, seq, &items[n]);
                }
            }
            if text.len() >= CHUNK_BYTES {
                cut(text, seq + 1);
            }
        }
        if !text.is_empty() {
            cut(text, end);
        }
        chunks
    }
}
