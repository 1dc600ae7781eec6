//! Coefficients up to power k of attitude, rate and gravity -> coefficient k + 1. Pure.
//!
//! The recurrences alone, for both kinds of number they are run in.

use crate::double_double::DoubleDouble;
use std::ops::{Add, Mul, Sub};

/// Degree of the series.
pub(super) const ORDER: usize = 24;
/// Coefficients up to this one in 32 digits; the term after it is below 1e-5 of the first, and
/// 1e-5 of an `f64`'s 1e-16 is the 1e-21 aimed at.
pub(super) const LOW: usize = 6;
const REMAINDER: f64 = 1e-21;
/// A body at rest has no time scale of its own, s.
const LONGEST: f64 = 1.0;

/// Operations that a recurrence needs of a number.
pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    const ZERO: Self;
    fn over(self, n: f64) -> Self;
}
impl Number for f64 {
    const ZERO: Self = 0.0;
    fn over(self, n: f64) -> Self {
        self / n
    }
}
impl Number for DoubleDouble {
    const ZERO: Self = DoubleDouble::ZERO;
    fn over(self, n: f64) -> Self {
        self / DoubleDouble::from(n)
    }
}

/// Coefficients `[component][power]` of attitude, rate, momentum and gravity in body axes.
#[derive(Clone, Debug)]
pub(super) struct Series<T> {
    pub(super) q: [[T; ORDER + 1]; 4],
    pub(super) w: [[T; ORDER + 1]; 3],
    momentum: [[T; ORDER + 1]; 3],
    pub(super) gravity: [[T; ORDER + 1]; 3],
}

impl<T: Number> Series<T> {
    pub(super) fn zero() -> Self {
        Self {
            q: [[T::ZERO; ORDER + 1]; 4],
            w: [[T::ZERO; ORDER + 1]; 3],
            momentum: [[T::ZERO; ORDER + 1]; 3],
            gravity: [[T::ZERO; ORDER + 1]; 3],
        }
    }

    /// Coefficient k of the cross product of two vectors of series.
    fn cross(a: &[[T; ORDER + 1]; 3], b: &[[T; ORDER + 1]; 3], k: usize) -> [T; 3] {
        let mut sum = [T::ZERO; 3];
        for j in 0..=k {
            let [ax, ay, az] = [a[0][j], a[1][j], a[2][j]];
            let [bx, by, bz] = [b[0][k - j], b[1][k - j], b[2][k - j]];
            sum[0] = sum[0] + (ay * bz - az * by);
            sum[1] = sum[1] + (az * bx - ax * bz);
            sum[2] = sum[2] + (ax * by - ay * bx);
        }
        sum
    }

    /// Adds coefficient k + 1 of the quaternion, given coefficients up to k.
    pub(super) fn extend_attitude(&mut self, k: usize) {
        let mut sum = [T::ZERO; 4];
        for j in 0..=k {
            let [q0, q1, q2, q3] = [self.q[0][j], self.q[1][j], self.q[2][j], self.q[3][j]];
            let [x, y, z] = [self.w[0][k - j], self.w[1][k - j], self.w[2][k - j]];
            sum[0] = sum[0] - (q1 * x + q2 * y + q3 * z);
            sum[1] = sum[1] + (q0 * x + q2 * z - q3 * y);
            sum[2] = sum[2] + (q0 * y - q1 * z + q3 * x);
            sum[3] = sum[3] + (q0 * z + q1 * y - q2 * x);
        }
        for (q, sum) in self.q.iter_mut().zip(sum) {
            q[k + 1] = sum.over(2.0 * (k + 1) as f64);
        }
    }

    /// Adds coefficient k + 1 of the rates and of gravity in body axes, given coefficients up to k.
    pub(super) fn extend_heavy(
        &mut self,
        k: usize,
        inertia: &[[T; 3]; 3],
        inverse: &[[T; 3]; 3],
        moment: &[T; 3],
    ) {
        let n = (k + 1) as f64;
        let gyroscopic = Self::cross(&self.momentum, &self.w, k);
        let gravity = Self::cross(&self.gravity, &self.w, k);
        let g = &self.gravity;
        let change: [T; 3] = std::array::from_fn(|i| {
            let (y, z) = ((i + 1) % 3, (i + 2) % 3);
            gyroscopic[i] + moment[y] * g[z][k] - moment[z] * g[y][k]
        });
        for i in 0..3 {
            let row = &inverse[i];
            let w_dot = row[0] * change[0] + row[1] * change[1] + row[2] * change[2];
            self.w[i][k + 1] = w_dot.over(n);
            self.gravity[i][k + 1] = gravity[i].over(n);
        }
        self.fill_momentum(k + 1, inertia);
    }

    pub(super) fn fill_momentum(&mut self, k: usize, inertia: &[[T; 3]; 3]) {
        let [x, y, z] = [self.w[0][k], self.w[1][k], self.w[2][k]];
        for (momentum, row) in self.momentum.iter_mut().zip(inertia) {
            momentum[k] = row[0] * x + row[1] * y + row[2] * z;
        }
    }
}

impl Series<f64> {
    pub(super) fn copy_low(&mut self, low: &Series<DoubleDouble>) {
        let pairs = [
            (&mut self.q[..], &low.q[..]),
            (&mut self.w[..], &low.w[..]),
            (&mut self.momentum[..], &low.momentum[..]),
            (&mut self.gravity[..], &low.gravity[..]),
        ];
        for (to, from) in pairs {
            for (to, from) in to.iter_mut().zip(from) {
                for k in 0..=LOW {
                    to[k] = from[k].to_f64();
                }
            }
        }
    }

    /// Length over which the series may be trusted: where its last two terms, whatever their ratio to the
    /// ones before, have fallen to [`REMAINDER`] of the first.
    pub(super) fn converged_length(&self) -> f64 {
        let largest =
            |s: &[[f64; ORDER + 1]], k: usize| s.iter().fold(0.0_f64, |m, c| m.max(c[k].abs()));
        // A rate that passes through zero is judged by what its change does to the attitude.
        let rate_scale = largest(&self.w, 0).max(1.0);
        let gravity_scale = largest(&self.gravity, 0);
        let mut length = LONGEST;
        for (series, scale) in [
            (&self.q[..], 1.0),
            (&self.w[..], rate_scale),
            (&self.gravity[..], gravity_scale),
        ] {
            for k in [ORDER - 1, ORDER] {
                let last = largest(series, k);
                if last > 0.0 && scale > 0.0 {
                    let radius = (REMAINDER * scale / last).powf(1.0 / k as f64);
                    length = length.min(radius);
                }
            }
        }
        few_bits(length)
    }
}

/// Rounded down to 8 significant bits, so that joints are short numbers.
fn few_bits(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & !((1 << 44) - 1))
}
