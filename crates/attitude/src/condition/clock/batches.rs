//! Stamps and rates -> whether samples were stamped in batches, when they came. Pure.
//!
//! A stage of its own because short steps and then a long one are two things: samples read several at once, which were
//! taken evenly, or samples that are missing. The rates tell: taken evenly, they change across the end of a batch as much
//! as inside it (`docs/theory/clocks.md`).

use super::line::{median_of, spread};
use crate::median::median;

/// A step below this share of the mean one lies inside a batch.
pub(super) const SHORT: f64 = 0.3;
/// Share of short steps from which there are batches.
pub(super) const SHORT_SHARE: f64 = 0.4;
/// Largest spread of the time of a batch for its number of samples, of the time of a batch.
const EVEN: f64 = 0.25;
/// Change of the rate across the beginning of a batch over that inside: up to this samples are joined, from this cut.
const JOINED: f64 = 1.3;
const CUT: f64 = 3.0;
/// Change of the rate over its noise from which a cut shows, and from which being joined is proved.
const MOVING: f64 = 4.0;
const SURELY: f64 = 10.0;
/// Reading one more sample takes less, nanoseconds.
const READING: f64 = 1e6;
/// Steps of gyros, nanoseconds: the shortest and the longest.
pub(super) const STEPS: (f64, f64) = (20e3, 2e9);
/// Fewest samples and batches that tell.
const LEAST: usize = 24;
const LEAST_BATCHES: usize = 5;
/// Largest batch that is believed.
const MOST_SIZE: usize = 100_000;
/// Longest step that is surely no gap, nanoseconds, and in median steps.
const GAP: f64 = 1e9;
const GAP_STEPS: f64 = 20.0;

/// Verdict about stamps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Batches {
    /// Samples that were stamped one by one.
    None,
    /// Samples that were stamped when their batch came, and taken evenly.
    Even(BatchRate),
    /// Samples that came in batches or are missing between them: nothing tells.
    Unsure(BatchRate),
    /// Batches between which samples are missing.
    Gaps,
}

/// Rate at which the samples of batches were taken.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct BatchRate {
    /// Step of the sensor, nanoseconds.
    pub step: f64,
    /// Median number of samples in a batch.
    pub size: usize,
    /// Median step inside a batch, nanoseconds.
    pub inside: f64,
}

impl BatchRate {
    /// Whether a sensor can have it: of what was read from outside.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        (STEPS.0..=STEPS.1).contains(&self.step)
            && (1..=MOST_SIZE).contains(&self.size)
            && (0.0..self.step).contains(&self.inside)
    }
}

