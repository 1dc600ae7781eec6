//! A log's channels -> their decoders, each schema compiled once. Pure.
//!
//! Apart from the log because how its messages are understood is asked again for each run, and a log may
//! have tens of thousands of channels of one schema, or as many schemas.

use crate::decode::{self, Decoder, Effort, Options, Unsupported};
use crate::mcap::{Channel, Schema};
use std::collections::BTreeMap;
use std::sync::Arc;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_attitude::setting::SAMPLE_KIND;

/// Decoders under the same options. The schemas of a log together are compiled within one fixed effort, however many.
#[derive(Debug, Default)]
pub struct Decoders {
    options: Options,
    stamps: Stamps,
    effort: Effort,
    /// Decoders by place in memory of the schema, which is kept, message encoding, and which stamp was asked for.
    compiled: BTreeMap<(usize, String, Option<usize>), Compiled>,
}

/// Meaning of the stamps in messages for their reader.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Stamps {
    /// The samples' time, and no flag says anything about them.
    #[default]
    Read,
    /// The same; `--field` may state their unit.
    Stated,
    /// Nothing: the time is another.
    Unread,
}

#[derive(Debug)]
struct Compiled {
    _schema: Arc<Schema>,
    decoder: Result<Decoder, Unsupported>,
}

impl Decoders {
    /// Makes an empty set.
    #[must_use]
    pub fn new(options: &Options) -> Decoders {
        Decoders {
            options: options.clone(),
            stamps: Stamps::Stated,
            ..Decoders::default()
        }
    }

    /// Makes an empty set for a run of `plan`.
    #[must_use]
    pub fn of_run(plan: &EstimationSettings, options: &Options) -> Decoders {
        Decoders {
            stamps: match plan.clock {
                Clock::Header => Stamps::Stated,
                Clock::Log | Clock::Publish | Clock::Index { .. } => Stamps::Unread,
            },
            ..Decoders::new(options)
        }
    }

    /// Settles what only the first messages of a channel tell. Nobody needs the unit of stamps that are not read.
    ///
    /// # Errors
    /// [`Unsupported`] when the first stamps fit no unit.
    pub fn settle_unit(
        &self,
        decoder: &mut Decoder,
        first: &[(Nanos, Vec<u8>)],
    ) -> Result<(), Unsupported> {
        match (decoder.settle_unit(first), self.stamps) {
            (Err(why), Stamps::Read) => Err(Unsupported {
                help: "a name that states it (stamp_ns, stamp_us, stamp_ms, stamp_s) is read as it says"
                    .to_owned(),
                ..why
            }),
            (Err(_), Stamps::Unread) => Ok(()),
            (settled, _) => settled,
        }
    }

    /// The decoder of a channel, which has seen no message.
    ///
    /// # Errors
    /// As [`Decoder::compile`].
    pub fn of(&mut self, channel: &Channel) -> Result<Decoder, Unsupported> {
        self.compiled(channel, None)
    }

    /// The same that takes the stamp of this number, of several ([`Options::nth_stamp`]).
    ///
    /// # Errors
    /// As [`Decoder::compile`].
    pub fn with_stamp(&mut self, channel: &Channel, nth: usize) -> Result<Decoder, Unsupported> {
        self.compiled(channel, Some(nth))
    }

    fn compiled(&mut self, channel: &Channel, nth: Option<usize>) -> Result<Decoder, Unsupported> {
        let options = Options {
            nth_stamp: nth.unwrap_or(self.options.nth_stamp),
            ..self.options.clone()
        };
        let plain = plain(channel);
        // As `strapd simulate` writes it: no field of a message says what a sample is.
        let kind = channel.metadata.get(SAMPLE_KIND.name());
        let kind = kind.and_then(|name| SampleKind::named(name));
        let Some(schema) = &channel.schema else {
            let made = Decoder::compile_within(&plain, &options, &mut self.effort)?;
            return Ok(made.of_topic(&channel.topic).stating(kind));
        };
        let encoding = channel.message_encoding.clone();
        let key = (Arc::as_ptr(schema) as usize, encoding, nth);
        let effort = &mut self.effort;
        let known = self.compiled.entry(key).or_insert_with(|| Compiled {
            _schema: Arc::clone(schema),
            decoder: Decoder::compile_within(&plain, &options, effort),
        });
        match &known.decoder {
            Ok(decoder) => Ok(decoder.of_topic(&channel.topic).stating(kind)),
            Err(why) => Err(Unsupported {
                topic: crate::text::printable(&channel.topic),
                ..why.clone()
            }),
        }
    }
}

/// The channel as the decoders see it.
#[must_use]
pub fn plain(channel: &Channel) -> decode::Channel<'_> {
    let schema = channel.schema.as_deref();
    decode::Channel {
        topic: &channel.topic,
        message_encoding: &channel.message_encoding,
        schema_name: schema.map_or("", |s| &s.name),
        schema_encoding: schema.map_or("", |s| &s.encoding),
        schema_data: schema.map_or(&[], |s| &s.data),
    }
}
