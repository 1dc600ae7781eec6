//! Stamps and the times at which they arrived -> steps of the stamp clock. Pure.
//!
//! A stage of its own because stamps alone cannot tell a clock that was set from samples that are missing: the arrival
//! clock can. What arrived a moment after its predecessor is at most that much younger, and the delay of the
//! predecessor (`docs/theory/clocks.md`).

use super::line::median_of;

/// Least step that is believed, in ordinary steps, and the shortest ordinary step for that, nanoseconds.
const STEPS_LEAST: i64 = 4;
const SHORTEST: i64 = 5_000_000;
/// The least delay is forgotten by this part of the time, for clocks drift.
const FORGETTING: i64 = 1_000;
/// Longest step that is ordinary, nanoseconds.
const MOST_ORDINARY: i64 = 1_000_000_000;
/// Steps of which the ordinary one is the median, and how many must be known.
const STEPS: usize = 64;
const STEPS_KNOWN: u8 = 16;
/// Clocks that run alike are apart by this part of the time, and by this more, nanoseconds, which is delay.
const ALIKE: i64 = 16;
const APART: i64 = 500_000_000;
/// Most times a clock is set, and how many samples one more takes.
const MOST_SET: u64 = 20;
const SAMPLES_A_STEP: u64 = 500;

/// The stamp clock against the arrival clock so far: without delay.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub(crate) struct ClockSteps {
    /// Stamp and arrival of the sample before; the stamp without the steps so far.
    before: Option<(i64, i64)>,
    /// The same of the first sample.
    first: (i64, i64),
    /// Least arrival minus stamp.
    low: i64,
    /// Ordinary step, and the steps it is the median of until there are enough.
    step: i64,
    steps: Vec<i64>,
    known: u8,
    samples: u64,
    /// Steps that were taken off.
    set: u64,
}

impl ClockSteps {
    /// Takes the next sample in the order of time; `stamp` is without the steps so far. Returns by how much the clock
    /// was set before it, which is to be taken off this stamp and all after it.
    #[inline]
    pub(crate) fn push(&mut self, stamp: i64, arrival: i64) -> Option<i64> {
        let Some((s, l)) = self.before else {
            self.before = Some((stamp, arrival));
            self.first = (stamp, arrival);
            self.low = arrival.saturating_sub(stamp);
            return None;
        };
        let (ds, dl) = (stamp.saturating_sub(s), arrival.saturating_sub(l));
        if ds == 0 && dl == 0 {
            return None;
        }
        self.samples = self.samples.saturating_add(1);
        if self.known < STEPS as u8 && ds > 0 && ds <= MOST_ORDINARY {
            self.learn(ds);
        }
        self.low = self.low.saturating_add(dl.max(0) / FORGETTING);
        let mut jump = None;
        if self.known >= STEPS_KNOWN && dl >= 0 {
            let late = l.saturating_sub(s).saturating_sub(self.low).max(0);
            let least = STEPS_LEAST * self.step.max(SHORTEST);
            let is_ahead = ds > dl.saturating_add(late).saturating_add(least);
            let is_back = ds < 0 && ds.saturating_sub(self.step) < -least;
            if (is_ahead || is_back) && self.is_comparable(s, l) {
                self.set += 1;
                jump = Some(ds.saturating_sub(self.step));
            }
        }
        let stamp = stamp.saturating_sub(jump.unwrap_or(0));
        self.low = self.low.min(arrival.saturating_sub(stamp));
        self.before = Some((stamp, arrival));
        jump
    }

    /// Whether this can be: of what was read from outside.
    pub(crate) fn is_plausible(&self) -> bool {
        self.steps.len() < STEPS
            && (0..=MOST_ORDINARY).contains(&self.step)
            && self.steps.iter().all(|s| (0..=MOST_ORDINARY).contains(s))
    }

    #[cold]
    fn learn(&mut self, step: i64) {
        self.steps.push(step);
        self.known += 1;
        self.step = median_of(&mut self.steps.clone());
        if self.known >= STEPS as u8 {
            self.steps = Vec::new();
        }
    }

