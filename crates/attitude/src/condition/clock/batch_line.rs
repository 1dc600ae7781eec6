//! Stamps of batches, made when they came -> even stamps. Pure.
//!
//! Apart from the verdict because it goes along with the samples: the i-th lies on the line through the arrivals of the
//! batches before, at the rate that was found, and that line follows a clock that drifts (`docs/theory/clocks.md`).

use super::batches::{BatchRate, SHORT, usual_size};

/// A batch that comes later than expected by this part of its time is one behind a batch that was lost.
const LOST: f64 = 0.75;
/// An arrival earlier than the line by this part of a batch proves the line wrong: nothing comes before it was taken.
const EARLY: f64 = 0.5;
/// Mean distances of an arrival from the line within which it proves nothing, and the share of a new one in the mean.
const SLACK: f64 = 8.0;
const OFF_GAIN: f64 = 1.0 / 64.0;
/// Least gains of place and of step.
const PLACE_GAIN: f64 = 0.02;
const STEP_GAIN: f64 = 2e-4;
/// Batches already seen where the rate is known from a pass over the recording.
const KNOWN: f64 = 40.0;
/// Batches whose size is remembered.
const SIZES: usize = 8;

/// The line on which the samples of batches lie.
#[derive(Clone, Debug)]
pub(crate) struct BatchLine {
    /// Stamp of the first sample: f64 holds only what is after it.
    base: Option<i64>,
    /// Instant of the sample number `last`, and the step, nanoseconds.
    at: f64,
    last: i64,
    step: f64,
    /// Number of the newest sample.
    number: i64,
    /// First stamp of the current batch, and the newest stamp.
    start: f64,
    before: f64,
    sizes: Vec<i64>,
    closed: f64,
    out: Option<i64>,
    /// Mean distance of the arrivals from the line, where they are no stamps of a log: so much later than it none proves
    /// that a batch was lost.
    off: Option<f64>,
    /// Batches in a row that moved the line.
    astray: u32,
}

impl BatchLine {
    /// Makes one for batches of this rate.
    pub(crate) fn new(rate: &BatchRate) -> BatchLine {
        let size = i64::try_from(rate.size).unwrap_or(i64::MAX / 4).max(1);
        BatchLine {
            base: None,
            at: 0.0,
            last: size - 1,
            step: rate.step,
            number: -1,
            start: 0.0,
            before: 0.0,
            sizes: vec![size],
            closed: 0.0,
            out: None,
            off: None,
            astray: 0,
        }
    }

    /// Gives no stamp before this one, or at it.
    pub(crate) fn begin_after(&mut self, stamp: i64) {
        self.out = Some(stamp);
    }

    /// Makes one that goes on from a line with this step through arrivals, `offset` after the first of them at its sample
    /// number 0, from which they are `off` in the mean. `beginnings` are the samples that begin a batch.
    pub(crate) fn on(
        step: f64,
        offset: f64,
        off: f64,
        (beginnings, arrivals): (&[usize], &[i64]),
    ) -> BatchLine {
        let base = arrivals.first().copied();
        let index = |at: usize| i64::try_from(at).unwrap_or(i64::MAX);
        let after = |at: usize| {
            let arrival = arrivals.get(at).copied().or(base).unwrap_or_default();
            arrival.saturating_sub(base.unwrap_or_default()) as f64
        };
        let begun = beginnings.last().copied().unwrap_or_default();
        let newest = arrivals.len().saturating_sub(1);
        let sizes = beginnings.windows(2).map(|pair| match pair {
            [from, to] => index(to - from),
            _ => 1,
        });
        let sizes: Vec<i64> = sizes.collect();
        let forgotten = sizes.len().saturating_sub(SIZES);
        let last = index(begun) - 1;
        let on_line = offset + step * newest as f64;
        BatchLine {
            base,
            at: offset + step * last as f64,
            last,
            step,
            number: index(newest),
            start: after(begun),
            before: after(newest),
            sizes: sizes.get(forgotten..).unwrap_or_default().to_vec(),
            closed: beginnings.len().saturating_sub(1).max(1) as f64,
            out: base.map(|base| base.saturating_add(on_line.round() as i64)),
            off: Some(off),
            astray: 0,
        }
    }

    /// Ordinary number of samples in a batch.
    pub(crate) fn usual_size(&self) -> f64 {
        usual_size(&self.sizes)
    }

    /// Number of batches in a row that moved the line: of many the rate is another one.
    pub(crate) fn astray(&self) -> u32 {
        self.astray
    }

    /// The step, nanoseconds.
    pub(crate) fn step(&self) -> f64 {
        self.step
    }

    /// Takes the stamp of the next sample and returns that of the line; always later than the one before.
    pub(crate) fn push(&mut self, stamp: i64) -> i64 {
        self.push_together(stamp, 1)
    }

