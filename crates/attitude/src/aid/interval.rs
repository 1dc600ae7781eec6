//! Samples since the last correction -> sums. Pure.

use super::calibration::CorrectionMatrices;
use crate::plausible::{are_numbers, is_amount};
use nalgebra::{Matrix3, Vector3};

/// Sums between two corrections. Earth axes but for `rate`.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Interval {
    /// Length, s.
    pub(super) secs: f64,
    /// Time that has a specific force, s.
    pub(super) force_secs: f64,
    /// Integral of the attitude matrix, s.
    pub(super) attitude: Matrix3<f64>,
    /// Change of the attitude for a scale (columns 0 to 2) or a cross axis (3 to 5) of 1, rad.
    pub(super) scaled: [[f64; 6]; 3],
    /// Integral of the specific force, m/s.
    pub(super) force: Vector3<f64>,
    /// Change for a time offset of 1 s.
    pub(super) lead: Vector3<f64>,
    /// Integral of the measured rate, rad, body axes.
    pub(super) rate: Vector3<f64>,
    /// Sum of the field, and how many there are.
    pub(super) field: Vector3<f64>,
    pub(super) fields: f64,
    /// The same sum in body axes, and that of the first row of the attitude matrix: what hard iron does to it.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "crate::aid::calibration::is_nothing")
    )]
    pub(super) field_in_body: Vector3<f64>,
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "crate::aid::calibration::is_nothing")
    )]
    pub(super) by_iron: Vector3<f64>,
    /// Headings from outside: sums of what they say the heading is off by over its variance, 1/rad, and of one over
    /// the variance, 1/rad^2.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub(super) outside: [f64; 2],
    /// Whether a sample was at the end of the gyro's range.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) is_clipped: bool,
}

/// Whether nothing came of it.
#[cfg(feature = "serde")]
fn is_zero(sums: &[f64; 2]) -> bool {
    *sums == [0.0; 2]
}

impl Interval {
    /// Whether its sums can be: what a file says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        let times = [self.secs, self.force_secs, self.fields];
        let vectors = [
            &self.force,
            &self.lead,
            &self.rate,
            &self.field,
            &self.field_in_body,
            &self.by_iron,
        ];
        times.into_iter().all(is_amount)
            && vectors.into_iter().all(are_numbers)
            && are_numbers(&self.attitude)
            && are_numbers(self.scaled.iter().flatten())
            && are_numbers(&self.outside)
            && is_amount(self.outside[1])
    }

    /// The attitude `r` at the end of `secs` in which the mean rate was measured as `rate`.
    #[inline]
    pub(super) fn turn(
        &mut self,
        secs: f64,
        r: &Matrix3<f64>,
        rate: &Vector3<f64>,
        known: &CorrectionMatrices,
    ) {
        let left = rate - known.bias;
        for (i, scaled) in self.scaled.iter_mut().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|j| r[(i, j)] * secs);
            let more = [
                x * left.x,
                y * left.y,
                z * left.z,
                x * left.y + y * left.x,
                x * left.z + z * left.x,
                y * left.z + z * left.y,
            ];
            for (sum, more) in scaled.iter_mut().zip(more) {
                *sum += more;
            }
        }
        self.attitude += r * secs;
        self.rate += rate * secs;
        self.secs += secs;
    }

    /// Mean of the vertical, body axes.
    pub(super) fn up(&self) -> Vector3<f64> {
        self.attitude.row(2).transpose() / self.secs
    }

    /// Sum of the squares of what scale and cross axes do: how much was turned.
    pub(super) fn turned_squared(&self) -> f64 {
        self.scaled.iter().flatten().map(|s| s * s).sum()
    }
}
