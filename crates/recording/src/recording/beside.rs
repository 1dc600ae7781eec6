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
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_attitude::setting::{ACCEL_TOPIC, AID, FIELD, MAG_TOPIC, TIME};

/// Lengths of a first force, m/s^2, by which a vector that only its topic names is no other acceleration: gravity,
/// and half of it for a body that does not begin at rest.
const GRAVITY: std::ops::Range<f64> = 5.0..15.0;

/// Channels that are read beside those of the samples.
#[derive(Debug, Default)]
pub struct AuxiliaryInputs {
    channels: Vec<(Arc<Channel>, Decoder)>,
    /// Whether temperatures are among them.
    pub has_temperature: bool,
    /// Notes on what was taken unnamed.
    pub notes: Vec<String>,
}

impl AuxiliaryInputs {
    /// Decoder of this channel's messages beside the samples.
    pub fn decoder(&self, channel: &Channel) -> Option<&Decoder> {
        let mut channels = self.channels.iter();
        let (_, decoder) = channels.find(|(known, _)| is_same(known, channel))?;
        Some(decoder)
    }

    pub(super) fn append(&mut self, mut other: AuxiliaryInputs) {
        self.has_temperature |= other.has_temperature;
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
    /// Name.
    pub topic: String,
    /// Type and encoding.
    pub described: String,
    /// Messages a second of the log; `None` where its length is not known.
    pub rate_hz: Option<f64>,
    /// Length of the first vector, in the unit of the file.
    pub first: Option<f64>,
}

/// Options by which messages are read that a topic named by a flag carries.
pub fn options(wanted: Wanted, beside: Option<&TopicBeside>) -> Options {
    Options {
        wanted,
        fields: beside
            .map(|beside| beside.fields.clone())
            .unwrap_or_default(),
        ..Options::default()
    }
}

/// Messages of the samples themselves: what they carry needs no topic beside them.
#[derive(Clone, Copy, Debug)]
pub struct OwnMessages<'a> {
    /// Topic.
    pub topic: &'a str,
    /// Whether they carry a specific force.
    pub has_force: bool,
    /// Whether they carry a magnetic field.
    pub has_field: bool,
    /// Whether they carry a temperature.
    pub has_temperature: bool,
}

/// Chooses what is read beside the samples of `own`; forces that nobody named are noted, not taken.
///
/// # Errors
/// A topic that is not there, or carries nothing of the kind; several that may be meant.
pub fn choose(
    (plan, selection): (&EstimationSettings, &Selection),
    path: &Path,
    log: &Recording,
    own: OwnMessages<'_>,
) -> Result<AuxiliaryInputs> {
    let mut besides = AuxiliaryInputs::default();
    if let Some(beside) = &selection.accel {
        besides.add(named(plan, Wanted::Forces, beside, path, log)?);
    } else if plan.aid == Aid::Auto && !own.has_force {
        besides.notes.extend(forces_not_taken(plan, log, own.topic));
    }
    if let Some(beside) = &selection.mag {
        besides.add(named(plan, Wanted::Fields, beside, path, log)?);
    } else if plan.aid == Aid::GravityAndField && !own.has_field {
        let found = unnamed(plan, path, log, own.topic)?;
        besides.notes.push(format!(
            "the magnetic field was taken from {} ({MAG_TOPIC} NAME takes another)",
            printable(&found.0.channel.topic)
        ));
        besides.add(found);
    }
    if !own.has_temperature
        && let Some(found) = temperature(plan, log, own.topic)
    {
        besides.has_temperature = true;
        besides.add(found);
    }
    Ok(besides)
}

impl AuxiliaryInputs {
    /// Adds the field that belongs to the samples of `own`, where nobody asks for it and it can be told: to be judged
    /// beside them.
    pub fn watch_field(
        &mut self,
        (plan, selection): (&EstimationSettings, &Selection),
        log: &Recording,
        (own, has_field): (&str, bool),
    ) {
        let is_asked = plan.aid == Aid::GravityAndField || selection.mag.is_some();
        if is_asked || has_field {
            return;
        }
        if let Ok(found) = unnamed(plan, log.name(), log, own) {
            self.add(found);
        }
    }
}

