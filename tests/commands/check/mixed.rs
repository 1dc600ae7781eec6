//! Two sensors in one table, units that change half way, and cures that `--mend` applies: named, and nothing of good data.

use crate::program::strapd;
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

const STEP: i64 = 10_000_000;
const HZ: f64 = 100.0;

/// Stamp, rate, specific force.
type Row = (i64, [f64; 3], [f64; 3]);

/// A body that rests for 2 s and is then turned every way by hand, at 100 Hz; one of another `seed` otherwise.
fn hand(seed: u64, secs: i64) -> Vec<Row> {
    let mut state = seed;
    let mut noise = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let pace = 1.0 + 0.3 * seed as f64;
    let mut attitude = UnitQuaternion::from_euler_angles(0.9 * (seed - 1) as f64, 0.0, 0.0);
    (0..secs * HZ as i64)
        .map(|n| {
            let t = (n as f64 / HZ - 2.0).max(0.0);
            let rate = Vector3::new(
                1.6 * (1.7 * pace * t).sin(),
                1.2 * (1.1 * pace * t).sin(),
                1.4 * (0.6 * t).sin(),
            );
            attitude *= UnitQuaternion::from_scaled_axis(rate / HZ);
            let force = attitude.inverse() * Vector3::new(0.0, 0.0, 9.81);
            let mut noisy = |of: Vector3<f64>, size: f64| of.map(|v| v + size * noise()).into();
            (n * STEP, noisy(rate, 0.01), noisy(force, 0.1))
        })
        .collect()
}

fn write(dir: &Path, name: &str, rows: impl IntoIterator<Item = Row>) {
    let mut table = "stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
    for (stamp, [x, y, z], [a, b, c]) in rows {
        let stamp = 1_700_000_000_000_000_000 + stamp;
        let _ = writeln!(table, "{stamp},{x:.6},{y:.6},{z:.6},{a:.5},{b:.5},{c:.5}");
    }
    std::fs::write(dir.join(name), table).unwrap();
}

/// Findings of the first topic of a replay, and its summary.
fn replayed(dir: &Path, arguments: &str) -> (Vec<String>, Value) {
    let ran = strapd(dir, &format!("replay --aid auto --json {arguments}"));
    let all: Value = serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {ran:?}"));
    let topic = all["topics"][0].clone();
    let findings = topic["findings"].as_array().unwrap();
    let errors = findings.iter().filter(|f| f["severity"] == "error");
    let code = |f: &Value| f["code"].as_str().unwrap().to_owned();
    (errors.map(code).collect(), topic)
}

fn finding<'t>(topic: &'t Value, code: &str) -> &'t Value {
    let findings = topic["findings"].as_array().unwrap();
    findings.iter().find(|f| f["code"] == code).unwrap()
}

#[test]
fn two_sensors_in_one_table_are_an_error_with_the_ways_to_split_them() {
    let dir = tempfile::tempdir().unwrap();
    for late in [0, STEP / 3, STEP / 2] {
        let pairs = hand(1, 20).into_iter().zip(hand(2, 20));
        let both = pairs.flat_map(|(a, (stamp, gyro, accel))| [a, (stamp + late, gyro, accel)]);
        write(dir.path(), "both.csv", both);
        let (errors, topic) = replayed(dir.path(), "both.csv");
        assert_eq!(errors, ["two-sensors"], "{late}");
        assert_eq!(topic["sigma_holds"], false, "{late}");
        let flags = finding(&topic, "two-sensors")["flags"].as_str().unwrap();
        assert!(flags.contains("--where COLUMN=VALUE"), "{flags}");
        let checked = strapd(dir.path(), "check --aid auto both.csv");
        assert_eq!(checked.code, Some(3), "{checked:?}");
        assert!(
            checked.out.contains("two sensors take turns in one stream"),
            "{checked:?}"
        );
    }
}

#[test]
fn one_sensor_recorded_twice_or_stamped_coarsely_is_no_two() {
    let dir = tempfile::tempdir().unwrap();
    let twice = hand(1, 20).into_iter().flat_map(|row| [row, row]);
    write(dir.path(), "twice.csv", twice);
    let coarse = hand(1, 20).into_iter();
    let coarse = coarse.map(|(stamp, gyro, accel)| (stamp / (5 * STEP) * 5 * STEP, gyro, accel));
    write(dir.path(), "coarse.csv", coarse);
    let jittered = hand(1, 20).into_iter().enumerate();
    let jittered =
        jittered.map(|(n, (stamp, g, a))| (stamp + (n as i64 * 7 % 5) * 1_500_000, g, a));
    write(dir.path(), "jittered.csv", jittered);
    for name in ["twice.csv", "coarse.csv", "jittered.csv"] {
        let (errors, topic) = replayed(dir.path(), name);
        assert_eq!(errors, Vec::<String>::new(), "{name}");
        assert_eq!(topic["sigma_holds"], true, "{name}");
    }
}

