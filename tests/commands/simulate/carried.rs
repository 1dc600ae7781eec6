//! Sensors that are carried: what is written is what was.

use super::largest_error;
use crate::program::strapd;

#[test]
fn attitude_comes_back_from_what_a_carried_gyro_puts_out() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for motion in [
        "walking --worn foot",
        "running",
        "circling",
        "arm",
        "hand",
        "boat",
    ] {
        let flags = "--duration 60 --rate-hz 500 --sample-kind delta-angle";
        strapd(at, &format!("simulate {motion} {flags} -o m.mcap --force")).done();
        strapd(
            at,
            "replay m.mcap --sample-kind delta-angle -o est.mcap --force",
        )
        .done();
        let (error, samples) = largest_error(at, "est.mcap", "m.mcap");
        println!("{motion}: {error:e} deg");
        assert_eq!(samples, 30_000, "{motion}");
        // 2 ms of joints and steps whose third derivative jumps.
        assert!(error < 1e-4, "{motion}: {error:e} deg");
    }
}

#[test]
fn a_lever_arm_and_the_sampling_of_the_force_change_the_force_alone() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rows = |flags: &str| {
        let made =
            format!("simulate hand --duration 6 --rate-hz 100 --sample-kind average {flags}");
        strapd(at, &format!("{made} -o m.csv --force")).done();
        let text = std::fs::read_to_string(at.join("m.csv")).unwrap();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|l| {
                // The last column is a word.
                let numbers = l.rsplit_once(',').unwrap().0;
                numbers.split(',').map(|v| v.parse().unwrap()).collect()
            })
            .collect();
        assert_eq!(rows.len(), 600);
        rows
    };
    let plain = rows("");
    let instant = rows("--force-sampling instant");
    let lever = rows("--lever-arm 0.1,0,0");
    let difference = |a: &[Vec<f64>], b: &[Vec<f64>], columns: std::ops::Range<usize>| {
        let pairs = a.iter().zip(b);
        pairs
            .flat_map(|(a, b)| columns.clone().map(|i| (a[i] - b[i]).abs()))
            .fold(0.0, f64::max)
    };
    for other in [&instant, &lever] {
        assert_eq!(difference(&plain, other, 2..5), 0.0, "the gyro");
        assert_eq!(difference(&plain, other, 8..12), 0.0, "the truth");
    }
    // Half an interval of a force that changes by up to 100 m/s^3.
    let moved = difference(&plain, &instant, 5..8);
    assert!((0.01..1.0).contains(&moved), "{moved}");
    // 0.1 m at some rad/s and tens of rad/s^2.
    let moved = difference(&plain, &lever, 5..8);
    assert!((0.05..5.0).contains(&moved), "{moved}");
}
