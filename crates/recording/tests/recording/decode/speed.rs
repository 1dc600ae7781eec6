//! Nanoseconds per message, best of many rounds:
//! `cargo test --release --test recording -- --ignored --nocapture speed`.

use super::writer::{IMU, Proto, Writer, imu_section};
use std::hint::black_box;
use std::time::Instant;
use strapd_attitude::record::Nanos;
use strapd_recording::decode::{Channel, Decoder, Options};

fn decoder(
    message_encoding: &str,
    schema_encoding: &str,
    schema_name: &str,
    schema: &[u8],
) -> Decoder {
    let channel = Channel {
        topic: "/imu",
        message_encoding,
        schema_name,
        schema_encoding,
        schema_data: schema,
    };
    Decoder::compile(&channel, &Options::default()).unwrap()
}

/// Best of 200 rounds of 2,000 messages: what the machine can do when nobody else asks for it.
fn nanos_per_message(decoder: &Decoder, payload: &[u8]) -> f64 {
    let mut out = Vec::with_capacity(1);
    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let start = Instant::now();
        for _ in 0..2000 {
            out.clear();
            decoder
                .decode(black_box(payload), Nanos(1), Nanos(2), &mut out)
                .unwrap();
            black_box(&out);
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / 2000.0);
    }
    best
}

#[test]
#[ignore = "measures; run it in release mode on a quiet machine"]
fn speed_of_every_decoder() {
    let rig = format!(
        "string name\nfloat64[] data\nsensor_msgs/Imu imu\n{}",
        imu_section()
    );
    let rig_payload = Writer::cdr(false)
        .string("rig")
        .u32(4)
        .f64s(&[1.0; 4])
        .imu("imu_link");
    let vector = Proto::message_type(
        "V",
        ["x", "y", "z"]
            .iter()
            .zip(1..)
            .map(|(n, i)| Proto::field(n, i, false, 1, ""))
            .collect(),
    );
    let stamp = Proto::message_type(
        "T",
        vec![
            Proto::field("seconds", 1, false, 3, ""),
            Proto::field("nanos", 2, false, 5, ""),
        ],
    );
    let imu = Proto::message_type(
        "Imu",
        vec![
            Proto::field("stamp", 1, false, 11, ".p.T"),
            Proto::field("angular_velocity", 2, false, 11, ".p.V"),
            Proto::field("linear_acceleration", 3, false, 11, ".p.V"),
        ],
    );
    let set = Proto::file_set("p", vec![vector, stamp, imu]);
    let xyz = || {
        Proto::default()
            .double(1, 0.123_456_789)
            .double(2, -2.5)
            .double(3, 9.806_65)
    };
    let proto = Proto::default().message(
        1,
        Proto::default()
            .varint(1, 1_700_000_000)
            .varint(2, 123_456_789),
    );
    let proto = proto.message(2, xyz()).message(3, xyz());
    let compact = br#"{"class":"RATE","id":"imu0","stamp":{"sec":1700000000,"nsec":5000000},"gyro":[0.0123456789,-1.23456,0.2],"seq":17}"#;
    let px4 = br#"{"timestamp":27329869,"gyro_rad":[-0.12973590195178986,-0.03351612016558647,-0.6194484829902649],"gyro_integral_dt":5007,"accelerometer_timestamp_relative":0,"accelerometer_m_s2":[1.8269859552383423,0.1537178009748459,-8.966402053833008],"accelerometer_integral_dt":4871,"accelerometer_clipping":0,"gyro_clipping":0,"accel_calibration_count":2,"gyro_calibration_count":1}"#;
    let ros = br#"{"header":{"seq":0,"stamp":{"sec":1730000000,"nsec":20000000},"frame_id":"imu_front"},"angular_velocity":{"x":0.06,"y":1.1996,"z":0.0112},"linear_acceleration":{"x":0.03,"y":0.4996,"z":9.814},"orientation":{"x":0,"y":0,"z":0,"w":1}}"#;
    // Goals, ns: twice what a quiet 2-core Xeon VM gave, so that a lost fast path shows.
    let cases: [(&str, f64, Decoder, Vec<u8>); 8] = [
        (
            "cdr imu little-endian",
            30.0,
            decoder("cdr", "ros2msg", "sensor_msgs/msg/Imu", IMU.as_bytes()),
            Writer::cdr(false).imu("imu_link").bytes,
        ),
        (
            "cdr imu big-endian",
            30.0,
            decoder("cdr", "ros2msg", "sensor_msgs/msg/Imu", IMU.as_bytes()),
            Writer::cdr(true).imu("imu_link").bytes,
        ),
        (
            "cdr nested imu",
            100.0,
            decoder("cdr", "ros2msg", "a/msg/Rig", rig.as_bytes()),
            rig_payload.bytes,
        ),
        (
            "ros1 imu",
            30.0,
            decoder("ros1", "ros1msg", "sensor_msgs/Imu", b""),
            Writer::ros1().imu("imu_link").bytes,
        ),
        (
            "protobuf imu",
            260.0,
            decoder("protobuf", "protobuf", "p.Imu", &set),
            proto.0,
        ),
        (
            "json RATE",
            550.0,
            decoder("json", "", "", b""),
            compact.to_vec(),
        ),
        (
            "json sensor_combined",
            1200.0,
            decoder("json", "", "px4.sensor_combined", b""),
            px4.to_vec(),
        ),
        (
            "json imu",
            1200.0,
            decoder("json", "", "sensor_msgs/Imu", b""),
            ros.to_vec(),
        ),
    ];
    let mut slow = Vec::new();
    for (name, goal, decoder, payload) in &cases {
        let nanos = nanos_per_message(decoder, payload);
        eprintln!("{name:24} {nanos:7.1} ns  {} bytes", payload.len());
        if nanos > *goal {
            slow.push((name, nanos, goal));
        }
    }
    assert!(slow.is_empty(), "slower than their goals: {slow:?}");
}
