//! A recorded log -> attitude, end to end. I/O.
//!
//! Of a file one walk goes as far as is needed to know clock, bias, initial attitude and lines through stamps, the next
//! integrates. A stream is read once; its first samples wait until these are known.

use super::channel_choice::{Reference, RunTopic, besides, choose, looked_at, reference, route};
use super::position::Position;
use super::replay_start::preparation;
use super::request::{ReplayRequest, refused};
use super::session_builder::begin;
use super::summarise;
use super::{mend, opening, replay_stream};
use crate::error::{Error, Result};
use crate::sink::{Flow, Transforms};
use crate::summary::{RunSummary, human_bytes};
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{EstimationSettings, Patience, Preparation, Prepared};
use strapd_attitude::setting::{BASE_FRAME, MEND, TF};
use strapd_recording::Input;
use strapd_recording::MadeBefore;
use strapd_recording::Recording;
use strapd_recording::Source;
use strapd_recording::format::open;
use strapd_recording::mcap::Survey;
use strapd_recording::pool::Pool;
use strapd_recording::recording::beside::AuxiliaryInputs;
use strapd_recording::recording::channel_route::Item;
use strapd_recording::recording::incoming::{Incoming, incoming};
use strapd_recording::recording::input::is_pipe;
use strapd_recording::recording::log_channel::{TF_STATIC, is_mounting};
use strapd_recording::recording::opened::{A_LITTLE_AHEAD, AHEAD};
use strapd_recording::recording::static_transforms::StaticTransforms;
use strapd_recording::text::printable;

/// Does it. `watch` is told where it is, often.
///
/// # Errors
/// Whatever kept it from being carried out. Bad samples and damaged files are no error: they are
/// counted in the summary.
pub fn run(
    run: &ReplayRequest,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let begun = Instant::now();
    let is_once = match &run.source {
        Source::File(path) => is_pipe(path),
        Source::Stdin => true,
        Source::Elsewhere(_) | Source::Parts(_) => false,
    };
    if run.plan.mend && is_once {
        tracing::warn!("{MEND}: a stream is read once, so nothing of it is changed");
    }
    let mended;
    let run = match run.plan.mend && !is_once {
        true => {
            mended = mended_request(run, pool)?;
            &mended
        }
        false => run,
    };
    let mut summary = match &run.source {
        Source::File(path) if is_once => piped(run, open(path)?, pool, watch)?,
        Source::File(_) | Source::Elsewhere(_) => {
            let input = match &run.source {
                Source::Elsewhere(address) => opening::elsewhere(address)?,
                source => opening::open(&source.name())?,
            };
            file(run, &input, pool, watch)?
        }
        Source::Parts(paths) => file(run, &opening::joined(paths)?, pool, watch)?,
        Source::Stdin => piped(run, std::io::stdin(), pool, watch)?,
    };
    summary.elapsed_secs = begun.elapsed().as_secs_f64();
    Ok(summary)
}

/// The request with settings that the recording itself corrects.
fn mended_request(run: &ReplayRequest, pool: &Pool) -> Result<ReplayRequest> {
    let dry = ReplayRequest {
        targets: Vec::new(),
        copy_input: false,
        speed: None,
        audience: None,
        against: None,
        reference: None,
        ..run.clone()
    };
    let plan = mend::settled(&run.plan, |plan| {
        let plan = EstimationSettings {
            mend: false,
            ..plan.clone()
        };
        let trial = ReplayRequest {
            plan,
            ..dry.clone()
        };
        let mut topics = self::run(&trial, pool, &mut |_| {})?.topics;
        let one = topics.pop().filter(|_| topics.is_empty());
        Ok::<_, Error>(one.map(|topic| topic.findings))
    })?;
    Ok(ReplayRequest {
        plan: EstimationSettings {
            mend: false,
            ..plan
        },
        ..run.clone()
    })
}

