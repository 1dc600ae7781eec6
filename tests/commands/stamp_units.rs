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
