//! One stream as clients know it: its name, its lines, how much of it there was. Pure.
//!
//! Apart from where its samples come from: a sensor of the daemon and a stream of a replay reach
//! whoever watches in the same way.

use super::subscriber::{Chunk, Class};
use crate::record::{AttitudeSample, RawSample};
use crate::sink::json::Objects;
use crate::sink::{Content, Profile, Stream};
use bytes::Bytes;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of one shared chunk of lines, about: small beside an outbox, so that little is dropped at once.
const CHUNK_BYTES: usize = 16 << 10;

/// A stream.
#[derive(Debug)]
pub struct Channel {
    id: Arc<str>,
    stream: Stream,
    lines: Objects,
    plot: Objects,
    sent: AtomicU64,
}

/// Consecutive items of a stream, oldest first.
#[derive(Clone, Copy, Debug)]
pub enum Items<'a> {
    /// Attitudes.
    Attitudes(&'a [AttitudeSample]),
    /// What a sensor put out.
    Samples(&'a [RawSample]),
}

impl Items<'_> {
    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Items::Attitudes(items) => items.len(),
            Items::Samples(items) => items.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Channel {
    /// Named and labelled as `stream` says.
    #[must_use]
    pub fn new(stream: &Stream) -> Channel {
        Channel {
            id: stream.id.as_str().into(),
            stream: stream.clone(),
            lines: Objects::new(stream, Profile::Lines),
            plot: Objects::new(stream, Profile::PlotJuggler),
            sent: AtomicU64::new(0),
        }
    }

    /// Its name.
    #[must_use]
    pub fn id(&self) -> &Arc<str> {
        &self.id
    }

    /// Its labels.
    #[must_use]
    pub fn stream(&self) -> &Stream {
        &self.stream
    }

    /// What its lines are.
    #[must_use]
    pub fn class(&self) -> Class {
        match self.stream.content {
            Content::Attitude | Content::Truth => Class::Att,
            Content::Samples(_) => Class::Rate,
        }
    }

    /// This many items more were offered to clients.
    pub(super) fn count(&self, items: usize) {
        self.sent.fetch_add(items as u64, Ordering::Relaxed);
    }

    /// Its line in `STATUS`.
    pub(super) fn status(&self) -> serde_json::Value {
        serde_json::json!({
            "id": &*self.id, "class": self.class().name(), "sent": self.sent.load(Ordering::Relaxed),
            "world": self.stream.world_axes, "body": self.stream.body_axes,
        })
    }

    fn objects(&self, profile: Profile) -> &Objects {
        match profile {
            Profile::Lines => &self.lines,
            Profile::PlotJuggler => &self.plot,
        }
    }

    /// Appends the line of one attitude.
    pub(super) fn line(
        &self,
        out: &mut Vec<u8>,
        profile: Profile,
        seq: u64,
        sample: &AttitudeSample,
    ) {
        self.objects(profile).push_attitude(out, seq, sample);
    }

    /// The lines of items from number `first_seq` on; `text` is room for encoding.
    pub(super) fn chunks(
        &self,
        profile: Profile,
        first_seq: u64,
        items: Items<'_>,
        text: &mut Vec<u8>,
    ) -> Vec<Chunk> {
        let objects = self.objects(profile);
        let mut chunks = Vec::new();
        let mut from = first_seq;
        text.clear();
        let mut cut = |text: &mut Vec<u8>, until: u64| {
            chunks.push(Chunk {
                id: self.id.clone(),
                first_seq: from,
                count: until - from,
                bytes: Bytes::copy_from_slice(text),
            });
            text.clear();
            from = until;
        };
        let end = first_seq + items.len() as u64;
        for (n, seq) in (first_seq..end).enumerate() {
            match items {
                Items::Attitudes(items) => objects.push_attitude(text, seq, &items[n]),
                Items::Samples(items) => objects.push_raw(text, seq, &items[n]),
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