/// Standard input or a named pipe, told by the first bytes.
fn piped(
    run: &ReplayRequest,
    input: impl Read + Send + 'static,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let name = run.source.name();
    if run.selection.topic.as_deref() == Some("all") {
        // Which topics there are is known at the end of a stream alone.
        let input = Input::of_stream(&name, input, &opening::warn())?;
        return file(run, &input, pool, watch);
    }
    match incoming(&name, input, &run.selection.decode, &opening::warn())? {
        Incoming::Messages(reader) => replay_stream::replay(run, reader, pool, watch),
        Incoming::Lines(lines) => replay_stream::replay_lines(run, *lines, pool, watch),
        Incoming::Whole(input) => file(run, &input, pool, watch),
    }
}

/// Warning for attitudes made before that are taken for a recording.
pub(super) fn integrated_again(made: &MadeBefore) -> Diagnostic {
    Diagnostic::new(format!(
        "{made}: its rates are integrated again, less the bias that was taken out of them"
    ))
    .help("name what it was made of")
}

fn file(
    run: &ReplayRequest,
    input: &Input,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = input.name();
    let (named, options) = (run.selection.topic.as_deref(), run.decode_options());
    let log = Recording::told_apart_with_notes(input, named, &options, pool)?;
    let choice = log.choose(path, named)?;
    let mut chosen = choose(run, path, &log, &choice.topics)?;
    if let Some(first) = chosen.first_mut() {
        let warnings = &mut first.found.warnings;
        warnings.extend(choice.note);
        let notes = log.notes(run.plan.unit.is_some());
        warnings.extend(notes.cloned().map(Diagnostic::from));
        let made_before = log.made_before().filter(|_| named.is_none());
        warnings.extend(made_before.as_ref().map(integrated_again));
    }
    let reference = reference_of(run, path, &log, &chosen)?;
    let besides = besides(run, path, &log, &mut chosen)?;
    warn_of_second_parents(run, &log, &mut chosen, pool)?;
    let prepared = prepare(run, &log, (&chosen, &besides), pool)?
        .into_iter()
        .collect::<Result<Vec<Prepared>>>()?;
    let starts = chosen.iter().map(|c| (c.found.clone(), c.stream.clone()));
    let mut session = begin(run, path, starts.zip(prepared))?;
    if let (Some(reference), Some(topic)) = (&reference, session.topics.first_mut()) {
        if let Some(against) = &mut topic.against {
            against.take_reference_from(&reference.resolved);
        }
        if let Some(recorded) = &mut topic.recorded {
            recorded.take_reference_from(&reference.resolved);
        }
    }
    let span = log.survey.times;
    if let Some((first, last)) = span {
        session.length(last.saturating_sub(first) as f64 * 1e-9);
    }
    let total: u64 = log.survey.channels.iter().map(|c| c.messages).sum();
    let survey = log.walk::<Error>(
        AHEAD,
        pool,
        |channel| {
            let copied = run.copy_input;
            route(&chosen, reference.as_ref(), &besides, copied, channel)
        },
        |items| {
            let done = done(items, span);
            let flow = session.consume(items.drain(..), pool)?;
            if flow == Flow::Closed {
                return Ok(ControlFlow::Break(()));
            }
            watch(&session.position(done.filter(|_| total > 0)));
            Ok(ControlFlow::Continue(()))
        },
    )?;
    log_passed_over(path, &survey);
    Ok(summarise::run(run, session.finish(run, pool)?, &survey))
}

