//! Attitudes or samples -> the messages of their stream, in a chunk. Pure.
//!
//! Apart from the layout because it is the hot part: what a message is made of was decided when its channels were declared.

use super::super::batch::Batch;
use super::super::json::{AttObject, FrameTransform};
use super::super::stream::Stream;
use super::chunk::Chunk;
use super::{cdr, log_time};
use strapd_attitude::record::LinearAcceleration;

/// Messages of a stream.
#[derive(Debug)]
pub(super) enum Messages {
    Cdr(CdrMessages),
    Json(JsonMessages),
    Samples(SampleMessages),
    Truth(TruthMessages),
}

impl Messages {
    /// Fills an empty chunk. A transform with the stamp of the one before is left out: tf2 warns
    /// about each.
    pub(super) fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        match self {
            Messages::Cdr(messages) => messages.fill(chunk, batch),
            Messages::Json(messages) => messages.fill(chunk, batch),
            Messages::Samples(messages) => messages.fill(chunk, batch),
            Messages::Truth(messages) => messages.fill(chunk, batch),
        }
    }
}

/// The attitude as `Imu`, and its transform.
#[derive(Debug)]
pub(super) struct CdrMessages {
    pub(super) attitude: u16,
    pub(super) imu: cdr::Imu,
    /// Transforms, if there are some.
    pub(super) transform: Option<(u16, cdr::Tf)>,
    /// The acceleration without gravity, where attitudes carry it.
    pub(super) acceleration: Option<(u16, Acceleration)>,
}

impl CdrMessages {
    fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        let mut previous = batch.previous;
        let attitude = chunk.lane(self.attitude);
        let transform = self
            .transform
            .as_ref()
            .map(|(id, tf)| (chunk.lane(*id), tf));
        let acceleration = self
            .acceleration
            .as_ref()
            .map(|(id, message)| (chunk.lane(*id), message));
        let beside = acceleration.map_or(0, |(_, message)| message.len())
            + transform.map_or(0, |(_, tf)| tf.len());
        chunk
            .plain
            .reserve(batch.samples.len() * (self.imu.len() + beside));
        for (n, sample) in (batch.first..).zip(&batch.samples) {
            let log_time = log_time(sample.log);
            let (stamp, fits) = cdr::ros_time(sample.stamp);
            chunk.stamps_out_of_range += u64::from(!fits);
            chunk.note(attitude, log_time);
            self.imu
                .append(&mut chunk.plain, n as u32, log_time, stamp, sample);
            if previous.replace(sample.stamp) != Some(sample.stamp)
                && let Some((lane, tf)) = transform
            {
                chunk.note(lane, log_time);
                tf.append(&mut chunk.plain, n as u32, log_time, stamp, sample);
            }
            if let Some(((lane, message), of)) = acceleration.zip(sample.linear_acceleration) {
                chunk.note(lane, log_time);
                message.append(&mut chunk.plain, n as u32, log_time, stamp, &of);
            }
        }
    }
}

/// Topic of the acceleration without gravity beside the attitudes of a stream.
pub(super) fn acceleration_topic(stream: &Stream) -> String {
    format!("{}/linear_acceleration", stream.output_topic)
}

/// The acceleration without gravity as `geometry_msgs/msg/AccelWithCovarianceStamped`.
#[derive(Debug)]
pub(super) struct Acceleration(cdr::Stamped<42>);

impl Acceleration {
    pub(super) fn new(channel: u16, frame_id: &str) -> Acceleration {
        Acceleration(cdr::Stamped::new(channel, frame_id))
    }

    /// Bytes of one message record.
    fn len(&self) -> usize {
        self.0.len()
    }

    /// Appends the record.
    pub(super) fn append(
        &self,
        out: &mut Vec<u8>,
        sequence: u32,
        log_time: u64,
        stamp: [u8; 8],
        of: &LinearAcceleration,
    ) {
        let numbers = accel_with_covariance(of);
        self.0.append(out, sequence, log_time, stamp, numbers);
    }
}

