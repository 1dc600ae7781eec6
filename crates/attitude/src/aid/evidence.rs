//! Knowledge of a sensor after a run with wide priors -> how many times likelier it is of one class than of another. Pure.
//!
//! Apart from the filter because it is asked for seldom. What the run told of scale, axes and accelerometer is
//! a Gaussian: its posterior less its prior. The likelihood of what was measured under any other prior of these numbers
//! follows from it in closed form, as if the filter had run with that.

use super::covariance::SCALE;
use super::filter::{COLOURED, Filter, WIDE};
use super::other_class::{ClassDoubt, NUMBERS, OtherClass};
use crate::open_class::share_of_variance;
use nalgebra::{Cholesky, Const, Matrix3, SMatrix, SVector};

/// Corrections after which the class is weighed again: 10 s.
const OFTEN: u64 = 100;
type Matrix = SMatrix<f64, NUMBERS, NUMBERS>;
type Vector = SVector<f64, NUMBERS>;

/// Inverse covariance of the numbers beforehand.
fn prior(class: &OtherClass) -> Matrix {
    let sigmas = class.sigmas();
    Matrix::from_diagonal(&Vector::from_fn(|i, _| sigmas[i].powi(-2)))
}

/// Logarithm of the likelihood of what told `information` and `told`, but for a constant, where `prior` is right.
fn likelihood(information: &Matrix, told: &Vector, prior: &Matrix) -> Option<f64> {
    let log_determinant = |factor: &Cholesky<f64, Const<NUMBERS>>| {
        2.0 * factor.l_dirty().diagonal().map(f64::ln).sum()
    };
    let after = Cholesky::new(information + prior)?;
    let before = Cholesky::new(*prior)?;
    let explained = told.dot(&after.solve(told));
    Some(0.5 * (log_determinant(&before) - log_determinant(&after) + explained))
}

impl Filter {
    /// Logarithm of how many times likelier what was measured is of a sensor with the priors of this filter than of one
    /// with those of `other`; `None` where nothing can be said.
    pub(crate) fn likelier_than(&self, other: &OtherClass) -> Option<f64> {
        let numbers = [
            self.calibration().scale,
            self.calibration().cross,
            self.calibration().force_bias,
        ];
        let found = Vector::from_fn(|i, _| numbers[i / 3][i % 3]);
        let covariance =
            Matrix::from_fn(|i, j| self.state.covariance.between(SCALE + i, SCALE + j));
        let own = prior(&OtherClass::of(self.settings()));
        let log = covariance.try_inverse().and_then(|known| {
            // Accelerations are not white: what was measured tells less than it seems to.
            let information = (known - prior(&self.held())) / COLOURED;
            let told = known * found / COLOURED;
            let of = |prior: &Matrix| likelihood(&information, &told, prior);
            Some(of(&own)? - of(&prior(other))?)
        });
        log.filter(|log| log.is_finite())
    }

    /// Lets the attitude be less sure by a class that the sensor may be of instead.
    pub(crate) fn may_be_of(&mut self, other: OtherClass) {
        self.derived.doubt = Some(ClassDoubt {
            other,
            weights: [0.0; NUMBERS],
        });
        self.forget_class();
    }

    /// Covariance that the attitude has more by the other class, where that can be; rad^2, earth axes.
    pub(super) fn by_other_class(&self) -> Option<Matrix3<f64>> {
        Some(self.open_class()?.of(&self.state.covariance))
    }

    /// The class that the sensor may be of instead, where that can be.
    pub(super) fn open_class(&self) -> Option<&ClassDoubt> {
        let doubt = self.derived.doubt.as_ref();
        doubt.filter(|doubt| doubt.weights != [0.0; NUMBERS])
    }

    /// Forgets what was learned of the class.
    pub(super) fn forget_class(&mut self) {
        self.state.class_log = 0.0;
        self.weigh_classes();
    }

    /// Finds by what was learned which class the sensor is of, where it is time.
    pub(super) fn find_class(&mut self) {
        if let Some(doubt) = &self.derived.doubt
            && self.state.report.updates.is_multiple_of(OFTEN)
        {
            if let Some(log) = self.likelier_than(&doubt.other) {
                self.state.class_log = -log;
            }
            self.weigh_classes();
        }
    }

    /// Derives from the state what the other class adds.
    pub(super) fn weigh_classes(&mut self) {
        if let Some(mut doubt) = self.derived.doubt {
            let share = share_of_variance(self.other_class_probability());
            doubt.weights = self.weights(&doubt.other, share);
            self.derived.doubt = Some(doubt);
        }
    }

    /// Probability that the sensor is of the other class.
    pub(crate) fn other_class_probability(&self) -> f64 {
        1.0 / (1.0 + (-self.state.class_log).exp())
    }

    /// Priors that the covariance began with, or goes on with since it was widened.
    fn held(&self) -> OtherClass {
        let mut own = OtherClass::of(&self.settings);
        if self.state.is_widened {
            own.scale_prior = own.scale_prior.max(WIDE);
            own.cross_prior = own.cross_prior.max(WIDE);
        }
        own
    }

    fn weights(&self, other: &OtherClass, share: f64) -> [f64; NUMBERS] {
        let [own, other] =
            [self.held(), *other].map(|class| class.sigmas().map(|sigma| sigma * sigma));
        std::array::from_fn(|i| share * (other[i] - own[i]).max(0.0) / (own[i] * own[i]))
    }
}