/// Judges stamps, nanoseconds in the order in which they came, by the rates, where there are any.
#[must_use]
pub fn batches(stamps: &[i64], rates: &[[f64; 3]]) -> Batches {
    let steps: Vec<f64> = stamps.windows(2).map(|w| step_of(w) as f64).collect();
    if stamps.len() < LEAST || steps.iter().any(|d| *d < 0.0) {
        return Batches::None;
    }
    let longest = GAP.max(GAP_STEPS * median(&mut steps.clone()));
    let believed: Vec<f64> = steps.iter().copied().filter(|d| *d <= longest).collect();
    let mut h = believed.iter().sum::<f64>() / believed.len().max(1) as f64;
    let short = steps.iter().filter(|d| **d < SHORT * h).count();
    if h <= 0.0 || (short as f64) < SHORT_SHARE * steps.len() as f64 {
        return Batches::None;
    }
    let (mut cuts, mut took, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..3 {
        cuts = beginnings(stamps, h);
        if cuts.len() < LEAST_BATCHES {
            return Batches::None;
        }
        took = pairs(&cuts, |a, b| at(stamps, b) - at(stamps, a));
        sizes = pairs(&cuts, |a, b| (b - a) as f64);
        let last = cuts.last().map_or(0, |last| stamps.len() - last);
        sizes.push(last as f64);
        // What was read when a batch began had been taken since the one before; the last may be short.
        let mut each: Vec<f64> = took
            .iter()
            .zip(sizes.iter().skip(1))
            .map(|(t, n)| t / n)
            .collect();
        each.pop();
        h = median(&mut each);
    }
    if !(STEPS.0..=STEPS.1).contains(&h) {
        // A clock that stands still, or another unit.
        return Batches::None;
    }
    let usual = median(&mut took.clone());
    let whole = took.len().saturating_sub(1);
    let off: Vec<f64> = took
        .iter()
        .zip(sizes.iter().skip(1))
        .take(whole)
        .map(|(t, n)| (t - n * h) / usual)
        .collect();
    let size = median(&mut sizes.clone());
    let share = 1.0 - cuts.len() as f64 / stamps.len() as f64;
    if share < SHORT_SHARE || (size < 2.0 && share < 0.6) {
        return Batches::None;
    }
    let mut inner: Vec<f64> = steps.iter().copied().filter(|d| *d < SHORT * h).collect();
    let inside = median(&mut inner);
    let (joined, moving) = change(rates, stamps.len(), &cuts, &took, usual);
    let rate = BatchRate {
        step: h,
        size: size as usize,
        inside,
    };
    if moving >= MOVING && joined >= CUT {
        Batches::Gaps
    } else if spread(&off) <= EVEN
        && joined < CUT
        && (inside < READING || (moving >= SURELY && joined <= JOINED))
    {
        Batches::Even(rate)
    } else {
        Batches::Unsure(rate)
    }
}

fn step_of(pair: &[i64]) -> i64 {
    match pair {
        [a, b] => b.saturating_sub(*a),
        _ => 0,
    }
}

fn at(stamps: &[i64], i: usize) -> f64 {
    let first = stamps.first().copied().unwrap_or_default();
    stamps
        .get(i)
        .map_or(0.0, |s| s.saturating_sub(first) as f64)
}

/// Index of the first sample of every batch.
pub(super) fn beginnings(stamps: &[i64], h: f64) -> Vec<usize> {
    let later = stamps.windows(2).enumerate();
    let later = later.filter(|(_, w)| step_of(w) as f64 >= SHORT * h);
    std::iter::once(0)
        .chain(later.map(|(i, _)| i + 1))
        .collect()
}

fn pairs<T: Copy>(of: &[usize], value: impl Fn(usize, usize) -> T) -> Vec<T> {
    of.windows(2)
        .filter_map(|w| match w {
            [a, b] => Some(value(*a, *b)),
            _ => None,
        })
        .collect()
}

/// Root mean square change of the rate across beginnings of batches over that inside them, and the larger of the two over
/// the noise. Rates that never change prove nothing: infinite.
fn change(
    rates: &[[f64; 3]],
    count: usize,
    cuts: &[usize],
    took: &[f64],
    usual: f64,
) -> (f64, f64) {
    if rates.len() != count {
        return (1.0, 0.0);
    }
    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let less = |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| b[i] - a[i]) };
    let mut is_inside = vec![true; count];
    let mut is_across = vec![false; count];
    for (j, cut) in cuts.iter().enumerate().skip(1) {
        // Behind a batch that took long, something was lost.
        let is_whole = took.get(j - 1).is_some_and(|t| *t <= 1.5 * usual);
        if let (Some(inside), Some(across)) = (is_inside.get_mut(*cut), is_across.get_mut(*cut)) {
            (*inside, *across) = (false, is_whole);
        }
    }
    let squares: Vec<f64> = rates
        .windows(2)
        .map(|w| match w {
            [a, b] => norm(less(a, b)),
            _ => f64::NAN,
        })
        .collect();
    let rms = |of: &[bool]| {
        let of = squares.iter().zip(of.iter().skip(1));
        let kept = of.filter(|(square, is_of)| **is_of && square.is_finite());
        let (sum, n) = kept.fold((0.0, 0.0), |(sum, n), (square, _)| (sum + square, n + 1.0));
        (n > 0.0).then(|| (sum / n).sqrt())
    };
    let mut noise: Vec<f64> = rates
        .windows(3)
        .filter_map(|w| match w {
            [a, b, c] => Some((norm(less(&less(a, b), &less(b, c))) / 3.0).sqrt()),
            _ => None,
        })
        .filter(|n| n.is_finite())
        .collect();
    let (Some(inside), Some(across)) = (rms(&is_inside), rms(&is_across)) else {
        return (1.0, 0.0);
    };
    if inside.max(across) == 0.0 {
        return (f64::INFINITY, 0.0);
    }
    noise.sort_unstable_by(f64::total_cmp);
    // Linear between the two nearest, as the reference has it.
    let place = 0.2 * noise.len().saturating_sub(1) as f64;
    let nth = |i: f64| noise.get(i as usize).copied().unwrap_or_default();
    let quiet = nth(place.floor()) + place.fract() * (nth(place.ceil()) - nth(place.floor()));
    (
        across / inside.max(1e-12),
        inside.max(across) / quiet.max(1e-9),
    )
}

