//! q_ib -> q_nb over a world that turns at a constant rate. Pure.
//!
//! Apart from the state because it is a closed form, not an integration. Gyros measure w_ib, so what is
//! accumulated is q_ib, with i the world as it stood at an instant t0. The world turns away from it at
//! w_in^n, and turns on the left and on the right commute, so that for a constant w_in^n
//!
//! `q_nb(t) = exp(-w_in^n (t - t0)) q_ib(t)`
//!
//! is exact whatever the body does (`docs/theory/attitude.md` 6.4). Taking C^T w_in from every sample instead
//! is off by 0.25 arcsec in 600 s with its coning term and by 2500 without.

use crate::propagate::columns::secs;
use crate::quaternion::kernel as quat;
use nalgebra::Vector3;

/// A world that turns.
#[derive(Clone, Copy, Debug)]
pub(super) struct TurningWorld {
    /// rad/s
    speed: f64,
    axis: Vector3<f64>,
}

impl TurningWorld {
    /// `None` for a world that stands still.
    pub(super) fn new(w_in_n: &Vector3<f64>) -> Option<Self> {
        let speed = w_in_n.norm();
        (speed > 0.0).then(|| TurningWorld {
            speed,
            axis: w_in_n / speed,
        })
    }

    /// The attitude of a body whose q_ib is given, `nanos` after t0. Continuous in time, sign included.
    pub(super) fn attitude(&self, nanos: i64, q_ib: &[f64; 4]) -> [f64; 4] {
        // Integers first, so that a run of a day keeps its nanoseconds.
        let half = 0.5 * self.speed * secs(nanos);
        let (sin, cos) = half.sin_cos();
        let turned = [
            cos,
            -sin * self.axis.x,
            -sin * self.axis.y,
            -sin * self.axis.z,
        ];
        quat::normalised(&quat::product(&turned, q_ib))
    }
}
