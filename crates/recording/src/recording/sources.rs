//! Channels of a log, and their messages -> who speaks on each topic. I/O.
//!
//! Apart from the choice of topics because it looks at messages: two drivers may publish on one topic,
//! and two bodies must never be integrated as one. A topic recorded in several channels one after the
//! other is one source. Channels that take turns, or name another publisher, and messages that name
//! another frame, are several, and each gets a name: `TOPIC@FRAME`, `TOPIC@PUBLISHER`.

use super::decoders::Decoders;
use super::log_channel::{LogChannel, nanos, rank};
use super::topics::PICKED_UNNAMED;
use super::turns::{Turns, digest};
use crate::decode::{Decoder, Options};
use crate::error::Result;
use crate::mcap::{self, Channel, Reader, WalkOptions};
use crate::pool::Pool;
use crate::text::printable;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::record::Nanos;

/// One publisher's samples on a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Publisher {
    /// Name that `--topic` takes: the topic, unless it has several sources.
    pub name: String,
    /// The topic.
    pub topic: String,
    /// Channels, by their index in [`super::opened::Recording::channels`].
    pub channels: Vec<usize>,
    /// The frame its messages name; `None` = any: they name none, or what they name is no frame.
    pub frame: Option<String>,
    /// The frames that the topic's other sources name.
    pub others: Vec<String>,
    /// Label that tells it from the others of its topic; empty where there is none.
    pub label: String,
}

impl Publisher {
    /// All channels of a topic, whatever they say.
    fn whole(topic: &str, channels: Vec<usize>) -> Publisher {
        Publisher {
            name: topic.to_owned(),
            topic: topic.to_owned(),
            channels,
            frame: None,
            others: Vec::new(),
            label: String::new(),
        }
    }
}

/// One source for each topic, in order of appearance.
pub(super) fn by_topic(channels: &[LogChannel]) -> Vec<Publisher> {
    let mut at: HashMap<&str, usize> = HashMap::new();
    let mut sources: Vec<Publisher> = Vec::new();
    for (index, known) in channels.iter().enumerate() {
        let topic = known.channel.topic.as_str();
        let place = *at.entry(topic).or_insert(sources.len());
        match sources.get_mut(place) {
            Some(source) => source.channels.push(index),
            None => sources.push(Publisher::whole(topic, vec![index])),
        }
    }
    sources
}

/// Messages of a channel after which its frames are known. A second publisher a hundred times slower
/// has sent a handful by then; one that comes later is met in the run, and left out.
const FIRST: u64 = 512;
/// Messages of all channels together after which those that are slow are not waited for.
const ENOUGH: u64 = 16_384;
/// First messages that are kept of a channel whose stamps are to be chosen, or whose unit is to be told,
/// and bytes of all of them.
pub(super) const OPENINGS: usize = 64;
pub(super) const OPENINGS_LIMIT: usize = 1 << 20;
/// Channels whose messages are looked at.
const MOST_CHANNELS: usize = 256;
/// More names than this on one topic are no frames.
const MOST_FRAMES: usize = 8;
/// Messages that make a frame: a damaged one, or one all of zeros, is no second body.
const FEW: u64 = 3;

/// Map from a channel met in one of the recording's files to the recording's own.
pub(super) type ChannelMap<'k> = Box<dyn Fn(&Arc<Channel>) -> Arc<Channel> + 'k>;

/// Channels whose messages are looked at, and what came of it so far.
#[derive(Default)]
struct Look {
    looked: Vec<Looked>,
    /// Speakers on a topic, by its place among the sources.
    speakers: BTreeMap<usize, Speakers>,
    /// Messages that are still to come until enough is known of who speaks, and of the unit of stamps.
    missing: u64,
    unsettled: u64,
    /// Messages of each channel, and of all.
    counts: HashMap<usize, u64>,
    total: u64,
}

