//! Arrivals of samples without a stamp -> even stamps. Pure.
//!
//! Apart from the stamps of a log because nothing else is known here: a sensor samples evenly, what it sends comes late,
//! one by one or several at once (a FIFO over USB, a connection interval of Bluetooth), and never early. So samples lie on
//! a line through their arrivals (`docs/theory/clocks.md`, 4): samples wait until a few batches tell its step, at most so
//! many as [`MOST_ARRIVALS`]; from then on none waits, and the line follows the arrivals ([`BatchLine`]).

use super::batch_line::BatchLine;
use super::batches::{Batches, STEPS, batches, beginnings};
use super::line::robust_line;
use crate::median::median;
use crate::record::Nanos;

/// Fewest samples, and beginnings of batches, that tell a step: five whole batches, since the first began anywhere.
const LEAST: usize = 24;
const LEAST_BEGINNINGS: usize = 7;
/// Time after which the first batch, in which samples follow each other closely, is not all that has come, nanoseconds.
const LEAST_TIME: i64 = 500_000_000;
/// Beginnings by which a step is told when nobody is to wait any longer.
const FEW_BEGINNINGS: usize = 3;
/// Samples that wait at most.
pub const MOST_ARRIVALS: usize = 2048;
/// Longest step that is surely no gap, nanoseconds, and in median steps.
const GAP: f64 = 1e9;
const GAP_STEPS: f64 = 20.0;
/// Difference of the slope of the line from the ordinary step, beyond which it is not believed.
const SLOPE: f64 = 0.05;
/// An arrival so much before the one before it is of a clock that was set, nanoseconds.
const SET_BACK: i64 = 1_000_000_000;
/// Batches in a row off the line, after which the rate is another one.
const ASTRAY: u32 = 8;
/// Share of a new latency in the mean.
const LATENCY_GAIN: f64 = 1.0 / 64.0;

/// Clock of samples that have no stamp but their arrival.
#[derive(Clone, Debug, Default)]
pub struct ArrivalClock {
    state: State,
    newest: Option<i64>,
    /// Mean time from a stamp to the arrival of its sample, nanoseconds.
    latency: f64,
    restarts: u64,
}

#[derive(Clone, Debug)]
enum State {
    Learning(Learning),
    Line(BatchLine),
    /// Arrivals that lie on no line: samples are missing between batches, or no sensor has the step.
    AsArrived(i64),
}

impl Default for State {
    fn default() -> State {
        State::Learning(Learning::default())
    }
}

/// Arrivals that wait for the step.
#[derive(Clone, Debug, Default)]
struct Learning {
    arrivals: Vec<i64>,
    rates: Vec<[f64; 3]>,
    /// Number of samples at which they are looked at next: each look costs a pass over all.
    next: usize,
}

/// Facts about arrivals, for a report.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ArrivalReport {
    /// Samples a second.
    pub rate_hz: f64,
    /// Samples that come together.
    pub batch: f64,
    /// Mean time from a stamp to the arrival of its sample, seconds.
    pub latency_secs: f64,
    /// Number of times the rate was learned anew.
    pub restarts: u64,
}

impl ArrivalClock {
    /// Takes samples in the order in which they came, each with its arrival and its rate, and pushes the stamps that are
    /// known by now: of the samples that wait and these, in order; none while the step is not known.
    pub fn take(&mut self, samples: &[(Nanos, [f64; 3])], stamps: &mut Vec<Nanos>) {
        let mut rest = samples;
        while let Some(((arrival, rate), behind)) = rest.split_first() {
            let together = 1 + behind.iter().take_while(|(at, _)| at == arrival).count();
            let is_last = together == 1;
            self.one(arrival.0, *rate, (together, is_last), stamps);
            rest = behind;
        }
    }

