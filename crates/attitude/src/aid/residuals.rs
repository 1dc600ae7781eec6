//! Residuals of the specific force, one after another -> the variance of the next. Pure.

use super::settings::Settings;
use crate::plausible::{are_numbers, is_amount};
use nalgebra::Vector3;

/// Statistics of residuals.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Residuals {
    /// Power density, m^2/s^3.
    density: f64,
    /// Mean square of the acceleration itself; nothing in a file that is older than this field.
    #[cfg_attr(feature = "serde", serde(default))]
    acceleration: f64,
    /// Mean square of a residual, and mean product with the one before.
    square: f64,
    product: f64,
    last: [f64; 2],
}

impl Residuals {
    pub(super) fn new(settings: &Settings) -> Residuals {
        Residuals {
            density: settings.force_start,
            ..Residuals::default()
        }
    }

    /// Whether they can be: what a file says may be anything.
    pub(super) fn is_plausible(&self) -> bool {
        [self.density, self.acceleration, self.square]
            .into_iter()
            .all(is_amount)
            && are_numbers(self.last.iter().chain([&self.product]))
    }

    /// The reference was left: what comes has nothing to do with what was.
    pub(super) fn restart(&mut self) {
        (self.square, self.product, self.last) = (0.0, 0.0, [0.0; 2]);
    }

    /// Variance of the residual of an interval of `secs`, in which the acceleration (earth axes) is.
    ///
    /// A wrong tilt carries the velocity and the position of the reference off without bound, and the residual with
    /// them: were that taken for noise, gravity would be believed less and less. So a residual counts in proportion to
    /// the acceleration that is really there.
    pub(super) fn variance(
        &mut self,
        secs: f64,
        residual: [f64; 2],
        acceleration: &Vector3<f64>,
        settings: &Settings,
    ) -> f64 {
        let share = secs / (settings.force_secs + secs);
        let across = acceleration.xy().norm_squared();
        self.acceleration += share * (across - self.acceleration);
        let most = settings.force_carried * self.acceleration.max(across);
        let square = residual[0] * residual[0] + residual[1] * residual[1];
        let counts = if square > most {
            (most / square).sqrt()
        } else {
            1.0
        };
        let [x, y] = residual.map(|one| one * counts);
        let (square, up) = (square.min(most), acceleration.z);
        let now = secs * (0.5 * square).max(settings.force_vertical * up * up);
        self.density += share * (now - self.density);
        let density = settings
            .force_floor
            .max(self.density)
            .max(settings.force_instant * now);
        self.square += share * (square - self.square);
        let product = x * self.last[0] + y * self.last[1];
        self.product += share * (product - self.product);
        self.last = residual;
        // What resembles the one before it says less than its number.
        let likeness = if self.square > 0.0 {
            (self.product / self.square).clamp(0.0, 0.98)
        } else {
            0.0
        };
        let colour = ((1.0 + likeness) / (1.0 - likeness)).powf(settings.colour);
        density / secs * colour
    }
}
