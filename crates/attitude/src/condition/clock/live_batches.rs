//! Stamps and rates of a live stream -> the rate of its batches, once it is certain that there are any. Pure.
//!
//! Apart from the verdict over a recording because a stream has no end to wait for: a stream of steps that are not short
//! costs a few operations a sample and no memory, and only one that has some is looked at.

use super::batches::{BatchRate, Batches, SHORT, batches};

/// Samples over which the mean step and the share of short steps are taken.
const OVER: f64 = 64.0;
/// Share of short steps from which on samples are kept.
const SHARE: f64 = 0.25;
/// Most samples that are kept.
const MOST: usize = 2048;
/// Beginnings of batches at which they are judged first: the one under way, four whole ones, and the next.
const FIRST: usize = 6;
/// A step of so many mean ones begins a batch.
const BEGINS: f64 = 1.5;
/// Longest step within a stream, ns.
const LONGEST: i64 = 1_000_000_000;

/// Looks for batches in a live stream.
#[derive(Clone, Debug, Default)]
pub(crate) struct BatchLearner {
    before: Option<i64>,
    count: f64,
    mean: f64,
    short: f64,
    stamps: Vec<i64>,
    rates: Vec<[f64; 3]>,
    begun: usize,
    /// Beginnings at which they are judged next.
    next: usize,
}

impl BatchLearner {
    /// Takes the next sample in the order in which it came; returns the rate when its batches are certain, of which this
    /// sample begins one.
    #[inline]
    pub(crate) fn push(&mut self, stamp: i64, rate: [f64; 3]) -> Option<BatchRate> {
        let step = stamp.saturating_sub(self.before.replace(stamp)?);
        if !(0..=LONGEST).contains(&step) {
            self.forget();
            return None;
        }
        let step = step as f64;
        self.count = (self.count + 1.0).min(OVER);
        self.mean += (step - self.mean) / self.count;
        let is_short = if step < SHORT * self.mean { 1.0 } else { 0.0 };
        self.short += (is_short - self.short) / self.count;
        if self.count < OVER / 4.0 || self.short < SHARE {
            if !self.stamps.is_empty() {
                self.forget();
            }
            return None;
        }
        self.keep(stamp, rate, step)
    }

    #[cold]
    fn keep(&mut self, stamp: i64, rate: [f64; 3], step: f64) -> Option<BatchRate> {
        if self.stamps.len() >= MOST {
            self.forget();
        }
        self.stamps.push(stamp);
        self.rates.push(rate);
        let first = self.stamps.first().copied().unwrap_or(stamp);
        let mean = stamp.saturating_sub(first) as f64 / self.stamps.len() as f64;
        if step <= BEGINS * mean {
            return None;
        }
        self.begun += 1;
        if self.begun < FIRST.max(self.next) {
            return None;
        }
        self.next = self.begun + self.begun / 2;
        match batches(&self.stamps, &self.rates) {
            Batches::Even(rate) => Some(rate),
            Batches::None | Batches::Unsure(_) | Batches::Gaps => None,
        }
    }

    fn forget(&mut self) {
        (self.stamps, self.rates) = (Vec::new(), Vec::new());
        (self.begun, self.next) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::batches::tests::{H, batched, even, gyro};
    use super::*;

    /// Rate that is found, and after how many samples.
    fn found(stamps: &[i64], rates: &[[f64; 3]]) -> Option<(BatchRate, usize)> {
        let mut learner = BatchLearner::default();
        let mut all = stamps.iter().zip(rates).enumerate();
        all.find_map(|(n, (stamp, rate))| Some((learner.push(*stamp, *rate)?, n)))
    }

    #[test]
    fn batches_of_a_stream_are_known_after_a_few_and_missing_samples_are_none() {
        for (size, inner, late, samples) in [
            (7, 300_000, 2_000_000, 128),
            (10, 20_000, 0, 128),
            (32, 100_000, 200_000, 300),
        ] {
            let stamps = even(1400, H);
            let came = batched(&stamps, size, inner, late);
            let (rate, n) = found(&came, &gyro(&stamps)).unwrap_or_default();
            assert_eq!(
                (rate.size, n <= samples),
                (size, true),
                "{rate:?} after {n}"
            );
            assert!((rate.step / H as f64 - 1.0).abs() < 0.03, "{rate:?}");
        }
        let stamps = even(2500, H);
        assert_eq!(found(&stamps, &gyro(&stamps)), None);
        let kept: Vec<i64> = stamps
            .chunks(25)
            .flat_map(|all| all[..5].to_vec())
            .collect();
        assert_eq!(found(&kept, &gyro(&kept)), None);
    }
}
