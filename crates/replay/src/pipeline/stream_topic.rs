//! Channels of a stream as they are met -> the topic that is taken, and how it is read. Pure.
//!
//! Apart from the choice of a log's topics because what is still to come nobody knows: the first channel that will do is
//! the one that is meant, and the others are named at the end.

use super::channel_choice::which_stamp;
use super::replay_start::StreamStart;
use super::request::ReplayRequest;
use super::session::TopicInfo;
use crate::error::{Error, Result};
use crate::finding::{Finding, Severity};
use crate::sink::{Stream, output_topic};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{Aid, Meaning};
use strapd_attitude::setting::TOPIC;
use strapd_recording::TopicBeside;
use strapd_recording::decode::{Decoder, Wanted};
use strapd_recording::mcap::{Channel, Survey};
use strapd_recording::recording::beside;
use strapd_recording::recording::channel_route::{Item, PayloadNotes, Route, RouteTarget};
use strapd_recording::recording::decoders::Decoders;
use strapd_recording::recording::held::HeldChannel;
use strapd_recording::recording::log_channel::{LogChannel, described, known, rank};
use strapd_recording::recording::log_topics::explained;
use strapd_recording::recording::payload_type::PayloadType;
use strapd_recording::recording::sources::publisher;
use strapd_recording::recording::topics::{self, PICKED_UNNAMED};

/// The first IMU of a stream.
pub(super) struct StreamTopic<'r> {
    run: &'r ReplayRequest,
    path: &'r Path,
    /// Notes on how the stream is read.
    notes: Vec<Diagnostic>,
    topic: Option<String>,
    publisher: String,
    noticed: Arc<PayloadNotes>,
    /// Channels of the topic so far.
    channels: usize,
    found: Option<(TopicInfo, Stream)>,
    /// Whether there is or was such a find.
    is_met: bool,
    /// Channels of the topic whose first messages tell how to read them.
    held: Vec<HeldChannel>,
    others: BTreeSet<String>,
    /// Topic of the magnetic field, where no flag names it.
    field_topic: Option<String>,
    refusals: Vec<Diagnostic>,
    /// Decoders with the run's options, and with none.
    decoders: Decoders,
    plain: Decoders,
}

impl<'r> StreamTopic<'r> {
    pub(super) fn of(run: &'r ReplayRequest, path: &'r Path, notes: Vec<Diagnostic>) -> Self {
        StreamTopic {
            run,
            path,
            notes,
            topic: None,
            publisher: String::new(),
            noticed: Arc::default(),
            channels: 0,
            found: None,
            is_met: false,
            held: Vec::new(),
            others: BTreeSet::new(),
            field_topic: None,
            refusals: Vec::new(),
            decoders: Decoders::of_run(&run.plan, &run.selection.decode),
            plain: Decoders::default(),
        }
    }

    /// Returns the way of the messages of a channel that is new.
    pub(super) fn message_route(&mut self, channel: &Arc<Channel>) -> Option<Route> {
        let known = known(channel, 0, None, &mut self.plain);
        self.route(&known)
    }

