//! A channel of a stream whose stamps are bare numbers: its first messages wait until they tell the unit,
//! as those of a file do. Pure.
//!
//! Apart from the stream because nothing else in it is looked at before it is read.

use super::channel_route::{Copied, Item, Route, RouteTarget};
use super::decoders::Decoders;
use super::log_channel::nanos;
use super::sources::{OPENINGS, OPENINGS_LIMIT, keep};
use crate::decode::{Decoder, Unsupported};
use crate::mcap::{Channel, Message};
use std::sync::Arc;

/// Channel whose messages are held.
#[derive(Debug)]
pub struct HeldChannel {
    channel: Arc<Channel>,
    /// Decoder by which it will be read.
    decoder: Decoder,
    taker: RouteTarget,
    /// Number among those of the topic.
    number: usize,
    copied: Option<Arc<Channel>>,
    waiting: Vec<Copied>,
    bytes: usize,
    /// Once the unit is known.
    route: Option<Route>,
}

impl HeldChannel {
    /// Makes it before its first message; `number` is its own among the channels of the topic.
    #[must_use]
    pub fn new(
        channel: &Arc<Channel>,
        decoder: Decoder,
        taker: RouteTarget,
        number: usize,
        copied: Option<Arc<Channel>>,
    ) -> HeldChannel {
        HeldChannel {
            channel: channel.clone(),
            decoder,
            taker,
            number,
            copied,
            waiting: Vec::new(),
            bytes: 0,
            route: None,
        }
    }

    /// Route by which its messages come as copies, whoever they are for.
    #[must_use]
    pub fn route(&self) -> Route {
        Route::only_copied(self.channel.clone())
    }

    /// Whether a message is of this channel.
    #[must_use]
    pub fn is_of(&self, copied: &Copied) -> bool {
        Arc::ptr_eq(&self.channel, &copied.channel)
    }

    /// Takes the next message; what is known by now goes out.
    ///
    /// # Errors
    /// [`Decoder::settle`]'s; [`Unsupported`] when the first stamps fit no unit.
    pub fn take(
        &mut self,
        copied: Copied,
        decoders: &Decoders,
        out: &mut Vec<Item>,
    ) -> Result<(), Unsupported> {
        if let Some(route) = &self.route {
            route.map(&message(&copied), out);
            return Ok(());
        }
        if self.waiting.is_empty() {
            self.decoder.settle(&copied.data, nanos(copied.log_time))?;
        }
        self.bytes += copied.data.len();
        self.waiting.push(copied);
        let is_enough = self.waiting.len() >= OPENINGS || self.bytes >= OPENINGS_LIMIT;
        if is_enough || !self.decoder.has_bare_stamps() {
            self.release(decoders, out)?;
        }
        Ok(())
    }

    /// Releases what waits, since there are no more to wait for.
    ///
    /// # Errors
    /// [`Unsupported`] when the first stamps fit no unit.
    pub fn release(&mut self, decoders: &Decoders, out: &mut Vec<Item>) -> Result<(), Unsupported> {
        let mut openings = Vec::new();
        for copied in &self.waiting {
            keep(&mut openings, (nanos(copied.log_time), copied.data.clone()));
        }
        decoders.settle_unit(&mut self.decoder, &openings)?;
        let route = Route::to(self.decoder.clone(), vec![self.taker.clone()])
            .taking_turns(self.number)
            .copying(self.copied.clone());
        for copied in self.waiting.drain(..) {
            route.map(&message(&copied), out);
        }
        self.route = Some(route);
        Ok(())
    }

    /// The channel, and how it is read.
    #[must_use]
    pub fn known(&self) -> (Arc<Channel>, Decoder) {
        (self.channel.clone(), self.decoder.clone())
    }

    /// Whether messages wait, or the unit of those that come.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.route.is_none()
    }
}

fn message(copied: &Copied) -> Message<'_> {
    Message {
        channel: &copied.channel,
        sequence: copied.sequence,
        log_time: copied.log_time,
        publish_time: copied.publish_time,
        data: &copied.data,
        offset: 0,
        inner: 0,
    }
}
