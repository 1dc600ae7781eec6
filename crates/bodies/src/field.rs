//! A place and a time -> the magnetic field there. Pure.

use nalgebra::Vector3;

/// The field a magnetometer is in: the Earth's, and what disturbs it for a while.
///
/// # Convention
/// Tesla, navigation axes: x east, y north, z up. The dip is positive where the field points down, the
/// declination where it points east of north.
#[derive(Clone, PartialEq, Debug)]
pub struct Field {
    earth_n: Vector3<f64>,
    disturbances: Vec<Disturbance>,
}

/// A field that comes within a second, stays, and goes within a second.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Disturbance {
    /// Beginning, s since the start.
    pub from: f64,
    /// End, s since the start.
    pub to: f64,
    /// Field added in between, tesla, navigation axes.
    pub added_n: Vector3<f64>,
}

/// Rise and fall time of a disturbance, s.
const EDGE: f64 = 1.0;

impl Field {
    /// Strength in tesla, dip and declination in rad.
    #[must_use]
    pub fn new(strength: f64, dip: f64, declination: f64, disturbances: Vec<Disturbance>) -> Self {
        let (down, level) = dip.sin_cos();
        let (east, north) = declination.sin_cos();
        Self {
            earth_n: strength * Vector3::new(level * east, level * north, -down),
            disturbances,
        }
    }

    /// The field at `secs` since the start.
    #[must_use]
    pub fn at(&self, secs: f64) -> Vector3<f64> {
        self.disturbances.iter().fold(self.earth_n, |sum, d| {
            let part = ((secs - d.from).min(d.to - secs) / EDGE).clamp(0.0, 1.0);
            sum + d.added_n * (part * part * (3.0 - 2.0 * part))
        })
    }
}
