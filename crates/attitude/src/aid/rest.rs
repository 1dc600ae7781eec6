//! Rate and force -> whether the sensor is at rest, and what its gyro reads there. Pure.

use super::settings::Settings;
use crate::condition::stillness::{Swing, is_solely_vertical};
use crate::plausible::{are_numbers, is_amount};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Intervals of a quiet spell that are remembered.
const MOST: usize = 50;
/// Least intervals that tell how much they scatter.
const FEW: usize = 8;
/// Time constant of the means that deviations are from, s.
const MEAN_SECS: f64 = 0.5;
/// Largest change of the mean rate of a rest from its first half to its second, beside three sigmas, rad/s.
const DRIFT: f64 = 0.002;

/// Whether rate and force have been quiet for long enough.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Rest {
    rate: Vector3<f64>,
    force: Vector3<f64>,
    /// Time for which all has been quiet, s.
    quiet: f64,
    /// Mean rates (rad/s) and lengths (s) of the last intervals since all became quiet.
    open: VecDeque<(Vector3<f64>, f64)>,
    /// Whether an interval of this spell has been taken for rest.
    #[cfg_attr(feature = "serde", serde(default))]
    is_certain: bool,
    /// The force at the last interval of the spell, and how it has moved in it.
    #[cfg_attr(feature = "serde", serde(default))]
    last_force: Option<Vector3<f64>>,
    #[cfg_attr(feature = "serde", serde(default))]
    swing: Swing,
    /// The mean rate of the first interval, rad/s, and whether one has been another by more than a rest allows: until
    /// then a rate about the vertical is that of all that was seen.
    #[cfg_attr(feature = "serde", serde(default))]
    first: Option<Vector3<f64>>,
    #[cfg_attr(feature = "serde", serde(default))]
    has_moved: bool,
}

/// Readings of an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    /// Mean rate, rad/s, body axes.
    pub(super) mean: Vector3<f64>,
    /// Mean rate less the known bias, rad/s.
    pub(super) off: Vector3<f64>,
    /// The vertical in the body, any length.
    pub(super) up: Vector3<f64>,
    /// Length, s.
    pub(super) secs: f64,
}

/// The gyro's reading of a rest.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct RestRate {
    /// Mean rate, rad/s, body axes.
    pub(super) mean: Vector3<f64>,
    /// Variance of the mean, (rad/s)^2.
    pub(super) variance: Vector3<f64>,
}

impl Rest {
    pub(super) fn new(force: Vector3<f64>) -> Rest {
        Rest {
            force,
            ..Rest::default()
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
        self.forget();
    }

    fn forget(&mut self) {
        self.open.clear();
        self.is_certain = false;
        self.last_force = None;
        self.swing = Swing::default();
    }

    /// Takes an interval. Returns what the gyro reads at rest, once the body has rested on for long enough since: the mean
    /// of the whole spell the first time, then of one interval each.
    pub(super) fn take_interval(
        &mut self,
        interval: &Interval,
        is_at_rest: bool,
        settings: &Settings,
    ) -> Option<RestRate> {
        let Interval {
            mean,
            off,
            up,
            secs,
        } = *interval;
        let first = self.first.get_or_insert(mean);
        self.has_moved |= (mean - *first).norm() > settings.rest_gyro;
        if self.quiet < secs {
            self.forget();
            return None;
        }
        // Before that the mean force is still that of what came before.
        if self.quiet > 2.0 * MEAN_SECS
            && let Some(last) = self.last_force.replace(self.force)
        {
            self.swing.take([&last, &self.force], &off, secs);
        }
        if self.swing.is_turn() {
            self.interrupt();
            return None;
        }
        if self.open.len() >= MOST {
            self.open.pop_front();
        }
        self.open.push_back((mean, secs));
        if !is_at_rest {
            return None;
        }
        if !settings.rest_by_spell {
            return Some(RestRate {
                mean,
                variance: Vector3::repeat(settings.rest_noise.powi(2) / secs),
            });
        }
        // A motion that sets in slowly is quiet at first: the last of it is left open.
        let mut open = 0.0;
        let late = self.open.iter().rev().take_while(|(_, secs)| {
            let is_open = open + 0.5 * secs < settings.rest_lag;
            open += secs;
            is_open
        });
        let certain = self.open.len() - late.count();
        if certain < FEW || self.swing.is_open(secs) {
            return None;
        }
        let known = || self.open.iter().take(certain);
        let count = certain as f64;
        let whole = known().map(|(mean, _)| mean).sum::<Vector3<f64>>() / count;
        let scatter = known()
            .map(|(mean, _)| (mean - whole).map(|d| d * d))
            .sum::<Vector3<f64>>()
            / (count - 1.0);
        // What is known of the bias is in `off` alone.
        let is_sole = settings.rest_by_direction && !self.has_moved && !self.is_certain;
        if self.changes(&scatter) || is_sole && is_solely_vertical(&(whole - mean + off), &up) {
            return None;
        }
        let one = scatter.map(|of| of.max(settings.rest_noise.powi(2) / secs));
        if self.is_certain {
            let (mean, _) = self.open.get(certain - 1)?;
            return Some(RestRate {
                mean: *mean,
                variance: one,
            });
        }
        self.is_certain = true;
        // What the gyro reads beside its bias is another from here on.
        self.swing = Swing::default();
        Some(RestRate {
            mean: whole,
            variance: one / count,
        })
    }

    /// Whether the rate changes from one half of the spell to the other, or scatters more than neighbours do: a slow
    /// turn that sets in or ends, a swell, and no bias. Neighbours tell the noise, which a slow change is not in.
    fn changes(&self, scatter: &Vector3<f64>) -> bool {
        let half = self.open.len() / 2;
        let sum = |from: usize| {
            let part = self.open.iter().skip(from).take(half);
            part.map(|(mean, _)| mean).sum::<Vector3<f64>>() / half as f64
        };
        let change = sum(0) - sum(self.open.len() - half);
        let neighbours = self.open.iter().zip(self.open.iter().skip(1));
        let squares = neighbours
            .map(|((a, _), (b, _))| (b - a).map(|d| d * d))
            .sum::<Vector3<f64>>();
        let noise = squares / (2.0 * (self.open.len() - 1) as f64);
        (0..3).any(|i| {
            let sigma = (noise[i] * 2.0 / half as f64).sqrt();
            change[i].abs() > DRIFT + 3.0 * sigma || scatter[i] > DRIFT * DRIFT + 9.0 * noise[i]
        })
    }

    /// Whether it can have come about.
    pub(super) fn is_bounded(&self) -> bool {
        self.open.len() <= MOST
            && are_numbers(&self.rate)
            && are_numbers(&self.force)
            && is_amount(self.quiet)
            && self.last_force.as_ref().is_none_or(are_numbers)
            && self.first.as_ref().is_none_or(are_numbers)
            && self.swing.is_plausible()
            && self
                .open
                .iter()
                .all(|(rate, secs)| are_numbers(rate) && is_amount(*secs))
    }

    pub(super) fn is_quiet(&self, settings: &Settings) -> bool {
        self.quiet > settings.rest_secs
    }
}
