//! A recorded log -> attitude, end to end. I/O.
//!
//! A file is read twice: once as far as is needed to know clock, bias and initial attitude, then
//! to integrate. A stream is read once; its first samples wait until these are known.

use super::log::{Known, Log, described, explained, known, plain, rank};
use super::outlet::Outlet;
use super::pool::Pool;
use super::position::Position;
use super::preparation::{Patience, Preparation, Prepared, Resolved};
use super::route::{Item, Noticed, Route};
use super::session::{Found, Session, Source, Topic};
use super::summarise;
use super::topics::{self, PICKED_UNNAMED};
use super::{lines, provenance};
use crate::config::Plan;
use crate::decode::Decoder;
use crate::error::{Error, Result};
use crate::report::summary::RunSummary;
use crate::sink::{self, Flow, Stream, Target, output_topic};
use crate::source::mcap::{self, Channel, Reader, Survey, WalkOptions};
use std::collections::BTreeSet;
use std::io::{BufReader, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// A replay to be done.
#[derive(Clone, Debug)]
pub struct Replay {
    /// From where.
    pub source: Source,
    /// To where.
    pub targets: Vec<Target>,
    /// How samples are understood and integrated.
    pub plan: Plan,
    /// How outputs are made.
    pub options: sink::Options,
    /// Whether every message of the input is copied to MCAP outputs.
    pub copy_input: bool,
    /// `--out-rate`, Hz.
    pub out_rate: Option<f64>,
    /// `--speed`; `None` = as fast as possible.
    pub speed: Option<f64>,
    /// `--against-recorded`: the reference's topic, empty = found.
    pub against: Option<String>,
    /// The command as typed, for the output's metadata.
    pub command: String,
}

/// Does it. `watch` is told where it is, often.
///
/// # Errors
/// Whatever kept it from being carried out. Bad samples and damaged files are no error: they are
/// counted in the summary.
pub fn run(run: &Replay, pool: &Pool, watch: &mut dyn FnMut(&Position)) -> Result<RunSummary> {
    let begun = Instant::now();
    let mut summary = match &run.source {
        Source::File(path) if is_lines(path) => {
            let file = lines::open(path)?;
            lines::replay(run, BufReader::new(file), pool, watch)?
        }
        Source::File(path) if is_pipe(path) => {
            let pipe = lines::open(path)?;
            piped(run, pipe, pool, watch)?
        }
        Source::File(path) => file(run, path, pool, watch)?,
        Source::Stdin => piped(run, std::io::stdin(), pool, watch)?,
    };
    summary.elapsed_secs = begun.elapsed().as_secs_f64();
    Ok(summary)
}

/// Whether a file is NDJSON, by its extension.
fn is_lines(path: &Path) -> bool {
    path.extension().is_some_and(|e| {
        ["ndjson", "jsonl"]
            .iter()
            .any(|known| e.eq_ignore_ascii_case(known))
    })
}

/// Whether a path names what can be read only once: a named pipe, a shell's `<(...)`, a device.
fn is_pipe(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Standard input or a named pipe: an MCAP or lines, told apart by the first bytes.
fn piped(
    run: &Replay,
    input: impl Read + Send + 'static,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let mut input = BufReader::with_capacity(1 << 16, input);
    let mut head = Vec::new();
    Read::take(&mut input, mcap::MAGIC.len() as u64)
        .read_to_end(&mut head)
        .map_err(|source| Error::Read {
            path: run.source.name(),
            offset: 0,
            source,
        })?;
    if head.is_empty() {
        return Err(Error::Empty {
            path: run.source.name(),
        });
    }
    let is_mcap = head == mcap::MAGIC;
    let whole = std::io::Cursor::new(head).chain(input);
    if is_mcap {
        let reader = Reader::from_stream(run.source.name(), Box::new(whole))?;
        stream(run, reader, pool, watch)
    } else {
        lines::replay(run, BufReader::with_capacity(1 << 16, whole), pool, watch)
    }
}

/// A topic that was chosen, and how its channels are read.
struct Chosen {
    found: Found,
    stream: Stream,
    channels: Vec<(Arc<Channel>, Decoder)>,
}

fn file(
    run: &Replay,
    path: &Path,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let log = Log::open(path, pool)?;
    let choice = log.choose(path, run.plan.topic.as_deref())?;
    let mut chosen = choose(run, path, &log, &choice.topics)?;
    if let (Some(note), Some(first)) = (choice.note, chosen.first_mut()) {
        first.found.warnings.push(note);
    }
    let reference = reference(run, path, &log, &chosen)?;
    let prepared = prepare(run, path, &log, &chosen, pool)?;

    let streams: Vec<Stream> = chosen
        .iter()
        .zip(&prepared)
        .map(|(c, p)| labelled(c.stream.clone(), &run.plan, &c.found.resolved, p))
        .collect();
    let founds: Vec<Found> = chosen.iter().map(|c| c.found.clone()).collect();
    let mut session = begin(run, path, founds, prepared, &streams)?;
    if let (Some((_, resolved)), Some(topic)) = (&reference, session.topics.first_mut())
        && let Some(against) = &mut topic.against
    {
        against.take_reference_from(resolved);
    }
    let span = log.survey.times;
    let total: u64 = log.survey.channels.iter().map(|c| c.messages).sum();
    let reader = again(&log, path)?;
    let mut failure = None;
    let report = mcap::walk(
        reader,
        &WalkOptions {
            pool: Some(pool.rayon()),
            ..WalkOptions::default()
        },
        |channel| route(&mut chosen, reference.as_ref(), run.copy_input, channel),
        Route::map,
        |items| {
            let done = items
                .last()
                .and_then(log_time)
                .zip(span)
                .map(|(now, (first, last))| {
                    (now.saturating_sub(first)) as f64 / last.saturating_sub(first).max(1) as f64
                });
            match session.consume(items.drain(..), pool) {
                Ok(Flow::Continue) => {
                    watch(&session.position(done.filter(|_| total > 0)));
                    ControlFlow::Continue(())
                }
                Ok(Flow::Closed) => ControlFlow::Break(()),
                Err(e) => {
                    failure = Some(e);
                    ControlFlow::Break(())
                }
            }
        },
    )?;
    if let Some(e) = failure {
        return Err(e);
    }
    end(run, session, &report.survey, pool)
}

/// An MCAP that can be read only once.
fn stream(
    run: &Replay,
    reader: Reader,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = run.source.name();
    let mut waiting = Waiting::new(run, &path);
    let mut failure = None;
    let picked = std::cell::RefCell::new(Picked::default());
    let report = mcap::walk(
        reader,
        // On this thread: what is learnt from a first message must not depend on who was faster.
        &WalkOptions::default(),
        |channel| picked.borrow_mut().route(run, channel),
        Route::map,
        |items| {
            let step = waiting
                .meet(&mut picked.borrow_mut().found)
                .and_then(|()| waiting.consume(items.drain(..), pool));
            match step {
                Ok(Flow::Continue) => {
                    watch(&waiting.position());
                    ControlFlow::Continue(())
                }
                Ok(Flow::Closed) => ControlFlow::Break(()),
                Err(e) => {
                    failure = Some(e);
                    ControlFlow::Break(())
                }
            }
        },
    )?;
    if let Some(e) = failure {
        return Err(e);
    }
    let picked = picked.into_inner();
    if waiting.is_idle() {
        return Err(picked.nothing(run, &path, &report.survey));
    }
    let session = waiting.into_session(pool)?;
    let mut summary = end(run, session, &report.survey, pool)?;
    if let Some(topic) = summary.topics.first_mut() {
        topic.warnings.extend(picked.passed_over());
    }
    Ok(summary)
}

/// The first IMU of a stream.
#[derive(Default)]
struct Picked {
    topic: Option<String>,
    found: Option<(Found, Stream)>,
    others: BTreeSet<String>,
    refusals: Vec<String>,
}

impl Picked {
    fn route(&mut self, run: &Replay, channel: &Arc<Channel>) -> Option<Route> {
        let copied = run.copy_input.then(|| channel.clone());
        let only_copied = |copied: Option<Arc<Channel>>| {
            copied.map(|channel| Route {
                decoder: None,
                stream: 0,
                is_reference: false,
                copied: Some(channel),
                noticed: Arc::default(),
            })
        };
        let found = known(channel, 0, None);
        let named = run.plan.topic.as_deref().filter(|t| *t != "all");
        let wanted = match (&self.topic, named) {
            (Some(topic), _) => *topic == channel.topic,
            (None, Some(name)) => name == channel.topic,
            // A twist that may be a body rate is taken only when nothing better is there, and what
            // is still to come nobody knows.
            (None, None) => rank(&found.role) > PICKED_UNNAMED,
        };
        if !wanted {
            if rank(&found.role) >= PICKED_UNNAMED {
                self.others.insert(channel.topic.clone());
            }
            return only_copied(copied);
        }
        match Decoder::compile(&plain(channel), &run.plan.decode) {
            Ok(decoder) => {
                let noticed = Arc::<Noticed>::default();
                if self.topic.is_none() {
                    self.topic = Some(channel.topic.clone());
                    let resolved = Resolved::new(&run.plan, decoder.stated());
                    self.found = Some((
                        Found {
                            name: channel.topic.clone(),
                            output_topic: output_topic(&channel.topic, &BTreeSet::new()),
                            described: described(channel),
                            resolved,
                            noticed: noticed.clone(),
                            warnings: Vec::new(),
                        },
                        Stream::new(&channel.topic, ""),
                    ));
                }
                Some(Route {
                    decoder: Some(decoder),
                    stream: 0,
                    is_reference: false,
                    copied,
                    noticed,
                })
            }
            Err(why) => {
                self.refusals.push(why.to_string());
                only_copied(copied)
            }
        }
    }

    /// Why nothing was picked.
    fn nothing(self, run: &Replay, path: &Path, survey: &Survey) -> Error {
        if let Some(what) = self.refusals.into_iter().next() {
            return Error::Unsupported {
                path: path.to_owned(),
                what,
            };
        }
        let channels: Vec<Known> = survey
            .channels
            .iter()
            .map(|c| known(&c.channel, c.messages, None))
            .collect();
        let candidates: Vec<_> = channels.iter().map(Known::candidate).collect();
        let error = match topics::choose(path, &candidates, run.plan.topic.as_deref()) {
            Err(e) => e,
            Ok(choice) => Error::Unsupported {
                path: path.to_owned(),
                what: format!(
                    "no IMU topic; {} may carry a body rate, but is not taken unnamed from a stream, where a better one could still come\n  help: --topic NAME",
                    choice.topics.join(", ")
                ),
            },
        };
        explained(error, &channels, &summarise::problems(survey))
    }

    fn passed_over(&self) -> Option<String> {
        let names: Vec<&str> = self
            .others
            .iter()
            .filter(|t| Some(*t) != self.topic.as_ref())
            .map(String::as_str)
            .collect();
        (!names.is_empty()).then(|| {
            format!(
                "the first IMU topic was taken; also there: {} (--topic)",
                names.join(", ")
            )
        })
    }
}

/// A run over a stream: first gathers, then runs.
pub(super) struct Waiting<'r> {
    run: &'r Replay,
    path: &'r Path,
    gathering: Option<(Found, Stream, Preparation)>,
    held: Vec<Item>,
    session: Option<Session>,
}

impl<'r> Waiting<'r> {
    pub(super) fn new(run: &'r Replay, path: &'r Path) -> Waiting<'r> {
        Waiting {
            run,
            path,
            gathering: None,
            held: Vec::new(),
            session: None,
        }
    }

    /// The stream's topic is known.
    pub(super) fn meet(&mut self, found: &mut Option<(Found, Stream)>) -> Result<()> {
        if let Some((found, stream)) = found.take() {
            let preparation =
                Preparation::new(&self.run.plan, &found.resolved, Patience::FirstMinute);
            self.gathering = Some((found, stream, preparation));
        }
        Ok(())
    }

    /// Whether no topic was met.
    pub(super) fn is_idle(&self) -> bool {
        self.gathering.is_none() && self.session.is_none()
    }

    pub(super) fn consume(
        &mut self,
        items: impl Iterator<Item = Item>,
        pool: &Pool,
    ) -> Result<Flow> {
        if let Some(session) = &mut self.session {
            return session.consume(items, pool);
        }
        let Some((found, _, preparation)) = &mut self.gathering else {
            self.held.extend(items);
            return Ok(Flow::Continue);
        };
        for item in items {
            if let Item::Sample(_, raw) = &item {
                preparation
                    .take(raw)
                    .map_err(|what| refused(self.path, &found.name, what))?;
            }
            self.held.push(item);
        }
        if preparation.wants_more() {
            return Ok(Flow::Continue);
        }
        self.begin(pool)
    }

    fn begin(&mut self, pool: &Pool) -> Result<Flow> {
        let Some((found, mut stream, preparation)) = self.gathering.take() else {
            return Ok(Flow::Continue);
        };
        // Read on this thread alone, so that the first message is the first.
        if let Some(frame) = found.noticed.frame_id.get() {
            stream.frame_id.clone_from(frame);
        }
        let prepared = preparation
            .decide()
            .map_err(|what| refused(self.path, &found.name, what))?;
        let stream = labelled(stream, &self.run.plan, &found.resolved, &prepared);
        let session = begin(self.run, self.path, vec![found], vec![prepared], &[stream])?;
        let held = std::mem::take(&mut self.held);
        self.session.insert(session).consume(held.into_iter(), pool)
    }

    /// Pushes what is known out to whoever reads it as it comes.
    pub(super) fn flush_to_readers(&mut self, pool: &Pool) -> Result<()> {
        match &mut self.session {
            Some(session) => session.flush_to_readers(pool),
            None => Ok(()),
        }
    }

    pub(super) fn position(&self) -> Position {
        self.session
            .as_ref()
            .map_or_else(Position::default, |s| s.position(None))
    }

    /// The input has ended.
    pub(super) fn into_session(mut self, pool: &Pool) -> Result<Session> {
        if self.session.is_none() {
            let _ = self.begin(pool)?;
        }
        self.session.ok_or_else(|| Error::NoImuTopic {
            path: self.path.to_owned(),
            topics: topics::listing(&[]),
        })
    }
}

