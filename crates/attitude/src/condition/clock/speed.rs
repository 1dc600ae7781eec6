//! Stamps and the times at which they arrived -> the speed of the stamp clock by the arrival clock. Pure.
//!
//! A stage of its own because an angle is a rate times time: a clock at half the speed halves every angle, and nothing
//! in the stamps alone shows it. Messages come late, never early, so only the least delay of many tells
//! (`docs/theory/clocks.md`).

use super::batches::STEPS;
use super::line::{robust_line, spread};
use super::steps::ClockSteps;
use crate::median::median;

/// Samples whose least delay is one point, and most points: beyond, two become one.
const BLOCK: u64 = 32;
const MOST_POINTS: usize = 4096;
/// Fewest points of which a speed is told.
const LEAST_POINTS: usize = 3;
/// Slower than this a clock stands still.
const FROZEN: f64 = 1e-5;
/// Deviations from the speed of the arrival clock: worth a note, a warning, and no clock's.
const NOTE: f64 = 2e-3;
const WARN: f64 = 5e-3;
const WRONG: f64 = 0.03;
/// Standard deviations of the speed below which it is no deviation.
const SIGMAS: f64 = 5.0;
/// A step of the arrival clock lasts so long, nanoseconds, which no stall of a link does; and is this large.
const LASTS: f64 = 5e9;
const LEAST_STEP: f64 = 1e8;

/// Verdict about the speed of a stamp clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SpeedVerdict {
    /// Speed of the arrival clock, within 0.2 %.
    Good,
    /// Deviation of 0.2 to 0.5 %.
    Note,
    /// Deviation of 0.5 to 3 %.
    Warning,
    /// Larger deviation: no clock drifts so much.
    Wrong,
    /// Stamps in another unit than they are taken for.
    Unit,
    /// The clock stands still, or as good as.
    Frozen,
}

/// Speed of a stamp clock.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ClockSpeed {
    /// Verdict about the speed.
    pub verdict: SpeedVerdict,
    /// Seconds of the stamp clock in a second of the arrival clock.
    pub speed: f64,
    /// Mean steps by the stamp clock and by the arrival clock, s.
    pub steps_secs: (f64, f64),
}

/// Least delays of blocks of samples.
#[derive(Clone, Debug)]
pub struct SpeedPass {
    clock: ClockSteps,
    /// Nanoseconds by which the stamp clock was set.
    set: i64,
    first: Option<(i64, i64)>,
    last: (i64, i64),
    samples: u64,
    is_apart: bool,
    block: u64,
    in_block: u64,
    /// Stamp after the first and delay less that of the first, of the least delay in the block.
    least: Option<(f64, f64)>,
    points: Vec<(f64, f64)>,
}

impl Default for SpeedPass {
    fn default() -> SpeedPass {
        SpeedPass {
            clock: ClockSteps::default(),
            set: 0,
            first: None,
            last: (0, 0),
            samples: 0,
            is_apart: false,
            block: BLOCK,
            in_block: 0,
            least: None,
            points: Vec::new(),
        }
    }
}

impl SpeedPass {
    /// Takes the next sample: its stamp and its arrival, nanoseconds.
    pub fn push(&mut self, stamp: i64, arrival: i64) {
        let mut stamp = stamp.saturating_sub(self.set);
        if let Some(jump) = self.clock.push(stamp, arrival) {
            self.set = self.set.saturating_add(jump);
            stamp = stamp.saturating_sub(jump);
        }
        let (s, l) = *self.first.get_or_insert((stamp, arrival));
        self.last = (stamp, arrival);
        self.samples += 1;
        let (stamp, arrival) = (stamp.saturating_sub(s), arrival.saturating_sub(l));
        self.is_apart |= stamp != arrival;
        let point = (stamp as f64, arrival.saturating_sub(stamp) as f64);
        if self.least.is_none_or(|least| point.1 < least.1) {
            self.least = Some(point);
        }
        self.in_block += 1;
        if self.in_block == self.block {
            self.in_block = 0;
            self.points.extend(self.least.take());
            if self.points.len() >= MOST_POINTS {
                self.halve();
            }
        }
    }