/// Topics whose fields belong to the samples of `own`, if that can be told without being stated; else why not.
///
/// # Errors
/// Several that may be meant, or none.
pub(super) fn of_fields(
    plan: &EstimationSettings,
    log: &Recording,
    own: &str,
) -> Result<AuxiliaryInputs> {
    let mut besides = AuxiliaryInputs::default();
    besides.add(unnamed(plan, log.name(), log, own)?);
    Ok(besides)
}

/// The topics of a log with vectors of their own. Found once for all topics of samples: each schema of the log is
/// compiled for it.
#[derive(Debug)]
pub struct Vectors<'l> {
    fields: Vec<TopicOfVectors>,
    forces: Vec<TopicOfVectors>,
    /// The channels of which `--aid gravity+mag` takes one unnamed.
    unnamed: Vec<Readable<'l>>,
}

/// A channel, and how it is read.
type Readable<'l> = (&'l LogChannel, Decoder);

impl<'l> Vectors<'l> {
    /// The topics of `log` with magnetic fields, and with specific forces.
    #[must_use]
    pub fn of(log: &'l Recording) -> Vectors<'l> {
        let plan = EstimationSettings::default();
        let fields = readable(&plan, log, Wanted::Fields);
        Vectors {
            forces: listed(log, Wanted::Forces, &readable(&plan, log, Wanted::Forces)),
            fields: listed(log, Wanted::Fields, &fields),
            unnamed: stamped(&plan, fields),
        }
    }

    /// The topics beside `own` with magnetic fields, of these the one that `--aid gravity+mag` takes unnamed, and the
    /// topics beside it with specific forces.
    #[must_use]
    pub fn beside(&self, own: &str) -> (Vec<TopicOfVectors>, Option<String>, Vec<TopicOfVectors>) {
        let others = |all: &[TopicOfVectors]| -> Vec<TopicOfVectors> {
            all.iter().filter(|t| t.topic != own).cloned().collect()
        };
        let fields = others(&self.fields);
        let taken = one_beside(&self.unnamed, own).ok();
        let taken = taken.map(|(known, _)| known.channel.topic.clone());
        let is_listed = |name: &String| fields.iter().any(|t| t.topic == *name);
        let taken = taken.filter(is_listed);
        (fields, taken, others(&self.forces))
    }
}

/// Note on the specific forces that the log has for samples without any.
fn forces_not_taken(plan: &EstimationSettings, log: &Recording, own: &str) -> Option<String> {
    let forces = readable(plan, log, Wanted::Forces);
    let listed = listed(log, Wanted::Forces, &forces);
    let others = listed.iter().map(|found| found.topic.as_str());
    let names: Vec<&str> = others.filter(|topic| *topic != own).collect();
    let first = names.first()?;
    Some(format!(
        "{} ({AID} gravity {ACCEL_TOPIC} {} takes them)",
        forces_elsewhere(&names),
        printable(first)
    ))
}

/// Words for samples without a specific force in a log that has forces on these topics.
#[must_use]
pub fn forces_elsewhere(topics: &[&str]) -> String {
    format!(
        "the samples carry no specific force, so the gyro alone gives the attitude; forces are on {}",
        named_few(topics)
    )
}

/// The channels with vectors of this kind, with their decoders.
fn readable<'l>(
    plan: &EstimationSettings,
    log: &'l Recording,
    wanted: Wanted,
) -> Vec<Readable<'l>> {
    let mut decoders = Decoders::of_run(plan, &options(wanted, None));
    let channels = log.channels.iter();
    channels
        .filter(|known| known.messages > 0)
        .filter(|known| may_be_field(&known.channel) || is_force_by_name(wanted, known))
        .filter_map(|known| Some((known, known.decoder(&mut decoders).ok()?)))
        .collect()
}

