//! Route of the messages of one channel, on the workers. Pure.

use super::log_channel::nanos;
use super::sources::Publisher;
use super::turns::{Turns, digest};
use crate::decode::{Decoder, Undecodable};
use crate::mcap::{Channel, Message};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use strapd_attitude::record::{Nanos, RawSample};

/// Uses of a channel's messages.
#[derive(Debug, Default)]
pub struct Route {
    /// Reads the samples in them; `None` when there are none.
    pub decoder: Option<Decoder>,
    /// Streams of the run to which they belong; of several, the one of the frame that a message names.
    takers: Vec<RouteTarget>,
    /// The channel's number, where it is not known beforehand whether channels take turns.
    turn: Option<usize>,
    /// Reads the recorded orientations in them to compare with.
    pub reference: Option<Decoder>,
    /// Whether the covariances of these are read too.
    with_covariances: bool,
    /// Reads the specific forces, or magnetic fields, in them that belong to the samples of others.
    pub beside: Option<Decoder>,
    /// The channel, when its messages are copied to the output.
    pub copied: Option<Arc<Channel>>,
}

/// A stream, and what is noticed on its way there.
#[derive(Clone, Debug)]
pub struct RouteTarget {
    /// Index of the stream in the run.
    pub stream: usize,
    /// Notes for the summary.
    pub noticed: Arc<PayloadNotes>,
}

/// Observations in payloads; sums, so that the order of the workers does not show.
#[derive(Debug, Default)]
pub struct PayloadNotes {
    /// Samples whose gyro the message marks as absent.
    pub gyro_marked_absent: AtomicU64,
    /// Stamps with a second or more of nanoseconds.
    pub stamps_carried: AtomicU64,
    /// The frame of the stream: given, or what the first message names; empty when it names none. Which
    /// message was first is certain only where one thread reads.
    pub frame_id: OnceLock<String>,
    /// Messages of any frame are taken.
    pub any_frame: bool,
    /// Frames of other streams: theirs are not missed here.
    pub others: Vec<String>,
    /// Messages left out because they name another frame, by its name; of many, the first few.
    left_out: Mutex<BTreeMap<String, u64>>,
    /// Order in which the channels of a stream followed each other, where that shows only in the run.
    turns: Mutex<Turns>,
}

/// Foreign frames that are told apart.
const FOREIGN: usize = 16;

impl PayloadNotes {
    /// Makes it for the samples of a source.
    #[must_use]
    pub fn of(source: &Publisher) -> PayloadNotes {
        PayloadNotes {
            frame_id: source
                .frame
                .clone()
                .map_or_else(OnceLock::new, OnceLock::from),
            any_frame: source.frame.is_none(),
            others: source.others.clone(),
            ..PayloadNotes::default()
        }
    }

    /// Messages that name a frame of no stream that is known, by its name.
    #[must_use]
    pub fn left_out(&self) -> Vec<(String, u64)> {
        let left_out = self.left_out.lock().unwrap_or_else(PoisonError::into_inner);
        let mut found: Vec<(String, u64)> = left_out.clone().into_iter().collect();
        found.retain(|(frame, _)| !self.others.contains(frame));
        found
    }

    /// Whether two publishers' channels take turns on the topic.
    #[must_use]
    pub fn are_several(&self) -> bool {
        let turns = self.turns.lock().unwrap_or_else(PoisonError::into_inner);
        turns.are_several()
    }

    #[cold]
    fn leave_out(&self, frame: String) {
        let mut left_out = self.left_out.lock().unwrap_or_else(PoisonError::into_inner);
        if left_out.len() < FOREIGN || left_out.contains_key(&frame) {
            *left_out.entry(frame).or_default() += 1;
        } else if let Some((_, n)) = left_out.iter_mut().next_back() {
            *n += 1;
        }
    }
}

