//! AttitudeSample (and, from a synthetic gyro, RawSample) -> the world: MCAP, NDJSON, CSV, or nothing. I/O.
//!
//! A stage of its own because it is the only one that may block on a disk or a pipe, and the only
//! one that knows what output looks like. Samples collect per stream; full batches of
//! 2048 are formatted and compressed in parallel and written in the order in which they
//! filled. The bytes depend on the samples and the order of the calls alone: not on the number of
//! threads and not (within a stream) on how the samples were cut into calls.
//!
//! Long because it is one queue: what is formatted, what is written and what has failed decide on each other. What a format
//! looks like is in the files below.

pub mod address;
mod axes;
mod batch;
mod claim;
mod copy;
mod csv;
pub mod datagram;
mod decimate;
mod document;
mod form;
mod format;
mod gcsv;
pub mod json;
mod mcap;
mod output;
#[cfg(feature = "parquet")]
mod parquet;
mod plot;
mod poses;
mod socket;
mod stream;
mod target;
#[cfg(test)]
mod tests;
mod text;
mod tum;
pub mod upload;

pub use axes::roll_pitch_yaw;
pub use claim::{claim_or_warn, unclaimed};
pub use copy::CopiedChannel;
pub use csv::{RAW_HEADER, push_raw_row};
pub use datagram::{Datagrams, Recipient};
pub use decimate::Decimator;
pub use document::Document;
pub use form::Precision;
pub use format::Format;
pub use json::Profile;
pub use mcap::chunk::Compression;
pub use mcap::live::{LiveMcap, LiveStream};
pub use mcap::payload;
pub use mcap::{Attachment, Encoding, InputChannel, InputMessage};
pub use output::Flow;
pub use output::{is_named, no_folder, sync_directory};
pub use socket::UNAUTHORISED;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::setting::TOPIC;
pub use stream::{ChildFrames, Content, FrameNames, Provenance, Stream, output_topic};

pub use target::Target;

use crate::error::{Error, Result};
use batch::Batch;
use form::{Form, Opening, Slot};
use mcap::chunk::Chunk;
use output::{Output, STDOUT_NAME};
use rayon::ThreadPool;
use rayon::iter::{IntoParallelRefMutIterator, ParallelIterator};
use std::path::PathBuf;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};

/// Samples in one batch: one chunk of about 1 MiB in MCAP.
const BATCH_SAMPLES: usize = 2048;

/// Batches in flight: enough to keep every thread busy, few enough to bound memory (about 3 MB each).
const MAX_BATCHES: usize = 16;

/// Transforms beside the attitudes of a stream, in an MCAP and for viewers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Transforms {
    /// Transforms from the world to the sensor: the world is the parent.
    #[default]
    Forward,
    /// Transforms from the sensor to the world, where the sensor's frame has a parent already.
    Reverse,
    /// Absence of transforms.
    None,
}

/// Options by which the output is made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// Replace an existing file (but never the input).
    pub force: bool,
    /// Messages of an MCAP.
    pub encoding: Encoding,
    /// Chunks of an MCAP.
    pub compression: Compression,
    /// Numbers of a table in Parquet.
    pub precision: Precision,
}

/// Account of what a finished sink has written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Written {
    /// The file, if it is one.
    pub path: Option<PathBuf>,
    /// Bytes of it.
    pub bytes: u64,
    /// Attitude samples in it.
    pub samples: u64,
    /// Messages (MCAP), lines or rows.
    pub messages: u64,
    /// Stamps that do not fit into the 32-bit seconds of a ROS message (before 1901, after 2038) and
    /// were written as the nearest one that does.
    pub stamps_out_of_range: u64,
    /// Whether the reader hung up before the end.
    pub closed: bool,
    /// Whether it was a socket that broke before the end: what was logged about it.
    pub broken: bool,
}

/// An open output. Dropped without [`Sink::finish`], it leaves no file.
#[derive(Debug)]
pub struct Sink {
    state: State,
    /// Form of its bytes; `None`: samples are counted and discarded.
    form: Option<Box<dyn Form>>,
    lanes: Vec<Lane>,
    /// Copied messages waiting for their chunk to fill.
    copies: Chunk,
    /// Full batches, and how many of them are in use.
    slots: Vec<Slot>,
    used: usize,
    /// Uncompressed bytes of copied messages among them.
    queued_copies: usize,
    path: Option<PathBuf>,
    is_socket: bool,
    samples: u64,
    messages: u64,
    bytes: u64,
    stamps_out_of_range: u64,
}

