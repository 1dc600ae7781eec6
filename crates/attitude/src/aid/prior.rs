//! Knowledge of a sensor beforehand -> what the filter begins with. Pure.

use super::calibration::Calibration;
use super::covariance::{BIAS, Covariance, FORCE_BIAS, IRON, LEAD, SCALE};
use super::settings::Settings;
use nalgebra::{Matrix3, Matrix6};

/// Knowledge of a sensor before its first sample, beside what was taken out of its samples already. Body axes;
/// `None`: no better than of any sensor.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Prior {
    /// Covariance of what is left of the gyro's bias, (rad/s)^2.
    pub bias: Option<Matrix3<f64>>,
    /// Covariance of its scale (x, y, z) and axes (xy, xz, yz).
    pub scale: Option<Matrix6<f64>>,
    /// Covariance of what is left of the accelerometer's bias, (m/s^2)^2.
    pub force_bias: Option<Matrix3<f64>>,
    /// The accelerometer's lead, s.
    pub lead: f64,
    /// Standard deviation of the time offset.
    pub lead_sigma: Option<f64>,
    /// Covariance of what is left of hard iron, in squares of the field's unit.
    pub hard_iron: Option<Matrix3<f64>>,
}

impl Prior {
    /// Calibration and covariance of a sensor of which this is known, by `settings` what is not.
    pub(super) fn begin(&self, settings: &Settings) -> (Calibration, Covariance) {
        let mut covariance = Covariance::zero(settings.hard_iron > 0.0);
        let mut put = |first: usize, size: usize, of: &dyn Fn(usize, usize) -> f64| {
            for i in 0..size {
                for j in 0..size {
                    covariance.set(first + i, first + j, of(i, j));
                }
            }
        };
        let even = |sigma: f64| move |i: usize, j: usize| if i == j { sigma * sigma } else { 0.0 };
        match &self.bias {
            Some(known) => put(BIAS, 3, &|i, j| known[(i, j)]),
            None => put(BIAS, 3, &even(settings.bias_prior)),
        }
        match &self.scale {
            Some(known) => put(SCALE, 6, &|i, j| known[(i, j)]),
            None => {
                put(SCALE, 3, &even(settings.scale_prior));
                put(SCALE + 3, 3, &even(settings.cross_prior));
            }
        }
        match &self.force_bias {
            Some(known) => put(FORCE_BIAS, 3, &|i, j| known[(i, j)]),
            None => put(FORCE_BIAS, 3, &even(settings.force_bias_prior)),
        }
        let lead = self.lead_sigma.unwrap_or(settings.lead_prior);
        put(LEAD, 1, &even(lead));
        // Without, it is known to a share of a field that has not come yet.
        if let Some(known) = self.hard_iron.filter(|_| settings.hard_iron > 0.0) {
            put(IRON, 3, &|i, j| known[(i, j)]);
        }
        let calibration = Calibration {
            lead: self.lead,
            ..Calibration::default()
        };
        (calibration, covariance)
    }
}
