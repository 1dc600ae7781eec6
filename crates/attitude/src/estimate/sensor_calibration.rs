//! Calibration of one sensor that is known beforehand, or was learned. Pure.
//!
//! Apart from what the filter knows ([`crate::aid::Calibration`]) because it outlives a run and a mounting: sensor
//! axes as recorded, everything that was taken out before, and how well each number is known.

use crate::diagnostic::Diagnostic;
use crate::estimate::Noise;
use crate::setting::CALIBRATION;
use nalgebra::{Matrix3, Vector3};

/// Largest errors a sensor can have, each element: rad/s, shares, m/s^2, s, the field's unit.
const BIAS: f64 = 10.0;
pub(super) const SHARE: f64 = SensorCalibration::LARGEST_SHARE;
pub(super) const FORCE_BIAS: f64 = 100.0;
pub(super) const LEAD: f64 = 0.5;
pub(super) const FIELD: f64 = 1e6;
const STEP: f64 = 1.0;

/// Numbers of a calibration with what is known of each. Matrices row by row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CalibrationTerm<const N: usize> {
    /// The numbers.
    pub value: [f64; N],
    /// One standard deviation of each.
    pub sigma: Option<[f64; N]>,
    /// Whether data have told them; what they have not is known no better than of any sensor.
    pub observed: [bool; N],
}

impl<const N: usize> CalibrationTerm<N> {
    /// One standard deviation of a number that data have told.
    #[must_use]
    pub fn sigma_of(&self, i: usize) -> Option<f64> {
        let sigma = self.sigma.as_ref()?.get(i).copied()?;
        self.observed.get(i).is_some_and(|o| *o).then_some(sigma)
    }

    /// Whether nothing of it was told by data.
    #[must_use]
    pub fn is_unobserved(&self) -> bool {
        (0..N).all(|i| self.sigma_of(i).is_none())
    }

    fn check(&self, key: &str, unit: &str, largest: f64) -> Result<(), Diagnostic> {
        for value in self.value {
            if value.is_nan() || value.abs() > largest {
                return Err(format!(
                    "`{key}`: {value} is no error of a sensor; at most {largest} {unit}"
                )
                .into());
            }
        }
        for sigma in self.sigma.iter().flatten() {
            if !(*sigma > 0.0 && *sigma <= largest) {
                return Err(format!(
                    "`{key}`: sigma {sigma} is none; above 0, at most {largest} {unit}"
                )
                .into());
            }
        }
        Ok(())
    }
}

/// Calibration of a sensor.
///
/// # Convention
/// Sensor axes as recorded, before `--body` and `--mount`; rates in rad/s, specific force in m/s^2, the field in the
/// unit it is recorded in:
///
/// ```text
/// rate  = (I + G) (gyro - bias)
/// force = (I + A) (accel - ba),  of the attitude `lead` after its stamp
/// field = (I + S) (mag - h),     of the attitude `mag_lead` after its stamp
/// ```
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SensorCalibration {
    /// Name of the sensor.
    pub sensor: Option<String>,
    /// Time of the last sample that it comes from.
    pub date: Option<String>,
    /// Names of the recordings that it comes from.
    pub sources: Vec<String>,
    /// Gyro bias, rad/s.
    pub bias: Option<CalibrationTerm<3>>,
    /// G: scale and axes of the gyro.
    pub gyro: Option<CalibrationTerm<9>>,
    /// ba: accelerometer bias, m/s^2.
    pub force_bias: Option<CalibrationTerm<3>>,
    /// A: scale and axes of the accelerometer.
    pub force: Option<CalibrationTerm<9>>,
    /// Accelerometer lead, s.
    pub lead: Option<CalibrationTerm<1>>,
    /// h: hard iron.
    pub hard_iron: Option<CalibrationTerm<3>>,
    /// S: soft iron.
    pub soft_iron: Option<CalibrationTerm<9>>,
    /// Lead of the magnetometer, s.
    pub field_lead: Option<CalibrationTerm<1>>,
    /// Step in which the driver cuts the rates towards zero, rad/s.
    pub truncation_step: Option<CalibrationTerm<1>>,
}

