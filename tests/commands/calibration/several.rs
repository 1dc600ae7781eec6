//! Promise: recordings of one sensor tell more together than each alone, and where they differ that is said.

use super::{error, errors, log, saved};
use crate::program::strapd;
use nalgebra::Matrix3;
use serde_json::{Value, json};
use std::path::Path;

/// The sensor at rest, its x axis up, for so many seconds; no accelerometer can be told by that.
fn resting(dir: &Path, name: &str, secs: u32) {
    let lines: Vec<String> = (0..secs * 100)
        .map(|i| {
            let noise = |k: u32| 1e-3 * (f64::from((i * 7919 + k * 101) % 1009) / 1009.0 - 0.5);
            json!({
                "class": "RATE", "id": "imu", "stamp": {"sec": i / 100, "nsec": i % 100 * 10_000_000},
                "gyro": [0.01 + noise(0), 0.004 + noise(1), noise(2) - 0.003], "accel": [9.81 + noise(3), noise(4), noise(5)],
            })
            .to_string()
        })
        .collect();
    std::fs::write(dir.join(name), lines.join("\n") + "\n").unwrap();
}

/// Sigma of the gyro's scales.
fn gyro_sigma(dir: &Path, name: &str) -> f64 {
    let gyro = saved(dir, name).gyro.unwrap();
    let squares = [0, 4, 8].map(|i| gyro.sigma_of(i).unwrap().powi(2));
    (squares.iter().sum::<f64>() / 3.0).sqrt()
}

#[test]
fn several_recordings_know_the_sensor_better_than_each_of_them_and_within_their_sigmas() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (name, seed) in [("a", 1), ("b", 2), ("c", 3)] {
        log(at, &format!("{name}.ndjson"), seed, 100);
        let one = format!("calibrate --aid gravity {name}.ndjson -o {name}.toml");
        strapd(at, &one).done();
    }
    let ran = strapd(
        at,
        "calibrate --aid gravity a.ndjson b.ndjson c.ndjson -o all.toml --json",
    );
    let said = ran.json();
    assert_eq!(said["recordings"].as_array().map(Vec::len), Some(3));
    let by = said["disagreement_sigmas"]["gyro"].as_f64().unwrap();
    assert!(by < 2.0, "{said}");
    let all = saved(at, "all.toml");
    assert_eq!(all.sources, ["a.ndjson", "b.ndjson", "c.ndjson"]);
    let (g, bias, force_bias) = errors();
    let gyro = all.gyro.unwrap();
    for i in 0..9 {
        // The scales are told; of the axes those that the motion shows.
        assert!(gyro.observed[i] || i % 4 != 0, "{gyro:?}");
        let off = (gyro.value[i] - g[(i / 3, i % 3)]).abs() / gyro.sigma.unwrap()[i];
        assert!(off < 3.5, "G {i}: {off} sigma of {gyro:?}");
    }
    for i in 0..3 {
        let (b, ba) = (all.bias.unwrap(), all.force_bias.unwrap());
        assert!((b.value[i] - bias[i]).abs() < 1e-3, "{b:?}");
        let off = (ba.value[i] - force_bias[i]).abs() / ba.sigma.unwrap()[i];
        assert!(off < 3.5, "ba {i}: {off} sigma of {ba:?}");
    }
    let together = gyro_sigma(at, "all.toml") / by.max(1.0);
    for one in ["a.toml", "b.toml", "c.toml"] {
        assert!(together < 0.9 * gyro_sigma(at, one), "{one}");
    }
    // And a file that is known is one recording more.
    strapd(
        at,
        "calibrate --aid gravity c.ndjson --calibration all.toml -o more.toml",
    )
    .done();
    assert_eq!(
        saved(at, "more.toml").sources,
        ["a.ndjson", "b.ndjson", "c.ndjson"]
    );
}

