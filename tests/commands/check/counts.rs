//! Tables of raw counts of a body that swings about one axis: named by their chip, never as other axes.

use crate::program::strapd;
use std::fmt::Write as _;

/// A swing of `degrees` at `speed` rad/s about y, as an MPU-6050 counts it.
fn counts(degrees: f64, speed: f64) -> String {
    let mut rows = "time,ax,ay,az,gx,gy,gz\n".to_owned();
    for n in 0..3000 {
        let t = f64::from(n) * 0.01;
        let angle = degrees.to_radians() * (speed * t).sin();
        let rate = degrees * speed * (speed * t).cos();
        let shaken = f64::from(n * 7919 % 13) - 6.0;
        let [x, z] = [-16384.0 * angle.sin(), 16384.0 * angle.cos()].map(|a| (a + shaken).round());
        let rates = [12.0 + shaken, 131.0 * rate + shaken, shaken - 8.0].map(f64::round);
        let [gx, gy, gz] = rates;
        let _ = writeln!(rows, "{t:.2},{x},{shaken},{z},{gx},{gy},{gz}");
    }
    rows
}

#[test]
fn counts_of_a_swing_about_one_axis_are_named_by_their_chip_and_never_as_other_axes() {
    let dir = tempfile::tempdir().unwrap();
    for (degrees, speed) in [(40.0, 2.0), (30.0, 6.0), (60.0, 3.0), (20.0, 4.0)] {
        std::fs::write(dir.path().join("counts.csv"), counts(degrees, speed)).unwrap();
        let text = strapd(dir.path(), "check counts.csv --json").out;
        for wrong in [
            "gyro-axes",
            "gyro-turned",
            "gyro-against-gravity",
            "unit-unknown",
            "under-sampled",
        ] {
            assert!(
                !text.contains(&format!("\"{wrong}\"")),
                "{degrees} {speed}: {text}"
            );
        }
        assert!(
            text.contains("\"unit-against-gravity\""),
            "{degrees} {speed}: {text}"
        );
        let next = strapd(dir.path(), "info counts.csv").out;
        assert!(
            next.contains("attitude.mcap --gyro-scale 0.0001332"),
            "{next}"
        );
        let cured = strapd(
            dir.path(),
            "check counts.csv --gyro-scale 0.0001332 --accel-scale 0.0005985",
        );
        assert!(
            cured.out.contains("nothing wrong was found"),
            "{}",
            cured.out
        );
    }
}