#[derive(Debug)]
enum State {
    Open(Box<Output>),
    /// The reader hung up.
    Closed,
    /// An error has been returned; the file is gone.
    Failed,
}

/// Pending output of a stream.
#[derive(Debug, Default)]
struct Lane {
    batch: Batch,
    last: Option<Nanos>,
    /// The form has no place for it.
    left_out: bool,
}

impl Sink {
    /// Opens `target` and writes what comes before the first sample.
    ///
    /// # Errors
    /// [`Error::OutputExists`], [`Error::OutputIsInput`], [`Error::Write`] (no such directory, disk
    /// full, ...), [`Error::Usage`] for several streams in one CSV.
    pub fn create(
        target: &Target,
        inputs: &[PathBuf],
        options: Options,
        streams: &[Stream],
        provenance: &Provenance,
    ) -> Result<Sink> {
        let format = target.format();
        let is_several = streams
            .iter()
            .filter(|s| s.content != Content::Truth)
            .nth(1);
        if format.is_some_and(|format| !format.takes_several()) && is_several.is_some() {
            return Err(Error::usage(
                Diagnostic::new(format!(
                    "a table of one attitude has no column for the topic, and {} topics are estimated",
                    streams.len()
                ))
                .help(format!(
                    "choose one with {TOPIC}, or write .ndjson or .mcap"
                )),
            ));
        }
        let output = Output::open(target, inputs, options.force)?;
        let streams: Vec<Stream> = streams.iter().map(Stream::bounded).collect();
        let opening = Opening {
            options,
            profile: match target {
                Target::Udp { profile, .. } => *profile,
                Target::Protocol(_) => Profile::Records,
                _ => Profile::Lines,
            },
            streams: &streams,
            provenance,
        };
        let mut head = Vec::new();
        let form = format.and_then(|format| format.open(&opening, &mut head));
        let form = form.transpose()?;
        let is_left_out = |stream: &Stream| {
            let is_sample = matches!(stream.content, Content::Samples(_));
            let mut form = form.iter();
            is_sample && format.is_some_and(|format| !format.takes_samples())
                || form.any(|form| form.leaves_out(stream))
        };
        let left_out: Vec<bool> = streams.iter().map(is_left_out).collect();
        Sink::begin(output, form, &head, &left_out)
    }

    /// The sink once its head is made; writes it. `left_out`: by stream, whether nothing of it is
    /// written.
    fn begin(
        output: Output,
        form: Option<Box<dyn Form>>,
        head: &[u8],
        left_out: &[bool],
    ) -> Result<Sink> {
        let lanes = left_out
            .iter()
            .enumerate()
            .map(|(stream, left_out)| Lane {
                batch: Batch {
                    stream,
                    ..Batch::default()
                },
                last: None,
                left_out: *left_out,
            })
            .collect();
        let mut sink = Sink {
            path: output.path().map(PathBuf::from),
            is_socket: output.is_socket(),
            state: State::Open(Box::new(output)),
            form,
            lanes,
            copies: Chunk::default(),
            slots: Vec::new(),
            used: 0,
            queued_copies: 0,
            samples: 0,
            messages: 0,
            bytes: 0,
            stamps_out_of_range: 0,
        };
        // A reader that has already hung up shows at the first sample.
        let _ = sink.put(head)?;
        Ok(sink)
    }

    /// Takes samples of one stream, oldest first. They are written when a batch is full, at
    /// [`Sink::flush`] and at [`Sink::finish`].
    ///
    /// # Errors
    /// [`Error::Write`]; the unfinished file is gone then, and every later call fails too.
    /// [`Error::Usage`] when `stream` is none of those the sink was created with.
    pub fn write(
        &mut self,
        stream: usize,
        samples: &[AttitudeSample],
        pool: &ThreadPool,
    ) -> Result<Flow> {
        self.take(stream, samples, |batch| &mut batch.samples, pool)
    }

