//! All a conditioner needs to go on exactly <-> plain numbers. Pure.
//!
//! Apart from the conditioner because it is read by another process: nothing in it is believed
//! unseen. Samples that have left are not kept: whoever sends them again is told by the stamps.

use super::clock::IndexClock;
use super::gate::{Entry, HUGE_RATE, MAX_STAMP};
use super::rails::Rails;
use super::spacing::Steps;
use super::timing::Previous;
use super::{Conditioner, Report, State, order};
use crate::plausible::are_numbers;
use crate::record::{Nanos, RawSample, Verdict};

/// Most samples that wait for what follows them.
const MOST_WAITING: usize = 16;

/// State of a conditioner at one moment; [`Conditioner::recall`] restores it.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Memory {
    #[cfg_attr(feature = "serde", serde(flatten))]
    state: State,
    /// Stamp of the first sample where the clock counts samples.
    index_base: Option<Nanos>,
    #[cfg_attr(feature = "serde", serde(flatten))]
    order: order::State,
    /// Not older than the newest, but not yet timed.
    untimed: Vec<Entry>,
    previous: Option<Previous>,
    steps: Steps,
    first: Option<Nanos>,
    last: Option<Nanos>,
}

impl Memory {
    /// Whether a conditioner can have known it, whatever the settings.
    pub(crate) fn is_plausible(&self) -> bool {
        let (order, previous) = (&self.order, self.previous.as_slice());
        let stamps = [
            self.index_base,
            self.state.trimmed_from,
            order.high,
            order.floor,
            self.first,
            self.last,
        ];
        let entries = || order.suspects.iter().chain(&self.untimed);
        self.state.turns.is_plausible()
            && self.state.against_arrival.is_plausible()
            && self.state.rails.iter().all(Rails::is_plausible)
            && [self.state.set.0, self.state.set.1]
                .iter()
                .all(|set| (-MAX_STAMP..=MAX_STAMP).contains(set))
            && stamps
            .into_iter()
            .flatten()
            .chain(entries().map(|entry| entry.stamp))
            .chain(previous.iter().flat_map(|p| [p.stamp, p.start]))
            .all(|stamp| stamp.0.unsigned_abs() <= MAX_STAMP as u64)
            // That of the gate, between other axes.
            && entries().all(|entry| entry.value.amax() <= 2.0 * HUGE_RATE)
            && previous.iter().all(|p| are_numbers(&p.value))
    }

    /// The last stamp that was used.
    #[must_use]
    pub fn last(&self) -> Option<Nanos> {
        self.last
    }
}

impl Conditioner {
    /// Returns the state; `None` before the first sample, and while more of them wait than is worth keeping.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        let (order, untimed) = (self.order.state(), self.order.untimed());
        let waiting = untimed.len().max(order.suspects.len());
        if (self.batch_line.is_some() && self.window > 0)
            || !self.zeros.is_empty()
            || !self.primed
            || waiting > MOST_WAITING
        {
            return None;
        }
        Some(Memory {
            state: self.state.clone(),
            index_base: self.index_clock.as_ref().and_then(IndexClock::base),
            order: order.clone(),
            untimed: untimed.to_vec(),
            previous: self.timing.previous(),
            steps: self.timing.steps(),
            first: self.report.first,
            last: self.report.last,
        })
    }

    /// Goes on as the conditioner with the same settings would have that knew this. What was counted
    /// stays. `false`, and nothing has changed, when no conditioner can have known it.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        let can_be = memory.is_plausible()
            && memory.order.suspects.len().max(memory.untimed.len()) <= MOST_WAITING
            && memory
                .untimed
                .is_sorted_by_key(|entry| (entry.epoch, entry.stamp))
            && memory.state.index < u64::MAX / 4
            && memory.index_base.is_some() == self.index_clock.is_some();
        if !can_be || !self.timing.set_steps(&memory.steps) {
            return false;
        }
        if let (Some(clock), Some(base)) = (&mut self.index_clock, memory.index_base) {
            clock.count_from(base);
        }
        let rails = self.state.rails.take();
        self.state = memory.state.clone();
        // A file may be older than these.
        self.state.rails = rails.map(|fresh| memory.state.rails.unwrap_or(fresh));
        self.zeros.clear();
        self.primed = true;
        self.hold = self.window;
        self.order
            .recall(memory.order.clone(), memory.untimed.clone());
        self.timing.set_previous(memory.previous);
        if let (Some(line), Some(previous)) = (&mut self.batch_line, memory.previous) {
            line.begin_after(previous.stamp.0);
        }
        self.report.first = memory.first;
        self.report.last = memory.last;
        true
    }

    /// Begins as the run after one of which so much was counted.
    pub fn continue_counts_of(&mut self, counted: &Report) {
        self.report = counted.clone();
        self.report.first = None;
        self.report.last = None;
        self.report.spacing_nanos = None;
    }

    /// The stamp a sample has by the clock that is believed; `None` where it has none, or that clock
    /// reads no stamps. Zero is none but close to a clock's beginning, as `near` is.
    #[must_use]
    pub fn stamp_of(&self, raw: &RawSample, near: Nanos) -> Option<Nanos> {
        let is_one = |stamp: &Nanos| match stamp.0 {
            0 => near.0.abs() <= super::ZERO_IS_CLOSE_NANOS,
            stamp => stamp.unsigned_abs() <= MAX_STAMP as u64,
        };
        let stamp = self.clock.read(raw)?;
        Some(self.followed_near(stamp, near)).filter(is_one)
    }

    /// A sample came that its sender has sent before: it is counted, and nothing else.
    pub(crate) fn push_late(&mut self, stamp: Nanos) {
        self.report
            .note(Verdict::Late, self.state.index, Some(stamp));
    }
}

