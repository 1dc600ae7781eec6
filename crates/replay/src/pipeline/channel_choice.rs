//! A surveyed log -> the topics of a run with their decoders, and what each channel is for. Pure.
//!
//! Apart from the replay because it is all choice and no work: which topics, under which names, held
//! against which reference.

use super::request::ReplayRequest;
use super::session::Found;
use crate::error::{Error, Result};
use crate::sink::{Stream, output_topic};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Meaning;
use strapd_attitude::setting::{FIELD, TOPIC};
use strapd_recording::Recording;
use strapd_recording::decode::Decoder;
use strapd_recording::mcap::Channel;
use strapd_recording::recording::beside::{self, Besides};
use strapd_recording::recording::channel_route::{Noticed, Route, Taker};
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::log_channel::{LogChannel, described, rank};
use strapd_recording::recording::sources::{Publisher, is_same};
use strapd_recording::recording::topics;

/// A topic that was chosen, and how its channels are read.
pub(super) struct Chosen {
    pub(super) found: Found,
    pub(super) stream: Stream,
    source: Publisher,
    /// Decoders by id and schema id: the index of a channel met in a walk may differ from the survey's, since the
    /// summary lists them in another order.
    channels: BTreeMap<(u16, u16), Decoder>,
}

pub(super) fn choose(
    run: &ReplayRequest,
    path: &Path,
    log: &Recording,
    names: &[String],
) -> Result<Vec<Chosen>> {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    if run.copy_input {
        taken.extend(log.channels.iter().map(|c| c.channel.topic.clone()));
    }
    let mut decoders = Decoders::of_run(&run.plan, &run.selection.decode);
    names
        .iter()
        .map(|name| {
            let chosen = choose_one(run, (path, log), name, &taken, &mut decoders)?;
            taken.insert(chosen.found.output_topic.clone());
            Ok(chosen)
        })
        .collect()
}

/// The same for topics that have nothing to do with each other.
pub(super) fn choose_each(
    run: &ReplayRequest,
    path: &Path,
    log: &Recording,
    names: &[String],
    decoders: &mut Decoders,
) -> Vec<Result<Chosen>> {
    let taken = BTreeSet::new();
    names
        .iter()
        .map(|name| choose_one(run, (path, log), name, &taken, decoders))
        .collect()
}

fn choose_one(
    run: &ReplayRequest,
    (path, log): (&Path, &Recording),
    name: &str,
    taken: &BTreeSet<String>,
    decoders: &mut Decoders,
) -> Result<Chosen> {
    let mut channels = Vec::new();
    let mut refusals = Vec::new();
    let Some(source) = log.source(name) else {
        return Err(strapd_recording::Error::NoSuchTopic {
            path: path.to_owned(),
            topic: name.to_owned(),
            topics: topics::listing(&log.candidates()),
        }
        .into());
    };
    for known in log.channels_of(&source) {
        match known.decoder(decoders) {
            Ok(decoder) => channels.push((known, decoder)),
            Err(why) => refusals.push(Diagnostic::from(&why)),
        }
    }
    let Some((first, decoder)) = channels.first() else {
        let none = || Diagnostic::new("no channel of it");
        let what = refusals.into_iter().next().unwrap_or_else(none);
        return Err(strapd_recording::Error::Unsupported {
            path: path.to_owned(),
            what,
        }
        .into());
    };
    if !decoder.stated().has_gyro {
        return Err(strapd_recording::Error::Unsupported {
            path: path.to_owned(),
            what: Diagnostic::new(format!(
                "{} ({}): carries no body rate",
                strapd_recording::text::printable(name),
                described(&first.channel)
            ))
            .help(format!("{FIELD} gyro=PATH names one")),
        }
        .into());
    }
    let frame = source.frame.clone().or_else(|| {
        let (_, payload) = first.first.as_ref()?;
        decoder.frame_id(payload)
    });
    let frame = frame.unwrap_or_default();
    let topic = output_topic(&plain_name(&source), taken);
    let mut stream = Stream::new(name, &frame);
    stream.output_topic = topic.clone();
    let found = Found {
        name: name.to_owned(),
        output_topic: topic,
        described: described(&first.channel),
        resolved: Meaning::new(&run.plan, &decoder.stated().declared),
        noticed: Arc::new(Noticed::of(&source)),
        warnings: refusals
            .into_iter()
            .chain(which_stamp(decoder).map(Into::into))
            .collect(),
    };
    let mut by_id = BTreeMap::new();
    for (known, decoder) in channels {
        let id = (known.channel.id, known.channel.schema_id);
        by_id.entry(id).or_insert(decoder);
    }
    Ok(Chosen {
        found,
        stream,
        source,
        channels: by_id,
    })
}

/// Chooses what is read beside the samples of the one topic chosen.
///
/// # Errors
/// As [`beside::choose`]; several topics, of which it could belong to any.
pub(super) fn besides(
    run: &ReplayRequest,
    path: &Path,
    log: &Recording,
    chosen: &mut [Chosen],
) -> Result<Besides> {
    let asked = run.selection.accel.as_ref().or(run.selection.mag.as_ref());
    let [one] = chosen else {
        if let Some(asked) = asked.filter(|_| !chosen.is_empty()) {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "{} could belong to any of {} topics",
                    strapd_recording::text::printable(&asked.topic),
                    chosen.len()
                ))
                .help(format!("{TOPIC} NAME takes one of them")),
            ));
        }
        return Ok(Besides::default());
    };
    let has_field = one.channels.values().any(|d| d.stated().has_mag);
    let own = (one.source.topic.as_str(), has_field);
    let mut besides = beside::choose((&run.plan, &run.selection), path, log, own)?;
    one.found
        .warnings
        .extend(besides.notes.drain(..).map(Diagnostic::from));
    Ok(besides)
}

