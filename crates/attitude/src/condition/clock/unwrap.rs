//! Stamps of a counter that wraps -> stamps that go on. Pure.
//!
//! A stage of its own because a counter that begins again looks like a clock that was set back, and only the numbers of
//! counters tell the two apart: a period of 16, 24, 30 (MicroPython), 31 or 32 bits, a day or a week, left near its top (`docs/theory/clocks.md`).

use super::line::median_of;

/// Units of counters, nanoseconds, and their names.
const UNITS: [(i64, &str); 5] = [
    (1, "ns"),
    (1_000, "us"),
    (10_000, "10 us"),
    (100_000, "0.1 ms"),
    (1_000_000, "ms"),
];
/// Widths of counters, bits.
const BITS: [u32; 5] = [16, 24, 30, 31, 32];
/// Periods of times of day and of GPS, nanoseconds.
const CALENDAR: [(i64, &str); 2] = [
    (86_400_000_000_000, "a day"),
    (604_800_000_000_000, "a week"),
];
/// Largest step across a wrap, nanoseconds.
const MOST_ACROSS: i64 = 1_000_000_000;
/// Samples after a wrap among which one from before it may still come.
const OVERTAKEN: u64 = 64;
/// Steps of which the ordinary one is the median.
const STEPS: usize = 64;
/// Stamps further than this from zero are no beginning of a counter: a zero amid them is no stamp.
const CLOSE_TO_ZERO: i64 = super::super::ZERO_IS_CLOSE_NANOS;

/// Period after which a counter begins again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Period {
    /// Length, nanoseconds.
    pub nanos: i64,
    /// Width in bits and name of the unit; `None` bits of a day or a week.
    counter: (Option<u32>, &'static str),
}

impl std::fmt::Display for Period {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.counter {
            (Some(bits), unit) => write!(f, "a counter of {bits} bits of {unit}"),
            (None, name) => write!(
                f,
                "a clock that begins anew every {}",
                name.trim_start_matches("a ")
            ),
        }
    }
}

/// Every period that a counter of stamps can have.
fn periods() -> impl Iterator<Item = Period> {
    let counters = UNITS.into_iter().flat_map(|(unit, name)| {
        BITS.into_iter().map(move |bits| Period {
            nanos: unit << bits,
            counter: (Some(bits), name),
        })
    });
    counters.chain(CALENDAR.into_iter().map(|(nanos, name)| Period {
        nanos,
        counter: (None, name),
    }))
}

/// Turns of a counter so far: one stamp in, one out, without delay.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub(crate) struct Turns {
    /// Sum of the periods so far, nanoseconds.
    add: i64,
    /// Period of the last wrap, nanoseconds; 0 before the first.
    period: i64,
    /// Stamps since the last wrap.
    since: u64,
    before: Option<i64>,
    /// Range of the stamps since the last wrap.
    range: (i64, i64),
    /// Ordinary step, nanoseconds; 0 while unknown.
    step: i64,
    /// First steps, until there are enough to tell the ordinary one.
    steps: Vec<i64>,
    /// Whether the ordinary step is final.
    is_settled: bool,
}

impl Turns {
    /// Returns `stamp` on the line of those before it, and the period of a wrap that it begins.
    #[inline]
    pub(crate) fn push(&mut self, stamp: i64) -> (i64, Option<Period>) {
        let Some(before) = self.before else {
            self.begin(stamp);
            return (stamp, None);
        };
        self.since = self.since.saturating_add(1);
        let step = stamp.saturating_sub(before);
        if self.period > 0 && self.since <= OVERTAKEN && is_within(step, self.period) {
            // Overtaken by the wrap: of the turn before.
            return (self.line_of(stamp).saturating_sub(self.period), None);
        }
        let mut wrap = None;
        if step < 0 {
            wrap = self.wrap_to(stamp, before);
            if stamp == 0 && wrap.is_none() && before.saturating_abs() > CLOSE_TO_ZERO {
                // No stamp at all.
                return (stamp, None);
            }
        } else if step > 0 && !self.is_settled {
            self.learn(step);
        }
        if let Some(period) = wrap {
            self.add = self.add.saturating_add(period.nanos);
            self.period = period.nanos;
            self.since = 0;
            self.range = (stamp, stamp);
        }
        self.before = Some(stamp);
        self.range = (self.range.0.min(stamp), self.range.1.max(stamp));
        (self.line_of(stamp), wrap)
    }

    /// The stamp of another stream by the same counter: on the turn on which it is nearest to `near`.
    pub(crate) fn near(&self, stamp: i64, near: i64) -> i64 {
        let here = self.line_of(stamp);
        if self.period == 0 {
            return here;
        }
        [-self.period, 0, self.period]
            .into_iter()
            .map(|turn| here.saturating_add(turn))
            .min_by_key(|at| at.saturating_sub(near).saturating_abs())
            .unwrap_or(here)
    }

    /// Whether these can have been counted: of what was read from outside.
    pub(crate) fn is_plausible(&self) -> bool {
        let most = i64::MAX / 4;
        let is_sane = |x: i64| (-most..=most).contains(&x);
        (0..=most).contains(&self.add)
            && (0..=most).contains(&self.period)
            && (0..=most).contains(&self.step)
            && self.before.is_none_or(|before| is_sane(before / 4))
            && is_sane(self.range.0 / 4)
            && is_sane(self.range.1 / 4)
            && self.steps.len() <= STEPS
    }

    fn begin(&mut self, stamp: i64) {
        if stamp != 0 {
            self.before = Some(stamp);
            self.range = (stamp, stamp);
        }
    }

    fn line_of(&self, stamp: i64) -> i64 {
        stamp.saturating_add(self.add)
    }

