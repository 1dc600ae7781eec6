//! A damaged MCAP -> an intact one of everything that is intact in it. I/O.
//!
//! A stage of its own because nothing is decoded: the guarded walk says what is whole, the sink's copy
//! writes it, both in the order of the file. What the walk cannot prove is left out and said.
//!
//! A chunk whose CRC is wrong is left out whole: one changed bit reads as 6e302 rad/s, and nothing
//! tells which message it is in. A chunk without a CRC, and unchunked messages, are kept as they are
//! found, and counted as unverified.

use super::position::Position;
use crate::error::{Error, Result};
use crate::sink::{
    Attachment, CopiedChannel, Flow, InputChannel, InputMessage, Options, Sink, Target, Written,
};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::Arc;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_recording::Source;
use strapd_recording::mcap::{
    self, Channel, HeaderRecord, Message, MetadataRecord, Order, Reader, Record, Survey,
    WalkOptions,
};
use strapd_recording::pool::Pool;

/// Request: what is to be recovered, and where to.
#[derive(Clone, Debug)]
pub struct Recover {
    /// The damaged log.
    pub source: Source,
    /// The MCAP to be written.
    pub target: Target,
    /// Whether it may replace a file, and how its chunks are packed.
    pub options: Options,
}

/// Result of a recovery.
#[derive(Clone, Debug)]
pub struct Recovered {
    /// The output.
    pub written: Written,
    /// Survey of the input, with what was wrong with it.
    pub survey: Survey,
    /// Attachments copied.
    pub attachments: u64,
    /// Metadata records copied.
    pub metadata: u64,
}

impl Recovered {
    /// Whether anything was wrong with the input.
    #[must_use]
    pub fn was_damaged(&self) -> bool {
        !self.survey.problems.is_empty()
    }
}

/// Messages of one block are handed on in parcels of about this many bytes: one allocation for
/// hundreds of messages, not one for each.
const PARCEL_BYTES: usize = 256 << 10;

/// Messages that follow one another.
#[derive(Debug, Default)]
struct Parcel {
    heads: Vec<Head>,
    data: Vec<u8>,
    /// Offset in the input of the last of them.
    offset: u64,
}

#[derive(Debug)]
struct Head {
    channel: CopiedChannel,
    sequence: u32,
    log_time: u64,
    publish_time: u64,
    bytes: usize,
}

impl Parcel {
    fn add(channel: CopiedChannel, message: &Message<'_>, parcels: &mut Vec<Parcel>) {
        if parcels.last().is_none_or(|p| p.data.len() >= PARCEL_BYTES) {
            parcels.push(Parcel::default());
        }
        if let Some(parcel) = parcels.last_mut() {
            parcel.heads.push(Head {
                channel,
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
                bytes: message.data.len(),
            });
            parcel.data.extend_from_slice(message.data);
            parcel.offset = message.offset;
        }
    }
}

/// The output under way.
struct Copying<'r> {
    pool: &'r Pool,
    sink: Sink,
    /// The head, which has the input's profile, is written.
    begun: bool,
    /// Error that ended it early.
    ended: Option<Error>,
    attachments: u64,
    metadata: u64,
    first_time: Option<u64>,
    position: Position,
}