fn choose(run: &Replay, path: &Path, log: &Log, names: &[String]) -> Result<Vec<Chosen>> {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    if run.copy_input {
        taken.extend(log.channels.iter().map(|c| c.channel.topic.clone()));
    }
    names
        .iter()
        .map(|name| {
            let chosen = choose_one(run, path, log, name, &taken)?;
            taken.insert(chosen.found.output_topic.clone());
            Ok(chosen)
        })
        .collect()
}

fn choose_one(
    run: &Replay,
    path: &Path,
    log: &Log,
    name: &str,
    taken: &BTreeSet<String>,
) -> Result<Chosen> {
    let mut channels = Vec::new();
    let mut refusals = Vec::new();
    for known in log.channels.iter().filter(|c| c.channel.topic == name) {
        match known.decoder(&run.plan.decode) {
            Ok(decoder) => channels.push((known, decoder)),
            Err(why) => refusals.push(why.to_string()),
        }
    }
    let Some((first, decoder)) = channels.first() else {
        let what = refusals.into_iter().next().unwrap_or_default();
        return Err(Error::Unsupported {
            path: path.to_owned(),
            what,
        });
    };
    if !decoder.stated().has_gyro {
        return Err(Error::Unsupported {
            path: path.to_owned(),
            what: format!(
                "{name} ({}): carries no body rate\n  help: --field gyro=PATH names one",
                described(&first.channel)
            ),
        });
    }
    let frame = first
        .first
        .as_ref()
        .and_then(|(_, payload)| decoder.frame_id(payload))
        .unwrap_or_default();
    let topic = output_topic(name, taken);
    let mut stream = Stream::new(name, &frame);
    stream.output_topic = topic.clone();
    let found = Found {
        name: name.to_owned(),
        output_topic: topic,
        described: described(&first.channel),
        resolved: Resolved::new(&run.plan, decoder.stated()),
        noticed: Arc::default(),
        warnings: refusals,
    };
    let channels = channels
        .into_iter()
        .map(|(k, d)| (k.channel.clone(), d))
        .collect();
    Ok(Chosen {
        found,
        stream,
        channels,
    })
}

