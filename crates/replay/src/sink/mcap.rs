//! Samples -> MCAP: which channels a stream becomes, and its samples as chunks. Pure.
//!
//! A stage of its own because this is where a sample takes the form other programs read. Chunks are
//! cut at fixed sample counts and filled independently of each other, so any number of threads, and
//! any cutting of the input, gives the same bytes.

pub(super) mod cdr;
pub(super) mod chunk;
pub(super) mod file;
pub(super) mod live;
pub mod payload;
mod schemas;

use super::batch::Batch;
use super::form::{Form, Opening, Slot};
use super::json::{AttObject, FrameTransform};
use super::stream::{ChildFrames, Content, Provenance, Stream, named_frame, parent_frame};
use crate::error::{Error, Result};
use chunk::{Chunk, Compression};
pub use file::Attachment;
use file::McapFile;
use std::collections::BTreeMap;
use std::io;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::Nanos;
use strapd_attitude::setting::{COPY_INPUT, ENCODING};

/// Encoding of messages.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Encoding {
    /// ROS 2: `sensor_msgs/msg/Imu` and `tf2_msgs/msg/TFMessage` in CDR, profile `ros2`.
    #[default]
    Cdr,
    /// JSON for readers without ROS: the `ATT` object (schema `strapd.Attitude`) and
    /// `foxglove.FrameTransform`, both JSON with a jsonschema, no profile.
    Json,
}

impl Encoding {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Encoding::Cdr => "cdr",
            Encoding::Json => "json",
        }
    }
}

impl std::str::FromStr for Encoding {
    type Err = Error;
    fn from_str(text: &str) -> Result<Encoding> {
        [Encoding::Cdr, Encoding::Json]
            .into_iter()
            .find(|e| e.name() == text)
            .ok_or_else(|| {
                Error::usage(
                    Diagnostic::new(format!("unknown encoding `{text}`")).help("cdr or json"),
                )
            })
    }
}

/// The topic of the transforms.
const TF_TOPIC: &str = "/tf";

/// A channel of another file, for `--copy-input`.
#[derive(Clone, Copy, Debug)]
pub struct InputChannel<'a> {
    /// Topic.
    pub topic: &'a str,
    /// Encoding of its messages.
    pub message_encoding: &'a str,
    /// Name, encoding and bytes of its schema, if it has one.
    pub schema: Option<(&'a str, &'a str, &'a [u8])>,
    /// Metadata.
    pub metadata: &'a BTreeMap<String, String>,
}

/// A message of another file, for `--copy-input`.
#[derive(Clone, Copy, Debug)]
pub struct InputMessage<'a> {
    /// Sequence number.
    pub sequence: u32,
    /// Time at which it was recorded, ns.
    pub log_time: u64,
    /// Time at which it was published, ns.
    pub publish_time: u64,
    /// Payload.
    pub data: &'a [u8],
}

/// An MCAP, of our streams or a copy of another.
#[derive(Debug, Default)]
pub(super) struct Mcap {
    pub(super) file: McapFile,
    pub(super) layout: Layout,
    pub(super) compression: Compression,
}

/// Begins an MCAP.
pub(super) fn begin(opening: &Opening<'_>, head: &mut Vec<u8>) -> Result<Box<dyn Form>> {
    let Opening {
        options,
        streams,
        provenance,
        ..
    } = opening;
    let mut file = McapFile::default();
    Ok(Box::new(Mcap {
        layout: Layout::begin(&mut file, head, options.encoding, streams, provenance)?,
        compression: options.compression,
        file,
    }))
}

impl Form for Mcap {
    fn encode(&self, slot: &mut Slot) {
        // Without samples the chunk holds copied messages.
        if !slot.batch.is_empty() {
            self.layout.fill(&mut slot.chunk, &slot.batch);
        }
        slot.outcome = slot.chunk.seal(self.compression).err();
    }