/// The reference on a topic of its own: the one asked for; for an audience the one that is found, if it can be read.
fn reference_of(
    run: &ReplayRequest,
    path: &Path,
    log: &Recording,
    chosen: &[RunTopic<'_>],
) -> Result<Option<Reference>> {
    let is_shown = run.audience.as_ref().is_some_and(|a| a.wants_recorded());
    match run.against.as_deref() {
        _ if run.reference.is_some() => Ok(None),
        None if is_shown => {
            Ok(reference(run, path, log, chosen, (Some(""), false)).unwrap_or_default())
        }
        asked => reference(run, path, log, chosen, (asked, false)),
    }
}

/// Warns where the sensor's frame has a parent in the recording that is copied, and the world would be a second one.
fn warn_of_second_parents(
    run: &ReplayRequest,
    log: &Recording,
    chosen: &mut [RunTopic<'_>],
    pool: &Pool,
) -> Result<()> {
    let is_one_tree = run.copy_input && run.frames.transforms == Transforms::Forward;
    let has_mountings = log.channels.iter().any(|k| is_mounting(&k.channel.topic));
    if !is_one_tree || run.frames.body.is_some() || !has_mountings {
        return Ok(());
    }
    let tree = StaticTransforms::of(log, pool)?;
    for topic in chosen {
        let frame = &topic.stream.frame_id;
        if let Some(root) = tree.root_of(frame) {
            let (frame, root) = (printable(frame), printable(root));
            topic.found.warnings.push(
                Diagnostic::new(format!(
                    "{frame} hangs on {root} by {TF_STATIC}, and a frame has one parent: the transform from the world tears that tree"
                ))
                .help(format!("{BASE_FRAME} {root} gives the attitude of {root}; {TF} reverse or none")),
            );
        }
    }
    Ok(())
}

fn log_passed_over(path: &Path, survey: &Survey) {
    let passed = survey.passed_over;
    if passed.chunks > 0 {
        tracing::info!(
            "{}: {} chunks ({}) have nothing of this by the index and were not fetched",
            path.display(),
            passed.chunks,
            human_bytes(passed.bytes)
        );
    }
}

/// Share of a log of this span that lies before the last of `items`.
pub(super) fn done(items: &[Item], span: Option<(u64, u64)>) -> Option<f64> {
    let (now, (first, last)) = items.last().and_then(log_time).zip(span)?;
    Some(now.saturating_sub(first) as f64 / last.saturating_sub(first).max(1) as f64)
}

/// Reads as far as needed to know clock, bias and initial attitude of every topic, or why one is refused.
pub(super) fn prepare(
    run: &ReplayRequest,
    log: &Recording,
    (chosen, besides): (&[RunTopic<'_>], &AuxiliaryInputs),
    pool: &Pool,
) -> Result<Vec<Result<Prepared>>> {
    let mut preparations: Vec<Preparation> = chosen
        .iter()
        .map(|c| preparation(run, &c.found, Patience::WholeLog))
        .collect();
    let mut failures: Vec<Option<Diagnostic>> = chosen.iter().map(|_| None).collect();
    log.walk::<Error>(
        A_LITTLE_AHEAD,
        pool,
        |channel| {
            let forces = run.plan.has_forces_beside.then_some(besides);
            looked_at(chosen, forces, channel)
        },
        |items| {
            for item in items.drain(..) {
                let (stream, raw) = match item {
                    Item::Sample(stream, raw) => (stream, raw),
                    Item::Beside(raw) => {
                        preparations.iter_mut().for_each(|p| p.take_beside(&raw));
                        continue;
                    }
                    _ => continue,
                };
                if let (Some(preparation), Some(failure @ None)) =
                    (preparations.get_mut(stream), failures.get_mut(stream))
                {
                    *failure = preparation.take(&raw).err();
                }
            }
            let mut open = preparations.iter().zip(&failures);
            Ok(
                if open.any(|(preparation, failure)| failure.is_none() && preparation.wants_more())
                {
                    ControlFlow::Continue(())
                } else {
                    ControlFlow::Break(())
                },
            )
        },
    )?;
    let name = |stream: usize| chosen.get(stream).map_or("", |c| c.found.name.as_str());
    Ok(preparations
        .into_iter()
        .zip(failures)
        .enumerate()
        .map(|(stream, (preparation, failure))| {
            failure
                .map_or_else(|| preparation.decide(), Err)
                .map_err(|what| refused(log.name(), name(stream), what))
        })
        .collect())
}

fn log_time(item: &Item) -> Option<u64> {
    match item {
        Item::Sample(_, raw) | Item::Reference(raw, _) | Item::Beside(raw) => {
            u64::try_from(raw.log.0).ok()
        }
        Item::Undecodable(_, why) => u64::try_from(why.0.0).ok(),
        Item::Copy(message) => Some(message.log_time),
    }
}
