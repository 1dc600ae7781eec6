//! Stamps of an even clock, one by one -> its phase and step. Pure.
//!
//! A stage of its own because both halves need it: live it is the answer, offline it tells at which
//! multiple of the step a stamp belongs.

use super::nanos;

/// Steady gains. While a segment is young its gains are larger: those of the least-squares line
/// through everything so far.
///
/// 0.01 remembers some 400 samples: stamp noise comes out at a fifteenth, and a crystal that wanders by
/// 1 ppm a minute is followed to a thousandth of a step at any rate above 10 Hz.
const ALPHA: f64 = 0.01;
/// 6 / k^2 where 4 / k is [`ALPHA`]: the line through the last k samples.
const BETA: f64 = 6.0 * (ALPHA / 4.0) * (ALPHA / 4.0);

/// An alpha-beta tracker of phase and step.
///
/// # Source
/// `docs/theory/attitude.md` 6.4: gains max(alpha, 2(2k-1)/(k(k+1))) and max(beta, 6/(k(k+1))), those of an
/// expanding-memory line fit (Morrison, Introduction to Sequential Smoothing and Prediction, 1969)
/// until the steady ones are larger.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tracker {
    /// Whole nanoseconds that `phase` is counted from, so that it never loses its fraction.
    origin: i64,
    phase: f64,
    step: f64,
    seen: u32,
}

impl Tracker {
    /// Begins at the first stamp of a segment; the step is learnt from the second.
    pub(super) fn at(stamp: i64) -> Tracker {
        Tracker {
            origin: stamp,
            phase: 0.0,
            step: 0.0,
            seen: 1,
        }
    }

    /// Begins on a line known from `seen` samples, at an instant `phase` after `origin`.
    pub(super) fn on_line(origin: i64, phase: f64, step: f64, seen: u32) -> Tracker {
        Tracker {
            origin,
            phase,
            step,
            seen,
        }
    }

    /// Nanoseconds per step; 0 until two samples were seen.
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// Samples seen.
    pub(super) fn seen(&self) -> u32 {
        self.seen
    }

    /// The filtered instant of the newest sample.
    pub(super) fn instant(&self) -> i64 {
        self.origin.saturating_add(nanos(self.phase))
    }

    /// Number of steps from the newest sample to a stamp.
    pub(super) fn steps_to(&self, stamp: i64) -> f64 {
        (self.since_origin(stamp) - self.phase) / self.step
    }

    /// Deviation of a stamp from the instant `ahead` steps on, nanoseconds.
    pub(super) fn off(&self, stamp: i64, ahead: i64) -> f64 {
        self.since_origin(stamp) - self.phase - ahead as f64 * self.step
    }

    /// A sample `ahead` steps on was stamped `off` nanoseconds after its instant.
    pub(super) fn advance(&mut self, off: f64, ahead: i64) {
        self.seen = self.seen.saturating_add(1);
        let k = f64::from(self.seen);
        let alpha = ALPHA.max(2.0 * (2.0 * k - 1.0) / (k * (k + 1.0)));
        let beta = BETA.max(6.0 / (k * (k + 1.0)));
        self.phase += ahead as f64 * self.step + alpha * off;
        self.step += beta * off / ahead.max(1) as f64;
        // Beyond it a fraction of a nanosecond would be lost: 2^49 ns are six days.
        if self.phase.abs() > (1_u64 << 49) as f64 {
            let whole = self.phase.trunc();
            self.origin = self.origin.saturating_add(nanos(whole));
            self.phase -= whole;
        }
    }

    /// A sample `ahead` steps on whose stamp tells nothing.
    pub(super) fn coast(&mut self, ahead: i64) {
        self.phase += ahead as f64 * self.step;
    }

    fn since_origin(&self, stamp: i64) -> f64 {
        stamp.saturating_sub(self.origin) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_young_tracker_is_the_least_squares_line() {
        let stamps = [0, 1_030, 1_960, 3_100, 3_900, 5_020, 6_070];
        let mut tracker = Tracker::at(stamps[0]);
        for (k, stamp) in stamps.iter().enumerate().skip(1) {
            let off = tracker.off(*stamp, 1);
            tracker.advance(off, 1);
            let n = (k + 1) as f64;
            let mean_i = (n - 1.0) / 2.0;
            let mean_t = stamps[..=k].iter().sum::<i64>() as f64 / n;
            let (mut it, mut ii) = (0.0, 0.0);
            for (i, t) in stamps[..=k].iter().enumerate() {
                it += (i as f64 - mean_i) * (*t as f64 - mean_t);
                ii += (i as f64 - mean_i).powi(2);
            }
            let slope = it / ii;
            let end = mean_t + slope * (k as f64 - mean_i);
            assert!((tracker.step - slope).abs() < 1e-9 * slope, "{k}");
            assert!((tracker.phase - end).abs() < 1e-9 * end, "{k}");
        }
    }
}
