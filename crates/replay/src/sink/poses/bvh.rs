//! Frames -> a motion in Biovision's BVH. Pure.
//!
//! A flat skeleton: under one root that stands still a joint for each sensor, beside each other. The axes of animation: x to
//! the left, y up, z forward, right-handed. Channels are Y, X, Z, in degrees, applied in this order from the parent on: the
//! yaw, pitch and roll of the FLU body, which are about these axes in turn.
//!
//! # Source
//! Meredith and Maddock, Motion Capture File Formats Explained (University of Sheffield, CS-01-11), 4.3.

use super::Frames;
use crate::sink::axes::roll_pitch_yaw;
use std::fmt::Write;

/// Distance between two joints, and length of each.
const APART: f64 = 10.0;

/// Writes it.
pub(super) fn write(frames: &Frames) -> Vec<u8> {
    let mut out = String::from(
        "HIERARCHY\nROOT strapd\n{\n\tOFFSET 0 0 0\n\tCHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation\n",
    );
    for (n, name) in frames.names.iter().enumerate() {
        let aside = -APART * n as f64;
        let _ = write!(
            out,
            "\tJOINT {name}\n\t{{\n\t\tOFFSET {aside} 0 0\n\t\tCHANNELS 3 Yrotation Xrotation Zrotation\n\t\tEnd Site\n\t\t{{\n\t\t\tOFFSET 0 0 {APART}\n\t\t}}\n\t}}\n"
        );
    }
    let _ = write!(
        out,
        "}}\nMOTION\nFrames: {}\nFrame Time: {:.9}\n",
        frames.rows.len(),
        frames.step as f64 * 1e-9
    );
    for row in &frames.rows {
        out.push_str("0 0 0 0 0 0");
        for q in row {
            let [roll, pitch, yaw] = roll_pitch_yaw(*q).map(f64::to_degrees);
            let _ = write!(out, " {yaw:.9} {pitch:.9} {roll:.9}");
        }
        out.push('\n');
    }
    out.into_bytes()
}
