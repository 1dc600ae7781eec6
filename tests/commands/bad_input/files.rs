//! The same in files, from the command line down: short logs, settings that cannot be, and what is
//! said.

use crate::made_logs::{motion, written};
use crate::replays::{assert_rotations, attitudes, done, only, replay_with};
use strapd_attitude::estimate::EstimationSettings;
use strapd_attitude::propagate::{Method, Order, Placement};
use strapd_attitude::record::SampleKind;

fn plan(method: Method, kind: SampleKind) -> EstimationSettings {
    EstimationSettings {
        method,
        kind: Some(kind),
        ..EstimationSettings::default()
    }
}

#[test]
fn the_shortest_logs_give_an_attitude_for_each_sample_or_say_that_there_is_none() {
    let dir = tempfile::tempdir().unwrap();
    for n in [1, 2, 3, 5] {
        let path = written(dir.path(), "log.mcap", &motion(n));
        for kind in [
            SampleKind::Rate,
            SampleKind::Average,
            SampleKind::DeltaAngle,
        ] {
            for name in super::method_names() {
                let plan = EstimationSettings {
                    regularise_stamps: n == 5,
                    ..plan(super::method_named(name), kind)
                };
                let (summary, found) = attitudes(&replay_with(&path, plan), dir.path());
                assert_eq!(found.len(), n, "{name}, {kind:?}");
                assert_rotations(&found, name);
                assert!(!summary.text().contains("NaN"), "{}", summary.text());
                assert!(!summary.json().to_string().contains("NaN"));
            }
        }
    }
}

#[test]
fn a_topic_without_a_sample_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &[]);
    let said = done(&replay_with(&path, EstimationSettings::default()))
        .map_or_else(|e| e.to_string(), |s| s.text());
    assert!(
        said.contains("no sample") || said.contains("no IMU topic") || said.contains("no messages"),
        "{said}"
    );
}

#[test]
fn a_window_that_no_sample_kind_has_is_a_usage_error_and_one_of_this_log_names_the_topic() {
    for window in ["0", "25", "1000000"] {
        for method in ["magnus", "causal", "commit"] {
            assert_cmd::Command::new(env!("CARGO_BIN_EXE_strapd"))
                .args(["replay", "no.mcap", "--method", method, "--window", window])
                .assert()
                .code(2)
                .stderr(predicates::str::contains("--window takes"));
        }
    }
    // One increment is a window, one rate is none: only the log tells which it has.
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &motion(50));
    let one = Method::Magnus {
        window: 1,
        order: Order::M4,
        placement: Placement::Centred,
    };
    let unsaid = EstimationSettings {
        kind: None,
        ..plan(one, SampleKind::Rate)
    };
    let said = done(&replay_with(&path, unsaid)).unwrap_err().to_string();
    assert!(said.contains("window takes 2 to 24"), "{said}");
    assert!(done(&replay_with(&path, plan(one, SampleKind::Average))).is_ok());
}

#[test]
fn a_motion_too_fast_for_its_samples_is_warned_of() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(100);
    for s in &mut samples {
        s.gyro[2] = 400.0;
    }
    let path = written(dir.path(), "log.mcap", &samples);
    for name in super::method_names() {
        let plan = plan(super::method_named(name), SampleKind::Rate);
        let summary = done(&replay_with(&path, plan)).unwrap();
        let said = only(&summary).warnings().join("; ");
        assert!(
            said.contains("99 steps turn more than half a turn"),
            "{name}: {said}"
        );
    }
}