    /// The same of a sample with which, itself among them, so many are known to have come.
    pub(crate) fn push_together(&mut self, stamp: i64, together: usize) -> i64 {
        let base = *self.base.get_or_insert(stamp);
        let s = stamp.saturating_sub(base) as f64;
        self.number += 1;
        if self.number > 0 && s - self.before >= SHORT * self.step {
            self.close(self.number - 1);
            self.start = s;
            let together = i64::try_from(together).unwrap_or(i64::MAX);
            let most = self.sizes.iter().copied().max().unwrap_or(1);
            let most = most.max(together) as f64;
            // Later than with as many as were ever in one of late.
            let late = s - (self.at + self.step * most);
            if late > LOST * self.step * most.max(2.0) + SLACK * self.off.unwrap_or(0.0) {
                self.at += late;
                self.astray += 1;
            }
        }
        self.before = s;
        let mut on_line = self.at + self.step * (self.number - self.last) as f64;
        if let Some(off) = self.off {
            let usual = self.usual_size().max(2.0);
            // Nothing is sampled so long after it came: the rate is higher, or what was lost had only stalled.
            if on_line - s > EARLY * self.step * usual + SLACK * off {
                (self.at, self.last, self.start) = (s, self.number, s);
                self.astray += 1;
                on_line = s;
            }
        }
        let stamp = base.saturating_add(on_line.round() as i64);
        let stamp = self
            .out
            .map_or(stamp, |out| stamp.max(out.saturating_add(1)));
        self.out = Some(stamp);
        stamp
    }

    /// The sample number `k` was the last of its batch.
    fn close(&mut self, k: i64) {
        if self.closed == 0.0 {
            // The first one began anywhere; that it is whole by now is all that is known.
            (self.last, self.at, self.closed) = (k, self.start, KNOWN);
            return;
        }
        let n = k - self.last;
        let count = n as f64;
        let expected = self.at + self.step * count;
        let off = self.start - expected;
        self.closed += 1.0;
        if self.sizes.len() >= SIZES {
            self.sizes.remove(0);
        }
        self.sizes.push(n);
        let slack = SLACK * self.off.unwrap_or(0.0);
        let is_behind_lost = off > LOST * self.step * usual_size(&self.sizes).max(2.0) + slack;
        self.last = k;
        if is_behind_lost || off < -EARLY * self.step * count.max(2.0) {
            self.at = self.start;
            self.astray += 1;
            return;
        }
        self.astray = 0;
        if let Some(mean) = &mut self.off {
            *mean += OFF_GAIN * (off.abs() - *mean);
        }
        // How late it came is no measure of when it was taken.
        let off = off.min(EARLY * self.step * count);
        let m = self.closed;
        let place = (2.0 * (2.0 * m - 1.0) / (m * (m + 1.0))).max(PLACE_GAIN);
        let step = (6.0 / (m * (m + 1.0))).max(STEP_GAIN);
        self.at = expected + place * off;
        self.step += step * off / count.max(1.0);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::batches::tests::{H, batched, even, gyro};
    use super::super::batches::{Batches, batches};
    use super::*;

    fn restamped(stamps: &[i64], rates: &[[f64; 3]]) -> Vec<i64> {
        let Batches::Even(rate) = batches(stamps, rates) else {
            panic!("no batches");
        };
        let mut line = BatchLine::new(&rate);
        stamps.iter().map(|s| line.push(*s)).collect()
    }

    fn rms(values: impl ExactSizeIterator<Item = i64>) -> f64 {
        let n = values.len() as f64;
        (values.map(|v| (v as f64).powi(2)).sum::<f64>() / n).sqrt()
    }

    #[test]
    fn samples_of_batches_lie_where_they_were_taken() {
        // Size, step inside, delay; what of the delay, which is a constant, may be left, and how much may vary, ns.
        let cases = [
            (7, 300_000, 2_000_000, 400_000.0),
            (10, 20_000, 0, 1.0),
            (32, 0, 0, 1.0),
            (2, 300_000, 500_000, 100_000.0),
        ];
        for (size, inner, late, varies) in cases {
            let stamps = even(size as i64 * 140, H);
            let out = restamped(&batched(&stamps, size, inner, late), &gyro(&stamps));
            let off: Vec<i64> = out.iter().zip(&stamps).map(|(out, s)| out - s).collect();
            let mean = off.iter().sum::<i64>() / off.len() as i64;
            assert!((0..=late.max(1)).contains(&mean), "{size}: {mean}");
            let spread = rms(off.iter().map(|v| v - mean));
            assert!(spread <= varies, "{size}: {spread}");
        }
    }

    #[test]
    fn time_goes_on_where_a_batch_was_lost() {
        let stamps = even(1400, H);
        let mut came = batched(&stamps, 10, 20_000, 0);
        let mut rates = gyro(&stamps);
        came.drain(700..710);
        rates.drain(700..710);
        let out = restamped(&came, &rates);
        let steps: Vec<i64> = out.windows(2).map(|w| w[1] - w[0]).collect();
        assert!((steps[699] - 11 * H).abs() < 10, "{}", steps[699]);
        let other = steps
            .iter()
            .enumerate()
            .filter(|(i, d)| *i != 699 && (**d - H).abs() > 10);
        assert_eq!(other.count(), 0);
    }
}
