//! A log's channels -> those with specific forces and magnetic fields that belong to the samples of another
//! topic. Pure.
//!
//! Apart from the choice of topics because these are no samples: they have stamps and rates of their own, and
//! correct what is integrated.

use super::decoders::Decoders;
use super::log_channel::{LogChannel, described};
use super::opened::Recording;
use super::selection::{Selection, TopicBeside};
use super::sources::is_same;
use super::topics;
use crate::decode::{Decoder, Options, Wanted};
use crate::error::{Error, Result};
use crate::mcap::Channel;
use crate::text::named_few;
use crate::text::printable;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::condition::Clock;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, Plan};
use strapd_attitude::setting::{AID, FIELD, MAG_TOPIC, TIME};

/// Channels that are read beside those of the samples.
#[derive(Debug, Default)]
pub struct Besides {
    channels: Vec<(Arc<Channel>, Decoder)>,
    /// What was taken unnamed, in words.
    pub notes: Vec<String>,
}

impl Besides {
    /// What is read of this channel beside the samples.
    pub fn decoder(&self, channel: &Channel) -> Option<&Decoder> {
        let mut channels = self.channels.iter();
        let (_, decoder) = channels.find(|(known, _)| is_same(known, channel))?;
        Some(decoder)
    }

    pub(super) fn append(&mut self, mut other: Besides) {
        self.channels.append(&mut other.channels);
        self.notes.append(&mut other.notes);
    }

    fn add(&mut self, found: (&LogChannel, Decoder)) {
        self.channels.push((found.0.channel.clone(), found.1));
    }
}

/// A topic of vectors that could correct the samples of another.
#[derive(Clone, Debug)]
pub struct TopicOfVectors {
    /// Its name.
    pub topic: String,
    /// Type and encoding.
    pub described: String,
    /// Messages a second of the log; `None` where its length is not known.
    pub rate_hz: Option<f64>,
    /// Length of the first vector, in the unit of the file.
    pub first: Option<f64>,
}

/// How messages are read that a topic named by a flag carries.
pub fn options(wanted: Wanted, beside: Option<&TopicBeside>) -> Options {
    Options {
        wanted,
        fields: beside
            .map(|beside| beside.fields.clone())
            .unwrap_or_default(),
        ..Options::default()
    }
}

/// Chooses. `own` is the topic of the samples, and whether its messages carry a field themselves.
///
/// # Errors
/// A topic that is not there, or carries nothing of the kind; several that may be meant.
pub fn choose(
    (plan, selection): (&Plan, &Selection),
    path: &Path,
    log: &Recording,
    (own, has_field): (&str, bool),
) -> Result<Besides> {
    let mut besides = Besides::default();
    if let Some(beside) = &selection.accel {
        besides.add(named(plan, Wanted::Forces, beside, path, log)?);
    }
    if let Some(beside) = &selection.mag {
        besides.add(named(plan, Wanted::Fields, beside, path, log)?);
    } else if plan.aid == Aid::GravityAndField && !has_field {
        let found = unnamed(plan, path, log, own)?;
        besides.notes.push(format!(
            "the magnetic field was taken from {} ({MAG_TOPIC} NAME takes another)",
            printable(&found.0.channel.topic)
        ));
        besides.add(found);
    }
    Ok(besides)
}

/// Whose fields belong to the samples of `own`, where that can be told without being said; else why not.
///
/// # Errors
/// Several that may be meant, or none.
pub(super) fn of_fields(plan: &Plan, log: &Recording, own: &str) -> Result<Besides> {
    let mut besides = Besides::default();
    besides.add(unnamed(plan, log.name(), log, own)?);
    Ok(besides)
}

