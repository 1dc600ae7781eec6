//! A log -> everything that is known about its quality: looked at, then integrated once. I/O.
//!
//! The second pass is an ordinary replay without outputs, so that what `check` says about verdicts,
//! gaps and turns per step is what a replay would do, and not another program's opinion.

use super::log::{Log, problems};
use super::look::{Looked, look};
use super::pool::Pool;
use super::replay;
use super::run::{Replay, Source};
use crate::config::Plan;
use crate::decode;
use crate::error::{Error, Result};
use crate::report::summary::TopicSummary;
use crate::sink;
use std::path::Path;

/// A log, examined.
#[derive(Debug)]
pub struct Checked {
    /// What is wrong with the file itself, the first few in words.
    pub problems: Vec<String>,
    /// How many of those lost data.
    pub file_losses: u64,
    /// Topics that sound like an IMU's and can not be decoded: why.
    pub refused: Vec<String>,
    /// Its topics of samples.
    pub topics: Vec<CheckedTopic>,
}

/// A topic of samples, looked at and replayed.
#[derive(Debug)]
pub struct CheckedTopic {
    /// Statistics of the samples as recorded.
    pub looked: Looked,
    /// What a replay with default flags makes of them, or why it refuses.
    pub replayed: std::result::Result<Box<TopicSummary>, String>,
}

/// Examines a log, or one topic of it.
///
/// # Errors
/// It can not be read, or holds no such topic.
pub fn check(
    path: &Path,
    named: Option<&str>,
    options: &decode::Options,
    pool: &Pool,
) -> Result<Checked> {
    let log = Log::open(path, pool)?;
    if let Some(topic) = named
        && !log.channels.iter().any(|k| k.channel.topic == topic)
    {
        return Err(Error::NoSuchTopic {
            path: path.to_owned(),
            topic: topic.to_owned(),
            topics: super::topics::listing(&log.candidates()),
        });
    }
    let (looked, survey) = look(path, &log, named, options, pool)?;
    let has_reference = log
        .channels
        .iter()
        .any(|k| k.role.has_orientation && k.messages > 0);
    let refused = if looked.is_empty() {
        // With what it says about channels that only sound like one.
        log.choose(path, None)
            .err()
            .map(|e| e.to_string())
            .into_iter()
            .collect()
    } else {
        Vec::new()
    };
    let topics = looked
        .into_iter()
        .filter(|l| named.is_none_or(|name| l.topic == name))
        .map(|looked| CheckedTopic {
            replayed: integrate(path, &looked.topic, options, has_reference, pool),
            looked,
        })
        .collect();
    Ok(Checked {
        problems: problems(&survey),
        file_losses: survey.problems.losses(),
        refused,
        topics,
    })
}

fn integrate(
    path: &Path,
    topic: &str,
    options: &decode::Options,
    has_reference: bool,
    pool: &Pool,
) -> std::result::Result<Box<TopicSummary>, String> {
    let run = Replay {
        source: Source::File(path.to_owned()),
        targets: Vec::new(),
        plan: Plan {
            topic: Some(topic.to_owned()),
            decode: options.clone(),
            ..Plan::default()
        },
        options: sink::Options::default(),
        copy_input: false,
        out_rate: None,
        speed: None,
        cast: None,
        against: has_reference.then(String::new),
        command: "strapd check".to_owned(),
    };
    let summary = replay::run(&run, pool, &mut |_| {}).map_err(|e| e.to_string())?;
    let found = summary.topics.into_iter().next();
    found
        .map(Box::new)
        .ok_or_else(|| "the replay gave nothing".to_owned())
}