    #[cold]
    fn learn(&mut self, step: i64) {
        self.steps.push(step);
        self.step = median_of(&mut self.steps.clone());
        if self.steps.len() >= STEPS {
            self.is_settled = true;
            self.steps = Vec::new();
        }
    }

    /// The period by which `stamp` carries on from `before`.
    #[cold]
    fn wrap_to(&self, stamp: i64, before: i64) -> Option<Period> {
        let back = stamp.saturating_sub(before);
        let off = |on: i64| on.saturating_sub(self.step).saturating_abs();
        periods()
            .filter(|period| self.fits(stamp, before, period.nanos))
            .min_by_key(|period| off(back.saturating_add(period.nanos)))
    }

    fn fits(&self, stamp: i64, before: i64, period: i64) -> bool {
        let on = stamp.saturating_sub(before).saturating_add(period);
        let off = on.saturating_sub(self.step).saturating_abs();
        if stamp == 0 && (self.step == 0 || off > self.step / 2) {
            // Most zeros are no stamps: only one in its place is.
            return false;
        }
        let (low, high) = (self.range.0.min(stamp), self.range.1.max(stamp));
        let is_unsigned = low >= 0 && high < period;
        let is_signed = low >= -(period / 2) && high < period / 2;
        let top = if is_unsigned { period } else { period / 2 };
        let near_top = top
            .saturating_sub(MOST_ACROSS)
            .saturating_sub(self.step.saturating_mul(3));
        let is_full = before > near_top || high.saturating_sub(low) > period / 2;
        if (is_unsigned || is_signed) && is_full {
            on > 0 && on <= MOST_ACROSS.min(period / 4)
        } else {
            // Something had been added to the counter: only a step as all others are proves it.
            period >= 2 * MOST_ACROSS && self.step > 0 && off <= self.step / 4
        }
    }
}

/// Whether a step ahead is one back to the turn before.
fn is_within(step: i64, period: i64) -> bool {
    step.saturating_sub(period).saturating_abs() <= MOST_ACROSS.min(period / 4)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn counted(unit: i64, bits: u32, first: i64, is_signed: bool, n: i64) -> Vec<i64> {
        let step = 5_000_000 / unit;
        (0..n)
            .map(|i| {
                let count = (first + i * step).rem_euclid(1 << bits);
                let turned = is_signed && count >= 1 << (bits - 1);
                (count - if turned { 1 << bits } else { 0 }) * unit
            })
            .collect()
    }

    #[test]
    fn counters_of_every_width_go_on_where_they_wrap() {
        // Unit, bits, first count, signed; the sample of the wrap: `golden.json` of the reference has the same.
        let cases = [
            (1_000, 32, (1_i64 << 32) - 100_000, false, 20),
            (1_000, 24, (1 << 24) - 50_000, false, 10),
            (1, 32, (1 << 32) - 60_000_000, false, 12),
            (1_000_000, 16, 65_500, false, 8),
            (1_000, 32, (1 << 31) - 100_000, true, 20),
            // `ticks_us` of MicroPython; `micros() & 0x7fffffff`.
            (1_000, 30, (1 << 30) - 50_000, false, 10),
            (1_000, 31, (1 << 31) - 100_000, false, 20),
        ];
        for (unit, bits, first, is_signed, at) in cases {
            let mut turns = Turns::default();
            let mut wraps = Vec::new();
            for (i, stamp) in counted(unit, bits, first, is_signed, 60)
                .into_iter()
                .enumerate()
            {
                let (out, wrap) = turns.push(stamp);
                assert_eq!(
                    out,
                    (first * unit) + i as i64 * 5_000_000,
                    "{unit} {bits} {i}"
                );
                wraps.extend(wrap.map(|w| (i, w.nanos)));
            }
            assert_eq!(wraps, [(at, unit << bits)], "{unit} {bits}");
        }
    }

    #[test]
    fn a_clock_that_was_set_back_is_no_counter() {
        for back in [
            300_000_000,
            1_000_000_000,
            1_800_000_000_000,
            4_293_967_296_000,
        ] {
            let mut turns = Turns::default();
            for i in 0..60 {
                let set = if i >= 30 { back } else { 0 };
                let stamp = 1_650_000_000_000_000_000 + i * 5_000_000 - set;
                assert_eq!(turns.push(stamp), (stamp, None));
            }
        }
    }

    #[test]
    fn a_zero_amid_a_counter_is_no_wrap_and_one_at_its_wrap_is() {
        let period = 65_536_000_000;
        let mut turns = Turns::default();
        for i in 0..40 {
            turns.push(65_000_000_000 + i * 5_000_000);
        }
        assert_eq!(turns.push(0), (0, None));
        assert_eq!(turns.push(65_200_000_000), (65_200_000_000, None));
        for i in 1..68 {
            turns.push(65_200_000_000 + i * 5_000_000);
        }
        turns.push(65_531_000_000);
        let (out, wrap) = turns.push(0);
        assert_eq!((out, wrap.unwrap().nanos), (period, period));
    }

    #[test]
    fn a_sample_that_was_overtaken_by_the_wrap_is_of_the_turn_before() {
        let mut turns = Turns::default();
        let stamps = counted(1_000, 32, (1 << 32) - 100_000, false, 30);
        for stamp in &stamps[..18] {
            turns.push(*stamp);
        }
        let order = [19, 21, 20, 18, 22, 23];
        let first = ((1_i64 << 32) - 100_000) * 1_000;
        for i in order {
            let (out, _) = turns.push(stamps[i]);
            assert_eq!(out, first + i as i64 * 5_000_000, "{i}");
        }
    }
}