impl Look {
    /// Decides which channels are looked at.
    fn at(
        sources: &[Publisher],
        channels: &[LogChannel],
        named: Option<&str>,
        options: &Options,
    ) -> Look {
        let mut decoders = Decoders::new(options);
        let mut look = Look::default();
        for (place, source, standing) in in_turn(sources, named) {
            let speaking: Vec<(usize, &LogChannel)> = source
                .channels
                .iter()
                .filter_map(|index| Some((*index, channels.get(*index)?)))
                .filter(|(_, k)| k.messages > 0 && standing.is_of(k))
                .collect();
            let several = speaking.len() > 1 && standing != TopicPurpose::Shown;
            for (index, known) in speaking {
                if look.looked.len() >= MOST_CHANNELS {
                    break;
                }
                let Ok(decoder) = known.decoder(&mut decoders) else {
                    continue;
                };
                let is_bare = decoder.has_bare_stamps();
                let is_opened = is_bare || decoder.stamps().len() > 1;
                let speaks = standing != TopicPurpose::Shown && (several || decoder.names_frames());
                if !speaks && !is_opened {
                    continue;
                }
                if standing != TopicPurpose::Shown {
                    look.missing += known.messages.min(FIRST);
                    look.speakers
                        .entry(place)
                        .or_insert_with(|| Speakers::new(several))
                        .add(index, &known.channel);
                }
                if is_bare {
                    look.unsettled += known.messages.min(OPENINGS as u64);
                }
                look.looked.push(Looked {
                    channel: known.channel.clone(),
                    index,
                    decoder,
                    is_opened,
                    is_bare,
                });
            }
        }
        look
    }

    /// Takes a message of a topic of this place among the sources.
    fn take(&mut self, mut met: Met, place: Option<usize>, channels: &mut [LogChannel]) {
        if let Some(opening) = met.opening.take()
            && let Some(known) = channels.get_mut(met.channel)
        {
            keep(&mut known.openings, opening);
        }
        let count = self.counts.entry(met.channel).or_default();
        *count += 1;
        self.total += 1;
        self.missing = self.missing.saturating_sub(u64::from(*count <= FIRST));
        let settles = met.is_bare && *count <= OPENINGS as u64;
        self.unsettled = self.unsettled.saturating_sub(u64::from(settles));
        if let Some(speakers) = place.and_then(|place| self.speakers.get_mut(&place)) {
            speakers.take(met);
        }
    }

    /// Whether more messages would tell no more.
    fn is_enough(&self) -> bool {
        let to_the_end = self.speakers.values().any(|s| s.several);
        !to_the_end && self.unsettled == 0 && (self.missing == 0 || self.total >= ENOUGH)
    }
}

