//! The constants of a log: which they are, and what is known of them beforehand. Pure.
//!
//! Apart from the nodes because these are the border of the equations: every node sees them.

use super::settings::{PriorScale, PriorSigmas, Settings};
use crate::open_class::share_of_variance;
use nalgebra::{DMatrix, Matrix2, Matrix3, Vector3};

/// Gyro matrix less 1, row by row.
pub(super) const GYRO: usize = 0;
/// Gyro's sensitivity to acceleration, rad/s per m/s^2, row by row.
pub(super) const SENSITIVITY: usize = 9;
/// Accelerometer: bias, matrix less 1, time offset.
pub(super) const FORCE_BIAS: usize = 18;
pub(super) const FORCE: usize = 21;
pub(super) const FORCE_TIME: usize = 30;
/// Centre of the positions.
pub(super) const CENTRE: usize = 31;
/// Magnetometer: hard iron, matrix less 1; the field's north and up; its time offset; the field while moving.
pub(super) const IRON: usize = 34;
pub(super) const FIELD: usize = 37;
pub(super) const NORTH: usize = 46;
pub(super) const FIELD_TIME: usize = 48;
pub(super) const MOVING: usize = 49;
/// Number of unknowns, and without a magnetometer.
pub(super) const ALL: usize = 52;
pub(super) const PLAIN: usize = 34;
/// Width of the border's equations: right sides are one more column.
pub(super) const WIDE: usize = ALL + 1;
pub(super) const NARROW: usize = PLAIN + 1;

/// The constants, SI and uT.
pub(super) type Constants = [f64; ALL];

/// 3x3 from its place among the constants, plus 1.
pub(super) fn matrix(constants: &Constants, first: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| constants[first + 3 * i + j] + if i == j { 1.0 } else { 0.0 })
}

/// Three of the constants.
pub(super) fn vector(constants: &Constants, first: usize) -> Vector3<f64> {
    Vector3::from_fn(|i, _| constants[first + i])
}

/// Inverse covariance of the constants beforehand: symmetric.
#[derive(Clone)]
pub(super) struct Priors {
    pub(super) information: Vec<[f64; ALL]>,
    /// One standard deviation of each; infinite where nothing is known.
    pub(super) sigma: Constants,
    /// About what they scatter.
    mean: Constants,
}

/// Scales of the accelerometer: of each axis by itself, and what all have in common.
pub(crate) const FORCE_SCALE: f64 = 0.0015;
/// Bias of the accelerometer, m/s^2.
pub(crate) const FORCE_BIAS_SIGMA: f64 = 0.04;
const FORCE_SHARED: f64 = 0.05;

/// Sensitivity of a calibrated gyro to acceleration, rad/s per m/s^2: 0.006 deg/s per g, as Xsens states of an MTi.
const GYRO_SENSITIVITY: f64 = 1.07e-5;

/// Hard iron is of this size, uT, or of any (Cauchy's distribution).
pub(super) const IRON_SCALE: f64 = 1.0;

impl Priors {
    /// Makes it for a log that rests in so many segments; `has_moving_field`: the field may be another while moving.
    pub(super) fn new(settings: &Settings, has_moving_field: bool) -> Priors {
        let PriorScale {
            scale,
            axes,
            force,
            sensitivity,
        } = settings.looseness;
        let mut sigma = [0.0; ALL];
        let mut matrix = |first: usize, diagonal: f64, others: f64| {
            for i in 0..9 {
                sigma[first + i] = if i % 4 == 0 {
                    scale * diagonal
                } else {
                    axes * others
                };
            }
        };
        let (force_own, force_shared) = (FORCE_SCALE * scale, FORCE_SHARED * scale);
        matrix(FORCE, force_own.hypot(force_shared) / scale, 0.001);
        matrix(FIELD, 0.015, 0.008);
        let mut put = |range: std::ops::Range<usize>, value: f64| sigma[range].fill(value);
        put(SENSITIVITY..FORCE_BIAS, GYRO_SENSITIVITY * sensitivity);
        put(FORCE_BIAS..FORCE, FORCE_BIAS_SIGMA * force);
        put(FORCE_TIME..CENTRE, 0.003 * scale);
        put(CENTRE..IRON, 10.0);
        put(IRON..FIELD, 1e3);
        put(NORTH..FIELD_TIME, 1e3);
        put(FIELD_TIME..MOVING, 0.005 * scale);
        put(MOVING..ALL, if has_moving_field { 2.5 } else { 1e-3 });
        let mut information = vec![[0.0; ALL]; ALL];
        for i in SENSITIVITY..ALL {
            information[i][i] = 1.0 / (sigma[i] * sigma[i]);
        }
        // Scales share a part: a clock, a reference voltage. A pair across the diagonal is a share of axes that are
        // not square to each other and of a triad that is turned in its case.
        let (own, shared): (f64, f64) = (0.0007 * scale, 0.003 * scale);
        let scales = Matrix3::from_diagonal_element(own * own) + Matrix3::repeat(shared * shared);
        let (skew, turned): (f64, f64) = (0.001 * axes, 0.002 * axes);
        let (s, t) = (skew * skew, turned * turned);
        let pair = Matrix2::new(s + t, s - t, s - t, s + t);
        for i in 0..9 {
            sigma[GYRO + i] = if i % 4 == 0 {
                scales[(0, 0)].sqrt()
            } else {
                pair[(0, 0)].sqrt()
            };
        }
        // An accelerometer's share far more: the sizes of gravity and of g, a reference that drifts.
        let of_force = Matrix3::from_diagonal_element(force_own * force_own)
            + Matrix3::repeat(force_shared * force_shared);
        for (first, scales) in [(GYRO, scales), (FORCE, of_force)] {
            let scales = scales.try_inverse().unwrap_or_default();
            for i in 0..3 {
                for j in 0..3 {
                    information[first + 4 * i][first + 4 * j] = scales[(i, j)];
                }
            }
        }
        let pair = pair.try_inverse().unwrap_or_default();
        for (a, b) in [(1, 3), (2, 6), (5, 7)] {
            let places = [GYRO + a, GYRO + b];
            for i in 0..2 {
                for j in 0..2 {
                    information[places[i]][places[j]] = pair[(i, j)];
                }
            }
        }
        sigma[IRON..FIELD].fill(f64::INFINITY);
        sigma[NORTH..FIELD_TIME].fill(f64::INFINITY);
        let mut priors = Priors {
            information,
            sigma,
            mean: [0.0; ALL],
        };
        priors.narrow(&settings.known);
        priors
    }

