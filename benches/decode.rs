//! Nanoseconds per message of each decoder: `cargo bench --bench decode`.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use strapd::decode::{Channel, Decoder, Options};
use strapd::record::Nanos;

#[path = "../tests/decode/writer.rs"]
#[allow(dead_code)]
mod writer;
use writer::{IMU, Proto, Writer, imu_section};

fn decoder(message_encoding: &str, schema_encoding: &str, schema_name: &str, schema: &[u8]) -> Decoder {
    let channel = Channel {
        topic: "/imu",
        message_encoding,
        schema_name,
        schema_encoding,
        schema_data: schema,
    };
    Decoder::compile(&channel, &Options::default()).unwrap()
}

fn decoders(criterion: &mut Criterion) {
    let rig = format!("string name\nfloat64[] data\nsensor_msgs/Imu imu\n{}", imu_section());
    let rig_payload = Writer::cdr(false).string("rig").u32(4).f64s(&[1.0; 4]).imu("imu_link");
    let vector = Proto::message_type("V", ["x", "y", "z"].iter().zip(1..).map(|(n, i)| Proto::field(n, i, false, 1, "")).collect());
    let stamp = Proto::message_type("T", vec![Proto::field("seconds", 1, false, 3, ""), Proto::field("nanos", 2, false, 5, "")]);
    let imu = Proto::message_type(
        "Imu",
        vec![
            Proto::field("stamp", 1, false, 11, ".p.T"),
            Proto::field("angular_velocity", 2, false, 11, ".p.V"),
            Proto::field("linear_acceleration", 3, false, 11, ".p.V"),
        ],
    );
    let set = Proto::file_set("p", vec![vector, stamp, imu]);
    let xyz = || Proto::default().double(1, 0.123_456_789).double(2, -2.5).double(3, 9.806_65);
    let proto = Proto::default().message(1, Proto::default().varint(1, 1_700_000_000).varint(2, 123_456_789));
    let proto = proto.message(2, xyz()).message(3, xyz());
    let compact = br#"{"class":"RATE","id":"imu0","stamp":{"sec":1700000000,"nsec":5000000},"gyro":[0.0123456789,-1.23456,0.2],"seq":17}"#;
    let px4 = br#"{"timestamp":27329869,"gyro_rad":[-0.12973590195178986,-0.03351612016558647,-0.6194484829902649],"gyro_integral_dt":5007,"accelerometer_timestamp_relative":0,"accelerometer_m_s2":[1.8269859552383423,0.1537178009748459,-8.966402053833008],"accelerometer_integral_dt":4871,"accelerometer_clipping":0,"gyro_clipping":0,"accel_calibration_count":2,"gyro_calibration_count":1}"#;
    let ros = br#"{"header":{"seq":0,"stamp":{"sec":1730000000,"nsec":20000000},"frame_id":"imu_front"},"angular_velocity":{"x":0.06,"y":1.1996,"z":0.0112},"linear_acceleration":{"x":0.03,"y":0.4996,"z":9.814},"orientation":{"x":0,"y":0,"z":0,"w":1}}"#;
    let cases: [(&str, Decoder, Vec<u8>); 8] = [
        ("cdr imu little-endian", decoder("cdr", "ros2msg", "sensor_msgs/msg/Imu", IMU.as_bytes()), Writer::cdr(false).imu("imu_link").bytes),
        ("cdr imu big-endian", decoder("cdr", "ros2msg", "sensor_msgs/msg/Imu", IMU.as_bytes()), Writer::cdr(true).imu("imu_link").bytes),
        ("cdr nested imu", decoder("cdr", "ros2msg", "a/msg/Rig", rig.as_bytes()), rig_payload.bytes),
        ("ros1 imu", decoder("ros1", "ros1msg", "sensor_msgs/Imu", b""), Writer::ros1().imu("imu_link").bytes),
        ("protobuf imu", decoder("protobuf", "protobuf", "p.Imu", &set), proto.0),
        ("json RATE", decoder("json", "", "", b""), compact.to_vec()),
        ("json sensor_combined", decoder("json", "", "px4.sensor_combined", b""), px4.to_vec()),
        ("json imu", decoder("json", "", "sensor_msgs/Imu", b""), ros.to_vec()),
    ];
    let mut group = criterion.benchmark_group("decode");
    group.throughput(Throughput::Elements(1));
    for (name, decoder, payload) in &cases {
        let mut out = Vec::with_capacity(1);
        group.bench_function(*name, |bencher| {
            bencher.iter(|| {
                out.clear();
                decoder.decode(black_box(payload), Nanos(1), Nanos(2), &mut out).unwrap();
                black_box(&out);
            });
        });
    }
    group.finish();
}

criterion_group!(benches, decoders);
criterion_main!(benches);
