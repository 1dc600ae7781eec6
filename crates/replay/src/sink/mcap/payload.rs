//! Samples of one stream -> the payloads of its messages in CDR, without a file around them. Pure.
//!
//! The same encoders and topics as in a file, for those who take messages one by one.

use super::cdr::{self, ros_time};
use super::messages::{Acceleration, acceleration_topic};
use super::{ACCEL_SCHEMA, IMU_SCHEMA, QUATERNION_SCHEMA, TF_SCHEMA, TF_TOPIC, VECTOR_SCHEMA};
use crate::sink::stream::{Content, Stream, named_frame, parent_frame};
use strapd_attitude::record::{AttitudeSample, RawSample};
use strapd_recording::mcap::MessageRecord;

/// A topic and the type of its messages, all `cdr` described as `ros2msg`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Topic {
    /// Name.
    pub name: String,
    /// The type's name.
    pub schema_name: &'static str,
    /// The type's definition.
    pub schema: &'static str,
}

impl Topic {
    fn new(name: &str, [schema_name, _, schema]: [&'static str; 3]) -> Topic {
        Topic {
            name: name.to_owned(),
            schema_name,
            schema,
        }
    }

    /// The one all transforms are on.
    #[must_use]
    pub fn transforms() -> Topic {
        Topic::new(TF_TOPIC, TF_SCHEMA)
    }
}

/// The messages of one stream.
#[derive(Debug)]
pub struct Payloads(Encoders);

#[derive(Debug)]
enum Encoders {
    /// Attitudes, accelerations without gravity, and transforms for [`Topic::transforms`].
    Attitude {
        imu: cdr::Imu,
        acceleration: Option<Acceleration>,
        tf: Option<cdr::Tf>,
    },
    /// Samples of a sensor.
    Samples { imu: cdr::Imu },
    /// True attitude and rate.
    Truth {
        attitude: cdr::Stamped<4>,
        rate: cdr::Stamped<3>,
    },
}

impl Payloads {
    /// Makes those of `stream`, whose transform has this child.
    #[must_use]
    pub fn new(stream: &Stream, child: &str) -> Payloads {
        let stream = stream.bounded();
        let parent = parent_frame(&stream);
        Payloads(match stream.content {
            Content::Attitude => Encoders::Attitude {
                imu: cdr::Imu::new(0, named_frame(&stream, child)),
                acceleration: stream
                    .has_linear_acceleration
                    .then(|| Acceleration::new(0, named_frame(&stream, child))),
                tf: stream
                    .has_transforms()
                    .then(|| cdr::Tf::new(0, stream.transforms, &parent, child)),
            },
            Content::Samples(_) => Encoders::Samples {
                imu: cdr::Imu::new(0, &stream.frame_id),
            },
            Content::Truth => Encoders::Truth {
                attitude: cdr::Stamped::new(0, &parent),
                rate: cdr::Stamped::new(0, &stream.frame_id),
            },
        })
    }

    /// The topics of the stream's own: that of its attitudes or samples, and a second one for what stands beside them.
    #[must_use]
    pub fn topics(stream: &Stream) -> Vec<Topic> {
        let stream = stream.bounded();
        let name = &stream.output_topic;
        match stream.content {
            Content::Attitude if stream.has_linear_acceleration => vec![
                Topic::new(name, IMU_SCHEMA),
                Topic::new(&acceleration_topic(&stream), ACCEL_SCHEMA),
            ],
            Content::Attitude | Content::Samples(_) => vec![Topic::new(name, IMU_SCHEMA)],
            Content::Truth => vec![
                Topic::new(name, QUATERNION_SCHEMA),
                Topic::new(&format!("{name}/rate"), VECTOR_SCHEMA),
            ],
        }
    }

    /// Appends the attitude itself.
    pub fn attitude(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        let (stamp, _) = ros_time(sample.stamp);
        headless(out, |record| match &self.0 {
            Encoders::Attitude { imu, .. } => imu.append(record, 0, 0, stamp, sample),
            Encoders::Truth { attitude, .. } => {
                let [w, x, y, z] = sample.q_nb.wxyz();
                attitude.append(record, 0, 0, stamp, [x, y, z, w]);
            }
            Encoders::Samples { .. } => {}
        });
    }

    /// Appends what stands beside the attitude on the second topic: the acceleration without gravity, or the true rate.
    /// Without it nothing is appended.
    pub fn beside(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        let (stamp, _) = ros_time(sample.stamp);
        headless(out, |record| match &self.0 {
            Encoders::Attitude { acceleration, .. } => {
                if let Some((message, of)) = acceleration.as_ref().zip(sample.linear_acceleration) {
                    message.append(record, 0, 0, stamp, &of);
                }
            }
            Encoders::Truth { rate, .. } => rate.append(record, 0, 0, stamp, sample.rate.into()),
            Encoders::Samples { .. } => {}
        });
    }

    /// Appends its transform, where it has one.
    pub fn transform(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        if let Encoders::Attitude { tf: Some(tf), .. } = &self.0 {
            let (stamp, _) = ros_time(sample.stamp);
            headless(out, |record| tf.append(record, 0, 0, stamp, sample));
        }
    }

    /// Appends what a sensor put out.
    pub fn sample(&self, out: &mut Vec<u8>, sample: &RawSample) {
        if let Encoders::Samples { imu } = &self.0 {
            let (stamp, _) = ros_time(sample.header.unwrap_or(sample.log));
            headless(out, |record| imu.append_raw(record, 0, 0, stamp, sample));
        }
    }
}

/// Appends what `append` does, without the head a file's record has.
fn headless(out: &mut Vec<u8>, append: impl FnOnce(&mut Vec<u8>)) {
    let from = out.len();
    append(out);
    let head = MessageRecord::HEAD.min(out.len() - from);
    out.drain(from..from + head);
}