/// Item that a message became.
#[derive(Debug)]
pub enum Item {
    /// A sample of a stream.
    Sample(usize, RawSample),
    /// A payload of a stream that could not be decoded.
    Undecodable(usize, Box<(Nanos, Undecodable)>),
    /// A recorded orientation to compare with, and its covariance ([`Decoder::orientation_covariance`]) if it is read.
    Reference(RawSample, Option<Box<[f64; 9]>>),
    /// A specific force, or a magnetic field, of a message that is no sample.
    Beside(RawSample),
    /// A message to be copied.
    Copy(Box<Copied>),
}

/// A message, owned.
#[derive(Debug)]
pub struct Copied {
    /// Channel.
    pub channel: Arc<Channel>,
    /// Sequence number.
    pub sequence: u32,
    /// Time at which it was recorded, ns.
    pub log_time: u64,
    /// Time at which it was published, ns.
    pub publish_time: u64,
    /// Payload.
    pub data: Vec<u8>,
}

thread_local! {
    /// Samples of one message on their way into items: no allocation per message.
    static SCRATCH: RefCell<Vec<RawSample>> = const { RefCell::new(Vec::new()) };
}

impl Route {
    /// Messages that are samples of a stream, whatever frame they name.
    #[must_use]
    pub fn samples(decoder: Decoder, stream: usize) -> Route {
        let noticed = PayloadNotes {
            any_frame: true,
            ..PayloadNotes::default()
        };
        Route::to(
            decoder,
            vec![RouteTarget {
                stream,
                noticed: Arc::new(noticed),
            }],
        )
    }

    /// Messages that are samples of the stream whose frame they name, of these.
    #[must_use]
    pub fn to(decoder: Decoder, takers: Vec<RouteTarget>) -> Route {
        Route {
            decoder: Some(decoder),
            takers,
            ..Route::default()
        }
    }

    /// Messages that are recorded orientations.
    #[must_use]
    pub fn reference(decoder: Decoder) -> Route {
        Route::default().comparing(Some(decoder))
    }

    /// Messages that are only copied.
    #[must_use]
    pub fn only_copied(channel: Arc<Channel>) -> Route {
        Route::default().copying(Some(channel))
    }

    /// The same, what the messages hold also compared with where a decoder is given.
    #[must_use]
    pub fn comparing(self, reference: Option<Decoder>) -> Route {
        Route { reference, ..self }
    }

    /// The same, the covariances of what is compared with read too.
    #[must_use]
    pub fn with_covariances(self) -> Route {
        Route {
            with_covariances: true,
            ..self
        }
    }

    /// The same, what the messages hold also taken beside the samples where a decoder is given.
    #[must_use]
    pub fn beside(self, beside: Option<Decoder>) -> Route {
        Route { beside, ..self }
    }

    /// Messages that are neither samples nor compared with.
    #[must_use]
    pub fn other(beside: Option<Decoder>, copied: Option<Arc<Channel>>) -> Option<Route> {
        let is_any = beside.is_some() || copied.is_some();
        is_any.then(|| Route::default().beside(beside).copying(copied))
    }

    /// The same, the messages also copied where a channel is given.
    #[must_use]
    pub fn copying(self, channel: Option<Arc<Channel>>) -> Route {
        Route {
            copied: channel,
            ..self
        }
    }

    /// The same, watching whether the stream's channels take turns; `number` is this one's.
    #[must_use]
    pub fn taking_turns(self, number: usize) -> Route {
        Route {
            turn: Some(number),
            ..self
        }
    }

    /// Appends what `message` becomes.
    pub fn map(&self, message: &Message<'_>, out: &mut Vec<Item>) {
        // Before the samples of the same message: it may be for them.
        if let Some(decoder) = &self.beside {
            recorded(decoder, message, Item::Beside, out);
        }
        if let Some(decoder) = &self.decoder {
            self.decode(decoder, message, out);
        }
        if let Some(decoder) = &self.reference {
            let covariance = match self.with_covariances {
                true => decoder.orientation_covariance(message.data),
                false => None,
            };
            let item = |raw| Item::Reference(raw, covariance.map(Box::new));
            recorded(decoder, message, item, out);
        }
        if let Some(channel) = &self.copied {
            out.push(Item::Copy(Box::new(Copied {
                channel: channel.clone(),
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
                data: message.data.to_vec(),
            })));
        }
    }