    /// The speed; `None` where too few samples came to tell, or both clocks are one.
    #[must_use]
    pub fn finish(&self) -> Option<ClockSpeed> {
        let (s, l) = self.first?;
        let (span_s, span_l) = (
            self.last.0.saturating_sub(s) as f64,
            self.last.1.saturating_sub(l) as f64,
        );
        if self.points.len() < LEAST_POINTS || span_l <= 0.0 || !self.is_apart {
            return None;
        }
        let intervals = (self.samples - 1) as f64;
        let (step_s, step_l) = (span_s / intervals, span_l / intervals);
        if !(STEPS.0..=STEPS.1).contains(&step_l) {
            // Written in one go, or not at once: the arrivals are no clock.
            return None;
        }
        let of = |verdict, speed| ClockSpeed {
            verdict,
            speed,
            steps_secs: (step_s * 1e-9, step_l * 1e-9),
        };
        let by_span = span_s / span_l;
        if span_s <= 0.0 || (step_s < STEPS.0 && step_l >= STEPS.0) {
            let is_frozen = by_span < FROZEN;
            let verdict = if is_frozen {
                SpeedVerdict::Frozen
            } else {
                SpeedVerdict::Unit
            };
            return Some(of(verdict, by_span));
        }
        if step_s > STEPS.1 && step_l <= STEPS.1 {
            return Some(of(SpeedVerdict::Unit, by_span));
        }
        let points = self.without_arrival_steps(step_s);
        let (slope, offset) = robust_line(&points);
        let rest: Vec<f64> = points.iter().map(|(x, y)| y - offset - slope * x).collect();
        let count = points.len() as f64;
        let sigma = 2.0 * spread(&rest) / span_s.max(1.0) * (12.0 / count).sqrt() + 1e-9;
        let speed = if slope > -1.0 {
            1.0 / (1.0 + slope)
        } else {
            f64::INFINITY
        };
        Some(of(verdict(speed, sigma), speed))
    }

    /// Twice as many samples a point.
    fn halve(&mut self) {
        self.points = self
            .points
            .chunks(2)
            .filter_map(|pair| pair.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)))
            .collect();
        self.block *= 2;
    }

    /// The points, without the steps at which the arrival clock was set: there the least delays of some seconds before
    /// and after differ, and neighbouring points as much.
    fn without_arrival_steps(&self, step: f64) -> Vec<(f64, f64)> {
        let mut slopes: Vec<f64> = self
            .points
            .windows(2)
            .filter_map(|pair| match pair {
                [a, b] => Some((b.1 - a.1) / (b.0 - a.0).max(1.0)),
                _ => None,
            })
            .collect();
        // A step does not bend the median of neighbouring differences.
        let slope = median(&mut slopes);
        let level: Vec<f64> = self.points.iter().map(|(x, y)| y - slope * x).collect();
        let around = ((LASTS / (step * self.block as f64)).ceil() as usize).max(2);
        let least_step = LEAST_STEP.max(4.0 * step);
        let least = |part: &[f64]| part.iter().copied().fold(f64::INFINITY, f64::min);
        let mut off = 0.0;
        let mut out = Vec::with_capacity(level.len());
        for (j, (x, y)) in self.points.iter().copied().enumerate() {
            let before = level.get(j.saturating_sub(around)..j).unwrap_or_default();
            let after = level
                .get(j..(j + around).min(level.len()))
                .unwrap_or_default();
            let here = level.get(j).copied().unwrap_or_default();
            let jump = least(after) - least(before);
            let seen = here - before.last().copied().unwrap_or(here);
            let is_whole = before.len().min(after.len()) * 2 >= around;
            if is_whole
                && jump.abs() > least_step
                && (seen - jump).abs() <= least_step.max(0.2 * jump.abs())
            {
                off += jump;
            }
            out.push((x, y - off));
        }
        out
    }
}