impl Copying<'_> {
    /// The output, with its head; `profile` counts the first time only.
    fn open(&mut self, profile: &str) -> Result<&mut Sink> {
        if !std::mem::replace(&mut self.begun, true) {
            still_wanted(self.sink.copy_header(profile)?)?;
        }
        Ok(&mut self.sink)
    }

    /// Runs `step`, unless an earlier one failed; remembers how it ended.
    fn step<T>(&mut self, step: impl FnOnce(&mut Self) -> Result<T>) -> Option<T> {
        if self.ended.is_some() {
            return None;
        }
        step(self).map_err(|e| self.ended = Some(e)).ok()
    }

    fn declare(&mut self, channel: &Channel) -> Result<CopiedChannel> {
        let pool = self.pool.rayon();
        let sink = self.open("")?;
        // Behind what precedes it in the input: then a copy of the copy is the same again.
        still_wanted(sink.flush(pool)?)?;
        let schema = channel.schema.as_deref();
        sink.copy_channel(&InputChannel {
            topic: &channel.topic,
            message_encoding: &channel.message_encoding,
            schema: schema.map(|s| (s.name.as_str(), s.encoding.as_str(), s.data.as_slice())),
            metadata: &channel.metadata,
        })
    }

    fn attach(&mut self, record: &Record<'_>) -> Result<()> {
        let pool = self.pool.rayon();
        match record {
            Record::Header(HeaderRecord { profile, .. }) => {
                self.open(profile)?;
            }
            Record::Attachment(found) => {
                let attachment = Attachment {
                    log_time: found.log_time,
                    create_time: found.create_time,
                    name: found.name,
                    media_type: found.media_type,
                    data: found.data.0,
                };
                let sink = self.open("")?;
                still_wanted(sink.copy_attachment(&attachment, pool)?)?;
                self.attachments += 1;
            }
            Record::Metadata(MetadataRecord { name, metadata }) => {
                let map = metadata
                    .iter()
                    .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()))
                    .collect();
                let sink = self.open("")?;
                still_wanted(sink.copy_metadata(name, &map, pool)?)?;
                self.metadata += 1;
            }
            _ => {}
        }
        Ok(())
    }

    fn copy(&mut self, parcel: &Parcel) -> Result<()> {
        let pool = self.pool.rayon();
        let sink = self.open("")?;
        let mut rest = parcel.data.as_slice();
        for head in &parcel.heads {
            let (data, later) = rest.split_at_checked(head.bytes).unwrap_or((rest, &[]));
            rest = later;
            let message = InputMessage {
                sequence: head.sequence,
                log_time: head.log_time,
                publish_time: head.publish_time,
                data,
            };
            still_wanted(sink.copy(head.channel, &message, pool)?)?;
        }
        let last = parcel.heads.last().map_or(0, |head| head.log_time);
        let first = *self.first_time.get_or_insert(last);
        self.position.data_secs = last.saturating_sub(first) as f64 * 1e-9;
        self.position.samples += parcel.heads.len() as u64;
        self.position.written = self.position.samples;
        Ok(())
    }
}

/// Whoever reads a pipe has enough: the run ends quietly.
fn still_wanted(flow: Flow) -> Result<()> {
    match flow {
        Flow::Continue => Ok(()),
        Flow::Closed => Err(Error::BrokenPipe),
    }
}

/// Does it. `watch` is told where it is, often.
///
/// The output depends on the input and the options alone, not on the number of threads; memory is
/// bounded by the blocks on their way and the largest chunk.
///
/// # Errors
/// Input or output cannot be opened, read or written; then there is no output. Damage is no error:
/// see [`Recovered::survey`].
pub fn run(run: &Recover, pool: &Pool, watch: &mut dyn FnMut(&Position)) -> Result<Recovered> {
    let reader = open(&run.source)?;
    let size = reader.size();
    let inputs = run.source.files();
    let copying = RefCell::new(Copying {
        pool,
        sink: Sink::create_copy(&run.target, &inputs, run.options)?,
        begun: false,
        ended: None,
        attachments: 0,
        metadata: 0,
        first_time: None,
        position: Position::default(),
    });
    let report = mcap::salvage(
        reader,
        &WalkOptions {
            pool: Some(pool.rayon()),
            order: Order::File,
            batch: 1,
            ..WalkOptions::default()
        },
        |channel: &Arc<Channel>| copying.borrow_mut().step(|c| c.declare(channel)),
        |channel: &CopiedChannel, message, parcels| Parcel::add(*channel, message, parcels),
        |parcels: &mut Vec<Parcel>| {
            let mut copying = copying.borrow_mut();
            for parcel in parcels.drain(..) {
                let fraction = size.map(|size| parcel.offset as f64 / size.max(1) as f64);
                copying.position.fraction = fraction;
                if copying.step(|c| c.copy(&parcel)).is_none() {
                    return ControlFlow::Break(());
                }
                watch(&copying.position);
            }
            ControlFlow::Continue(())
        },
        |record| {
            copying.borrow_mut().step(|c| c.attach(&record));
        },
    )?;
    let mut copying = copying.into_inner();
    if let Some(error) = copying.ended.take() {
        return Err(error);
    }
    copying.open("")?;
    Ok(Recovered {
        written: copying.sink.finish()?,
        survey: report.survey,
        attachments: copying.attachments,
        metadata: copying.metadata,
    })
}

/// Opens the one file that is recovered, or standard input.
fn open(source: &Source) -> Result<Reader> {
    let refuse = |what: &str, help: &str| Err(Error::usage(Diagnostic::new(what).help(help)));
    match source {
        Source::File(path) => Ok(Reader::open(path)?),
        Source::Stdin => {
            let stdin = Box::new(std::io::stdin());
            Ok(Reader::from_stream(source.name(), stdin)?)
        }
        Source::Parts(_) => refuse(
            "what is recovered is one file",
            "recover each, and join them then",
        ),
        Source::Elsewhere(_) => refuse("what is recovered is a file", "save it to one first"),
    }
}
