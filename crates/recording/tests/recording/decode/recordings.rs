//! Every recording decodes to what `logs/README.md` says of it.

use crate::shared_data::shared;
use std::collections::BTreeMap;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Channel, Decoded, Decoder, Options, role};

/// A channel, owned.
#[derive(Clone)]
pub(crate) struct Owned {
    pub(crate) topic: String,
    pub(crate) message_encoding: String,
    pub(crate) schema_name: String,
    pub(crate) schema_encoding: String,
    pub(crate) schema_data: Vec<u8>,
    pub(crate) log: Nanos,
}

impl Owned {
    pub(crate) fn channel(&self) -> Channel<'_> {
        Channel {
            topic: &self.topic,
            message_encoding: &self.message_encoding,
            schema_name: &self.schema_name,
            schema_encoding: &self.schema_encoding,
            schema_data: &self.schema_data,
        }
    }
}

/// Every message of a recording up to the first damage.
pub(crate) fn messages(relative: &str) -> Option<Vec<(Vec<u8>, Owned)>> {
    let bytes = std::fs::read(shared(relative)?).unwrap();
    let mut list = Vec::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let Ok(message) = message else { break };
        let schema = message.channel.schema.clone();
        let owned = Owned {
            topic: message.channel.topic.clone(),
            message_encoding: message.channel.message_encoding.clone(),
            schema_name: schema.as_ref().map_or(String::new(), |s| s.name.clone()),
            schema_encoding: schema
                .as_ref()
                .map_or(String::new(), |s| s.encoding.clone()),
            schema_data: schema.map_or(Vec::new(), |s| s.data.to_vec()),
            log: Nanos(message.log_time as i64),
        };
        list.push((message.data.to_vec(), owned));
    }
    Some(list)
}

/// Samples, how many payloads could not be decoded, and what was noticed.
type Topic = (Vec<RawSample>, usize, Decoded);

