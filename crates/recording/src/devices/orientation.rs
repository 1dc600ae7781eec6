//! A device's own orientation, in the convention of its maker -> sensor to east, north, up. Pure.
//!
//! Apart from the protocols because makers have two conventions among them, and a recording has one (REP-103). The
//! heading of a device without a magnetometer begins anywhere: who compares aligns it.

use crate::records::imu::nwu_of_ned;
use std::f64::consts::FRAC_1_SQRT_2;
use strapd_attitude::quaternion::{Quaternion, YawPitchRoll};

/// Orientation `[w, x, y, z]` of a sensor (x forward, y left, z up) to east, north, up.
pub(super) type Orientation = [f64; 4];

/// Quaternion `[w, x, y, z]`, normalised; `None` of one that is no rotation.
pub(super) fn unit(wxyz: [f64; 4]) -> Option<Quaternion<(), ()>> {
    Quaternion::try_from_wxyz(wxyz).ok()
}

/// Rotation of angles in rad: by yaw about z, by pitch about the new y, by roll about the newest x.
pub(super) fn of_angles([roll, pitch, yaw]: [f64; 3]) -> Option<Quaternion<(), ()>> {
    let is_finite = [roll, pitch, yaw].iter().all(|angle| angle.is_finite());
    is_finite.then(|| Quaternion::from_yaw_pitch_roll(&YawPitchRoll { yaw, pitch, roll }))
}

/// Orientation of such a sensor to north, west, up.
pub(super) fn of_nwu(q: &Quaternion<(), ()>) -> Orientation {
    // East is behind west by a half turn, and north a quarter to its left.
    let quarter = Quaternion::<(), ()>::assume_unit([FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]);
    (quarter * *q).wxyz()
}

/// Orientation of a sensor with x forward, y right, z down to north, east, down.
pub(super) fn of_ned(q: &Quaternion<(), ()>) -> Orientation {
    let [x, y, z, w] = nwu_of_ned(q);
    of_nwu(&Quaternion::assume_unit([w, x, y, z]))
}