/// Description of which of several stamps is read.
pub(super) fn which_stamp(decoder: &Decoder) -> Option<String> {
    let stamps = decoder.stamps();
    let read = stamps.get(decoder.nth_stamp())?;
    let others: Vec<&str> = stamps
        .iter()
        .filter(|s| *s != read)
        .map(String::as_str)
        .collect();
    (!others.is_empty()).then(|| {
        format!(
            "messages carry several stamps: {read} was taken, not {}; {FIELD} stamp=PATH takes another",
            others.join(", ")
        )
    })
}

/// A source's name fit for a topic: letters, digits and underscores in place of the label.
fn plain_name(source: &Publisher) -> String {
    if source.label.is_empty() {
        return source.topic.clone();
    }
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let label: String = source.label.chars().map(plain).collect();
    format!("{}_{label}", source.topic.trim_end_matches('/'))
}

/// A channel of recorded orientations the estimate is held against.
pub(super) struct Reference {
    channel: Arc<Channel>,
    decoder: Decoder,
    /// Meaning of its orientations.
    pub(super) resolved: Meaning,
}

impl Reference {
    /// Whether it lies on the very topic of the samples.
    pub(super) fn is_of(&self, chosen: &Chosen) -> bool {
        self.channel.topic == chosen.source.topic
    }
}

/// The channel whose orientations the estimate is held against; `None` = the samples' own. Where each of the
/// topics is by itself (`apart`), one of them may be the reference of the others.
pub(super) fn reference(
    run: &ReplayRequest,
    path: &Path,
    log: &Recording,
    chosen: &[Chosen],
    apart: bool,
) -> Result<Option<Reference>> {
    let Some(asked) = &run.against else {
        return Ok(None);
    };
    let names: BTreeSet<&str> = chosen.iter().map(|c| c.source.topic.as_str()).collect();
    let taken = |k: &&LogChannel| names.contains(k.channel.topic.as_str());
    let found = if asked.is_empty() {
        let is_other_body = |k: &LogChannel| {
            let mut frames = chosen.iter().map(|c| c.stream.frame_id.as_str());
            frames.all(|frame| k.is_of_another_frame(frame))
        };
        let mut others = log.channels.iter().filter(|k| {
            let is_orientation = k.role.has_orientation && rank(&k.role) <= 1 && k.messages > 0;
            !taken(k) && is_orientation && !is_other_body(k)
        });
        match (others.next(), others.next()) {
            // An odometry's or a camera's pose beside an IMU that has its own is another matter.
            (Some(one), None) if !one.role.has_rate => one,
            _ => return Ok(None),
        }
    } else {
        let Some(named) = log.channels.iter().find(|k| k.channel.topic == *asked) else {
            return Err(strapd_recording::Error::NoSuchTopic {
                path: path.to_owned(),
                topic: asked.clone(),
                topics: topics::listing(&log.candidates()),
            }
            .into());
        };
        if taken(&named) && !apart {
            return Ok(None);
        }
        named
    };
    let decoder = found.decoder(&mut Decoders::default()).map_err(|why| {
        strapd_recording::Error::Unsupported {
            path: path.to_owned(),
            what: Diagnostic::from(&why),
        }
    })?;
    Ok(Some(Reference {
        channel: found.channel.clone(),
        resolved: Meaning::new(&run.plan, &decoder.stated().declared),
        decoder,
    }))
}

/// The decoder of a channel's messages and the streams they may belong to: of several, the one of the
/// frame that a message names.
fn find<'c>(chosen: &'c [Chosen], channel: &Channel) -> Option<(&'c Decoder, Vec<usize>)> {
    let mut decoder = None;
    let mut streams = Vec::new();
    let id = (channel.id, channel.schema_id);
    for (stream, c) in chosen.iter().enumerate() {
        if c.source.topic == channel.topic
            && let Some(own) = c.channels.get(&id)
        {
            decoder.get_or_insert(own);
            streams.push(stream);
        }
    }
    Some((decoder?, streams))
}

/// The way of a channel's messages to the streams, with what is noticed put aside.
pub(super) fn looked_at(chosen: &[Chosen], channel: &Channel) -> Option<Route> {
    let (decoder, streams) = find(chosen, channel)?;
    let taker = |stream: usize| {
        let noticed = chosen.get(stream).map(|c| Noticed::of(&c.source));
        Taker {
            stream,
            noticed: Arc::new(noticed.unwrap_or_default()),
        }
    };
    let takers = streams.into_iter().map(taker).collect();
    Some(Route::to(decoder.clone(), takers))
}

pub(super) fn route(
    chosen: &[Chosen],
    reference: Option<&Reference>,
    besides: &Besides,
    copy_input: bool,
    channel: &Arc<Channel>,
) -> Option<Route> {
    let beside = besides.decoder(channel).cloned();
    let copied = copy_input.then(|| channel.clone());
    let compared = reference.filter(|r| is_same(&r.channel, channel));
    let compared = compared.map(|r| r.decoder.clone());
    if let Some((decoder, streams)) = find(chosen, channel) {
        let taker = |stream: usize| {
            let noticed = chosen.get(stream).map(|c| c.found.noticed.clone());
            Taker {
                stream,
                noticed: noticed.unwrap_or_default(),
            }
        };
        let takers = streams.into_iter().map(taker).collect();
        let route = Route::to(decoder.clone(), takers);
        return Some(route.comparing(compared).beside(beside).copying(copied));
    }
    match compared {
        Some(decoder) => Some(Route::reference(decoder).beside(beside).copying(copied)),
        None => Route::other(beside, copied),
    }
}
