//! Messages that another reader hands over -> samples. Pure.
//!
//! Apart from the decoders because who walks a log with a reader of their own, such as the crate `mcap`, has of a message
//! its channel and its payload, and no survey: what a channel's first message tells is learned here, at that message.

use super::{Channel, Decoded, Decoder, Effort, Options, Undecodable, Unsupported};
use std::collections::BTreeMap;
use std::fmt;
use strapd_attitude::record::{Nanos, RawSample};

/// Message as another reader has it.
#[derive(Clone, Copy, Debug)]
pub struct Handed<'a> {
    /// Id of its channel: two channels have two.
    pub channel_id: u16,
    /// Time at which it was recorded.
    pub log: Nanos,
    /// Time at which it was published.
    pub publish: Nanos,
    /// Payload.
    pub payload: &'a [u8],
}

/// Reason for which a message gives no sample.
#[derive(Clone, Debug)]
pub enum Refused {
    /// Channel without samples, or of a type that is not read: each of its messages is refused.
    Channel(Unsupported),
    /// The message itself cannot be read.
    Message(Undecodable),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refused::Channel(why) => why.fmt(f),
            Refused::Message(why) => why.fmt(f),
        }
    }
}

impl std::error::Error for Refused {}

/// Decoders of the channels of one log, each made at the first message of its channel.
///
/// A stamp that is a number without a unit is read by the recorder's clock at that message; a
/// [`Recording`](crate::Recording) looks at more of them.
#[derive(Debug, Default)]
pub struct HandedDecoders {
    options: Options,
    effort: Effort,
    known: BTreeMap<u16, Result<Decoder, Unsupported>>,
}

impl HandedDecoders {
    /// Makes decoders that read messages by `options`.
    #[must_use]
    pub fn new(options: Options) -> HandedDecoders {
        HandedDecoders {
            options,
            ..HandedDecoders::default()
        }
    }

    /// Reads one message and pushes its samples; pushes nothing when it fails.
    ///
    /// # Errors
    /// [`Refused`]: its channel, or the message itself.
    pub fn decode(
        &mut self,
        channel: &Channel<'_>,
        message: &Handed<'_>,
        out: &mut Vec<RawSample>,
    ) -> Result<Decoded, Refused> {
        let Handed {
            channel_id,
            log,
            publish,
            payload,
        } = *message;
        let (options, effort) = (&self.options, &mut self.effort);
        let known = self.known.entry(channel_id).or_insert_with(|| {
            let mut decoder = Decoder::compile_within(channel, options, effort)?;
            decoder.settle(payload, log)?;
            Ok(decoder)
        });
        let decoder = known
            .as_ref()
            .map_err(|why| Refused::Channel(why.clone()))?;
        let decoded = decoder.decode(payload, log, publish, out);
        decoded.map_err(Refused::Message)
    }
}
