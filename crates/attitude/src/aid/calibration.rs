//! Calibration of the sensor: raw rate -> true rate. Pure.

use nalgebra::{Matrix3, Vector3};

/// Errors of gyro and accelerometer as the filter knows them. Body axes.
///
/// Gyro: `rate = M (measured - bias)`, `M = 1 + [[s_x, c_xy, c_xz], [c_xy, s_y, c_yz], [c_xz, c_yz, s_z]]`:
/// symmetric, since a rotation between the axes of gyro and accelerometer is mounting.
/// Accelerometer: `force = measured - force_bias`, and it belongs to the attitude `lead` after its stamp.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Calibration {
    /// Gyro bias, rad/s.
    pub bias: Vector3<f64>,
    /// Gyro scale factors less 1: x, y, z.
    pub scale: Vector3<f64>,
    /// Angles between the gyro's axes, rad: xy, xz, yz.
    pub cross: Vector3<f64>,
    /// Accelerometer bias, m/s^2.
    pub force_bias: Vector3<f64>,
    /// Accelerometer lead, s.
    pub lead: f64,
    /// Hard iron, in the field's unit: a field that turns with the body. Zero unless it is asked for.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "crate::aid::calibration::is_nothing")
    )]
    pub hard_iron: Vector3<f64>,
}

impl Calibration {
    /// M.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        let (s, c) = (&self.scale, &self.cross);
        Matrix3::new(
            1.0 + s.x,
            c.x,
            c.y,
            c.x,
            1.0 + s.y,
            c.z,
            c.y,
            c.z,
            1.0 + s.z,
        )
    }
}

/// Part of a calibration by which a rate is corrected.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct CorrectionMatrices {
    pub(super) bias: Vector3<f64>,
    pub(super) matrix: Matrix3<f64>,
}

impl CorrectionMatrices {
    pub(crate) fn of(calibration: &Calibration) -> CorrectionMatrices {
        CorrectionMatrices {
            bias: calibration.bias,
            matrix: calibration.matrix(),
        }
    }

    /// The true rate of a measured one, rad/s; or the true turn, rad, of one measured over `secs`.
    #[inline]
    pub(crate) fn corrected(self, measured: Vector3<f64>, secs: f64) -> Vector3<f64> {
        self.matrix * (measured - self.bias * secs)
    }
}

/// Whether it is zero to the bit, and so takes no place in a text.
#[cfg(feature = "serde")]
pub(super) fn is_nothing(v: &Vector3<f64>) -> bool {
    v.iter().all(|c| c.to_bits() == 0)
}
