//! A log's topics of samples -> how good they are: statistics, rests, clocks. I/O.
//!
//! Apart from the replay because it integrates nothing: `info`, `check` and `report` look before anyone leaps.

use crate::error::{Error, Result};
use crate::inspection::{Aids, Inspection};
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::condition::quality::Quality;
use strapd_attitude::condition::regularise;
use strapd_attitude::condition::stillness::{self, Limits, Stillness};
use strapd_attitude::condition::{Clock, GyroUnit, choose_clock_as};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{
    ClockPass, Conditioned, EstimationSettings, FEW, LagPass, Meaning,
};
use strapd_attitude::record::{Declared, RawSample, Verdict};
use strapd_recording::Recording;
use strapd_recording::decode::Options;
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;
use strapd_recording::recording::beside::Vectors;
use strapd_recording::recording::channel_route::{Item, PayloadNotes, RouteTarget};
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::log_channel::{LogChannel, described};
use strapd_recording::recording::opened::AHEAD;
use strapd_recording::recording::payload_type::PayloadType;
use strapd_recording::recording::sources::Publisher;
use strapd_recording::recording::topic_plan::{self, TopicPlan};
use strapd_recording::recording::topics::{MOST_TOPICS, PICKED_UNNAMED};

/// Result of looking at a log.
#[derive(Debug)]
pub struct LogInspection {
    /// The topics of samples, in the order of the log.
    pub topics: Vec<Inspection>,
    /// Topics beyond [`MOST_TOPICS`], which were not looked at; the best are looked at first.
    pub left_out: Vec<String>,
    /// Survey of the log.
    pub survey: Survey,
}

/// A topic being looked at.
struct TopicInspector {
    topic: String,
    of: String,
    described: PayloadType,
    frame: String,
    /// Pass that finds the kind by an orientation in the samples.
    lag: Option<LagPass>,
    resolved: Meaning,
    first: Vec<RawSample>,
    /// The first of other sensors than the gyro.
    beside: Vec<RawSample>,
    clock: Option<(Clock, Option<Diagnostic>)>,
    asked: Clock,
    quality: Quality,
    si: Si,
    conditioned: Conditioned,
    stillness: Stillness,
    stamps: regularise::Survey,
    clocks: Option<ClockPass>,
    undecodable: u64,
    plan: EstimationSettings,
    aid: Aids,
}

/// Factors from the units that a format states to those that numbers are judged in. What it does not state stays as
/// it is: then the numbers tell.
struct Si {
    rate: f64,
    force: f64,
    unit: GyroUnit,
}

impl Si {
    fn new(plan: &EstimationSettings, declared: &Declared, resolved: &Meaning) -> Si {
        let stated = declared.gyro_unit.filter(|_| plan.unit.is_none());
        Si {
            rate: stated.map_or(1.0, GyroUnit::to_rad),
            // 1 where none is stated.
            force: resolved.accel_scale.abs(),
            unit: plan.unit.unwrap_or_default(),
        }
    }

    fn of(&self, raw: &RawSample, resolved: &Meaning) -> RawSample {
        let raw = &resolved.remapped(raw);
        let by = |vector: Option<[f64; 3]>, by: f64| vector.map(|v| v.map(|value| value * by));
        RawSample {
            gyro: by(raw.gyro, self.rate),
            accel: by(raw.accel, self.force),
            ..*raw
        }
    }
}

impl TopicInspector {
    fn take(&mut self, raw: &RawSample) -> std::result::Result<(), Diagnostic> {
        if raw.is_beside {
            if self.beside.len() < FEW {
                self.beside.push(*raw);
            }
            return Ok(());
        }
        if let Some(clocks) = &mut self.clocks {
            clocks.take(raw);
        }
        if let Some(lag) = &mut self.lag {
            lag.take(raw, &self.resolved, self.asked);
        }
        self.conditioned.push(std::slice::from_ref(raw), |sample| {
            self.stillness.push(sample);
            self.stamps.push(sample);
        })?;
        if self.clock.is_some() {
            self.quality.push(&self.si.of(raw, &self.resolved));
            return Ok(());
        }
        self.first.push(*raw);
        let clocks = self.clocks.as_ref();
        if self.first.len() >= FEW && !clocks.is_some_and(ClockPass::lacks_stamps) {
            self.settle();
        }
        Ok(())
    }