/// Publishers on each topic, from the messages; `named` is looked at though it may carry no rate that is
/// found without [`Options`].
///
/// # Errors
/// The log cannot be read.
pub(super) fn tell_apart(
    readers: Vec<(Reader, ChannelMap<'_>)>,
    channels: &mut [LogChannel],
    named: Option<&str>,
    options: &Options,
    pool: &Pool,
) -> Result<Vec<Publisher>> {
    let sources = by_topic(channels);
    let mut look = Look::at(&sources, channels, named, options);
    if look.looked.is_empty() {
        return Ok(sources);
    }
    let place_of: HashMap<usize, usize> = sources
        .iter()
        .enumerate()
        .flat_map(|(place, s)| s.channels.iter().map(move |index| (*index, place)))
        .collect();
    let looked = std::mem::take(&mut look.looked);
    let mut is_enough = false;
    for (reader, known) in readers {
        if is_enough {
            break;
        }
        mcap::walk(
            reader,
            // This usually ends soon.
            &WalkOptions {
                pool: Some(pool.rayon()),
                in_flight: 4 << 20,
                ..WalkOptions::default()
            },
            |met| {
                let met = known(met);
                looked.iter().find(|looked| is_same(&looked.channel, &met))
            },
            |looked, message, out: &mut Vec<Met>| {
                let may_be_kept = looked.is_opened && message.data.len() < OPENINGS_LIMIT;
                out.push(Met {
                    channel: looked.index,
                    frame: looked.decoder.frame_id(message.data),
                    digest: digest(message.data),
                    opening: may_be_kept.then(|| (nanos(message.log_time), message.data.to_vec())),
                    is_bare: looked.is_bare,
                });
            },
            |items| {
                for met in items.drain(..) {
                    let place = place_of.get(&met.channel).copied();
                    look.take(met, place, channels);
                }
                is_enough = look.is_enough();
                match is_enough {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            },
        )?;
    }
    let mut told = Vec::new();
    for (place, source) in sources.into_iter().enumerate() {
        match look.speakers.remove(&place) {
            Some(speakers) => told.append(&mut speakers.sources(&source)),
            None => told.push(source),
        }
    }
    Ok(told)
}

/// A channel whose first messages are looked at.
struct Looked {
    channel: Arc<Channel>,
    index: usize,
    decoder: Decoder,
    /// Whether they are kept.
    is_opened: bool,
    /// Whether its stamps are bare numbers.
    is_bare: bool,
}

/// Why a topic is looked at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum TopicPurpose {
    /// Named by the user.
    Named,
    /// Rate that may be integrated.
    Rate,
    /// Orientations to compare with: only its stamps matter.
    Shown,
}

impl TopicPurpose {
    fn is_of(self, known: &LogChannel) -> bool {
        let may_be_integrated = rank(&known.role) >= PICKED_UNNAMED;
        match self {
            TopicPurpose::Named => true,
            TopicPurpose::Rate => may_be_integrated,
            TopicPurpose::Shown => !may_be_integrated && known.role.has_orientation,
        }
    }
}

/// The topics in the order in which they are looked at, since that is not without end.
fn in_turn<'s>(
    sources: &'s [Publisher],
    named: Option<&str>,
) -> impl Iterator<Item = (usize, &'s Publisher, TopicPurpose)> {
    let is_named = |source: &Publisher| {
        named
            .and_then(|name| name.strip_prefix(source.topic.as_str()))
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('@'))
    };
    let (first, rest): (Vec<_>, Vec<_>) =
        sources.iter().enumerate().partition(|(_, s)| is_named(s));
    let of = |standing| move |(place, source): (usize, &'s Publisher)| (place, source, standing);
    first
        .into_iter()
        .map(of(TopicPurpose::Named))
        .chain(rest.clone().into_iter().map(of(TopicPurpose::Rate)))
        .chain(rest.into_iter().map(of(TopicPurpose::Shown)))
}

/// Keeps a first message, as long as there are few.
pub(super) fn keep(openings: &mut Vec<(Nanos, Vec<u8>)>, opening: (Nanos, Vec<u8>)) {
    let bytes: usize = openings.iter().map(|(_, payload)| payload.len()).sum();
    if openings.len() < OPENINGS && bytes + opening.1.len() <= OPENINGS_LIMIT {
        openings.push(opening);
    }
}

/// Whether a channel met in a walk is the one the survey knows: the index may differ, since the
/// summary lists them in another order.
pub fn is_same(known: &Channel, met: &Channel) -> bool {
    known.id == met.id && known.topic == met.topic && known.schema_id == met.schema_id
}

/// Publisher that a channel states: the keys that recorders and converters write.
pub fn publisher(channel: &Channel) -> String {
    const KEYS: [&str; 10] = [
        "callerid",
        "publisher",
        "publisher_gid",
        "gid",
        "node",
        "node_name",
        "device",
        "device_id",
        "serial",
        "serial_number",
    ];
    let said: Vec<&str> = channel
        .metadata
        .iter()
        .filter(|(key, _)| KEYS.contains(&key.to_ascii_lowercase().as_str()))
        .map(|(_, value)| value.as_str())
        .collect();
    printable(&said.join(" "))
}

/// One message.
struct Met {
    channel: usize,
    frame: Option<String>,
    digest: u64,
    /// Log time and payload, where first messages are kept.
    opening: Option<(Nanos, Vec<u8>)>,
    is_bare: bool,
}

/// Speakers found on a topic.
struct Speakers {
    /// Whether it has several channels.
    several: bool,
    publishers: BTreeMap<usize, (String, u16)>,
    frames: BTreeMap<Option<String>, u64>,
    groups: BTreeMap<(String, Option<String>), Group>,
    /// The frames are too many to be frames.
    nameless: bool,
}

