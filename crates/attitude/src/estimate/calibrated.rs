//! A calibration, and how the sensor is mounted -> what the filter begins with; what it learned -> a calibration. Pure.
//!
//! Apart from the filter because a calibration is of the sensor's axes as recorded and of everything that was taken
//! out of a sample, while the filter knows body axes and what is left.

use super::meaning::Meaning;
use super::plan::{EstimationSettings, Noise};
use super::preparation::Prepared;
use super::sensor_calibration::{CalibrationTerm, SensorCalibration};
use super::smoothing::Recording;
use crate::aid::{Filter, Prior, Settings};
use crate::consistency::FieldIron;
use crate::smooth::{Estimated, OBSERVED, PriorSigmas, Smoothed};
use nalgebra::{Matrix3, Matrix6, Vector3};

/// Change of a chip's bias while it is switched off, rad/s (0.3 deg/s): ten degrees of temperature do that. A
/// sensor whose class has less of it after switching on has no more than that.
const SWITCHED_OFF: f64 = 5e-3;

/// Rows and columns of a symmetric matrix in the order of its states: scale, then axes.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Takes scale and axes about other axes, `by` orthogonal: `by E by^T`.
fn turned(by: &Matrix3<f64>) -> Matrix6<f64> {
    Matrix6::from_fn(|row, column| {
        let (k, l) = PAIRS[column];
        let mut unit = Matrix3::zeros();
        unit[(k, l)] = 1.0;
        unit[(l, k)] = 1.0;
        let (i, j) = PAIRS[row];
        (by * unit * by.transpose())[(i, j)]
    })
}

/// Sigma of a sum of independent numbers, by their factors and sigmas; `None` where one is not known.
fn about(terms: impl Iterator<Item = (f64, Option<f64>)>) -> Option<f64> {
    let mut square = 0.0;
    for (factor, sigma) in terms.filter(|(factor, _)| factor.abs() > 1e-6) {
        square += (factor * sigma?).powi(2);
    }
    Some(square.sqrt())
}

/// Sigmas that state more than was known before: the others are of numbers that were not observed.
fn observed<const N: usize>(sigma: [f64; N], prior: [f64; N]) -> [f64; N] {
    std::array::from_fn(|i| match sigma[i] <= OBSERVED * prior[i] {
        true => sigma[i],
        false => f64::INFINITY,
    })
}

fn diagonal(sigma: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal(&sigma.component_mul(sigma))
}

/// Sigmas of three numbers, by `class` where data have not told them.
fn sigmas(known: &CalibrationTerm<3>, class: f64) -> Vector3<f64> {
    Vector3::from_fn(|i, _| known.sigma_of(i).unwrap_or(class))
}

/// Sigmas of scale and axes of a matrix that need not be symmetric, by `settings` where data have not told them.
fn scale_sigmas(gyro: Option<&CalibrationTerm<9>>, settings: &Settings) -> [f64; 6] {
    PAIRS.map(|(i, j)| {
        let class = if i == j {
            settings.scale_prior
        } else {
            settings.cross_prior
        };
        let of = |i: usize, j: usize| gyro.and_then(|g| g.sigma_of(3 * i + j));
        match (of(i, j), of(j, i)) {
            (Some(a), Some(b)) => a.hypot(b) / std::f64::consts::SQRT_2,
            _ => class,
        }
    })
}

impl Meaning {
    /// Prior for a filter of `settings` of a sensor whose calibration was taken out of the samples: the bias only
    /// where that is the calibration's.
    pub(super) fn prior(&self, settings: &Settings, is_bias_calibrated: bool) -> Prior {
        let Some(calibration) = &self.calibration else {
            return Prior::default();
        };
        let c = self.to_body();
        let told = |known: &Option<CalibrationTerm<3>>| known.filter(|k| !k.is_unobserved());
        let by_gyro = c * calibration.gyro_matrix();
        let by_force = c * calibration.force_matrix();
        let by_field = self.field_to_body() * calibration.field_matrix();
        Prior {
            bias: told(&calibration.bias)
                .filter(|_| is_bias_calibrated)
                .map(|bias| {
                    by_gyro * diagonal(&sigmas(&bias, settings.bias_prior)) * by_gyro.transpose()
                }),
            scale: calibration
                .gyro
                .filter(|gyro| !gyro.is_unobserved())
                .map(|gyro| {
                    let map = turned(&c);
                    let sigma = scale_sigmas(Some(&gyro), settings);
                    map * Matrix6::from_diagonal(&sigma.map(|s| s * s).into()) * map.transpose()
                }),
            force_bias: told(&calibration.force_bias).map(|bias| {
                let sigma = sigmas(&bias, settings.force_bias_prior);
                by_force * diagonal(&sigma) * by_force.transpose()
            }),
            lead: calibration.lead.map_or(0.0, |lead| lead.value[0]),
            lead_sigma: calibration.lead.and_then(|lead| lead.sigma_of(0)),
            hard_iron: calibration
                .hard_iron
                .filter(|iron| (0..3).all(|i| iron.sigma_of(i).is_some()))
                .map(|iron| by_field * diagonal(&sigmas(&iron, 0.0)) * by_field.transpose()),
        }
    }