/// The channel whose orientations the estimate is held against; `None` = the samples' own.
fn reference(
    run: &Replay,
    path: &Path,
    log: &Log,
    chosen: &[Chosen],
) -> Result<Option<((Arc<Channel>, Decoder), Resolved)>> {
    let Some(asked) = &run.against else {
        return Ok(None);
    };
    let taken = |k: &&Known| chosen.iter().any(|c| c.found.name == k.channel.topic);
    let found = if asked.is_empty() {
        let mut others = log.channels.iter().filter(|k| {
            !taken(k) && k.role.has_orientation && rank(&k.role) <= 1 && k.messages > 0
        });
        match (others.next(), others.next()) {
            // An odometry's or a camera's pose beside an IMU that has its own is another matter.
            (Some(one), None) if !one.role.has_rate => one,
            _ => return Ok(None),
        }
    } else {
        let Some(named) = log.channels.iter().find(|k| k.channel.topic == *asked) else {
            return Err(Error::NoSuchTopic {
                path: path.to_owned(),
                topic: asked.clone(),
                topics: topics::listing(&log.candidates()),
            });
        };
        if taken(&named) {
            return Ok(None);
        }
        named
    };
    let decoder = found
        .decoder(&crate::decode::Options::default())
        .map_err(|why| Error::Unsupported {
            path: path.to_owned(),
            what: why.to_string(),
        })?;
    let resolved = Resolved::new(&run.plan, decoder.stated());
    Ok(Some(((found.channel.clone(), decoder), resolved)))
}

