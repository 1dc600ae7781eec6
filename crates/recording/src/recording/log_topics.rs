//! A surveyed log -> the topics to estimate from, and why there are none. Pure.
//!
//! Apart from the survey because nothing is read: who speaks, what each channel can serve as and which are our own outputs
//! are known, and the choice follows.

use super::decoders::Decoders;
use super::line_input::no_rates;
use super::log_channel::{LogChannel, described, rank};
use super::opened::Recording;
use super::sources::{self, Publisher};
use super::topics::{self, Candidate, Choice, PICKED_UNNAMED};
use crate::decode::Unsupported;
use crate::error::{Error, Result};
use crate::text::printable;
use std::collections::BTreeMap;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;

/// Most refusals, and most faults of the file, that an error goes into.
const SAID: usize = 3;

impl Recording {
    /// The source of this name. `TOPIC@FRAME` is one even if nobody named that frame so far.
    #[must_use]
    pub fn source(&self, name: &str) -> Option<Publisher> {
        if let Some(known) = self.sources.iter().find(|s| s.name == name) {
            return Some(known.clone());
        }
        let (whole, frame) = sources::by_topic(&self.channels)
            .into_iter()
            .find_map(|s| Some((s.clone(), name.strip_prefix(&s.topic)?.strip_prefix('@')?)))?;
        Some(Publisher {
            name: name.to_owned(),
            frame: Some(frame.to_owned()),
            label: frame.to_owned(),
            others: self
                .sources
                .iter()
                .filter(|s| s.topic == whole.topic)
                .filter_map(|s| s.frame.clone())
                .collect(),
            ..whole
        })
    }

    /// Whether `--topic` of this name can be meant: a topic, or one of several sources on it.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.channels.iter().any(|k| k.channel.topic == name) || self.source(name).is_some()
    }

    /// The topics to estimate from ([`topics::choose`]). Where there are none, the error also says
    /// what is wrong with those that sound like an IMU, and with the file.
    ///
    /// # Errors
    /// As [`topics::choose`].
    pub fn choose(&self, path: &Path, named: Option<&str>) -> Result<Choice> {
        if let Some(name) = named.filter(|name| *name != "all") {
            let mut rivals = self.candidates();
            rivals.retain(|c| c.topic != name && c.of == name);
            if !rivals.is_empty() {
                return Err(Error::SeveralImuTopics {
                    path: path.to_owned(),
                    topics: topics::listing(&rivals),
                });
            }
            if self.source(name).is_some() {
                return Ok(Choice {
                    topics: vec![name.to_owned()],
                    note: None,
                });
            }
        }
        topics::choose(path, &self.candidates(), named)
            .map_err(|error| explained(error, &self.channels, &self.problems))
    }

    /// Candidates for the choice of topics: one for each source.
    #[must_use]
    pub fn candidates(&self) -> Vec<Candidate> {
        let mut users: BTreeMap<usize, usize> = BTreeMap::new();
        for channel in self.sources.iter().flat_map(|s| &s.channels) {
            *users.entry(*channel).or_default() += 1;
        }
        let is_shared = |channel: &usize| users.get(channel).is_some_and(|n| *n > 1);
        self.sources
            .iter()
            .map(|s| self.candidate(s, s.channels.iter().any(is_shared)))
            .collect()
    }

    /// `is_shared`: another source has messages on its channels.
    fn candidate(&self, source: &Publisher, is_shared: bool) -> Candidate {
        let first = self.channels_of(source).next();
        let mut said = first.map_or_else(String::new, |k| described(&k.channel).to_string());
        if !source.label.is_empty() {
            let publishers = first.map_or_else(String::new, |k| sources::publisher(&k.channel));
            for (what, name) in [
                ("frame", source.frame.as_deref().unwrap_or_default()),
                ("publisher", publishers.as_str()),
            ] {
                if !name.is_empty() {
                    said.push_str(&format!("  {what} {name}"));
                }
            }
        }
        Candidate {
            topic: source.name.clone(),
            of: source.topic.clone(),
            described: said,
            // How many of a channel's messages are whose is known at the end.
            messages: (!is_shared).then(|| self.channels_of(source).map(|k| k.messages).sum()),
            rank: self
                .channels_of(source)
                .map(LogChannel::rank)
                .max()
                .unwrap_or(0),
            is_derived: first.is_some_and(|known| known.is_derived),
            sensor_column: first.and_then(|known| known.sensor_column.clone()),
        }
    }
}

/// "No IMU topic" with what is wrong with those that sound like one, and with the file.
#[must_use]
pub fn explained(error: Error, channels: &[LogChannel], problems: &[String]) -> Error {
    let Error::NoImuTopic {
        path, mut topics, ..
    } = error
    else {
        return error;
    };
    if let Some(format) = channels.iter().find_map(|known| known.channel.text) {
        return no_rates(&path, format, "");
    }
    let sounds_like_one = |k: &&LogChannel| {
        let name = k.channel.schema.as_deref().map_or("", |s| &s.name);
        !k.role.has_rate && name.to_ascii_lowercase().contains("imu")
    };
    let is_empty = |k: &&LogChannel| k.messages == 0 && rank(&k.role) >= PICKED_UNNAMED;
    for empty in channels.iter().filter(is_empty).take(SAID) {
        topics.push_str(&format!(
            "\n  {} is of an IMU and has no message",
            printable(&empty.channel.topic)
        ));
    }
    let mut decoders = Decoders::default();
    let refusals = channels
        .iter()
        .filter(sounds_like_one)
        .filter_map(|k| k.decoder(&mut decoders).err())
        .map(|why| Diagnostic::from(&why));
    for why in refusals.take(SAID) {
        // Its own help is about naming a field; so is the error's.
        topics.push_str(&format!("\n  {}", why.what()));
    }
    for problem in problems.iter().take(SAID) {
        topics.push_str(&format!("\n  the file is damaged: {problem}"));
    }
    let undefined = channels
        .iter()
        .filter(|k| k.messages > 0)
        .filter_map(|k| k.decoder(&mut decoders).err())
        .find(Unsupported::is_undefined)
        .map(|why| why.type_name);
    Error::NoImuTopic {
        path,
        topics,
        undefined,
    }
}
