//! Schema and channel records -> what a message's channel id means here. Pure.
//!
//! A stage of its own because ids are reused in the wild: an id means what the latest definition
//! before the message, in file order, says. A second, different definition makes a second channel,
//! so that messages of two topics are never mixed under one id.

use crate::format::Format;
use crate::records::op;
use crate::records::problem::{ProblemKind, Problems};
use crate::records::record::{Body, ChannelRecord, SchemaRecord};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Layout of a channel's payloads, in the words of the file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Schema {
    /// Id in the file.
    pub id: u16,
    /// Name of the type, such as `sensor_msgs/msg/Imu`.
    pub name: String,
    /// Language of `data`, such as `ros2msg`; empty where it has none.
    pub encoding: String,
    /// The definition itself.
    pub data: Vec<u8>,
}

/// A stream of messages in the log.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Channel {
    /// Index among the walk's channels, from 0 in the order of definition. Two channels of
    /// one log may share an id or a topic, never an index.
    pub index: usize,
    /// Id in the file.
    pub id: u16,
    /// Topic.
    pub topic: String,
    /// Encoding of the payloads, such as `cdr`.
    pub message_encoding: String,
    /// Free pairs of text.
    pub metadata: BTreeMap<String, String>,
    /// Layout of the payloads; `None` where the channel names none, or one that is not in the file.
    pub schema: Option<Arc<Schema>>,
    /// Schema id in the file; 0 for none.
    pub schema_id: u16,
    /// Format of the lines or rows that stand for its messages; `None` where there are messages.
    pub text: Option<Format>,
}

impl Schema {
    fn is(&self, r: &SchemaRecord<'_>) -> bool {
        self.id == r.id && self.name == r.name && self.encoding == r.encoding && self.data == r.data
    }

    fn new(r: &SchemaRecord<'_>) -> Self {
        Schema {
            id: r.id,
            name: r.name.to_owned(),
            encoding: r.encoding.to_owned(),
            data: r.data.to_owned(),
        }
    }
}

impl Channel {
    fn is(&self, r: &ChannelRecord<'_>) -> bool {
        self.id == r.id
            && self.schema_id == r.schema_id
            && self.topic == r.topic
            && self.message_encoding == r.message_encoding
            && self.metadata == text_map(&r.metadata)
    }
}

fn text_map(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
    pairs
        .iter()
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()))
        .collect()
}

/// Definitions found in a summary section: used for ids the data section leaves undefined
/// (the chunk that defined them is lost).
#[derive(Debug, Default)]
pub(super) struct Fallback {
    pub(super) schemas: BTreeMap<u16, Vec<u8>>,
    pub(super) channels: BTreeMap<u16, Vec<u8>>,
}

/// "No channel has this id."
pub(super) const NONE: u32 = u32::MAX;

/// Every channel so far, and what the caller decided about it.
#[derive(Debug)]
pub(super) struct Table<D> {
    by_id: Vec<u32>,
    entries: Vec<Entry<D>>,
    schemas: BTreeMap<u16, Arc<Schema>>,
    fallback: Fallback,
    /// Bytes the definitions may still take.
    left: usize,
}

#[derive(Debug)]
pub(super) struct Entry<D> {
    pub(super) channel: Arc<Channel>,
    pub(super) choice: Option<D>,
}

