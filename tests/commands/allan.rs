//! `strapd allan`: what it prints, writes, warns of and refuses.

use crate::made_logs::{ImuSample, START, STEP, written};
use crate::program::ended;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use strapd_attitude::noise::sensor_error::{ConstantErrors, GyroModel, ImuError, Truth};
use strapd_attitude::record::{Nanos, SampleKind};

/// Stdout, stderr and exit code of `strapd allan` in `dir`.
fn allan(dir: &Path, arguments: &str) -> (String, String, Option<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_strapd"));
    command
        .current_dir(dir)
        .env_remove("STRAPD_TIME")
        .env_remove("STRAPD_LOG")
        .env("NO_COLOR", "1")
        .arg("allan")
        .args(arguments.split_whitespace());
    let output = ended(&command, "");
    (
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
        output.status.code(),
    )
}

/// A sensor at rest for `n` samples at 100 Hz.
fn resting(text: &str, n: i64) -> Vec<ImuSample> {
    let error = ImuError::parse(text).unwrap();
    let mut gyro =
        GyroModel::with_constants(&error, ConstantErrors::none(), SampleKind::Rate, 1).unwrap();
    (0..n)
        .map(|k| {
            let (from, to) = (Nanos(START + (k - 1) * STEP), Nanos(START + k * STEP));
            let read = gyro.measure(from, to, &Truth::default()).unwrap();
            ImuSample {
                stamp: to.0,
                orientation: None,
                gyro: read.gyro.into(),
                gyro_covariance_0: 0.0,
                accel: [0.0, 0.0, 9.80665],
            }
        })
        .collect()
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// 0.3 deg/sqrt(h), rad/sqrt(s).
const ARW: f64 = 0.3 / 60.0 / 180.0 * std::f64::consts::PI;

#[test]
fn the_noise_of_a_log_comes_out_in_its_units_and_as_flags() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "rest.mcap", &resting("arw=0.3", 20_000));
    let (out, err, code) = allan(dir.path(), "rest.mcap");
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("20000 samples every 10.0000 ms"), "{out}");
    assert!(out.contains("not seen, <"), "{out}");
    let (out, err, _) = allan(dir.path(), "rest.mcap --json");
    let summary = json(&out);
    assert_eq!(summary["warnings"], serde_json::json!([]), "{err}");
    for axis in summary["axes"].as_array().unwrap() {
        let arw = axis["terms_si"]["arw"]["value"].as_f64().unwrap();
        assert!((arw / ARW - 1.0).abs() < 0.03, "{arw}");
        assert!(axis["terms_si"]["rrw"]["value"].is_null());
        assert!(axis["terms_si"]["rrw"]["at_most"].as_f64().unwrap() > 0.0);
    }
    // Each flag is understood where it is to be pasted, and means the same.
    let simulate = ImuError::parse(summary["simulate_noise"].as_str().unwrap()).unwrap();
    assert!((simulate.arw / ARW - 1.0).abs() < 0.03);
    let replay = strapd::config::parse_noise(summary["replay_noise"].as_str().unwrap()).unwrap();
    for axis in replay.arw.iter() {
        assert!((axis / simulate.arw - 1.0).abs() < 0.03);
    }
}

#[test]
fn units_and_kinds_are_as_the_flags_say() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "rest.mcap", &resting("arw=0.3", 5000));
    let sigma = |flags: &str| {
        let (out, err, _) = allan(dir.path(), &format!("rest.mcap --json {flags}"));
        let summary: Value = serde_json::from_str(&out).unwrap_or_else(|_| panic!("{err}"));
        summary["axes"][0]["points"][0]["sigma_rad_s"]
            .as_f64()
            .unwrap()
    };
    let plain = sigma("");
    // At 10 ms: N / sqrt(tau).
    assert!((plain / (ARW / 0.1) - 1.0).abs() < 0.05, "{plain}");
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    near(sigma("--gyro-unit mrad"), 1e-3 * plain);
    near(sigma("--sample-kind average"), plain);
    near(sigma("--sample-kind delta-angle"), plain / 0.01);
    // Twice the rate: half the interval, the same rates.
    near(sigma("--time index --rate-hz 200"), plain);
}

#[test]
fn start_and_until_choose_the_part() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "rest.mcap", &resting("arw=0.3", 5000));
    let (out, ..) = allan(dir.path(), "rest.mcap --json --start 10 --until 30");
    assert!(
        (json(&out)["duration_s"].as_f64().unwrap() - 20.0).abs() < 0.02,
        "{out}"
    );
}

