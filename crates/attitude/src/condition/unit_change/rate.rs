//! Rates and specific forces -> a change of the unit of the rates, by the rotation of gravity. Pure.
//!
//! In windows of a tenth of a second the rotation of gravity by the rates is held against that in the accelerometer.
//! Their ratio is near 1 for a slow motion and smaller for one that accelerates, but it does not jump by the ratio of two
//! units while the rates themselves jump by the same.

use super::{GYRO_UNITS, UnitChange};
use crate::condition::quality::GravityTrack;
use crate::record::Nanos;
use nalgebra::Vector3;

/// Rotation of gravity in a window that says something of the rates, rad, and its cosine with that by the gyro.
const ROTATES: f64 = 0.02;
const ALONG: f64 = 0.8;
/// Logarithm of a window's ratio by the usual that may be another unit's, and the largest of a right one.
const JUMPS: f64 = 1.8;
const RIGHT: f64 = 2.2;
/// Largest distance of the logarithm of the ratio's jump, and of that of the rates, from that of two units.
const NEAR: f64 = 0.6;
const RATES_NEAR: f64 = 1.6;
/// Least rotation of gravity by the rates in a window, as a logarithm (0.0015 rad): below they are noise and bias, and a
/// body that is pushed about without rotating looks like one in a smaller unit.
const LEAST: f64 = -6.5;
/// Scatter of the logarithm within each.
const SCATTER: f64 = 0.9;
/// Windows that show a ratio, most that are remembered of it, and the time within which they come, ns.
const WINDOWS: f64 = 10.0;
const MEMORY: f64 = 16.0;
const NANOS: i64 = 20_000_000_000;

/// Unit of the rates, by those they are taken for.
#[derive(Clone, Debug)]
pub(super) struct RateUnit {
    track: GravityTrack,
    usual: Level,
    /// Windows in a row that show another ratio, and where they begin.
    other: Option<(Level, Nanos)>,
}

/// Mean logarithms of windows: of the ratio, its square, and of the rotation by the rates.
#[derive(Clone, Copy, Debug, Default)]
struct Level {
    windows: f64,
    ratio: f64,
    square: f64,
    rate: f64,
}

impl Default for RateUnit {
    fn default() -> RateUnit {
        RateUnit {
            track: GravityTrack::loose(),
            usual: Level::default(),
            other: None,
        }
    }
}

impl RateUnit {
    /// Takes the next sample.
    #[inline]
    pub(super) fn take(
        &mut self,
        stamp: Nanos,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
    ) -> Option<UnitChange> {
        let rotation = self.track.push(stamp, rate, force)?;
        let (seen, by_gyro) = (rotation.seen.norm(), rotation.by_gyro.norm());
        let along = rotation.seen.dot(&rotation.by_gyro);
        if seen < ROTATES || along <= ALONG * seen * by_gyro {
            return None;
        }
        self.add(rotation.from, (by_gyro / seen).ln(), by_gyro.ln())
    }

    fn add(&mut self, from: Nanos, ratio: f64, rate: f64) -> Option<UnitChange> {
        let jumps = (ratio - self.usual.ratio).abs() > JUMPS;
        if self.usual.windows < WINDOWS || !jumps {
            self.other = None;
            self.usual.add(ratio, rate);
            return None;
        }
        let (other, begun) = self.other.get_or_insert((Level::default(), from));
        if !(0..=NANOS).contains(&from.since(*begun)) {
            self.other = None;
            return None;
        }
        other.add(ratio, rate);
        let (other, begun) = (*other, *begun);
        if other.windows < WINDOWS {
            return None;
        }
        let found = self.usual.change(&other, begun);
        if found.is_some() || other.windows >= MEMORY {
            (self.usual, self.other) = (other, None);
        }
        found
    }
}

impl Level {
    fn add(&mut self, ratio: f64, rate: f64) {
        self.windows = (self.windows + 1.0).min(MEMORY);
        let share = 1.0 / self.windows;
        self.ratio += (ratio - self.ratio) * share;
        self.square += (ratio * ratio - self.square) * share;
        self.rate += (rate - self.rate) * share;
    }

    fn scatter(&self) -> f64 {
        (self.square - self.ratio * self.ratio).max(0.0).sqrt()
    }

    /// The change of unit from this level to `other`, if it is one.
    fn change(&self, other: &Level, at: Nanos) -> Option<UnitChange> {
        let (jump, of_rates) = (other.ratio - self.ratio, other.rate - self.rate);
        let is_steady = self.scatter().max(other.scatter()) < SCATTER;
        let both_ways = GYRO_UNITS.iter().flat_map(|(unit, ..)| [*unit, 1.0 / unit]);
        let unit = both_ways.min_by(|a, b| {
            let off = |unit: &f64| (jump - unit.ln()).abs();
            off(a).total_cmp(&off(b))
        })?;
        let is_unit = (jump - unit.ln()).abs() < NEAR && (of_rates - unit.ln()).abs() < RATES_NEAR;
        let is_motion = self.rate.min(other.rate) > LEAST;
        (is_steady && is_unit && is_motion).then(|| UnitChange {
            at,
            factor: unit,
            is_first_right: match (self.ratio.abs() < RIGHT, other.ratio.abs() < RIGHT) {
                (true, _) => Some(true),
                (_, true) => Some(false),
                _ => None,
            },
        })
    }
}
