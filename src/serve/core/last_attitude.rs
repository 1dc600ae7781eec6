//! The last attitude of a stream, for who comes after it. Pure.
//!
//! Kept as it is until there is room for it, and encoded then: a thousand of them take no room among
//! the attitudes that wait.

use super::channel::{Channel, Clock, Items};
use crate::serve::protocol::chunk::Chunk;
use crate::sink::Profile;
use std::sync::Arc;
use strapd_attitude::record::{AttitudeSample, Status};
use strapd_recording::decode::packed::Form;

/// Form in which somebody wants it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Line, or packed object.
    Object(Form),
    /// Message of one channel.
    Message {
        /// The channel.
        channel: u32,
        /// The subscription to it.
        subscription: u32,
        /// Clock of its time.
        clock: Clock,
    },
}

/// The last attitude of a stream.
#[derive(Clone, Debug)]
pub struct Last {
    channel: Arc<Channel>,
    seq: u64,
    sample: AttitudeSample,
    wanted: Wanted,
}

impl Last {
    /// Number `seq` of a stream; it says of itself that it is the last.
    #[must_use]
    pub fn new(channel: Arc<Channel>, seq: u64, sample: AttitudeSample, wanted: Wanted) -> Last {
        Last {
            channel,
            seq,
            sample: AttitudeSample {
                status: sample.status.with(Status::LAST),
                ..sample
            },
            wanted,
        }
    }

    /// Id of the stream.
    #[must_use]
    pub fn id(&self) -> &Arc<str> {
        self.channel.id()
    }

    /// Whether it is wanted on this channel.
    #[must_use]
    pub fn is_for(&self, asked: u32) -> bool {
        matches!(self.wanted, Wanted::Message { channel, .. } if channel == asked)
    }

    /// Encoded. `None`: the channel it is wanted on has no such message.
    #[must_use]
    pub fn chunk(&self) -> Option<Chunk> {
        match self.wanted {
            Wanted::Object(form) => {
                let only = [(self.seq, self.sample)];
                Some(self.channel.thinned(form, Profile::Lines, &only))
            }
            Wanted::Message {
                channel,
                subscription,
                clock,
            } => {
                let of = |asked: u32| (asked == channel).then_some(subscription);
                let only = Items::Attitudes(std::slice::from_ref(&self.sample));
                let messages = self.channel.frames(of, self.seq, only, clock, None);
                messages.into_iter().next()
            }
        }
    }
}
