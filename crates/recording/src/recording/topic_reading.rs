//! One topic of a log -> its samples, each channel read by its own decoder. I/O.
//!
//! Apart from the replay for who looks at samples and integrates none: which topic, by which decoders, and the walk.

use super::beside::{self, AuxiliaryInputs, OwnMessages};
use super::channel_route::{Item, PayloadNotes, Route, RouteTarget};
use super::decoders::Decoders;
use super::log_channel::LogChannel;
use super::opened::{AHEAD, Recording, problems};
use super::selection::Selection;
use super::topic_plan::{self, TopicPlan};
use crate::decode::{Decoder, Undecodable};
use crate::error::{Error, Result};
use crate::mcap::Survey;
use crate::pool::Pool;
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{EstimationSettings, Meaning};
use strapd_attitude::record::{Nanos, RawSample, SampleKind};

/// A topic that is read by itself.
#[derive(Debug)]
pub struct TopicReading<'l> {
    log: &'l Recording,
    plan: TopicPlan<'l>,
    /// Something to know about the choice.
    pub note: Option<Diagnostic>,
    /// Topics that belong to these samples.
    besides: AuxiliaryInputs,
}

/// Item that is read.
#[derive(Debug)]
pub enum TopicItem {
    /// A sample of the channel of this place.
    Sample(usize, RawSample),
    /// A payload that could not be decoded, and when it was logged (of a line: its number).
    Undecodable(Nanos, Undecodable),
}

impl<'l> TopicReading<'l> {
    /// The topic called `named`, or the log's IMU.
    ///
    /// # Errors
    /// As [`Recording::choose`]; a channel of it cannot be decoded.
    pub fn new(
        log: &'l Recording,
        named: Option<&str>,
        decoders: &mut Decoders,
    ) -> Result<TopicReading<'l>> {
        let choice = log.choose(log.name(), named)?;
        let topic = choice.topics.first().map_or("", String::as_str);
        Ok(TopicReading {
            note: choice.note,
            ..TopicReading::of(log, topic, decoders)?
        })
    }

    /// The topic, or publisher on one, of this name.
    ///
    /// # Errors
    /// It is not there; a channel of it cannot be decoded.
    pub(super) fn of(
        log: &'l Recording,
        topic: &str,
        decoders: &mut Decoders,
    ) -> Result<TopicReading<'l>> {
        let plan = TopicPlan::named(log, topic, decoders)?;
        if let Some(why) = plan.refusals.first() {
            return Err(Error::unsupported(log.name(), Diagnostic::from(why)));
        }
        Ok(TopicReading {
            log,
            plan,
            note: None,
            besides: AuxiliaryInputs::default(),
        })
    }

    /// Says what else was there, to whom the recording was opened with.
    pub fn say_note(&self) {
        if let Some(note) = &self.note {
            let said = format!("{}: {note}", self.log.name().display());
            self.log.input().warn().say(&said);
        }
    }

    /// Returns the plan by which it is read.
    #[must_use]
    pub fn plan(&self) -> &TopicPlan<'l> {
        &self.plan
    }

    /// The same with the magnetic fields that a topic of their own has for these samples, where there is one.
    #[must_use]
    pub fn with_fields(mut self) -> TopicReading<'l> {
        let has_field = |(_, decoder): &(&LogChannel, Decoder)| decoder.stated().has_mag;
        if !self.plan.channels.iter().any(has_field) {
            let found = beside::of_fields(
                &EstimationSettings::default(),
                self.log,
                &self.plan.source.topic,
            );
            self.besides = found.unwrap_or_default();
        }
        self
    }

    /// The same with what is selected beside its samples, and the fields as [`TopicReading::with_fields`] finds them.
    ///
    /// # Errors
    /// A topic that is not there, or carries nothing of the kind.
    pub(super) fn with_besides(mut self, selection: &Selection) -> Result<TopicReading<'l>> {
        if selection.mag.is_none() {
            self = self.with_fields();
        }
        let own = OwnMessages {
            topic: &self.plan.source.topic,
            has_force: true,
            has_field: true,
            // Of samples by themselves.
            has_temperature: true,
        };
        let asked = (&EstimationSettings::default(), selection);
        let named = beside::choose(asked, self.log.name(), self.log, own)?;
        self.besides.append(named);
        Ok(self)
    }

    /// Name that `--topic` takes.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.plan.source.name
    }

    /// Reads all of it, in order, until `take` has enough or fails: samples in rad/s, m/s^2 and FLU, each with what the
    /// format says it means. What is lost is said, and how many that are comes back.
    ///
    /// # Errors
    /// As [`Recording::walk`].
    pub fn walk_in_flu<E: From<Error>>(
        &self,
        pool: &Pool,
        mut take: impl FnMut(&RawSample, Option<SampleKind>) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<u64, E> {
        let each = std::slice::from_ref(self);
        walk_in_flu(self.log, each, pool, |_, raw, kind| take(raw, kind))
    }

    /// Reads all of it, in order, until `take` has enough or fails.
    ///
    /// # Errors
    /// As [`Recording::walk`].
    pub fn walk<E: From<Error>>(
        &self,
        pool: &Pool,
        mut take: impl FnMut(TopicItem) -> std::result::Result<ControlFlow<()>, E>,
    ) -> std::result::Result<Survey, E> {
        let each = std::slice::from_ref(self);
        walk(self.log, each, pool, |_, taken| take(taken))
    }
}

