//! `../shared/logs/hostile` and `native`: each row of the table there gives what it says. Fixtures:
//! each fault of `faults.mcap` gets the verdict its page promises.

use super::cuts::whole_records;
use crate::replays::{assert_rotations, attitudes, done, fixture, only, replay_of};
use crate::shared_data::shared;
use std::time::{Duration, Instant};
use strapd::error::Error;
use strapd::report::summary::{RunSummary, TopicSummary};
use strapd_attitude::record::Verdict;

fn hostile(name: &str) -> Option<RunSummary> {
    let path = shared(&format!("logs/hostile/{name}.mcap"))?;
    let dir = tempfile::tempdir().unwrap();
    let (summary, attitudes) = attitudes(&replay_of(&path), dir.path());
    assert_eq!(attitudes.len() as u64, only(&summary).written, "{name}");
    assert_rotations(&attitudes, name);
    Some(summary)
}

fn refused(folder: &str, name: &str) -> Option<Error> {
    let path = shared(&format!("logs/{folder}/{name}.mcap"))?;
    Some(done(&replay_of(&path)).unwrap_err())
}

/// Everything but these verdicts is `Accepted`.
fn assert_verdicts(topic: &TopicSummary, expected: &[(Verdict, u64)]) {
    for verdict in Verdict::ALL {
        let named = expected.iter().find(|(v, _)| *v == verdict);
        match named {
            Some((_, n)) => assert_eq!(topic.counts.get(verdict), *n, "{verdict:?}: {topic:?}"),
            None if verdict == Verdict::Accepted => {}
            None => assert_eq!(topic.counts.get(verdict), 0, "{verdict:?}: {topic:?}"),
        }
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_log_without_a_summary_section_gives_all_its_samples() {
    let Some(summary) = hostile("01_no_summary") else {
        return;
    };
    assert_verdicts(only(&summary), &[(Verdict::Accepted, 953)]);
    assert!(!summary.is_lossy());
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_log_cut_inside_a_chunk_gives_every_whole_chunk_and_says_so() {
    let Some(summary) = hostile("02_truncated_mid_chunk") else {
        return;
    };
    // Judged by the mcap crate, given the records that are whole.
    let path = shared("logs/hostile/02_truncated_mid_chunk.mcap").unwrap();
    let bytes = std::fs::read(path).unwrap();
    let end = whole_records(&bytes);
    let options = mcap::read::Options::IgnoreEndMagic.into();
    let whole = mcap::MessageStream::new_with_options(&bytes[..end], options)
        .unwrap()
        .take_while(Result::is_ok)
        .count();
    assert_verdicts(only(&summary), &[(Verdict::Accepted, whole as u64)]);
    assert!(whole > 300, "{whole}");
    assert!(summary.is_lossy());
    let said = summary.file_problems.join("; ");
    assert!(said.contains("the file is cut"), "{said}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn big_endian_cdr_gives_what_little_endian_gives() {
    let Some(summary) = hostile("06_big_endian_cdr") else {
        return;
    };
    assert_verdicts(only(&summary), &[(Verdict::Accepted, 953)]);
    let plain = shared("logs/real/xsens_mti_ros2_none.mcap").unwrap();
    let plain = done(&replay_of(&plain)).unwrap();
    assert_eq!(only(&summary).final_wxyz, only(&plain).final_wxyz);
    assert!(!summary.is_lossy());
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn zero_header_stamps_fall_back_to_log_time_and_that_is_said() {
    let Some(summary) = hostile("07_zero_header_stamps") else {
        return;
    };
    let topic = only(&summary);
    assert_verdicts(topic, &[(Verdict::Accepted, 953)]);
    assert_eq!(topic.clock, "log");
    let said = topic.warnings().join("; ");
    assert!(said.contains("header stamps are 0"), "{said}");
    assert!(said.contains("time log"), "{said}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn pairs_with_the_same_stamp_are_counted_and_none_is_divided_by() {
    let Some(summary) = hostile("08_duplicate_stamps") else {
        return;
    };
    let topic = only(&summary);
    // 136 pairs, each followed by a double step: the second of each finds room in it.
    assert_verdicts(
        topic,
        &[(Verdict::Restamped, 136), (Verdict::Accepted, 817)],
    );
    assert!(
        topic
            .warnings()
            .iter()
            .any(|w| w.starts_with("136 samples shared their stamp")),
        "{:?}",
        topic.warnings()
    );
    assert!(!summary.is_lossy());
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_gap_of_two_seconds_is_held_measured_and_costs_certainty() {
    let Some(summary) = hostile("09_gap_2s") else {
        return;
    };
    let topic = only(&summary);
    assert_verdicts(topic, &[(Verdict::Accepted, 853)]);
    assert_eq!((topic.gaps.held, topic.gaps.bridged), (1, 0));
    // The stamps are whole multiples of 20 ms: 101 steps, exactly, in nanoseconds, and the sample behind them is the mean
    // of the last one.
    assert!(
        (topic.gaps.longest_secs - 2.0).abs() < 1e-9,
        "{:?}",
        topic.gaps
    );
    assert!(summary.is_lossy());
    // Whoever did not look for 2 s at a body turning a radian a second knows nothing to 10 degrees.
    assert!(topic.final_sigma[0].to_degrees() > 10.0, "{topic:?}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn nan_and_infinity_are_rejected_counted_and_leave_the_attitude_finite() {
    let Some(summary) = hostile("10_nan_inf") else {
        return;
    };
    let topic = only(&summary);
    assert_verdicts(topic, &[(Verdict::NotFinite, 5), (Verdict::Accepted, 948)]);
    assert!(summary.is_lossy());
    assert!(
        topic.first_losses[0].contains("sample 100 at 2.0"),
        "{topic:?}"
    );
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn two_imu_topics_are_refused_and_both_are_named_with_the_flag() {
    let Some(error) = refused("hostile", "13_two_imu_topics") else {
        return;
    };
    assert!(
        matches!(
            error,
            Error::Recording(strapd_recording::Error::SeveralImuTopics { .. })
        ),
        "{error:?}"
    );
    let said = error.to_string();
    for word in ["    /imu ", "    /imu2 ", "topic NAME takes one"] {
        assert!(said.contains(word), "{word} is missing: {said}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn payloads_that_are_too_short_are_counted_and_the_first_is_explained() {
    let Some(summary) = hostile("16_short_and_empty_payloads") else {
        return;
    };
    let topic = only(&summary);
    assert_verdicts(
        topic,
        &[(Verdict::Undecodable, 3), (Verdict::Accepted, 950)],
    );
    assert!(summary.is_lossy());
    let said = topic.first_losses.join("; ");
    assert!(
        said.contains("first undecodable") && said.contains("0 bytes, need 4"),
        "{said}"
    );
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_log_with_a_header_alone_has_no_imu_topic() {
    let Some(error) = refused("hostile", "25_header_only") else {
        return;
    };
    assert!(
        matches!(
            error,
            Error::Recording(strapd_recording::Error::NoImuTopic { .. })
        ),
        "{error:?}"
    );
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_log_that_hangs_the_mcap_crate_ends_at_once() {
    let begun = Instant::now();
    let Some(summary) = hostile("mcap-0.25.0-hang") else {
        return;
    };
    let took = begun.elapsed();
    eprintln!("the hang file ended after {took:?} (target 100 ms)");
    // Fifty times the target: a debug build on a machine shared by many. A hang takes forever.
    assert!(took < Duration::from_secs(5), "{took:?}");
    // Five chunks, two of them broken, leave 141 messages; their payloads are noise, not an Imu.
    assert_verdicts(only(&summary), &[(Verdict::Undecodable, 141)]);
    assert_eq!(only(&summary).counts.used(), 0);
    assert!(summary.is_lossy());
    let problems = summary.file_problems.join(" ");
    assert!(problems.contains("does not unpack"), "{problems}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn an_unknown_message_encoding_is_named_with_its_topic() {
    let Some(error) = refused("native", "rosbag2_wrong_format") else {
        return;
    };
    let said = error.to_string();
    assert!(
        said.contains("/test_topic") && said.contains("[wrong_format]"),
        "{said}"
    );
    let path = shared("logs/native/rosbag2_wrong_format.mcap").unwrap();
    let mut replay = replay_of(&path);
    replay.selection.topic = Some("/test_topic".to_owned());
    let said = done(&replay).unwrap_err().to_string();
    for word in ["/test_topic", "wrong_format", "test_msgs/msg/BasicTypes"] {
        assert!(said.contains(word), "{word} is missing: {said}");
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_only_imu_of_ninety_four_topics_is_found_and_the_other_rates_are_mentioned() {
    let Some(path) = shared("logs/native/rosbags_rs_all_types.mcap") else {
        return;
    };
    let summary = done(&replay_of(&path)).unwrap();
    let topic = only(&summary);
    assert_eq!(topic.topic, "/test/sensor_msgs/imu");
    assert_verdicts(topic, &[(Verdict::Accepted, 2)]);
    let said = topic.warnings().join("; ");
    assert!(said.contains("/test/geometry_msgs/twist_stamped"), "{said}");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn one_sample_with_a_zero_stamp_is_an_attitude() {
    let Some(path) = shared("logs/native/rosbag2parquet_array_msgs.mcap") else {
        return;
    };
    let summary = done(&replay_of(&path)).unwrap();
    assert_verdicts(only(&summary), &[(Verdict::Accepted, 1)]);
    assert_eq!(only(&summary).written, 1);
    assert_eq!(only(&summary).final_wxyz, [1.0, 0.0, 0.0, 0.0]);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn json_messages_with_an_empty_schema_are_read() {
    let Some(path) = shared("logs/native/mcap_explorer_demo_json_imu.mcap") else {
        return;
    };
    let summary = done(&replay_of(&path)).unwrap();
    assert_verdicts(only(&summary), &[(Verdict::Accepted, 150)]);
    assert!(!summary.is_lossy());
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_cut_log_without_an_imu_says_both() {
    let Some(error) = refused("native", "tiryoh_test_sample_truncated") else {
        return;
    };
    let said = error.to_string();
    assert!(said.contains("/rosout"), "{said}");
    assert!(said.contains("the file is cut"), "{said}");
}

#[test]
fn each_fault_of_the_fixture_gets_its_verdict_and_the_truth_is_met() {
    let dir = tempfile::tempdir().unwrap();
    let (summary, attitudes) = attitudes(&replay_of(&fixture("faults.mcap")), dir.path());
    let topic = only(&summary);
    assert_verdicts(
        topic,
        &[
            (Verdict::NotFinite, 2),
            (Verdict::Huge, 1),
            (Verdict::Repeated, 1),
            (Verdict::DuplicateStamp, 1),
            (Verdict::Reordered, 1),
            (Verdict::Late, 1),
            (Verdict::Undecodable, 1),
            (Verdict::NoGyro, 1),
            (Verdict::NoStamp, 1),
            (Verdict::Accepted, 592),
        ],
    );
    assert_eq!(topic.gaps.held, 1);
    // 101 steps of 10 ms; the sample behind them is the mean of the last one.
    assert!((topic.gaps.longest_secs - 1.0).abs() < 1e-9);
    assert_rotations(&attitudes, "faults.mcap");
    // A quarter turn a second about (2, -1, 2)/3: up to the gap at 2.99 s the attitude is exact
    // whatever was left out, for the rate is constant. 1e-9 rad is far above rounding (1e-15 a
    // step) and far below one lost step (1.6e-2 rad).
    for a in attitudes
        .iter()
        .take_while(|a| a.stamp <= 1_700_000_002_990_000_000)
    {
        let secs = (a.stamp - 1_700_000_000_000_000_000) as f64 * 1e-9;
        // The duplicate at 2.5 s replaces nothing.
        let (s, c) = (secs * std::f64::consts::FRAC_PI_4).sin_cos();
        let truth = [c, s * 2.0 / 3.0, -s / 3.0, s * 2.0 / 3.0];
        let off = a
            .numbers()
            .iter()
            .zip(truth)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(off < 1e-9, "{secs} s: {:?}, truth {truth:?}", a.numbers());
    }
}