    /// Prior for a smoother: one standard deviation of each number in body axes, where all are known that it
    /// is made of there. Hard iron is not among them: a smoother knows it to a microtesla, whatever was taken out.
    pub(super) fn beforehand(&self) -> PriorSigmas {
        let Some(calibration) = &self.calibration else {
            return PriorSigmas::default();
        };
        let c = self.to_body();
        let matrix = |c: &Matrix3<f64>, known: &Option<CalibrationTerm<9>>| {
            std::array::from_fn(|n| {
                let known = known.as_ref()?;
                about((0..9).map(|m| (c[(n / 3, m / 3)] * c[(n % 3, m % 3)], known.sigma_of(m))))
            })
        };
        let time = |known: &Option<CalibrationTerm<1>>| {
            let known = known.as_ref()?;
            Some((known.value[0], known.sigma_of(0)?))
        };
        PriorSigmas {
            // By the filter's settings, which have what flags say of it, too.
            gyro_bias: [None; 3],
            gyro: matrix(&c, &calibration.gyro),
            force_bias: std::array::from_fn(|n| {
                let known = calibration.force_bias.as_ref()?;
                about((0..3).map(|m| (c[(n, m)], known.sigma_of(m))))
            }),
            force: matrix(&c, &calibration.force),
            force_time: time(&calibration.lead),
            field: matrix(&self.field_to_body(), &calibration.soft_iron),
            // A field's stamps are set right before.
            field_time: time(&calibration.field_lead).map(|(_, sigma)| (0.0, sigma)),
        }
    }

    /// The bias that a calibration takes out and what is not known of it, rad/s, body axes: by the class of the
    /// sensor what it does not say.
    pub(super) fn calibrated_bias(&self, noise: &Noise) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let calibration = self.calibration.as_ref()?;
        let known = calibration.bias.as_ref()?;
        let by_gyro = self.to_body() * calibration.gyro_matrix();
        let class = noise.unremoved_bias().into_iter().fold(0.0, f64::max);
        let covariance = by_gyro * diagonal(&sigmas(known, class)) * by_gyro.transpose();
        let unstable = Vector3::from(noise.unstable_bias());
        let sigma = covariance.diagonal().map(f64::sqrt);
        Some((
            by_gyro * calibration.bias_vector(),
            sigma.zip_map(&unstable, f64::hypot),
        ))
    }
}