    /// Covariance of the constants that this sensor may have beyond these priors, where it may be of another class,
    /// between two inverse covariances of these: with the covariance C of an attitude and of the constants, an attitude
    /// that was solved by these priors has the variance `C doubt C'` more (Schmidt's consider covariance).
    pub(super) fn doubt(&self, settings: &Settings) -> Option<Vec<[f64; ALL]>> {
        const SENSOR: usize = CENTRE;
        let other = settings.other?;
        let wide = Priors::new(
            &Settings {
                looseness: other.looseness,
                other: None,
                ..*settings
            },
            true,
        );
        let of =
            |priors: &Priors| DMatrix::from_fn(SENSOR, SENSOR, |i, j| priors.information[i][j]);
        let (narrow, covariance) = (of(self), of(&wide).try_inverse()?);
        let more =
            (&narrow * covariance * &narrow - &narrow) * share_of_variance(other.probability);
        let mut doubt = vec![[0.0; ALL]; ALL];
        for i in 0..SENSOR {
            for j in 0..SENSOR {
                doubt[i][j] = 0.5 * (more[(i, j)] + more[(j, i)]);
            }
        }
        Some(doubt)
    }

    /// Takes up what is known of this sensor.
    fn narrow(&mut self, known: &PriorSigmas) {
        let mut put = |first: usize, sigmas: &[Option<f64>]| {
            if sigmas.iter().all(Option::is_none) {
                return;
            }
            // What is left of numbers that data have told shares nothing any more.
            for (i, sigma) in sigmas.iter().enumerate() {
                let own = &mut self.sigma[first + i];
                *own = sigma.map_or(*own, |sigma| sigma.min(*own));
                self.information[first + i] = [0.0; ALL];
                self.information[first + i][first + i] = 1.0 / (*own * *own);
            }
        };
        put(GYRO, &known.gyro);
        put(FORCE_BIAS, &known.force_bias);
        put(FORCE, &known.force);
        put(FIELD, &known.field);
        put(FORCE_TIME, &[known.force_time.map(|(_, sigma)| sigma)]);
        put(FIELD_TIME, &[known.field_time.map(|(_, sigma)| sigma)]);
        self.mean[FORCE_TIME] = known.force_time.map_or(0.0, |(mean, _)| mean);
        self.mean[FIELD_TIME] = known.field_time.map_or(0.0, |(mean, _)| mean);
    }

    /// Adds them to the border's equations; the last column is their right side.
    pub(super) fn add<const W: usize>(&self, constants: &Constants, border: &mut [[f64; W]; W]) {
        let last = W - 1;
        for i in 0..last {
            for j in i..last {
                border[i][j] += self.information[i][j];
            }
            for j in 0..last {
                // The field's size is anything: no pull.
                if !(NORTH..FIELD_TIME).contains(&j) {
                    border[i][last] -= self.information[i][j] * (constants[j] - self.mean[j]);
                }
            }
        }
        if last >= FIELD {
            let square: f64 = constants[IRON..FIELD].iter().map(|h| h * h).sum();
            let scale = IRON_SCALE * IRON_SCALE;
            let weight = 1.0 / (1.0 + square / scale) / scale;
            for i in IRON..FIELD {
                border[i][i] += weight;
                border[i][last] -= weight * constants[i];
            }
        }
    }
}