/// Reads as far as needed to know clock, bias and initial attitude of every topic.
fn prepare(
    run: &Replay,
    path: &Path,
    log: &Log,
    chosen: &[Chosen],
    pool: &Pool,
) -> Result<Vec<Prepared>> {
    let mut preparations: Vec<Preparation> = chosen
        .iter()
        .map(|c| Preparation::new(&run.plan, &c.found.resolved, Patience::WholeLog))
        .collect();
    let mut failure = None;
    mcap::walk(
        again(log, path)?,
        // A little ahead is enough: this usually ends at once.
        &WalkOptions {
            pool: Some(pool.rayon()),
            in_flight: 4 << 20,
            ..WalkOptions::default()
        },
        |channel| {
            let (stream, decoder) = find(chosen, channel)?;
            Some(Route {
                decoder: Some(decoder.clone()),
                stream,
                is_reference: false,
                copied: None,
                noticed: Arc::default(),
            })
        },
        Route::map,
        |items| {
            for item in items.drain(..) {
                let Item::Sample(stream, raw) = item else {
                    continue;
                };
                let Some(preparation) = preparations.get_mut(stream) else {
                    continue;
                };
                if let Err(what) = preparation.take(&raw) {
                    failure = Some((stream, what));
                    return ControlFlow::Break(());
                }
            }
            if preparations.iter().any(Preparation::wants_more) {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        },
    )?;
    let name = |stream: usize| chosen.get(stream).map_or("", |c| c.found.name.as_str());
    if let Some((stream, what)) = failure {
        return Err(refused(path, name(stream), what));
    }
    preparations
        .into_iter()
        .enumerate()
        .map(|(stream, p)| p.decide().map_err(|what| refused(path, name(stream), what)))
        .collect()
}

fn find<'c>(chosen: &'c [Chosen], channel: &Channel) -> Option<(usize, &'c Decoder)> {
    chosen.iter().enumerate().find_map(|(stream, c)| {
        c.channels
            .iter()
            .find(|(known, _)| is_same(known, channel))
            .map(|(_, decoder)| (stream, decoder))
    })
}