    fn one(
        &mut self,
        arrival: i64,
        rate: [f64; 3],
        (together, is_last): (usize, bool),
        stamps: &mut Vec<Nanos>,
    ) {
        let is_set_back = self
            .newest
            .is_some_and(|newest| arrival < newest.saturating_sub(SET_BACK));
        let is_astray = matches!(&self.state, State::Line(line) if line.astray() >= ASTRAY);
        let is_waiting = self.is_waiting();
        if (is_set_back && !is_waiting) || is_astray {
            self.state = State::default();
            self.restarts += 1;
        }
        self.newest = Some(arrival);
        match &mut self.state {
            State::Learning(learning) => {
                learning.push(arrival, rate);
                if is_last && learning.is_due() {
                    self.settle(false, stamps);
                }
            }
            State::Line(line) => {
                let stamp = line.push_together(arrival, together);
                let late = arrival.saturating_sub(stamp) as f64;
                self.latency += LATENCY_GAIN * (late - self.latency);
                stamps.push(Nanos(stamp));
            }
            State::AsArrived(last) => {
                *last = arrival.max(last.saturating_add(1));
                stamps.push(Nanos(*last));
            }
        }
    }

    /// Whether samples wait for the step.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        matches!(&self.state, State::Learning(learning) if !learning.arrivals.is_empty())
    }

    /// Pushes the stamps of the samples that wait, by what is known of the step, when nobody is to wait any longer.
    pub fn release(&mut self, stamps: &mut Vec<Nanos>) {
        if self.is_waiting() {
            self.settle(true, stamps);
        }
    }

    /// Facts for a report, once the step is known.
    #[must_use]
    pub fn report(&self) -> Option<ArrivalReport> {
        let State::Line(line) = &self.state else {
            return None;
        };
        Some(ArrivalReport {
            rate_hz: 1e9 / line.step(),
            batch: line.usual_size(),
            latency_secs: self.latency * 1e-9,
            restarts: self.restarts,
        })
    }

    /// Whether arrivals lie on no line, so that the stamps are the arrivals.
    #[must_use]
    pub fn is_uneven(&self) -> bool {
        matches!(self.state, State::AsArrived(_))
    }

    fn settle(&mut self, at_last: bool, stamps: &mut Vec<Nanos>) {
        let State::Learning(learning) = &self.state else {
            return;
        };
        let at_last = at_last || learning.arrivals.len() >= MOST_ARRIVALS;
        let base = learning.arrivals.first().copied().unwrap_or_default();
        if let Some(fit) = learning.fit(at_last) {
            let line = fit.line(&learning.arrivals);
            let at =
                |i: usize| base.saturating_add((fit.offset + fit.step * i as f64).round() as i64);
            let late = learning.arrivals.iter().enumerate();
            let late = late.map(|(i, arrival)| arrival.saturating_sub(at(i)) as f64);
            self.latency = late.sum::<f64>() / learning.arrivals.len().max(1) as f64;
            stamps.extend((0..learning.arrivals.len()).map(|i| Nanos(at(i))));
            self.state = State::Line(line);
        } else if at_last {
            let mut last = i64::MIN;
            for arrival in &learning.arrivals {
                last = (*arrival).max(last.saturating_add(1));
                stamps.push(Nanos(last));
            }
            self.state = State::AsArrived(last);
        }
    }
}

/// Line through the arrivals of batches, nanoseconds after the first.
struct Fit {
    step: f64,
    /// Instant of the sample number 0.
    offset: f64,
    /// Mean distance of arrivals from it.
    off: f64,
    beginnings: Vec<usize>,
}

impl Fit {
    fn line(&self, arrivals: &[i64]) -> BatchLine {
        BatchLine::on(
            self.step,
            self.offset,
            self.off,
            (&self.beginnings, arrivals),
        )
    }
}

impl Learning {
    fn push(&mut self, arrival: i64, rate: [f64; 3]) {
        // Of one connection none comes before another; of a clock that is set a little back neither.
        let newest = self.arrivals.last().copied();
        self.arrivals
            .push(newest.map_or(arrival, |newest| arrival.max(newest)));
        self.rates.push(rate);
    }

    fn is_due(&mut self) -> bool {
        let count = self.arrivals.len();
        let (first, last) = (self.arrivals.first(), self.arrivals.last());
        let took = last
            .zip(first)
            .map_or(0, |(last, first)| last.saturating_sub(*first));
        if count < self.next.max(LEAST) || took < LEAST_TIME {
            return false;
        }
        self.next = (count + count / 4 + 1).min(MOST_ARRIVALS);
        true
    }

