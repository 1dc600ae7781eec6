//! Yaw-pitch-roll <-> quaternion, for people and for messages that know nothing else. Pure.
//!
//! Apart from `attitude` because nothing here is integrated: angles are a display.

use super::{Quaternion, RotationVector};
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Turn by yaw about z, then by pitch about the new y, then by roll about the newest x
/// (intrinsic z-y'-x'', the aviation and ROS `rpy` sequence), rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct YawPitchRoll {
    /// About z, in -pi..=pi.
    pub yaw: f64,
    /// About y', in -pi/2..=pi/2. What it means (nose up or down) depends on the axes:
    /// up in NED/FRD, down in ENU/FLU.
    pub pitch: f64,
    /// About x'', in -pi..=pi.
    pub roll: f64,
}

impl<To, From> Quaternion<To, From> {
    /// `q = q_z(yaw) q_y(pitch) q_x(roll)`.
    #[must_use]
    pub fn from_yaw_pitch_roll(angles: &YawPitchRoll) -> Self {
        let about = |axis: Vector3<f64>, angle: f64| {
            Quaternion::<To, To>::from_rotation_vector(&RotationVector(axis * angle))
        };
        let q = about(Vector3::z(), angles.yaw)
            * about(Vector3::y(), angles.pitch)
            * about(Vector3::x(), angles.roll);
        Self::assume_unit(q.wxyz())
    }

    /// The three angles. At pitch +-90 degrees only yaw minus (plus) roll means anything; roll is
    /// then 0 and yaw carries the turn.
    ///
    /// # Accuracy
    /// Put together again they give the attitude to 3e-15 rad, gimbal lock included.
    ///
    /// # Source
    /// Bernardes and Viollet, "Quaternion to Euler angles conversion", PLoS ONE 17(11), 2022: half
    /// sums and half differences of yaw and roll are plain arguments of pairs of components.
    #[must_use]
    pub fn yaw_pitch_roll(&self) -> YawPitchRoll {
        let [w, x, y, z] = self.wxyz();
        // (w + y, x - z) = up (cos, sin)((roll - yaw)/2), up = sqrt 2 sin(45 deg + pitch/2)
        // (w - y, x + z) = down (cos, sin)((roll + yaw)/2), down = sqrt 2 sin(45 deg - pitch/2)
        let up = (w + y).hypot(x - z);
        let down = (w - y).hypot(x + z);
        let pitch = 2.0 * up.atan2(down) - FRAC_PI_2;
        let half_difference = (x - z).atan2(w + y);
        let half_sum = (x + z).atan2(w - y);
        // Below this the argument is that of rounding errors; setting roll to 0 costs as little.
        const LOCKED: f64 = 1e-15;
        let (yaw, roll) = if down < LOCKED {
            (-2.0 * half_difference, 0.0)
        } else if up < LOCKED {
            (2.0 * half_sum, 0.0)
        } else {
            (half_sum - half_difference, half_sum + half_difference)
        };
        YawPitchRoll {
            yaw: wrapped(yaw),
            pitch,
            roll: wrapped(roll),
        }
    }
}

/// Into -pi..=pi, from -2pi..=2pi.
fn wrapped(angle: f64) -> f64 {
    if angle > PI {
        angle - 2.0 * PI
    } else if angle < -PI {
        angle + 2.0 * PI
    } else {
        angle
    }
}