    fn in_order<'s>(&mut self, slot: &'s mut Slot) -> io::Result<[&'s [u8]; 3]> {
        self.file.book(&slot.chunk, self.compression);
        Ok(slot.chunk.parts())
    }

    fn closing(&mut self) -> io::Result<Vec<u8>> {
        Ok(self.file.closing())
    }

    fn account(&mut self, bytes: &[u8]) {
        self.file.account(bytes);
    }

    fn messages(&self) -> Option<u64> {
        Some(self.file.messages())
    }

    fn mcap(&mut self) -> Option<&mut McapFile> {
        Some(&mut self.file)
    }
}

/// Layout of each stream's messages.
#[derive(Debug, Default)]
pub(super) struct Layout {
    streams: Vec<Messages>,
}

#[derive(Debug)]
enum Messages {
    Cdr {
        attitude: u16,
        imu: cdr::Imu,
        transform: u16,
        tf: cdr::Tf,
    },
    Json {
        attitude: u16,
        att: AttObject,
        transform: u16,
        frame_transform: FrameTransform,
    },
    Samples {
        channel: u16,
        imu: cdr::Imu,
        /// The field and its nine covariances.
        field: Option<(u16, cdr::Stamped<12>)>,
    },
    Truth {
        attitude: u16,
        quaternion: cdr::Stamped<4>,
        rate: u16,
        vector: cdr::Stamped<3>,
    },
}

impl Layout {
    /// Declares every stream's channels; the head of the file goes to `out`.
    fn begin(
        file: &mut McapFile,
        out: &mut Vec<u8>,
        encoding: Encoding,
        streams: &[Stream],
        provenance: &Provenance,
    ) -> Result<Layout> {
        let metadata = push_head(file, out, encoding, provenance);
        let mut declare = |topic: &str, schema: [&str; 3]| {
            let [name, form, text] = schema;
            file.schema(out, name, form, text.as_bytes())
                .and_then(|id| file.channel(out, id, topic, encoding.name(), &metadata))
                .ok_or_else(too_many_channels)
        };
        let (attitude_schema, transform_schema) = match encoding {
            Encoding::Cdr => (IMU_SCHEMA, TF_SCHEMA),
            Encoding::Json => (
                ["strapd.Attitude", "jsonschema", schemas::ATTITUDE],
                [
                    "foxglove.FrameTransform",
                    "jsonschema",
                    schemas::FRAME_TRANSFORM,
                ],
            ),
        };
        let attitudes = streams
            .iter()
            .map(|stream| match stream.content {
                Content::Attitude => declare(&stream.output_topic, attitude_schema),
                _ if encoding == Encoding::Json => Err(only_attitudes_are_json()),
                Content::Samples(_) => declare(
                    &stream.output_topic,
                    ["sensor_msgs/msg/Imu", "ros2msg", schemas::IMU],
                ),
                Content::Truth => declare(
                    &stream.output_topic,
                    [
                        "geometry_msgs/msg/QuaternionStamped",
                        "ros2msg",
                        schemas::QUATERNION_STAMPED,
                    ],
                ),
            })
            .collect::<Result<Vec<u16>>>()?;
        let rates = streams
            .iter()
            .map(|stream| match stream.content {
                Content::Truth => declare(
                    &format!("{}/rate", stream.output_topic),
                    [
                        "geometry_msgs/msg/Vector3Stamped",
                        "ros2msg",
                        schemas::VECTOR3_STAMPED,
                    ],
                ),
                Content::Attitude | Content::Samples(_) => Ok(0),
            })
            .collect::<Result<Vec<u16>>>()?;
        let fields = streams
            .iter()
            .map(|stream| match (&stream.content, &stream.field_topic) {
                (Content::Samples(_), Some(topic)) => declare(topic, FIELD_SCHEMA).map(Some),
                _ => Ok(None),
            })
            .collect::<Result<Vec<Option<u16>>>>()?;
        let transform = if streams.iter().any(|s| s.content == Content::Attitude) {
            declare(TF_TOPIC, transform_schema)?
        } else {
            0
        };

        let mut frames = ChildFrames::default();
        let children: Vec<String> = streams.iter().map(|stream| frames.take(stream)).collect();
        let streams = streams
            .iter()
            .zip(attitudes)
            .zip(rates)
            .zip(fields)
            .zip(&children)
            .map(|((((stream, attitude), rate), field), child)| {
                let parent = parent_frame(stream);
                match stream.content {
                    Content::Samples(_) => {
                        return Messages::Samples {
                            channel: attitude,
                            imu: cdr::Imu::new(attitude, &stream.frame_id),
                            field: field.map(|id| (id, cdr::Stamped::new(id, &stream.frame_id))),
                        };
                    }
                    Content::Truth => {
                        return Messages::Truth {
                            attitude,
                            quaternion: cdr::Stamped::new(attitude, &parent),
                            rate,
                            vector: cdr::Stamped::new(rate, &stream.frame_id),
                        };
                    }
                    Content::Attitude => {}
                }
                match encoding {
                    Encoding::Cdr => Messages::Cdr {
                        attitude,
                        imu: cdr::Imu::new(attitude, named_frame(stream, child)),
                        transform,
                        tf: cdr::Tf::new(transform, &parent, child),
                    },
                    Encoding::Json => Messages::Json {
                        attitude,
                        att: AttObject::new(stream),
                        transform,
                        frame_transform: FrameTransform::new(&parent, child),
                    },
                }
            })
            .collect();
        Ok(Layout { streams })
    }

