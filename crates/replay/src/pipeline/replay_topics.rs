//! A log -> what a replay makes of each of several topics, all in one pass. I/O.
//!
//! Apart from the replay because nothing is written, every topic is by itself (one that is refused does not
//! keep the others from being told about), and a log may have hundreds: a pass for each would cost the
//! square of its size.

use super::channel_choice::{
    Reference, RunTopic, besides, choose_each, reference, route, watch_field,
};
use super::check::Drawing;
use super::delivery::{Delivery, Outlet};
use super::history::History;
use super::position::Position;
use super::replay::{done, prepare};
use super::request::ReplayRequest;
use super::session::{Session, Topic};
use super::session_builder::topic;
use super::summarise;
use super::summarise::TopicOutcome;
use crate::error::{Error, Result};
use crate::sink::{Provenance, Stream};
use std::ops::ControlFlow;
use std::path::Path;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::Prepared;
use strapd_recording::Recording;
use strapd_recording::pool::Pool;
use strapd_recording::recording::beside::AuxiliaryInputs;
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::opened::AHEAD;

/// Integrates the topics called `names`, without outputs; by name, in their order.
///
/// # Errors
/// The log cannot be read.
pub(super) fn each(
    run: &ReplayRequest,
    log: &Recording,
    names: &[String],
    drawing: Option<&Drawing<'_>>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<Vec<TopicOutcome>> {
    let path = log.name();
    let mut decoders = Decoders::of_run(&run.plan, &run.selection.decode);
    let mut told: Vec<Option<TopicOutcome>> = Vec::new();
    let mut chosen: Vec<RunTopic<'_>> = Vec::new();
    for found in choose_each(run, path, log, names, &mut decoders) {
        told.push(found.map_or_else(
            |refused| Some(Err(Diagnostic::from(&refused))),
            |found| {
                chosen.push(found);
                None
            },
        ));
    }
    let elsewhere = drawing.and_then(|d| d.reference).is_some();
    let reference = match reference(run, path, log, &chosen, (run.against.as_deref(), true)) {
        _ if elsewhere => None,
        Ok(reference) => reference,
        Err(refused) => {
            let refused = Diagnostic::from(&refused);
            let all = told
                .into_iter()
                .map(|told| told.unwrap_or_else(|| Err(refused.clone())));
            return Ok(all.collect());
        }
    };

    let prepared = prepare(run, log, (&chosen, &AuxiliaryInputs::default()), pool)?;
    let mut begun = Begun::of((run, path), chosen.into_iter().zip(prepared), &mut told);
    let mut besides = besides(run, path, log, &mut begun.chosen)?;
    watch_field(run, log, &begun.chosen, &mut besides);
    begun.compare(reference.as_ref(), drawing);
    let Begun {
        topics,
        streams,
        chosen,
    } = begun;
    let provenance = Provenance::default();
    let outlet = Outlet::open(
        &[],
        &[],
        run.options,
        &streams,
        &provenance,
        Delivery::default(),
    )?;
    let mut session = Session::new(topics, outlet);
    let span = log.survey.times;
    log.walk::<Error>(
        AHEAD,
        pool,
        |channel| route(&chosen, reference.as_ref(), &besides, false, channel),
        |items| {
            let done = done(items, span);
            let _ = session.consume(items.drain(..), pool)?;
            watch(&session.position(done));
            Ok(ControlFlow::Continue(()))
        },
    )?;
    let mut summaries = summarise::topics(run, session.finish_each(pool)?).into_iter();
    let nothing = || Err(Diagnostic::new("the replay gave nothing"));
    let mut next = || summaries.next().unwrap_or_else(nothing);
    Ok(told
        .into_iter()
        .map(|told| told.unwrap_or_else(&mut next))
        .collect())
}

/// Topics that are integrated together.
#[derive(Default)]
struct Begun<'l> {
    topics: Vec<Topic>,
    streams: Vec<Stream>,
    chosen: Vec<RunTopic<'l>>,
}

impl<'l> Begun<'l> {
    /// Begins those that can be; why another cannot is its outcome, in the place that is still open.
    fn of(
        (run, path): (&ReplayRequest, &Path),
        chosen: impl Iterator<Item = (RunTopic<'l>, Result<Prepared>)>,
        told: &mut [Option<TopicOutcome>],
    ) -> Begun<'l> {
        let mut all = Begun::default();
        let open = told.iter_mut().filter(|told| told.is_none());
        for ((chosen, prepared), slot) in chosen.zip(open) {
            let begun = prepared.and_then(|prepared| {
                let start = (chosen.found.clone(), chosen.stream.clone());
                topic(run, path, start, prepared)
            });
            match begun {
                Ok((topic, stream)) => {
                    all.topics.push(topic);
                    all.streams.push(stream);
                    all.chosen.push(chosen);
                }
                Err(refused) => *slot = Some(Err(Diagnostic::from(&refused))),
            }
        }
        all
    }

    /// Holds each against the reference, and keeps what is drawn of it.
    fn compare(&mut self, reference: Option<&Reference>, drawing: Option<&Drawing<'_>>) {
        let together = self.topics.len();
        for (topic, chosen) in self.topics.iter_mut().zip(&self.chosen) {
            if let Some(against) = &mut topic.against {
                against.share_room(together);
                if let Some(reference) = reference.filter(|r| !r.is_of(chosen)) {
                    against.take_reference_from(&reference.resolved);
                }
            }
            if let Some(drawing) = drawing {
                draw(topic, drawing);
            }
        }
    }
}

fn draw(topic: &mut Topic, drawing: &Drawing<'_>) {
    topic.history = Some(History::new(topic.prepared.clock, drawing.stretches));
    topic.estimator.keep_innovations();
    if let (Some(against), Some(track)) = (&mut topic.against, drawing.reference) {
        against.take_reference_track(track);
    }
}
