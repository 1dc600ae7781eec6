//! Samples of one stream -> the payloads of its messages in CDR, without a file around them. Pure.
//!
//! The same encoders and topics as in a file, for those who take messages one by one.

use super::cdr::{self, ros_time};
use super::{IMU_SCHEMA, TF_SCHEMA, TF_TOPIC, schemas};
use crate::sink::Transforms;
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
    /// Attitudes, and transforms for [`Topic::transforms`].
    Attitude { imu: cdr::Imu, tf: cdr::Tf },
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
                tf: cdr::Tf::new(0, Transforms::Forward, &parent, child),
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

    /// The topics of the stream's own, in the order of their messages.
    #[must_use]
    pub fn topics(stream: &Stream) -> Vec<Topic> {
        let name = stream.bounded().output_topic;
        match stream.content {
            Content::Attitude | Content::Samples(_) => vec![Topic::new(&name, IMU_SCHEMA)],
            Content::Truth => vec![
                Topic::new(
                    &name,
                    [
                        "geometry_msgs/msg/QuaternionStamped",
                        "ros2msg",
                        schemas::QUATERNION_STAMPED,
                    ],
                ),
                Topic::new(
                    &format!("{name}/rate"),
                    [
                        "geometry_msgs/msg/Vector3Stamped",
                        "ros2msg",
                        schemas::VECTOR3_STAMPED,
                    ],
                ),
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

    /// Appends what stands beside the attitude: the transform, or the true rate.
    pub fn beside(&self, out: &mut Vec<u8>, sample: &AttitudeSample) {
        let (stamp, _) = ros_time(sample.stamp);
        headless(out, |record| match &self.0 {
            Encoders::Attitude { tf, .. } => tf.append(record, 0, 0, stamp, sample),
            Encoders::Truth { rate, .. } => rate.append(record, 0, 0, stamp, sample.rate.into()),
            Encoders::Samples { .. } => {}
        });
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