/// Whether a channel met in a walk is the one the survey knows: the index may differ, since the
/// summary lists them in another order.
fn is_same(known: &Channel, met: &Channel) -> bool {
    known.id == met.id && known.topic == met.topic && known.schema_id == met.schema_id
}

fn route(
    chosen: &mut [Chosen],
    reference: Option<&((Arc<Channel>, Decoder), Resolved)>,
    copy_input: bool,
    channel: &Arc<Channel>,
) -> Option<Route> {
    let copied = copy_input.then(|| channel.clone());
    if let Some((stream, decoder)) = find(chosen, channel) {
        let noticed = chosen
            .get(stream)
            .map(|c| c.found.noticed.clone())
            .unwrap_or_default();
        return Some(Route {
            decoder: Some(decoder.clone()),
            stream,
            is_reference: false,
            copied,
            noticed,
        });
    }
    let decoder = reference
        .filter(|((known, _), _)| is_same(known, channel))
        .map(|((_, decoder), _)| decoder.clone());
    (decoder.is_some() || copied.is_some()).then(|| Route {
        is_reference: decoder.is_some(),
        decoder,
        stream: 0,
        copied,
        noticed: Arc::default(),
    })
}

fn log_time(item: &Item) -> Option<u64> {
    match item {
        Item::Sample(_, raw) | Item::Reference(raw) => u64::try_from(raw.log.0).ok(),
        Item::Undecodable(_, why) => u64::try_from(why.0.0).ok(),
        Item::Copy(message) => Some(message.log_time),
    }
}