#[test]
fn a_unit_that_changes_half_way_is_named_with_its_instant() {
    let dir = tempfile::tempdir().unwrap();
    for (gyro, accel, code, words) in [
        (57.295_78, 1.0, "gyro-unit-change", "from rad/s to deg/s"),
        (
            1.0 / 57.295_78,
            1.0,
            "gyro-unit-change",
            "from deg/s to rad/s",
        ),
        (1.0, 1.0 / 9.81, "accel-unit-change", "from m/s^2 to g"),
        (1.0, 1.0, "", ""),
    ] {
        let changed = hand(1, 40).into_iter().map(|(stamp, w, f)| match stamp {
            stamp if stamp < 2000 * STEP => (stamp, w, f),
            stamp => (stamp, w.map(|v| v * gyro), f.map(|v| v * accel)),
        });
        write(dir.path(), "changed.csv", changed);
        let (errors, topic) = replayed(dir.path(), "changed.csv");
        if code.is_empty() {
            assert_eq!(errors, Vec::<String>::new());
            continue;
        }
        assert!(errors.contains(&code.to_owned()), "{code}: {errors:?}");
        assert!(!errors.contains(&"gyro-scale".to_owned()), "{errors:?}");
        let found = finding(&topic, code);
        assert!(found["what"].as_str().unwrap().contains(words), "{found}");
        let at = found["evidence"]["at_s"].as_f64().unwrap();
        assert!((19.7..20.6).contains(&at), "{found}");
        assert_eq!(topic["sigma_holds"], false);
    }
}

#[test]
fn mending_applies_a_certain_cure_and_leaves_good_data_as_they_are() {
    let dir = tempfile::tempdir().unwrap();
    write(dir.path(), "good.csv", hand(1, 30));
    let swapped = hand(1, 30).into_iter();
    let swapped = swapped.map(|(stamp, [x, y, z], f)| (stamp, [y, x, z], f));
    write(dir.path(), "swapped.csv", swapped);

    let (errors, as_recorded) = replayed(dir.path(), "swapped.csv");
    assert_eq!(errors, ["gyro-axes"]);
    let flags = finding(&as_recorded, "gyro-axes")["flags"].as_str();
    assert_eq!(flags, Some("--gyro-axes YXZ, or --mend"));
    assert_eq!(as_recorded["sigma_holds"], false);
    assert_eq!(as_recorded["mended"], serde_json::json!([]));
    let text = strapd(dir.path(), "replay --aid auto swapped.csv").out;
    assert!(text.contains("it does not hold: "), "{text}");

    let (errors, mended) = replayed(dir.path(), "--mend swapped.csv");
    assert_eq!(errors, Vec::<String>::new());
    assert_eq!(mended["mended"][0]["settings"]["gyro_axes"], "YXZ");
    assert_eq!(mended["sigma_holds"], true);
    let (_, by_hand) = replayed(dir.path(), "--gyro-axes YXZ swapped.csv");
    assert_eq!(mended["final"], by_hand["final"]);
    let text = strapd(dir.path(), "replay --aid auto --mend swapped.csv").out;
    assert!(text.contains("mended   --gyro-axes YXZ (--mend)"), "{text}");
    let checked = strapd(dir.path(), "check --aid auto --mend -v swapped.csv").out;
    assert!(checked.contains("applied: --gyro-axes YXZ"), "{checked}");

    let (errors, mended) = replayed(dir.path(), "--mend good.csv");
    assert_eq!(errors, Vec::<String>::new());
    assert_eq!(mended["mended"], serde_json::json!([]));
    let (_, good) = replayed(dir.path(), "good.csv");
    assert_eq!(mended["final"], good["final"]);
}

#[test]
fn a_daemon_does_not_mend() {
    let dir = tempfile::tempdir().unwrap();
    let ran = strapd(dir.path(), "serve --listen tcp-listen://127.0.0.1:0 --mend");
    ran.refused(2, &["--mend", "a live stream"]);
}

#[test]
fn a_hand_that_moves_fast_tells_axes_and_units_of_its_gyro() {
    let dir = tempfile::tempdir().unwrap();
    let made =
        "simulate hand --noise consumer_imu --duration 60 --rate-hz 100 --seed 5 -o hand.csv";
    strapd(dir.path(), made).done();
    for (flags, code, words) in [
        ("", "", ""),
        ("--gyro-axes YXZ", "gyro-axes", "about x is the recorded y"),
        ("--gyro-axes xYZ", "gyro-axes", "about x is the recorded -x"),
        // Gravity vanishes under such rates, and what vanishes does not wander.
        (
            "--gyro-scale 57.29578",
            "gyro-scale",
            "true rates are 0.017",
        ),
        ("--gyro-scale 0.01745329", "gyro-scale", "true rates are 5"),
        ("--gyro-scale 1000", "gyro-scale", "true rates are 0.00099"),
    ] {
        let ran = strapd(dir.path(), &format!("check hand.csv --json {flags}"));
        let all: Value = serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {ran:?}"));
        let findings = all["findings"].as_array().unwrap();
        let named: Vec<&Value> = findings
            .iter()
            .filter(|f| f["severity"] == "error")
            .collect();
        match code {
            "" => assert_eq!(named, Vec::<&Value>::new()),
            _ => {
                assert_eq!(named.len(), 1, "{flags}: {named:?}");
                assert_eq!(named[0]["code"], code, "{flags}");
                assert!(
                    named[0]["what"].as_str().unwrap().contains(words),
                    "{named:?}"
                );
            }
        }
    }
}
