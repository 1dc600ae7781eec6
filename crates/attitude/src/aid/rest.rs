//! Rate and force -> whether the sensor is at rest. Pure.

use super::memory::LARGEST;
use super::settings::Settings;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Intervals whose rest is not certain.
const MOST_OPEN: usize = 64;
/// Time constant of the means that deviations are from, s.
const MEAN_SECS: f64 = 0.5;

/// Whether rate and force have been quiet for long enough.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Rest {
    rate: Vector3<f64>,
    force: Vector3<f64>,
    /// How long all has been quiet, s.
    quiet: f64,
    /// Mean rates (rad/s) and lengths (s) of the last intervals at rest, whose end is not known yet.
    open: VecDeque<(Vector3<f64>, f64)>,
}

impl Rest {
    pub(super) fn new(force: Vector3<f64>) -> Rest {
        Rest {
            rate: Vector3::zeros(),
            force,
            quiet: 0.0,
            open: VecDeque::new(),
        }
    }

    /// A sample `secs` after the one before. `bias`: as far as known, with the sigma of each axis.
    #[inline]
    pub(super) fn take(
        &mut self,
        secs: f64,
        rate: &Vector3<f64>,
        force: Option<&Vector3<f64>>,
        (bias, sigma): (&Vector3<f64>, impl Fn(usize) -> f64),
        settings: &Settings,
    ) {
        let share = secs / (MEAN_SECS + secs);
        self.rate += (rate - self.rate) * share;
        let mut is_quiet = (rate - self.rate).norm_squared() <= settings.rest_gyro.powi(2)
            && secs <= settings.gap_secs;
        if let Some(force) = force {
            self.force += (force - self.force) * share;
            is_quiet &= (force - self.force).norm_squared() <= settings.rest_force.powi(2);
        }
        is_quiet = is_quiet
            && (0..3).all(|i| {
                if settings.rest_beside_bias {
                    (self.rate[i] - bias[i]).abs() <= settings.rest_rate + 3.0 * sigma(i)
                } else {
                    self.rate[i].abs() <= settings.rest_rate
                }
            });
        self.quiet = if is_quiet { self.quiet + secs } else { 0.0 };
    }

    /// A pause: what was before it says nothing.
    pub(super) fn interrupt(&mut self) {
        self.quiet = 0.0;
        self.open.clear();
    }

    /// The mean rate over an interval at rest, and of the intervals before it that over which rest is certain by
    /// now, with its length: the body has rested on for long enough since.
    pub(super) fn certain(
        &mut self,
        mean: Vector3<f64>,
        secs: f64,
        settings: &Settings,
    ) -> Option<(Vector3<f64>, f64)> {
        self.open.push_back((mean, secs));
        let waiting: f64 = self.open.iter().map(|(_, secs)| secs).sum();
        (waiting > settings.rest_lag).then(|| self.open.pop_front())?
    }

    /// It moves: what was quiet just before may have been the beginning of it.
    pub(super) fn moves(&mut self) {
        self.open.clear();
    }

    /// Whether it can have come about.
    pub(super) fn is_bounded(&self) -> bool {
        let is_small = |v: &Vector3<f64>| v.amax() <= LARGEST;
        let is_time = |secs: f64| (0.0..=LARGEST).contains(&secs);
        self.open.len() <= MOST_OPEN
            && is_small(&self.rate)
            && is_small(&self.force)
            && is_time(self.quiet)
            && self
                .open
                .iter()
                .all(|(rate, secs)| is_small(rate) && is_time(*secs))
    }

    pub(super) fn is_quiet(&self, settings: &Settings) -> bool {
        self.quiet > settings.rest_secs
    }
}