/// Messages of one publisher in one frame.
#[derive(Default)]
struct Group {
    channels: BTreeSet<usize>,
    turns: Turns,
}

impl Speakers {
    fn new(several: bool) -> Speakers {
        Speakers {
            several,
            publishers: BTreeMap::new(),
            frames: BTreeMap::new(),
            groups: BTreeMap::new(),
            nameless: false,
        }
    }

    fn add(&mut self, index: usize, channel: &Channel) {
        self.publishers
            .insert(index, (publisher(channel), channel.id));
    }

    fn take(&mut self, met: Met) {
        if self.nameless {
            return;
        }
        let publisher = self
            .publishers
            .get(&met.channel)
            .map_or_else(String::new, |(name, _)| name.clone());
        *self.frames.entry(met.frame.clone()).or_default() += 1;
        self.nameless = self.frames.len() > MOST_FRAMES;
        let group = self.groups.entry((publisher, met.frame)).or_default();
        group.channels.insert(met.channel);
        if self.several {
            group.turns.take(met.channel, met.digest);
        }
    }

    /// Publisher, frame and channels of each source.
    fn apart(&self) -> Vec<(String, Option<String>, Vec<usize>)> {
        let named = self.frames.iter().filter(|(frame, _)| frame.is_some());
        let most = named.map(|(_, n)| *n).max().unwrap_or(0);
        let is_named = self.frames.keys().any(Option::is_some);
        // A payload that cannot be read names none.
        let is_frame = |frame: &Option<String>| {
            frame.is_some() == is_named
                && self.frames.get(frame).is_some_and(|n| *n >= FEW.min(most))
        };
        let mut apart = Vec::new();
        for ((publisher, frame), group) in &self.groups {
            if !is_frame(frame) {
                continue;
            }
            if group.turns.are_several() {
                for channel in &group.channels {
                    apart.push((publisher.clone(), frame.clone(), vec![*channel]));
                }
            } else {
                let channels = group.channels.iter().copied().collect();
                apart.push((publisher.clone(), frame.clone(), channels));
            }
        }
        apart.sort_by(|a, b| a.2.cmp(&b.2));
        apart
    }

    fn sources(&self, whole: &Publisher) -> Vec<Publisher> {
        let apart = self.apart();
        if self.nameless || apart.is_empty() {
            return vec![whole.clone()];
        }
        if let [(_, frame, _)] = apart.as_slice() {
            return vec![Publisher {
                frame: frame.clone(),
                ..whole.clone()
            }];
        }
        let frames: Vec<String> = apart.iter().filter_map(|(_, f, _)| f.clone()).collect();
        labels(&apart, &self.publishers)
            .into_iter()
            .zip(&apart)
            .map(|(label, (_, frame, channels))| Publisher {
                name: format!("{}@{label}", whole.topic),
                topic: whole.topic.clone(),
                channels: channels.clone(),
                frame: frame.clone(),
                others: frames
                    .iter()
                    .filter(|f| Some(*f) != frame.as_ref())
                    .cloned()
                    .collect(),
                label,
            })
            .collect()
    }
}

/// The first of frame, publisher and channel id that differs for all.
fn labels(
    apart: &[(String, Option<String>, Vec<usize>)],
    publishers: &BTreeMap<usize, (String, u16)>,
) -> Vec<String> {
    let id = |channels: &Vec<usize>| {
        let index = channels.first().copied().unwrap_or_default();
        let id = publishers.get(&index).map_or(0, |(_, id)| *id);
        format!("channel-{id}")
    };
    let kinds: [Vec<String>; 4] = [
        apart
            .iter()
            .map(|a| a.1.clone().unwrap_or_default())
            .collect(),
        apart.iter().map(|a| a.0.clone()).collect(),
        apart.iter().map(|a| id(&a.2)).collect(),
        // Ids are reused in the wild.
        (1..=apart.len()).map(|n| format!("source-{n}")).collect(),
    ];
    let differ =
        |labels: &Vec<String>| labels.iter().collect::<BTreeSet<_>>().len() == labels.len();
    kinds.into_iter().find(differ).unwrap_or_default()
}
