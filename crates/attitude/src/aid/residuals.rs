//! Residuals of the specific force, one after another -> the variance of the next. Pure.

use super::settings::Settings;
use crate::plausible::{are_numbers, is_amount};
use nalgebra::Vector3;

/// Time over which residuals are averaged to see what turns with the body, s.
const TURNING_SECS: f64 = 5.0;

/// Statistics of residuals.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Residuals {
    /// Power density, m^2/s^3.
    density: f64,
    /// Mean square of the acceleration itself; nothing in a file that is older than this field.
    #[cfg_attr(feature = "serde", serde(default))]
    acceleration: f64,
    /// Mean square of a residual, and mean product with the one before.
    square: f64,
    product: f64,
    last: [f64; 2],
    /// Means over seconds, m/s^2: along earth axes, and along axes that turn about the vertical with the body.
    #[cfg_attr(feature = "serde", serde(default))]
    means: [[f64; 2]; 2],
}

impl Residuals {
    pub(super) fn new(settings: &Settings) -> Residuals {
        Residuals {
            density: settings.force_start,
            ..Residuals::default()
        }
    }

    /// Whether they can be: what a file says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        [self.density, self.acceleration, self.square]
            .into_iter()
            .all(is_amount)
            && are_numbers(self.last.iter().chain([&self.product]))
            && are_numbers(self.means.iter().flatten())
    }

    /// The reference was left: what comes has nothing to do with what was.
    pub(super) fn restart(&mut self) {
        (self.square, self.product, self.last) = (0.0, 0.0, [0.0; 2]);
        self.means = [[0.0; 2]; 2];
    }

    /// Variance of the residual of an interval of `secs`, in which the body has turned by `turned` rad about the vertical
    /// and the acceleration (earth axes) is; `upright` says how far one axis of the body stays vertical, 0 to 1. By
    /// `explained` (m^2/s^4, each axis) its square is more than that of noise: what the filter does not know makes it, too.
    ///
    /// A wrong tilt carries the velocity and the position of the reference off without bound, and the residual with
    /// them: were that taken for noise, gravity would be believed less and less. So a residual counts in proportion to
    /// the acceleration that is really there.
    pub(super) fn variance(
        &mut self,
        secs: f64,
        residual: [f64; 2],
        explained: f64,
        acceleration: &Vector3<f64>,
        (turned, upright): (f64, f64),
        settings: &Settings,
    ) -> f64 {
        let share = secs / (settings.force_secs + secs);
        let of_noise = self.share_of_noise(secs, &residual, explained, settings);
        let residual = residual.map(|one| one * of_noise);
        let across = acceleration.xy().norm_squared();
        self.acceleration += share * (across - self.acceleration);
        let most = settings.force_carried * self.acceleration.max(across);
        let square = residual[0] * residual[0] + residual[1] * residual[1];
        let counts = if square > most {
            (most / square).sqrt()
        } else {
            1.0
        };
        let [x, y] = residual.map(|one| one * counts);
        let (square, up) = (square.min(most), acceleration.z);
        let now = secs * (0.5 * square).max(settings.force_vertical * up * up);
        self.density += share * (now - self.density);
        let density = settings
            .force_floor
            .max(self.density)
            .max(settings.force_instant * now);
        self.square += share * (square - self.square);
        let product = x * self.last[0] + y * self.last[1];
        self.product += share * (product - self.product);
        self.last = residual;
        // What resembles the one before it says less than its number.
        let likeness = if self.square > 0.0 {
            (self.product / self.square).clamp(0.0, 0.98)
        } else {
            0.0
        };
        let turning = self.turning([x, y], secs, turned, settings.force_turning * density);
        let density = density + upright * turning;
        let colour = ((1.0 + likeness) / (1.0 - likeness)).powf(settings.colour);
        density / secs * colour
    }

    /// Root of the share of a residual's square that is of noise, at most 1, by its expectation under the density so far. Of both axes
    /// together, so that it is the same whatever the heading.
    fn share_of_noise(
        &self,
        secs: f64,
        residual: &[f64; 2],
        explained: f64,
        settings: &Settings,
    ) -> f64 {
        let noise = self.density.max(settings.force_floor) / secs;
        let share = noise / (noise + explained);
        let all = residual[0] * residual[0] + residual[1] * residual[1];
        let of_noise = share * share * all + 2.0 * noise * (1.0 - share);
        if of_noise < all {
            (of_noise / all).sqrt()
        } else {
            1.0
        }
    }

    /// Power density of what turns about the vertical with the body, beyond `chance`.
    ///
    /// In a curve that is the acceleration towards its middle, which a gait hides in a mean square. While the body stays
    /// upright it is the accelerometer's bias to the filter, or a tilt. What lasts along earth axes is not counted: where
    /// a bias is not known yet it is the bias, and gravity is to tell it.
    fn turning(&mut self, residual: [f64; 2], secs: f64, turned: f64, chance: f64) -> f64 {
        let share = secs / (TURNING_SECS + secs);
        let (sin, cos) = turned.sin_cos();
        let [_, [x, y]] = self.means;
        self.means[1] = [cos * x - sin * y, sin * x + cos * y];
        for mean in &mut self.means {
            for (mean, now) in mean.iter_mut().zip(residual) {
                *mean += share * (now - *mean);
            }
        }
        let [stays, turns] = self.means.map(|[x, y]| x * x + y * y);
        // A mean of white noise has its density over twice that time, on each of two axes.
        (TURNING_SECS * (turns - stays) - chance).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance after a minute of residuals of 5 m/s^2 to and fro, with `pull` m/s^2 more that turns by `turned` rad an
    /// update, on a body that does.
    fn hidden(pull: f64, turned: f64, settings: &Settings) -> f64 {
        let mut residuals = Residuals::new(settings);
        let mut variance = 0.0;
        for k in 0..600 {
            let (sin, cos) = (turned * f64::from(k)).sin_cos();
            let gait = if k % 2 == 0 { 5.0 } else { -5.0 };
            let residual = [gait + pull * cos, pull * sin];
            let acceleration = Vector3::new(residual[0], residual[1], 0.0);
            variance =
                residuals.variance(0.1, residual, 0.0, &acceleration, (turned, 1.0), settings);
        }
        variance
    }

    #[test]
    fn a_pull_that_turns_with_the_body_is_seen_under_a_gait_and_one_that_stays_is_left_to_the_bias()
    {
        let now = Settings::default();
        let before = Settings {
            force_turning: f64::INFINITY,
            ..now
        };
        let more =
            |pull: f64, turned: f64| hidden(pull, turned, &now) / hidden(pull, turned, &before);
        assert!(more(2.0, 0.04) > 5.0, "{}", more(2.0, 0.04));
        for nothing in [more(2.0, 0.0), more(0.0, 0.04), more(0.2, 0.04)] {
            assert_eq!(nothing, 1.0);
        }
    }

    /// Variance after ten seconds of noise and two of residuals of 5 m/s^2 of which `explained` is made by a wrong tilt.
    fn after_a_wrong_tilt(explained: f64) -> f64 {
        let settings = Settings::default();
        let mut residuals = Residuals::new(&settings);
        let mut variance = 0.0;
        for k in 0..120 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let size = if k < 100 { 0.5 } else { 5.0 };
            let acceleration = Vector3::new(1.0, 0.0, 0.0);
            let residual = [size * sign, 0.0];
            variance = residuals.variance(
                0.1,
                residual,
                explained,
                &acceleration,
                (0.0, 0.0),
                &settings,
            );
        }
        variance
    }

    #[test]
    fn what_the_filter_does_not_know_yet_is_no_noise() {
        let all = after_a_wrong_tilt(0.0);
        assert!(after_a_wrong_tilt(0.01) > 0.8 * all);
        assert!(
            after_a_wrong_tilt(5.0) < 0.2 * all,
            "{} {all}",
            after_a_wrong_tilt(5.0)
        );
        // It never adds to the noise.
        assert!(after_a_wrong_tilt(1e9) < 0.2 * all);
    }
}
