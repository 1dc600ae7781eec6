//! Specific force at a corrected attitude -> acceleration without gravity, and how well it is known. Pure.
//!
//! Apart from the attitude because its errors go with the accelerometer's: at rest a bias is a tilt, and what is left
//! of the force is zero although neither is known.

use super::covariance::{FORCE_BIAS, LEAD, SCALE, TILT};
use super::filter::{COLOURED, Filter};
use super::other_class::NUMBERS;
use super::settings::Settings;
use crate::frames::In;
use crate::record::LinearAcceleration;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Deviation of gravity from 9.81 m/s^2 over the latitudes, one standard deviation.
const GRAVITY_SIGMA: f64 = 0.015;
/// States that a linear acceleration is off by: attitude, the accelerometer's bias and its lead.
const CAUSES: [usize; 7] = [
    TILT,
    TILT + 1,
    TILT + 2,
    FORCE_BIAS,
    FORCE_BIAS + 1,
    FORCE_BIAS + 2,
    LEAD,
];

impl Filter {
    /// Computes it from a specific force (m/s^2, body axes) measured while the body turned at `rate` (rad/s, corrected),
    /// at the attitude of matrix `r`. `None` before there is an attitude, and where gravity is none.
    pub(super) fn linear_acceleration(
        &self,
        measured: &Vector3<f64>,
        rate: &Vector3<f64>,
        r: &Matrix3<f64>,
    ) -> Option<LinearAcceleration> {
        if !self.state.is_started || self.state.plausibility.is_denied() || !self.is_force(measured)
        {
            return None;
        }
        let (settings, known) = (&self.settings, &self.state.calibration);
        let turning = rate.cross(measured);
        let force = measured - known.force_bias + turning * known.lead;
        // Change for a unit of each cause, body axes: the attitude turns from the left, in earth axes.
        let up = r.row(2).transpose() * settings.gravity;
        let by_tilt = -up.cross_matrix() * r.transpose();
        let by = SMatrix::<f64, 3, 7>::from_fn(|i, j| match j {
            0..3 => by_tilt[(i, j)],
            3..6 => -f64::from(u8::from(i == j - 3)),
            _ => turning[i],
        });
        let covariance = &self.state.covariance;
        let joint = SMatrix::<f64, 7, 7>::from_fn(|i, j| covariance.between(CAUSES[i], CAUSES[j]));
        let mut p = by * joint * by.transpose() * COLOURED;
        if let Some(doubt) = self.open_class() {
            let with = SMatrix::<f64, 7, NUMBERS>::from_fn(|i, j| {
                covariance.between(CAUSES[i], SCALE + j)
            });
            let rows = by * with;
            p += doubt.by(&std::array::from_fn(|a| {
                std::array::from_fn(|i| rows[(a, i)])
            }));
        }
        // What is no state: white noise, less of a better class; scale, of which the gyro's tells the class; gravity's
        // own size.
        let usual = Settings::default().force_bias_prior;
        let class = (settings.force_bias_prior / usual).min(1.0);
        let white = class * class * LinearAcceleration::white(self.state.nominal);
        let direction = force * settings.scale_prior;
        p += Matrix3::from_diagonal_element(white)
            + direction * direction.transpose()
            + up * up.transpose() * (GRAVITY_SIGMA / settings.gravity).powi(2);
        Some(LinearAcceleration {
            body: In::assume(LinearAcceleration::of(&force, r, settings.gravity)),
            covariance: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| p[at]),
        })
    }
}
