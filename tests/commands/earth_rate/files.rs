//! `--earth-rate` end to end: what it needs, what it does to `--bias auto`, what it says.

use super::{LATITUDE, in_body, pose};
use crate::made_logs::{ImuSample, START, STEP, written};
use crate::replays::{attitudes, done, only, replay_with, target};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};
use strapd_attitude::estimate::{Bias, EstimationSettings, Initial};
use strapd_attitude::frames::{Body, In, Nav};
use strapd_attitude::quaternion::{BodyRate, Quaternion, YawPitchRoll};
use strapd_attitude::worlds::{Convention, World};

const BIAS: [f64; 3] = [0.003, -0.002, 0.001];

/// A body that stays in a pose (ENU, FLU) for 20 s, or moves in the first `moving` samples.
fn still(q_nb: &Quaternion<Nav, Body>, moving: usize) -> Vec<ImuSample> {
    let earth = in_body(q_nb, Convention::EnuFlu.earth_rate(LATITUDE));
    let g = in_body(q_nb, In::assume(Vector3::new(0.0, 0.0, 9.81)));
    (0..2000)
        .map(|k| {
            let shake = if k < moving {
                (10.0 * k as f64).sin()
            } else {
                0.0
            };
            ImuSample {
                stamp: START + k as i64 * STEP,
                orientation: Some(q_nb.wxyz()),
                gyro: std::array::from_fn(|i| BIAS[i] + earth[i] + shake),
                gyro_covariance_0: 0.0,
                accel: g.into(),
            }
        })
        .collect()
}

fn plan(world: World) -> EstimationSettings {
    EstimationSettings {
        world,
        initial: Initial::FirstOrientation,
        bias: Bias::Auto,
        latitude_deg: Some(LATITUDE.to_degrees()),
        ..EstimationSettings::default()
    }
}

fn log(dir: &Path, moving: usize) -> PathBuf {
    written(dir, "log.mcap", &still(&pose(), moving))
}

fn quaternion(numbers: [f64; 4]) -> Quaternion<Nav, Body> {
    Quaternion::assume_unit(numbers)
}

#[test]
fn a_bias_from_rest_does_not_swallow_the_earth() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), 0);
    for (world, convention) in [
        (World::Enu, Convention::EnuFlu),
        (World::Ned, Convention::NedFrd),
        (World::Nwu, Convention::NwuFlu),
    ] {
        let (summary, found) = attitudes(&replay_with(&path, plan(world)), dir.path());
        let topic = only(&summary);
        for (found, expected) in topic.bias.iter().zip(BIAS) {
            // Means of 100 equal numbers: rounding.
            assert!(
                (found - expected).abs() < 1e-14,
                "{world}: {:?}",
                topic.bias
            );
        }
        assert!(
            topic.bias_origin.contains("less the Earth's rate"),
            "{}",
            topic.bias_origin
        );
        let expected = Convention::EnuFlu.convert(convention, pose());
        for a in &found {
            let off = quaternion(a.numbers()).angle_to(&expected);
            assert!(off < 1e-12, "{world}: {off:.2e} rad");
        }
        assert!(topic.warnings().iter().all(|w| !w.contains("--earth-rate")));
    }
    // Without the flag the Earth is taken for bias, as it always was.
    let without = EstimationSettings {
        latitude_deg: None,
        ..plan(World::Enu)
    };
    let summary = done(&replay_with(&path, without)).unwrap();
    let earth = in_body(&pose(), Convention::EnuFlu.earth_rate(LATITUDE));
    for i in 0..3 {
        assert!((only(&summary).bias[i] - BIAS[i] - earth[i]).abs() < 1e-14);
    }
}

#[test]
fn a_bias_without_a_rest_at_the_start_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), 500);
    let said = done(&replay_with(&path, plan(World::Enu)))
        .unwrap_err()
        .to_string();
    assert!(said.contains("bias auto with earth_rate"), "{said}");
    assert!(
        said.contains("start SECS") && said.contains("bias x,y,z"),
        "{said}"
    );
    // Without the flag that rest does.
    let without = EstimationSettings {
        latitude_deg: None,
        ..plan(World::Enu)
    };
    assert!(done(&replay_with(&path, without)).is_ok());
}

