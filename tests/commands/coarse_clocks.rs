//! Promise: a clock that counts in longer steps than the sensor loses no row, though rows are alike at rest; rows that
//! were recorded several times are counted as repeats.

use crate::program::{Ran, strapd, strapd_fed};
use std::path::Path;

/// Rates in whole deg/s and forces in 0.01 g, 50 a second for 30 s: at rest for the first three, then in motion.
fn rows() -> impl Iterator<Item = String> {
    (0..1500).map(|k| {
        let t = (f64::from(k) / 50.0 - 3.0).max(0.0);
        let [x, y, z] = [1.7, 1.1, 0.6].map(|w: f64| (90.0 * (w * t).sin()).round());
        format!("{x},{y},{z},0.00,0.00,1.00")
    })
}

const HEADER: &str =
    "time[ms],gyro_x[deg/s],gyro_y[deg/s],gyro_z[deg/s],acc_x[g],acc_y[g],acc_z[g]\n";

/// A table of them, each `times` over, with these stamps, ms.
fn written(at: &Path, times: usize, stamp: impl Fn(usize) -> i64) {
    let mut text = HEADER.to_owned();
    for (k, row) in rows().enumerate() {
        text += &format!("{},{row}\n", 1_743_300_000_000 + stamp(k)).repeat(times);
    }
    std::fs::write(at.join("a.csv"), text).unwrap();
}

/// Replays of the file and of a pipe, with their attitudes.
fn replayed(at: &Path) -> [(Ran, String); 2] {
    let text = std::fs::read(at.join("a.csv")).unwrap();
    let flags = "-o out.csv --force --json";
    let file = strapd(at, &format!("replay a.csv {flags}"));
    let of_file = std::fs::read_to_string(at.join("out.csv")).unwrap();
    let pipe = strapd_fed(at, &format!("replay - {flags}"), text);
    let of_pipe = std::fs::read_to_string(at.join("out.csv")).unwrap();
    [(file, of_file), (pipe, of_pipe)]
}

#[test]
fn rows_alike_at_rest_on_fifths_of_a_second_are_all_used_and_spread_evenly() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for tick in [200, 1000, 100] {
        written(at, 1, |k| k as i64 * 20 / tick * tick);
        for (ran, attitudes) in replayed(at) {
            let topic = ran.json()["topics"][0].clone();
            assert_eq!(topic["samples"]["used"], 1500, "{tick} ms: {ran:?}");
            assert!(topic["findings"].to_string().contains("coarse-stamps"));
            let stamps = attitudes.lines().skip(1).map(|row| {
                let stamp = row.split(',').next().unwrap();
                stamp.parse::<i64>().unwrap()
            });
            let even = (0..1500).map(|k| 1_743_300_000_000_000_000 + k * 20_000_000);
            // The mean step of the sensor is known to a sample in all.
            let off = stamps
                .zip(even)
                .map(|(stamp, even)| (stamp - even).abs())
                .max();
            assert!(off.unwrap() < 1000, "{tick} ms: {off:?} ns");
        }
        let checked = strapd(at, "check a.csv");
        assert!(!checked.out.contains("duplicate"), "{checked:?}");
    }
}

#[test]
fn rows_of_a_logger_that_polls_faster_than_the_sensor_are_repeats_in_motion_and_at_rest() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for times in [2, 4] {
        written(at, times, |k| k as i64 * 20);
        for (ran, _) in replayed(at) {
            let samples = ran.json()["topics"][0]["samples"].clone();
            assert_eq!(samples["used"], 1500, "{ran:?}");
            assert_eq!(
                samples["by_verdict"]["repeated"],
                1500 * (times - 1),
                "{ran:?}"
            );
        }
    }
    // At rest, where noise alone changes.
    let mut text = HEADER.to_owned();
    for k in 0..1500_i64 {
        let noise = k * 7919 % 11 - 5;
        text += &format!(
            "{},0.{noise:02},0.1,-0.1,0.0,0.0,1.0\n",
            1_743_300_000_000_i64 + k * 20
        )
        .replace("0.-", "-0.")
        .repeat(2);
    }
    std::fs::write(at.join("a.csv"), text).unwrap();
    for (ran, _) in replayed(at) {
        assert_eq!(
            ran.json()["topics"][0]["samples"]["by_verdict"]["repeated"],
            1500,
            "{ran:?}"
        );
    }
}

#[test]
fn a_log_that_was_recorded_twice_is_counted_as_repeated() {
    use crate::made_logs::{motion, written};
    let dir = tempfile::tempdir().unwrap();
    let twice: Vec<_> = motion(500).into_iter().flat_map(|s| [s, s]).collect();
    let log = written(dir.path(), "twice.mcap", &twice);
    let ran = strapd(
        dir.path(),
        &format!("replay {} -o null: --json", log.display()),
    );
    let samples = ran.json()["topics"][0]["samples"].clone();
    assert_eq!(
        (&samples["used"], &samples["by_verdict"]["repeated"]),
        (&500.into(), &500.into()),
        "{ran:?}"
    );
}
