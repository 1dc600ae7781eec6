//! A log's channels and first messages -> what is in it and how to read it. I/O.
//!
//! Apart from the replay because `info`, `cat` and `compare` ask the same questions first: which
//! channels, which of them carry a rate or an orientation, and a decoder that has seen a message.

use super::pool::Pool;
use super::topics::Candidate;
use crate::decode::{self, Decoder, Rank, Role, Unsupported, role};
use crate::error::Result;
use crate::record::Nanos;
use crate::source::mcap::{self, Channel, Reader, Survey, WalkOptions};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A finished file, surveyed.
#[derive(Debug)]
pub struct Log {
    reader: Reader,
    /// What is in it.
    pub survey: Survey,
    /// Its channels, with what they can serve as.
    pub channels: Vec<Known>,
}

/// A channel and its first message.
#[derive(Clone, Debug)]
pub struct Known {
    /// The channel.
    pub channel: Arc<Channel>,
    /// Messages on it.
    pub messages: u64,
    /// Log time and payload of its first message, where there is one.
    pub first: Option<(Nanos, Vec<u8>)>,
    /// What it can serve as.
    pub role: Role,
}

impl Log {
    /// Opens and surveys a file.
    ///
    /// # Errors
    /// It can not be opened or read, or is no MCAP.
    pub fn open(path: &Path, pool: &Pool) -> Result<Log> {
        let reader = Reader::open(path)?;
        let options = WalkOptions { pool: Some(pool.rayon()), ..WalkOptions::default() };
        let survey = mcap::survey(&reader, &options)?;
        let firsts = match reader.again() {
            Some(again) => first_messages(again, &survey)?,
            None => Vec::new(),
        };
        let channels = survey
            .channels
            .iter()
            .map(|found| {
                let first = firsts
                    .iter()
                    .find(|f| f.id == found.channel.id && f.topic == found.channel.topic)
                    .map(|f| (f.log, f.data.clone()));
                known(&found.channel, found.messages, first)
            })
            .collect();
        Ok(Log { reader, survey, channels })
    }

    /// The file once more, from its beginning.
    #[must_use]
    pub fn reader(&self) -> Option<Reader> {
        self.reader.again()
    }

    /// For the choice of topics.
    #[must_use]
    pub fn candidates(&self) -> Vec<Candidate> {
        self.channels.iter().map(Known::candidate).collect()
    }
}

impl Known {
    /// For the choice of topics.
    #[must_use]
    pub fn candidate(&self) -> Candidate {
        Candidate {
            topic: self.channel.topic.clone(),
            described: described(&self.channel),
            messages: Some(self.messages),
            rank: rank(&self.role),
        }
    }

    /// A decoder for it that has seen its first message.
    ///
    /// # Errors
    /// The channel can not be decoded: which, why, and the flag that helps.
    pub fn decoder(&self, options: &decode::Options) -> std::result::Result<Decoder, Unsupported> {
        let mut decoder = Decoder::compile(&plain(&self.channel), options)?;
        if let Some((log, payload)) = &self.first {
            decoder.settle(payload, *log)?;
        }
        Ok(decoder)
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

/// `sensor_msgs/msg/Imu [cdr]`, fit for a terminal.
#[must_use]
pub fn described(channel: &Channel) -> String {
    let name = channel.schema.as_deref().map_or("(no type)", |s| s.name.as_str());
    decode::printable(&format!("{name} [{}]", channel.message_encoding))
}

/// A role as a number: higher is more likely "the IMU" (see [`Candidate::rank`]).
#[must_use]
pub fn rank(role: &Role) -> u8 {
    if !role.has_rate {
        return 0;
    }
    match role.rank {
        Rank::Imu => 5,
        Rank::Processed => 4,
        Rank::RateByTopic => 3,
        Rank::Weak => 2,
        Rank::ByNameOnly => 1,
    }
}

/// A channel with what it can serve as.
#[must_use]
pub fn known(channel: &Arc<Channel>, messages: u64, first: Option<(Nanos, Vec<u8>)>) -> Known {
    let role = role(&plain(channel), first.as_ref().map(|(log, data)| (data.as_slice(), *log)));
    Known { channel: channel.clone(), messages, first, role }
}

/// A log time as a stamp; beyond 2262 it saturates.
#[must_use]
pub fn nanos(time: u64) -> Nanos {
    Nanos(i64::try_from(time).unwrap_or(i64::MAX))
}

/// Largest first message that is kept, and all of them together: an IMU's is small, and a log may
/// have thousands of channels of images.
const FIRST_LIMIT: usize = 64 << 10;
const FIRSTS_LIMIT: usize = 16 << 20;

struct First {
    id: u16,
    topic: String,
    log: Nanos,
    data: Vec<u8>,
}

/// The first message of every channel, in file order, reading no further than needed.
fn first_messages(reader: Reader, survey: &Survey) -> Result<Vec<First>> {
    let wanted = survey.channels.iter().filter(|c| c.messages > 0).count();
    let mut firsts: Vec<First> = Vec::new();
    let (mut met, mut bytes) = (0, 0);
    // On the calling thread: "first" must not depend on who was faster.
    mcap::walk(
        reader,
        &WalkOptions::default(),
        |_| Some(AtomicBool::new(false)),
        |seen, message, out: &mut Vec<First>| {
            if !seen.swap(true, Ordering::Relaxed) {
                out.push(First {
                    id: message.channel.id,
                    topic: message.channel.topic.clone(),
                    log: nanos(message.log_time),
                    data: message.data.get(..FIRST_LIMIT.min(message.data.len())).map_or_else(
                        Vec::new,
                        <[u8]>::to_vec,
                    ),
                });
            }
        },
        |items| {
            for first in items.drain(..) {
                met += 1;
                bytes += first.data.len();
                if first.data.len() < FIRST_LIMIT && bytes < FIRSTS_LIMIT {
                    firsts.push(first);
                }
            }
            if met >= wanted {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        },
    )?;
    Ok(firsts)
}