#[test]
fn recordings_of_two_sensors_are_said_to_differ_and_sigma_knows_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "a.ndjson", 1, 100);
    strapd(at, "calibrate --aid gravity a.ndjson -o a.toml").done();
    // The same sensor turned in its case by three degrees about z, and two per cent off: another one.
    let text = std::fs::read_to_string(at.join("a.ndjson")).unwrap();
    let (sin, cos) = 3_f64.to_radians().sin_cos();
    let other = Matrix3::new(1.02 * cos, -sin, 0.0, sin, 1.02 * cos, 0.0, 0.0, 0.0, 1.02);
    let lines: Vec<String> = text
        .lines()
        .map(|line| {
            let mut line: Value = serde_json::from_str(line).unwrap();
            if line["class"] == "RATE" {
                line["gyro"] = (other * super::vector(&line["gyro"])).as_slice().into();
            }
            line.to_string()
        })
        .collect();
    std::fs::write(at.join("b.ndjson"), lines.join("\n") + "\n").unwrap();
    let ran = strapd(at, "calibrate --aid gravity a.ndjson b.ndjson -o both.toml");
    let said = ran.done().out.clone();
    assert!(
        said.contains("POOR, gyro: the recordings differ by"),
        "{said}"
    );
    assert!(
        gyro_sigma(at, "both.toml") > 3.0 * gyro_sigma(at, "a.toml"),
        "{said}"
    );
}

#[test]
fn what_a_rest_can_not_tell_is_missing_with_the_motion_that_would() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    resting(at, "rest.ndjson", 20);
    let ran = strapd(at, "calibrate --aid gravity rest.ndjson -o rest.toml");
    let said = ran.done().out.clone();
    assert!(
        said.contains("the gyro's scale about x and y and z: hold that axis level"),
        "{said}"
    );
    assert!(
        said.contains("the accelerometer: rest for two seconds in each of six"),
        "{said}"
    );
    assert!(
        said.contains("the accelerometer's time offset: turn fast"),
        "{said}"
    );
    assert!(!said.contains("the gyro's bias: rest"), "{said}");
    let known = saved(at, "rest.toml");
    assert!(
        (known.bias.unwrap().value[0] - 0.01).abs() < 1e-4,
        "{known:?}"
    );
    assert!(known.gyro.unwrap().is_unobserved(), "{known:?}");
}

#[test]
fn a_short_recording_is_smoothed_better_with_what_others_have_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "long.ndjson", 1, 240);
    log(at, "short.ndjson", 2, 12);
    strapd(at, "calibrate --aid gravity long.ndjson -o c.toml").done();
    let without = error(at, "--smooth --aid gravity", "short.ndjson", 12.0);
    let with = error(
        at,
        "--smooth --aid gravity --calibration c.toml",
        "short.ndjson",
        12.0,
    );
    assert!(with * 2.0 < without, "{with} with, {without} without");
}

#[test]
fn what_can_be_no_calibration_is_refused_before_anything_is_read() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::write(at.join("there.toml"), "").unwrap();
    for (run, why) in [
        ("calibrate no.mcap --aid none -o c.toml", "--aid gravity"),
        ("calibrate --aid gravity no.mcap -o c.mcap", ".toml"),
        ("calibrate --aid gravity no.mcap -o there.toml", "--force"),
        (
            "calibrate --aid gravity no.mcap no.mcap -o c.toml",
            "named twice",
        ),
        (
            "calibrate --aid gravity no.mcap --topic all -o c.toml",
            "--topic NAME",
        ),
        ("calibrate --aid gravity no.mcap -q", "-o imu.toml"),
    ] {
        let ran = strapd(at, run);
        assert!(ran.err.contains(why), "{run}: {}", ran.err);
        assert_eq!(ran.code.map(|code| code == 0), Some(false), "{run}");
    }
    // Of several, those that can be read are.
    log(at, "a.ndjson", 1, 20);
    let ran = strapd(at, "calibrate --aid gravity no.mcap a.ndjson -o c.toml");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert_eq!(saved(at, "c.toml").sources, ["a.ndjson"]);
}
