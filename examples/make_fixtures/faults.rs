//! The constant rate, with the faults that recordings have -> the bytes of an MCAP file. Pure.
//!
//! A stage of its own because each fault stands at a known sample, so that a run's counts can be checked
//! one by one. Everything that is left is the exact motion.

use super::imu_cdr::imu_message;
use super::log::{Log, Storage};
use super::motions::Motion;
use super::{SENSOR_FRAME, imu_topic, quaternion_message, quaternion_topic, sample_of};
use mcap::McapResult;

/// Messages are this far apart.
const PERIOD: i64 = 10_000_000;

/// Fault at a sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Fault {
    /// Sent as it should be.
    None,
    /// x rate is NaN.
    NotANumber,
    /// z rate is infinite.
    Infinite,
    /// y rate is 1e9 rad/s.
    Huge,
    /// The message is sent twice.
    SentTwice,
    /// A second message of the same stamp follows, with another rate.
    StampTwice,
    /// Nothing was recorded.
    Missing,
    /// Sent after the message that follows it.
    AfterTheNext,
    /// Sent a second late.
    SecondLate,
    /// The payload ends after 100 bytes.
    CutShort,
    /// The covariance says that there is no gyro (-1).
    MarkedAbsent,
    /// The stamp inside the message is zero.
    NoStamp,
}

/// The fault of each of the 700 samples.
pub(crate) fn fault_of(k: i64) -> Fault {
    match k {
        100 => Fault::NotANumber,
        101 => Fault::Infinite,
        150 => Fault::Huge,
        200 => Fault::SentTwice,
        250 => Fault::StampTwice,
        300..=399 => Fault::Missing,
        450 => Fault::AfterTheNext,
        500 => Fault::SecondLate,
        550 => Fault::CutShort,
        620 => Fault::MarkedAbsent,
        650 => Fault::NoStamp,
        _ => Fault::None,
    }
}

/// Number of samples in the motion, missing ones included.
pub(crate) const SAMPLES: i64 = 700;

/// The recording.
pub(crate) fn log(storage: Storage) -> McapResult<Vec<u8>> {
    let mut log = Log::new("ros2", storage)?;
    let imu = imu_topic(&mut log, "/imu/data_raw")?;
    let truth = quaternion_topic(&mut log, "/truth")?;
    // (received, channel, payload), in the order of sending.
    let mut sent: Vec<(i64, u16, Vec<u8>)> = Vec::new();
    for k in 0..SAMPLES {
        let mut sample = sample_of(Motion::ConstantRate, k * PERIOD);
        let on_time = sample.stamp;
        let mut received = on_time;
        let mut copies = 1;
        let fault = fault_of(k);
        match fault {
            Fault::NotANumber => sample.gyro[0] = f64::NAN,
            Fault::Infinite => sample.gyro[2] = f64::INFINITY,
            Fault::Huge => sample.gyro[1] = 1e9,
            Fault::SentTwice => copies = 2,
            Fault::Missing => copies = 0,
            Fault::AfterTheNext => received += PERIOD + PERIOD / 2,
            Fault::SecondLate => received += 1_000_000_000,
            Fault::MarkedAbsent => sample.gyro_covariance_0 = -1.0,
            Fault::NoStamp => sample.stamp = 0,
            Fault::StampTwice | Fault::CutShort | Fault::None => {}
        }
        let mut message = imu_message(SENSOR_FRAME, &sample);
        if fault == Fault::CutShort {
            message.truncate(100);
        }
        sent.extend(std::iter::repeat_n((received, imu, message), copies));
        if fault == Fault::StampTwice {
            sample.gyro = sample.gyro.map(|rate| rate + 0.125);
            sent.push((received, imu, imu_message(SENSOR_FRAME, &sample)));
        }
        if fault != Fault::Missing {
            let attitude = Motion::ConstantRate.attitude(k * PERIOD);
            let message = quaternion_message(on_time, "start", attitude);
            sent.push((on_time, truth, message));
        }
    }
    // The recorder writes what it receives, when it receives it. Stable: copies keep their order.
    sent.sort_by_key(|(received, ..)| *received);
    for (received, channel, message) in &sent {
        log.write(*channel, *received, message)?;
    }
    log.finish(&[("motion", "ConstantRate, Rate, with faults")])
}
