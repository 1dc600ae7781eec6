//! Stamps and rows -> whether the clock counts in longer steps than the sensor samples. Pure.
//!
//! A stage of its own because rows that share a stamp are two things: samples of one step of a coarse clock, or one
//! sample recorded several times. Row by row nothing tells them apart at rest, where all are equal; over many steps the
//! changes do: samples change inside a step as much as across its end, repeats only across it (`docs/theory/clocks.md`).

use crate::record::RawSample;

/// Fewest samples and steps of the clock that tell.
const LEAST: usize = 24;
const TICKS: usize = 4;
/// Samples in a step of the clock, in the mean, and share of the steps with several, from which it is coarse: three in two
/// steps, less what the ends cut off. From so many on the share says nothing.
const SHARING: f64 = 1.48;
const SHARED: f64 = 0.48;
const SURELY_SHARING: f64 = 3.0;
/// Share of the steps that begin at a multiple of the step: a clock counts from 0, batches come at any time.
const COUNTED: f64 = 0.95;
/// Shortest step of a coarse clock, nanoseconds.
const SHORTEST: i64 = 10_000;
/// Rows that change less often inside a step than so many times as often as across its end are repeats, with so many
/// changes across at least.
const VARIED: f64 = 0.2;
const CHANGES: usize = 8;

/// A clock that counts in longer steps than the sensor samples.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CoarseClock {
    /// Step of the clock, nanoseconds.
    pub tick: i64,
    /// Mean step of the sensor, nanoseconds.
    pub step: f64,
}

/// Verdict about samples that share their stamps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Sharing {
    /// Few samples share a stamp, or these are no steps of a clock.
    None,
    /// Samples of a coarse clock: equal ones are no repeats.
    Coarse(CoarseClock),
    /// Samples that were recorded several times.
    Repeats,
}

/// Judges samples, each with its stamp in nanoseconds, in the order in which they came.
#[must_use]
pub fn sharing(samples: &[(i64, &RawSample)]) -> Sharing {
    let is_sorted = samples.is_sorted_by_key(|(stamp, _)| *stamp);
    let ticks = ticks_of(samples);
    let inner = ticks.get(1..ticks.len().saturating_sub(1));
    let inner = inner.unwrap_or_default();
    if samples.len() < LEAST || !is_sorted || ticks.len() < TICKS {
        return Sharing::None;
    }
    // The first and the last may be cut off.
    let (Some(first), Some(last)) = (inner.first(), ticks.last()) else {
        return Sharing::None;
    };
    let count: usize = inner.iter().map(|tick| tick.count).sum();
    let mean = count as f64 / inner.len() as f64;
    let shared = inner.iter().filter(|tick| tick.count > 1).count();
    let is_shared = shared as f64 >= SHARED * inner.len() as f64 || mean >= SURELY_SHARING;
    if mean < SHARING || !is_shared {
        return Sharing::None;
    }
    if are_repeats(samples) {
        return Sharing::Repeats;
    }
    let mut steps: Vec<i64> = ticks
        .windows(2)
        .filter_map(|pair| match pair {
            [a, b] => Some(b.stamp.saturating_sub(a.stamp)),
            _ => None,
        })
        .collect();
    let middle = steps.len() / 2;
    let tick = *steps.select_nth_unstable(middle).1;
    let is_counted = |of: &&Tick| tick > 0 && of.stamp % tick == 0;
    let counted = ticks.iter().filter(is_counted).count() as f64;
    if tick < SHORTEST || counted < COUNTED * ticks.len() as f64 {
        return Sharing::None;
    }
    // Steps of the clock in which nothing was recorded are none of the sensor's.
    let full = inner.len() as f64 * tick as f64;
    let span = last.stamp.saturating_sub(first.stamp) as f64;
    let step = span.min(full) / count as f64;
    Sharing::Coarse(CoarseClock { tick, step })
}

/// A step of the clock.
struct Tick {
    stamp: i64,
    count: usize,
}

