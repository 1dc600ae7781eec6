//! Frames -> a table of orientations for OpenSim's OpenSense. Pure.
//!
//! One column a sensor: `w,x,y,z` from its body to a world with z up. OpenSense turns that into its own world with y up by
//! `sensor_to_opensim_rotations` (-pi/2, 0, 0), its default for data of sensors.
//!
//! # Source
//! OpenSim's documentation, "OpenSense - Kinematics with IMU Data"; the header of `STOFileAdapter`.

use super::Frames;
use std::fmt::Write;

/// Writes it.
pub(super) fn write(frames: &Frames) -> Vec<u8> {
    let mut out = format!(
        "DataRate={:.6}\nDataType=Quaternion\nversion=3\nOpenSimVersion=4.1\nendheader\ntime",
        1e9 / frames.step as f64
    );
    for name in &frames.names {
        let _ = write!(out, "\t{name}");
    }
    out.push('\n');
    for (n, row) in (0i64..).zip(&frames.rows) {
        let _ = write!(out, "{:.9}", n.saturating_mul(frames.step) as f64 * 1e-9);
        for [w, x, y, z] in row {
            let _ = write!(out, "\t{w},{x},{y},{z}");
        }
        out.push('\n');
    }
    out.into_bytes()
}
