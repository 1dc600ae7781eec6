//! Rates of one topic -> axes whose numbers wrap: the sensor turned faster than its range, and the reading went on at
//! the other end of it. Pure.
//!
//! A stage of its own because it shows between four readings alone: towards one end, a leap to the other end, and on in
//! the same direction. A spike comes back, a vibration turns round, and what is clipped stays.

/// Leaps of an axis from which it is said.
const LEAST: u64 = 3;
/// Least reading on either side of a leap, as a share of the largest one; and of the leaps that are counted together.
const AT_END: f64 = 0.8;
/// Largest step before and after a leap, as a share of the reading there; and how far on both together lead at least.
const STEP: f64 = 0.5;
const ONWARD: f64 = 0.01;
/// Largest reading, as a share of the level of the leaps.
const BEYOND: f64 = 1.1;
/// Rate, rad/s, below which nothing is at the end of a range.
const SLOWEST: f64 = 1.0;

/// Axis whose numbers wrap.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WrappedAxis {
    /// Reading at which they do, source's unit.
    pub level: f64,
    /// Number of leaps.
    pub leaps: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    /// The last three readings, the oldest first.
    last: [f64; 3],
    seen: u64,
    largest: f64,
    level: f64,
    leaps: u64,
}

/// Readings of three axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct WrappedAxes {
    axes: [Axis; 3],
    /// One rad/s in the unit of the source.
    rad: f64,
}

impl WrappedAxes {
    /// Watch over rates of which `rad` are one rad/s.
    pub(super) fn new(rad: f64) -> WrappedAxes {
        WrappedAxes {
            axes: [Axis::default(); 3],
            rad,
        }
    }

    /// Takes the next rates, which are finite.
    #[inline]
    pub(super) fn push(&mut self, gyro: &[f64; 3]) {
        for (axis, rate) in self.axes.iter_mut().zip(gyro) {
            axis.push(*rate, SLOWEST * self.rad);
        }
    }

    /// The axes that wrap.
    pub(super) fn found(&self) -> [Option<WrappedAxis>; 3] {
        self.axes.map(|axis| {
            let is_end = axis.largest <= BEYOND * axis.level;
            (axis.leaps >= LEAST && is_end).then_some(WrappedAxis {
                level: axis.level,
                leaps: axis.leaps,
            })
        })
    }

    /// Largest reading of an axis so far.
    pub(super) fn largest(&self) -> [f64; 3] {
        self.axes.map(|axis| axis.largest)
    }
}

impl Axis {
    #[inline]
    fn push(&mut self, rate: f64, slowest: f64) {
        let [earlier, from, to] = self.last;
        self.last = [from, to, rate];
        self.seen += 1;
        self.largest = self.largest.max(rate.abs());
        if self.seen > 3 && from * to < 0.0 {
            self.look([earlier, from, to, rate], slowest);
        }
    }

    /// Looks at a change of sign, between its neighbours.
    fn look(&mut self, [earlier, from, to, next]: [f64; 4], slowest: f64) {
        let end = from.abs().min(to.abs());
        let (before, after) = (
            (from - earlier) * from.signum(),
            (next - to) * from.signum(),
        );
        let is_leap = end >= slowest.max(AT_END * self.largest)
            && before.abs().max(after.abs()) < STEP * end
            && before + after >= ONWARD * end;
        if !is_leap {
            return;
        }
        // Before the true end was seen, nothing was one.
        if AT_END * end > self.level {
            self.leaps = 0;
        }
        self.leaps += 1;
        self.level = self.level.max(end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(rates: impl Iterator<Item = f64>) -> Option<WrappedAxis> {
        let mut axes = WrappedAxes::new(1.0);
        rates.for_each(|rate| axes.push(&[0.1, rate, -0.2]));
        assert_eq!((axes.found()[0], axes.found()[2]), (None, None));
        axes.found()[1]
    }

    fn wrapped(rate: f64, range: f64) -> f64 {
        (rate + range).rem_euclid(2.0 * range) - range
    }

    #[test]
    fn numbers_that_wrap_are_seen_with_their_range() {
        let swing = |k: i32| 7.0 * (f64::from(k) * 0.03).sin();
        let seen = found((0..4000).map(|k| wrapped(swing(k), 4.36))).unwrap_or_default();
        assert!(
            (seen.level - 4.36).abs() < 0.2 && seen.leaps >= 60,
            "{seen:?}"
        );
        // Within the range, nothing does.
        assert_eq!(found((0..4000).map(swing)), None);
    }

    #[test]
    fn vibrations_clipped_rates_and_spikes_do_not_wrap() {
        for period in [2.0, 3.0, 4.0, 4.1, 5.0, 6.3, 9.0] {
            for amplitude in [2.0, 40.0] {
                let phase = |k: i32| std::f64::consts::TAU * f64::from(k) / period + 0.785;
                let rates = (0..4000).map(|k| amplitude * phase(k).sin());
                assert_eq!(found(rates.clone()), None, "{period}");
                let clipped = rates.map(|rate| rate.clamp(-0.6 * amplitude, 0.6 * amplitude));
                assert_eq!(found(clipped), None, "{period}, clipped");
            }
        }
        let spike = |k: i32| {
            if k % 50 == 7 {
                -4.0
            } else {
                4.0 * (f64::from(k) * 0.01).cos()
            }
        };
        assert_eq!(found((0..4000).map(spike)), None);
    }

    impl Default for WrappedAxis {
        fn default() -> WrappedAxis {
            WrappedAxis {
                level: 0.0,
                leaps: 0,
            }
        }
    }
}
