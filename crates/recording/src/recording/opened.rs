//! A log's channels and first messages -> what is in it and how to read it. I/O.
//!
//! Apart from what is done with samples because whoever wants some asks the same questions first: which
//! channels, which of them carry a rate or an orientation, and a decoder that has seen a message.

use super::channel_route::{Item, Route};
use super::decoders::Decoders;
use super::first_messages::first_messages;
use super::input::Input;
use super::line_input::only_for_tables;
use super::log_channel::{LogChannel, known};
use super::own_output::{self, MadeBefore};
use super::parts::{self, Same, Whole};
use super::sample_cache;
use super::sources::{self, ChannelMap, Publisher};
use super::text_log::TextLog;
use crate::decode::Options;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::mcap::{self, Channel, Reader, Survey, WalkOptions};
use crate::pool::Pool;
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::record::Nanos;

/// A recording, surveyed.
#[derive(Debug)]
pub struct Recording {
    input: Input,
    body: Body,
    /// Survey of its contents.
    pub survey: Survey,
    /// Channels, with the roles in which they can serve.
    pub channels: Vec<LogChannel>,
    /// Publishers on its topics: one for each until `sources::tell_apart` has looked.
    pub sources: Vec<Publisher>,
    /// Problems found as far as it was read: all of it when it has no summary, otherwise up
    /// to the first message of the last channel.
    pub problems: Vec<String>,
    /// Notes for the reader of its tables.
    notes: Vec<String>,
    /// Why the unit of its rates may be another one.
    doubt: Option<String>,
}

/// Body of a log as it is read again.
#[derive(Debug)]
enum Body {
    Mcap(Reader),
    Text(Box<TextLog>),
    /// Parts in the order of their times.
    Parts(Vec<(Recording, Same)>),
}

/// Says the way of a channel's messages, once a channel; not for each caller anew, as the walk behind it is long.
type Select<'s> = &'s mut dyn FnMut(&Arc<Channel>) -> Option<Route>;

/// Gets what becomes of messages, a batch at a time.
type Take<'t> = &'t mut dyn FnMut(&mut Vec<Item>) -> ControlFlow<()>;

impl Recording {
    /// Surveys a recording.
    ///
    /// # Errors
    /// It cannot be read, or is none.
    pub fn of(input: &Input, options: &Options, pool: &Pool) -> Result<Recording> {
        let log = Recording::surveyed(input, options, pool)?;
        log.say_notes();
        Ok(log)
    }

    fn surveyed(input: &Input, options: &Options, pool: &Pool) -> Result<Recording> {
        match input.parts().len() {
            0 => Recording::of_one(input, options, sample_cache::MOST, pool),
            _ => Recording::of_parts(input, options, pool),
        }
    }

    /// Surveys what is in one file, of whose rows at most so many bytes of samples are kept.
    fn of_one(input: &Input, options: &Options, kept: u64, pool: &Pool) -> Result<Recording> {
        if !input.format().is_text() {
            only_for_tables(input.name(), input.format(), options)?;
            return Recording::of_mcap(input, pool);
        }
        let (mut text, channels) = TextLog::survey(input, options, kept)?;
        let (notes, doubt) = std::mem::take(&mut text.notes);
        Ok(Recording {
            notes,
            doubt,
            input: input.clone(),
            survey: text.surveyed().clone(),
            body: Body::Text(Box::new(text)),
            sources: sources::by_topic(&channels),
            channels,
            problems: Vec::new(),
        })
    }

    fn of_parts(input: &Input, options: &Options, pool: &Pool) -> Result<Recording> {
        let (mut logs, mut empty) = (Vec::new(), Vec::new());
        // All in memory: a file for each were too many of them.
        let kept = sample_cache::IN_MEMORY / input.parts().len().max(1) as u64;
        // Of the others what cannot be decoded has no message, either.
        let counts = matches!(
            input.format(),
            Format::Mcap | Format::Ulog | Format::Bag | Format::Rosbag2
        );
        for path in input.parts() {
            let log = Recording::of_one(&Input::open(path, input.warn())?, options, kept, pool)?;
            log.say_notes();
            match log.survey.times {
                Some(times) => logs.push((times, log)),
                None if counts && log.channels.iter().all(|known| known.messages == 0) => {
                    empty.push(log);
                }
                None => return Err(parts::without_time(path)),
            }
        }
        if let (true, Some(log)) = (logs.is_empty(), empty.first()) {
            return Err(parts::without_time(log.name()));
        }
        logs.sort_by_key(|(times, _)| *times);
        let mut whole = Whole::new(input.warn());
        let (mut problems, mut body) = (Vec::new(), Vec::new());
        for log in logs.iter().map(|(_, log)| log).chain(&empty) {
            let name = log.name().display();
            problems.extend(log.problems.iter().map(|what| format!("{name}: {what}")));
        }
        // The last part of a recorder that was killed.
        for log in &empty {
            parts::say_left_out(log.name(), input.warn());
        }
        for (times, log) in logs {
            let same = whole.add((log.name(), times), &log.channels, &log.survey)?;
            body.push((log, same));
        }
        Ok(Recording {
            input: input.clone(),
            notes: Vec::new(),
            doubt: None,
            body: Body::Parts(body),
            survey: whole.survey,
            sources: sources::by_topic(&whole.channels),
            channels: whole.channels,
            problems,
        })
    }