fn ticks_of(samples: &[(i64, &RawSample)]) -> Vec<Tick> {
    let same = samples.chunk_by(|a, b| a.0 == b.0);
    same.filter_map(|chunk| {
        let (stamp, _) = chunk.first()?;
        Some(Tick {
            stamp: *stamp,
            count: chunk.len(),
        })
    })
    .collect()
}

/// Whether rows change across the steps of the clock and hardly inside them.
fn are_repeats(samples: &[(i64, &RawSample)]) -> bool {
    let (mut inside, mut across) = ((0_usize, 0_usize), (0_usize, 0_usize));
    for pair in samples.windows(2) {
        let [(a, before), (b, row)] = pair else {
            continue;
        };
        let (pairs, changes) = if a == b { &mut inside } else { &mut across };
        *pairs += 1;
        *changes += usize::from(!are_equal(before, row));
    }
    let share = |(pairs, changes): (usize, usize)| changes as f64 / pairs.max(1) as f64;
    across.1 >= CHANGES && share(inside) < VARIED * share(across)
}

/// Whether two rows are one measurement; a number that is none equals itself.
fn are_equal(a: &RawSample, b: &RawSample) -> bool {
    let bits = |v: Option<[f64; 3]>| v.map(|v| v.map(f64::to_bits));
    bits(a.gyro) == bits(b.gyro)
        && bits(a.accel) == bits(b.accel)
        && a.interval_nanos == b.interval_nanos
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const T0: i64 = 1_650_000_000_000_000_000;

    /// 30 s of whole degrees a second, at rest for the first `still` of them, `rate` a second.
    fn rows(rate: i64, still: f64) -> Vec<RawSample> {
        let row = |i| {
            let t = (i as f64 / rate as f64 - still).max(0.0);
            RawSample {
                gyro: Some([80.0, 60.0, 40.0].map(|top: f64| (top * (1.7 * t).sin()).round())),
                ..RawSample::default()
            }
        };
        (0..30 * rate).map(row).collect()
    }

    fn judged(rows: &[RawSample], stamp: impl Fn(i64) -> i64) -> Sharing {
        let stamped: Vec<_> = (0..).map(stamp).zip(rows).collect();
        sharing(&stamped)
    }

    fn counted(tick: i64, rate: i64) -> impl Fn(i64) -> i64 {
        move |i| (T0 + i * 1_000_000_000 / rate) / tick * tick
    }

    #[test]
    fn clocks_of_a_second_to_ten_milliseconds_are_coarse_moving_and_at_rest() {
        // Step of the clock in ms, samples a second.
        for (ms, rate) in [
            (200, 50),
            (1000, 50),
            (100, 50),
            (100, 200),
            (10, 400),
            (10, 150),
        ] {
            let tick = ms * 1_000_000;
            for still in [0.0, 3.0, 25.0, 30.0] {
                let Sharing::Coarse(found) = judged(&rows(rate, still), counted(tick, rate)) else {
                    panic!("{ms} ms, {rate} Hz, {still} s at rest");
                };
                assert_eq!(found.tick, tick);
                let step = 1e9 / rate as f64;
                // A sample more or less in the two steps at the ends.
                assert!((found.step / step - 1.0).abs() < 0.02, "{found:?} {step}");
            }
        }
    }

    #[test]
    fn a_logger_that_polls_faster_than_the_sensor_repeats() {
        for held in [2, 4] {
            let of_sensor = rows(100, 5.0);
            let polled: Vec<RawSample> = of_sensor
                .iter()
                .flat_map(|row| std::iter::repeat_n(*row, held))
                .collect();
            let found = judged(&polled, |i| T0 + i / held as i64 * 10_000_000);
            assert_eq!(found, Sharing::Repeats, "{held} times");
        }
    }

    #[test]
    fn stamps_of_their_own_and_batches_that_come_at_any_time_are_no_coarse_clocks() {
        let moving = rows(100, 0.0);
        let own = judged(&moving, |i| T0 + i * 10_000_000);
        let pairs = judged(&moving, |i| T0 + (i - i % 50 / 49) * 10_000_000);
        let batched = judged(&moving, |i| T0 + 7_654_321 + i / 10 * 100_000_007);
        assert_eq!([own, pairs, batched], [Sharing::None; 3]);
    }
}
