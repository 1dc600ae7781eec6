//! The recordings of `../shared/logs/real`: each replays into every format, and the gyro alone comes
//! as close to the recorded orientation as the table there says it can.

use crate::replays::{
    Bits, assert_rotations, csv, done, mcap, ndjson, only, replay_of, replay_with, target,
};
use crate::shared_data::shared;
use std::path::Path;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::record::{SampleKind, Verdict};

/// File, samples in it, samples used, where the attitude goes.
const REAL: [(&str, u64, u64, &str); 7] = [
    ("broad07_60s_ros2_zstd", 17143, 17143, "/imu/attitude"),
    ("husky_ros1_lz4", 11865, 11865, "/imu/data/attitude"),
    (
        "px4_fmuv6c_json_zstd",
        1297,
        1297,
        "/sensor_combined/attitude",
    ),
    ("ximu3_ros2_zstd", 500, 500, "/imu/attitude"),
    ("xio_fusion_ros2_lz4", 13514, 13514, "/imu/attitude"),
    // 205 samples carry the stamp and the data of their predecessor.
    (
        "xio_gait_short_walk_protobuf_batch",
        16539,
        16334,
        "/imu/attitude",
    ),
    ("xsens_mti_ros2_none", 953, 953, "/imu/attitude"),
];

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_recording_replays_into_every_format_with_the_same_attitudes_in_each() {
    for (name, total, used, topic) in REAL {
        let Some(path) = shared(&format!("logs/real/{name}.mcap")) else {
            return;
        };
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        let mut replay = replay_of(&path);
        replay.targets = ["a.mcap", "a.ndjson", "a.csv"]
            .map(|name| target(&file(name)))
            .to_vec();
        let summary = done(&replay).unwrap();
        assert!(!summary.is_lossy(), "{name}: {summary:?}");
        let of_topic = only(&summary);
        assert_eq!(of_topic.counts.total(), total, "{name}");
        assert_eq!(of_topic.counts.used(), used, "{name}");
        assert_eq!(of_topic.written, used, "{name}");
        assert_eq!(
            of_topic.counts.get(Verdict::Repeated),
            total - used,
            "{name}"
        );

        let lines = ndjson(&std::fs::read_to_string(file("a.ndjson")).unwrap());
        assert_eq!(lines.len() as u64, used, "{name}");
        assert_rotations(&lines, name);
        let rows = csv(&std::fs::read_to_string(file("a.csv")).unwrap());
        assert_eq!(rows, lines, "{name}");
        let messages = mcap(&std::fs::read(file("a.mcap")).unwrap(), topic);
        assert_eq!(messages, lines, "{name}");
        assert!(
            lines.windows(2).all(|pair| pair[0].stamp < pair[1].stamp),
            "{name}: stamps ascend"
        );
        assert_sign_continuous(&lines, name);
    }
}

/// dot(q_k, q_k-1) >= 0: a reader may interpolate without looking at signs.
fn assert_sign_continuous(attitudes: &[Bits], what: &str) {
    for pair in attitudes.windows(2) {
        let (a, b) = (pair[0].numbers(), pair[1].numbers());
        let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        assert!(dot >= 0.0, "{what}: {pair:?}");
    }
}

/// Median of the error of the rotation over 1 s, deg, for "rate", "average", "held".
fn against(path: &Path, plan: EstimationSettings) -> [f64; 3] {
    let mut replay = replay_with(path, plan);
    replay.against = Some(String::new());
    let summary = done(&replay).unwrap();
    let rows = &only(&summary).against;
    ["rate", "average", "held"].map(|kind| {
        rows.iter()
            .find(|row| row.kind == kind)
            .unwrap_or_else(|| panic!("{kind} is missing: {rows:?}"))
            .median_deg
    })
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn gyro_alone_meets_the_gates_with_samples_taken_as_means() {
    // The gates of issue 2: the table's figures and 0.3 to 1 % of room, for the table was computed
    // with a first-order step where this integrates to higher order.
    for (name, gate) in [
        ("broad07_60s_ros2_zstd", 0.93),
        ("ximu3_ros2_zstd", 0.87),
        ("xsens_mti_ros2_none", 1.40),
        ("husky_ros1_lz4", 0.44),
    ] {
        let Some(path) = shared(&format!("logs/real/{name}.mcap")) else {
            return;
        };
        let plan = EstimationSettings {
            kind: Some(SampleKind::Average),
            ..EstimationSettings::default()
        };
        let [rate, average, held] = against(&path, plan);
        eprintln!("{name}: rate {rate:.4}  average {average:.4}  held {held:.4} deg");
        assert!(average <= gate, "{name}: {average} deg, gate {gate}");
        // A metric that is broken towards zero must not pass: nobody has bettered these by half.
        assert!(average >= 0.5 * gate, "{name}: {average} deg, gate {gate}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_other_meanings_of_a_sample_give_the_table_of_the_recordings() {
    // `logs/README.md`: instantaneous (trapezoid + a x b h^2/12), held. 3 % is the room the issue
    // gives: the table has three digits, and its medians are of nearest, not interpolated, samples.
    let two_points = EstimationSettings {
        method: Method::Magnus {
            window: 2,
            order: Order::M4,
            placement: Placement::Centred,
        },
        ..EstimationSettings::default()
    };
    for (name, rate_table, held_table) in [
        ("broad07_60s_ros2_zstd", 1.469, 2.031),
        ("ximu3_ros2_zstd", 3.30, 5.70),
        ("xsens_mti_ros2_none", 1.501, 1.828),
        ("husky_ros1_lz4", 0.438, 0.451),
    ] {
        let Some(path) = shared(&format!("logs/real/{name}.mcap")) else {
            return;
        };
        let [rate, _, held] = against(&path, two_points.clone());
        for (kind, found, table) in [("rate", rate, rate_table), ("held", held, held_table)] {
            assert!(
                (found / table - 1.0).abs() <= 0.03,
                "{name} {kind}: {found} deg, table {table}"
            );
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_recorded_orientation_on_a_topic_of_its_own_can_be_named() {
    let Some(path) = shared("logs/real/ximu3_ros2_zstd.mcap") else {
        return;
    };
    let mut replay = replay_of(&path);
    replay.against = Some(String::new());
    let found = done(&replay).unwrap();
    replay.against = Some("/reference/orientation".to_owned());
    let named = done(&replay).unwrap();
    let medians = |summary| only(summary).against.iter().map(|r| r.median_deg).collect();
    let found: Vec<f64> = medians(&found);
    assert_eq!(found.len(), 4);
    assert_eq!(found, medians(&named));
    replay.against = Some("/nowhere".to_owned());
    let error = done(&replay).unwrap_err().to_string();
    assert!(error.contains("no topic `/nowhere`"), "{error}");
    assert!(error.contains("/reference/orientation"), "{error}");
}