    /// Takes samples of a [`Content::Samples`] stream, oldest first, as [`Sink::write`] takes
    /// attitudes.
    ///
    /// # Errors
    /// As [`Sink::write`].
    pub fn write_raw(
        &mut self,
        stream: usize,
        samples: &[RawSample],
        pool: &ThreadPool,
    ) -> Result<Flow> {
        self.take(stream, samples, |batch| &mut batch.raw, pool)
    }

    fn take<T: Copy>(
        &mut self,
        stream: usize,
        samples: &[T],
        collected: fn(&mut Batch) -> &mut Vec<T>,
        pool: &ThreadPool,
    ) -> Result<Flow> {
        if self.form.is_none() {
            self.samples += samples.len() as u64;
            return Ok(Flow::Continue);
        }
        if !self.is_open()? {
            return Ok(Flow::Closed);
        }
        let mut rest = samples;
        while !rest.is_empty() {
            let Some(lane) = self.lanes.get_mut(stream) else {
                return Err(Error::usage(format!("the output has no stream {stream}")));
            };
            if lane.left_out {
                break;
            }
            let room = BATCH_SAMPLES.saturating_sub(lane.batch.len());
            let (now, later) = rest.split_at(room.min(rest.len()));
            collected(&mut lane.batch).extend_from_slice(now);
            rest = later;
            if lane.batch.len() >= BATCH_SAMPLES {
                self.queue_lane(stream);
                if self.make_room(pool)? == Flow::Closed {
                    return Ok(Flow::Closed);
                }
            }
        }
        Ok(Flow::Continue)
    }