impl<D> Table<D> {
    pub(super) fn new(fallback: Fallback, limit: usize) -> Self {
        Table {
            by_id: Vec::new(),
            entries: Vec::new(),
            schemas: BTreeMap::new(),
            fallback,
            left: limit,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    pub(super) fn channels(&self) -> impl Iterator<Item = &Arc<Channel>> {
        self.entries.iter().map(|e| &e.channel)
    }

    /// Index of the channel that has this id now, or [`NONE`].
    #[inline]
    pub(super) fn lookup(&self, id: u16) -> u32 {
        self.by_id.get(usize::from(id)).copied().unwrap_or(NONE)
    }

    #[inline]
    pub(super) fn entry(&self, index: u32) -> Option<&Entry<D>> {
        self.entries.get(index as usize)
    }

    /// Whether the summary can define this id.
    pub(super) fn can_adopt(&self, id: u16) -> bool {
        self.fallback.channels.contains_key(&id)
    }

    /// Whether a schema or channel record says nothing new.
    pub(super) fn holds(&self, opcode: u8, body: &[u8]) -> bool {
        if opcode == op::SCHEMA {
            SchemaRecord::parse(body)
                .is_some_and(|r| self.schemas.get(&r.id).is_some_and(|s| s.is(&r)))
        } else {
            ChannelRecord::parse(body).is_some_and(|r| {
                self.entry(self.lookup(r.id)).is_some_and(|e| {
                    // The same words after a new schema under the old id mean something else.
                    let schema = self.schemas.get(&r.schema_id).or(e.channel.schema.as_ref());
                    e.channel.is(&r) && schema == e.channel.schema.as_ref()
                })
            })
        }
    }

    /// Takes in a schema or channel record; asks `select` about a channel that is new.
    pub(super) fn define(
        &mut self,
        opcode: u8,
        body: &[u8],
        offset: u64,
        select: &mut dyn FnMut(&Arc<Channel>) -> Option<D>,
        problems: &mut Problems,
    ) {
        if self.holds(opcode, body) {
            return;
        }
        // The fixed part stands for what an entry itself takes.
        let Some(left) = self.left.checked_sub(body.len().saturating_add(256)) else {
            return problems.add(offset, ProblemKind::TooManyDefinitions, None);
        };
        if opcode == op::SCHEMA {
            let Some(r) = SchemaRecord::parse(body) else {
                return problems.add(offset, ProblemKind::BadDefinition { opcode }, None);
            };
            if let Some(old) = self.schemas.insert(r.id, Arc::new(Schema::new(&r))) {
                let (was, now) = (old.name.clone(), r.name.to_owned());
                let kind = ProblemKind::Redefined {
                    what: "schema",
                    id: r.id,
                    was,
                    now,
                };
                problems.add(offset, kind, None);
            }
        } else {
            let Some(r) = ChannelRecord::parse(body) else {
                return problems.add(offset, ProblemKind::BadDefinition { opcode }, None);
            };
            self.add_channel(&r, offset, select, problems);
        }
        self.left = left;
    }

    /// Defines everything as the summary does, before any of it is met; which channels are wanted.
    pub(super) fn adopt_all(
        &mut self,
        select: &mut dyn FnMut(&Arc<Channel>) -> Option<D>,
        problems: &mut Problems,
    ) -> BTreeSet<u16> {
        for body in std::mem::take(&mut self.fallback.channels).values() {
            if let Some(r) = ChannelRecord::parse(body) {
                self.add_channel(&r, 0, select, problems);
            }
        }
        let wanted = self.entries.iter().filter(|e| e.choice.is_some());
        wanted.map(|e| e.channel.id).collect()
    }

    /// Defines `id` as the summary does.
    pub(super) fn adopt(
        &mut self,
        id: u16,
        offset: u64,
        select: &mut dyn FnMut(&Arc<Channel>) -> Option<D>,
        problems: &mut Problems,
    ) {
        let Some(body) = self.fallback.channels.remove(&id) else {
            return;
        };
        let Some(r) = ChannelRecord::parse(&body) else {
            return;
        };
        let topic = r.topic.to_owned();
        problems.add(offset, ProblemKind::DefinedBySummary { topic }, None);
        self.add_channel(&r, offset, select, problems);
    }

    fn add_channel(
        &mut self,
        r: &ChannelRecord<'_>,
        offset: u64,
        select: &mut dyn FnMut(&Arc<Channel>) -> Option<D>,
        problems: &mut Problems,
    ) {
        if let Some(old) = self.entry(self.lookup(r.id)) {
            let (was, now) = (old.channel.topic.clone(), r.topic.to_owned());
            let kind = ProblemKind::Redefined {
                what: "channel",
                id: r.id,
                was,
                now,
            };
            problems.add(offset, kind, None);
        }
        let schema = self.schema(r.schema_id);
        if r.schema_id != 0 && schema.is_none() {
            let (topic, schema_id) = (r.topic.to_owned(), r.schema_id);
            problems.add(
                offset,
                ProblemKind::MissingSchema { topic, schema_id },
                None,
            );
        }
        let index = self.entries.len();
        let channel = Arc::new(Channel {
            index,
            id: r.id,
            topic: r.topic.to_owned(),
            message_encoding: r.message_encoding.to_owned(),
            metadata: text_map(&r.metadata),
            schema,
            schema_id: r.schema_id,
            text: None,
        });
        let choice = select(&channel);
        let id = usize::from(r.id);
        if self.by_id.len() <= id {
            self.by_id.resize(id + 1, NONE);
        }
        if let (Some(slot), Ok(index)) = (self.by_id.get_mut(id), u32::try_from(index)) {
            *slot = index;
        }
        self.entries.push(Entry { channel, choice });
    }

    fn schema(&mut self, id: u16) -> Option<Arc<Schema>> {
        if id == 0 {
            return None;
        }
        if let Some(known) = self.schemas.get(&id) {
            return Some(Arc::clone(known));
        }
        let body = self.fallback.schemas.get(&id)?;
        let schema = Arc::new(Schema::new(&SchemaRecord::parse(body)?));
        self.schemas.insert(id, Arc::clone(&schema));
        Some(schema)
    }
}