/// [`TopicReading::walk_in_flu`] of several at once, which are told apart by their place.
pub(super) fn walk_in_flu<E: From<Error>>(
    log: &Recording,
    readings: &[TopicReading<'_>],
    pool: &Pool,
    mut take: impl FnMut(
        usize,
        &RawSample,
        Option<SampleKind>,
    ) -> std::result::Result<ControlFlow<()>, E>,
) -> std::result::Result<u64, E> {
    let of_channel = |(_, decoder): &(&LogChannel, Decoder)| {
        let declared = &decoder.stated().declared;
        let meaning = Meaning::new(&EstimationSettings::default(), declared);
        (meaning, declared.sample_kind)
    };
    let meanings: Vec<Vec<(Meaning, Option<SampleKind>)>> = readings
        .iter()
        .map(|reading| reading.plan.channels.iter().map(of_channel).collect())
        .collect();
    let warn = log.input().warn();
    let mut undecodable = 0u64;
    let survey = walk(log, readings, pool, |reading, taken| match taken {
        TopicItem::Sample(place, raw) => meanings
            .get(reading)
            .and_then(|meanings| meanings.get(place))
            .map_or(Ok(ControlFlow::Continue(())), |(meaning, kind)| {
                take(reading, &meaning.in_flu(&raw), *kind)
            }),
        TopicItem::Undecodable(at, why) => {
            if undecodable == 0 {
                warn.say(&format!(
                    "first undecodable payload, {}: {why}",
                    log.place_of(at)
                ));
            }
            undecodable += 1;
            Ok(ControlFlow::Continue(()))
        }
    })?;
    for problem in problems(&survey) {
        warn.say(&format!("{}: {problem}", log.name().display()));
    }
    if undecodable > 0 {
        warn.say(&format!("{undecodable} payloads could not be decoded"));
    }
    Ok(undecodable + survey.problems.losses())
}

/// [`TopicReading::walk`] of several at once, which are told apart by their place.
fn walk<E: From<Error>>(
    log: &Recording,
    readings: &[TopicReading<'_>],
    pool: &Pool,
    mut take: impl FnMut(usize, TopicItem) -> std::result::Result<ControlFlow<()>, E>,
) -> std::result::Result<Survey, E> {
    // A stream for each channel of each reading.
    let streams: Vec<(usize, usize)> = readings
        .iter()
        .enumerate()
        .flat_map(|(at, reading)| (0..reading.plan.channels.len()).map(move |place| (at, place)))
        .collect();
    let begins: Vec<usize> = (0..readings.len())
        .map(|at| streams.partition_point(|(of, _)| *of < at))
        .collect();
    let noticed: Vec<Arc<PayloadNotes>> = readings
        .iter()
        .map(|reading| Arc::new(PayloadNotes::of(&reading.plan.source)))
        .collect();
    log.walk(
        AHEAD,
        pool,
        |met| {
            let plans = readings.iter().map(|reading| &reading.plan);
            let samples = topic_plan::route(plans, met, |at, place| RouteTarget {
                stream: begins.get(at).map_or(0, |begin| begin + place),
                noticed: noticed.get(at).cloned().unwrap_or_default(),
            });
            samples.or_else(|| {
                let mut besides = readings.iter().map(|reading| &reading.besides);
                let decoder = besides.find_map(|besides| besides.decoder(met));
                Route::other(decoder.cloned(), None)
            })
        },
        |items| {
            for item in items.drain(..) {
                let (stream, raw) = match item {
                    Item::Sample(stream, raw) => (stream, Ok(raw)),
                    Item::Undecodable(stream, why) => (stream, Err(why)),
                    // In the axes of the samples, as a replay takes it.
                    Item::Beside(raw) => {
                        let is_beside = true;
                        (0, Ok(RawSample { is_beside, ..raw }))
                    }
                    Item::Reference(..) | Item::Copy(_) => continue,
                };
                let (at, place) = streams.get(stream).copied().unwrap_or_default();
                let taken = match raw {
                    Ok(raw) => TopicItem::Sample(place, raw),
                    Err(why) => TopicItem::Undecodable(why.0, why.1),
                };
                if take(at, taken)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
            Ok(ControlFlow::Continue(()))
        },
    )
}
