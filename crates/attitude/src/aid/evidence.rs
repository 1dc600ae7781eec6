//! Knowledge of a sensor after a run with wide priors -> how many times likelier it is of one class than of another. Pure.
//!
//! Apart from the filter because nobody asks for it on the way. What the run told of scale, axes and accelerometer is
//! a Gaussian: its posterior less its prior. The likelihood of what was measured under any other prior of these numbers
//! follows from it in closed form, as if the filter had run with that.

use super::covariance::{CROSS, FORCE_BIAS, SCALE};
use super::filter::{COLOURED, Filter};
use super::settings::Settings;
use nalgebra::{Cholesky, Const, SMatrix, SVector};

/// Scale, axes and accelerometer's bias.
const NUMBERS: usize = 9;
type Matrix = SMatrix<f64, NUMBERS, NUMBERS>;
type Vector = SVector<f64, NUMBERS>;

/// Inverse covariance of the numbers beforehand.
fn prior(settings: &Settings) -> Matrix {
    let Settings {
        scale_prior,
        cross_prior,
        force_bias_prior,
        ..
    } = settings;
    let sigmas = [scale_prior, cross_prior, force_bias_prior];
    Matrix::from_diagonal(&Vector::from_fn(|i, _| sigmas[i / 3].powi(-2)))
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
    /// with those of `narrow`; 0 where nothing can be said.
    pub(crate) fn likelier_than(&self, narrow: &Settings) -> f64 {
        let state = |i: usize| [SCALE, CROSS, FORCE_BIAS][i / 3] + i % 3;
        let numbers = [
            self.calibration().scale,
            self.calibration().cross,
            self.calibration().force_bias,
        ];
        let found = Vector::from_fn(|i, _| numbers[i / 3][i % 3]);
        let covariance = Matrix::from_fn(|i, j| self.state.covariance.between(state(i), state(j)));
        let wide = prior(self.settings());
        let log = covariance.try_inverse().and_then(|known| {
            // Accelerations are not white: what was measured tells less than it seems to.
            let information = (known - wide) / COLOURED;
            let told = known * found / COLOURED;
            let of = |prior: &Matrix| likelihood(&information, &told, prior);
            Some(of(&wide)? - of(&prior(narrow))?)
        });
        log.filter(|log| log.is_finite()).unwrap_or(0.0)
    }
}
