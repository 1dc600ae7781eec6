//! A surveyed log -> the topics of a run with their decoders, and what each channel is for. Pure.
//!
//! Apart from the replay because it is all choice and no work: which topics, under which names, held
//! against which reference.

use super::request::ReplayRequest;
use super::session::TopicInfo;
use crate::error::{Error, Result};
use crate::sink::{Stream, output_topic};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Meaning;
use strapd_attitude::setting::{FIELD, TOPIC};
use strapd_recording::Recording;
use strapd_recording::decode::Decoder;
use strapd_recording::mcap::Channel;
use strapd_recording::recording::beside::{self, AuxiliaryInputs, OwnMessages};
use strapd_recording::recording::channel_route::{PayloadNotes, Route, RouteTarget};
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::log_channel::LogChannel;
use strapd_recording::recording::sources::{Publisher, is_same};
use strapd_recording::recording::topic_plan::{self, TopicPlan};
use strapd_recording::recording::topics;

/// A topic that was chosen, and how it is read.
pub(super) struct RunTopic<'l> {
    pub(super) found: TopicInfo,
    pub(super) stream: Stream,
    plan: TopicPlan<'l>,
}

pub(super) fn choose<'l>(
    run: &ReplayRequest,
    path: &Path,
    log: &'l Recording,
    names: &[String],
) -> Result<Vec<RunTopic<'l>>> {
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
pub(super) fn choose_each<'l>(
    run: &ReplayRequest,
    path: &Path,
    log: &'l Recording,
    names: &[String],
    decoders: &mut Decoders,
) -> Vec<Result<RunTopic<'l>>> {
    let taken = BTreeSet::new();
    names
        .iter()
        .map(|name| choose_one(run, (path, log), name, &taken, decoders))
        .collect()
}

