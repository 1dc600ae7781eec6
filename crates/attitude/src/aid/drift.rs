//! Corrections of the gyro's bias, one after another -> the random walk that its class lacks. Pure.
//!
//! Corrections of a bias that wanders as expected go either way. Those of one that drifts, as a sensor warms up or
//! cools, go one way, and the square of their sum exceeds its variance: what exceeds it is the walk that is missing
//! (an adaptive process noise by innovations). Without it the bias lags, gravity contradicts the attitude for longer
//! and longer, and the contradiction is taken for an acceleration.

use crate::plausible::{are_numbers, is_amount};
use nalgebra::Vector3;

/// Time over which corrections are added up, s.
const SUM_SECS: f64 = 15.0;
/// Sigma of each axis by which a bias is known for the first time, rad/s (0.1 deg/s).
const KNOWN: f64 = 1.75e-3;
/// Least change that is one, rad/s (0.5 deg/s), and in sigmas of both.
const MOVED: f64 = 8.7e-3;
const MOVED_SIGMAS: f64 = 5.0;

/// Sums of corrections by gravity, and the bias as it was first known.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Drift {
    /// Corrections of the last seconds, rad/s, body axes.
    sum: Vector3<f64>,
    /// Variance of the sum by the covariance, (rad/s)^2.
    variance: Vector3<f64>,
    /// Bias when it was known for the first time, and its sigma, rad/s.
    first: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl Drift {
    /// Takes the correction of an interval of `secs`, and by how much it has reduced the variance of each axis.
    pub(super) fn take(&mut self, by: &Vector3<f64>, reduced: &Vector3<f64>, secs: f64) {
        let kept = 1.0 - (secs / SUM_SECS).min(1.0);
        self.sum = self.sum * kept + by;
        self.variance = self.variance * (kept * kept) + reduced.map(|v| v.max(0.0));
    }

    /// Variance by which the bias wanders more than its class, (rad/s)^2/s; `gain` multiplies what was found. Of all axes
    /// as of the one it is most of: what moves one, a temperature, moves the others, and gravity does not show each.
    pub(super) fn excess(&self, gain: f64) -> f64 {
        let over = self.sum.component_mul(&self.sum) - self.variance;
        gain * over.max().max(0.0) / SUM_SECS
    }

    /// Takes the bias and its sigma after a correction.
    pub(super) fn know(&mut self, bias: &Vector3<f64>, sigma: &Vector3<f64>) {
        if self.first.is_none() && sigma.amax() < KNOWN {
            self.first = Some((*bias, *sigma));
        }
    }

    /// Bias when it was first known, if `bias` is clearly another by now.
    pub(super) fn moved_from(
        &self,
        bias: &Vector3<f64>,
        sigma: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let (first, first_sigma) = self.first?;
        let is_another = |i: usize| {
            let sigma = first_sigma[i].hypot(sigma[i]);
            (bias[i] - first[i]).abs() > MOVED.max(MOVED_SIGMAS * sigma)
        };
        (0..3).any(is_another).then_some(first)
    }

    /// Whether it can have been seen: what a file says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        let known = self.first.iter().flat_map(|(bias, sigma)| [bias, sigma]);
        are_numbers(&self.sum)
            && self.variance.iter().all(|v| is_amount(*v))
            && known.into_iter().all(are_numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.1;
    const ONE: f64 = 1e-4;

    fn after(steps: usize, correction: impl Fn(usize) -> f64) -> Drift {
        let mut drift = Drift::default();
        for k in 0..steps {
            let by = Vector3::new(correction(k), 0.0, 0.0);
            drift.take(&by, &Vector3::repeat(ONE * ONE), STEP);
        }
        drift
    }

    #[test]
    fn corrections_either_way_add_no_walk_and_those_of_one_sign_do() {
        let either = after(600, |k| if k % 2 == 0 { ONE } else { -ONE });
        assert_eq!(either.excess(1.0), 0.0);
        // 150 corrections in the sum, whose variance is half of theirs.
        let one_way = after(2000, |_| ONE).excess(1.0) * SUM_SECS / (ONE * ONE);
        assert!(
            (one_way - (150.0 * 150.0 - 75.0)).abs() < 200.0,
            "{one_way}"
        );
        assert!(after(600, |_| ONE).is_plausible());
    }

    #[test]
    fn a_bias_has_moved_where_both_sigmas_are_far_exceeded() {
        let mut drift = Drift::default();
        let (wide, narrow) = (Vector3::repeat(2e-3), Vector3::repeat(1.6e-3));
        drift.know(&Vector3::x(), &wide);
        drift.know(&Vector3::zeros(), &narrow);
        let now = Vector3::y() * 1e-2;
        assert_eq!(drift.moved_from(&now, &narrow), None);
        assert_eq!(
            drift.moved_from(&now, &(narrow * 0.1)),
            Some(Vector3::zeros())
        );
        assert_eq!(drift.moved_from(&(now * 0.5), &(narrow * 0.1)), None);
    }
}