    /// Line through the arrivals, if they tell one.
    fn fit(&self, at_last: bool) -> Option<Fit> {
        let first = self.arrivals.first()?;
        let arrivals: Vec<f64> = self
            .arrivals
            .iter()
            .map(|arrival| arrival.saturating_sub(*first) as f64)
            .collect();
        let (step, beginnings) = self.step(&arrivals)?;
        let least = if at_last {
            FEW_BEGINNINGS
        } else {
            LEAST_BEGINNINGS
        };
        if beginnings.len() < least || !(STEPS.0..=STEPS.1).contains(&step) {
            return None;
        }
        let is_cut = matches!(batches(&self.arrivals, &self.rates), Batches::Gaps);
        if is_cut {
            return None;
        }
        // The last sample of a batch was taken shortly before the batch came.
        let points: Vec<(f64, f64)> = beginnings
            .windows(2)
            .filter_map(|pair| match pair {
                [start, next] => Some((next.saturating_sub(1) as f64, *arrivals.get(*start)?)),
                _ => None,
            })
            .collect();
        let (mut slope, mut offset) = robust_line(&points);
        if (slope - step).abs() > SLOPE * step {
            slope = step;
            let mut offsets: Vec<f64> = points.iter().map(|(k, a)| a - step * k).collect();
            offset = median(&mut offsets);
        }
        let off = points.iter().map(|(k, a)| (a - offset - slope * k).abs());
        Some(Fit {
            step: slope,
            offset,
            off: off.sum::<f64>() / points.len().max(1) as f64,
            beginnings,
        })
    }

