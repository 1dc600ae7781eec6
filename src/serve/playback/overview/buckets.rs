//! Attitudes of a recording of any length -> stretches of time with the least and the greatest of each value. Pure.
//!
//! Every sample has a stretch of its own until there are too many; then stretches double, so that memory does not
//! grow with the recording and no peak is lost.

use std::ops::Range;

/// Series with a least and a greatest value: rates about x, y, z (deg/s), roll, pitch, yaw without jumps (deg), error
/// (deg), acceleration without gravity along x, y, z of the world (m/s^2).
pub(super) const SERIES: usize = 10;

/// Number of the error among them.
pub(super) const ERROR: usize = 6;

/// One stretch of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bucket {
    index: i64,
    /// Time of its first sample, ns from the first of the stream.
    pub at: i64,
    /// Number of its first sample.
    pub seq: u64,
    /// Number of samples.
    pub count: u64,
    /// Whether no line leads here from the stretch before.
    pub is_cut: bool,
    /// Attitude of the first sample, `[w, x, y, z]`.
    pub q: [f64; 4],
    /// Values of the first sample; NaN = not known.
    pub first: [f32; SERIES],
    /// Least of each series.
    pub low: [f32; SERIES],
    /// Greatest of each series.
    pub high: [f32; SERIES],
}

impl Bucket {
    fn add(&mut self, later: &Bucket) {
        self.count += later.count;
        for n in 0..SERIES {
            if let (Some(mine), Some(theirs)) = (self.low.get_mut(n), later.low.get(n)) {
                *mine = mine.min(*theirs);
            }
            if let (Some(mine), Some(theirs)) = (self.high.get_mut(n), later.high.get(n)) {
                *mine = mine.max(*theirs);
            }
        }
    }

    fn put_error(&mut self, at: i64, degrees: f32) {
        if let Some(low) = self.low.get_mut(ERROR) {
            *low = low.min(degrees);
        }
        if let Some(high) = self.high.get_mut(ERROR) {
            *high = high.max(degrees);
        }
        if let Some(first) = self.first.get_mut(ERROR).filter(|_| at == self.at) {
            *first = degrees;
        }
    }
}

/// Stretches of one stream, in order of time.
#[derive(Debug)]
pub(super) struct Buckets {
    all: Vec<Bucket>,
    most: usize,
    /// Length of a stretch, ns.
    width: i64,
    /// Samples taken.
    pub samples: u64,
}

impl Buckets {
    /// Makes them for at most `most` stretches, at least 2.
    pub(super) fn new(most: usize) -> Buckets {
        Buckets {
            all: Vec::new(),
            most: most.max(2),
            width: 1,
            samples: 0,
        }
    }

    /// Takes a sample at `at`, not before the last, with its attitude and values; its error comes later.
    pub(super) fn push(&mut self, at: i64, q: [f64; 4], values: [f32; SERIES], is_cut: bool) {
        let next = Bucket {
            index: at.div_euclid(self.width),
            at,
            seq: self.samples,
            count: 1,
            is_cut,
            q,
            first: values,
            low: values,
            high: values,
        };
        self.samples += 1;
        match self.all.last_mut() {
            Some(last) if last.index >= next.index => last.add(&next),
            _ => self.all.push(next),
        }
        while self.all.len() > self.most {
            self.double();
        }
    }

    /// Adds the error of the sample at `at`.
    pub(super) fn put_error(&mut self, at: i64, degrees: f64) {
        let index = at.div_euclid(self.width);
        let after = self.all.partition_point(|bucket| bucket.index <= index);
        if let Some(bucket) = after.checked_sub(1).and_then(|n| self.all.get_mut(n)) {
            bucket.put_error(at, degrees as f32);
        }
    }

    fn double(&mut self) {
        self.width = self.width.saturating_mul(2);
        for bucket in &mut self.all {
            bucket.index = bucket.index.div_euclid(2);
        }
        self.all.dedup_by(|later, kept| {
            let is_same = later.index == kept.index;
            if is_same {
                kept.add(later);
            }
            is_same
        });
    }

