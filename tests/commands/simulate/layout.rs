//! Layout of the log of a simulation, as others see it.

use crate::program::strapd;
use mcap::records::MessageHeader;

fn f64_at(data: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(data[at..at + 8].try_into().unwrap())
}

#[test]
fn an_mcap_has_samples_truth_and_its_parameters_where_they_are_documented() {
    let dir = tempfile::tempdir().unwrap();
    strapd(
        dir.path(),
        "simulate coning --duration 1 --rate-hz 100 --start-stamp 1.000000007 -o c.mcap",
    )
    .done();
    let bytes = std::fs::read(dir.path().join("c.mcap")).unwrap();
    let mut seen = std::collections::BTreeMap::<String, Vec<(MessageHeader, Vec<u8>)>>::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let m = message.unwrap();
        let schema = m.channel.schema.as_ref().unwrap();
        assert_eq!(
            (
                m.channel.message_encoding.as_str(),
                schema.encoding.as_str()
            ),
            ("cdr", "ros2msg")
        );
        let header = MessageHeader {
            channel_id: 0,
            sequence: m.sequence,
            log_time: m.log_time,
            publish_time: m.publish_time,
        };
        let key = format!("{} {}", m.channel.topic, schema.name);
        seen.entry(key).or_default().push((header, m.data.to_vec()));
    }
    let topics: Vec<&str> = seen.keys().map(String::as_str).collect();
    assert_eq!(
        topics,
        [
            "/imu/data_raw sensor_msgs/msg/Imu",
            "/truth geometry_msgs/msg/QuaternionStamped",
            "/truth/rate geometry_msgs/msg/Vector3Stamped",
        ]
    );
    for (topic, messages) in &seen {
        assert_eq!(messages.len(), 101, "{topic}");
        let (header, data) = &messages[3];
        assert_eq!(header.log_time, 1_030_000_007, "{topic}");
        assert_eq!(
            data[..12],
            [0, 1, 0, 0, 1, 0, 0, 0, 0x87, 0xc3, 0xc9, 1],
            "{topic}"
        );
    }
    let third = |topic: &str| &seen[topic][3].1;
    // imu_link: numbers from 28 on. Half-angle 10 deg, 3 turns a second.
    let imu = third(topics[0]);
    assert_eq!(imu.len(), 324);
    let (a, w) = (10_f64.to_radians(), 6.0 * std::f64::consts::PI);
    let rate = [
        -2.0 * w * (a / 2.0).sin().powi(2),
        -w * a.sin() * (w * 0.03).sin(),
        w * a.sin() * (w * 0.03).cos(),
    ];
    let force: f64 = (0..3).map(|i| f64_at(imu, 28 + 200 + 8 * i).powi(2)).sum();
    assert!(
        (force.sqrt() - 9.80665).abs() < 1e-12,
        "at rest but for turning"
    );
    assert!(f64_at(imu, 28 + 216) > 0.0, "specific force points up");
    assert_eq!(f64_at(imu, 28 + 32), -1.0, "no orientation is claimed");
    assert_eq!(
        [0, 8, 16, 24].map(|i| f64_at(imu, 28 + i)),
        [0.0, 0.0, 0.0, 1.0]
    );
    // world: quaternion at 28, x, y, z, w.
    let truth = third(topics[1]);
    assert_eq!((truth.len(), &truth[16..22]), (60, &b"world\0"[..]));
    let q = [52, 28, 36, 44].map(|i| f64_at(truth, i));
    let (s, c) = (w * 0.03).sin_cos();
    let expected = [
        (a / 2.0).cos(),
        0.0,
        (a / 2.0).sin() * c,
        (a / 2.0).sin() * s,
    ];
    let vector = third(topics[2]);
    for (i, right) in rate.iter().enumerate() {
        let found = f64_at(imu, 28 + 104 + 8 * i);
        // Roundings of numbers of the size of the rate, 19 rad/s.
        assert!((found - right).abs() < 2e-14, "{found} {right}");
        assert_eq!(found, f64_at(vector, 28 + 8 * i));
    }
    for (found, right) in q.iter().zip(expected) {
        assert!((found - right).abs() < 1e-15, "{q:?} {expected:?}");
    }
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let record = summary
        .metadata_indexes
        .iter()
        .find(|m| m.name == "strapd")
        .unwrap();
    let metadata = mcap::read::metadata(&bytes, record).unwrap().metadata;
    for (key, value) in [
        ("motion", "coning"),
        ("half_angle_deg", "10"),
        ("frequency_hz", "3"),
        ("rate_hz", "100"),
        ("seed", "1"),
        ("start_stamp_ns", "1000000007"),
        ("noise", "none"),
        ("world", "enu"),
        ("rotates", "sensor_to_world"),
    ] {
        assert_eq!(metadata[key], value, "{key}");
    }
}

#[test]
fn a_table_has_a_row_a_sample_with_the_truth_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    strapd(
        dir.path(),
        "simulate random --duration 1 --rate-hz 10 --sample-kind average -o r.csv",
    )
    .done();
    let text = std::fs::read_to_string(dir.path().join("r.csv")).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "stamp_ns,true_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,qw,qx,qy,qz,interval_ns,sample_kind"
    );
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    assert_eq!(rows.len(), 10);
    assert!(rows.iter().all(|r| r[12..] == ["100000000", "average"]));
    assert_eq!(rows[9][0], "1700000001000000000");
}

#[test]
fn the_log_says_nothing_that_makes_the_truth_a_sensor() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(at, "simulate coning --duration 2 --rate-hz 100 -o c.mcap").done();
    let replayed = strapd(at, "replay c.mcap --topic all -o out.mcap");
    assert!(!replayed.done().err.contains("/truth"), "{}", replayed.err);
    assert!(!replayed.out.contains("/truth"), "{}", replayed.out);
    // Named, it may be: the rate as it truly was.
    strapd(at, "replay c.mcap --topic /truth/rate -o true.mcap").done();
    assert!(super::largest_error(at, "true.mcap", "c.mcap").0 < 1e-9);
}

#[test]
fn paced_samples_and_truth_keep_step() {
    let dir = tempfile::tempdir().unwrap();
    // Ten seconds of data in a tenth of a second.
    let ran = strapd(
        dir.path(),
        "simulate coning --duration 10 --rate-hz 50 --speed 100 -o -",
    );
    let lines = ran.done().lines();
    let seconds = |l: &serde_json::Value| {
        l["stamp"]["sec"].as_f64().unwrap() + 1e-9 * l["stamp"]["nsec"].as_f64().unwrap()
    };
    assert_eq!(lines.len(), 1002);
    for pair in lines.windows(2) {
        assert!(
            (seconds(&pair[1]) - seconds(&pair[0])).abs() <= 0.6,
            "{pair:?}"
        );
    }
}
