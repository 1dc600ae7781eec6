//! A log -> everything that is known about its quality: looked at, then integrated once. I/O.
//!
//! The second pass is a replay of all topics at once without outputs, so that what `check` says about verdicts,
//! gaps and turns per step is what a replay would do, and not another program's opinion.

use super::attitude_track::Track;
use super::inspection::look_as;
use super::mend;
use super::position::Position;
use super::replay_topics::each;
use super::request::ReplayRequest;
use super::summarise::TopicOutcome;
use crate::error::{Error, Result};
use crate::findings::no_topic;
use crate::inspection::{Checked, CheckedTopic, Inspection};
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_recording::Input;
use strapd_recording::Recording;
use strapd_recording::Selection;
use strapd_recording::decode;
use strapd_recording::pool::Pool;
use strapd_recording::recording::log_channel::LogChannel;
use strapd_recording::recording::opened::problems;

/// Series that a report wants of the replays beside their summaries.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<'a> {
    /// Stretches of time each series is drawn in.
    pub stretches: usize,
    /// A reference from another file; `None` = as the run says.
    pub reference: Option<&'a Track>,
}

/// Settings by which a log is examined.
#[derive(Clone, Debug)]
pub struct Examination<'a> {
    /// Selection; its topic is the only one looked at.
    pub selection: Selection,
    /// Settings by which samples are understood and integrated.
    pub plan: EstimationSettings,
    /// The topic of the reference in the log, empty = found.
    pub reference_topic: String,
    /// Series to draw of the replays.
    pub drawing: Option<Drawing<'a>>,
    /// The command as typed.
    pub command: String,
}

/// Examines a log, or one topic of it, as a replay with default flags understands it.
///
/// # Errors
/// It cannot be read, or holds no such topic.
pub fn check(
    input: &Input,
    named: Option<&str>,
    options: &decode::Options,
    pool: &Pool,
) -> Result<Checked> {
    let examination = Examination {
        selection: Selection {
            topic: named.map(str::to_owned),
            decode: options.clone(),
            ..Selection::default()
        },
        plan: EstimationSettings {
            aid: Aid::Auto,
            ..EstimationSettings::default()
        },
        reference_topic: String::new(),
        drawing: None,
        command: "strapd check".to_owned(),
    };
    examine(input, &examination, pool, &mut |_| {})
}

/// Examines a log, or one topic of it.
///
/// # Errors
/// It cannot be read, or holds no such topic.
pub fn examine(
    input: &Input,
    asked: &Examination<'_>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<Checked> {
    let plan = mend::settled(&asked.plan, |plan| {
        let trial = Examination {
            plan: plan.clone(),
            drawing: None,
            ..asked.clone()
        };
        let mut topics = examine_by(input, &trial, pool, &mut |_| {})?.topics;
        topics.retain(|topic| topic.looked.is_likely);
        let one = topics.pop().filter(|_| topics.is_empty());
        let replayed = one.and_then(|topic| topic.replayed.ok());
        Ok::<_, Error>(replayed.map(|summary| summary.findings))
    })?;
    let mut asked = Examination {
        plan,
        ..asked.clone()
    };
    asked.selection.decode.is_unit_stated = asked.plan.states_gyro_unit();
    examine_by(input, &asked, pool, watch)
}

fn examine_by(
    input: &Input,
    asked: &Examination<'_>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<Checked> {
    let named = asked
        .selection
        .topic
        .as_deref()
        .filter(|name| *name != "all");
    let path = input.name();
    let log = Recording::told_apart(input, named, &asked.selection.decode, pool)?;
    let reference = Some(asked.reference_topic.as_str()).filter(|name| !name.is_empty());
    are_there(&log, named.into_iter().chain(reference))?;
    let looks = look_as(&log, named, (&asked.selection.decode, &asked.plan), pool)?;
    let has_reference = asked.drawing.is_some_and(|d| d.reference.is_some())
        || log.channels.iter().any(LogChannel::has_attitudes);
    let no_topic = match looks.topics.is_empty() {
        true => log.choose(path, None).err().as_ref().map(no_topic),
        false => None,
    };
    let mut looked: Vec<Inspection> = looks
        .topics
        .into_iter()
        .filter(|l| named.is_none_or(|name| l.topic == name || l.of == name))
        .collect();
    if named.is_some() {
        looked.iter_mut().for_each(|l| l.is_likely = true);
    }
    let names: Vec<String> = looked.iter().map(|l| l.topic.clone()).collect();
    let replayed = integrate(&log, &names, asked, has_reference, pool, watch)?;
    let topics = looked
        .into_iter()
        .zip(replayed)
        .map(|(looked, replayed)| CheckedTopic { looked, replayed })
        .collect();
    let survey = &looks.survey;
    Ok(Checked {
        problems: problems(survey),
        file_losses: survey.problems.losses(),
        file_size: survey.file_size,
        profile: survey.facts.profile.clone(),
        made_before: log.made_before().filter(|_| named.is_none()),
        no_topic,
        is_gyro_alone: asked.plan.aid == Aid::None,
        plan: asked.plan.clone(),
        topics,
        left_out: match named {
            Some(_) => Vec::new(),
            None => looks.left_out,
        },
    })
}

/// Refuses topics that are not in the log.
fn are_there<'n>(log: &Recording, names: impl Iterator<Item = &'n str>) -> Result<()> {
    for topic in names {
        if !log.has(topic) {
            return Err(strapd_recording::Error::NoSuchTopic {
                path: log.name().to_owned(),
                topic: topic.to_owned(),
                topics: strapd_recording::recording::topics::listing(&log.candidates()),
            }
            .into());
        }
    }
    Ok(())
}

fn integrate(
    log: &Recording,
    topics: &[String],
    asked: &Examination<'_>,
    has_reference: bool,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<Vec<TopicOutcome>> {
    if topics.is_empty() {
        return Ok(Vec::new());
    }
    let run = ReplayRequest {
        selection: asked.selection.clone(),
        plan: asked.plan.clone(),
        against: has_reference.then(|| asked.reference_topic.clone()),
        command: asked.command.clone(),
        ..ReplayRequest::new(log.input().source().clone())
    };
    each(&run, log, topics, asked.drawing.as_ref(), pool, watch)
}
