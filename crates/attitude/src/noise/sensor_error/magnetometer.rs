//! True field -> what a magnetometer reads. Pure, seeded.
//!
//! ```text
//! true field -> soft iron -> hard iron -> white -> quantisation
//! ```
//!
//! Iron that turns with the sensor; what stands in the world is part of the field.

use super::normal::{Purpose, Stream, vector};
use super::{ImuError, ImuErrorFault};
use nalgebra::{Matrix3, Vector3};

/// A running magnetometer.
#[derive(Clone, Debug)]
pub struct MagnetometerModel {
    soft_iron: Matrix3<f64>,
    hard_iron: Vector3<f64>,
    noise: f64,
    step: f64,
    white: [Stream; 3],
}

impl MagnetometerModel {
    /// A sensor whose iron is drawn from `seed`, as its noise is.
    ///
    /// # Errors
    /// What [`ImuError::check`] refuses.
    pub fn new(error: &ImuError, seed: u64) -> Result<MagnetometerModel, ImuErrorFault> {
        error.check()?;
        let [mut x, mut y, mut z] = Stream::axes(seed, Purpose::SoftIron);
        // Symmetric: iron answers along the field it is in, and its axes are at any angle.
        let [xx, xy, xz] = [x.normal(), x.normal(), x.normal()];
        let [yy, yz, zz] = [y.normal(), y.normal(), z.normal()];
        let iron = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Ok(MagnetometerModel {
            soft_iron: Matrix3::identity() + error.mag_soft_iron * iron,
            hard_iron: error.mag_hard_iron * vector(&mut Stream::axes(seed, Purpose::HardIron)),
            noise: error.mag_noise,
            step: error.mag_lsb,
            white: Stream::axes(seed, Purpose::MagneticNoise),
        })
    }

    /// Reading in a field, tesla, sensor axes.
    pub fn measure(&mut self, field: &Vector3<f64>) -> Vector3<f64> {
        let mut read = self.soft_iron * field + self.hard_iron;
        if self.noise > 0.0 {
            read += self.noise * vector(&mut self.white);
        }
        if self.step > 0.0 {
            read.apply(|v| *v = (*v / self.step).round() * self.step);
        }
        read
    }

    /// The field of the iron that turns with the sensor, tesla.
    #[must_use]
    pub fn hard_iron(&self) -> Vector3<f64> {
        self.hard_iron
    }
}