#[test]
fn gaps_are_filled_or_split_and_said() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = resting("arw=0.3", 10_000);
    samples.drain(7000..7100);
    samples.drain(3000..3005);
    written(dir.path(), "gaps.mcap", &samples);
    let (out, err, _) = allan(dir.path(), "gaps.mcap --json");
    let summary = json(&out);
    assert_eq!(summary["filled"], 5);
    assert_eq!(summary["splits"], 1);
    assert_eq!(summary["samples"], 9895);
    assert!(err.contains("5 missing samples in 1 places"), "{err}");
    assert!(err.contains("1 gaps split the record"), "{err}");
    let (out, ..) = allan(dir.path(), "gaps.mcap --json --max-gap 0");
    assert_eq!(json(&out)["filled"], 0);
    assert_eq!(json(&out)["splits"], 2);
}

#[test]
fn motion_is_said_and_gives_no_flags() {
    let dir = tempfile::tempdir().unwrap();
    // Still for 40 s, then lively.
    let mut samples = resting("arw=0.3", 4000);
    samples.extend(crate::made_logs::motion(6000).into_iter().skip(4000));
    written(dir.path(), "moved.mcap", &samples);
    let (out, err, _) = allan(dir.path(), "moved.mcap");
    assert!(err.contains("the sensor moved: at rest for 40."), "{err}");
    assert!(err.contains("--start 0.0 --until 39."), "{err}");
    assert!(!out.contains("--noise"), "{out}");
}

#[test]
fn a_stuck_axis_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = resting("arw=0.3", 3000);
    samples.iter_mut().for_each(|s| s.gyro[1] = 0.001);
    written(dir.path(), "stuck.mcap", &samples);
    let (out, err, _) = allan(dir.path(), "stuck.mcap");
    assert!(err.contains("y: stuck"), "{err}");
    assert!(out.contains("stuck"), "{out}");
    let (out, ..) = allan(dir.path(), "stuck.mcap --json");
    assert_eq!(json(&out)["axes"][1]["stuck"], true);
}

#[test]
fn chart_and_table_are_written_once() {
    let dir = tempfile::tempdir().unwrap();
    written(
        dir.path(),
        "rest.mcap",
        &resting("arw=0.3,bias-instability=30", 10_000),
    );
    let (_, err, code) = allan(dir.path(), "rest.mcap --plot a.svg --csv a.csv");
    assert_eq!(code, Some(0), "{err}");
    let svg = std::fs::read_to_string(dir.path().join("a.svg")).unwrap();
    assert!(svg.contains("Allan deviation, deg/h") && svg.contains("z, fitted"));
    let csv = std::fs::read_to_string(dir.path().join("a.csv")).unwrap();
    let rows: Vec<Vec<f64>> = csv
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    assert!(rows.len() > 20 && rows.iter().all(|r| r.len() == 9));
    assert_eq!(csv.lines().next().unwrap().split(',').count(), 9);
    assert!((rows[0][0] - 0.01).abs() < 1e-12 && rows[0][1] == 1.0);
    // The fit is near the curve where there are many clusters.
    assert!((rows[0][4] / rows[0][3] - 1.0).abs() < 0.05);
    let (_, err, code) = allan(dir.path(), "rest.mcap --csv a.csv");
    assert_eq!(code, Some(1));
    assert!(
        err.contains("a.csv: already exists") && err.contains("--force"),
        "{err}"
    );
    assert_eq!(
        allan(dir.path(), "rest.mcap --csv a.csv --force").2,
        Some(0)
    );
    let (_, err, _) = allan(dir.path(), "rest.mcap --csv rest.mcap --force");
    assert!(err.contains("is the input"), "{err}");
}

#[test]
fn what_can_not_be_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "short.mcap", &resting("arw=0.3", 8));
    for (arguments, code, says) in [
        ("short.mcap", 1, "too short: 8 sampling intervals"),
        ("short.mcap --topic /other", 1, "no topic `/other`"),
        ("short.mcap --topic all", 2, "one topic at a time"),
        ("short.mcap --time index", 2, "--rate-hz HZ"),
        ("short.mcap --rate-hz 5", 2, "only --time index"),
        ("short.mcap --gyro-unit turns", 2, "gyro-unit"),
        ("short.mcap --max-gap NaN", 2, "max-gap"),
        ("absent.mcap", 1, "cannot open"),
    ] {
        let (out, err, found) = allan(dir.path(), arguments);
        assert_eq!(found, Some(code), "{arguments}: {err}");
        assert!(err.contains(says), "{arguments}: {err}");
        assert!(out.is_empty(), "{arguments}: {out}");
    }
}
