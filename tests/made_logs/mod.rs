//! A motion -> IMU logs written by the `mcap` crate, packed in every way.
//!
//! The messages are laid out by the fixtures' generator, from the CDR rules: nothing here is made
//! with this project's own encoder.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::expect_used)]

#[path = "../../examples/make_fixtures/imu_cdr.rs"]
mod imu_cdr;

#[allow(unused_imports)]
pub(crate) use imu_cdr::{ImuSample, imu_definition, imu_message};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// 2023-11-14 22:13:20 UTC.
pub const START: i64 = 1_700_000_000_000_000_000;
/// 100 Hz.
pub const STEP: i64 = 10_000_000;
pub const TOPIC: &str = "/imu/data_raw";

/// `None` for unchunked, else the compression of the chunks.
pub type Packing = Option<Option<mcap::Compression>>;

pub const PACKINGS: [(&str, Packing); 4] = [
    ("none", Some(None)),
    ("lz4", Some(Some(mcap::Compression::Lz4))),
    ("zstd", Some(Some(mcap::Compression::Zstd))),
    ("unchunked", None),
];

/// One message: when it was received, and what is in it.
#[derive(Clone, Debug)]
pub struct Logged {
    pub topic: &'static str,
    pub log_time: u64,
    pub payload: Vec<u8>,
}

/// `n` samples at 100 Hz of a lively motion about all three axes, none of them alike.
pub(crate) fn motion(n: usize) -> Vec<ImuSample> {
    (0..n as i64)
        .map(|k| {
            let t = k as f64 * 0.01;
            ImuSample {
                stamp: START + k * STEP,
                orientation: None,
                gyro: [
                    0.9 * (1.7 * t + 0.3).sin() + 0.2 * (23.0 * t).cos(),
                    1.3 * (0.9 * t).cos(),
                    0.4 + 0.7 * (3.1 * t + 1.0).sin(),
                ],
                gyro_covariance_0: 0.0,
                accel: [0.1 * (2.0 * t).sin(), 0.2, 9.80665],
            }
        })
        .collect()
}

/// Received when stamped.
pub(crate) fn logged(topic: &'static str, samples: &[ImuSample]) -> Vec<Logged> {
    samples
        .iter()
        .map(|sample| Logged {
            topic,
            log_time: sample.stamp as u64,
            payload: imu_cdr::imu_message("imu_link", sample),
        })
        .collect()
}

/// The bytes of a log of Imu messages in the order given.
pub fn bytes(packing: Packing, chunk: u64, messages: &[Logged]) -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .use_chunks(packing.is_some())
        .compression(packing.flatten())
        .compression_threads(0)
        .chunk_size(Some(chunk))
        .profile("ros2");
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let schema = writer
        .add_schema(
            "sensor_msgs/msg/Imu",
            "ros2msg",
            imu_cdr::imu_definition().as_bytes(),
        )
        .unwrap();
    // The rates of the motion at the stamps: no message says so.
    let metadata = [("sample_kind".to_owned(), "rate".to_owned())].into();
    for (sequence, message) in messages.iter().enumerate() {
        let channel_id = writer
            .add_channel(schema, message.topic, "cdr", &metadata)
            .unwrap();
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: sequence as u32,
            log_time: message.log_time,
            // A recorder receives what was sent a while before.
            publish_time: message.log_time.saturating_sub(1_234_567),
        };
        writer
            .write_to_known_channel(&header, &message.payload)
            .unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A log of these samples on [`TOPIC`], in zstd chunks of about 4 kB, under `dir`.
pub(crate) fn written(dir: &Path, name: &str, samples: &[ImuSample]) -> PathBuf {
    let path = dir.join(name);
    let packing = Some(Some(mcap::Compression::Zstd));
    std::fs::write(&path, bytes(packing, 4096, &logged(TOPIC, samples))).unwrap();
    path
}
