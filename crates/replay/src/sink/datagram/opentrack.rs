//! An attitude -> six numbers for opentrack ("UDP over network"). Pure.
//!
//! Little-endian doubles x, y, z in cm and yaw, pitch, roll in degrees. A gyro knows no place, so the first three are
//! nought. The angles are those of aviation, body forward, right, down: yaw positive to the right, pitch positive up, roll
//! positive to the right.
//!
//! # Source
//! opentrack: `tracker-udp/ftnoir_tracker_udp.cpp` (six doubles as they lie in memory), issues 420 and 881 (order, units).
//! The signs: `x-plane-plugin/plugin.c` gives yaw to X-Plane as heading and pitch as elevation unchanged;
//! `proto-ft/ftnoir_protocol_ft.cpp` turns the sign of yaw and pitch, and not of roll, for programs that count left and down
//! positive. Each axis can be inverted there.

use crate::sink::axes::roll_pitch_yaw;

/// Appends the datagram of an attitude, FRD body to NED.
pub(super) fn push(out: &mut Vec<u8>, q: [f64; 4]) {
    let [roll, pitch, yaw] = roll_pitch_yaw(q).map(f64::to_degrees);
    for number in [0.0, 0.0, 0.0, yaw, pitch, roll] {
        out.extend_from_slice(&number.to_le_bytes());
    }
}