    fn settle(&mut self) {
        let (clock, warning) = choose_clock_as(&self.first, self.asked, self.plan.stamps);
        self.resolved = self.resolved.settled(&self.first, clock);
        self.quality = Quality::new(clock);
        self.aid = Aids::of(&self.plan, &self.resolved, &self.first, &self.beside);
        for raw in self.first.drain(..) {
            self.quality.push(&self.si.of(&raw, &self.resolved));
        }
        self.clock = Some((clock, warning.as_ref().map(Diagnostic::from)));
    }

    fn finish(mut self) -> std::result::Result<Inspection, Diagnostic> {
        if self.clock.is_none() {
            self.settle();
        }
        let (clock, clock_warning) = self.clock.unwrap_or((self.asked, None));
        self.conditioned.finish(|sample| {
            self.stillness.push(sample);
            self.stamps.push(sample);
        })?;
        if let Some(choice) = self.lag.take().and_then(|lag| lag.choice()) {
            self.resolved = self.resolved.with_kind(&choice);
        }
        let rests = self.stillness.finish();
        let mut counts = self.conditioned.counts();
        counts.add_many(Verdict::Undecodable, self.undecodable);
        let mut quality = self.quality.summary();
        quality.lines = Some(self.stamps.finish());
        let of = (&self.plan, &self.resolved);
        let clocks = self.clocks.map(|pass| pass.finish(clock, of));
        let clocks = clocks.unwrap_or_default();
        Ok(Inspection {
            topic: self.topic,
            of: self.of,
            described: self.described,
            frame: self.frame,
            resolved: self.resolved,
            quality,
            quality_unit: self.si.unit,
            bias: stillness::estimate_bias(&rests, &Limits::default()).ok(),
            rests,
            counts,
            clock_set: self.conditioned.clock_set(),
            clocks,
            undecodable: self.undecodable,
            clock,
            clock_warning,
            aid: self.aid,
            is_likely: true,
            has_reference: false,
        })
    }
}

/// Decodes every topic of samples once. `named` is looked at too, though it may not obviously be an
/// IMU's.
///
/// # Errors
/// The log cannot be read, or `named` not decoded.
pub fn look(
    log: &Recording,
    named: Option<&str>,
    options: &Options,
    pool: &Pool,
) -> Result<LogInspection> {
    look_as(log, named, (options, &EstimationSettings::default()), pool)
}

/// The same with the samples understood as a run of `plan` understands them.
///
/// # Errors
/// As [`look`].
pub(crate) fn look_as(
    log: &Recording,
    named: Option<&str>,
    (options, plan): (&Options, &EstimationSettings),
    pool: &Pool,
) -> Result<LogInspection> {
    let path = log.name();
    let (wanted, left_out) = wanted(log, named);
    let unsupported = |what: Diagnostic| Error::unsupported(path, what);
    let (mut looks, plans) = begin_all(log, wanted, named.is_some(), (options, plan))?;
    let noticed = |source: &Publisher| Arc::new(PayloadNotes::of(source));
    let noticed: Vec<Arc<PayloadNotes>> = plans.iter().map(|of| noticed(&of.source)).collect();
    let survey = log.walk::<Error>(
        AHEAD,
        pool,
        |channel| {
            topic_plan::route(plans.iter(), channel, |stream, _| RouteTarget {
                stream,
                noticed: noticed.get(stream).cloned().unwrap_or_default(),
            })
        },
        |items| {
            for item in items.drain(..) {
                match item {
                    Item::Sample(stream, raw) => {
                        let look = looks.get_mut(stream);
                        look.map_or(Ok(()), |look| look.take(&raw))
                            .map_err(unsupported)?;
                    }
                    Item::Undecodable(stream, _) => {
                        if let Some(look) = looks.get_mut(stream) {
                            look.undecodable += 1;
                        }
                    }
                    Item::Reference(..) | Item::Beside(_) | Item::Copy(_) => {}
                }
            }
            Ok(ControlFlow::Continue(()))
        },
    )?;
    let mut topics = looks
        .into_iter()
        .map(|look| look.finish().map_err(unsupported))
        .collect::<Result<Vec<_>>>()?;
    compare(&mut topics, log);
    Ok(LogInspection {
        topics,
        left_out,
        survey,
    })
}

