//! Samples and attitudes as they come -> an MCAP that is whole up to its last chunk at any time. Pure.
//!
//! A stage of its own because a recording has other needs than a finished run's output: streams appear
//! while it runs, one chunk holds all of them, and what was not written, because the disk would not
//! take it, must not be in the index. So bytes are made first ([`LiveMcap::seal`]) and booked only
//! when they are on their way ([`LiveMcap::booked`]).

use super::cdr::{self, ros_time};
use super::chunk::{Chunk, Compression};
use super::file::McapFile;
use super::messages::{Acceleration, acceleration_topic};
use super::{
    ACCEL_SCHEMA, Encoding, IMU_SCHEMA, Provenance, Stream, TF_SCHEMA, TF_TOPIC, push_head,
};
use super::{log_time, too_many_channels};
use crate::error::{Error, Result};
use crate::sink::stream::{ChildFrames, named_frame, parent_frame};
use std::collections::BTreeMap;
use std::path::Path;
use strapd_attitude::record::{AttitudeSample, Nanos, RawSample};
use strapd_attitude::setting::SAMPLE_KIND;

/// A stream of the recording.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LiveStream(usize);

/// An MCAP being recorded.
#[derive(Debug)]
pub struct LiveMcap {
    file: McapFile,
    compression: Compression,
    metadata: BTreeMap<String, String>,
    /// Channel of the transforms, once a stream has some.
    transform: Option<u16>,
    frames: ChildFrames,
    layouts: Vec<Layout>,
    chunk: Chunk,
    /// The head, and declarations that have to stand before the next chunk.
    declared: Vec<u8>,
    /// Bytes that [`LiveMcap::seal`] made.
    sealed: Vec<u8>,
    has_chunk: bool,
}

#[derive(Debug)]
struct Layout {
    input: u16,
    input_imu: cdr::Imu,
    attitude: u16,
    imu: cdr::Imu,
    acceleration: Option<(u16, Acceleration)>,
    tf: Option<(u16, cdr::Tf)>,
    last: Option<Nanos>,
}

impl LiveMcap {
    /// Makes one with a head that states `provenance`, and no stream yet.
    ///
    /// # Errors
    /// None that can happen: the first channel always has a number.
    pub fn new(compression: Compression, provenance: &Provenance) -> Result<LiveMcap> {
        let mut file = McapFile::default();
        let mut declared = Vec::new();
        let metadata = push_head(&mut file, &mut declared, Encoding::Cdr, provenance);
        Ok(LiveMcap {
            file,
            compression,
            metadata,
            transform: None,
            frames: ChildFrames::default(),
            layouts: Vec::new(),
            chunk: Chunk::default(),
            declared,
            sealed: Vec::new(),
            has_chunk: false,
        })
    }