    /// Returns the way of what comes on a channel that is new.
    pub(super) fn route(&mut self, known: &LogChannel) -> Option<Route> {
        let channel = &known.channel;
        let copied = self.run.copy_input.then(|| channel.clone());
        let beside = self.beside(channel);
        if !self.is_wanted(known) {
            return Route::other(beside, copied);
        }
        // Samples of a text state what they are; of messages nothing is known before the first.
        let decoder = match &known.stated {
            Some(_) => known.decoder(&mut self.decoders),
            None => self.decoders.of(channel),
        };
        match decoder {
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
                    let held = HeldChannel::new(channel, decoder, taker, self.channels, copied);
                    let route = held.route();
                    self.held.push(held);
                    return Some(route);
                }
                self.meet(known.read_as(), channel, &decoder);
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

    /// Whether a channel is of the topic; what else could be one is remembered.
    fn is_wanted(&mut self, known: &LogChannel) -> bool {
        let (channel, rank) = (&known.channel, rank(&known.role));
        let is_text = channel.text.is_some();
        if self.topic.as_ref() == Some(&channel.topic) {
            let is_other = is_text || publisher(channel) != self.publisher;
            if is_other {
                let by = match is_text {
                    true => described(channel).to_string(),
                    false => format!("published by `{}`", publisher(channel)),
                };
                self.others.insert(format!("{} {by}", channel.topic));
            }
            return !is_other;
        }
        let named = self.run.selection.topic.as_deref();
        let is_wanted = match (&self.topic, named) {
            (Some(_), _) => false,
            (None, Some(name)) => name == channel.topic,
            // A twist that may be a body rate is taken only when nothing better is there, and what is still to come
            // nobody knows. Attitudes in lines come behind their samples, if these come at all.
            (None, None) => rank > PICKED_UNNAMED || (is_text && rank == PICKED_UNNAMED),
        };
        if !is_wanted && rank >= PICKED_UNNAMED && !known.is_derived {
            self.others.insert(channel.topic.clone());
        }
        is_wanted
    }

    /// Decoder for what is read of a channel beside the samples: of the topics named, or of the first with a field.
    fn beside(&mut self, channel: &Arc<Channel>) -> Option<Decoder> {
        let run = self.run;
        // Lines bring theirs with them.
        if channel.text.is_some() {
            return None;
        }
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
    fn meet(&mut self, described: PayloadType, channel: &Channel, decoder: &Decoder) {
        if std::mem::replace(&mut self.is_met, true) {
            return;
        }
        self.found = Some((
            TopicInfo {
                name: channel.topic.clone(),
                output_topic: output_topic(&channel.topic, &BTreeSet::new()),
                described,
                resolved: Meaning::new(&self.run.plan, &decoder.stated().declared),
                noticed: self.noticed.clone(),
                warnings: which_stamp(decoder)
                    .into_iter()
                    .map(Into::into)
                    .chain(self.notes.drain(..))
                    .collect(),
            },
            Stream::new(&channel.topic, ""),
        ));
    }

    /// Hands the topic over, once it is settled.
    pub(super) fn hand_over(&mut self, start: &mut StreamStart<'_>) {
        if let Some((found, stream)) = self.found.take() {
            start.meet(found, stream);
        }
    }

    /// Hands messages of channels whose first ones wait to these, and takes what comes of it.
    pub(super) fn feed(&mut self, items: &mut Vec<Item>) -> Result<()> {
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
                        .map_err(|why| Error::unsupported(self.path, &why))?;
                    if was_waiting && !held.is_waiting() {
                        let (channel, decoder) = held.known();
                        self.meet(described(&channel), &channel, &decoder);
                    }
                }
                (item, _) => items.push(item),
            }
        }
        Ok(())
    }

    /// The stream has ended: nothing waits any longer.
    pub(super) fn release(&mut self, items: &mut Vec<Item>) -> Result<()> {
        for mut held in std::mem::take(&mut self.held) {
            if held.is_waiting() {
                held.release(&self.decoders, items)
                    .map_err(|why| Error::unsupported(self.path, &why))?;
                let (channel, decoder) = held.known();
                self.meet(described(&channel), &channel, &decoder);
            }
        }
        Ok(())
    }

    /// Whether the topic's channels so far are one publisher's.
    pub(super) fn is_one_body(&self) -> Result<()> {
        if self.channels > 1 && self.noticed.are_several() {
            return Err(strapd_recording::Error::Topic {
                path: self.path.to_owned(),
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

    /// The channels of a survey, as far as they are known without a message.
    pub(super) fn channels_of(&mut self, survey: &Survey) -> Vec<LogChannel> {
        let met = survey.channels.iter();
        met.map(|c| known(&c.channel, c.messages, None, &mut self.plain))
            .collect()
    }

    /// Why nothing was picked of these channels.
    pub(super) fn nothing(self, channels: &[LogChannel], problems: &[String]) -> Error {
        if let Some(what) = self.refusals.into_iter().next() {
            return Error::unsupported(self.path, what);
        }
        let candidates: Vec<_> = channels.iter().map(LogChannel::candidate).collect();
        let error = match topics::choose(
            self.path,
            &candidates,
            self.run.selection.topic.as_deref(),
        ) {
            Err(e) => e,
            Ok(choice) => {
                let what = format!(
                    "no IMU topic; {} may carry a body rate, but is not taken unnamed from a stream, where a better one could still come",
                    choice.topics.join(", ")
                );
                let what = Diagnostic::new(what).help(format!("{TOPIC} NAME"));
                strapd_recording::Error::unsupported(self.path, what)
            }
        };
        explained(error, channels, problems).into()
    }

    pub(super) fn passed_over(&self) -> Option<Finding> {
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
