//! Classical coning: the body axis x runs round a cone of half angle `a` at `W` rad/s while the body does
//! not turn about it on average. Attitude, rate and delta angle in closed form (`docs/theory/attitude.md` 10).
//!
//! q = [cos(a/2), 0, sin(a/2) cos Wt, sin(a/2) sin Wt].

use std::f64::consts::TAU;

pub struct Coning {
    /// Half angle, rad.
    pub a: f64,
    /// Cone frequency and sampling frequency, Hz, as whole numbers, so that phases are exact.
    pub cone: i64,
    pub sampling: i64,
}

impl Coning {
    fn phase(&self, k: i64) -> f64 {
        TAU * (self.cone * k).rem_euclid(self.sampling) as f64 / self.sampling as f64
    }

    fn speed(&self) -> f64 {
        TAU * self.cone as f64
    }

    pub fn attitude(&self, k: i64) -> [f64; 4] {
        let (s, c) = (0.5 * self.a).sin_cos();
        let (sin, cos) = self.phase(k).sin_cos();
        [c, 0.0, s * cos, s * sin]
    }

    pub fn rate(&self, k: i64) -> [f64; 3] {
        let w = self.speed();
        let half = (0.5 * self.a).sin();
        let (sin, cos) = self.phase(k).sin_cos();
        let across = w * self.a.sin();
        [-2.0 * w * half * half, -across * sin, across * cos]
    }

    /// Integral of the rate from sample k - 1 to k.
    pub fn increment(&self, k: i64) -> [f64; 3] {
        let half = (0.5 * self.a).sin();
        let step = TAU * self.cone as f64 / self.sampling as f64;
        let chord = 2.0 * self.a.sin() * (0.5 * step).sin();
        let (sin, cos) = (self.phase(k) - 0.5 * step).sin_cos();
        [-2.0 * step * half * half, -chord * sin, chord * cos]
    }
}