/// The topics of channels without a rate: with one, they are samples of their own. A vector that only its topic names
/// is a force if it begins as long as gravity.
fn listed(log: &Recording, wanted: Wanted, found: &[Readable<'_>]) -> Vec<TopicOfVectors> {
    let secs = log
        .survey
        .times
        .map(|(a, b)| b.saturating_sub(a) as f64 * 1e-9);
    let listed = found.iter().filter(|(known, decoder)| {
        let stated = decoder.stated();
        let is_rate = known.role.has_rate && !is_force_by_name(wanted, known);
        !stated.has_gyro && !is_rate && stated.has_stamp
    });
    listed
        .filter_map(|(known, decoder)| {
            let mut samples = Vec::new();
            if let Some((at, payload)) = &known.first {
                let _ = decoder.decode(payload, *at, *at, &mut samples);
            }
            let vector = samples.first().and_then(|raw| match wanted {
                Wanted::Fields => raw.mag,
                _ => raw.accel,
            });
            let first = vector.map(|[x, y, z]| x.hypot(y).hypot(z));
            let is_gravity = first.is_some_and(|length| GRAVITY.contains(&length));
            let is_one = may_be_field(&known.channel) || is_gravity;
            is_one.then(|| TopicOfVectors {
                topic: known.channel.topic.clone(),
                described: described(&known.channel).to_string(),
                rate_hz: secs
                    .filter(|secs| *secs > 0.0)
                    .map(|secs| known.messages.saturating_sub(1) as f64 / secs),
                first,
            })
        })
        .collect()
}

fn named<'l>(
    plan: &EstimationSettings,
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

/// The topic whose field is taken unnamed.
fn unnamed<'l>(
    plan: &EstimationSettings,
    path: &Path,
    log: &'l Recording,
    own: &str,
) -> Result<Readable<'l>> {
    let found = stamped(plan, readable(plan, log, Wanted::Fields));
    let one = one_beside(&found, own).map_err(|what| Error::unsupported(path, what))?;
    Ok(one.clone())
}

/// Keeps the channels whose messages can be placed in time.
fn stamped<'l>(plan: &EstimationSettings, mut found: Vec<Readable<'l>>) -> Vec<Readable<'l>> {
    found.retain(|(_, decoder)| decoder.stated().has_stamp || plan.clock != Clock::Header);
    found
}

/// The one topic with a field, or of several the one beside the samples: `/imu/mag` beside `/imu/data`.
fn one_beside<'f, 'l>(
    all: &'f [Readable<'l>],
    own: &str,
) -> std::result::Result<&'f Readable<'l>, Diagnostic> {
    let folder = |topic: &str| topic.rsplit_once('/').map(|(folder, _)| folder.to_owned());
    let is_beside = |(known, _): &&Readable<'_>| folder(&known.channel.topic) == folder(own);
    let mut beside = all.iter().filter(is_beside);
    let found = match (all, beside.next(), beside.next()) {
        ([one], ..) | (_, Some(one), None) => return Ok(one),
        _ => all,
    };
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
    Err(what)
}

/// The topic with the temperature of the sensor behind `own`: beside or below it, or called after an IMU. None where
/// several may be meant: nothing is estimated by it.
fn temperature<'l>(
    plan: &EstimationSettings,
    log: &'l Recording,
    own: &str,
) -> Option<Readable<'l>> {
    let mut decoders = Decoders::of_run(plan, &options(Wanted::Temperatures, None));
    let is_one = |known: &&LogChannel| {
        let schema = known.channel.schema.as_deref().map_or("", |s| &s.name);
        schema.rsplit(['/', '.']).next() == Some("Temperature")
    };
    let folder = own.rsplit_once('/').map_or("", |(folder, _)| folder);
    let is_near = |known: &&LogChannel| {
        let topic = known.channel.topic.as_str();
        let below = topic
            .strip_prefix(folder)
            .is_some_and(|rest| rest.starts_with('/'));
        let name = topic.to_ascii_lowercase();
        (below && !folder.is_empty()) || ["imu", "gyro"].iter().any(|word| name.contains(word))
    };
    let channels = log.channels.iter().filter(|known| known.messages > 0);
    let mut found = channels.filter(is_one).filter(is_near);
    match (found.next(), found.next()) {
        (Some(one), None) => Some((one, one.decoder(&mut decoders).ok()?)),
        _ => None,
    }
}

/// Whether a topic's fields may be taken unnamed: a vector of no name may be anything.
pub fn may_be_field(channel: &Channel) -> bool {
    let schema = channel.schema.as_deref().map_or("", |s| &s.name);
    !schema.ends_with("Vector3Stamped")
}

/// Whether specific forces are wanted, and the topic of a vector says that it is one: `/imu/acceleration`, and not an
/// angular one.
fn is_force_by_name(wanted: Wanted, known: &LogChannel) -> bool {
    let topic = known.channel.topic.to_ascii_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| topic.contains(word));
    wanted == Wanted::Forces
        && !may_be_field(&known.channel)
        && has(&["acc", "specific_force"])
        && !has(&["ang", "gyro", "bias", "cmd", "target", "setpoint"])
}
