//! One topic of a log -> its samples, each channel read by its own decoder. I/O.
//!
//! Apart from the replay for who looks at samples and integrates none: which topic, by which decoders, and the walk.

use super::beside::{self, Besides};
use super::channel_route::{Item, Noticed, Route, Taker};
use super::decoders::Decoders;
use super::log::{AHEAD, Log, problems};
use super::log_channel::LogChannel;
use super::sources::Source;
use super::topics;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::estimate::{Meaning, Plan};
use strapd_attitude::record::{Nanos, RawSample, SampleKind};
use strapd_recording::decode::{Decoder, Undecodable};
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;

/// A topic, and how it is read.
#[derive(Debug)]
pub struct TopicReading<'l> {
    log: &'l Log,
    source: Source,
    /// Something to know about the choice.
    pub note: Option<String>,
    /// Its channels, at least one, with their decoders.
    pub channels: Vec<(&'l LogChannel, Decoder)>,
    /// By id and schema id: the place among the channels.
    places: BTreeMap<(u16, u16), usize>,
    /// What has a topic of its own and belongs to these samples.
    besides: Besides,
}

/// What is read.
#[derive(Debug)]
pub enum Taken {
    /// A sample of the channel of this place.
    Sample(usize, RawSample),
    /// A payload that could not be decoded, and when it was logged (of a line: its number).
    Undecodable(Nanos, Undecodable),
}

impl<'l> TopicReading<'l> {
    /// The topic called `named`, or the log's IMU.
    ///
    /// # Errors
    /// As [`Log::choose`]; a channel of it can not be decoded.
    pub fn new(
        log: &'l Log,
        named: Option<&str>,
        decoders: &mut Decoders,
    ) -> Result<TopicReading<'l>> {
        let choice = log.choose(log.name(), named)?;
        let topic = choice.topics.into_iter().next().unwrap_or_default();
        let source = log.source(&topic).ok_or_else(|| Error::NoSuchTopic {
            path: log.name().to_owned(),
            topic,
            topics: topics::listing(&log.candidates()),
        })?;
        let mut channels = Vec::new();
        let mut places = BTreeMap::new();
        for known in log.channels_of(&source) {
            let decoder = known.decoder(decoders).map_err(|why| Error::Unsupported {
                path: log.name().to_owned(),
                what: why.to_string(),
            })?;
            places
                .entry((known.channel.id, known.channel.schema_id))
                .or_insert(channels.len());
            channels.push((known, decoder));
        }
        Ok(TopicReading {
            log,
            source,
            note: choice.note,
            channels,
            places,
            besides: Besides::default(),
        })
    }

    /// The same with the magnetic fields that a topic of their own has for these samples, where there is one.
    #[must_use]
    pub fn with_fields(mut self) -> TopicReading<'l> {
        let has_field = |(_, decoder): &(&LogChannel, Decoder)| decoder.stated().has_mag;
        if !self.channels.iter().any(has_field) {
            let found = beside::of_fields(&Plan::default(), self.log, &self.source.topic);
            self.besides = found.unwrap_or_default();
        }
        self
    }

    /// What `--topic` takes.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.source.name
    }

    /// Reads all of it, in order, until `take` has enough or fails: samples in rad/s, m/s^2 and FLU, each with what the
    /// format says it means. What is lost is said, and how many that are comes back.
    ///
    /// # Errors
    /// As [`Log::walk`].
    pub fn walk_in_flu(
        &self,
        pool: &Pool,
        mut take: impl FnMut(&RawSample, Option<SampleKind>) -> Result<ControlFlow<()>>,
    ) -> Result<u64> {
        let meanings: Vec<(Meaning, Option<SampleKind>)> = self
            .channels
            .iter()
            .map(|(_, decoder)| {
                let declared = &decoder.stated().declared;
                let meaning = Meaning::new(&Plan::default(), declared);
                (meaning, declared.sample_kind)
            })
            .collect();
        let mut undecodable = 0u64;
        let survey = self.walk(pool, |taken| match taken {
            Taken::Sample(place, raw) => meanings
                .get(place)
                .map_or(Ok(ControlFlow::Continue(())), |(meaning, kind)| {
                    take(&meaning.in_flu(&raw), *kind)
                }),
            Taken::Undecodable(at, why) => {
                if undecodable == 0 {
                    tracing::warn!(
                        "first undecodable payload, {}: {why}",
                        self.log.place_of(at)
                    );
                }
                undecodable += 1;
                Ok(ControlFlow::Continue(()))
            }
        })?;
        for problem in problems(&survey) {
            tracing::warn!("{}: {problem}", self.log.name().display());
        }
        if undecodable > 0 {
            tracing::warn!("{undecodable} payloads could not be decoded");
        }
        Ok(undecodable + survey.problems.losses())
    }

    /// Reads all of it, in order, until `take` has enough or fails.
    ///
    /// # Errors
    /// As [`Log::walk`].
    pub fn walk(
        &self,
        pool: &Pool,
        mut take: impl FnMut(Taken) -> Result<ControlFlow<()>>,
    ) -> Result<Survey> {
        let noticed = Arc::new(Noticed::of(&self.source));
        self.log.walk(
            AHEAD,
            pool,
            |met| {
                let id = (met.id, met.schema_id);
                let is_own = met.topic == self.source.topic;
                let Some(stream) = self.places.get(&id).filter(|_| is_own).copied() else {
                    return Route::other(self.besides.decoder(met).cloned(), None);
                };
                let (_, decoder) = self.channels.get(stream)?;
                let noticed = noticed.clone();
                Some(Route::to(decoder.clone(), vec![Taker { stream, noticed }]))
            },
            |items| {
                for item in items.drain(..) {
                    let taken = match item {
                        Item::Sample(place, raw) => Taken::Sample(place, raw),
                        Item::Undecodable(_, why) => Taken::Undecodable(why.0, why.1),
                        // In the axes of the samples, as a replay takes it.
                        Item::Beside(raw) => Taken::Sample(
                            0,
                            RawSample {
                                is_beside: true,
                                ..raw
                            },
                        ),
                        Item::Reference(_) | Item::Copy(_) => continue,
                    };
                    if take(taken)?.is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
                }
                Ok(ControlFlow::Continue(()))
            },
        )
    }
}