/// Calibration of the sensor at the end of a run: what it was known by before, with what the filter has learned.
/// Numbers that the run has told nothing of stay as they were.
///
/// Of a `recording` that was smoothed, that says more than the filter that ran along.
#[must_use]
pub fn learned(
    (plan, resolved, prepared): (&EstimationSettings, &Meaning, &Prepared),
    filter: Option<&Filter>,
    recording: Option<&Recording>,
) -> SensorCalibration {
    let mut known = plan.calibration.as_deref().cloned().unwrap_or_default();
    let c = resolved.to_body();
    let undone = |matrix: Matrix3<f64>| matrix.try_inverse().unwrap_or_else(Matrix3::identity);
    let from_gyro = undone(c * known.gyro_matrix());
    let from_force = undone(c * known.force_matrix());
    let class = prepared.noise.turn_on_bias.into_iter().fold(0.0, f64::max);
    let switched_off = if class > 0.0 {
        SWITCHED_OFF.min(class)
    } else {
        SWITCHED_OFF
    };
    if let Some(left) = prepared.bias_left {
        known.bias = Some(CalibrationTerm {
            value: (from_gyro * prepared.bias.0).into(),
            sigma: Some([left.hypot(switched_off); 3]),
            observed: [true; 3],
        });
    }
    if let Some(step) = prepared.truncation_step {
        known.truncation_step = Some(CalibrationTerm {
            value: [step],
            sigma: None,
            observed: [true],
        });
    }
    if let Some(Recording { smoothed, iron, .. }) = recording {
        if let Some(iron) = iron {
            take_up(&mut known, resolved, iron);
        }
        let class = [prepared.noise.bias_of_class(); 3];
        by_smoother(
            &mut known,
            (resolved, prepared),
            smoothed,
            class,
            switched_off,
        );
        return known;
    }
    let Some(filter) = filter.filter(|f| f.is_started() && !f.is_force_implausible()) else {
        return known;
    };
    let (settings, now) = (filter.settings(), filter.calibration());
    let (bias, scale, force_bias) = filter.calibration_covariance();
    let about = |by: &Matrix3<f64>, covariance: Matrix3<f64>| {
        let sigma = (by * covariance * by.transpose()).diagonal();
        sigma.map(|variance| variance.max(0.0).sqrt()).into()
    };
    let left = c.transpose() * (now.matrix() - Matrix3::identity()) * c;
    let total = (Matrix3::identity() + left) * known.gyro_matrix() - Matrix3::identity();
    let map = turned(&c.transpose());
    let scale = (map * scale * map.transpose()).diagonal();
    let prior = scale_sigmas(known.gyro.as_ref(), settings);
    // Of a symmetric matrix: the states in the places of its elements.
    let everywhere = |of: &dyn Fn(usize) -> f64| {
        let mut all = [0.0; 9];
        for (n, (i, j)) in PAIRS.into_iter().enumerate() {
            all[3 * i + j] = of(n);
            all[3 * j + i] = of(n);
        }
        all
    };
    known.bias = Some(now_known(
        known.bias.as_ref(),
        [settings.bias_prior; 3],
        (from_gyro * (prepared.bias.0 + now.bias)).into(),
        about(&from_gyro, bias),
        switched_off,
    ));
    known.gyro = Some(now_known(
        known.gyro.as_ref(),
        everywhere(&|n| prior[n]),
        total.transpose().as_slice().try_into().unwrap_or([0.0; 9]),
        everywhere(&|n| scale[n].max(0.0).sqrt()),
        0.0,
    ));
    known.force_bias = Some(now_known(
        known.force_bias.as_ref(),
        [settings.force_bias_prior; 3],
        (Vector3::from(vector_of(known.force_bias.as_ref())) + from_force * now.force_bias).into(),
        about(&from_force, force_bias),
        0.0,
    ));
    if let Some((covariance, class)) = filter.hard_iron_covariance() {
        let from_field = undone(resolved.field_to_body() * known.field_matrix());
        let before = Vector3::from(vector_of(known.hard_iron.as_ref()));
        known.hard_iron = Some(now_known(
            known.hard_iron.as_ref(),
            [class; 3],
            (before + from_field * now.hard_iron).into(),
            about(&from_field, covariance),
            0.0,
        ));
    }
    known.lead = Some(now_known(
        known.lead.as_ref(),
        [filter.lead_prior()],
        [now.lead],
        [filter.lead_sigma()],
        0.0,
    ));
    known
}

/// Adds iron that was taken out of the fields before they were smoothed, body axes: the smoother's is of what is left.
fn take_up(known: &mut SensorCalibration, resolved: &Meaning, iron: &FieldIron) {
    let to_body = resolved.field_to_body();
    let before = known.field_matrix();
    let from_body = (to_body * before)
        .try_inverse()
        .unwrap_or_else(Matrix3::identity);
    // Squares turn with the squares of the axes, as of errors that are independent.
    let square = |matrix: &Matrix3<f64>| matrix.component_mul(matrix);
    let offset = Vector3::from(vector_of(known.hard_iron.as_ref())) + from_body * iron.offset;
    let offset_sigma = square(&from_body) * square_of(&iron.offset_sigma);
    known.hard_iron = Some(CalibrationTerm {
        value: offset.into(),
        sigma: Some(offset_sigma.map(f64::sqrt).into()),
        observed: [true; 3],
    });
    let matrix = to_body.transpose() * iron.matrix * to_body * before - Matrix3::identity();
    let sigma = square(&to_body).transpose() * square(&iron.matrix_sigma) * square(&to_body);
    known.soft_iron = Some(CalibrationTerm {
        value: row_by_row(&matrix),
        sigma: Some(row_by_row(&sigma.map(f64::sqrt))),
        observed: [true; 9],
    });
}

fn square_of(sigma: &Vector3<f64>) -> Vector3<f64> {
    sigma.component_mul(sigma)
}

