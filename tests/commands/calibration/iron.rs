//! Promise: hard and soft iron of a board are learned from a recording that shows them, and taken out of the next one.

use super::{attitudes, saved, vector};
use crate::program::strapd;
use crate::shared_data::shared;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::path::Path;

/// Hard iron, tesla: three quarters of the field.
const HARD: Vector3<f64> = Vector3::new(30e-6, -18e-6, 12e-6);

/// Soft iron whose largest entry is `share`; not symmetric, since a magnetometer is mounted askew, too.
fn board(share: f64) -> Matrix3<f64> {
    Matrix3::identity() + Matrix3::new(1.0, 0.42, -0.25, 0.35, -0.6, 0.33, -0.2, 0.4, -0.2) * share
}

/// A motion as a magnetometer on such a board measures it.
fn log(dir: &Path, name: &str, (motion, seed): (&str, u64), share: f64) {
    let made = format!(
        "simulate {motion} --mag --duration 120 --rate-hz 100 --seed {seed} --noise arw=0.3,accel_noise=150,mag_noise=0.3 -o - --quiet"
    );
    let lines: Vec<String> = strapd(dir, &made)
        .done()
        .out
        .lines()
        .map(|line| {
            let mut line: Value = serde_json::from_str(line).unwrap();
            if line["class"] == "RATE" {
                let field = board(share) * vector(&line["mag"]) + HARD;
                line["mag"] = field.as_slice().into();
            }
            line.to_string()
        })
        .collect();
    std::fs::write(dir.join(name), lines.join("\n") + "\n").unwrap();
}

/// Mean error against north after 30 s, degrees, nothing aligned.
fn error(dir: &Path, log: &str, flags: &str) -> f64 {
    let run = format!("replay {log} --aid gravity+mag --world enu -o - --quiet {flags}");
    let found = attitudes(&strapd(dir, &run).done().out, "");
    let truth = attitudes(&std::fs::read_to_string(dir.join(log)).unwrap(), "truth");
    let first = found[0].0;
    let mut truth = truth.iter();
    let late = found.iter().filter(|(at, _)| at - first > 30.0);
    let errors: Vec<f64> = late
        .map(|(at, q)| {
            let (_, reference) = truth.find(|(t, _)| (t - at).abs() < 1e-6).unwrap();
            (q * reference.inverse()).angle().to_degrees()
        })
        .collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn iron_of_a_board_is_learned_and_taken_out_of_another_recording() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for share in [0.12, 0.3] {
        log(at, "turns.ndjson", ("hand", 1), share);
        log(at, "flight.ndjson", ("hand", 2), share);
        let run = "calibrate turns.ndjson --aid gravity+mag -o c.toml --force";
        let said = strapd(at, run).done().out.clone();
        assert!(!said.contains("the magnetometer"), "{said}");
        let known = saved(at, "c.toml");
        let (soft, hard) = (known.soft_iron.unwrap(), known.hard_iron.unwrap());
        let back = (Matrix3::identity() + Matrix3::from_row_slice(&soft.value)) * board(share);
        // The size of the field is no one's business.
        let off = (back * (3.0 / back.trace()) - Matrix3::identity())
            .abs()
            .max();
        let sigma = soft.sigma.unwrap().into_iter().fold(0.0, f64::max);
        assert!(
            off < 5.0 * sigma && sigma < 3e-3,
            "{share}: {off} of {sigma}"
        );
        assert!(soft.observed.iter().all(|is| *is));
        for i in 0..3 {
            let sigma = hard.sigma_of(i).unwrap();
            let off = (hard.value[i] - HARD[i]).abs();
            assert!(
                off < 5.0 * sigma && sigma < 5e-7,
                "{share}: {off} of {sigma}"
            );
        }
        let [without, with] =
            ["", "--calibration c.toml"].map(|flags| error(at, "flight.ndjson", flags));
        assert!(
            without > 10.0 && with < 1.0,
            "{share}: {without} and {with}"
        );
    }
}

#[test]
fn soft_iron_that_no_motion_shows_stays_zero_and_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (motion, share) in [(("hand", 1), 0.0), (("car", 1), 0.12)] {
        log(at, "turns.ndjson", motion, share);
        let run = "calibrate turns.ndjson --aid gravity+mag -o c.toml --force";
        let said = strapd(at, run).done().out.clone();
        let missing =
            "not observable        the magnetometer's soft iron: none above 3 % shows; rotate";
        assert!(said.contains(missing), "{said}");
        let axes = "the magnetometer's hard iron along x and y and z: rotate";
        assert_eq!(said.contains(axes), motion.0 == "car", "{said}");
        let soft = saved(at, "c.toml").soft_iron;
        assert!(soft.is_none_or(|s| s.value == [0.0; 9] && s.observed == [false; 9]));
    }
}

/// Root mean square of the heading's error against the cameras, degrees, nothing aligned.
fn heading(dir: &Path, log: &str, truth: &str, flags: &str) -> f64 {
    let run = format!("replay {log} --aid gravity+mag -o a.csv --force --quiet {flags}");
    strapd(dir, &run).done();
    let run = format!("compare a.csv {truth} --align none --ref-topic /ground_truth --json");
    let out: Value = serde_json::from_str(&strapd(dir, &run).done().out).unwrap();
    out["heading"]["rms_deg"].as_f64().unwrap()
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_board_under_a_real_sensor_costs_its_heading_a_degree() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for name in [
        "01_undisturbed_slow_rotation_A",
        "07_undisturbed_fast_rotation_B",
    ] {
        let truth = shared(&format!("logs/broad/{name}.mcap")).unwrap();
        let truth = truth.display().to_string();
        let cat = strapd(at, &format!("cat {truth}")).done().out.clone();
        let lines: Vec<String> = cat
            .lines()
            .map(|line| {
                let mut line: Value = serde_json::from_str(line).unwrap();
                if line["mag"].is_array() {
                    let field = board(0.12) * vector(&line["mag"]) + HARD;
                    line["mag"] = field.as_slice().into();
                }
                line.to_string()
            })
            .collect();
        std::fs::write(at.join("board.ndjson"), lines.join("\n") + "\n").unwrap();
        let run = "calibrate board.ndjson --aid gravity+mag -o c.toml --force";
        strapd(at, run).done();
        let untouched = heading(at, &truth, &truth, "");
        let [without, with] =
            ["", "--calibration c.toml"].map(|flags| heading(at, "board.ndjson", &truth, flags));
        // Of 0.2 % that the room's field leaves unknown, and a dip of 68 degrees: half a degree; twice that.
        assert!(
            without > 20.0 && with < untouched + 1.5,
            "{name}: {untouched}, {without}, {with}"
        );
    }
}
