//! Promise: a replay, and not `check` alone, says of a gyro that one of its axes is dead, hangs or wraps, and says nothing
//! of one that is sound; spikes of several samples at ordinary rates are repaired.

use crate::program::strapd;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// A thing in the hand for a minute, whose rates are changed by row; and what a command says of it.
fn changed(at: &Path, rate_hz: u32, command: &str, fault: impl Fn(usize, &mut [f64])) -> Value {
    let made = format!("simulate hand --noise consumer_imu --duration 60 --rate-hz {rate_hz}");
    strapd(at, &format!("{made} -o made.csv --force")).done();
    let text = std::fs::read_to_string(at.join("made.csv")).unwrap();
    let mut out = "stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
    for (n, row) in text.lines().skip(1).enumerate() {
        let cells: Vec<&str> = row.split(',').collect();
        let mut rates: Vec<f64> = cells[2..5]
            .iter()
            .map(|cell| cell.parse().unwrap())
            .collect();
        fault(n, &mut rates);
        let [x, y, z] = rates[..] else { unreachable!() };
        writeln!(out, "{},{x},{y},{z},{}", cells[0], cells[5..8].join(",")).unwrap();
    }
    std::fs::write(at.join("in.csv"), out).unwrap();
    let ran = strapd(at, &format!("{command} --json"));
    serde_json::from_str(&ran.out).unwrap_or_else(|why| panic!("{why}: {ran:?}"))
}

/// Errors, and warnings of spikes.
fn errors(said: &Value) -> Vec<String> {
    let findings = said["topics"][0]["findings"].as_array();
    let findings = findings.or_else(|| said["findings"].as_array()).unwrap();
    let told = findings
        .iter()
        .filter(|f| f["severity"] == "error" || f["code"] == "spikes");
    told.map(|f| f["code"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn a_replay_names_an_axis_that_is_dead_hangs_or_wraps() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let replay = "replay in.csv --aid gravity -o null:";
    for command in [replay, "check in.csv --aid gravity"] {
        let codes = |fault: &dyn Fn(usize, &mut [f64])| errors(&changed(at, 100, command, fault));
        assert_eq!(codes(&|_, _| {}), [""; 0], "{command}");
        assert_eq!(codes(&|_, w| w[1] = 0.0), ["axis-dead"], "{command}");
        let hangs = |n, w: &mut [f64]| w[0] = if n < 3000 { w[0] } else { 0.3125 };
        assert_eq!(codes(&hangs), ["stuck"], "{command}");
        let wraps = |_, w: &mut [f64]| {
            w.iter_mut()
                .for_each(|w| *w = (*w + 1.1).rem_euclid(2.2) - 1.1);
        };
        let said = changed(at, 100, command, wraps);
        assert!(
            errors(&said).contains(&"wrapped".to_owned()),
            "{command}: {said}"
        );
    }
}

#[test]
fn who_turns_about_one_axis_alone_has_no_dead_ones() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let mut text = "stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
    for n in 0..6000_u64 {
        let rate = (n as f64 * 0.01).sin();
        writeln!(
            text,
            "{},0,0,{rate},0,0,9.81",
            1_000_000_000 + n * 10_000_000
        )
        .unwrap();
    }
    std::fs::write(at.join("table.csv"), text).unwrap();
    let said = strapd(at, "replay table.csv --aid gravity -o null: --json").json();
    assert_eq!(errors(&said), [""; 0]);
}

#[test]
fn two_wrong_samples_at_100_hz_and_three_at_200_are_repaired() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (rate_hz, samples) in [(100, 2), (200, 3)] {
        let spikes = |n: usize, w: &mut [f64]| {
            if n > 500 && n % 331 < samples {
                w.iter_mut().for_each(|w| *w += 8.0);
            }
        };
        let said = changed(at, rate_hz, "replay in.csv --aid gravity -o null:", spikes);
        let topic = &said["topics"][0];
        let wrong = (501..60 * rate_hz as usize + 1)
            .filter(|n| n % 331 < samples)
            .count();
        let repaired = topic["repaired_spikes"].as_u64().unwrap() as usize;
        assert!(
            (wrong - samples..=wrong).contains(&repaired),
            "{repaired} of {wrong}"
        );
        assert_eq!(errors(&said), ["spikes"]);
    }
}

#[test]
fn a_replay_says_of_a_body_that_is_upside_down_all_the_time_what_may_be_wrong() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // For good, or turned over after ten seconds, within one.
    for (until, expected) in [(6000, true), (1000, false)] {
        let mut text = "stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n".to_owned();
        let mut roll = std::f64::consts::PI;
        for n in 0..6000_usize {
            let rate = if n >= until && roll > 0.0 {
                -std::f64::consts::PI
            } else {
                0.0
            };
            roll += rate * 0.01;
            let noise = 1e-4 * (n as f64 * 1.7).sin();
            let (y, z) = (9.81 * roll.sin(), 9.81 * roll.cos());
            let stamp = 1_000_000_000 + n * 10_000_000;
            writeln!(text, "{stamp},{},{noise},{noise},0,{y},{z}", rate + noise).unwrap();
        }
        std::fs::write(at.join("down.csv"), text).unwrap();
        let said = strapd(at, "replay down.csv --aid gravity -o null: --json").json();
        let findings = said["topics"][0]["findings"].to_string();
        assert_eq!(findings.contains("looks-frd"), expected, "{said}");
        let stated = strapd(
            at,
            "replay down.csv --aid gravity --body frd -o null: --json",
        )
        .json();
        assert!(
            !stated["topics"][0]["findings"]
                .to_string()
                .contains("looks-frd"),
            "{stated}"
        );
    }
}
