//! A motion and a lever arm -> what a perfect accelerometer reads. Pure.
//!
//! `f_b = C_nb^T (a_n - g_n) + w_dot x r + w x (w x r)`, with r from the point whose motion is known to
//! the sensor, body axes: 9.8 m/s^2 upwards at rest.

use super::{Kinematics, Motion};
use crate::gauss::gauss;
use nalgebra::Vector3;
use strapd_attitude::frames::{In, Nav};

/// Accelerometer: where it sits, and the gravity that acts on it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Accelerometer {
    /// Vector from the origin of the body axes, m, body axes.
    pub lever_b: Vector3<f64>,
    /// m/s^2, downwards.
    pub gravity: f64,
}

impl Accelerometer {
    /// Kinematics of the motion at `nanos` for [`Self::read`]: without a lever arm nothing of how
    /// the rate changes, which costs a random motion as much as all the rest.
    pub fn felt(&self, motion: &mut Motion, nanos: u64) -> Kinematics {
        match motion {
            Motion::BandLimited(m) if self.lever_b == Vector3::zeros() => Kinematics {
                spin: m.at_nanos(nanos),
                rate_change: Vector3::zeros(),
                acceleration_n: Vector3::zeros(),
            },
            _ => motion.kinematics(nanos),
        }
    }

    /// Reading of the accelerometer, m/s^2, body axes.
    #[must_use]
    pub fn read(&self, k: &Kinematics) -> Vector3<f64> {
        let held_n = In::<Nav>::assume(k.acceleration_n + Vector3::new(0.0, 0.0, self.gravity));
        let f_b = *(k.spin.q_nb.inverse() * held_n).as_vector();
        if self.lever_b == Vector3::zeros() {
            return f_b;
        }
        let (w, r) = (&k.spin.w_nb_b, &self.lever_b);
        f_b + k.rate_change.cross(r) + w.cross(&w.cross(r))
    }

    /// Mean reading over `from..to` in nanoseconds, `to` after `from`, m/s^2: body axes as they rotate, as a
    /// sensor takes it.
    ///
    /// # Accuracy
    /// 1e-12 m/s^2 for [`Motion::Carried`]. The others are looked at on whole nanoseconds, which is half
    /// a nanosecond of the change of the force at each point at most: 1e-7 m/s^2 at 200 m/s^3.
    pub fn mean(&self, motion: &mut Motion, from: u64, to: u64) -> Vector3<f64> {
        let secs = to.saturating_sub(from) as f64 * 1e-9;
        if secs == 0.0 {
            return self.read(&self.felt(motion, to));
        }
        if let Motion::Carried(carried) = motion {
            return carried.integral(from, to, |k| self.read(k)) / secs;
        }
        let turned = motion.at_nanos(from).w_nb_b.norm() * secs;
        let pieces = (2.0 * turned).ceil().clamp(1.0, 64.0) as u32;
        let mut sum = Vector3::zeros();
        gauss(secs, pieces, |since, weight| {
            let at = from + (since * 1e9).round() as u64;
            sum += self.read(&self.felt(motion, at)) * weight;
        });
        sum / secs
    }
}
