//! Result of a recording: the sensor, the sections, how sure. Pure.

use super::border::{self, Constants, IRON_SCALE, Priors};
use super::phase::Failure;
use super::survey::Quantisation;
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};

/// A constant whose sigma is above this share of what it was beforehand was not observed.
pub(crate) const OBSERVED: f64 = 0.7;

/// Some numbers that were learned, each with one standard deviation after and before.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Estimated<const N: usize> {
    /// The numbers; matrices row by row.
    pub value: [f64; N],
    /// One standard deviation, by this log.
    pub sigma: [f64; N],
    /// Beforehand.
    pub prior: [f64; N],
}

impl<const N: usize> Estimated<N> {
    /// Whether this log says more of the number `i` than was known before.
    #[must_use]
    pub fn is_observed(&self, i: usize) -> bool {
        match (self.sigma.get(i), self.prior.get(i)) {
            (Some(sigma), Some(prior)) => *sigma <= OBSERVED * prior,
            _ => false,
        }
    }

    fn of(
        first: usize,
        constants: &Constants,
        sigma: &Constants,
        prior: &Constants,
    ) -> Estimated<N> {
        Estimated {
            value: std::array::from_fn(|i| constants[first + i]),
            sigma: std::array::from_fn(|i| sigma[first + i]),
            prior: std::array::from_fn(|i| prior[first + i]),
        }
    }
}

/// The sensor by this log. Body axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Calibration {
    /// G of `rate = (1 + G)(measured - bias)`.
    pub gyro: Estimated<9>,
    /// Sensitivity of the gyro to the specific force, rad/s per m/s^2, row by row: `measured - bias` holds this times what
    /// the force differs from its mean over the recording.
    pub gyro_sensitivity: Estimated<9>,
    /// ba of `force = (1 + A)(measured - ba)`, m/s^2.
    pub force_bias: Estimated<3>,
    /// A.
    pub force: Estimated<9>,
    /// ta of `force + ta rate x force`, s.
    pub force_time: Estimated<1>,
    /// Magnetometer, with a field.
    pub magnetometer: Option<Magnetometer>,
}

/// The magnetometer by this log.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Magnetometer {
    /// h of `field = (1 + S)(measured - h)`, uT.
    pub hard_iron: Estimated<3>,
    /// S.
    pub matrix: Estimated<9>,
    /// tm of `field + tm rate x field`, s.
    pub time: Estimated<1>,
    /// The field's north and up, uT.
    pub north_up: Estimated<2>,
    /// Field added while the body moves: east, north, up, uT.
    pub while_moving: Estimated<3>,
    /// uT by the unit of the field that came.
    pub scale: f64,
}

impl Calibration {
    /// Calibrates a specific force (m/s^2, body axes) measured while the body turned at `rate` (rad/s); with the
    /// variance of each component by what is not known of the calibration.
    pub(crate) fn calibrated_force(
        &self,
        measured: &Vector3<f64>,
        rate: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (bias, matrix) = (&self.force_bias, &self.force);
        let left = measured - Vector3::from(bias.value);
        let turning = rate.cross(&left);
        let force = left + Matrix3::from_row_slice(&matrix.value) * left;
        let by_matrix = Matrix3::from_row_slice(&matrix.sigma.map(|sigma| sigma * sigma))
            * left.component_mul(&left);
        let by_bias = Vector3::from(bias.sigma.map(|sigma| sigma * sigma));
        let [time] = self.force_time.value;
        let [time_sigma] = self.force_time.sigma;
        let by_time = turning.component_mul(&turning) * (time_sigma * time_sigma);
        (force + turning * time, by_bias + by_matrix + by_time)
    }

    /// `covariance`: of as many constants as there were.
    pub(super) fn of(
        constants: &Constants,
        covariance: &[Vec<f64>],
        priors: &Priors,
        scale: f64,
    ) -> Calibration {
        let sigma: Constants = std::array::from_fn(|i| {
            covariance
                .get(i)
                .and_then(|row| row.get(i))
                .map_or(priors.sigma[i], |variance| variance.max(0.0).sqrt())
        });
        let mut prior = priors.sigma;
        // As it counted in the end.
        let square: f64 = constants[border::IRON..border::FIELD]
            .iter()
            .map(|h| h * h)
            .sum();
        prior[border::IRON..border::FIELD].fill(IRON_SCALE.hypot(square.sqrt()));
        let has_field = covariance.len() > border::PLAIN;
        Calibration {
            gyro: Estimated::of(border::GYRO, constants, &sigma, &prior),
            gyro_sensitivity: Estimated::of(border::SENSITIVITY, constants, &sigma, &prior),
            force_bias: Estimated::of(border::FORCE_BIAS, constants, &sigma, &prior),
            force: Estimated::of(border::FORCE, constants, &sigma, &prior),
            force_time: Estimated::of(border::FORCE_TIME, constants, &sigma, &prior),
            magnetometer: has_field.then(|| Magnetometer {
                hard_iron: Estimated::of(border::IRON, constants, &sigma, &prior),
                matrix: Estimated::of(border::FIELD, constants, &sigma, &prior),
                time: Estimated::of(border::FIELD_TIME, constants, &sigma, &prior),
                north_up: Estimated::of(border::NORTH, constants, &sigma, &prior),
                while_moving: Estimated::of(border::MOVING, constants, &sigma, &prior),
                scale,
            }),
        }
    }
}

/// Sizes of what was measured between two nodes, by the sensor and by its calibration. Whatever way is up, a force at
/// rest and the field should be of one size; how far they are from it is what a calibration is worth.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sizes {
    /// Stamp of the later node.
    pub stamp: Nanos,
    /// Mean size of the specific force, m/s^2, as measured and as calibrated; where the body rests.
    pub force: Option<[f64; 2]>,
    /// The same of the field, uT (as [`Magnetometer::scale`] makes them); where its calibration was looked for.
    pub field: Option<[f64; 2]>,
}

/// The gyro's bias at a node.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bias {
    /// Stamp of the node.
    pub stamp: Nanos,
    /// rad/s, body axes.
    pub value: Vector3<f64>,
    /// One standard deviation of each axis.
    pub sigma: Vector3<f64>,
}

/// A part of the log without a break.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Section {
    /// Stamps of its first sample, and of its last.
    pub start: Nanos,
    /// The last.
    pub end: Nanos,
    /// Heading is that of north; otherwise of the section's beginning, and unknown against the other sections.
    pub has_north: bool,
}

/// Origin of the attitudes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Outcome {
    /// The smoother's, field included where there is one.
    Converged,
    /// The same, but in the last iteration a node still turned by this, rad.
    Unsettled(f64),
    /// The real-time filter's: the smoother led nowhere, without the field or with it.
    Filter(Failure),
}

/// Counts of what was done to the samples, and what became of them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Counts {
    /// Number that came.
    pub samples: u64,
    /// Number that could not be used: not finite, beyond what there is, not later than those before, without a force
    /// near.
    pub rejected: u64,
    /// Number that came without a force: an accelerometer may be slower than the gyro.
    pub forceless: u64,
    /// Segments between nodes, and those of them at rest.
    pub segments: u64,
    /// Number at rest.
    pub standstills: u64,
    /// Gaps that were bridged.
    pub bridged: u64,
    /// Gaps over which nothing is known.
    pub breaks: u64,
    /// Iterations without the field, and with it.
    pub iterations: [u64; 2],
    /// Quantisation of the rates.
    pub quantisation: Option<Quantisation>,
}
