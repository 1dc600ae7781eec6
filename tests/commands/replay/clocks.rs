//! Stamps: only their differences count, whichever clock they are read from.

use crate::made_logs::{ImuSample, PACKINGS, START, STEP, TOPIC, bytes, logged, motion, written};
use crate::replays::{attitudes, done, only, replay_of, replay_with};
use strapd::error::Error;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::record::{SampleKind, Verdict};

fn shifted(samples: &[ImuSample], by: i64) -> Vec<ImuSample> {
    samples
        .iter()
        .map(|s| ImuSample {
            stamp: s.stamp + by,
            ..*s
        })
        .collect()
}

/// Uneven stamps, so that a stamp turned into f64 seconds anywhere would show: one step of an f64
/// at 1.7e9 s is 2.4e-7 s.
fn uneven(n: usize) -> Vec<ImuSample> {
    let mut samples = motion(n);
    for (k, sample) in samples.iter_mut().enumerate() {
        sample.stamp = 1_000_000_000 + k as i64 * STEP + (k as i64 * 7_654_321) % 3_000_001;
    }
    samples
}

#[test]
fn a_shift_of_every_stamp_by_54_years_changes_no_bit_of_any_attitude() {
    let dir = tempfile::tempdir().unwrap();
    let near = uneven(300);
    // The shift of the issue; one before it and one that is not whole seconds. ROS stamps hold
    // seconds in 31 bits: 1.7e18 ns is where today is.
    let far = [
        1_700_000_000_000_000_000,
        1_700_000_000_000_000_001,
        777_777_777,
    ];
    let early = written(dir.path(), "early.mcap", &near);
    for (kind, method) in [
        (None, Method::Auto),
        (Some(SampleKind::Average), Method::Auto),
        (None, Method::DcmLeft),
        (
            Some(SampleKind::Rate),
            Method::Magnus {
                window: 4,
                order: Order::M6,
                placement: Placement::Causal,
            },
        ),
    ] {
        let plan = EstimationSettings {
            kind,
            method,
            ..EstimationSettings::default()
        };
        let (_, expected) = attitudes(&replay_with(&early, plan.clone()), dir.path());
        assert_eq!(expected.len(), 300);
        for shift in far {
            let late = written(dir.path(), "late.mcap", &shifted(&near, shift));
            let (_, found) = attitudes(&replay_with(&late, plan.clone()), dir.path());
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(&expected) {
                assert_eq!(found.stamp - expected.stamp, shift);
                assert_eq!(found.wxyz, expected.wxyz, "{method:?}, shift {shift}");
            }
        }
    }
}

#[test]
fn stamps_that_are_zero_in_both_clocks_are_refused_with_the_flag_that_helps() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(100);
    for sample in &mut samples {
        sample.stamp = 0;
    }
    let mut messages = logged(TOPIC, &samples);
    for message in &mut messages {
        message.log_time = 0;
    }
    let path = dir.path().join("zero.mcap");
    std::fs::write(&path, bytes(PACKINGS[2].1, 4096, &messages)).unwrap();
    let error = done(&replay_of(&path)).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Recording(strapd_recording::Error::Topic { .. })
        ),
        "{error:?}"
    );
    let said = error.to_string();
    for word in [TOPIC, "stamps", "time index rate_hz"] {
        assert!(said.contains(word), "{word} is missing: {said}");
    }

    // And the flag does help: the attitudes are those of even stamps.
    let plan = EstimationSettings {
        clock: Clock::Index { rate_hz: 100.0 },
        ..EstimationSettings::default()
    };
    let (summary, by_index) = attitudes(&replay_with(&path, plan), dir.path());
    assert_eq!(only(&summary).counts.used(), 100);
    let stamped = written(dir.path(), "stamped.mcap", &motion(100));
    let (_, by_stamp) = attitudes(&replay_of(&stamped), dir.path());
    let bits = |a: &[crate::replays::Bits]| a.iter().map(|a| a.wxyz).collect::<Vec<_>>();
    assert_eq!(bits(&by_index), bits(&by_stamp));
}

#[test]
fn log_time_and_header_stamp_give_the_same_where_they_agree_but_for_an_offset() {
    let dir = tempfile::tempdir().unwrap();
    let samples = motion(200);
    let mut messages = logged(TOPIC, &samples);
    for message in &mut messages {
        message.log_time += 123_456_789;
    }
    let path = dir.path().join("offset.mcap");
    std::fs::write(&path, bytes(PACKINGS[1].1, 4096, &messages)).unwrap();
    let (_, by_header) = attitudes(&replay_of(&path), dir.path());
    let plan = EstimationSettings {
        clock: Clock::Log,
        ..EstimationSettings::default()
    };
    let (summary, by_log) = attitudes(&replay_with(&path, plan), dir.path());
    assert_eq!(only(&summary).clock, "log");
    for (a, b) in by_header.iter().zip(&by_log) {
        assert_eq!(b.stamp - a.stamp, 123_456_789);
        assert_eq!(a.wxyz, b.wxyz);
    }
}

#[test]
fn start_and_until_take_the_samples_between_and_count_the_others_as_trimmed() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &motion(500));
    let plan = EstimationSettings {
        start: Some(1.0),
        until: Some(3.0),
        ..EstimationSettings::default()
    };
    let (summary, found) = attitudes(&replay_with(&path, plan), dir.path());
    let topic = only(&summary);
    // 100 Hz: stamps 1.00 to 3.00 s, both ends included.
    assert_eq!(topic.counts.used(), 201);
    assert_eq!(topic.counts.get(Verdict::Trimmed), 299);
    assert!(!summary.is_lossy(), "what was asked for is not lost");
    assert_eq!(found.first().unwrap().stamp, START + 1_000_000_000);
    assert_eq!(found.last().unwrap().stamp, START + 3_000_000_000);
    assert_eq!(
        found[0].numbers(),
        [1.0, 0.0, 0.0, 0.0],
        "starts where it starts"
    );
}

#[test]
fn a_start_beyond_the_end_leaves_nothing_and_that_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &motion(100));
    let plan = EstimationSettings {
        start: Some(60.0),
        ..EstimationSettings::default()
    };
    let said = done(&replay_with(&path, plan)).unwrap_err().to_string();
    assert!(said.contains("start 60: none of the 100 samples"), "{said}");
    assert!(said.contains("lies in that window"), "{said}");
}

#[test]
fn every_order_of_the_messages_gives_the_same_attitudes() {
    // Swaps of neighbours, in the file and in log time: within the reorder window nothing is late.
    let dir = tempfile::tempdir().unwrap();
    let samples = motion(200);
    let in_order = written(dir.path(), "in_order.mcap", &samples);
    let (_, expected) = attitudes(&replay_of(&in_order), dir.path());
    let mut swapped = samples.clone();
    for pair in swapped.chunks_exact_mut(5) {
        pair.swap(1, 3);
    }
    // Received in the order in which they now stand.
    let mut messages = logged(TOPIC, &swapped);
    for (k, message) in messages.iter_mut().enumerate() {
        message.log_time = (START + k as i64 * STEP) as u64;
    }
    let path = dir.path().join("swapped.mcap");
    std::fs::write(&path, bytes(PACKINGS[2].1, 4096, &messages)).unwrap();
    let (summary, found) = attitudes(&replay_of(&path), dir.path());
    assert_eq!(only(&summary).counts.used(), 200, "{summary:?}");
    assert!(only(&summary).counts.get(Verdict::Reordered) >= 40);
    assert!(!summary.is_lossy());
    assert_eq!(found, expected);
}
