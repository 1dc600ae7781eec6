//! A log's topics of samples -> how good they are: statistics, rests, clocks. I/O.
//!
//! Apart from the replay because it integrates nothing: `info` (and later `check`) look before
//! anyone leaps.

use super::log::{Known, Log, described, rank};
use super::passes::{Conditioned, FEW};
use super::pool::Pool;
use super::preparation::Resolved;
use super::route::{Item, Noticed, Route, Taker};
use super::sources::{Source, is_same};
use super::topics::PICKED_UNNAMED;
use crate::condition::quality::{Quality, QualitySummary};
use crate::condition::regularise;
use crate::condition::stillness::{self, Limits, Rests, Stillness};
use crate::condition::{Clock, choose_clock};
use crate::config::Plan;
use crate::decode::{self, Options};
use crate::error::{Error, Result};
use crate::record::RawSample;
use crate::source::mcap::{self, Survey, WalkOptions};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// One topic of samples, looked at.
#[derive(Debug)]
pub struct Looked {
    /// Its name: the topic, or one of several sources on it.
    pub topic: String,
    /// The topic.
    pub of: String,
    /// Type and encoding.
    pub described: String,
    /// The frame its first message names.
    pub frame: String,
    /// How its samples are understood by default.
    pub resolved: Resolved,
    /// Whether the format states the meaning of a sample.
    pub kind_stated: bool,
    /// Statistics.
    pub quality: QualitySummary,
    /// Rests, rad/s.
    pub rests: Rests,
    /// The bias they give.
    pub bias: Option<stillness::BiasEstimate>,
    /// Payloads that could not be decoded.
    pub undecodable: u64,
    /// The clock the statistics are on.
    pub clock: Clock,
    /// What was noticed about the clock.
    pub clock_warning: Option<String>,
}

/// A topic being looked at.
struct Look {
    topic: String,
    of: String,
    described: String,
    frame: String,
    kind_stated: bool,
    resolved: Resolved,
    first: Vec<RawSample>,
    clock: Option<(Clock, Option<String>)>,
    asked: Clock,
    quality: Quality,
    conditioned: Conditioned,
    stillness: Stillness,
    stamps: regularise::Survey,
    undecodable: u64,
}

impl Look {
    fn take(&mut self, raw: &RawSample) -> std::result::Result<(), String> {
        self.conditioned.push(std::slice::from_ref(raw), |sample| {
            self.stillness.push(sample);
            self.stamps.push(sample);
        })?;
        if self.clock.is_some() {
            self.quality.push(raw);
            return Ok(());
        }
        self.first.push(*raw);
        if self.first.len() >= FEW {
            self.settle();
        }
        Ok(())
    }

    fn settle(&mut self) {
        let (clock, warning) = choose_clock(&self.first, self.asked);
        self.quality = Quality::new(clock);
        self.first.drain(..).for_each(|raw| self.quality.push(&raw));
        self.clock = Some((clock, warning.map(|w| w.to_string())));
    }

    fn finish(mut self) -> std::result::Result<Looked, String> {
        if self.clock.is_none() {
            self.settle();
        }
        let (clock, clock_warning) = self.clock.unwrap_or((self.asked, None));
        self.conditioned.finish(|sample| {
            self.stillness.push(sample);
            self.stamps.push(sample);
        })?;
        let rests = self.stillness.finish();
        let mut quality = self.quality.summary();
        quality.judge_lines(&self.stamps.finish());
        Ok(Looked {
            topic: self.topic,
            of: self.of,
            described: self.described,
            frame: self.frame,
            resolved: self.resolved,
            kind_stated: self.kind_stated,
            quality,
            bias: stillness::estimate_bias(&rests, &Limits::default()).ok(),
            rests,
            undecodable: self.undecodable,
            clock,
            clock_warning,
        })
    }
}

/// Decodes every topic of samples once. `named` is looked at too, though it may not obviously be an
/// IMU's.
///
/// # Errors
/// The log can not be read, or `named` not decoded.
pub fn look(
    path: &Path,
    log: &Log,
    named: Option<&str>,
    options: &Options,
    pool: &Pool,
) -> Result<(Vec<Looked>, Survey)> {
    let plan = Plan {
        decode: options.clone(),
        ..Plan::default()
    };
    look_as(path, log, named, &plan, pool)
}

