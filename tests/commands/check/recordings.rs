//! The recordings of `../shared/logs`: all that their README describes is found, and nothing else.

use super::{codes, flags, found, notes};
use crate::replays::{done, only, replay_with};
use crate::shared_data::shared;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::record::SampleKind;

/// File, errors and warnings. The Xsens samples are averages (see `fixtures/README.md`), and taken for
/// that in every variant of that log.
const FINDINGS: [(&str, &[&str]); 24] = [
    ("real/broad07_60s_ros2_zstd", &[]),
    ("real/husky_ros1_lz4", &["heading-drift"]),
    // What is wrong with its other topics is noted.
    ("real/px4_fmuv6c_json_zstd", &[]),
    ("real/ximu3_ros2_zstd", &[]),
    ("real/xio_fusion_ros2_lz4", &["jitter", "missing"]),
    (
        "real/xio_gait_short_walk_protobuf_batch",
        &["missing", "repeats"],
    ),
    ("real/xsens_mti_ros2_none", &[]),
    (
        "native/mcap_explorer_demo_json_imu",
        &["orientation-constant"],
    ),
    ("native/rosbag2_wrong_format", &["no-imu-topic"]),
    ("native/rosbag2parquet_array_msgs", &["clock"]),
    ("native/rosbags_rs_all_types", &["orientation-constant"]),
    (
        "native/tiryoh_test_sample_truncated",
        &["file-damaged", "no-imu-topic"],
    ),
    ("hostile/01_no_summary", &[]),
    ("hostile/02_truncated_mid_chunk", &["file-damaged"]),
    ("hostile/06_big_endian_cdr", &[]),
    ("hostile/07_zero_header_stamps", &["clock"]),
    ("hostile/08_duplicate_stamps", &["shared-stamps"]),
    ("hostile/09_gap_2s", &["gap-held", "missing"]),
    ("hostile/10_nan_inf", &["not-finite"]),
    // The second topic has the forces of the first, and its rates with the other sign.
    ("hostile/13_two_imu_topics", &["gyro-axes"]),
    (
        "hostile/16_short_and_empty_payloads",
        &["missing", "undecodable"],
    ),
    ("hostile/25_header_only", &["no-imu-topic"]),
    (
        "hostile/mcap-0.25.0-hang",
        &["file-damaged", "nothing-used", "undecodable"],
    ),
    ("hostile/01_no_summary", &[]),
];

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn what_is_known_of_each_recording_is_found_and_nothing_else() {
    for (name, expected) in FINDINGS {
        let Some(path) = shared(&format!("logs/{name}.mcap")) else {
            return;
        };
        let found = found(&path);
        assert_eq!(codes(&found), expected, "{name}: {found:#?}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn choices_are_noted() {
    for (name, note) in [
        ("real/husky_ros1_lz4", "mounted-on-side"),
        ("real/px4_fmuv6c_json_zstd", "refused"),
        ("real/xio_fusion_ros2_lz4", "sample-kind-unknown"),
        ("hostile/13_two_imu_topics", "several-topics"),
    ] {
        let Some(path) = shared(&format!("logs/{name}.mcap")) else {
            return;
        };
        let found = found(&path);
        assert!(notes(&found).contains(&note), "{name}: {found:#?}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn evidence_is_the_numbers_of_the_recording() {
    let Some(path) = shared("logs/hostile/09_gap_2s.mcap") else {
        return;
    };
    let found = found(&path);
    let gap = found.iter().find(|f| f.code == "gap-held").unwrap();
    let longest = gap.evidence["longest_s"].as_f64().unwrap();
    // 101 steps of 20 ms lie between two stamps; the sample behind them is the mean of the last one.
    assert!((longest - 2.0).abs() < 1e-9, "{gap:?}");
    assert_eq!(flags(gap), "--on-gap bridge --max-gap 2.0");
}

/// x-IMU3 and BROAD: taken as they are by default, the gyro is closer to the recorded orientation than as rates. PX4,
/// whose format states rates: so is the advice.
#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_default_and_the_advice_on_the_meaning_of_a_sample_reduce_the_error() {
    for (name, topic, is_advised, at_most) in [
        ("ximu3_ros2_zstd", "/imu", false, 0.4),
        ("broad07_60s_ros2_zstd", "/imu", false, 0.7),
        (
            "px4_fmuv6c_json_zstd",
            "/vehicle_angular_velocity",
            true,
            0.95,
        ),
    ] {
        let Some(path) = shared(&format!("logs/real/{name}.mcap")) else {
            return;
        };
        let found = found(&path);
        let advice = found
            .iter()
            .find(|f| f.code == "sample-kind" && f.topic == topic);
        assert_eq!(advice.is_some(), is_advised, "{name}: {advice:?}");
        if let Some(advice) = advice {
            assert_eq!(flags(advice), "--sample-kind average", "{name}");
        }
        let median = |kind: Option<SampleKind>| {
            let mut replay = replay_with(
                &path,
                EstimationSettings {
                    kind,
                    ..EstimationSettings::default()
                },
            );
            replay.selection.topic = Some(topic.to_owned());
            replay.against = Some(String::new());
            let summary = done(&replay).unwrap();
            let topic = only(&summary);
            let used = topic.kind.name();
            let row = topic.against.iter().find(|r| r.kind == used).unwrap();
            row.median_deg
        };
        let better = match is_advised {
            true => Some(SampleKind::Average),
            false => None,
        };
        let (before, after) = (median(Some(SampleKind::Rate)), median(better));
        assert!(after < at_most * before, "{name}: {before} to {after} deg");
    }
}