#[test]
fn an_unknown_heading_is_warned_of_with_its_size() {
    let dir = tempfile::tempdir().unwrap();
    let level = Quaternion::from_yaw_pitch_roll(&YawPitchRoll {
        yaw: 1.0,
        pitch: 0.1,
        roll: -0.2,
    });
    let path = written(dir.path(), "log.mcap", &still(&level, 0));
    let plan = EstimationSettings {
        initial: Initial::Gravity,
        bias: Bias::Given(BodyRate(BIAS.into())),
        ..plan(World::Enu)
    };
    let (summary, found) = attitudes(&replay_with(&path, plan), dir.path());
    let said = only(&summary).warnings().join("; ");
    // 15.041 cos 48 = 10.064 deg/h: 1.75 of it for 10 degrees, 20.1 at most.
    assert!(said.contains("10 degrees leaves 1.8 deg/h"), "{said}");
    assert!(said.contains("at most 20.1"), "{said}");
    assert!(said.contains("init gravity knows no heading"), "{said}");
    // And so it is: the heading is off by 1 rad, and 2 * 10.064 sin(0.5) deg/h are left over 20 s.
    let (first, last) = (found[0].numbers(), found[1999].numbers());
    let turned = quaternion(first).angle_to(&quaternion(last)).to_degrees();
    let expected = 2.0 * 10.064 * 0.5_f64.sin() * 19.99 / 3600.0;
    assert!(
        (turned / expected - 1.0).abs() < 1e-3,
        "{turned} {expected}"
    );
}

#[test]
fn what_can_not_be_is_refused_before_anything_is_read() {
    let refused = |plan: EstimationSettings| plan.check().unwrap_err().to_string();
    let said = refused(plan(World::Start));
    for flag in [
        "earth_rate",
        "world enu",
        "init first-orientation",
        "rpy=roll,pitch,yaw",
    ] {
        assert!(said.contains(flag), "{said}");
    }
    for latitude in [90.1, -91.0, f64::NAN, f64::INFINITY] {
        let said = refused(EstimationSettings {
            latitude_deg: Some(latitude),
            ..plan(World::Ned)
        });
        assert!(said.contains("between -90 and 90"), "{said}");
    }
    for latitude in [-90.0, 0.0, 90.0] {
        let plan = EstimationSettings {
            latitude_deg: Some(latitude),
            ..plan(World::Ned)
        };
        assert!(plan.check().is_ok());
    }
    assert_cmd::Command::new(env!("CARGO_BIN_EXE_strapd"))
        .args(["replay", "no.mcap", "--earth-rate", "-33.9"])
        .assert()
        .code(2)
        .stderr(predicates::str::contains("--world start"));
}

#[test]
fn summary_and_metadata_state_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), 0);
    let out = dir.path().join("out.mcap");
    let mut replay = replay_with(&path, plan(World::Enu));
    replay.plan.latitude_deg = Some(48.0);
    replay.targets = vec![target(&out)];
    let summary = done(&replay).unwrap();
    assert!(
        summary
            .text()
            .contains("rotation taken out for latitude 48 deg"),
        "{}",
        summary.text()
    );
    assert_eq!(
        summary.json()["topics"][0]["earth_rate"]["latitude_deg"],
        48.0
    );
    let bytes = std::fs::read(&out).unwrap();
    let index = mcap::Summary::read(&bytes)
        .unwrap()
        .unwrap()
        .metadata_indexes;
    let at = index.iter().find(|m| m.name == "strapd").unwrap();
    let metadata = mcap::read::metadata(&bytes, at).unwrap().metadata;
    assert!(
        metadata["earth_rate"].contains("latitude 48 deg"),
        "{metadata:?}"
    );
    // The gyro's rate, Earth's included: bias taken out, and no more.
    let without = EstimationSettings {
        latitude_deg: None,
        ..plan(World::Enu)
    };
    assert!(
        !done(&replay_with(&path, without))
            .unwrap()
            .text()
            .contains("latitude")
    );
}

#[test]
fn rates_stay_those_of_the_gyro() {
    let dir = tempfile::tempdir().unwrap();
    let path = log(dir.path(), 0);
    let out = dir.path().join("out.ndjson");
    let mut replay = replay_with(&path, plan(World::Enu));
    replay.targets = vec![target(&out)];
    done(&replay).unwrap();
    let text = std::fs::read_to_string(&out).unwrap();
    let line: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    let earth = in_body(&pose(), Convention::EnuFlu.earth_rate(LATITUDE));
    for i in 0..3 {
        let found = line["rate"][i].as_f64().unwrap();
        assert!((found - earth[i]).abs() < 1e-14, "{found} {}", earth[i]);
    }
}