/// Calibration that a whole recording gives. `class`: one sigma of the bias where the recording tells nothing of it.
fn by_smoother(
    known: &mut SensorCalibration,
    (resolved, prepared): (&Meaning, &Prepared),
    smoothed: &Smoothed,
    class: [f64; 3],
    switched_off: f64,
) {
    let found = smoothed.calibration();
    let c = resolved.to_body();
    let undone = |matrix: Matrix3<f64>| matrix.try_inverse().unwrap_or_else(Matrix3::identity);
    // Of errors that are independent: squares turn with the squares of the axes.
    let turned = |by: &Matrix3<f64>, sigma: [f64; 3]| -> [f64; 3] {
        let squares = by.component_mul(by) * Vector3::from(sigma).map(|s| s * s);
        squares.map(f64::sqrt).into()
    };
    // (I + E), found of what was left of a matrix that was known, in the sensor's own axes.
    let whole = |c: &Matrix3<f64>, before: &Matrix3<f64>, found: &Estimated<9>| {
        let left = c.transpose() * Matrix3::from_row_slice(&found.value) * c;
        let total = (Matrix3::identity() + left) * before - Matrix3::identity();
        let square = c.component_mul(c);
        let of = |numbers: &[f64; 9]| -> [f64; 9] {
            let turned =
                square.transpose() * Matrix3::from_row_slice(numbers).map(|s| s * s) * square;
            row_by_row(&turned.map(f64::sqrt))
        };
        let prior = of(&found.prior);
        (row_by_row(&total), observed(of(&found.sigma), prior), prior)
    };
    let from_gyro = undone(c * known.gyro_matrix());
    let from_force = undone(c * known.force_matrix());
    // As it was at the end.
    if let Some(last) = smoothed.biases().last() {
        let sigma = turned(&from_gyro, last.sigma.into());
        let value = from_gyro * (prepared.bias.0 + last.value);
        known.bias = Some(now_known(
            known.bias.as_ref(),
            class,
            value.into(),
            observed(sigma, class),
            switched_off,
        ));
    }
    let (value, sigma, prior) = whole(&c, &known.gyro_matrix(), &found.gyro);
    known.gyro = Some(now_known(known.gyro.as_ref(), prior, value, sigma, 0.0));
    let before = Vector3::from(vector_of(known.force_bias.as_ref()));
    let value = before + from_force * Vector3::from(found.force_bias.value);
    let prior = turned(&from_force, found.force_bias.prior);
    known.force_bias = Some(now_known(
        known.force_bias.as_ref(),
        prior,
        value.into(),
        observed(turned(&from_force, found.force_bias.sigma), prior),
        0.0,
    ));
    let (value, sigma, prior) = whole(&c, &known.force_matrix(), &found.force);
    known.force = Some(now_known(known.force.as_ref(), prior, value, sigma, 0.0));
    // A lead that was known is told to the filter alone: what is found is all of it.
    known.lead = Some(now_known(
        known.lead.as_ref(),
        found.force_time.prior,
        found.force_time.value,
        observed(found.force_time.sigma, found.force_time.prior),
        0.0,
    ));
    let Some(magnetometer) = &found.magnetometer else {
        return;
    };
    let to_body = resolved.field_to_body();
    let from_field = undone(to_body * known.field_matrix());
    // Of the field in the unit it is recorded in.
    let unit = 1.0 / magnetometer.scale;
    let iron = &magnetometer.hard_iron;
    let before = Vector3::from(vector_of(known.hard_iron.as_ref()));
    let prior = turned(&from_field, iron.prior).map(|s| s * unit);
    known.hard_iron = Some(now_known(
        known.hard_iron.as_ref(),
        prior,
        (before + from_field * Vector3::from(iron.value) * unit).into(),
        observed(turned(&from_field, iron.sigma).map(|s| s * unit), prior),
        0.0,
    ));
    let (value, sigma, prior) = whole(&to_body, &known.field_matrix(), &magnetometer.matrix);
    known.soft_iron = Some(now_known(
        known.soft_iron.as_ref(),
        prior,
        value,
        sigma,
        0.0,
    ));
    // Of what the stamps were set right by already.
    let before = known.field_lead.map_or(0.0, |lead| lead.value[0]);
    let time = &magnetometer.time;
    known.field_lead = Some(now_known(
        known.field_lead.as_ref(),
        time.prior,
        time.value.map(|time| before + time),
        observed(time.sigma, time.prior),
        0.0,
    ));
}

fn row_by_row(matrix: &Matrix3<f64>) -> [f64; 9] {
    std::array::from_fn(|n| matrix[(n / 3, n % 3)])
}

fn vector_of(known: Option<&CalibrationTerm<3>>) -> [f64; 3] {
    known.map_or([0.0; 3], |known| known.value)
}

/// Each number as it is known now, where that is better than before, else as it was: by `class` where nothing was
/// known. `lost` is what switching the sensor off leaves unknown.
fn now_known<const N: usize>(
    before: Option<&CalibrationTerm<N>>,
    class: [f64; N],
    value: [f64; N],
    sigma: [f64; N],
    lost: f64,
) -> CalibrationTerm<N> {
    let mut known = before.copied().unwrap_or(CalibrationTerm {
        value: [0.0; N],
        sigma: None,
        observed: [false; N],
    });
    let mut sigmas = known.sigma.unwrap_or(class);
    for i in 0..N {
        if sigma[i] < known.sigma_of(i).unwrap_or(class[i]) && value[i].is_finite() {
            known.value[i] = value[i];
            sigmas[i] = sigma[i].hypot(lost);
            known.observed[i] = true;
        }
    }
    known.sigma = Some(sigmas);
    known
}
