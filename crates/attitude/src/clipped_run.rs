//! Samples at the end of the gyro's range, one after the other -> variance of the angle that they leave unknown. Pure.
//!
//! Apart from the filter and the smoother because both doubt such a rotation alike.

use crate::plausible::is_amount;
use nalgebra::Vector3;

/// One sigma of the rate beyond the end of the range, as a share of the range.
const EXCESS: f64 = 0.5;
/// One sigma of the angle, in those under the parabola that goes on as the rate came to the end of the range: those of one
/// motion have one sign.
const PARABOLAS: f64 = 3.0;
/// Most that a stretch leaves unknown, rad: all of it.
const MOST: f64 = std::f64::consts::TAU;
/// Share of the largest component at which another is at the end of the range, too.
const ALSO: f64 = 0.98;

/// A stretch of samples at the end of the gyro's range. The excess of one of them is that of the next: over the stretch
/// the unknown angle grows with its time, not with the root of it, and while it is short with the square.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ClippedRun {
    /// Time of the stretch so far, s; 0 outside of one.
    secs: f64,
    /// Change of the rate as it came to the end of the range, rad/s^2; 0: nobody saw it come.
    slope: f64,
    /// Square of the change in the last step before, (rad/s)^2; `None` where it began at the end of the range.
    before: Option<f64>,
}

impl ClippedRun {
    /// Variance, rad^2 about each axis of the body, that a step of `secs` at `rate` (rad/s) adds; the square of the
    /// change of the rate in that step is `change`.
    #[inline]
    pub(crate) fn add(
        &mut self,
        is_saturated: bool,
        rate: &Vector3<f64>,
        change: f64,
        secs: f64,
    ) -> Vector3<f64> {
        if !is_saturated {
            (self.secs, self.before) = (0.0, Some(change));
            return Vector3::zeros();
        }
        if self.secs == 0.0 {
            let slope = self.before.map(|before| change.max(before).sqrt() / secs);
            self.slope = slope.filter(|slope| slope.is_finite()).unwrap_or(0.0);
        }
        let range = rate.amax();
        let before = self.secs;
        self.secs += secs;
        rate.map(|rate| {
            if rate.abs() < ALSO * range {
                return 0.0;
            }
            let excess = EXCESS * rate.abs();
            let mean = |secs: f64| match self.slope {
                0.0 => excess,
                slope => (PARABOLAS / 6.0 * slope * secs).min(excess),
            };
            let angle = |secs: f64| (mean(secs) * secs).min(MOST);
            angle(self.secs).powi(2) - angle(before).powi(2)
        })
    }

    pub(crate) fn is_plausible(&self) -> bool {
        let all = [self.secs, self.slope];
        all.into_iter().chain(self.before).all(is_amount)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_angle_grows_with_the_time_at_the_range_at_any_rate_of_samples() {
        let rate = Vector3::new(0.3, -2.0, 0.1);
        for steps in [1, 10, 1000] {
            let secs = 0.4 / f64::from(steps);
            // It comes to the range at 100 rad/s^2.
            let came = (100.0 * secs).powi(2);
            let mut run = ClippedRun::default();
            let variance: Vector3<f64> = (0..steps).map(|_| run.add(true, &rate, came, secs)).sum();
            let sigma = variance.map(f64::sqrt);
            assert!(
                (sigma - Vector3::new(0.0, 0.4, 0.0)).amax() < 1e-9,
                "{steps}: {sigma}"
            );
            assert_eq!(run.add(false, &rate, 0.0, secs), Vector3::zeros());
            // Another stretch begins anew.
            assert!((run.add(true, &rate, 100.0, 0.1).y.sqrt() - 0.1).abs() < 1e-12);
        }
        let both = Vector3::new(2.0, -1.99, 0.0);
        let both = ClippedRun::default().add(true, &both, 100.0, 0.1);
        assert!((both.map(f64::sqrt) - Vector3::new(0.1, 0.1, 0.0)).amax() < 1e-3);
    }

    #[test]
    fn the_top_of_a_slow_swing_leaves_little_unknown() {
        // A swing of 3.1 rad/s and 1 s, cut at 3: its top has 0.0073 rad above that.
        let (size, turn) = (3.1_f64, std::f64::consts::TAU);
        let top = 2.0 * (3.0 / size).acos() / turn;
        let step = 0.001;
        let lost = 2.0 * size / turn * (turn * top / 2.0).sin() - 3.0 * top;
        let (mut run, mut variance, mut last) = (ClippedRun::default(), 0.0, 0.0_f64);
        for n in 0..500 {
            let rate = (size * (turn * f64::from(n) * step).sin()).min(3.0);
            let change = (rate - last) * (rate - last);
            last = rate;
            variance += run
                .add(rate == 3.0, &Vector3::new(rate, 0.0, 0.0), change, step)
                .x;
        }
        let sigma = variance.sqrt();
        assert!(lost < sigma && sigma < 4.0 * lost, "{lost} {sigma}");
        // A recording that begins at the end of the range.
        let mut run = ClippedRun::default();
        let begun = run.add(true, &Vector3::new(0.0, 3.0, 0.0), 1e-9, 0.1).y;
        assert!((begun.sqrt() - 0.15).abs() < 1e-12, "{begun}");
        // An hour at the end of the range is no more unknown than a full turn.
        let mut run = ClippedRun::default();
        let hour = run.add(true, &Vector3::new(0.0, 3.0, 0.0), 1.0, 3600.0).y;
        assert!((hour.sqrt() - MOST).abs() < 1e-9, "{hour}");
        // A rate that is not finite, or no time, leaves no state that is none.
        let mut run = ClippedRun::default();
        let _ = run.add(true, &Vector3::zeros(), 1.0, 0.0);
        assert!(run.is_plausible());
    }
}
