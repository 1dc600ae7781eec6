//! The samples of one run, axis by axis, with what windows need to know about them. Pure.
//!
//! A run is what lies between two breaks (start, hold, reset). Element k of a track is sample k of
//! the run; the interval k ends at element k and begins at element k - 1. Old elements are dropped.

use crate::lanes::{Lanes, Triple};

/// Share of the increment's own length that separates a stretch without rotation data from clock rounding.
const HOLE: f64 = 0.05;

#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    /// Whether values are increments.
    pub(crate) increments: bool,
    /// Elements dropped from the front, so that `base + k` counts from the start of the run.
    pub(crate) base: usize,
    pub(crate) stamp: Vec<i64>,
    /// Increments: where each begins. Equals the stamp before when nothing is missing.
    pub(crate) start: Vec<i64>,
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
    pub(crate) z: Vec<f64>,
    /// Number of spacings in a row, the last one ending here, that are equal and without holes.
    same: Vec<u8>,
    /// Number of increments in a row, the last one ending here, that join without holes.
    joined: Vec<u8>,
    /// Samples are missing before this one.
    pub(crate) bridged: Vec<bool>,
}

impl Track {
    pub(crate) fn new(increments: bool) -> Self {
        Track {
            increments,
            ..Track::default()
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.stamp.len()
    }

    pub(crate) fn clear(&mut self) {
        self.base = 0;
        self.drop_front(self.len());
        self.base = 0;
    }

    /// Appends a sample later than the last. `start` is ignored for rates.
    pub(crate) fn push(&mut self, stamp: i64, start: i64, value: [f64; 3], bridged: bool) {
        let last = self.len().checked_sub(1);
        let mut start = start;
        let mut joins = last.is_some();
        if let Some(last) = last {
            let before = self.stamp[last];
            if !self.increments || start >= stamp || start <= before {
                start = before;
            } else {
                let own = stamp.saturating_sub(start) as f64;
                let hole = start.saturating_sub(before) as f64;
                joins = hole <= HOLE * own;
                if joins {
                    start = before;
                }
            }
        } else if start >= stamp {
            // Nobody says where the first increment began: it tells nothing about the rate.
            start = stamp;
        }
        let spacing = stamp.saturating_sub(start);
        let (mut same, mut joined) = (u8::from(spacing > 0), u8::from(spacing > 0));
        if let (Some(last), true) = (last, joins) {
            if self.stamp[last].saturating_sub(self.start[last]) == spacing {
                same = self.same[last].saturating_add(1);
            }
            joined = self.joined[last].saturating_add(1);
        }
        self.stamp.push(stamp);
        self.start.push(start);
        self.x.push(value[0]);
        self.y.push(value[1]);
        self.z.push(value[2]);
        self.same.push(same);
        self.joined.push(joined);
        self.bridged.push(bridged);
    }

    /// Elements dropped from the front so far, were these all that is left of a longer run.
    pub(crate) fn count_from(&mut self, base: usize) {
        self.base = base;
    }

    /// Forgets the first `count` elements.
    pub(crate) fn drop_front(&mut self, count: usize) {
        let count = count.min(self.len());
        self.base += count;
        self.stamp.drain(..count);
        self.start.drain(..count);
        self.x.drain(..count);
        self.y.drain(..count);
        self.z.drain(..count);
        self.same.drain(..count);
        self.joined.drain(..count);
        self.bridged.drain(..count);
    }

    /// First element a window may hold.
    pub(crate) fn first(&self) -> usize {
        let useless = self.increments
            && self.base == 0
            && self
                .stamp
                .first()
                .is_some_and(|s| Some(s) == self.start.first());
        usize::from(useless)
    }

    pub(crate) fn value(&self, k: usize) -> Triple<1> {
        Triple::new(self.x[k], self.y[k], self.z[k])
    }

    /// Values of element k of the first of N windows, each of which begins STEP behind the one before.
    #[inline(always)]
    pub(crate) fn values<const N: usize, const STEP: usize>(&self, k: usize) -> Triple<N> {
        let at = |v: &[f64]| {
            let v = &v[k..=k + STEP * (N - 1)];
            Lanes(std::array::from_fn(|i| v[STEP * i]))
        };
        Triple {
            x: at(&self.x),
            y: at(&self.y),
            z: at(&self.z),
        }
    }

    /// Mean rate at element k, rad/s: the sample, or the increment over its interval.
    pub(crate) fn rate(&self, k: usize) -> Triple<1> {
        if !self.increments {
            return self.value(k);
        }
        let h = secs(self.stamp[k].saturating_sub(self.start[k]));
        if h > 0.0 {
            self.value(k) * (1.0 / h)
        } else {
            Triple::ZERO
        }
    }

    /// Length of interval k in nanoseconds, any hole included.
    pub(crate) fn spacing(&self, k: usize) -> i64 {
        self.stamp[k].saturating_sub(self.stamp[k - 1])
    }

    /// Length of interval k in seconds.
    pub(crate) fn step(&self, k: usize) -> f64 {
        secs(self.spacing(k))
    }

    /// Whether the `window` elements from `first` on are equally spaced, without holes.
    pub(crate) fn is_uniform(&self, first: usize, window: usize) -> bool {
        let spacings = if self.increments { window } else { window - 1 };
        usize::from(self.same[first + window - 1]) >= spacings
    }

    /// Whether the increments of a window join without holes. Rates always do.
    pub(crate) fn is_joined(&self, first: usize, window: usize) -> bool {
        let last = first + window - 1;
        !self.increments || usize::from(self.joined[last]) >= window
    }

    /// Whether there is a hole before increment k.
    pub(crate) fn has_hole(&self, k: usize) -> bool {
        self.start[k] > self.stamp[k - 1]
    }

    /// An instant in the coordinate of interval `a..b`, where it runs from -1 to 1.
    #[inline(always)]
    pub(crate) fn coordinate(t: i64, a: i64, b: i64) -> f64 {
        // Whole nanoseconds, exact in f64 up to 104 days, subtracted before anything is rounded.
        let twice = t.saturating_sub(a) as f64 + t.saturating_sub(b) as f64;
        twice / b.saturating_sub(a) as f64
    }
}

/// Nanoseconds to seconds, correctly rounded.
#[inline(always)]
pub(crate) fn secs(nanos: i64) -> f64 {
    nanos as f64 / 1e9
}