#[cfg(all(test, feature = "serde"))]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::condition::Settings;
    use crate::record::{RateSample, Status};

    #[test]
    fn what_is_remembered_goes_on_to_the_bit_and_the_keys_of_a_state_file_stay() {
        // Of every ten the sixth and the seventh come in the wrong order: a cut between them leaves one that waits.
        let place = |n: i64| match n % 10 {
            5 => n + 1,
            6 => n - 1,
            _ => n,
        };
        let raw = |n: i64| RawSample {
            header: Some(Nanos(1 + 1_000_000 * place(n))),
            gyro: Some([n as f64 * 1e-3, 0.1, 0.2]),
            accel: (n % 2 == 0).then_some([0.0, 0.0, 9.8]),
            ..RawSample::default()
        };
        let settings = Settings {
            reorder_window: Settings::LIVE_WINDOW,
            ..Settings::default()
        };
        let fresh = || Conditioner::new(&settings).unwrap();
        for cut in [3, 6, 7, 8, 40, 127] {
            let (mut whole, mut other) = (fresh(), fresh());
            let fed = |conditioner: &mut Conditioner, samples: std::ops::Range<i64>| {
                let mut out = Vec::new();
                conditioner.push(&samples.map(raw).collect::<Vec<_>>(), &mut out);
                out
            };
            let _ = fed(&mut whole, 0..cut);
            let memory = whole.memory().unwrap();
            let mut text = serde_json::to_value(&memory).unwrap();
            let again: Memory = serde_json::from_value(text.clone()).unwrap();
            assert_eq!(again, memory);
            assert!(other.recall(&again));
            assert_eq!(
                fed(&mut other, cut..200),
                fed(&mut whole, cut..200),
                "{cut}"
            );

            let keys: Vec<&String> = text.as_object().unwrap().keys().collect();
            let all = "against_arrival epoch first floor high index index_base last previous rails rejected set steps \
                       suspects trimmed_from turns untimed";
            assert_eq!(keys, all.split_whitespace().collect::<Vec<_>>());
            text["of_a_later_release"] = 1.into();
            assert!(serde_json::from_value::<Memory>(text).is_err());
        }
    }

    #[test]
    fn the_end_of_a_range_that_was_found_is_remembered() {
        let raw = |n: i64| {
            let shaken = 1e-3 * (n * 7919 % 1009) as f64 / 1009.0;
            let swing = 3.0 * (0.01 * (n - 30).max(0) as f64).sin() + shaken;
            RawSample {
                header: Some(Nanos(1 + 1_000_000 * n)),
                gyro: Some([swing.clamp(-2.0, 2.0), 1e-3 * n as f64, 0.2]),
                ..RawSample::default()
            }
        };
        let settings = Settings {
            reorder_window: 0,
            ..Settings::default()
        };
        let fresh = || Conditioner::new(&settings).unwrap();
        for cut in [40, 75, 300, 420, 900] {
            let (mut whole, mut other, mut older) = (fresh(), fresh(), fresh());
            let fed = |conditioner: &mut Conditioner, samples: std::ops::Range<i64>| {
                let mut out = Vec::new();
                conditioner.push(&samples.map(raw).collect::<Vec<_>>(), &mut out);
                out
            };
            let _ = fed(&mut whole, 0..cut);
            let mut text = serde_json::to_value(whole.memory().unwrap()).unwrap();
            assert!(other.recall(&serde_json::from_value(text.clone()).unwrap()));
            // A file of an older release has none: they are found anew.
            text.as_object_mut().unwrap().remove("rails");
            assert!(older.recall(&serde_json::from_value(text.clone()).unwrap()));
            assert!(older.state.rails.is_some());
            let next = fed(&mut whole, cut..1500);
            assert_eq!(fed(&mut other, cut..1500), next, "{cut}");
            let count = |out: &[RateSample]| {
                let is_saturated = |s: &&RateSample| s.status.has(Status::SATURATED);
                out.iter().filter(is_saturated).count()
            };
            assert!(count(&next) > 100);
            text["rails"] = serde_json::json!({"axes": []});
            assert!(serde_json::from_value::<Memory>(text).is_err());
        }
    }
}