    /// A channel, whose metadata says `more`.
    fn declare(&mut self, topic: &str, schema: [&str; 3], more: &[(&str, &str)]) -> Result<u16> {
        let [name, form, text] = schema;
        let out = &mut self.declared;
        self.file
            .schema(out, name, form, text.as_bytes())
            .and_then(|id| {
                let mut metadata = self.metadata.clone();
                metadata.extend(more.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())));
                self.file
                    .channel(out, id, topic, Encoding::Cdr.name(), &metadata)
            })
            .ok_or_else(too_many_channels)
    }

    /// A further stream: its samples go to its input topic, its attitudes to its output topic and `/tf`.
    ///
    /// # Errors
    /// [`Error::Usage`] when there are more than MCAP can number.
    pub fn stream(&mut self, stream: &Stream) -> Result<LiveStream> {
        let stream = stream.bounded();
        if stream.has_transforms() && self.transform.is_none() {
            self.transform = Some(self.declare(TF_TOPIC, TF_SCHEMA, &[])?);
        }
        let kind = stream
            .input_kind
            .map(|kind| (SAMPLE_KIND.name(), kind.name()));
        let input = self.declare(&stream.input_topic, IMU_SCHEMA, kind.as_slice())?;
        let axes = [
            ("rotates", stream.rotates.as_str()),
            ("world", &stream.world_axes),
            ("body", &stream.body_axes),
        ];
        let attitude = self.declare(&stream.output_topic, IMU_SCHEMA, &axes)?;
        let acceleration = match stream.has_linear_acceleration {
            true => Some(self.declare(&acceleration_topic(&stream), ACCEL_SCHEMA, &[])?),
            false => None,
        };
        let parent = parent_frame(&stream);
        let frame_id = stream.frame_id.clone();
        let child = self.frames.take(&stream);
        self.layouts.push(Layout {
            input,
            input_imu: cdr::Imu::new(input, &frame_id),
            attitude,
            imu: cdr::Imu::new(attitude, named_frame(&stream, &child)),
            acceleration: acceleration
                .map(|id| (id, Acceleration::new(id, named_frame(&stream, &child)))),
            tf: self
                .transform
                .filter(|_| stream.has_transforms())
                .map(|id| (id, cdr::Tf::new(id, stream.transforms, &parent, &child))),
            last: None,
        });
        Ok(LiveStream(self.layouts.len() - 1))
    }

    /// Takes a sample as it was received, number `n` of its stream. `false` when its stamp does not fit
    /// into a ROS time and the nearest one was written.
    pub fn input(&mut self, stream: LiveStream, n: u64, sample: &RawSample) -> bool {
        let Some(layout) = self.layouts.get(stream.0) else {
            return true;
        };
        let times = [sample.log, sample.publish].map(|t| t.0.max(0) as u64);
        // A stamp of zero is how a ROS message says that it has none.
        let (stamp, fits) = ros_time(sample.header.unwrap_or_default());
        let lane = self.chunk.lane(layout.input);
        self.chunk.note(lane, times[0]);
        layout
            .input_imu
            .append_input(&mut self.chunk.plain, n as u32, times, stamp, sample);
        fits
    }

    /// Takes an attitude, number `n` of its stream. The answer is that of [`LiveMcap::input`].
    pub fn attitude(&mut self, stream: LiveStream, n: u64, sample: &AttitudeSample) -> bool {
        let Some(layout) = self.layouts.get_mut(stream.0) else {
            return true;
        };
        let log_time = log_time(sample.log);
        let (stamp, fits) = ros_time(sample.stamp);
        let n = n as u32;
        let lane = self.chunk.lane(layout.attitude);
        self.chunk.note(lane, log_time);
        let plain = &mut self.chunk.plain;
        layout.imu.append(plain, n, log_time, stamp, sample);
        // A repeat of a stamp is what tf2 warns about.
        if layout.last.replace(sample.stamp) != Some(sample.stamp)
            && let Some((id, tf)) = &layout.tf
        {
            let lane = self.chunk.lane(*id);
            self.chunk.note(lane, log_time);
            tf.append(&mut self.chunk.plain, n, log_time, stamp, sample);
        }
        let acceleration = layout.acceleration.as_ref().zip(sample.linear_acceleration);
        if let Some(((id, message), of)) = acceleration {
            let lane = self.chunk.lane(*id);
            self.chunk.note(lane, log_time);
            message.append(&mut self.chunk.plain, n, log_time, stamp, &of);
        }
        fits
    }

    /// Uncompressed bytes waiting for [`LiveMcap::seal`].
    #[must_use]
    pub fn pending(&self) -> usize {
        self.declared.len() + self.chunk.plain_len()
    }

    /// The bytes of what is pending, to be written behind what is booked; made again by every call.
    ///
    /// # Errors
    /// [`Error::Write`]: memory ran out in the compressor.
    pub fn seal(&mut self, path: &Path) -> Result<&[u8]> {
        self.sealed.clear();
        self.sealed.extend_from_slice(&self.declared);
        self.has_chunk = !self.chunk.is_empty();
        if self.has_chunk {
            self.chunk
                .seal(self.compression)
                .map_err(|source| Error::Write {
                    path: path.to_owned(),
                    source,
                })?;
            for part in self.chunk.parts() {
                self.sealed.extend_from_slice(part);
            }
        }
        Ok(&self.sealed)
    }

    /// The sealed bytes are in the file.
    pub fn booked(&mut self) {
        let (declared, chunk) = self
            .sealed
            .split_at_checked(self.declared.len())
            .unwrap_or((&self.sealed, &[]));
        self.file.account(declared);
        if self.has_chunk {
            self.file.book(&self.chunk, self.compression);
            self.file.account(chunk);
        }
        self.drop_pending();
    }

    /// The sealed bytes will never be in the file.
    pub fn drop_pending(&mut self) {
        self.declared.clear();
        self.chunk.clear();
        self.sealed.clear();
        self.has_chunk = false;
    }

    /// Endings of the file: first the whole closing, then, for a disk that has no room for it, the
    /// shortest there is, without summary or index.
    #[must_use]
    pub fn closings(&self) -> [Vec<u8>; 2] {
        [self.file.closing(), McapFile::shortest_closing()]
    }
}
