//! A window of p samples against one of p - 4 -> how wrong the integration may be. Pure.
//!
//! Both windows interpolate the rate; where they differ the narrower one errs, and the wider one, of
//! higher order, errs less: so the attitude by which they differ bounds the error of the one that is
//! used (`docs/theory/attitude.md` 6.4). The second attitude is not integrated. To first order it is the sum, in fixed
//! axes, of what the outer samples changed about each step, and that is one more number from the same
//! interpolation.
//!
//! # Accuracy
//! To first order in the difference: within a tenth of the true one away from the ends of runs, on
//! motion windows can follow at all. At an end, where windows are one-sided, up to ten times it, and thirty
//! for a method that does not wait (`crates/bodies/tests/bodies/accuracy/integration_error.rs`).

use super::accumulate::Accumulator;
use super::method::Order;

/// Number of samples by which the window that is compared with is shorter.
pub(crate) const FEWER: usize = 4;

/// Rounding of rates or increments to `f64`, half a unit in the last place: what every angle may be off
/// by, were all to the same side.
const ROUNDING: f64 = 0.5 * f64::EPSILON;

/// Attitude by which two windows differ.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Difference {
    /// Rad, in fixed axes.
    sum: [f64; 3],
    worst_squared: f64,
}

impl Difference {
    /// Adds a step's difference, rad, in the body axes at the step's end.
    #[inline(always)]
    pub(crate) fn add(&mut self, attitude: &Accumulator, step: [f64; 3]) {
        let turned = attitude.turned(step);
        let mut squared = 0.0;
        for i in 0..3 {
            self.sum[i] += turned[i];
            squared += self.sum[i] * self.sum[i];
        }
        // Also takes a NaN for nothing.
        if squared > self.worst_squared {
            self.worst_squared = squared;
        }
    }

    /// The attitude is the initial one again: without error. The worst there was remains.
    pub(crate) fn restart(&mut self) {
        self.sum = [0.0; 3];
    }

    /// The other's worst, too.
    #[inline(always)]
    pub(crate) fn seen(&mut self, other: &Difference) {
        self.worst_squared = self.worst_squared.max(other.worst_squared);
    }

    /// Largest attitude error over a run in which `turned` rad were turned in all, rad: the largest
    /// difference, and rounding.
    pub(crate) fn worst(&self, turned: f64) -> f64 {
        self.worst_squared.sqrt() + turned * ROUNDING + 2.0 * f64::EPSILON
    }
}

/// Whether two windows' difference says how wrong the wider one is: not where the wider one's error is that
/// of its order, which both share.
pub(crate) fn tells(window: usize, order: Order, increments: bool) -> bool {
    // A window of increments has the order of one more rate.
    let points = window + usize::from(increments);
    let rank = match order {
        Order::M2 => 2,
        Order::M4 => 4,
        Order::M6 => 6,
        Order::M8 => 8,
        Order::Exact => usize::MAX,
    };
    points >= FEWER + 2 && rank > points - FEWER
}