/// Number of samples in the ordinary batch of the last few.
pub(super) fn usual_size(sizes: &[i64]) -> f64 {
    median_of(&mut sizes.to_vec()) as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(super) mod tests {
    use super::super::steps::tests::draws;
    use super::*;

    const T0: i64 = 1_650_000_000_000_000_000;
    pub(in super::super) const H: i64 = 9_615_385;

    pub(in super::super) fn even(n: i64, h: i64) -> Vec<i64> {
        (0..n).map(|i| T0 + i * h).collect()
    }

    pub(in super::super) fn gyro(stamps: &[i64]) -> Vec<[f64; 3]> {
        let rate = |s: &i64| {
            let t = (s - T0) as f64 / 1e9;
            [
                1.5 * (1.7 * t).sin(),
                0.9 * (1.1 * t).cos(),
                1.2 * (0.6 * t).sin(),
            ]
        };
        stamps.iter().map(rate).collect()
    }

    /// Stamps of samples that are read `size` at a time, `inner` apart, up to `late` after the last was taken.
    pub(in super::super) fn batched(
        stamps: &[i64],
        size: usize,
        inner: i64,
        late: i64,
    ) -> Vec<i64> {
        let late: Vec<i64> = draws(1, late.max(1))
            .take(stamps.len() / size + 1)
            .collect();
        let mut newest = i64::MIN;
        (0..stamps.len())
            .map(|i| {
                let last = (i / size * size + size - 1).min(stamps.len() - 1);
                let stamp = stamps[last] + late[i / size] + (i % size) as i64 * inner;
                newest = newest.max(stamp);
                newest
            })
            .collect()
    }

    #[test]
    fn batches_are_told_with_the_rate_of_the_reference() {
        // Size, step inside, delay, samples; the step of the reference.
        let cases = [
            (7, 300_000, 2_000_000, 700, 9_626_089.43),
            (10, 20_000, 0, 700, 9_615_385.0),
            (32, 0, 0, 690, 9_615_385.0),
            (2, 300_000, 500_000, 700, 9_617_447.5),
        ];
        for (size, inner, late, n, step) in cases {
            let stamps = even(n, H);
            let Batches::Even(rate) = batches(&batched(&stamps, size, inner, late), &gyro(&stamps))
            else {
                panic!("{size} at a time");
            };
            assert!((rate.step - step).abs() < 0.01, "{} {step}", rate.step);
            assert_eq!(rate.size, size);
        }
    }

    #[test]
    fn missing_samples_and_jitter_are_no_batches() {
        let stamps = even(2500, H);
        let kept: Vec<i64> = stamps
            .iter()
            .enumerate()
            .filter(|(i, _)| i % 25 < 5)
            .map(|(_, s)| *s)
            .collect();
        assert_eq!(batches(&kept, &gyro(&kept)), Batches::Gaps);
        let off: Vec<i64> = draws(5, 3_000_000).take(700).collect();
        let jitter: Vec<i64> = even(700, H)
            .iter()
            .zip(off)
            .map(|(s, off)| s + off)
            .collect();
        assert_eq!(batches(&jitter, &gyro(&jitter)), Batches::None);
    }

    #[test]
    fn a_clock_that_stands_still_makes_no_batches() {
        let stamps: Vec<i64> = (0..6000).map(|i| T0 + i / 200 * 1000).collect();
        assert_eq!(batches(&stamps, &gyro(&even(6000, H))), Batches::None);
    }

    #[test]
    fn a_body_that_rests_proves_nothing() {
        let stamps = batched(&even(700, H), 5, 2_000_000, 0);
        let still = vec![[0.0; 3]; 700];
        assert!(matches!(batches(&stamps, &still), Batches::Unsure(_)));
    }
}