    /// The same for samples that came as such.
    pub(super) fn pass(&self, samples: &[RawSample], out: &mut Vec<Item>) {
        if self.beside.is_some() {
            out.extend(samples.iter().map(|raw| Item::Beside(*raw)));
        }
        if let (Some(_), Some(taker)) = (&self.decoder, self.takers.first()) {
            out.extend(samples.iter().map(|raw| Item::Sample(taker.stream, *raw)));
        }
        if self.reference.is_some() {
            let own = samples.iter().filter(|raw| !raw.is_beside);
            out.extend(own.map(|raw| Item::Reference(*raw, None)));
        }
    }

    /// The same for a line that holds none; `number` is its number.
    pub(super) fn lose(&self, number: u64, why: Undecodable, out: &mut Vec<Item>) {
        if let (Some(_), Some(taker)) = (&self.decoder, self.takers.first()) {
            let number = nanos(number);
            out.push(Item::Undecodable(taker.stream, Box::new((number, why))));
        }
    }

    fn decode(&self, decoder: &Decoder, message: &Message<'_>, out: &mut Vec<Item>) {
        let log = nanos(message.log_time);
        let publish = nanos(message.publish_time);
        SCRATCH.with_borrow_mut(|samples| {
            samples.clear();
            let Some(RouteTarget { stream, noticed }) = self.taker(decoder, message.data) else {
                return;
            };
            if let Some(number) = self.turn {
                let mut turns = noticed.turns.lock().unwrap_or_else(PoisonError::into_inner);
                turns.take(number, digest(message.data));
            }
            let frame = noticed
                .frame_id
                .get_or_init(|| decoder.frame_id(message.data).unwrap_or_default());
            let decoded = if noticed.any_frame {
                decoder
                    .decode(message.data, log, publish, samples)
                    .map(Some)
            } else {
                decoder.decode_of(frame, message.data, log, publish, samples)
            };
            match decoded {
                Ok(Some(decoded)) => {
                    let add = |counter: &AtomicU64, n: usize| {
                        if n > 0 {
                            counter.fetch_add(n as u64, Ordering::Relaxed);
                        }
                    };
                    add(&noticed.gyro_marked_absent, decoded.gyro_marked_absent);
                    add(&noticed.stamps_carried, decoded.stamps_carried);
                    out.extend(samples.drain(..).map(|raw| Item::Sample(*stream, raw)));
                }
                Ok(None) => {
                    noticed.leave_out(decoder.frame_id(message.data).unwrap_or_default());
                }
                Err(why) => out.push(Item::Undecodable(*stream, Box::new((log, why)))),
            }
        });
    }

    fn taker(&self, decoder: &Decoder, payload: &[u8]) -> Option<&RouteTarget> {
        let first = self.takers.first();
        if self.takers.len() < 2 {
            return first;
        }
        let frame = decoder.frame_id(payload).unwrap_or_default();
        let of = |taker: &&RouteTarget| taker.noticed.frame_id.get() == Some(&frame);
        self.takers.iter().find(of).or(first)
    }
}

/// The orientations, or the vectors beside samples, in a message; one that cannot be read is one less.
fn recorded(
    decoder: &Decoder,
    message: &Message<'_>,
    item: impl Fn(RawSample) -> Item,
    out: &mut Vec<Item>,
) {
    let (log, publish) = (nanos(message.log_time), nanos(message.publish_time));
    SCRATCH.with_borrow_mut(|samples| {
        samples.clear();
        if decoder.decode(message.data, log, publish, samples).is_ok() {
            out.extend(samples.drain(..).map(item));
        }
    });
}
