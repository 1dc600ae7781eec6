//! An MCAP that can be read only once -> attitude. I/O.
//!
//! Nothing is known before it comes: the first IMU topic is taken, and its first samples wait until
//! clock, bias and initial attitude are known.

use super::channel_choice::which_stamp;
use super::position::Position;
use super::replay_start::StreamStart;
use super::request::ReplayRequest;
use super::session::TopicInfo;
use super::summarise;
use crate::error::{Error, Result};
use crate::finding::{Finding, Severity};
use crate::sink::{Flow, Stream, output_topic};
use crate::summary::RunSummary;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, Meaning};
use strapd_attitude::setting::TOPIC;
use strapd_recording::TopicBeside;
use strapd_recording::decode::{Decoder, Wanted};
use strapd_recording::mcap::{self, Channel, Reader, Survey, WalkOptions};
use strapd_recording::pool::Pool;
use strapd_recording::recording::beside;
use strapd_recording::recording::channel_route::{Item, Noticed, Route, RouteTarget};
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::held::Held;
use strapd_recording::recording::log_channel::{LogChannel, described, known, rank};
use strapd_recording::recording::opened::{explained, problems};
use strapd_recording::recording::sources::publisher;
use strapd_recording::recording::topics::{self, PICKED_UNNAMED};

