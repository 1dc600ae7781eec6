//! Path of the vertical in the body -> how much gravity can tell of the gyro's bias along it. Pure.
//!
//! While one axis of the body stays vertical, gravity says nothing of the bias about that axis; a linearised filter
//! learns it all the same, because the estimate's inclination wanders. So the bias along the main vertical is
//! considered and not estimated, the more so the less the body has leaned: the partial update of Schmidt's filter.

use nalgebra::{Matrix3, Vector3};

/// Time over which the vertical is remembered, s.
const MEMORY_SECS: f64 = 20.0;
/// Steps of the power iteration an update: the mean moves little in a tenth of a second.
const STEPS: usize = 4;

/// The vertical as it was seen. Body axes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Vertical {
    /// Mean of `u u^T`, `u` the unit vector upwards.
    mean: Matrix3<f64>,
    /// Largest eigenvector of the mean.
    main: Vector3<f64>,
    /// Time it has been seen for, s; no more than what is remembered.
    secs: f64,
    /// Share of a correction of heading and of the bias along `main` that gravity does not give, 0 to 1.
    withheld: f64,
}

impl Default for Vertical {
    /// The vertical of a body of which nothing has been seen; nothing is withheld.
    fn default() -> Vertical {
        Vertical {
            mean: Matrix3::zeros(),
            main: Vector3::zeros(),
            secs: 0.0,
            withheld: 0.0,
        }
    }
}

impl Vertical {
    /// Takes the mean of the vertical over an interval of `secs`. At a mean square of `believed` of the sine of the
    /// inclination gravity is believed by half.
    pub(super) fn take(&mut self, up: &Vector3<f64>, secs: f64, believed: f64) {
        let length = up.norm();
        if !length.is_finite() || length <= 0.0 {
            return;
        }
        let up = up / length;
        if self.secs <= 0.0 {
            self.main = up;
        }
        self.secs = (self.secs + secs).min(MEMORY_SECS);
        self.mean += (up * up.transpose() - self.mean) * (secs / self.secs);
        for _ in 0..STEPS {
            let next = self.mean * self.main;
            let length = next.norm();
            if length > 0.0 {
                self.main = next / length;
            }
        }
        let leaned = (1.0 - (self.mean * self.main).norm()).max(0.0);
        let believed = believed * believed;
        self.withheld = believed / (believed + leaned * leaned).max(f64::MIN_POSITIVE);
    }

    /// The body's main vertical, and the share of what gravity says of heading and of the bias along it that is not
    /// believed.
    pub(super) fn withheld(&self) -> (&Vector3<f64>, f64) {
        (&self.main, self.withheld)
    }

    /// Degree to which one axis stays vertical, 0 to 1; 0 where the body leans so far that gravity is believed by half.
    pub(super) fn upright(&self) -> f64 {
        (2.0 * self.withheld - 1.0).max(0.0)
    }

    /// The same, as far as the body has been seen for long enough to know.
    pub(super) fn known_upright(&self) -> f64 {
        self.upright() * self.secs / MEMORY_SECS
    }

    /// Whether it can have come about.
    pub(super) fn is_plausible(&self) -> bool {
        let is_share = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&x);
        is_share(self.withheld)
            && (0.0..=MEMORY_SECS).contains(&self.secs)
            && self.main.norm() <= 1.0 + 1e-9
            && self.mean.iter().all(|x| is_share(x.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(lean: impl Fn(f64) -> f64) -> Vertical {
        let mut vertical = Vertical::default();
        for i in 0..600 {
            let lean = lean(f64::from(i) * 0.1);
            vertical.take(&Vector3::new(lean.sin(), 0.0, lean.cos()), 0.1, 0.05);
        }
        vertical
    }

    #[test]
    fn the_less_a_body_leans_the_more_is_withheld() {
        assert_eq!(Vertical::default().withheld().1, 0.0);
        let upright = seen(|_| 0.0);
        assert!((upright.withheld().1 - 1.0).abs() < 1e-12);
        assert!((upright.withheld().0 - Vector3::z()).norm() < 1e-12);
        // A mean square of the sine of 0.05: half.
        let half = seen(|t| 0.3203 * (2.0 * t).sin()).withheld().1;
        assert!((half - 0.5).abs() < 0.03, "{half}");
        let over = seen(|t| 0.7 * t).withheld().1;
        assert!(over < 0.02, "{over}");
    }

    #[test]
    fn a_body_laid_on_its_side_has_another_main_axis_in_time() {
        let vertical = seen(|t| if t < 2.0 { 0.0 } else { 1.57 });
        let (main, withheld) = vertical.withheld();
        assert!(main.x.abs() > 0.99 && withheld > 0.8, "{main} {withheld}");
        assert!(vertical.is_plausible());
    }
}
