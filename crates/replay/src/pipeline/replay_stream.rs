//! Messages or lines that can be read only once -> attitude. I/O.
//!
//! Apart from the replay of a file because nothing is known before it comes: the first topic of samples is taken
//! (`stream_topic`), and its first samples wait until clock, bias and initial attitude are known.

use super::position::Position;
use super::replay::integrated_again;
use super::replay_start::StreamStart;
use super::request::ReplayRequest;
use super::stream_topic::StreamTopic;
use super::summarise;
use crate::error::{Error, Result};
use crate::sink::Flow;
use crate::summary::{RunSummary, warning};
use std::cell::RefCell;
use std::io::Read;
use std::ops::ControlFlow;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::MadeBefore;
use strapd_recording::lines::Lines;
use strapd_recording::mcap::{self, Reader, Survey, WalkOptions};
use strapd_recording::pool::Pool;
use strapd_recording::recording::channel_route::{Item, Route};
use strapd_recording::recording::opened::problems;
use strapd_recording::recording::text_log::{doubt_of_unit, walk_once};

/// Replays messages on channels.
///
/// # Errors
/// As [`super::replay::run`]; two publishers on the topic.
pub(super) fn replay(
    run: &ReplayRequest,
    reader: Reader,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = run.source.name();
    let topic = RefCell::new(StreamTopic::of(run, &path, Vec::new()));
    let mut start = StreamStart::new(run, &path);
    let mut failure = None;
    let report = mcap::walk(
        reader,
        // On this thread: what is learnt from a first message must not depend on who was faster.
        // And nothing waits for a batch: the stream may pause.
        &WalkOptions {
            batch: 1,
            ..WalkOptions::default()
        },
        |channel| topic.borrow_mut().message_route(channel),
        Route::map,
        |items| {
            step(&topic, &mut start, items, pool, watch).unwrap_or_else(|why| {
                failure = Some(why);
                ControlFlow::Break(())
            })
        },
    )?;
    if let Some(e) = failure {
        return Err(e);
    }
    let mut topic = topic.into_inner();
    let mut last = Vec::new();
    topic.release(&mut last)?;
    topic.hand_over(&mut start);
    if !last.is_empty() {
        let _ = start.consume(last.drain(..), pool)?;
    }
    if start.is_idle() {
        let channels = topic.channels_of(&report.survey);
        return Err(topic.nothing(&channels, &problems(&report.survey)));
    }
    finish((run, topic), start, &report.survey, pool)
}

/// Replays lines of JSON, or rows of a table.
///
/// # Errors
/// As [`super::replay::run`].
pub(super) fn replay_lines(
    run: &ReplayRequest,
    lines: Lines<impl Read>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = run.source.name();
    let made_before = MadeBefore::in_lines(&lines).filter(|_| run.selection.topic.is_none());
    let doubt = doubt_of_unit(&lines).filter(|_| !run.plan.states_gyro_unit());
    let notes = lines.notes().into_iter().chain(doubt);
    let notes = notes.map(Diagnostic::from);
    let notes = notes.chain(made_before.as_ref().map(integrated_again));
    let topic = RefCell::new(StreamTopic::of(run, &path, notes.collect()));
    let mut start = StreamStart::new(run, &path);
    let (channels, left_out) = walk_once::<_, Error>(
        lines,
        (&path, &run.decode_options()),
        |known| topic.borrow_mut().route(known),
        |items, may_wait| {
            let flow = step(&topic, &mut start, items, pool, watch)?;
            if may_wait {
                start.flush_to_readers(pool)?;
            }
            Ok(flow)
        },
    )?;
    let topic = topic.into_inner();
    if start.is_idle() {
        return Err(topic.nothing(&channels, &[]));
    }
    let mut summary = finish((run, topic), start, &Survey::default(), pool)?;
    if let (Some(first), Some(note)) = (summary.topics.first_mut(), left_out) {
        first.findings.push(warning(&Diagnostic::from(note)));
    }
    Ok(summary)
}

/// Takes the next items of a stream.
fn step(
    topic: &RefCell<StreamTopic<'_>>,
    start: &mut StreamStart<'_>,
    items: &mut Vec<Item>,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<ControlFlow<()>> {
    let mut topic = topic.borrow_mut();
    topic.feed(items)?;
    topic.hand_over(start);
    topic.is_one_body()?;
    if start.consume(items.drain(..), pool)? == Flow::Closed {
        return Ok(ControlFlow::Break(()));
    }
    watch(&start.position());
    Ok(ControlFlow::Continue(()))
}

fn finish(
    (run, topic): (&ReplayRequest, StreamTopic<'_>),
    start: StreamStart<'_>,
    survey: &Survey,
    pool: &Pool,
) -> Result<RunSummary> {
    let session = start.into_session(pool)?;
    let mut summary = summarise::run(run, session.finish(run, pool)?, survey);
    if let Some(first) = summary.topics.first_mut() {
        first.findings.extend(topic.passed_over());
    }
    Ok(summary)
}