    /// Step of the sensor, and where batches begin: `docs/theory/clocks.md`, 4.
    fn step(&self, arrivals: &[f64]) -> Option<(f64, Vec<usize>)> {
        let steps: Vec<f64> = arrivals
            .windows(2)
            .map(|pair| match pair {
                [a, b] => b - a,
                _ => 0.0,
            })
            .collect();
        let longest = GAP.max(GAP_STEPS * median(&mut steps.clone()));
        let believed: Vec<f64> = steps.into_iter().filter(|step| *step <= longest).collect();
        let mut step = believed.iter().sum::<f64>() / believed.len().max(1) as f64;
        let mut cuts = Vec::new();
        for _ in 0..3 {
            if step <= 0.0 {
                return None;
            }
            cuts = beginnings(&self.arrivals, step);
            let mut each: Vec<f64> = cuts
                .windows(3)
                .filter_map(|cuts| match cuts {
                    [a, b, c] => {
                        let took = arrivals.get(*b)? - arrivals.get(*a)?;
                        Some(took / (c - b) as f64)
                    }
                    _ => None,
                })
                .collect();
            if each.is_empty() {
                return None;
            }
            step = median(&mut each);
        }
        Some((step, cuts))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::batches::tests::{batched, even, gyro};
    use super::super::steps::tests::draws;
    use super::*;

    const MS: i64 = 1_000_000;

    /// Stamps of samples that came so: those of each read are taken together.
    fn stamped(clock: &mut ArrivalClock, arrivals: &[i64], rates: &[[f64; 3]]) -> Vec<i64> {
        let mut out = Vec::new();
        let all: Vec<_> = arrivals
            .iter()
            .map(|at| Nanos(*at))
            .zip(rates.iter().copied())
            .collect();
        for read in all.chunk_by(|a, b| a.0 == b.0) {
            clock.take(read, &mut out);
        }
        clock.release(&mut out);
        out.iter().map(|stamp| stamp.0).collect()
    }

    /// Distance from the truth without its mean: rms, and most, ns.
    fn varies(out: &[i64], truth: &[i64]) -> (f64, f64) {
        let off: Vec<f64> = out.iter().zip(truth).map(|(a, b)| (a - b) as f64).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let each = off.iter().map(|off| (off - mean).abs());
        let rms = each.clone().map(|off| off * off).sum::<f64>() / off.len() as f64;
        (rms.sqrt(), each.fold(0.0, f64::max))
    }

    #[test]
    fn samples_of_a_fifo_are_even_from_the_first_one_on() {
        // Step, samples at once, between two of a read, lateness.
        for (h, size, inner, late) in [
            (MS, 10, 0, 0),
            (MS, 10, 20_000, 300_000),
            (5 * MS, 10, 0, 2 * MS),
            (10 * MS, 4, 0, 3 * MS),
            (9_615_385, 32, 300_000, 5 * MS),
        ] {
            let truth = even(4000, h);
            let arrivals = batched(&truth, size, inner, late);
            let mut clock = ArrivalClock::default();
            let out = stamped(&mut clock, &arrivals, &gyro(&truth));
            assert_eq!(out.len(), truth.len());
            let (rms, most) = varies(&out, &truth);
            let bound = 1000.0 + 0.4 * late as f64;
            assert!(
                rms < bound && most < 3.0 * bound,
                "{h} {size}: {rms} {most}"
            );
            assert!(out.windows(2).all(|pair| pair[0] < pair[1]));
            let report = clock.report().unwrap();
            assert!(
                (report.rate_hz * h as f64 / 1e9 - 1.0).abs() < 2e-3,
                "{report:?}"
            );
            assert!((report.batch - size as f64).abs() < 0.1, "{report:?}");
            let expected = (size as f64 - 1.0) / 2.0 * h as f64 / 1e9;
            let latency = report.latency_secs;
            assert!(
                (latency - expected).abs() < 0.2 * expected + 3e-3,
                "{latency} {expected}"
            );
        }
    }

    #[test]
    fn single_samples_that_come_late_lie_on_a_line() {
        let truth = even(6000, 5 * MS);
        let late = draws(7, 3 * MS);
        let arrivals: Vec<i64> = truth.iter().zip(late).map(|(at, late)| at + late).collect();
        let out = stamped(&mut ArrivalClock::default(), &arrivals, &gyro(&truth));
        let (rms, most) = varies(&out, &truth);
        let (recorded, _) = varies(&arrivals, &truth);
        assert!(
            rms < 0.45 * recorded && most < 2e6,
            "{rms} {most}, as they came {recorded}"
        );
    }

    #[test]
    fn time_stands_in_no_stall_and_goes_on_behind_what_is_lost() {
        // 100 ms in which nothing comes, and then all at once.
        let truth = even(3000, 10 * MS);
        let stalled: Vec<i64> = (0..3000)
            .map(|i| truth[if (1500..1510).contains(&i) { 1510 } else { i }])
            .collect();
        let out = stamped(&mut ArrivalClock::default(), &stalled, &gyro(&truth));
        let (_, most) = varies(&out, &truth);
        assert!(most < 2e6, "{most}");
        // 30 samples that never come.
        let kept: Vec<i64> = truth
            .iter()
            .enumerate()
            .filter(|(i, _)| !(1500..1530).contains(i))
            .map(|(_, at)| *at)
            .collect();
        let out = stamped(&mut ArrivalClock::default(), &kept, &gyro(&kept));
        let (_, most) = varies(&out, &kept);
        assert!(most < 5e6, "{most}");
    }

    #[test]
    fn another_rate_and_a_clock_that_was_set_back_are_learned_anew() {
        let mut clock = ArrivalClock::default();
        let slow = even(1000, 10 * MS);
        let end = *slow.last().unwrap();
        let fast: Vec<i64> = (1..2000).map(|i| end + i * 2 * MS).collect();
        let truth = [slow, fast].concat();
        let out = stamped(&mut clock, &truth, &gyro(&truth));
        let report = clock.report().unwrap();
        assert!(
            (report.rate_hz - 500.0).abs() < 1.0 && report.restarts == 1,
            "{report:?}"
        );
        assert_eq!(out.len(), truth.len());
        let back: Vec<i64> = truth.iter().map(|at| at - 3600 * 1000 * MS).collect();
        let out = stamped(&mut clock, &back, &gyro(&truth));
        assert!(out[0] < truth[0] && clock.report().unwrap().restarts >= 2);
    }

    #[test]
    fn few_samples_and_bursts_between_which_samples_are_missing_come_as_they_came() {
        let truth = even(3, 10 * MS);
        assert_eq!(
            stamped(&mut ArrivalClock::default(), &truth[..1], &gyro(&truth)),
            truth[..1]
        );
        // 5 of 25 are recorded.
        let all = even(2500, 9_615_385);
        let kept: Vec<i64> = (0..2500).filter(|i| i % 25 < 5).map(|i| all[i]).collect();
        let mut clock = ArrivalClock::default();
        let out = stamped(&mut clock, &kept, &gyro(&kept));
        assert_eq!(out, kept);
        assert!(clock.is_uneven());
        // A thousand at once, and nothing else.
        let out = stamped(&mut ArrivalClock::default(), &[7; 3000], &[[0.0; 3]; 3000]);
        assert_eq!(out.len(), 3000);
    }
}
