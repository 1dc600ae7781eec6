//! Promise: stamps in another unit than their name says are refused with the setting that reads them, and a fast
//! sensor is not.

use crate::program::{Ran, strapd, strapd_fed};
use std::path::Path;

const MS: i64 = 1_700_000_000_000;

/// A table and lines of samples at these stamps.
fn written(at: &Path, stamps: impl Iterator<Item = i64>) -> [&'static str; 2] {
    let (mut rows, mut lines) = ("stamp_ns,gyro_x,gyro_y,gyro_z\n".to_owned(), String::new());
    for (n, stamp) in stamps.enumerate() {
        let rate = 0.3 * (n as f64 * 0.01).sin();
        rows += &format!("{stamp},{rate},0.1,-0.2\n");
        lines += &format!("{{\"id\":\"imu\",\"stamp_ns\":{stamp},\"gyro\":[{rate},0.1,-0.2]}}\n");
    }
    std::fs::write(at.join("a.csv"), rows).unwrap();
    std::fs::write(at.join("a.ndjson"), lines).unwrap();
    ["a.csv", "a.ndjson"]
}

fn replay(at: &Path, file: &str, flags: &str) -> Ran {
    strapd(at, &format!("replay {file} -o out.csv --force {flags}"))
}

fn secs(at: &Path) -> f64 {
    let rows = std::fs::read_to_string(at.join("out.csv")).unwrap();
    let stamp = |row: &str| row.split(',').next().unwrap().parse::<i64>().unwrap();
    let mut rows = rows.lines().skip(1);
    let first = stamp(rows.next().unwrap());
    (stamp(rows.last().unwrap()) - first) as f64 * 1e-9
}

#[test]
fn milliseconds_and_microseconds_called_nanoseconds_are_refused_with_the_setting() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (unit, stamp) in [
        ("ms", (|n| MS + 10 * n) as fn(i64) -> i64),
        ("us", |n| MS * 1000 + 10_000 * n),
        ("s", |n| MS / 1000 + n),
    ] {
        for file in written(at, (0..2000).map(stamp)) {
            let flag = match file {
                "a.csv" => "--columns",
                _ => "--field",
            };
            let stated = format!("stamp=stamp_ns:{unit}");
            let help = format!("{flag} {stated}");
            for command in ["replay", "info", "check", "cat"] {
                let ran = strapd(at, &format!("{command} {file}"));
                ran.refused(1, &["stamps are in ns by their name", &help]);
            }
            let piped = std::fs::read(at.join(file)).unwrap();
            strapd_fed(at, "replay - -o piped.csv --force", piped).refused(1, &[&help]);
            // As it says, and as the name says.
            replay(at, file, &help).done();
            let expected = if unit == "s" { 1999.0 } else { 19.99 };
            assert!((secs(at) - expected).abs() < 1e-6, "{file} {unit}");
            let believed = replay(at, file, &format!("{flag} stamp=stamp_ns:ns"));
            assert!(matches!(believed.code, Some(0 | 3)), "{believed:?}");
        }
    }
}

#[test]
fn fast_sensors_bursts_and_doubled_rows_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for stamp in [
        (|n| MS + 125_000 * n) as fn(i64) -> i64,
        |n| MS + 31_250 * n,
        |n| MS * 1_000_000 + 31_250 * n,
        // Ten at a time on arrival, 5 us apart.
        |n| MS * 1_000_000 + n / 10 * 100_000_000 + n % 10 * 5_000,
        |n| MS * 1_000_000 + n / 2 * 10_000_000,
    ] {
        for file in written(at, (0..2000).map(stamp)) {
            let ran = strapd(at, &format!("info {file}"));
            ran.done();
            let ran = replay(at, file, "");
            assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
            assert!(!ran.err.contains("by their name"), "{ran:?}");
        }
    }
}

/// A table of a sensor at 100 Hz by the recorder's clock, with these stamps.
fn recorded(at: &Path, stamp: impl Fn(i64) -> i64) {
    let mut rows = "stamp_ns,log_ns,gyro_x,gyro_y,gyro_z\n".to_owned();
    for n in 0..2000 {
        let (log, rate) = (
            MS * 1_000_000 + 10_000_000 * n,
            0.3 * (n as f64 * 0.01).sin(),
        );
        rows += &format!("{},{log},{rate},0.1,-0.2\n", stamp(n));
    }
    std::fs::write(at.join("a.csv"), rows).unwrap();
}

#[test]
fn where_the_recorders_clock_goes_on_it_takes_the_place_of_stamps_that_no_gyro_has() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    type Stamps = (fn(i64) -> i64, &'static str);
    // A second that is always the same, with a microsecond for every one that passes; other units than their name says.
    let cases: [Stamps; 4] = [
        (
            |n| 1_751_654_798 + n / 100 * 1000,
            "that clock stands still",
        ),
        (|n| MS + 10 * n, "that clock stands still"),
        (
            |n| MS * 1000 + 10_000 * n,
            "their unit is 1000 times larger",
        ),
        (|n| 10_000_000_000 * n, "their unit is 1000 times smaller"),
    ];
    for (stamp, words) in cases {
        recorded(at, stamp);
        let ran = replay(at, "a.csv", "");
        let is_said = ran.out.contains(words) && ran.out.contains("using the log time");
        assert!(ran.code == Some(0) && is_said, "{ran:?}");
        assert!((secs(at) - 19.99).abs() < 1e-9, "{words}");
        let checked = strapd(at, "check a.csv");
        assert!(checked.out.contains(words), "{checked:?}");
    }
    // Both in milliseconds: nothing tells but the steps.
    let table = std::fs::read_to_string(at.join("a.csv")).unwrap();
    let rows = table.lines().enumerate().map(|(n, row)| match n {
        0 => format!("{row}\n"),
        _ => {
            let rates = row.splitn(3, ',').last().unwrap();
            let stamp = MS + 10 * n as i64;
            format!("{stamp},{stamp},{rates}\n")
        }
    });
    std::fs::write(at.join("a.csv"), rows.collect::<String>()).unwrap();
    replay(at, "a.csv", "").refused(1, &["stamps are in ns by their name"]);
}