/// The output's labels: frames and axes as they will be in the numbers.
fn labelled(mut stream: Stream, plan: &Plan, resolved: &Resolved, prepared: &Prepared) -> Stream {
    let (world, body) = resolved.labels(prepared.world);
    stream.world_axes = world;
    stream.body_axes = body;
    if resolved.is_remapped(plan, prepared.world) {
        stream.rotates = "body_to_world".to_owned();
        // The sensor's own frame keeps its axes; this is another one.
        stream.frame_id = match stream.frame_id.as_str() {
            "" => stream.body_axes.clone(),
            id => format!("{id}_{}", stream.body_axes),
        };
    }
    stream
}

fn begin(
    run: &Replay,
    path: &Path,
    founds: Vec<Found>,
    prepared: Vec<Prepared>,
    streams: &[Stream],
) -> Result<Session> {
    let provenance = provenance::of(run, &founds, &prepared, streams)?;
    let topics = founds
        .into_iter()
        .zip(prepared)
        .map(|(found, prepared)| {
            Topic::new(path, &run.plan, found, prepared, run.against.is_some())
        })
        .collect::<Result<Vec<_>>>()?;
    let inputs: Vec<PathBuf> = match &run.source {
        Source::File(path) => vec![path.clone()],
        Source::Stdin => Vec::new(),
    };
    let outlet = Outlet::open(
        &run.targets,
        &inputs,
        run.options,
        streams,
        &provenance,
        run.out_rate,
        run.speed,
    )?;
    Ok(Session::new(topics, outlet))
}

pub(super) fn end(
    run: &Replay,
    session: Session,
    survey: &Survey,
    pool: &Pool,
) -> Result<RunSummary> {
    let (topics, outputs) = session.finish(pool)?;
    Ok(summarise::run(run, topics, outputs, survey))
}

fn again(log: &Log, path: &Path) -> Result<Reader> {
    match log.reader() {
        Some(reader) => Ok(reader),
        None => Reader::open(path),
    }
}

pub(super) fn refused(path: &Path, topic: &str, what: String) -> Error {
    Error::Topic {
        path: path.to_owned(),
        topic: topic.to_owned(),
        what,
    }
}