/// An MCAP that can be read only once.
pub(super) fn replay(
    run: &ReplayRequest,
    reader: Reader,
    pool: &Pool,
    watch: &mut dyn FnMut(&Position),
) -> Result<RunSummary> {
    let path = run.source.name();
    let mut start = StreamStart::new(run, &path, None);
    let mut failure = None;
    let picked = std::cell::RefCell::new(StreamTopic {
        decoders: Decoders::of_run(&run.plan, &run.selection.decode),
        ..StreamTopic::default()
    });
    let report = mcap::walk(
        reader,
        // On this thread: what is learnt from a first message must not depend on who was faster.
        // And nothing waits for a batch: the stream may pause.
        &WalkOptions {
            batch: 1,
            ..WalkOptions::default()
        },
        |channel| picked.borrow_mut().route(run, channel),
        Route::map,
        |items| {
            let fed = picked.borrow_mut().feed(run, &path, items);
            let step = fed
                .and_then(|()| picked.borrow_mut().hand_over(&mut start))
                .and_then(|()| picked.borrow().is_one_body(&path))
                .and_then(|()| start.consume(items.drain(..), pool));
            match step {
                Ok(Flow::Continue) => {
                    watch(&start.position());
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
    let mut picked = picked.into_inner();
    let mut last = Vec::new();
    picked.release(run, &path, &mut last)?;
    picked.hand_over(&mut start)?;
    if !last.is_empty() {
        let _ = start.consume(last.drain(..), pool)?;
    }
    if start.is_idle() {
        return Err(picked.nothing(run, &path, &report.survey));
    }
    let session = start.into_session(pool)?;
    let mut summary = summarise::run(run, session.finish(run, pool)?, &report.survey);
    if let Some(topic) = summary.topics.first_mut() {
        topic.findings.extend(picked.passed_over());
    }
    Ok(summary)
}

/// The first IMU of a stream.
#[derive(Default)]
struct StreamTopic {
    topic: Option<String>,
    publisher: String,
    noticed: Arc<Noticed>,
    /// Channels of the topic so far.
    channels: usize,
    found: Option<(TopicInfo, Stream)>,
    /// Whether there is or was such a find.
    is_met: bool,
    /// Channels of the topic whose first messages tell how to read them.
    held: Vec<Held>,
    others: BTreeSet<String>,
    /// Topic of the magnetic field, where no flag names it.
    field_topic: Option<String>,
    refusals: Vec<Diagnostic>,
    /// Decoders with the run's options, and with none.
    decoders: Decoders,
    plain: Decoders,
}

impl StreamTopic {
    fn route(&mut self, run: &ReplayRequest, channel: &Arc<Channel>) -> Option<Route> {
        let copied = run.copy_input.then(|| channel.clone());
        let beside = self.beside(run, channel);
        let found = known(channel, 0, None, &mut self.plain);
        let named = run.selection.topic.as_deref();
        let wanted = match (&self.topic, named) {
            (Some(topic), _) => {
                let is_same = *topic == channel.topic;
                if is_same && publisher(channel) != self.publisher {
                    let other = format!("{topic} published by `{}`", publisher(channel));
                    self.others.insert(other);
                    return Route::other(beside, copied);
                }
                is_same
            }
            (None, Some(name)) => name == channel.topic,
            // A twist that may be a body rate is taken only when nothing better is there, and what
            // is still to come nobody knows.
            (None, None) => rank(&found.role) > PICKED_UNNAMED,
        };
        if !wanted {
            if rank(&found.role) >= PICKED_UNNAMED {
                self.others.insert(channel.topic.clone());
            }
            return Route::other(beside, copied);
        }
        match self.decoders.of(channel) {
            Ok(decoder) => {
                if self.topic.is_none() {
                    self.topic = Some(channel.topic.clone());
                    self.publisher = publisher(channel);
                }
                let taker = RouteTarget {
                    stream: 0,
                    noticed: self.noticed.clone(),
                };
                self.channels += 1;
                if decoder.has_bare_stamps() {
                    let held = Held::new(channel, decoder, taker, self.channels, copied);
                    let route = held.route();
                    self.held.push(held);
                    return Some(route);
                }
                self.meet(run, channel, &decoder);
                Some(
                    Route::to(decoder, vec![taker])
                        .taking_turns(self.channels)
                        .beside(beside)
                        .copying(copied),
                )
            }
            Err(why) => {
                self.refusals.push(Diagnostic::from(&why));
                Route::other(beside, copied)
            }
        }
    }

    /// Decoder for what is read of a channel beside the samples: of the topics named, or of the first with a field.
    fn beside(&mut self, run: &ReplayRequest, channel: &Arc<Channel>) -> Option<Decoder> {
        let of = |wanted, beside: Option<&TopicBeside>| {
            let options = beside::options(wanted, beside);
            Decoders::of_run(&run.plan, &options).of(channel)
        };
        let named = [
            (Wanted::Forces, &run.selection.accel),
            (Wanted::Fields, &run.selection.mag),
        ];
        for (wanted, beside) in named {
            if let Some(beside) = beside.as_ref().filter(|b| b.topic == channel.topic) {
                return of(wanted, Some(beside))
                    .map_err(|why| self.refusals.push(Diagnostic::from(&why)))
                    .ok();
            }
        }
        let is_open = run.plan.aid == Aid::GravityAndField && run.selection.mag.is_none();
        // JSON says what it holds only in its messages, which are still to come.
        if !is_open || channel.message_encoding == "json" || !beside::may_be_field(channel) {
            return None;
        }
        let topic = self.field_topic.as_ref();
        if topic.is_some_and(|topic| *topic != channel.topic) {
            return None;
        }
        let decoder = of(Wanted::Fields, None).ok()?;
        let has_rate = self.decoders.of(channel).is_ok_and(|d| d.stated().has_gyro);
        self.field_topic = Some(channel.topic.clone());
        // Of the samples' own messages it comes with them.
        (!has_rate).then_some(decoder)
    }

    /// Settles how the topic is read: by the decoder of its first channel.
    fn meet(&mut self, run: &ReplayRequest, channel: &Channel, decoder: &Decoder) {
        if std::mem::replace(&mut self.is_met, true) {
            return;
        }
        self.found = Some((
            TopicInfo {
                name: channel.topic.clone(),
                output_topic: output_topic(&channel.topic, &BTreeSet::new()),
                described: described(channel),
                resolved: Meaning::new(&run.plan, &decoder.stated().declared),
                noticed: self.noticed.clone(),
                warnings: which_stamp(decoder).into_iter().map(Into::into).collect(),
            },
            Stream::new(&channel.topic, ""),
        ));
    }

    /// Hands the topic over, once it is settled.
    fn hand_over(&mut self, start: &mut StreamStart<'_>) -> Result<()> {
        match self.found.take() {
            Some((found, stream)) => start.meet(found, stream),
            None => Ok(()),
        }
    }

    /// Hands messages of channels whose first ones wait to these, and takes what comes of it.
    fn feed(&mut self, run: &ReplayRequest, path: &Path, items: &mut Vec<Item>) -> Result<()> {
        if self.held.is_empty() {
            return Ok(());
        }
        for item in std::mem::take(items) {
            let place = match &item {
                Item::Copy(copied) => self.held.iter().position(|held| held.is_of(copied)),
                _ => None,
            };
            match (item, place.and_then(|place| self.held.get_mut(place))) {
                (Item::Copy(copied), Some(held)) => {
                    let was_waiting = held.is_waiting();
                    held.take(*copied, &self.decoders, items)
                        .map_err(|why| Error::unsupported(path, &why))?;
                    if was_waiting && !held.is_waiting() {
                        let (channel, decoder) = held.known();
                        self.meet(run, &channel, &decoder);
                    }
                }
                (item, _) => items.push(item),
            }
        }
        Ok(())
    }

    /// The stream has ended: nothing waits any longer.
    fn release(&mut self, run: &ReplayRequest, path: &Path, items: &mut Vec<Item>) -> Result<()> {
        for mut held in std::mem::take(&mut self.held) {
            if held.is_waiting() {
                held.release(&self.decoders, items)
                    .map_err(|why| Error::unsupported(path, &why))?;
                let (channel, decoder) = held.known();
                self.meet(run, &channel, &decoder);
            }
        }
        Ok(())
    }

    /// Whether the topic's channels so far are one publisher's.
    fn is_one_body(&self, path: &Path) -> Result<()> {
        if self.channels > 1 && self.noticed.are_several() {
            return Err(strapd_recording::Error::Topic {
                path: path.to_owned(),
                topic: self.topic.clone().unwrap_or_default(),
                what: Diagnostic::new(format!(
                    "{} channels of this topic take turns: two publishers, and they must not be mixed",
                    self.channels
                ))
                .help(format!("save it to a file, where {TOPIC} tells them apart")),
            }
            .into());
        }
        Ok(())
    }

    /// Why nothing was picked.
    fn nothing(self, run: &ReplayRequest, path: &Path, survey: &Survey) -> Error {
        if let Some(what) = self.refusals.into_iter().next() {
            return Error::unsupported(path, what);
        }
        let mut decoders = Decoders::default();
        let channels: Vec<LogChannel> = survey
            .channels
            .iter()
            .map(|c| known(&c.channel, c.messages, None, &mut decoders))
            .collect();
        let candidates: Vec<_> = channels.iter().map(LogChannel::candidate).collect();
        let error = match topics::choose(path, &candidates, run.selection.topic.as_deref()) {
            Err(e) => e,
            Ok(choice) => {
                let what = format!(
                    "no IMU topic; {} may carry a body rate, but is not taken unnamed from a stream, where a better one could still come",
                    choice.topics.join(", ")
                );
                let what = Diagnostic::new(what).help(format!("{TOPIC} NAME"));
                strapd_recording::Error::unsupported(path, what)
            }
        };
        explained(error, &channels, &problems(survey)).into()
    }

    fn passed_over(&self) -> Option<Finding> {
        let names: Vec<&str> = self
            .others
            .iter()
            .filter(|t| Some(*t) != self.topic.as_ref())
            .map(String::as_str)
            .collect();
        (!names.is_empty()).then(|| {
            let what = format!(
                "the first IMU topic was taken; also there: {}",
                names.join(", ")
            );
            Finding::new(Severity::Warning, "several-topics", what)
                .with("topics", names)
                .help([TOPIC.to("NAME")])
        })
    }
}
