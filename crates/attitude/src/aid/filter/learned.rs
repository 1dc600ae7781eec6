//! The filter -> what it has learned of the sensor, and how well it is known. Pure.
//!
//! Apart from how samples are taken because it is read by those who report it, and by the rules that doubt the class.

use super::super::calibration::Calibration;
use super::super::covariance::{BIAS, CROSS, FORCE_BIAS, IRON, LEAD, SCALE};
use super::super::settings::Settings;
use super::{COLOURED, Filter, WIDE};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3};

impl Filter {
    /// Calibration of the sensor by now.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.state.calibration
    }

    /// One standard deviation of each number of the calibration.
    #[must_use]
    pub fn calibration_sigma(&self) -> Calibration {
        let three = |first: usize| {
            Vector3::from_fn(|i, _| self.state.covariance.variance(first + i).max(0.0).sqrt())
        };
        Calibration {
            bias: three(BIAS),
            scale: three(SCALE),
            cross: three(CROSS),
            force_bias: three(FORCE_BIAS),
            lead: self.state.covariance.variance(LEAD).max(0.0).sqrt(),
            hard_iron: three(IRON),
        }
    }

    /// Whether what was learned of the gyro's scale and axes lies two of its prior sigmas off, or the accelerometer's
    /// bias
    /// three: then the sensor is none of that class, and the sigma of the attitude has been too small. Not asked of
    /// priors
    /// that a calibration gave. The bounds tell the 14 recordings of BROAD from simulated units that nobody calibrated.
    #[must_use]
    pub fn is_beyond_class(&self) -> bool {
        let settings = &self.settings;
        let is_force = self.state.calibration.force_bias.amax() > 3.0 * settings.force_bias_prior;
        self.state.is_widened
            || self.is_gyro_beyond_class()
            || (is_force && settings.prior.force_bias.is_none())
    }

    fn is_gyro_beyond_class(&self) -> bool {
        let (settings, found) = (&self.settings, &self.state.calibration);
        settings.prior.scale.is_none()
            && (found.scale.amax() > 2.0 * settings.scale_prior
                || found.cross.amax() > 2.0 * settings.cross_prior)
    }

    /// Looks for the gyro's scale and axes farther off, once it was found to be none of its class.
    pub(in crate::aid) fn widen(&mut self) {
        if self.state.is_widened || !self.is_gyro_beyond_class() {
            return;
        }
        self.state.is_widened = true;
        let Settings {
            scale_prior,
            cross_prior,
            ..
        } = self.settings;
        for (first, prior) in [(SCALE, scale_prior), (CROSS, cross_prior)] {
            let more = (WIDE * WIDE - prior * prior).max(0.0);
            for axis in 0..3 {
                self.state.covariance.add(first + axis, more);
            }
        }
    }

    /// Covariance of the calibration's numbers from state `first` on, as much larger than the filter's own as that
    /// of the attitude.
    fn block<const N: usize>(&self, first: usize) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| COLOURED * self.state.covariance.between(first + i, first + j))
    }

    /// Covariances of the gyro's bias, (rad/s)^2; of its scale and axes; of the accelerometer's bias, (m/s^2)^2. Body
    /// axes.
    pub(crate) fn calibration_covariance(&self) -> (Matrix3<f64>, Matrix6<f64>, Matrix3<f64>) {
        (self.block(BIAS), self.block(SCALE), self.block(FORCE_BIAS))
    }

    /// Sigma of the accelerometer's time offset, s.
    pub(crate) fn lead_sigma(&self) -> f64 {
        self.block::<1>(LEAD)[(0, 0)].max(0.0).sqrt()
    }

    /// Covariance of hard iron, if it is looked for, and what it was taken for at the start, in the field's unit.
    pub(crate) fn hard_iron_covariance(&self) -> Option<(Matrix3<f64>, f64)> {
        let prior = self.settings.hard_iron * self.state.surroundings.mean_norm();
        self.state
            .covariance
            .has_iron()
            .then(|| (self.block(IRON), prior))
    }

    /// Sigma of the accelerometer's time offset at the start, s.
    pub(crate) fn lead_prior(&self) -> f64 {
        let settings = &self.settings;
        // The second part is added by the first correction.
        let share = if self.state.report.updates > 0 {
            settings.lead_share * self.state.nominal
        } else {
            0.0
        };
        let class = settings.lead_prior.hypot(share);
        settings.prior.lead_sigma.unwrap_or(class)
    }

    /// Whether nothing has told the gyro's bias about the vertical: the body has turned about its vertical axis only
    /// and has not rested, so that its sigma is most of what it was at the start, and heading drifts by it.
    #[must_use]
    pub fn is_bias_unobserved(&self) -> bool {
        let (main, withheld) = self.state.vertical.withheld();
        // Half of the prior's sigma.
        withheld > 0.5 && self.variance_of_bias(main) > 0.25 * self.prior_of_bias(main)
    }

    /// Gyro's bias when it was first known to 0.1 deg/s, rad/s, where that of now is clearly another: it drifts.
    #[must_use]
    pub fn bias_moved_from(&self) -> Option<Vector3<f64>> {
        let sigma = self.calibration_sigma().bias;
        self.state
            .drift
            .moved_from(&self.state.calibration.bias, &sigma)
    }

    /// Variance of the gyro's bias along a unit vector of the body, (rad/s)^2.
    pub(in crate::aid) fn variance_of_bias(&self, axis: &Vector3<f64>) -> f64 {
        let bias = Matrix3::from_fn(|i, j| self.state.covariance.between(BIAS + i, BIAS + j));
        axis.dot(&(bias * axis))
    }

    /// The same at the start.
    pub(in crate::aid) fn prior_of_bias(&self, axis: &Vector3<f64>) -> f64 {
        match &self.settings.prior.bias {
            Some(known) => axis.dot(&(known * axis)),
            None => self.settings.bias_prior.powi(2),
        }
    }
}
