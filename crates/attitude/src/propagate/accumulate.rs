//! Turns, one after another -> attitude. Pure.
//!
//! A quaternion with the part its last addition could not hold (four Kahan sums): the error of
//! a step is |phi| 1e-16 instead of 1e-16, which over 1e8 steps is 1e-14 instead of 1e-12 rad, and
//! on a body turning with the Earth 1e-17 instead of 2e-11 (`docs/theory/attitude.md` 5). It is normalised on
//! output, never in the recursion, where normalising makes constant rotation worse.

use crate::plausible::is_unit;
use crate::quaternion::kernel;

/// Attitude q_nb under accumulation.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Accumulator {
    #[cfg_attr(feature = "serde", serde(rename = "attitude"))]
    q: [f64; 4],
    /// Excess of `q` over what was accumulated.
    excess: [f64; 4],
}

impl Accumulator {
    /// Begins with a unit quaternion `[w, x, y, z]`.
    pub(crate) fn new(q: [f64; 4]) -> Self {
        Accumulator {
            q,
            excess: [0.0; 4],
        }
    }

    /// Whether it can have come about.
    pub(crate) fn is_plausible(&self) -> bool {
        is_unit(&self.q) && self.excess.iter().all(|c| c.abs() < 1e-6)
    }

    /// Turns on by `[cos(a/2) - 1, x, y, z]`, about body axes: the increment multiplies on the right.
    #[inline(always)]
    pub(crate) fn turn(&mut self, [c, x, y, z]: [f64; 4]) {
        let [qw, qx, qy, qz] = self.q;
        // `kernel::product` adds from left to right, one sum waiting for the other. Here two halves are summed side by
        // side, which every attitude keeps in its last bits.
        let delta = [
            (qw * c - qx * x) - (qy * y + qz * z),
            (qw * x + qx * c) + (qy * z - qz * y),
            (qw * y + qy * c) + (qz * x - qx * z),
            (qw * z + qz * c) + (qx * y - qy * x),
        ];
        for i in 0..4 {
            let wanted = delta[i] - self.excess[i];
            let sum = self.q[i] + wanted;
            self.excess[i] = (sum - self.q[i]) - wanted;
            self.q[i] = sum;
        }
    }

    /// A vector of body axes in fixed ones; as exact as the norm, which is within 1e-12.
    #[inline(always)]
    pub(crate) fn turned(&self, vector: [f64; 3]) -> [f64; 3] {
        kernel::rotated(&self.q, vector)
    }

    /// The unit quaternion. Its sign never jumps: accumulation is continuous and normalising keeps it.
    ///
    /// Also brings the norm back, should years of samples have moved it: from where this is called
    /// on every sample, at the same samples for everybody.
    #[inline(always)]
    pub(crate) fn attitude(&mut self) -> [f64; 4] {
        let [w, x, y, z] = self.q;
        let n = (w * w + x * x) + (y * y + z * z);
        // 1/sqrt(n) to second order: n - 1 stays below 1e-12.
        let scale = 1.5 - 0.5 * n;
        let unit = self.q.map(|c| c * scale);
        if (n - 1.0).abs() > 1e-12 {
            let scale = 1.0 / n.sqrt();
            *self = Accumulator::new(self.q.map(|c| c * scale));
            return self.q;
        }
        unit
    }

    /// Starts again at `q`, on the side of the sphere where the attitude was.
    pub(crate) fn restart(&mut self, q: [f64; 4]) {
        let sign = if kernel::dot(&q, &self.q) < 0.0 {
            -1.0
        } else {
            1.0
        };
        *self = Accumulator::new(q.map(|c| c * sign));
    }
}

#[cfg(test)]
mod tests;