    /// Whether the two clocks ran alike until now, and not more was set than a clock is: those of a log that was written
    /// faster than it was recorded bound nothing.
    #[cold]
    fn is_comparable(&self, stamp: i64, arrival: i64) -> bool {
        let by_stamps = stamp.saturating_sub(self.first.0);
        let by_arrival = arrival.saturating_sub(self.first.1);
        let apart = by_stamps.saturating_sub(by_arrival).saturating_abs();
        // Nothing is known of delays before a second message has come.
        by_arrival > 0
            && by_stamps / 2 <= by_arrival
            && apart <= by_arrival / ALIKE + APART
            && self.set < MOST_SET + self.samples / SAMPLES_A_STEP
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const H: i64 = 5_000_000;

    /// Whole numbers below `top`, as the reference draws them.
    pub(in super::super) fn draws(seed: i64, top: i64) -> impl Iterator<Item = i64> {
        let mut x = seed;
        std::iter::repeat_with(move || {
            x = (1_103_515_245 * x + 12_345) % (1 << 31);
            x * top / (1 << 31)
        })
    }

    /// Stamps of an even sensor and their arrival, 2 to 10 ms later and in order.
    pub(in super::super) fn stream(n: i64) -> Vec<(i64, i64)> {
        let mut newest = 0;
        draws(7, 8_000_000)
            .take(n as usize)
            .enumerate()
            .map(|(i, late)| {
                let stamp = 1_650_000_000_000_000_000 + i as i64 * H;
                newest = (stamp + 2_000_000 + late).max(newest);
                (stamp, newest)
            })
            .collect()
    }

    /// Steps at their sample, and the stamps without them.
    fn followed(stream: &[(i64, i64)]) -> (Vec<(usize, i64)>, Vec<i64>) {
        let (mut clock, mut off) = (ClockSteps::default(), 0);
        let (mut steps, mut out) = (Vec::new(), Vec::new());
        for (i, (stamp, arrival)) in stream.iter().enumerate() {
            if let Some(jump) = clock.push(stamp - off, *arrival) {
                off += jump;
                steps.push((i, jump));
            }
            out.push(stamp - off);
        }
        (steps, out)
    }

    #[test]
    fn a_clock_that_was_set_goes_on_where_it_was() {
        let true_stream = stream(4000);
        let mut set = true_stream.clone();
        set[1500..2300].iter_mut().for_each(|s| s.0 += 300_000_000);
        let (steps, out) = followed(&set);
        assert_eq!(steps, [(1500, 300_000_000), (2300, -300_000_000)]);
        let stamps: Vec<i64> = true_stream.iter().map(|s| s.0).collect();
        assert_eq!(out, stamps);
    }

    #[test]
    fn missing_samples_drift_and_late_messages_are_no_steps() {
        let mut gap = stream(4000);
        gap.drain(1500..1560);
        let drift: Vec<_> = stream(4000)
            .into_iter()
            .map(|(s, l)| (s + (s - 1_650_000_000_000_000_000) / 100, l))
            .collect();
        // A link that stalls for 0.3 s, and then delivers at once.
        let mut stalls = stream(4000);
        for from in [900, 2000, 3100] {
            let at = stalls[from + 60].1;
            stalls[from..from + 60].iter_mut().for_each(|s| s.1 = at);
        }
        // A log written ten times as fast as it was recorded, with a gap in it.
        let fast: Vec<_> = gap.iter().map(|(s, l)| (*s, l / 10)).collect();
        // No log times, and one message with a hole in it.
        let none: Vec<_> = gap.iter().map(|(s, _)| (*s, 0)).collect();
        let mut packed = stream(100);
        packed.drain(40..60);
        packed
            .iter_mut()
            .for_each(|s| s.1 = 1_650_000_001_000_000_000);
        for stream in [gap, drift, stalls, fast, none, packed] {
            let (steps, out) = followed(&stream);
            assert_eq!(steps, []);
            assert!(out.iter().zip(&stream).all(|(out, s)| *out == s.0));
        }
    }

    #[test]
    fn a_clock_that_is_set_with_every_sample_is_left_alone_after_a_while() {
        let mut wild = stream(4000);
        for (i, sample) in wild.iter_mut().enumerate() {
            sample.0 += (i as i64 % 2) * 400_000_000;
        }
        let (steps, _) = followed(&wild);
        assert!(steps.len() < 40, "{}", steps.len());
    }
}