    fn of_mcap(input: &Input, pool: &Pool) -> Result<Recording> {
        let reader = input.mcap()?;
        let options = WalkOptions {
            pool: Some(pool.rayon()),
            ..WalkOptions::default()
        };
        let survey = mcap::survey(&reader, &options)?;
        let (firsts, met) = match reader.again() {
            Some(again) => first_messages(again, &survey)?,
            None => (Vec::new(), Vec::new()),
        };
        let mut by_channel = BTreeMap::new();
        for first in &firsts {
            by_channel
                .entry((first.id, first.topic.as_str()))
                .or_insert(first);
        }
        let mut decoders = Decoders::default();
        let mut channels: Vec<LogChannel> = survey
            .channels
            .iter()
            .map(|found| {
                let first = by_channel
                    .get(&(found.channel.id, found.channel.topic.as_str()))
                    .map(|f| (f.log, f.data.clone()));
                known(&found.channel, found.messages, first, &mut decoders)
            })
            .collect();
        own_output::mark(&mut channels, &survey);
        Ok(Recording {
            problems: match problems(&survey) {
                none if none.is_empty() => met,
                whole => whole,
            },
            input: input.clone(),
            notes: Vec::new(),
            doubt: None,
            body: Body::Mcap(reader),
            survey,
            sources: sources::by_topic(&channels),
            channels,
        })
    }

    /// Surveys a recording, and looks at who speaks on its topics: whatever integrates samples must
    /// know. `named` is `--topic`.
    ///
    /// # Errors
    /// As [`Recording::of`].
    pub fn told_apart(
        input: &Input,
        named: Option<&str>,
        options: &Options,
        pool: &Pool,
    ) -> Result<Recording> {
        let log = Recording::told_apart_with_notes(input, named, options, pool)?;
        log.say_notes();
        Ok(log)
    }