    /// Writes everything pending, for a live reader. In an MCAP this ends the chunk, so there (only)
    /// the bytes depend on when it is called.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn flush(&mut self, pool: &ThreadPool) -> Result<Flow> {
        if !self.is_open()? {
            return Ok(Flow::Closed);
        }
        if self.queue_everything(Some(pool))? == Flow::Closed {
            return Ok(Flow::Closed);
        }
        let flow = match &mut self.state {
            State::Open(output) => output.flush(),
            State::Closed | State::Failed => Ok(Flow::Closed),
        };
        self.note(flow)
    }

    /// Writes the rest and the closing part, syncs, and gives the file its name.
    ///
    /// # Errors
    /// [`Error::Write`]; [`Error::OutputExists`] when somebody else created the file meanwhile.
    pub fn finish(mut self) -> Result<Written> {
        if self.is_open()? && self.queue_everything(None)? == Flow::Continue {
            match self.form.as_mut().map(|form| form.closing()) {
                Some(Ok(closing)) if !closing.is_empty() => {
                    let _ = self.put(&closing)?;
                }
                Some(Err(source)) => return Err(self.failed(source)),
                _ => {}
            }
            if let State::Open(output) = std::mem::replace(&mut self.state, State::Closed)
                && output.finish()? == Flow::Continue
            {
                return Ok(self.written(false));
            }
        }
        Ok(self.written(true))
    }

    fn written(&self, closed: bool) -> Written {
        Written {
            path: self.path.clone(),
            bytes: self.bytes,
            samples: self.samples,
            messages: match self.form.as_ref().and_then(|form| form.messages()) {
                Some(messages) => messages,
                None => self.messages,
            },
            stamps_out_of_range: self.stamps_out_of_range,
            closed,
            broken: closed && self.is_socket,
        }
    }

    /// The output's name in messages.
    fn named(&self) -> PathBuf {
        self.path.clone().unwrap_or_else(|| STDOUT_NAME.into())
    }

    /// `false` when the reader hung up; an error when one has been returned before.
    fn is_open(&self) -> Result<bool> {
        match self.state {
            State::Open(_) => Ok(true),
            State::Closed => Ok(false),
            State::Failed => Err(Error::Write {
                path: self.named(),
                source: std::io::Error::other("an earlier write failed"),
            }),
        }
    }

    /// Remembers how a write ended: nothing is written after a hang-up or an error.
    fn note(&mut self, flow: Result<Flow>) -> Result<Flow> {
        match flow {
            Ok(Flow::Continue) => {}
            Ok(Flow::Closed) => self.state = State::Closed,
            Err(_) => self.state = State::Failed,
        }
        flow
    }

    fn put(&mut self, bytes: &[u8]) -> Result<Flow> {
        let flow = match &mut self.state {
            State::Open(output) => output.write(bytes),
            State::Closed | State::Failed => Ok(Flow::Closed),
        };
        if matches!(flow, Ok(Flow::Continue)) {
            self.bytes += bytes.len() as u64;
            if let Some(form) = &mut self.form {
                form.account(bytes);
            }
        }
        self.note(flow)
    }

    /// A free slot at the end of the queue.
    fn next_slot(&mut self) -> &mut Slot {
        if self.used == self.slots.len() {
            self.slots.push(Slot::default());
        }
        self.used += 1;
        &mut self.slots[self.used - 1]
    }

    /// Moves a stream's pending samples into the queue.
    fn queue_lane(&mut self, stream: usize) {
        let mut lane = std::mem::take(&mut self.lanes[stream]);
        let count = lane.batch.len() as u64;
        let next = Batch {
            stream,
            first: lane.batch.first + count,
            ..Batch::default()
        };
        lane.batch.previous = lane.last;
        let last = lane.batch.samples.last().map(|s| s.stamp).or(lane.last);
        self.samples += count;

        let slot = self.next_slot();
        // The slot's old vectors are emptied and go back to the lane: no allocation per batch.
        let mut samples = std::mem::take(&mut slot.batch.samples);
        let mut raw = std::mem::take(&mut slot.batch.raw);
        samples.clear();
        raw.clear();
        slot.batch = lane.batch;
        self.lanes[stream] = Lane {
            batch: Batch {
                samples,
                raw,
                ..next
            },
            last,
            left_out: lane.left_out,
        };
    }

    fn queue_everything(&mut self, pool: Option<&ThreadPool>) -> Result<Flow> {
        for stream in 0..self.lanes.len() {
            if !self.lanes[stream].batch.is_empty() {
                self.queue_lane(stream);
                if self.used >= MAX_BATCHES && self.drain(pool)? == Flow::Closed {
                    return Ok(Flow::Closed);
                }
            }
        }
        if !self.copies.is_empty() {
            self.queue_copies();
        }
        self.drain(pool)
    }

    /// Drains the queue when it is long enough for this pool.
    fn make_room(&mut self, pool: &ThreadPool) -> Result<Flow> {
        let limit = (2 * pool.current_num_threads()).clamp(2, MAX_BATCHES);
        if self.used >= limit || self.queued_copies >= copy::MAX_QUEUED_COPIES {
            self.drain(Some(pool))
        } else {
            Ok(Flow::Continue)
        }
    }

    /// Turns every queued batch into bytes, in parallel, and writes them in order.
    fn drain(&mut self, pool: Option<&ThreadPool>) -> Result<Flow> {
        let used = std::mem::take(&mut self.used);
        self.queued_copies = 0;
        let mut slots = std::mem::take(&mut self.slots);
        let form = self.form.as_deref();
        let encode = |slot: &mut Slot| {
            slot.text.clear();
            if let Some(form) = form {
                form.encode(slot);
            }
        };
        match pool {
            Some(pool) if used > 1 => {
                pool.install(|| slots[..used].par_iter_mut().for_each(encode));
            }
            _ => slots[..used].iter_mut().for_each(encode),
        }
        let mut flow = Ok(Flow::Continue);
        for slot in &mut slots[..used] {
            flow = self.emit(slot);
            if !matches!(flow, Ok(Flow::Continue)) {
                break;
            }
        }
        self.slots = slots;
        flow
    }

    fn emit(&mut self, slot: &mut Slot) -> Result<Flow> {
        if let Some(source) = slot.outcome.take() {
            return Err(self.failed(source));
        }
        self.messages += slot.batch.len() as u64;
        self.stamps_out_of_range += slot.chunk.stamps_out_of_range;
        let Some(form) = &mut self.form else {
            return Ok(Flow::Continue);
        };
        let parts = match form.in_order(slot) {
            Ok(parts) => parts,
            Err(source) => return Err(self.failed(source)),
        };
        for part in parts.into_iter().filter(|part| !part.is_empty()) {
            if self.put(part)? == Flow::Closed {
                return Ok(Flow::Closed);
            }
        }
        slot.chunk.clear();
        Ok(Flow::Continue)
    }

    /// Error of bytes that could not be made: nothing is written behind it.
    fn failed(&mut self, source: std::io::Error) -> Error {
        self.state = State::Failed;
        Error::Write {
            path: self.named(),
            source,
        }
    }
}