/// The same with the samples understood as a run of `plan` understands them.
///
/// # Errors
/// As [`look`].
pub fn look_as(
    path: &Path,
    log: &Log,
    named: Option<&str>,
    plan: &Plan,
    pool: &Pool,
) -> Result<(Vec<Looked>, Survey)> {
    let mut looks: Vec<Look> = Vec::new();
    let mut decoders: Vec<(Arc<mcap::Channel>, decode::Decoder, Vec<Taker>)> = Vec::new();
    for source in &log.sources {
        let is_named = named.is_some_and(|name| name == source.name || name == source.topic);
        let noticed = Arc::new(Noticed::of(source));
        let mut begun = None;
        for known in log.channels_of(source) {
            if rank(&known.role) < PICKED_UNNAMED && !is_named {
                continue;
            }
            let decoder = match known.decoder(&plan.decode) {
                Ok(decoder) => decoder,
                Err(why) if named.is_some() => {
                    return Err(Error::Unsupported {
                        path: path.to_owned(),
                        what: why.to_string(),
                    });
                }
                Err(why) => {
                    tracing::warn!("{why}");
                    continue;
                }
            };
            let stream = *begun.get_or_insert_with(|| {
                looks.push(begin(source, known, &decoder, plan));
                looks.len() - 1
            });
            let taker = Taker {
                stream,
                noticed: noticed.clone(),
            };
            match decoders.iter_mut().find(|d| is_same(&d.0, &known.channel)) {
                Some((_, _, takers)) => takers.push(taker),
                None => decoders.push((known.channel.clone(), decoder, vec![taker])),
            }
        }
    }
    let mut failure = None;
    let reader = log.reader().map_or_else(|| mcap::Reader::open(path), Ok)?;
    let report = mcap::walk(
        reader,
        &WalkOptions {
            pool: Some(pool.rayon()),
            ..WalkOptions::default()
        },
        |channel| {
            let (_, decoder, takers) = decoders.iter().find(|d| is_same(&d.0, channel))?;
            Some(Route::to(decoder.clone(), takers.clone()))
        },
        Route::map,
        |items| {
            for item in items.drain(..) {
                let result = match item {
                    Item::Sample(stream, raw) => {
                        looks.get_mut(stream).map_or(Ok(()), |look| look.take(&raw))
                    }
                    Item::Undecodable(stream, _) => {
                        if let Some(look) = looks.get_mut(stream) {
                            look.undecodable += 1;
                        }
                        Ok(())
                    }
                    Item::Reference(_) | Item::Copy(_) => Ok(()),
                };
                if let Err(what) = result {
                    failure = Some(what);
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(())
        },
    )?;
    let unsupported = |what| Error::Unsupported {
        path: path.to_owned(),
        what,
    };
    if let Some(what) = failure {
        return Err(unsupported(what));
    }
    let looked = looks
        .into_iter()
        .map(|look| look.finish().map_err(unsupported))
        .collect::<Result<Vec<_>>>()?;
    Ok((looked, report.survey))
}

fn begin(source: &Source, known: &Known, decoder: &decode::Decoder, plan: &Plan) -> Look {
    let resolved = Resolved::new(plan, decoder.stated());
    let first_frame = || {
        let (_, payload) = known.first.as_ref()?;
        decoder.frame_id(payload)
    };
    Look {
        topic: source.name.clone(),
        of: source.topic.clone(),
        described: described(&known.channel),
        frame: source
            .frame
            .clone()
            .or_else(first_frame)
            .unwrap_or_default(),
        kind_stated: decoder.stated().sample_kind.is_some(),
        first: Vec::new(),
        clock: None,
        quality: Quality::new(plan.clock),
        conditioned: Conditioned::new(plan, &resolved),
        asked: plan.clock,
        stillness: Stillness::new(resolved.kind, Limits::default()),
        stamps: regularise::Survey::new(),
        resolved,
        undecodable: 0,
    }
}
