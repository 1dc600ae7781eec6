//! Samples -> MCAP: which channels a stream becomes, and its samples as chunks. Pure.
//!
//! A stage of its own because this is where a sample takes the form other programs read. Chunks are
//! cut at fixed sample counts and filled independently of each other, so any number of threads, and
//! any cutting of the input, gives the same bytes.

pub(super) mod cdr;
pub(super) mod chunk;
pub(super) mod file;
pub(super) mod live;
mod messages;
pub mod payload;
mod schemas;

use super::Options;
use super::batch::Batch;
use super::form::{Form, Opening, Slot};
use super::json::{AttObject, FrameTransform};
use super::stream::{ChildFrames, Content, Provenance, Stream, named_frame, parent_frame};
use crate::error::{Error, Result};
use chunk::{Chunk, Compression};
pub use file::Attachment;
use file::McapFile;
use messages::acceleration_topic;
use messages::{Acceleration, CdrMessages, JsonMessages, Messages, SampleMessages, TruthMessages};
use std::collections::BTreeMap;
use std::io;
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::record::{Nanos, SampleKind};
use strapd_attitude::setting::{COPY_INPUT, ENCODING, SAMPLE_KIND};

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
        layout: Layout::begin(&mut file, head, *options, streams, provenance)?,
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

impl Layout {
    /// Declares every stream's channels; the head of the file goes to `out`.
    fn begin(
        file: &mut McapFile,
        out: &mut Vec<u8>,
        options: Options,
        streams: &[Stream],
        provenance: &Provenance,
    ) -> Result<Layout> {
        let encoding = options.encoding;
        let metadata = push_head(file, out, encoding, provenance);
        let mut declare = |topic: &str, schema: [&str; 3], kind: Option<SampleKind>| {
            let [name, form, text] = schema;
            let mut metadata = metadata.clone();
            // For whoever reads them: no field of a message says what a sample is.
            metadata
                .extend(kind.map(|kind| (SAMPLE_KIND.name().to_owned(), kind.name().to_owned())));
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
        let topics = Declared::of(streams, encoding, attitude_schema, &mut declare)?;
        let transform = match streams.iter().any(Stream::has_transforms) {
            true => Some(declare(TF_TOPIC, transform_schema, None)?),
            false => None,
        };
        file.transform_channel = transform.filter(|_| encoding == Encoding::Cdr);

        let mut frames = ChildFrames::default();
        let children: Vec<String> = streams.iter().map(|stream| frames.take(stream)).collect();
        let all = streams.iter().zip(topics).zip(&children);
        let messages = |((stream, topics), child): ((&Stream, Declared), &String)| {
            topics.messages(stream, encoding, transform, child)
        };
        Ok(Layout {
            streams: all.map(messages).collect(),
        })
    }

    fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        if let Some(messages) = self.streams.get(batch.stream) {
            messages.fill(chunk, batch);
        }
    }
}

/// Channels of a stream.
struct Declared {
    /// Attitudes, or samples.
    main: u16,
    /// True rates.
    rate: u16,
    /// Magnetic field.
    field: Option<u16>,
    /// Acceleration without gravity.
    acceleration: Option<u16>,
}

/// Declares a channel: its topic, its schema, the kind of its samples.
type Declare<'d> = &'d mut dyn FnMut(&str, [&str; 3], Option<SampleKind>) -> Result<u16>;

