//! The command that `info` says to run next, and what findings say to do, hold for the log they are about.

use super::{flags, found, notes};
use crate::made_logs::{ImuSample, motion, written};
use crate::program::strapd;
use crate::shared_data::shared;
use std::path::Path;

fn next(log: &Path) -> String {
    let dir = log.parent().unwrap();
    let said = strapd(dir, &format!("info {}", log.display())).out;
    let line = said.lines().find(|line| line.starts_with("next"));
    line.unwrap_or_else(|| unreachable!("{said}")).to_owned()
}

fn moving(orientation: impl Fn(&ImuSample) -> Option<[f64; 4]>) -> Vec<ImuSample> {
    let mut samples = motion(2000);
    for sample in &mut samples {
        sample.orientation = orientation(sample);
    }
    samples
}

#[test]
fn a_reference_is_named_where_there_is_one_and_nowhere_else() {
    let dir = tempfile::tempdir().unwrap();
    let turning = |s: &ImuSample| {
        let half = 1e-9 * (s.stamp % 1_000_000_000) as f64;
        Some([half.cos(), 0.0, 0.0, half.sin()])
    };
    let log = written(dir.path(), "turns.mcap", &moving(turning));
    assert!(next(&log).ends_with("--against-recorded"), "{}", next(&log));
    let log = written(dir.path(), "none.mcap", &moving(|_| None));
    assert!(!next(&log).contains("--against"), "{}", next(&log));
    // As drivers without an orientation fill it.
    let constant = moving(|_| Some([1.0, 0.0, 0.0, 0.0]));
    let log = written(dir.path(), "constant.mcap", &constant);
    assert!(!next(&log).contains("--against"), "{}", next(&log));
    let said = strapd(dir.path(), "info constant.mcap").out;
    assert!(said.contains("orientation: always the same"), "{said}");
    // On another topic.
    let simulated = strapd(dir.path(), "simulate random --duration 2 -o s.mcap");
    assert_eq!(simulated.code, Some(0));
    let log = dir.path().join("s.mcap");
    assert!(next(&log).ends_with("--against-recorded"), "{}", next(&log));
}

#[test]
fn jitter_asks_the_reference_only_where_there_is_one() {
    let dir = tempfile::tempdir().unwrap();
    let advice = |name: &str, orientation: Option<[f64; 4]>| {
        let mut samples = moving(|_| orientation);
        for (i, sample) in samples.iter_mut().enumerate() {
            sample.stamp += [0, 900_000, -900_000, 400_000, -200_000][i % 5];
        }
        if let (Some(last), Some(_)) = (samples.last_mut(), orientation) {
            last.orientation = Some([0.0, 1.0, 0.0, 0.0]);
        }
        let found = found(&written(dir.path(), name, &samples));
        let jitter = found.iter().find(|f| f.code == "jitter");
        jitter.unwrap_or_else(|| unreachable!("{found:#?}")).line()
    };
    let without = advice("without.mcap", None);
    assert!(!without.contains("they cannot tell"), "{without}");
    let with = advice("with.mcap", Some([1.0, 0.0, 0.0, 0.0]));
    assert!(with.contains("they cannot tell"), "{with}");
}

#[test]
fn a_sensor_on_its_side_is_told_the_mounting_that_makes_it_level() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = moving(|_| None);
    for (i, sample) in samples.iter_mut().enumerate() {
        // A rest of two seconds, up along +y but for 3 degrees.
        let (sin, cos) = 3_f64.to_radians().sin_cos();
        if i < samples_of_rest() {
            sample.gyro = [0.0; 3];
        }
        sample.accel = [0.0, 9.80665 * cos, 9.80665 * sin];
    }
    let log = written(dir.path(), "side.mcap", &samples);
    let found = found(&log);
    let side = found.iter().find(|f| f.code == "mounted-on-side");
    let help = flags(side.unwrap_or_else(|| unreachable!("{found:#?}")));
    let mount = help.split(", or ").next().unwrap();
    // Half of 87 degrees about x.
    let (sin, cos) = 43.5_f64.to_radians().sin_cos();
    assert_eq!(mount, format!("--mount q={cos:.6},{sin:.6},0.000000,0"));
    let ran = strapd(
        dir.path(),
        &format!("replay side.mcap {mount} --init gravity -o - -q"),
    );
    let first: serde_json::Value = serde_json::from_str(ran.out.lines().next().unwrap()).unwrap();
    for axis in ["x", "y"] {
        assert!(first["q"][axis].as_f64().unwrap().abs() < 1e-5, "{first}");
    }
}

fn samples_of_rest() -> usize {
    1200
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_heading_that_drifts_far_is_said_though_sigma_allows_it() {
    let Some(path) = shared("logs/real/husky_ros1_lz4.mcap") else {
        return;
    };
    let found = found(&path);
    let drift = found.iter().find(|f| f.code == "heading-drift").unwrap();
    assert!(drift.what.contains("22 deg (rms)"), "{drift:?}");
    assert!(notes(&found).contains(&"mounted-on-side"));
}
