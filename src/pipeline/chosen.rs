//! A surveyed log -> the topics of a run with their decoders, and what each channel is for. Pure.
//!
//! Apart from the replay because it is all choice and no work: which topics, under which names, held
//! against which reference.

use super::log::{Known, Log, described, rank};
use super::preparation::Resolved;
use super::route::Route;
use super::run::Replay;
use super::session::Found;
use super::topics;
use crate::decode::Decoder;
use crate::error::{Error, Result};
use crate::sink::{Stream, output_topic};
use crate::source::mcap::Channel;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// A topic that was chosen, and how its channels are read.
pub(super) struct Chosen {
    pub(super) found: Found,
    pub(super) stream: Stream,
    channels: Vec<(Arc<Channel>, Decoder)>,
}

pub(super) fn choose(
    run: &Replay,
    path: &Path,
    log: &Log,
    names: &[String],
) -> Result<Vec<Chosen>> {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    if run.copy_input {
        taken.extend(log.channels.iter().map(|c| c.channel.topic.clone()));
    }
    names
        .iter()
        .map(|name| {
            let chosen = choose_one(run, path, log, name, &taken)?;
            taken.insert(chosen.found.output_topic.clone());
            Ok(chosen)
        })
        .collect()
}

fn choose_one(
    run: &Replay,
    path: &Path,
    log: &Log,
    name: &str,
    taken: &BTreeSet<String>,
) -> Result<Chosen> {
    let mut channels = Vec::new();
    let mut refusals = Vec::new();
    for known in log.channels.iter().filter(|c| c.channel.topic == name) {
        match known.decoder(&run.plan.decode) {
            Ok(decoder) => channels.push((known, decoder)),
            Err(why) => refusals.push(why.to_string()),
        }
    }
    let Some((first, decoder)) = channels.first() else {
        let what = refusals.into_iter().next().unwrap_or_default();
        return Err(Error::Unsupported {
            path: path.to_owned(),
            what,
        });
    };
    if !decoder.stated().has_gyro {
        return Err(Error::Unsupported {
            path: path.to_owned(),
            what: format!(
                "{name} ({}): carries no body rate\n  help: --field gyro=PATH names one",
                described(&first.channel)
            ),
        });
    }
    let frame = first
        .first
        .as_ref()
        .and_then(|(_, payload)| decoder.frame_id(payload))
        .unwrap_or_default();
    let topic = output_topic(name, taken);
    let mut stream = Stream::new(name, &frame);
    stream.output_topic = topic.clone();
    let found = Found {
        name: name.to_owned(),
        output_topic: topic,
        described: described(&first.channel),
        resolved: Resolved::new(&run.plan, decoder.stated()),
        noticed: Arc::default(),
        warnings: refusals,
    };
    let channels = channels
        .into_iter()
        .map(|(k, d)| (k.channel.clone(), d))
        .collect();
    Ok(Chosen {
        found,
        stream,
        channels,
    })
}

/// A channel of recorded orientations the estimate is held against.
pub(super) struct Reference {
    channel: Arc<Channel>,
    decoder: Decoder,
    /// How its orientations are understood.
    pub(super) resolved: Resolved,
}

/// The channel whose orientations the estimate is held against; `None` = the samples' own.
pub(super) fn reference(
    run: &Replay,
    path: &Path,
    log: &Log,
    chosen: &[Chosen],
) -> Result<Option<Reference>> {
    let Some(asked) = &run.against else {
        return Ok(None);
    };
    let taken = |k: &&Known| chosen.iter().any(|c| c.found.name == k.channel.topic);
    let found = if asked.is_empty() {
        let mut others = log.channels.iter().filter(|k| {
            !taken(k) && k.role.has_orientation && rank(&k.role) <= 1 && k.messages > 0
        });
        match (others.next(), others.next()) {
            // An odometry's or a camera's pose beside an IMU that has its own is another matter.
            (Some(one), None) if !one.role.has_rate => one,
            _ => return Ok(None),
        }
    } else {
        let Some(named) = log.channels.iter().find(|k| k.channel.topic == *asked) else {
            return Err(Error::NoSuchTopic {
                path: path.to_owned(),
                topic: asked.clone(),
                topics: topics::listing(&log.candidates()),
            });
        };
        if taken(&named) {
            return Ok(None);
        }
        named
    };
    let decoder = found
        .decoder(&crate::decode::Options::default())
        .map_err(|why| Error::Unsupported {
            path: path.to_owned(),
            what: why.to_string(),
        })?;
    Ok(Some(Reference {
        channel: found.channel.clone(),
        resolved: Resolved::new(&run.plan, decoder.stated()),
        decoder,
    }))
}

pub(super) fn find<'c>(chosen: &'c [Chosen], channel: &Channel) -> Option<(usize, &'c Decoder)> {
    chosen.iter().enumerate().find_map(|(stream, c)| {
        c.channels
            .iter()
            .find(|(known, _)| is_same(known, channel))
            .map(|(_, decoder)| (stream, decoder))
    })
}

/// Whether a channel met in a walk is the one the survey knows: the index may differ, since the
/// summary lists them in another order.
fn is_same(known: &Channel, met: &Channel) -> bool {
    known.id == met.id && known.topic == met.topic && known.schema_id == met.schema_id
}

pub(super) fn route(
    chosen: &mut [Chosen],
    reference: Option<&Reference>,
    copy_input: bool,
    channel: &Arc<Channel>,
) -> Option<Route> {
    let copied = copy_input.then(|| channel.clone());
    if let Some((stream, decoder)) = find(chosen, channel) {
        let noticed = chosen
            .get(stream)
            .map(|c| c.found.noticed.clone())
            .unwrap_or_default();
        return Some(
            Route::samples(decoder.clone(), stream)
                .noticing(&noticed)
                .copying(copied),
        );
    }
    match reference.filter(|r| is_same(&r.channel, channel)) {
        Some(r) => Some(Route::reference(r.decoder.clone()).copying(copied)),
        None => copied.map(Route::only_copied),
    }
}
