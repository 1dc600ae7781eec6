//! A class that the sensor may be of instead -> how much less sure the attitude is. Pure.
//!
//! Apart from the covariance because the filter corrects by the priors of one class alone: this is what it would be
//! off by if those were not the sensor's (Schmidt's consider covariance), as far as nothing tells which they are.

use super::covariance::{CROSS, Covariance, FORCE_BIAS, SCALE};
use super::filter::{Filter, WIDE};
use super::settings::Settings;
use nalgebra::Matrix3;

/// Scale, axes and accelerometer's bias, as they follow each other among the states.
const NUMBERS: usize = 9;
/// Corrections after which the class is weighed again: 10 s.
const OFTEN: u64 = 100;
/// Probability of a class that adds nothing any more.
const NEGLIGIBLE: f64 = 1e-3;

/// Class that a sensor may be of instead of that of the settings.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OtherClass {
    /// Its prior sigma of the gyro's scale factors.
    pub scale_prior: f64,
    /// Its prior sigma of the angles between the axes, rad.
    pub cross_prior: f64,
    /// Its prior sigma of the accelerometer's bias, m/s^2.
    pub force_bias_prior: f64,
    /// Logarithm of how many times likelier the sensor is of it; `None`: what the filter learns tells it on the way.
    pub log: Option<f64>,
}

/// The other class, and what it adds.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassDoubt {
    other: OtherClass,
    /// Variance that each number may have more, over the square of the one it was given.
    weights: [f64; NUMBERS],
}

impl ClassDoubt {
    /// What the covariance of the attitude has more, rad^2, earth axes.
    fn of(&self, covariance: &Covariance) -> Matrix3<f64> {
        let rows: [[f64; NUMBERS]; 3] =
            std::array::from_fn(|a| std::array::from_fn(|i| covariance.between(a, SCALE + i)));
        let between = |a: usize, b: usize| -> f64 {
            let products = rows[a].iter().zip(&rows[b]).zip(&self.weights);
            products.map(|((a, b), weight)| a * b * weight).sum()
        };
        let [xx, xy, xz] = [between(0, 0), between(0, 1), between(0, 2)];
        let [yy, yz, zz] = [between(1, 1), between(1, 2), between(2, 2)];
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

impl Filter {
    /// Lets the attitude be less sure by a class that the sensor may be of instead.
    pub(crate) fn may_be_of(&mut self, other: OtherClass) {
        self.derived.doubt = Some(ClassDoubt {
            other,
            weights: [0.0; NUMBERS],
        });
        self.forget_class();
    }

    /// What the covariance of the attitude has more by the other class, where that can be; rad^2, earth axes.
    pub(super) fn by_other_class(&self) -> Option<Matrix3<f64>> {
        let doubt = self.derived.doubt.as_ref();
        let doubt = doubt.filter(|doubt| doubt.weights != [0.0; NUMBERS]);
        Some(doubt?.of(&self.state.covariance))
    }

    /// Forgets what was learned of the class.
    pub(super) fn forget_class(&mut self) {
        let log = self.derived.doubt.and_then(|doubt| doubt.other.log);
        self.state.class_log = log.unwrap_or(0.0);
        self.weigh_classes();
    }

    /// Finds by what was learned which class the sensor is of, where it is time.
    pub(super) fn find_class(&mut self) {
        let Some(doubt) = &self.derived.doubt else {
            return;
        };
        if doubt.other.log.is_none() && self.state.report.updates.is_multiple_of(OFTEN) {
            self.state.class_log = -self.likelier_than(&self.priors_of(&doubt.other));
            self.weigh_classes();
        }
    }

    /// Derives from the state what the other class adds.
    pub(super) fn weigh_classes(&mut self) {
        if let Some(mut doubt) = self.derived.doubt {
            let probability = self.other_class_probability();
            doubt.weights = match probability {
                ..NEGLIGIBLE => [0.0; NUMBERS],
                _ => self.weights(&self.priors_of(&doubt.other), probability),
            };
            self.derived.doubt = Some(doubt);
        }
    }

    /// Probability that the sensor is of the other class.
    pub(crate) fn other_class_probability(&self) -> f64 {
        1.0 / (1.0 + (-self.state.class_log).exp())
    }

    fn priors_of(&self, other: &OtherClass) -> Settings {
        Settings {
            scale_prior: other.scale_prior,
            cross_prior: other.cross_prior,
            force_bias_prior: other.force_bias_prior,
            ..self.settings
        }
    }

    fn weights(&self, other: &Settings, probability: f64) -> [f64; NUMBERS] {
        let own = &self.settings;
        let gyro = |prior: f64| if self.state.is_widened { WIDE } else { prior };
        let of = |own: f64, other: f64| {
            let own = own * own;
            probability * (other * other - own).max(0.0) / (own * own)
        };
        const { assert!(CROSS == SCALE + 3 && FORCE_BIAS == SCALE + 6) };
        let scale = of(gyro(own.scale_prior), other.scale_prior);
        let cross = of(gyro(own.cross_prior), other.cross_prior);
        let force = of(own.force_bias_prior, other.force_bias_prior);
        std::array::from_fn(|i| [scale, cross, force][i / 3])
    }
}
