//! Promise: a recording survives what kills the process or fills the disk, and replays to the same attitude.

mod child;
mod crash;
mod disk;
mod replay;
mod rotation;

use mcap::sans_io::{LinearReadEvent, LinearReader};
use nalgebra::Vector3;
use std::path::Path;
use strapd::pipeline::recover::{Recover, Recovered, run};
use strapd::sink::{Options, Target};
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, RawSample, Status};
use strapd_recording::Source;
use strapd_recording::pool::Pool;

/// Sample `k` of a sensor that sends `rate_hz` a second. Its last digits differ from sample to sample, so
/// that it packs as badly as a real one.
fn sample(k: u64, rate_hz: u64) -> RawSample {
    let stamp = Nanos(1_700_000_000_000_000_000 + (k * 1_000_000_000 / rate_hz) as i64);
    let t = k as f64 / rate_hz as f64;
    let log = Nanos(stamp.0 + 150_000);
    RawSample {
        header: Some(stamp),
        log,
        publish: stamp,
        gyro: Some([(1.3 * t).sin(), 0.2 * (7.0 * t).cos(), 1e-3 * t]),
        accel: Some([0.1 * (3.0 * t).sin(), 0.2, 9.8 + 0.01 * t.cos()]),
        ..RawSample::default()
    }
}

/// An attitude for it; what it is does not matter here.
fn attitude(raw: &RawSample) -> AttitudeSample {
    let [x, y, z] = raw.gyro.unwrap();
    AttitudeSample {
        stamp: raw.header.unwrap(),
        q_nb: Quaternion::assume_unit([(0.5 * x).cos(), (0.5 * x).sin(), 0.0, 0.0]),
        rate: BodyRate(Vector3::new(x, y, z)),
        accel: raw.accel.map(|a| In::assume(Vector3::from(a))),
        linear_acceleration: None,
        covariance: AttitudeCovariance::from_sigma(Vector3::new(1e-5, 2e-5, 3e-5)),
        status: Status::OK,
        reset_count: 0,
        log: raw.log,
        temperature: None,
    }
}

const RAW: &str = "imu/data_raw";
const OUT: &str = "imu/data";

/// Recovers a file; the sequence numbers on each of the two topics, which must be 0, 1, 2, ...
fn recovered(path: &Path) -> (Recovered, [u64; 2]) {
    let out = path.with_extension("recovered.mcap");
    let wanted = Recover {
        source: Source::File(path.to_owned()),
        target: Target::parse(out.to_str().unwrap()).unwrap(),
        options: Options {
            force: true,
            ..Options::default()
        },
    };
    let recovered = run(&wanted, &Pool::new(1).unwrap(), &mut |_| {}).unwrap();
    let bytes = std::fs::read(&out).unwrap();
    let mut counts = [0u64; 3];
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let topics = [RAW, OUT, "/tf"];
        let topic = topics
            .iter()
            .position(|t| *t == message.channel.topic)
            .unwrap();
        assert_eq!(
            u64::from(message.sequence),
            counts[topic],
            "{}",
            topics[topic]
        );
        counts[topic] += 1;
    }
    assert_eq!(counts[1], counts[2], "every attitude has its transform");
    (recovered, [counts[0], counts[1]])
}

/// Messages the `mcap` crate's linear reader gives before it ends or fails.
fn linear(bytes: &[u8]) -> u64 {
    let mut reader = LinearReader::new();
    let (mut rest, mut messages) = (bytes, 0);
    while let Some(Ok(event)) = reader.next_event() {
        match event {
            LinearReadEvent::ReadRequest(wanted) => {
                // A file in the middle of a chunk asks for more than there is.
                let n = wanted.min(rest.len());
                reader.insert(n).copy_from_slice(&rest[..n]);
                reader.notify_read(n);
                rest = &rest[n..];
            }
            LinearReadEvent::Record { opcode, .. } => {
                messages += u64::from(opcode == strapd_recording::mcap::op::MESSAGE);
            }
        }
    }
    messages
}

/// The file is whole: its summary holds together and the index finds every message.
fn assert_whole(path: &Path) -> u64 {
    let bytes = std::fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().expect("a summary");
    let indexed: usize = summary
        .chunk_indexes
        .iter()
        .map(|index| summary.stream_chunk(&bytes, index).unwrap().count())
        .sum();
    assert_eq!(summary.stats.unwrap().message_count, indexed as u64);
    assert_eq!(linear(&bytes), indexed as u64);
    indexed as u64
}