/// Inspectors of these topics, and how each is read; what cannot be read is an error only where it is `asked` for.
fn begin_all<'l>(
    log: &'l Recording,
    wanted: Vec<(&'l Publisher, bool)>,
    asked: bool,
    (options, plan): (&Options, &EstimationSettings),
) -> Result<(Vec<TopicInspector>, Vec<TopicPlan<'l>>)> {
    let mut decoders = Decoders::of_run(plan, options);
    let (mut looks, mut plans) = (Vec::new(), Vec::new());
    for (source, is_named) in wanted {
        let is_likely = |known: &LogChannel| is_named || known.rank() >= PICKED_UNNAMED;
        let of_topic = TopicPlan::of(log, source.clone(), &mut decoders, is_likely);
        for why in &of_topic.refusals {
            if asked {
                return Err(Error::unsupported(log.name(), Diagnostic::from(why)));
            }
            tracing::warn!("{why}");
        }
        if let Some(look) = begin(&of_topic, plan) {
            looks.push(look);
            plans.push(of_topic);
        }
    }
    Ok((looks, plans))
}

/// Adds to each topic what the rest of the log says of it: what lies beside it, and whether it is the likely one.
fn compare(topics: &mut [Inspection], log: &Recording) {
    let vectors = Vectors::of(log);
    for topic in topics.iter_mut() {
        let (fields, taken, forces) = vectors.beside(&topic.of);
        (topic.aid.fields, topic.aid.forces) = ((fields, taken), forces);
        topic.has_reference = topic.quality.with_orientation > 0
            && topic.quality.orientation_varies
            || has_reference_beside(log, &topic.of, &topic.frame);
    }
    let rank_of = |topic: &Inspection| {
        log.channels
            .iter()
            .filter(|k| k.channel.topic == topic.of)
            .map(LogChannel::rank)
            .max()
    };
    let best = topics.iter().map(rank_of).max().flatten();
    for topic in topics {
        topic.is_likely = rank_of(topic) == best;
    }
}

/// Whether a replay that names none finds one topic of orientations beside the samples' own.
fn has_reference_beside(log: &Recording, of: &str, frame: &str) -> bool {
    let mut others = log
        .channels
        .iter()
        .filter(|k| k.channel.topic != of && k.is_reference_of(frame));
    matches!((others.next(), others.next()), (Some(one), None) if !one.role.has_rate)
}

/// The sources to look at, with whether they are named, in the order of the log; and the names of those that are
/// too many: what is named and the best ranks come first.
fn wanted<'l>(
    log: &'l Recording,
    named: Option<&str>,
) -> (Vec<(&'l Publisher, bool)>, Vec<String>) {
    let best = |s: &Publisher| log.channels_of(s).map(LogChannel::rank).max();
    let mut found: Vec<_> = log
        .sources
        .iter()
        .enumerate()
        .map(|(at, source)| {
            let is_named = named.is_some_and(|name| name == source.name || name == source.topic);
            (is_named, best(source).unwrap_or(0), at, source)
        })
        .filter(|(is_named, rank, ..)| *is_named || *rank >= PICKED_UNNAMED)
        .collect();
    found.sort_by_key(|(is_named, rank, ..)| std::cmp::Reverse((*is_named, *rank)));
    let rest = found.split_off(found.len().min(MOST_TOPICS));
    found.sort_by_key(|(_, _, at, _)| *at);
    (
        found.into_iter().map(|(named, .., s)| (s, named)).collect(),
        rest.into_iter().map(|(.., s)| s.name.clone()).collect(),
    )
}

fn begin(of_topic: &TopicPlan<'_>, plan: &EstimationSettings) -> Option<TopicInspector> {
    let (known, decoder) = of_topic.channels.first()?;
    let resolved = Meaning::new(plan, &decoder.stated().declared);
    Some(TopicInspector {
        topic: of_topic.source.name.clone(),
        of: of_topic.source.topic.clone(),
        described: described(&known.channel),
        frame: of_topic.frame(),
        lag: LagPass::of(&resolved),
        first: Vec::new(),
        beside: Vec::new(),
        clock: None,
        quality: Quality::new(plan.clock),
        si: Si::new(plan, &decoder.stated().declared, &resolved),
        conditioned: Conditioned::new(plan, &resolved),
        asked: plan.clock,
        stillness: Stillness::new(Limits::default()),
        stamps: regularise::Survey::new(),
        clocks: ClockPass::of(plan),
        resolved,
        undecodable: 0,
        plan: plan.clone(),
        aid: Aids::default(),
    })
}