impl SensorCalibration {
    /// Largest entry of a matrix: of 1, or rad.
    pub const LARGEST_SHARE: f64 = 0.3;

    /// Checks that a sensor can be like this.
    ///
    /// # Errors
    /// In words, naming the key.
    pub fn check(&self) -> Result<(), Diagnostic> {
        fn of<const N: usize>(
            known: &Option<CalibrationTerm<N>>,
            key: &str,
            unit: &str,
            largest: f64,
        ) -> Result<(), Diagnostic> {
            known
                .as_ref()
                .map_or(Ok(()), |k| k.check(key, unit, largest))
        }
        of(&self.bias, "bias", "rad/s", BIAS)?;
        of(&self.gyro, "G", "(of 1, or rad)", SHARE)?;
        of(&self.force_bias, "ba", "m/s^2", FORCE_BIAS)?;
        of(&self.force, "A", "(of 1, or rad)", SHARE)?;
        of(&self.lead, "lead", "s", LEAD)?;
        of(&self.hard_iron, "h", "in the unit of the field", FIELD)?;
        of(&self.soft_iron, "S", "(of 1, or rad)", SHARE)?;
        of(&self.field_lead, "mag_lead", "s", LEAD)?;
        of(&self.truncation_step, "truncation_step", "rad/s", STEP)?;
        if self.step().is_some_and(|step| step <= 0.0) {
            return Err("`truncation_step`: a step is above 0".into());
        }
        Ok(())
    }

    /// Warning that it is taken for a sensor of another name.
    #[must_use]
    pub fn mismatch(&self, name: &str) -> Option<String> {
        let own = self.sensor.as_deref().filter(|own| *own != name)?;
        Some(format!(
            "{CALIBRATION}: the file is of the sensor `{own}`, and this is `{name}`: it was taken all the same"
        ))
    }

    /// `I + G`.
    #[must_use]
    pub(crate) fn gyro_matrix(&self) -> Matrix3<f64> {
        matrix(self.gyro.as_ref())
    }

    /// `I + A`.
    #[must_use]
    pub(crate) fn force_matrix(&self) -> Matrix3<f64> {
        matrix(self.force.as_ref())
    }

    /// `I + S`.
    #[must_use]
    pub(crate) fn field_matrix(&self) -> Matrix3<f64> {
        matrix(self.soft_iron.as_ref())
    }

    /// Gyro bias, rad/s.
    #[must_use]
    pub(crate) fn bias_vector(&self) -> Vector3<f64> {
        vector(self.bias.as_ref())
    }

    /// Accelerometer bias, m/s^2.
    #[must_use]
    pub(crate) fn force_bias_vector(&self) -> Vector3<f64> {
        vector(self.force_bias.as_ref())
    }

    /// Hard iron, in the field's unit.
    #[must_use]
    pub(crate) fn hard_iron_vector(&self) -> Vector3<f64> {
        vector(self.hard_iron.as_ref())
    }

    /// Step of truncation, rad/s.
    #[must_use]
    pub fn step(&self) -> Option<f64> {
        self.truncation_step.map(|step| step.value[0])
    }

    /// The noise of a class of sensors with what is known of scale and axes of this one.
    #[must_use]
    pub fn narrowed(&self, noise: &Noise) -> Noise {
        let Some(gyro) = &self.gyro else {
            return noise.clone();
        };
        let largest = |is_diagonal: bool, class: f64| {
            (0..9)
                .filter(|i| (i % 4 == 0) == is_diagonal)
                .map(|i| gyro.sigma_of(i).unwrap_or(class))
                .fold(0.0, f64::max)
        };
        Noise {
            scale: largest(true, noise.scale),
            misalignment: largest(false, noise.misalignment),
            ..noise.clone()
        }
    }
}

fn matrix(known: Option<&CalibrationTerm<9>>) -> Matrix3<f64> {
    known.map_or_else(Matrix3::identity, |known| {
        Matrix3::identity() + Matrix3::from_row_slice(&known.value)
    })
}

fn vector(known: Option<&CalibrationTerm<3>>) -> Vector3<f64> {
    known.map_or_else(Vector3::zeros, |known| known.value.into())
}
