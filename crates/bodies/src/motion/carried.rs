//! Courses of angles and places -> the motion of a sensor that somebody or something carries. Pure.
//!
//! A motion of its own kind because it accelerates: what a filter takes for gravity is gravity and the
//! motion together. Attitude and place are written as functions of time, and rates and accelerations
//! are their derivatives, carried along term by term ([`Jet`]), not differences.

use super::Kinematics;
use super::course::{Course, Instant, Rhythm};
use super::jet::Jet;
use crate::gauss::gauss;
use crate::rigid_body::Spin;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// Rule by which the position follows from the courses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Place {
    /// Along the heading at `speed`, with `sway` (m; ahead, left, up) about that way.
    Way,
    /// End of an arm: heading turns its base, `sway[0]` and `sway[1]` are the angles of
    /// shoulder and elbow from the vertical (rad), the links are as long as said (m).
    Arm([f64; 2]),
    /// Carried by a thrust along the body's z axis alone, against this gravity (m/s^2); `sway` comes
    /// on top, its z by more thrust.
    Thrust(f64),
}

/// A sensor that is carried: walking and running people, vehicles, arms, machines, hands.
///
/// # Convention
/// `q_nb = Rz(heading + yaw) Ry(pitch) Rx(roll)`: body axes ahead, left, up.
///
/// # Accuracy
/// Attitude, rate and acceleration to rounding of their size at any time: phases are reduced in 32
/// digits. Delta angle and mean force by Gauss's rule on pieces that end where a derivative jumps:
/// 1e-15 rad and 1e-12 m/s^2 (`crates/bodies/tests/bodies/carried.rs`).
#[derive(Clone, Debug)]
pub struct Carried {
    pub(super) rhythm: Rhythm,
    pub(super) heading: Course,
    /// m/s.
    pub(super) speed: Course,
    pub(super) sway: [Course; 3],
    /// Yaw against the heading, pitch, roll.
    pub(super) turn: [Course; 3],
    pub(super) place: Place,
}

impl Carried {
    /// Attitude and body rate at `nanos` nanoseconds.
    #[must_use]
    pub fn at_nanos(&self, nanos: u64) -> Spin {
        self.at(nanos, 0.0).spin
    }

    /// All that a sensor at the origin of the body axes feels, `beyond` seconds after `nanos`.
    #[must_use]
    pub fn at(&self, nanos: u64, beyond: f64) -> Kinematics {
        let beat = self.rhythm.at(Instant::new(nanos, beyond));
        let [mut yaw, mut pitch, roll] = [0, 1, 2].map(|i| self.turn[i].at(&beat));
        let sway = [0, 1, 2].map(|i| self.sway[i].at(&beat));
        let heading = self.heading.at(&beat);
        yaw = yaw + heading;
        if let Place::Arm(_) = self.place {
            pitch = pitch + sway[0] + sway[1];
        }
        let (q, w, change) = turning(yaw, pitch, roll);
        let (sin, cos) = heading.sin_cos();
        let acceleration_n = match self.place {
            Place::Way => {
                let speed = self.speed.at(&beat);
                let ahead = cos * sway[0] - sin * sway[1];
                let left = sin * sway[0] + cos * sway[1];
                Vector3::new(
                    ahead.bend + (speed * cos).rate,
                    left.bend + (speed * sin).rate,
                    sway[2].bend,
                )
            }
            Place::Arm([upper, fore]) => {
                let (s1, c1) = sway[0].sin_cos();
                let (s2, c2) = (sway[0] + sway[1]).sin_cos();
                let out = s1 * upper + s2 * fore;
                let up = c1 * upper + c2 * fore;
                Vector3::new((cos * out).bend, (sin * out).bend, up.bend)
            }
            Place::Thrust(gravity) => {
                let z_n = quat::matrix(&q).column(2).into_owned();
                let thrust = (gravity + sway[2].bend) / z_n.z;
                let aside = Vector3::new(sway[0].bend, sway[1].bend, -gravity);
                z_n * thrust + aside
            }
        };
        Kinematics {
            spin: Spin {
                q_nb: Quaternion::assume_unit(q),
                w_nb_b: w,
            },
            rate_change: change,
            acceleration_n,
        }
    }

    /// Integral of the body rate over `from..to` in nanoseconds, rad.
    #[must_use]
    pub fn delta_angle(&self, from: u64, to: u64) -> Vector3<f64> {
        self.integral(from, to, |k| k.spin.w_nb_b)
    }

    /// Integral of what `read` makes of the motion over `from..to` in nanoseconds.
    pub(super) fn integral(
        &self,
        from: u64,
        to: u64,
        read: impl Fn(&Kinematics) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let (sign, from, to) = if to >= from {
            (1.0, from, to)
        } else {
            (-1.0, to, from)
        };
        let mut joints = vec![from, to];
        self.rhythm.joints(from, to, &mut joints);
        for course in self.courses() {
            course.joints(from, to, &mut joints);
        }
        joints.sort_unstable();
        joints.dedup();
        // One rad of the fastest wave in a piece, and little of a step: below rounding with eight points.
        let longest = (1.0 / (TAU * self.highest_hz())).min(0.05);
        let mut sum = Vector3::zeros();
        for pair in joints.windows(2) {
            let &[start, end] = pair else { continue };
            let whole = (end - start) as f64 * 1e-9;
            let pieces = (whole / longest).ceil().clamp(1.0, 1e6) as u32;
            gauss(whole, pieces, |secs, weight| {
                sum += read(&self.at(start, secs)) * weight;
            });
        }
        sum * sign
    }

    fn courses(&self) -> impl Iterator<Item = &Course> {
        [&self.heading, &self.speed]
            .into_iter()
            .chain(&self.sway)
            .chain(&self.turn)
    }

    fn highest_hz(&self) -> f64 {
        self.courses()
            .map(|c| c.highest_hz(self.rhythm.stride_hz))
            .fold(0.0, f64::max)
    }
}

/// Yaw, pitch and roll -> attitude, body rate and its rate of change.
fn turning(yaw: Jet, pitch: Jet, roll: Jet) -> ([f64; 4], Vector3<f64>, Vector3<f64>) {
    let half = |angle: Jet| (0.5 * angle.value).sin_cos();
    let ((sy, cy), (sp, cp), (sr, cr)) = (half(yaw), half(pitch), half(roll));
    let q = quat::product(
        &quat::product(&[cy, 0.0, 0.0, sy], &[cp, 0.0, sp, 0.0]),
        &[cr, sr, 0.0, 0.0],
    );
    let ((sp, cp), (sr, cr)) = (pitch.sin_cos(), roll.sin_cos());
    let [yaw, pitch, roll] = [yaw, pitch, roll].map(Jet::derivative);
    let w = [
        roll - yaw * sp,
        pitch * cr + yaw * cp * sr,
        yaw * cp * cr - pitch * sr,
    ];
    (
        quat::normalised(&q),
        Vector3::from(w.map(|w| w.value)),
        Vector3::from(w.map(|w| w.rate)),
    )
}