/// Topic, samples, undecodable payloads.
type Expected = [(&'static str, usize, usize)];

/// Results of decoding each topic of a recording.
fn all(relative: &str) -> Option<BTreeMap<String, Topic>> {
    let mut decoders: BTreeMap<String, Option<Decoder>> = BTreeMap::new();
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    for (payload, owned) in messages(relative)? {
        let decoder = decoders.entry(owned.topic.clone()).or_insert_with(|| {
            let mut decoder = Decoder::compile(&owned.channel(), &Options::default()).ok()?;
            decoder.settle(&payload, owned.log).ok()?;
            Some(decoder)
        });
        let Some(decoder) = decoder else { continue };
        let (samples, bad, sum) = topics.entry(owned.topic.clone()).or_default();
        match decoder.decode(&payload, owned.log, owned.log, samples) {
            Ok(outcome) => {
                sum.gyro_marked_absent += outcome.gyro_marked_absent;
                sum.stamps_carried += outcome.stamps_carried;
            }
            Err(_) => *bad += 1,
        }
    }
    Some(topics)
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_recording_gives_as_many_samples_as_its_readme_says() {
    let expected: &[(&str, &Expected)] = &[
        (
            "real/ximu3_ros2_zstd",
            &[("/imu", 500, 0), ("/reference/orientation", 500, 0)],
        ),
        ("real/xsens_mti_ros2_none", &[("/imu", 953, 0)]),
        (
            "real/px4_fmuv6c_json_zstd",
            &[
                ("/sensor_combined", 1297, 0),
                ("/vehicle_angular_velocity", 326, 0),
                ("/vehicle_attitude", 131, 0),
                ("/vehicle_imu", 13, 0),
                ("/vehicle_imu/1", 13, 0),
            ],
        ),
        (
            "real/husky_ros1_lz4",
            &[
                ("/husky_velocity_controller/odom", 3952, 0),
                ("/imu/data", 11_865, 0),
            ],
        ),
        ("real/xio_fusion_ros2_lz4", &[("/imu", 13_514, 0)]),
        (
            "real/xio_gait_short_walk_protobuf_batch",
            &[("/imu", 16_539, 0)],
        ),
        (
            "real/broad07_60s_ros2_zstd",
            &[("/imu", 17_143, 0), ("/reference/orientation", 17_143, 0)],
        ),
        (
            "native/mcap_explorer_demo_json_imu",
            &[("/imu/front", 150, 0)],
        ),
        (
            "native/rosbag2parquet_array_msgs",
            &[("/one_shot/imu", 1, 0)],
        ),
        ("native/tiryoh_test_sample_truncated", &[]),
        ("native/rosbag2_wrong_format", &[]),
        ("hostile/01_no_summary", &[("/imu", 953, 0)]),
        ("hostile/06_big_endian_cdr", &[("/imu", 953, 0)]),
        ("hostile/07_zero_header_stamps", &[("/imu", 953, 0)]),
        ("hostile/08_duplicate_stamps", &[("/imu", 953, 0)]),
        ("hostile/09_gap_2s", &[("/imu", 853, 0)]),
        ("hostile/10_nan_inf", &[("/imu", 953, 0)]),
        (
            "hostile/13_two_imu_topics",
            &[("/imu", 953, 0), ("/imu2", 953, 0)],
        ),
        ("hostile/16_short_and_empty_payloads", &[("/imu", 950, 3)]),
        ("hostile/25_header_only", &[]),
    ];
    for (file, topics) in expected {
        let Some(found) = all(&format!("logs/{file}.mcap")) else {
            return;
        };
        let found: Vec<_> = found
            .iter()
            .map(|(t, (s, bad, _))| (t.as_str(), s.len(), *bad))
            .collect();
        assert_eq!(&found, topics, "{file}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_variants_of_one_log_hold_the_same_numbers() {
    let read = |name: &str| Some(all(&format!("logs/{name}.mcap"))?.remove("/imu")?.0);
    let Some(plain) = read("real/xsens_mti_ros2_none") else {
        return;
    };
    let same = |a: &RawSample, b: &RawSample| {
        (a.gyro, a.accel, a.orientation) == (b.gyro, b.accel, b.orientation)
    };
    let big = read("hostile/06_big_endian_cdr").unwrap();
    assert!(
        plain
            .iter()
            .zip(&big)
            .all(|(a, b)| same(a, b) && a.header == b.header)
    );
    let zero = read("hostile/07_zero_header_stamps").unwrap();
    assert!(
        plain
            .iter()
            .zip(&zero)
            .all(|(a, b)| same(a, b) && b.header == Some(Nanos(0)))
    );
    let odd = read("hostile/10_nan_inf").unwrap();
    let bad = odd
        .iter()
        .filter(|s| s.gyro.is_none_or(|g| g.iter().any(|v| !v.is_finite())));
    assert!(
        bad.count() >= 1,
        "NaN passes the decoder; conditioning counts it"
    );
    let duplicates = read("hostile/08_duplicate_stamps").unwrap();
    let pairs = duplicates
        .windows(2)
        .filter(|w| w[0].header == w[1].header)
        .count();
    assert_eq!(pairs, 136, "logs/README.md");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn recorded_rates_are_plausible_and_stamps_lie_near_the_recorders_clock() {
    for (name, topic, rate_below) in [
        // The largest rate of each, by mcap-ros2-support, mcap-ros1-support and json: 12.33, 4.61,
        // 0.651, 6.38, 25.2 rad/s. Bytes read in the wrong place give 1e-300 or 1e+300.
        ("ximu3_ros2_zstd", "/imu", 12.4),
        ("xsens_mti_ros2_none", "/imu", 4.7),
        ("husky_ros1_lz4", "/imu/data", 0.66),
        ("xio_fusion_ros2_lz4", "/imu", 6.4),
        ("broad07_60s_ros2_zstd", "/imu", 25.3),
    ] {
        let Some(mut topics) = all(&format!("logs/real/{name}.mcap")) else {
            return;
        };
        let samples = topics.remove(topic).unwrap().0;
        let rates = samples.iter().filter_map(|s| s.gyro).flatten();
        let top = rates.fold(0.0_f64, |top, v| top.max(v.abs()));
        assert!(top < rate_below && top > 0.97 * rate_below, "{name}: {top}");
        let off = samples
            .iter()
            .map(|s| s.log.since(s.header.unwrap()).abs())
            .max();
        assert!(
            off.unwrap() < 1_000_000_000,
            "{name}: {off:?} ns between stamp and log time"
        );
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_imu_topic_of_every_recording_is_the_best_ranked_one() {
    for (file, expected) in [
        ("real/broad07_60s_ros2_zstd", vec!["/imu"]),
        ("real/px4_fmuv6c_json_zstd", vec!["/sensor_combined"]),
        ("real/husky_ros1_lz4", vec!["/imu/data"]),
        ("real/xio_gait_short_walk_protobuf_batch", vec!["/imu"]),
        ("native/rosbags_rs_all_types", vec!["/test/sensor_msgs/imu"]),
        ("native/rosbag2parquet_array_msgs", vec!["/one_shot/imu"]),
        ("native/mcap_explorer_demo_json_imu", vec!["/imu/front"]),
        ("native/rosbag2_wrong_format", vec![]),
        ("native/tiryoh_test_sample_truncated", vec![]),
        ("hostile/13_two_imu_topics", vec!["/imu", "/imu2"]),
    ] {
        let Some(messages) = messages(&format!("logs/{file}.mcap")) else {
            return;
        };
        let mut first = BTreeMap::new();
        for (payload, owned) in &messages {
            first.entry(owned.topic.clone()).or_insert((payload, owned));
        }
        let roles: Vec<_> = first
            .iter()
            .map(|(topic, (payload, owned))| {
                (
                    topic.as_str(),
                    role(&owned.channel(), Some((payload.as_slice(), owned.log))),
                )
            })
            .filter(|(_, role)| role.is_automatic())
            .collect();
        let best = roles.iter().map(|(_, r)| r.rank).min();
        let chosen: Vec<_> = roles
            .iter()
            .filter(|(_, r)| Some(r.rank) == best)
            .map(|(t, _)| *t)
            .collect();
        assert_eq!(chosen, expected, "{file}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_channel_that_can_not_be_decoded_is_refused_by_topic_type_and_encoding() {
    let Some(messages) = messages("logs/native/rosbag2_wrong_format.mcap") else {
        return;
    };
    let error = Decoder::compile(&messages[0].1.channel(), &Options::default())
        .unwrap_err()
        .to_string();
    for part in [
        "/test_topic",
        "test_msgs/msg/BasicTypes",
        "wrong_format",
        "topic",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn layouts_built_in_equal_the_schema_texts_of_recordings() {
    let Some(messages) = messages("logs/native/rosbags_rs_all_types.mcap") else {
        return;
    };
    let mut compared = 0;
    for (payload, owned) in &messages {
        let empty = Channel {
            schema_data: b"",
            ..owned.channel()
        };
        let Ok(builtin) = Decoder::compile(&empty, &Options::default()) else {
            continue;
        };
        let text = Decoder::compile(&owned.channel(), &Options::default()).unwrap();
        let read = |decoder: &Decoder| {
            let mut out = Vec::new();
            decoder
                .decode(payload, owned.log, owned.log, &mut out)
                .unwrap();
            out
        };
        assert_eq!(read(&builtin), read(&text), "{}", owned.topic);
        compared += 1;
    }
    // Two messages each of Imu, Vector3Stamped, TwistStamped, TwistWithCovarianceStamped,
    // QuaternionStamped, PoseStamped, PoseWithCovarianceStamped, TransformStamped, Odometry, TFMessage,
    // and of the parts Pose, Twist, PoseWithCovariance, TwistWithCovariance, Transform.
    assert_eq!(compared, 30);
}