/// The topics beside `own` with magnetic fields, and with specific forces; and of the fields the one that
/// `--aid gravity+mag` takes unnamed.
#[must_use]
pub fn vectors(log: &Recording, own: &str) -> [(Vec<TopicOfVectors>, Option<String>); 2] {
    let plan = Plan::default();
    let secs = log
        .survey
        .times
        .map(|(a, b)| b.saturating_sub(a) as f64 * 1e-9);
    [Wanted::Fields, Wanted::Forces].map(|wanted| {
        let mut decoders = Decoders::of_run(&plan, &options(wanted, None));
        let channels = log.channels.iter().filter(|known| {
            known.channel.topic != own && known.messages > 0 && may_be_field(&known.channel)
        });
        let found: Vec<TopicOfVectors> = channels
            .filter_map(|known| {
                let decoder = known.decoder(&mut decoders).ok()?;
                let stated = decoder.stated();
                // A rate beside it makes samples of their own.
                if stated.has_gyro || known.role.has_rate || !stated.has_stamp {
                    return None;
                }
                let mut samples = Vec::new();
                if let Some((at, payload)) = &known.first {
                    let _ = decoder.decode(payload, *at, *at, &mut samples);
                }
                let vector = samples.first().and_then(|raw| match wanted {
                    Wanted::Fields => raw.mag,
                    _ => raw.accel,
                });
                Some(TopicOfVectors {
                    topic: known.channel.topic.clone(),
                    described: described(&known.channel),
                    rate_hz: secs
                        .filter(|secs| *secs > 0.0)
                        .map(|secs| known.messages.saturating_sub(1) as f64 / secs),
                    first: vector.map(|[x, y, z]| x.hypot(y).hypot(z)),
                })
            })
            .collect();
        let taken = match wanted {
            Wanted::Fields => unnamed(&plan, Path::new(""), log, own).ok(),
            _ => None,
        };
        let taken = taken.map(|(known, _)| known.channel.topic.clone());
        let is_listed = |name: &String| found.iter().any(|t| t.topic == *name);
        let taken = taken.filter(is_listed);
        (found, taken)
    })
}

fn named<'l>(
    plan: &Plan,
    wanted: Wanted,
    beside: &TopicBeside,
    path: &Path,
    log: &'l Recording,
) -> Result<(&'l LogChannel, Decoder)> {
    let mut channels = log.channels.iter();
    let Some(known) = channels.find(|k| k.channel.topic == beside.topic) else {
        return Err(Error::NoSuchTopic {
            path: path.to_owned(),
            topic: beside.topic.clone(),
            topics: topics::listing(&log.candidates()),
        });
    };
    let refuse = |what: Diagnostic| Error::unsupported(path, what);
    let mut decoders = Decoders::of_run(plan, &options(wanted, Some(beside)));
    let decoder = known
        .decoder(&mut decoders)
        .map_err(|why| refuse((&why).into()))?;
    if plan.clock == Clock::Header && !decoder.stated().has_stamp {
        return Err(refuse(
            Diagnostic::new(format!(
                "{} ({}): its messages carry no stamp to find their gyro sample by",
                printable(&beside.topic),
                described(&known.channel)
            ))
            .help(format!("{TIME} log")),
        ));
    }
    Ok((known, decoder))
}

/// The one topic with a field, or of several the one beside the samples: `/imu/mag` beside `/imu/data`.
fn unnamed<'l>(
    plan: &Plan,
    path: &Path,
    log: &'l Recording,
    own: &str,
) -> Result<(&'l LogChannel, Decoder)> {
    let mut decoders = Decoders::of_run(plan, &options(Wanted::Fields, None));
    let has_stamp = |decoder: &Decoder| decoder.stated().has_stamp || plan.clock != Clock::Header;
    let mut found: Vec<(&LogChannel, Decoder)> = log
        .channels
        .iter()
        .filter(|known| known.messages > 0 && may_be_field(&known.channel))
        .filter_map(|known| Some((known, known.decoder(&mut decoders).ok()?)))
        .filter(|(_, decoder)| has_stamp(decoder))
        .collect();
    if found.len() > 1 {
        let folder = |topic: &str| topic.rsplit_once('/').map(|(folder, _)| folder.to_owned());
        let beside =
            |(known, _): &(&LogChannel, Decoder)| folder(&known.channel.topic) == folder(own);
        if found.iter().filter(|k| beside(k)).count() == 1 {
            found.retain(beside);
        }
    }
    let names: Vec<&str> = found
        .iter()
        .map(|(k, _)| k.channel.topic.as_str())
        .collect();
    let what = match names.as_slice() {
        [] => Diagnostic::new(format!("{AID} gravity+mag: no topic carries a magnetic field")).help(
            format!("{MAG_TOPIC} NAME, with {FIELD} mag=PATH where it has another name; {AID} gravity does without"),
        ),
        several => Diagnostic::new(format!(
            "{AID} gravity+mag: several topics carry a magnetic field: {}",
            named_few(several)
        ))
        .help(format!("{MAG_TOPIC} NAME")),
    };
    match found.pop() {
        Some(one) if found.is_empty() => Ok(one),
        _ => Err(Error::unsupported(path, what)),
    }
}

/// Whether a topic's fields may be taken unnamed: a vector of no name may be anything.
pub fn may_be_field(channel: &Channel) -> bool {
    let schema = channel.schema.as_deref().map_or("", |s| &s.name);
    !schema.ends_with("Vector3Stamped")
}
