//! Decisions before the first sample is integrated: of a file of any format from the whole file.

use crate::program::{strapd, strapd_fed};
use std::fmt::Write as _;

/// The same samples in three formats: attitudes to the bit, and what a driver cut off is put back in each.
#[test]
fn a_table_and_lines_are_prepared_as_the_log_of_the_same_samples() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(
        at,
        "simulate walking --noise consumer,truncation=0.1 --rate-hz 100 --duration 60 --seed 3 -o log.mcap -q",
    )
    .done();
    for form in ["csv", "ndjson"] {
        let text = strapd(at, &format!("cat log.mcap --format {form}"));
        std::fs::write(at.join(format!("log.{form}")), &text.done().out).unwrap();
    }
    for flags in [
        "--aid gravity",
        "--aid gravity --smooth",
        "--aid gravity --method commit",
        "--aid none --undo-truncation on",
    ] {
        let attitudes = ["mcap", "csv", "ndjson"].map(|form| {
            let run = format!("replay log.{form} {flags} -o out.csv --force");
            let said = strapd(at, &run).done().out.clone();
            assert!(said.contains("the driver cut the rates"), "{run}: {said}");
            std::fs::read_to_string(at.join("out.csv")).unwrap()
        });
        assert!(attitudes[0].lines().count() > 6000, "{flags}");
        assert!(attitudes.iter().all(|a| *a == attitudes[0]), "{flags}");
        // Otherwise this test shows nothing.
        let off = flags.split(" --undo").next().unwrap();
        let run = format!("replay log.csv {off} --undo-truncation off -o out.csv --force");
        strapd(at, &run).done();
        let off = std::fs::read_to_string(at.join("out.csv")).unwrap();
        assert_ne!(off, attitudes[0], "{flags}");
    }
}

/// Beyond the first minute, which is what a stream is waited for.
#[test]
fn a_rest_is_found_wherever_it_is_in_lines_that_can_be_read_twice() {
    const BIAS: [f64; 3] = [0.01, -0.02, 0.003];
    let mut lines = String::new();
    for i in 0..8000_i64 {
        let secs = i as f64 / 100.0;
        let motion = match secs < 70.0 {
            true => [0.5 * secs.sin(), 0.3 * (2.0 * secs).cos(), 0.4],
            false => [1e-4 * ((i * 7 % 5) - 2) as f64; 3],
        };
        let gyro = [0, 1, 2].map(|axis| motion[axis] + BIAS[axis]);
        let stamp = i * 10_000_000;
        let _ = writeln!(
            lines,
            "{{\"stamp_ns\":{stamp},\"gyro\":{gyro:?},\"accel\":[0.01,0.02,9.81]}}"
        );
    }
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("late.ndjson"), &lines).unwrap();
    let flags = "--aid none --bias auto -o null: --json --quiet";
    let found = strapd(dir.path(), &format!("replay late.ndjson {flags}")).json();
    let bias = &found["topics"][0]["bias_rad_s"];
    for (axis, truth) in ["x", "y", "z"].into_iter().zip(BIAS) {
        let error = bias[axis].as_f64().unwrap() - truth;
        assert!(error.abs() < 1e-5, "{bias}");
    }
    strapd_fed(dir.path(), &format!("replay - {flags}"), lines)
        .refused(1, &["--bias auto", "never stands still"]);
}
