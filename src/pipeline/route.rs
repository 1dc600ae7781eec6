//! What becomes of the messages of one channel, on the workers. Pure.

use super::log::nanos;
use crate::decode::{Decoder, Undecodable};
use crate::record::{Nanos, RawSample};
use crate::source::mcap::{Channel, Message};
use std::cell::RefCell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// What a channel's messages are used for.
#[derive(Debug)]
pub struct Route {
    /// Reads them; `None` when they are only copied.
    pub decoder: Option<Decoder>,
    /// Which of the run's streams they belong to.
    pub stream: usize,
    /// Whether they are a recorded orientation to compare with, not samples.
    pub is_reference: bool,
    /// The channel, when its messages are copied to the output.
    pub copied: Option<Arc<Channel>>,
    /// Notes for the summary.
    pub noticed: Arc<Noticed>,
}

/// What was noticed in payloads; sums, so that the order of the workers does not show.
#[derive(Debug, Default)]
pub struct Noticed {
    /// Samples whose gyro the message marks as absent.
    pub gyro_marked_absent: AtomicU64,
    /// Stamps with a second or more of nanoseconds.
    pub stamps_carried: AtomicU64,
    /// The frame the first message names; empty when it names none. Which message was first is
    /// certain only where one thread reads.
    pub frame_id: OnceLock<String>,
}

/// What a message became.
#[derive(Debug)]
pub enum Item {
    /// A sample of a stream.
    Sample(usize, RawSample),
    /// A payload of a stream that could not be decoded.
    Undecodable(usize, Box<(Nanos, Undecodable)>),
    /// A recorded orientation to compare with.
    Reference(RawSample),
    /// A message to be copied.
    Copy(Box<Copied>),
}

/// A message, owned.
#[derive(Debug)]
pub struct Copied {
    /// Its channel.
    pub channel: Arc<Channel>,
    /// Its sequence number.
    pub sequence: u32,
    /// When it was recorded, ns.
    pub log_time: u64,
    /// When it was published, ns.
    pub publish_time: u64,
    /// Its payload.
    pub data: Vec<u8>,
}

thread_local! {
    /// Samples of one message on their way into items: no allocation per message.
    static SCRATCH: RefCell<Vec<RawSample>> = const { RefCell::new(Vec::new()) };
}

impl Route {
    /// Messages that are samples of a stream.
    #[must_use]
    pub fn samples(decoder: Decoder, stream: usize) -> Route {
        Route {
            decoder: Some(decoder),
            stream,
            is_reference: false,
            copied: None,
            noticed: Arc::default(),
        }
    }

    /// Messages that are recorded orientations.
    #[must_use]
    pub fn reference(decoder: Decoder) -> Route {
        Route {
            is_reference: true,
            ..Route::samples(decoder, 0)
        }
    }

    /// Messages that are only copied.
    #[must_use]
    pub fn only_copied(channel: Arc<Channel>) -> Route {
        Route {
            decoder: None,
            stream: 0,
            is_reference: false,
            copied: Some(channel),
            noticed: Arc::default(),
        }
    }

    /// The same, the messages also copied where a channel is given.
    #[must_use]
    pub fn copying(self, channel: Option<Arc<Channel>>) -> Route {
        Route {
            copied: channel,
            ..self
        }
    }

    /// The same, what is noticed going to `noticed`.
    #[must_use]
    pub fn noticing(self, noticed: &Arc<Noticed>) -> Route {
        Route {
            noticed: noticed.clone(),
            ..self
        }
    }

    /// Appends what `message` becomes.
    pub fn map(&self, message: &Message<'_>, out: &mut Vec<Item>) {
        if let Some(decoder) = &self.decoder {
            self.decode(decoder, message, out);
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

    fn decode(&self, decoder: &Decoder, message: &Message<'_>, out: &mut Vec<Item>) {
        let log = nanos(message.log_time);
        self.noticed
            .frame_id
            .get_or_init(|| decoder.frame_id(message.data).unwrap_or_default());
        SCRATCH.with_borrow_mut(|samples| {
            samples.clear();
            match decoder.decode(message.data, log, nanos(message.publish_time), samples) {
                Ok(_) if self.is_reference => {
                    out.extend(samples.drain(..).map(Item::Reference));
                }
                Ok(decoded) => {
                    let add = |counter: &AtomicU64, n: usize| {
                        if n > 0 {
                            counter.fetch_add(n as u64, Ordering::Relaxed);
                        }
                    };
                    add(&self.noticed.gyro_marked_absent, decoded.gyro_marked_absent);
                    add(&self.noticed.stamps_carried, decoded.stamps_carried);
                    out.extend(samples.drain(..).map(|raw| Item::Sample(self.stream, raw)));
                }
                // A reference that can not be read is one row less to compare with.
                Err(_) if self.is_reference => {}
                Err(why) => {
                    out.push(Item::Undecodable(self.stream, Box::new((log, why))));
                }
            }
        });
    }
}
