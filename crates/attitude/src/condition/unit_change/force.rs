//! Squared lengths of specific forces -> a step from gravity in one unit to gravity in another. Pure.

use super::{ACCEL_UNITS, UnitChange};
use crate::record::Nanos;

/// Squared length, by the usual, within which a force is the usual one: 0.7 and 1.4 of it.
const USUAL: std::ops::Range<f64> = 0.5..2.0;
/// Samples after which the usual length is known, and its pace.
const KNOWN: u32 = 32;
const PACE: f64 = 1.0 / 64.0;
/// A changed unit stays so for so many samples, and so long, ns.
const SAMPLES: u32 = 32;
const NANOS: i64 = 3_000_000_000;
/// The same of readings that become larger, which a thrust can do, ns.
const NANOS_LARGER: i64 = 6_000_000_000;
/// Time after which lengths that no change of a unit explains are the usual ones, ns.
const GIVEN_UP: i64 = 10_000_000_000;
/// Largest distance of a ratio, as a logarithm, of its scatter, and of the first sample's from that of two units:
/// accelerations move them.
const NEAR: f64 = 0.2;
const SCATTER: f64 = 0.45;
const FIRST: f64 = 0.5;
/// Lengths scatter as before, so many times, and by this: what is left in a free fall is noise.
const MORE: f64 = 2.0;
const STILL: f64 = 0.1;
/// The same of a range of half, or twice: at rest alone.
const RANGE: f64 = 2.0;
const NEAR_RANGE: f64 = 0.03;
const REST: f64 = 0.03;

/// Usual length of a specific force, and a run of others.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct ForceLevel {
    known: u32,
    /// Usual squared length, and the mean square of its deviations as a share.
    square: f64,
    scatter: f64,
    run: Option<Run>,
}

/// Samples of another length, one after the other.
#[derive(Clone, Copy, Debug)]
struct Run {
    from: Nanos,
    samples: u32,
    first: f64,
    /// Sums of logarithms of lengths by the usual, and of their squares.
    sum: f64,
    squares: f64,
}

impl ForceLevel {
    /// Takes the next squared length.
    #[inline]
    pub(super) fn take(&mut self, stamp: Nanos, square: f64) -> Option<UnitChange> {
        if self.known == 0 {
            self.square = square;
        }
        let share = square / self.square;
        if !USUAL.contains(&share) {
            return self.other(stamp, share);
        }
        self.run = None;
        self.known = self.known.saturating_add(1);
        self.square += (square - self.square) * PACE;
        self.scatter += ((share - 1.0) * (share - 1.0) - self.scatter) * PACE;
        None
    }

    #[cold]
    fn other(&mut self, stamp: Nanos, share: f64) -> Option<UnitChange> {
        let length = 0.5 * share.ln();
        if self.known < KNOWN || !length.is_finite() {
            // Nothing to compare with, or nothing there.
            *self = ForceLevel::default();
            return None;
        }
        let run = self.run.get_or_insert(Run {
            from: stamp,
            samples: 0,
            first: length,
            sum: 0.0,
            squares: 0.0,
        });
        run.samples += 1;
        run.sum += length;
        run.squares += length * length;
        let span = stamp.since(run.from);
        if !(0..GIVEN_UP).contains(&span) {
            *self = ForceLevel::default();
            return None;
        }
        let least = if run.sum > 0.0 { NANOS_LARGER } else { NANOS };
        if run.samples < SAMPLES || span < least {
            return None;
        }
        let found = run.change(self.scatter.sqrt() * 0.5)?;
        *self = ForceLevel::default();
        Some(found)
    }
}

impl Run {
    /// The change that this run shows, after readings whose lengths scattered so.
    fn change(&self, scatter_before: f64) -> Option<UnitChange> {
        let n = f64::from(self.samples);
        let mean = self.sum / n;
        let scatter = (self.squares / n - mean * mean).max(0.0).sqrt();
        let is_near = |ratio: f64| (mean.abs() - ratio.ln()).abs() < NEAR;
        let first_off = (self.first - mean).abs();
        let is_unit = ACCEL_UNITS.iter().any(|(ratio, ..)| is_near(*ratio))
            && scatter.max(scatter_before) < SCATTER
            && scatter < MORE * scatter_before + STILL
            && first_off < FIRST;
        let is_range = (mean.abs() - RANGE.ln()).abs() < NEAR_RANGE
            && scatter.max(scatter_before) < REST
            && first_off < 2.0 * REST;
        (is_unit || is_range).then(|| UnitChange {
            at: self.from,
            factor: mean.exp(),
            is_first_right: None,
        })
    }
}
