//! Durations -> percentiles in bounded memory. Pure.
//!
//! A stage of its own because percentiles of a recording of any length must cost the same memory
//! and come out the same, however the recording was cut.

/// Sub-bins per octave.
const PER_OCTAVE_BITS: u32 = 5;
const PER_OCTAVE: usize = 1 << PER_OCTAVE_BITS;
/// Octaves of a non-negative `i64`.
const BINS: usize = 64 * PER_OCTAVE;

/// Counts of non-negative nanoseconds in bins of a 32nd of an octave. Each bin keeps its sum, so
/// that values which agree within 3 % come back as their mean, not as the bin's edge.
///
/// # Accuracy
/// Percentiles are off by at most 3.2 % of their value; exact where a bin holds one value.
#[derive(Clone, Debug)]
pub struct Histogram {
    bins: Vec<(u64, f64)>,
    count: u64,
    max: i64,
}

impl Default for Histogram {
    fn default() -> Histogram {
        Histogram::new()
    }
}

impl Histogram {
    /// Makes an empty one.
    #[must_use]
    pub fn new() -> Self {
        Histogram {
            bins: vec![(0, 0.0); BINS],
            count: 0,
            max: 0,
        }
    }

    /// Makes one that counts how many came and the largest, and no percentiles: of many streams at once.
    pub(super) fn without_bins() -> Self {
        Histogram {
            bins: Vec::new(),
            count: 0,
            max: 0,
        }
    }

    /// Counts one value; a negative one as 0.
    pub fn add(&mut self, nanos: i64) {
        let nanos = nanos.max(0);
        if let Some((count, sum)) = self.bins.get_mut(bin(nanos)) {
            *count += 1;
            *sum += nanos as f64;
        }
        self.count += 1;
        self.max = self.max.max(nanos);
    }

    pub(super) fn max(&self) -> i64 {
        self.max
    }

    /// Counts of values in `from..to` nanoseconds, octave by octave, from the first that holds one
    /// to the last. The first octave is 0 alone, the second 1 alone.
    pub(super) fn octaves(&self) -> Vec<(f64, f64, u64)> {
        let mut counts = [0_u64; 70];
        for (index, (count, _)) in self.bins.iter().enumerate() {
            counts[octave(index)] += count;
        }
        let first = counts.iter().position(|n| *n > 0).unwrap_or(0);
        let last = counts.iter().rposition(|n| *n > 0).map_or(0, |k| k + 1);
        (first..last)
            .map(|k| match k {
                0 => (0.0, 1.0, counts[0]),
                _ => (2_f64.powi(k as i32 - 1), 2_f64.powi(k as i32), counts[k]),
            })
            .collect()
    }

    /// The value below or at which the share `q` of all values lies, nanoseconds; 0 of nothing.
    #[must_use]
    pub fn quantile(&self, q: f64) -> f64 {
        let rank = (q * self.count as f64).ceil().max(1.0);
        let mut seen = 0;
        for (count, sum) in &self.bins {
            seen += count;
            if *count > 0 && seen as f64 >= rank {
                return sum / *count as f64;
            }
        }
        0.0
    }
}

/// Exact below 64 ns, then 32 bins to the octave.
fn bin(nanos: i64) -> usize {
    let n = nanos.unsigned_abs();
    let octave = 63 - (n | 1).leading_zeros();
    if octave <= PER_OCTAVE_BITS {
        return n as usize;
    }
    let within = (n >> (octave - PER_OCTAVE_BITS)) as usize & (PER_OCTAVE - 1);
    (octave - PER_OCTAVE_BITS + 1) as usize * PER_OCTAVE + within
}

/// Octave that a bin belongs to: 0 = the value 0, k = `2^(k-1)..2^k`.
fn octave(bin: usize) -> usize {
    if bin < 2 * PER_OCTAVE {
        return (usize::BITS - bin.leading_zeros()) as usize;
    }
    bin / PER_OCTAVE + PER_OCTAVE_BITS as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_ascend_without_a_hole_or_an_overlap() {
        let mut last = bin(0);
        for n in 1..200_000 {
            let this = bin(n);
            assert!(this == last || this == last + 1, "{n}: {last} -> {this}");
            last = this;
        }
        assert!(bin(i64::MAX) < BINS);
    }

    #[test]
    fn percentiles_are_within_three_and_a_half_percent_of_the_sorted_ones() {
        // A lattice that fills two decades evenly, as a sequence that needs no random numbers.
        let values: Vec<i64> = (0..10_000_i64)
            .map(|i| 1000 + (i * 7919 % 10_000) * 11)
            .collect();
        let mut histogram = Histogram::new();
        values.iter().for_each(|v| histogram.add(*v));
        let mut sorted = values;
        sorted.sort_unstable();
        for q in [0.01, 0.25, 0.5, 0.9, 0.99] {
            let exact = sorted[(q * 10_000.0) as usize - 1] as f64;
            let got = histogram.quantile(q);
            // Half a bin either way and the mean within it: 1/32.
            assert!((got / exact - 1.0).abs() < 1.0 / 32.0, "{q}: {got} {exact}");
        }
    }

    #[test]
    fn octaves_hold_every_value_once() {
        let mut histogram = Histogram::new();
        let values = [0, 0, 1, 2, 3, 31, 32, 63, 64, 65, 1000, 1 << 40, i64::MAX];
        values.iter().for_each(|v| histogram.add(*v));
        let octaves = histogram.octaves();
        for (from, to, count) in octaves {
            let inside =
                |v: &&i64| (from..to).contains(&(**v as f64)) || (**v == i64::MAX && from > 4e18);
            assert_eq!(
                count,
                values.iter().filter(inside).count() as u64,
                "{from}..{to}"
            );
        }
    }
}