fn verdict(speed: f64, sigma: f64) -> SpeedVerdict {
    let thousands = (speed.log10() / 3.0).round_ties_even();
    if speed.is_finite()
        && speed > 0.0
        && thousands != 0.0
        && (speed / 10f64.powf(3.0 * thousands) - 1.0).abs() < WRONG
    {
        return SpeedVerdict::Unit;
    }
    let off = (speed - 1.0).abs();
    let is_off_by = |least: f64| off > least.max(SIGMAS * sigma);
    match () {
        () if is_off_by(WRONG) => SpeedVerdict::Wrong,
        () if is_off_by(WARN) => SpeedVerdict::Warning,
        () if is_off_by(NOTE) => SpeedVerdict::Note,
        () => SpeedVerdict::Good,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::steps::tests::stream;
    use super::*;

    const T0: i64 = 1_650_000_000_000_000_000;

    fn speed_of(stamp: impl Fn(i64) -> i64, arrival: impl Fn(usize, i64) -> i64) -> ClockSpeed {
        let mut pass = SpeedPass::default();
        for (i, (s, l)) in stream(4000).into_iter().enumerate() {
            pass.push(T0 + stamp(s - T0), arrival(i, l));
        }
        pass.finish().unwrap()
    }

    #[test]
    fn speeds_and_their_verdicts_are_those_of_the_reference() {
        type Warp = fn(i64) -> i64;
        let cases: [(Warp, SpeedVerdict, f64); 6] = [
            (|e| e + e * 8 / 100_000, SpeedVerdict::Good, 1.000_076_36),
            (|e| e + e / 100, SpeedVerdict::Warning, 1.009_998_09),
            (|e| e / 2, SpeedVerdict::Wrong, 0.500_000_411),
            (|e| e * 2, SpeedVerdict::Wrong, 2.000_065_05),
            (|e| e / 1000, SpeedVerdict::Unit, 0.001_000_068_69),
            (
                |e| e / 1_000_000_000 * 1000,
                SpeedVerdict::Frozen,
                9.503_028_27e-7,
            ),
        ];
        for (stamp, verdict, speed) in cases {
            let found = speed_of(stamp, |_, l| l);
            assert_eq!(found.verdict, verdict);
            // The reference writes nine digits: half of the last is 5e-9 of one.
            assert!(
                (found.speed / speed - 1.0).abs() < 5e-9,
                "{} {speed}",
                found.speed
            );
        }
    }

    #[test]
    fn a_recorder_whose_clock_was_set_leaves_the_speed_as_it_was() {
        let found = speed_of(|e| e, |i, l| l + if i >= 2000 { 2_000_000_000 } else { 0 });
        assert_eq!(found.verdict, SpeedVerdict::Good);
        // 15 ppm of the reference, which knows the very sample of the step.
        assert!((found.speed - 1.0).abs() < 50e-6, "{}", found.speed);
    }

    #[test]
    fn a_long_recording_is_halved_and_keeps_its_speed() {
        let mut pass = SpeedPass::default();
        for i in 0..400_000_i64 {
            let s = i * 5_000_000;
            pass.push(s + s / 20, s + 2_000_000 + (i * 7919) % 8_000_000);
        }
        assert!(pass.points.len() < MOST_POINTS);
        let found = pass.finish().unwrap();
        assert_eq!(found.verdict, SpeedVerdict::Wrong);
        assert!((found.speed - 1.05).abs() < 1e-5, "{}", found.speed);
    }

    #[test]
    fn one_clock_alone_tells_nothing() {
        let mut pass = SpeedPass::default();
        (0..4000).for_each(|i| pass.push(T0 + i, T0 + 7 + i));
        assert_eq!(pass.finish(), None);
    }
}