    /// Fills an empty chunk. A transform with the stamp of the one before is left out: tf2 warns
    /// about each.
    fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        let Some(messages) = self.streams.get(batch.stream) else {
            return;
        };
        let mut previous = batch.previous;
        match messages {
            Messages::Cdr {
                attitude,
                imu,
                transform,
                tf,
            } => {
                let (attitude, transform) = (chunk.lane(*attitude), chunk.lane(*transform));
                chunk
                    .plain
                    .reserve(batch.samples.len() * (imu.len() + tf.len()));
                for (n, sample) in (batch.first..).zip(&batch.samples) {
                    let log_time = log_time(sample.log);
                    let (stamp, fits) = cdr::ros_time(sample.stamp);
                    chunk.stamps_out_of_range += u64::from(!fits);
                    chunk.note(attitude, log_time);
                    imu.append(&mut chunk.plain, n as u32, log_time, stamp, sample);
                    if previous.replace(sample.stamp) != Some(sample.stamp) {
                        chunk.note(transform, log_time);
                        tf.append(&mut chunk.plain, n as u32, log_time, stamp, sample);
                    }
                }
            }
            Messages::Json {
                attitude,
                att,
                transform,
                frame_transform,
            } => {
                let mut text = Vec::new();
                for (n, sample) in (batch.first..).zip(&batch.samples) {
                    let log_time = log_time(sample.log);
                    text.clear();
                    att.push(&mut text, n, sample);
                    chunk.push(*attitude, n as u32, log_time, log_time, &text);
                    if previous.replace(sample.stamp) != Some(sample.stamp) {
                        text.clear();
                        frame_transform.push(&mut text, sample);
                        chunk.push(*transform, n as u32, log_time, log_time, &text);
                    }
                }
            }
            Messages::Samples {
                channel,
                imu,
                field,
            } => {
                let lane = chunk.lane(*channel);
                let field = field.as_ref().map(|(id, field)| (chunk.lane(*id), field));
                chunk.plain.reserve(batch.raw.len() * imu.len());
                for (n, sample) in (batch.first..).zip(&batch.raw) {
                    let log_time = log_time(sample.log);
                    let (stamp, fits) = cdr::ros_time(sample.header.unwrap_or(sample.log));
                    chunk.stamps_out_of_range += u64::from(!fits);
                    chunk.note(lane, log_time);
                    imu.append_raw(&mut chunk.plain, n as u32, log_time, stamp, sample);
                    if let (Some((lane, field)), Some([x, y, z])) = (&field, sample.mag) {
                        // A covariance of zeros is an unknown one.
                        let numbers = [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                        chunk.note(*lane, log_time);
                        field.append(&mut chunk.plain, n as u32, log_time, stamp, numbers);
                    }
                }
            }
            Messages::Truth {
                attitude,
                quaternion,
                rate,
                vector,
            } => {
                let (attitude, rate) = (chunk.lane(*attitude), chunk.lane(*rate));
                chunk
                    .plain
                    .reserve(batch.samples.len() * (quaternion.len() + vector.len()));
                for (n, sample) in (batch.first..).zip(&batch.samples) {
                    let log_time = log_time(sample.log);
                    let (stamp, fits) = cdr::ros_time(sample.stamp);
                    chunk.stamps_out_of_range += u64::from(!fits);
                    let [w, x, y, z] = sample.q_nb.wxyz();
                    chunk.note(attitude, log_time);
                    quaternion.append(&mut chunk.plain, n as u32, log_time, stamp, [x, y, z, w]);
                    chunk.note(rate, log_time);
                    let w_nb_b = sample.rate.into();
                    vector.append(&mut chunk.plain, n as u32, log_time, stamp, w_nb_b);
                }
            }
        }
    }
}

