//! Samples in the order they came -> whether a sensor's unit, or its range, changes on the way. Pure.
//!
//! A stage of its own because it needs the samples of before: a driver that was started anew with other settings, or two
//! recordings put into one. The accelerometer tells by the length of gravity, the gyro by how far gravity rotates in the
//! accelerometer: a gyro alone shows nothing. `docs/theory/consistency.md` has the numbers.

mod force;
mod rate;
mod sign;

use super::gate::{Entry, finite_accel};
use crate::record::Nanos;
use force::ForceLevel;
use rate::RateUnit;
use sign::ForceSign;

/// Units of a gyro: ratio of their readings for the same rate, the unit of the larger, of the smaller.
pub const GYRO_UNITS: [(f64, &str, &str); 3] = [
    (180.0 / std::f64::consts::PI, "deg/s", "rad/s"),
    (1000.0, "mrad/s", "rad/s"),
    (1000.0 * std::f64::consts::PI / 180.0, "mrad/s", "deg/s"),
];
/// Units of an accelerometer, as [`GYRO_UNITS`].
pub const ACCEL_UNITS: [(f64, &str, &str); 3] = [
    (9.806_65, "m/s^2", "g"),
    (1000.0, "mg", "g"),
    (1000.0 / 9.806_65, "mg", "m/s^2"),
];

/// Change of a sensor's unit or range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UnitChange {
    /// Stamp of the first sample behind it, or near it.
    pub at: Nanos,
    /// Readings behind it by those before, for the same motion; -1 where the sign changed.
    pub factor: f64,
    /// Whether the readings before it had the unit they were taken for; `None` where that is not known.
    pub is_first_right: Option<bool>,
}

/// Changes that were found, the first of each sensor.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub struct UnitChanges {
    /// Gyro.
    pub gyro: Option<UnitChange>,
    /// Accelerometer.
    pub accel: Option<UnitChange>,
}

/// Watch over one stream.
#[derive(Clone, Debug, Default)]
pub(super) struct UnitWatch {
    force: ForceLevel,
    sign: ForceSign,
    rate: RateUnit,
}

impl UnitWatch {
    /// Takes the next sample; those without a force tell nothing.
    #[inline]
    pub(super) fn take(&mut self, entry: &Entry, is_rate: bool, found: &mut UnitChanges) {
        let Some(force) = finite_accel(&entry.accel) else {
            return;
        };
        if found.accel.is_none() {
            let turned = self.sign.take(entry, is_rate, &force);
            found.accel = self
                .force
                .take(entry.stamp, force.norm_squared())
                .or(turned);
        }
        if is_rate && found.gyro.is_none() {
            found.gyro = self.rate.take(entry.stamp, &entry.value, &force);
        }
    }
}

#[cfg(test)]
mod tests;