fn choose_one<'l>(
    run: &ReplayRequest,
    (path, log): (&Path, &'l Recording),
    name: &str,
    taken: &BTreeSet<String>,
    decoders: &mut Decoders,
) -> Result<RunTopic<'l>> {
    let plan = TopicPlan::named(log, name, decoders)?;
    let (first, decoder) = plan.first_with_rate(path)?;
    let topic = output_topic(&plain_name(&plan.source), taken);
    let mut stream = Stream::new(name, &plan.frame());
    stream.output_topic = topic.clone();
    let found = TopicInfo {
        name: name.to_owned(),
        output_topic: topic,
        described: first.read_as(),
        resolved: Meaning::new(&run.plan, &decoder.stated().declared),
        noticed: Arc::new(PayloadNotes::of(&plan.source)),
        warnings: plan
            .refusals
            .iter()
            .map(Diagnostic::from)
            .chain(which_stamp(decoder).map(Into::into))
            .collect(),
    };
    Ok(RunTopic {
        found,
        stream,
        plan,
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
    chosen: &mut [RunTopic<'_>],
) -> Result<AuxiliaryInputs> {
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
        return Ok(AuxiliaryInputs::default());
    };
    let stated = || {
        one.plan
            .channels
            .iter()
            .map(|(_, decoder)| decoder.stated())
    };
    let own = OwnMessages {
        topic: &one.plan.source.topic,
        has_force: stated().any(|stated| stated.has_accel),
        has_field: stated().any(|stated| stated.has_mag),
        has_temperature: stated().any(|stated| stated.has_temperature),
    };
    let mut besides = beside::choose((&run.plan, &run.selection), path, log, own)?;
    one.found
        .warnings
        .extend(besides.notes.drain(..).map(Diagnostic::from));
    one.stream.has_temperature = besides.has_temperature;
    Ok(besides)
}

/// Adds a field that nobody asked for to what is read beside the samples of the one topic chosen, to be judged.
pub(super) fn watch_field(
    run: &ReplayRequest,
    log: &Recording,
    chosen: &[RunTopic<'_>],
    besides: &mut AuxiliaryInputs,
) {
    let [one] = chosen else { return };
    let has_field = one.plan.channels.iter().any(|(_, d)| d.stated().has_mag);
    let own = (one.plan.source.topic.as_str(), has_field);
    besides.watch_field((&run.plan, &run.selection), log, own);
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
    pub(super) fn is_of(&self, chosen: &RunTopic<'_>) -> bool {
        self.channel.topic == chosen.plan.source.topic
    }
}

/// The channel whose orientations the estimate is held against: the one asked for, or (empty) found; `None` = the
/// samples' own. Where each of the topics is by itself (`apart`), one of them may be the reference of the others.
pub(super) fn reference(
    run: &ReplayRequest,
    path: &Path,
    log: &Recording,
    chosen: &[RunTopic<'_>],
    (asked, apart): (Option<&str>, bool),
) -> Result<Option<Reference>> {
    let Some(asked) = asked else {
        return Ok(None);
    };
    let names: BTreeSet<&str> = chosen
        .iter()
        .map(|c| c.plan.source.topic.as_str())
        .collect();
    let taken = |k: &&LogChannel| names.contains(k.channel.topic.as_str());
    let found = if asked.is_empty() {
        let is_of_one = |k: &LogChannel| {
            let mut frames = chosen.iter().map(|c| c.stream.frame_id.as_str());
            frames.any(|frame| k.is_reference_of(frame))
        };
        let mut others = log.channels.iter().filter(|k| !taken(k) && is_of_one(k));
        match (others.next(), others.next()) {
            // An odometry's or a camera's pose beside an IMU that has its own is another matter.
            (Some(one), None) if !one.role.has_rate => one,
            _ => return Ok(None),
        }
    } else {
        let Some(named) = log.channels.iter().find(|k| k.channel.topic == *asked) else {
            return Err(strapd_recording::Error::NoSuchTopic {
                path: path.to_owned(),
                topic: asked.to_owned(),
                topics: topics::listing(&log.candidates()),
            }
            .into());
        };
        if taken(&named) && !apart {
            return Ok(None);
        }
        named
    };
    let decoder = found
        .decoder(&mut Decoders::default())
        .map_err(|why| Error::unsupported(path, &why))?;
    Ok(Some(Reference {
        channel: found.channel.clone(),
        resolved: Meaning::new(&run.plan, &decoder.stated().declared),
        decoder,
    }))
}

/// The way of a channel's messages to the streams, with what is noticed put aside.
pub(super) fn looked_at(
    chosen: &[RunTopic<'_>],
    besides: Option<&AuxiliaryInputs>,
    channel: &Channel,
) -> Option<Route> {
    let beside = besides.and_then(|besides| besides.decoder(channel).cloned());
    let samples = to_streams(chosen, channel, |chosen| {
        Arc::new(PayloadNotes::of(&chosen.plan.source))
    });
    match samples {
        Some(samples) => Some(samples.beside(beside)),
        None => Route::other(beside, None),
    }
}

fn to_streams(
    chosen: &[RunTopic<'_>],
    channel: &Channel,
    noticed: impl Fn(&RunTopic<'_>) -> Arc<PayloadNotes>,
) -> Option<Route> {
    let plans = chosen.iter().map(|c| &c.plan);
    topic_plan::route(plans, channel, |stream, _| RouteTarget {
        stream,
        noticed: chosen.get(stream).map(&noticed).unwrap_or_default(),
    })
}

pub(super) fn route(
    chosen: &[RunTopic<'_>],
    reference: Option<&Reference>,
    besides: &AuxiliaryInputs,
    copy_input: bool,
    channel: &Arc<Channel>,
) -> Option<Route> {
    let beside = besides.decoder(channel).cloned();
    let copied = copy_input.then(|| channel.clone());
    let compared = reference.filter(|r| is_same(&r.channel, channel));
    let compared = compared.map(|r| r.decoder.clone());
    let samples = to_streams(chosen, channel, |chosen| chosen.found.noticed.clone());
    match (samples, compared) {
        (Some(samples), compared) => {
            Some(samples.comparing(compared).beside(beside).copying(copied))
        }
        (None, Some(decoder)) => Some(Route::reference(decoder).beside(beside).copying(copied)),
        (None, None) => Route::other(beside, copied),
    }
}