/// Name, encoding and text of our ROS 2 types.
const IMU_SCHEMA: [&str; 3] = ["sensor_msgs/msg/Imu", "ros2msg", schemas::IMU];
const FIELD_SCHEMA: [&str; 3] = [
    "sensor_msgs/msg/MagneticField",
    "ros2msg",
    schemas::MAGNETIC_FIELD,
];
const TF_SCHEMA: [&str; 3] = ["tf2_msgs/msg/TFMessage", "ros2msg", schemas::TF_MESSAGE];

/// Writes the header and what is known about the run; returns the metadata of our channels.
fn push_head(
    file: &mut McapFile,
    out: &mut Vec<u8>,
    encoding: Encoding,
    provenance: &Provenance,
) -> BTreeMap<String, String> {
    let profile = match encoding {
        Encoding::Cdr => "ros2",
        Encoding::Json => "",
    };
    file.push_header(out, profile);
    file.push_metadata(out, "strapd", &provenance.metadata);
    match encoding {
        Encoding::Cdr => {
            let (key, value) = schemas::ROSBAG2_FORM;
            let form = BTreeMap::from([(key.to_owned(), value.to_owned())]);
            file.push_metadata(out, "rosbag2", &form);
            let key = "offered_qos_profiles".to_owned();
            BTreeMap::from([(key, schemas::OFFERED_QOS.to_owned())])
        }
        Encoding::Json => BTreeMap::new(),
    }
}

/// Declares a channel of another file; its records go to `out`.
pub(super) fn declare_copy(
    file: &mut McapFile,
    out: &mut Vec<u8>,
    channel: &InputChannel<'_>,
) -> Result<u16> {
    let schema = match channel.schema {
        Some((name, encoding, text)) => file
            .schema(out, name, encoding, text)
            .ok_or_else(too_many_channels)?,
        None => 0,
    };
    file.channel(
        out,
        schema,
        channel.topic,
        channel.message_encoding,
        channel.metadata,
    )
    .ok_or_else(too_many_channels)
}

/// Appends a message of another file to a chunk.
pub(super) fn copy(chunk: &mut Chunk, channel: u16, message: &InputMessage<'_>) {
    chunk.push(
        channel,
        message.sequence,
        message.log_time,
        message.publish_time,
        message.data,
    );
}

/// MCAP times are unsigned: what was logged before 1970 was logged at its beginning.
fn log_time(log: Nanos) -> u64 {
    log.0.max(0) as u64
}

fn only_attitudes_are_json() -> Error {
    Error::usage(
        Diagnostic::new("only attitudes are written to MCAP as JSON")
            .help(format!("{ENCODING} cdr, or write .ndjson")),
    )
}

fn too_many_channels() -> Error {
    Error::usage(
        Diagnostic::new("an MCAP file holds at most 65535 channels and schemas").help(format!(
            "a copy of this log ({COPY_INPUT}, recover) does not fit into one"
        )),
    )
}