    /// The same for whoever reports its [`Recording::notes`] elsewhere than in warnings.
    ///
    /// # Errors
    /// As [`Recording::of`].
    pub fn told_apart_with_notes(
        input: &Input,
        named: Option<&str>,
        options: &Options,
        pool: &Pool,
    ) -> Result<Recording> {
        let mut log = Recording::surveyed(input, options, pool)?;
        let told = {
            let readers: Vec<(Reader, ChannelMap<'_>)> = match &log.body {
                Body::Parts(parts) => parts
                    .iter()
                    .filter_map(|(log, same)| {
                        let known: ChannelMap<'_> = Box::new(|met| same.known(met));
                        Some((log.reader()?, known))
                    })
                    .collect(),
                _ => {
                    let known = |reader| (reader, Box::new(Arc::clone) as ChannelMap<'_>);
                    log.reader().into_iter().map(known).collect()
                }
            };
            match readers.is_empty() {
                true => None,
                false => {
                    let channels = &mut log.channels;
                    Some(sources::tell_apart(
                        readers, channels, named, options, pool,
                    )?)
                }
            }
        };
        if let Some(told) = told {
            log.sources = told;
        }
        Ok(log)
    }

    /// Notes on how its table is read; that the unit of its rates may be another one only if that is not `stated`.
    pub fn notes(&self, stated: bool) -> impl Iterator<Item = &String> {
        let doubt = self.doubt.iter().filter(move |_| !stated);
        self.notes.iter().chain(doubt)
    }

    fn say_notes(&self) {
        for note in self.notes(false) {
            let said = format!("{}: {note}", self.name().display());
            self.input.warn().say(&said);
        }
    }

    /// The channels of a source.
    pub fn channels_of<'l>(&'l self, source: &Publisher) -> impl Iterator<Item = &'l LogChannel> {
        let indices = source.channels.clone();
        indices.into_iter().filter_map(|n| self.channels.get(n))
    }

    /// Whether there is nothing in it but attitudes that strapd made before.
    #[must_use]
    pub fn made_before(&self) -> Option<MadeBefore> {
        if !self.input.format().is_text() {
            return own_output::in_survey(&self.survey);
        }
        let mut head = Vec::new();
        let bytes = self.input.text(&Options::default()).ok()?;
        bytes.take(own_output::HEAD).read_to_end(&mut head).ok()?;
        own_output::in_text(&head)
    }

    /// Name in messages.
    #[must_use]
    pub fn name(&self) -> &Path {
        self.input.name()
    }

    /// Place of a payload, in words: a line has its number where others have a time.
    #[must_use]
    pub fn place_of(&self, at: Nanos) -> String {
        match &self.body {
            Body::Mcap(_) => format!("logged at {} ns", at.0),
            Body::Text(_) => format!("line {}", at.0),
            Body::Parts(parts) => match parts.first() {
                Some((log, _)) => log.place_of(at),
                None => String::new(),
            },
        }
    }

    /// The recording.
    #[must_use]
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// An MCAP once more, from its beginning.
    #[must_use]
    pub fn reader(&self) -> Option<Reader> {
        match &self.body {
            Body::Mcap(reader) => reader.again(),
            Body::Text(_) | Body::Parts(_) => None,
        }
    }

    /// Reads it once. `select` says the way of a channel's messages, `take` gets what becomes of them in order, and may
    /// take it out of the vector; what it fails with ends it. At most `ahead` bytes are on their way at once. What
    /// was met.
    ///
    /// # Errors
    /// It cannot be read; as `take`.
    pub fn walk<E: From<Error>>(
        &self,
        ahead: usize,
        pool: &Pool,
        mut select: impl FnMut(&Arc<Channel>) -> Option<Route>,
        mut take: impl FnMut(&mut Vec<Item>) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<Survey, E> {
        let mut failure = None;
        let survey = self.walk_all(ahead, pool, &mut select, &mut |items| {
            take(items).unwrap_or_else(|why| {
                failure = Some(why);
                ControlFlow::Break(())
            })
        })?;
        match failure {
            Some(why) => Err(why),
            None => Ok(survey),
        }
    }

    /// Part by part, where there are several.
    fn walk_all(
        &self,
        ahead: usize,
        pool: &Pool,
        select: Select<'_>,
        take: Take<'_>,
    ) -> Result<Survey> {
        let Body::Parts(parts) = &self.body else {
            return self.walk_file(ahead, pool, select, take);
        };
        let mut survey = Survey::default();
        let mut is_over = false;
        for (log, same) in parts {
            let met = log.walk_file(
                ahead,
                pool,
                &mut |channel| select(&same.known(channel)),
                &mut |items| {
                    let flow = take(items);
                    is_over = flow.is_break();
                    flow
                },
            )?;
            survey.append(&met, &[]);
            if is_over {
                break;
            }
        }
        survey.channels.clone_from(&self.survey.channels);
        Ok(survey)
    }

    /// The same of a recording in one file.
    fn walk_file(
        &self,
        ahead: usize,
        pool: &Pool,
        select: Select<'_>,
        take: Take<'_>,
    ) -> Result<Survey> {
        let reader = match &self.body {
            Body::Mcap(reader) => reader.again().map_or_else(|| self.input.mcap(), Ok)?,
            Body::Text(text) => {
                text.walk::<Error>(select, |items| Ok(take(items)))?;
                return Ok(self.survey.clone());
            }
            // Its parts are read instead.
            Body::Parts(_) => return Ok(self.survey.clone()),
        };
        let options = WalkOptions {
            pool: Some(pool.rayon()),
            in_flight: ahead,
            ..WalkOptions::default()
        };
        let report = mcap::walk(reader, &options, select, Route::map, take)?;
        Ok(report.survey)
    }
}

/// Bytes on their way at once through a walk to the end.
pub const AHEAD: usize = WalkOptions::IN_FLIGHT;
/// The same for a walk that usually ends at once.
pub const A_LITTLE_AHEAD: usize = 4 << 20;

/// Most of a file's problems that are written out.
const PROBLEMS_SAID: usize = 5;

/// Problems of the file, the first few in words.
#[must_use]
pub fn problems(survey: &Survey) -> Vec<String> {
    let found = &survey.problems;
    let mut said: Vec<String> = found
        .first()
        .iter()
        .take(PROBLEMS_SAID)
        .map(ToString::to_string)
        .collect();
    let more = found.total().saturating_sub(said.len() as u64);
    if more > 0 {
        said.push(format!("and {more} more of the kind"));
    }
    said
}