/// Numbers of a `geometry_msgs/msg/AccelWithCovariance`: linear, angular, 6x6 covariance row by row. What is angular is
/// not known.
fn accel_with_covariance(of: &LinearAcceleration) -> [f64; 42] {
    let mut numbers = [f64::NAN; 42];
    let [xx, xy, xz, yy, yz, zz] = of.covariance;
    for (row, values) in [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        .iter()
        .enumerate()
    {
        for (column, value) in values.iter().enumerate() {
            numbers[6 + 6 * row + column] = *value;
        }
    }
    for (place, value) in numbers.iter_mut().zip(of.body.as_vector()) {
        *place = *value;
    }
    numbers
}

/// The same as JSON.
#[derive(Debug)]
pub(super) struct JsonMessages {
    pub(super) attitude: u16,
    pub(super) att: AttObject,
    /// Transforms, if there are some.
    pub(super) transform: Option<(u16, FrameTransform)>,
}

impl JsonMessages {
    fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        let mut previous = batch.previous;
        let mut text = Vec::new();
        for (n, sample) in (batch.first..).zip(&batch.samples) {
            let log_time = log_time(sample.log);
            text.clear();
            self.att.push(&mut text, n, sample);
            chunk.push(self.attitude, n as u32, log_time, log_time, &text);
            if previous.replace(sample.stamp) != Some(sample.stamp)
                && let Some((id, transform)) = &self.transform
            {
                text.clear();
                transform.push(&mut text, sample);
                chunk.push(*id, n as u32, log_time, log_time, &text);
            }
        }
    }
}

/// Samples of a simulation.
#[derive(Debug)]
pub(super) struct SampleMessages {
    pub(super) channel: u16,
    pub(super) imu: cdr::Imu,
    /// The field and its nine covariances.
    pub(super) field: Option<(u16, cdr::Stamped<12>)>,
}

impl SampleMessages {
    fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        let lane = chunk.lane(self.channel);
        let field = self
            .field
            .as_ref()
            .map(|(id, field)| (chunk.lane(*id), field));
        chunk.plain.reserve(batch.raw.len() * self.imu.len());
        for (n, sample) in (batch.first..).zip(&batch.raw) {
            let log_time = log_time(sample.log);
            let (stamp, fits) = cdr::ros_time(sample.header.unwrap_or(sample.log));
            chunk.stamps_out_of_range += u64::from(!fits);
            chunk.note(lane, log_time);
            self.imu
                .append_raw(&mut chunk.plain, n as u32, log_time, stamp, sample);
            if let (Some((lane, field)), Some([x, y, z])) = (&field, sample.mag) {
                // A covariance of zeros is an unknown one.
                let numbers = [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                chunk.note(*lane, log_time);
                field.append(&mut chunk.plain, n as u32, log_time, stamp, numbers);
            }
        }
    }
}

/// The true attitude and rate of a simulation.
#[derive(Debug)]
pub(super) struct TruthMessages {
    pub(super) attitude: u16,
    pub(super) quaternion: cdr::Stamped<4>,
    pub(super) rate: u16,
    pub(super) vector: cdr::Stamped<3>,
}

impl TruthMessages {
    fn fill(&self, chunk: &mut Chunk, batch: &Batch) {
        let (attitude, rate) = (chunk.lane(self.attitude), chunk.lane(self.rate));
        chunk
            .plain
            .reserve(batch.samples.len() * (self.quaternion.len() + self.vector.len()));
        for (n, sample) in (batch.first..).zip(&batch.samples) {
            let log_time = log_time(sample.log);
            let (stamp, fits) = cdr::ros_time(sample.stamp);
            chunk.stamps_out_of_range += u64::from(!fits);
            let [w, x, y, z] = sample.q_nb.wxyz();
            chunk.note(attitude, log_time);
            self.quaternion
                .append(&mut chunk.plain, n as u32, log_time, stamp, [x, y, z, w]);
            chunk.note(rate, log_time);
            let w_nb_b = sample.rate.into();
            self.vector
                .append(&mut chunk.plain, n as u32, log_time, stamp, w_nb_b);
        }
    }
}
