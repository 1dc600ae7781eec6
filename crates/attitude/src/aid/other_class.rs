//! A class that the sensor may be of instead -> how much less sure the attitude is. Pure.
//!
//! Apart from the covariance because the filter corrects by the priors of one class alone: this is what it would be
//! off by if those were not the sensor's (Schmidt's consider covariance), as far as nothing tells which they are.

use super::covariance::{CROSS, Covariance, FORCE_BIAS, SCALE};
use super::settings::Settings;
use nalgebra::Matrix3;

/// Scale, axes and accelerometer's bias, as they follow each other among the states.
pub(super) const NUMBERS: usize = 9;

/// Class that a sensor may be of instead of that of the settings.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OtherClass {
    /// Prior sigma of the gyro's scale factors.
    pub scale_prior: f64,
    /// Prior sigma of the angles between the axes, rad.
    pub cross_prior: f64,
    /// Prior sigma of the accelerometer's bias, m/s^2.
    pub force_bias_prior: f64,
}

/// Other class, and what it adds.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassDoubt {
    pub(super) other: OtherClass,
    /// Variance that each number may have more, over the square of the one it was given.
    pub(super) weights: [f64; NUMBERS],
}

impl OtherClass {
    /// Priors of a filter with these settings.
    pub(crate) fn of(settings: &Settings) -> OtherClass {
        OtherClass {
            scale_prior: settings.scale_prior,
            cross_prior: settings.cross_prior,
            force_bias_prior: settings.force_bias_prior,
        }
    }

    /// Prior sigma of each of the numbers.
    pub(super) fn sigmas(&self) -> [f64; NUMBERS] {
        const { assert!(CROSS == SCALE + 3 && FORCE_BIAS == SCALE + 6) };
        let sigmas = [self.scale_prior, self.cross_prior, self.force_bias_prior];
        std::array::from_fn(|i| sigmas[i / 3])
    }
}

impl ClassDoubt {
    /// Covariance that the attitude has more, rad^2, earth axes.
    pub(super) fn of(&self, covariance: &Covariance) -> Matrix3<f64> {
        self.by(&std::array::from_fn(|a| {
            std::array::from_fn(|i| covariance.between(a, SCALE + i))
        }))
    }

    /// Covariance that three quantities have more, whose covariances with the numbers are these rows.
    pub(super) fn by(&self, rows: &[[f64; NUMBERS]; 3]) -> Matrix3<f64> {
        let between = |a: usize, b: usize| -> f64 {
            let products = rows[a].iter().zip(&rows[b]).zip(&self.weights);
            products.map(|((a, b), weight)| a * b * weight).sum()
        };
        let [xx, xy, xz] = [between(0, 0), between(0, 1), between(0, 2)];
        let [yy, yz, zz] = [between(1, 1), between(1, 2), between(2, 2)];
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}