impl Declared {
    /// Declares those of all streams: first every stream's own, then those beside them.
    fn of(
        streams: &[Stream],
        encoding: Encoding,
        attitude_schema: [&str; 3],
        declare: Declare<'_>,
    ) -> Result<Vec<Declared>> {
        let mut all = Vec::new();
        for stream in streams {
            let (schema, kind) = match stream.content {
                Content::Attitude => (attitude_schema, None),
                _ if encoding == Encoding::Json => return Err(only_attitudes_are_json()),
                Content::Samples(kind) => (IMU_SCHEMA, Some(kind)),
                Content::Truth => (QUATERNION_SCHEMA, None),
            };
            all.push(Declared {
                main: declare(&stream.output_topic, schema, kind)?,
                rate: 0,
                field: None,
                acceleration: None,
            });
        }
        for (stream, own) in streams.iter().zip(&mut all) {
            if stream.content == Content::Truth {
                own.rate = declare(
                    &format!("{}/rate", stream.output_topic),
                    VECTOR_SCHEMA,
                    Some(SampleKind::Rate),
                )?;
            }
        }
        for (stream, own) in streams.iter().zip(&mut all) {
            if let (Content::Samples(_), Some(topic)) = (&stream.content, &stream.field_topic) {
                own.field = Some(declare(topic, FIELD_SCHEMA, None)?);
            }
        }
        // In JSON it is a part of the attitude's object.
        for (stream, own) in streams.iter().zip(&mut all) {
            if stream.has_linear_acceleration && encoding == Encoding::Cdr {
                own.acceleration = Some(declare(&acceleration_topic(stream), ACCEL_SCHEMA, None)?);
            }
        }
        Ok(all)
    }

    /// The messages of a stream with these channels.
    fn messages(
        self,
        stream: &Stream,
        encoding: Encoding,
        transform: Option<u16>,
        child: &str,
    ) -> Messages {
        let parent = parent_frame(stream);
        let main = self.main;
        let transform = transform.filter(|_| stream.has_transforms());
        let way = stream.transforms;
        match (&stream.content, encoding) {
            (Content::Samples(_), _) => Messages::Samples(SampleMessages {
                channel: main,
                imu: cdr::Imu::new(main, &stream.frame_id),
                field: self
                    .field
                    .map(|id| (id, cdr::Stamped::new(id, &stream.frame_id))),
            }),
            (Content::Truth, _) => Messages::Truth(TruthMessages {
                attitude: main,
                quaternion: cdr::Stamped::new(main, &parent),
                rate: self.rate,
                vector: cdr::Stamped::new(self.rate, &stream.frame_id),
            }),
            (Content::Attitude, Encoding::Cdr) => Messages::Cdr(CdrMessages {
                attitude: main,
                imu: cdr::Imu::new(main, named_frame(stream, child)),
                transform: transform.map(|id| (id, cdr::Tf::new(id, way, &parent, child))),
                acceleration: self
                    .acceleration
                    .map(|id| (id, Acceleration::new(id, named_frame(stream, child)))),
            }),
            (Content::Attitude, Encoding::Json) => Messages::Json(JsonMessages {
                attitude: main,
                att: AttObject::new(stream),
                transform: transform.map(|id| (id, FrameTransform::new(way, &parent, child))),
            }),
        }
    }
}

/// Name, encoding and text of our ROS 2 types.
const IMU_SCHEMA: [&str; 3] = ["sensor_msgs/msg/Imu", "ros2msg", schemas::IMU];
const QUATERNION_SCHEMA: [&str; 3] = [
    "geometry_msgs/msg/QuaternionStamped",
    "ros2msg",
    schemas::QUATERNION_STAMPED,
];
const VECTOR_SCHEMA: [&str; 3] = [
    "geometry_msgs/msg/Vector3Stamped",
    "ros2msg",
    schemas::VECTOR3_STAMPED,
];
const ACCEL_SCHEMA: [&str; 3] = [
    "geometry_msgs/msg/AccelWithCovarianceStamped",
    "ros2msg",
    schemas::ACCEL_WITH_COVARIANCE_STAMPED,
];
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
    // One topic, one channel: of two with the same name some readers take one alone.
    let is_alike = channel.topic == TF_TOPIC
        && channel.message_encoding == Encoding::Cdr.name()
        && channel
            .schema
            .is_some_and(|(name, ..)| name == TF_SCHEMA[0]);
    if let Some(ours) = file.transform_channel.filter(|_| is_alike) {
        return Ok(ours);
    }
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