    /// Time of the last stretch's first sample.
    pub(super) fn end(&self) -> Option<i64> {
        self.all.last().map(|bucket| bucket.at)
    }

    /// Stretches between two times and one beyond on both sides, no more than about `most` of equal length.
    pub(super) fn between(&self, times: Range<i64>, most: usize) -> Vec<Bucket> {
        let from = self.all.partition_point(|b| b.at < times.start);
        let to = self.all.partition_point(|b| b.at <= times.end);
        let from = from.saturating_sub(1);
        let part = self.all.get(from..(to + 1).min(self.all.len()));
        let part = part.unwrap_or_default();
        let (Some(first), Some(last)) = (part.first(), part.last()) else {
            return Vec::new();
        };
        if part.len() <= most {
            return part.to_vec();
        }
        let width = last.at.saturating_sub(first.at) / most.max(1) as i64 + 1;
        let place = |bucket: &Bucket| bucket.at.saturating_sub(first.at) / width;
        let mut fewer: Vec<Bucket> = Vec::with_capacity(most);
        for bucket in part {
            match fewer.last_mut() {
                Some(kept) if place(kept) == place(bucket) => kept.add(bucket),
                _ => fewer.push(*bucket),
            }
        }
        fewer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const Q: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

    fn values(first: f32) -> [f32; SERIES] {
        let mut values = [0.0; SERIES];
        values[0] = first;
        values[ERROR] = f32::NAN;
        values
    }

    #[test]
    fn a_peak_of_one_sample_in_millions_is_kept_and_memory_does_not_grow() {
        let mut buckets = Buckets::new(1000);
        for k in 0..3_000_000_i64 {
            let peak = if k == 1_234_567 { 500.0 } else { 1.0 };
            buckets.push(k * 1_000_000, Q, values(peak), false);
            buckets.put_error(k * 1_000_000, if k == 2_000_001 { 9.0 } else { 0.5 });
        }
        assert!(buckets.all.len() <= 1000);
        let whole = buckets.between(0..i64::MAX, 200);
        assert!(whole.len() <= 201 && whole.len() > 50, "{}", whole.len());
        assert_eq!(whole.iter().map(|b| b.count).sum::<u64>(), 3_000_000);
        assert!(whole.iter().any(|b| b.high[0] == 500.0 && b.low[0] == 1.0));
        let worst = whole.iter().map(|b| b.high[ERROR]).fold(0.0, f32::max);
        assert_eq!(worst, 9.0);
    }

    #[test]
    fn as_long_as_there_is_room_every_sample_is_there() {
        let mut buckets = Buckets::new(1000);
        // In bursts, as a bus delivers them.
        for k in 0..1000_i64 {
            let at = (k / 8) * 80_000_000 + (k % 8) * 1000;
            buckets.push(at, Q, values(k as f32), k == 500);
        }
        let all = buckets.between(0..i64::MAX, 4000);
        assert_eq!(all.len(), 1000);
        assert!(
            all.iter()
                .all(|b| b.count == 1 && b.is_cut == (b.seq == 500))
        );
        // A part has a neighbour on each side.
        let part = buckets.between(80_000_000..80_003_000, 100);
        assert_eq!(
            part.iter().map(|b| b.seq).collect::<Vec<_>>(),
            (7..=12).collect::<Vec<_>>()
        );
    }

    #[test]
    fn none_one_and_equal_times_are_no_trouble() {
        let mut buckets = Buckets::new(2);
        assert!(buckets.between(0..1, 10).is_empty() && buckets.end().is_none());
        for _ in 0..10 {
            buckets.push(0, Q, values(1.0), false);
        }
        assert_eq!(buckets.between(0..0, 10).len(), 1);
        buckets.push(i64::MAX, Q, values(2.0), false);
        buckets.push(i64::MAX, Q, values(3.0), false);
        assert_eq!(buckets.between(i64::MIN..i64::MAX, 10).len(), 2);
    }
}
