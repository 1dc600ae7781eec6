//! RawSample -> RateSample. Pure.
//!
//! A stage of its own because everything that can be wrong with a recorded sample is settled
//! here, once, with a counted [`Verdict`]: unit, axes, bias; which clock; NaN and nonsense;
//! disorder, shared stamps, jumps, gaps. Behind it every number is finite, stamps increase
//! strictly, and no interval crosses a place where time is unknown.
//!
//! ```text
//! RawSample -> gate (one sample alone) -> order (in time) -> spikes -> timing (interval, join) -> RateSample
//! RateSample -> stillness (rests: bias, level)         RawSample -> quality (what `info` prints)
//! RawSample -> truncation (did the driver cut?), rails (was an axis clipped?)
//! behind the gate, in the order samples come: mixture (two sensors?), unit_change (another unit from here on?)
//! ```
//!
//! # Policy
//! | seen | done | verdict |
//! |---|---|---|
//! | NaN or infinity in the gyro; above 4e4 rad/s (1e3 rad) | dropped; the next sample carries `REJECTED_BEFORE` | `NotFinite`, `Huge` |
//! | NaN in the acceleration | the acceleration alone is dropped | `Accepted` |
//! | same stamp, same data (also when sent again later) | dropped, nothing is lost | `Repeated` |
//! | same stamp, other data | given a stamp inside the longer step after it, or else before it | `Restamped` |
//! | ... and no longer step beside it | dropped | `DuplicateStamp` |
//! | several on every stamp: a coarse clock | spread over its step, equal ones too, the first ones at the end of theirs | `Restamped` |
//! | overtaken on its way, by no more than the window | put back | `Reordered` |
//! | ... by more | dropped | `Late` |
//! | a counter wraps (16, 24, 30, 31, 32 bits, a day, a week) | stamps go on, counted and shown | `Accepted` |
//! | clock set ahead or back, by the arrival clock | stamps go on where they were, counted and shown | `Accepted` |
//! | clock set back, and it stays so | held (or reset), integration goes on behind it | `Accepted` |
//! | one stamp far ahead, the rest carries on before it | dropped | `StrayStamp` |
//! | no stamp, or zero amid others | dropped | `NoStamp` |
//! | a stamp more than 146 years from the epoch | dropped | `FarStamp` |
//! | stamped when a batch came (recordings) | spread evenly, at the rate of the batches | `Accepted` |
//! | step above 1.5 times the ordinary | bridged up to `max_gap_secs`, beyond it `on_gap` | `Accepted` |
//! | ... but the stamps catch up | a late stamp, not a gap | `Accepted` |
//! | one to three rates far off the line between their neighbours | replaced by that line, `REPAIRED`; live, what has left is taken back | `Accepted` |
//!
//! The ordinary step is learnt from the stream. An increment whose predecessor is missing covers its own
//! interval only, so `start` is later than the stamp before, and the propagator fills the hole.
//! An increment that states its own interval keeps it for its angle; where stamps and
//! intervals disagree by less than half an interval, the stamps are taken to jitter.
//!
//! Long because the policy of the whole room stands in its head, and because it is one machine: an entry that leaves the
//! line goes through spikes, timing and counts in one loop, which every stage can stop.

mod broken;
mod clock;
mod follow;
mod frozen;
mod gate;
mod histogram;
mod lone_zeros;
mod memory;
mod mixture;
mod order;
pub(crate) mod rails;
mod repairs;
mod report;
mod settings;
mod spacing;
pub(crate) mod spikes;
mod timing;
mod unit_change;
mod wrapped;

pub mod quality;
pub mod regularise;
pub mod stillness;
pub mod truncation;

pub use crate::record::GyroUnit;
pub use clock::{
    ArrivalClock, ArrivalReport, BatchRate, Batches, Clock, ClockSpeed, ClockWarning, CoarseClock,
    MOST_ARRIVALS, Period, Sharing, SpeedPass, SpeedVerdict, batches, choose_clock,
    choose_clock_as, sharing,
};
pub use histogram::Histogram;
pub use lone_zeros::LoneZeros;
pub use memory::Memory;
pub use mixture::{Apart, Mixture};
pub use rails::{Clipped, Rails};
pub use repairs::{SpikePolicy, StampRepair};
pub use report::{ClockSet, FirstBad, GAPS_KEPT, Gap, Gaps, Report, Wraps};
pub(crate) use settings::{LONGEST_SECS, MAX_GAP_SECS, SAMPLE_RATES};
pub use settings::{OnGap, Settings, SettingsError};
pub use spikes::SpikeCount;
pub use unit_change::{ACCEL_UNITS, GYRO_UNITS, UnitChange, UnitChanges};

use crate::record::{Nanos, RateSample, RawSample, SampleKind, Status, Verdict};
use clock::{BatchLearner, BatchLine, ClockSteps, IndexClock, Turns};
use gate::{Gate, MAX_STAMP};
use mixture::MixtureWatch;
use order::Order;
use spikes::Spikes;
use spikes::passed::Passed;
pub(crate) use spikes::passed::{Revised, Revision};
use timing::Timing;
use unit_change::UnitWatch;

/// Entries from which the ordinary step is learnt before the first sample leaves (recordings).
const PRIMING: usize = 32;
/// Entries held at most until the ordinary step of a coarse clock is learnt.
const COARSE_PRIMING: usize = 1 << 15;
/// A stamp of zero is taken for a stamp only where the clock is within this of zero.
const ZERO_IS_CLOSE_NANOS: i64 = 10_000_000_000;
/// Most samples with a stamp of zero that wait: those of a second at 1 kHz, where the clock counts seconds.
const MOST_ZEROS: usize = 1000;

/// One stream's conditioning: push blocks, cut anywhere, and finish.
///
/// The output depends on the samples and the settings alone, not on how they were cut into blocks.
#[derive(Clone, Debug)]
pub struct Conditioner {
    clock: Clock,
    index_clock: Option<IndexClock>,
    gate: Gate,
    order: Order,
    /// `None` where spikes are left, and where no sample waits for its successors.
    spikes: Option<Spikes>,
    timing: Timing,
    window: usize,
    /// Entries held back just now: the window, or more until the ordinary step is known.
    hold: usize,
    primed: bool,
    finishing: bool,
    /// `--start`, `--until` in nanoseconds after the first stamp.
    trim: Option<(i64, i64)>,
    /// Turns of a counter are followed.
    is_followed: bool,
    /// Stamps are held against their arrival.
    is_compared: bool,
    /// Line on which samples of batches lie.
    batch_line: Option<BatchLine>,
    /// Looks for batches in a stream of which nothing waits.
    batch_learner: Option<BatchLearner>,
    /// Looks for spikes in the samples that have left, where none waits for its successors.
    passed: Option<Passed>,
    /// Look for two sensors in one stream, and for units that change; whether values are rates.
    mixture: MixtureWatch,
    units: UnitWatch,
    is_rate: bool,
    /// First samples with stamp zero, until another stamp tells whether that can be.
    zeros: Vec<(RawSample, u64)>,
    state: State,
    report: Report,
}

/// State of a [`Conditioner`] beside those of its stages. A new field is added here alone, with `serde(default)`.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct State {
    /// Number of samples so far.
    index: u64,
    /// Stamp that `start` and `until` are counted from.
    trimmed_from: Option<Nanos>,
    /// Whether the sample before was dropped.
    rejected: bool,
    /// Turns of the counter that the stamps are read from.
    #[cfg_attr(feature = "serde", serde(default))]
    turns: Turns,
    /// The stamp clock against the arrival clock.
    #[cfg_attr(feature = "serde", serde(default))]
    against_arrival: ClockSteps,
    /// Nanoseconds by which the stamp clock was set so far, and the last time.
    #[cfg_attr(feature = "serde", serde(default))]
    set: (i64, i64),
    /// Ends of the gyro's range that nobody states, where no sample waits.
    #[cfg_attr(feature = "serde", serde(default))]
    rails: Option<Rails>,
}

impl Conditioner {
    /// A conditioner for one stream.
    ///
    /// # Errors
    /// [`SettingsError`] when a setting cannot be; the text names the flag.
    pub fn new(settings: &Settings) -> Result<Self, SettingsError> {
        settings.validate()?;
        let max_gap_nanos = secs_to_nanos(settings.max_gap_secs);
        let window = settings.reorder_window;
        let batch_line = settings.batches.as_ref().map(BatchLine::new);
        let is_followed =
            settings.repair == StampRepair::Auto && !matches!(settings.clock, Clock::Index { .. });
        let is_rate = matches!(settings.kind, SampleKind::Rate | SampleKind::Average);
        let is_live = is_followed && is_rate && window == 0;
        let mut timing = Timing::new(settings, max_gap_nanos);
        if let Some(line) = &batch_line {
            timing.expect(line.step());
        }
        Ok(Conditioner {
            clock: settings.clock,
            index_clock: match settings.clock {
                Clock::Index { rate_hz } => Some(IndexClock::new(rate_hz)),
                _ => None,
            },
            gate: Gate::new(settings),
            order: Order::new(
                window,
                max_gap_nanos,
                batch_line.is_some() || settings.coarse.is_some(),
            ),
            spikes: Spikes::of(settings),
            timing,
            window,
            hold: match (window, settings.kind) {
                (0, SampleKind::Rate) => 0,
                // The first increment has no interval until the second has come.
                (0, _) => 1,
                (window, _) if settings.coarse.is_some() => window,
                (window, _) => window.max(PRIMING),
            },
            primed: batch_line.is_some() || settings.coarse.is_some(),
            batch_learner: (is_live && batch_line.is_none()).then(BatchLearner::default),
            passed: Passed::of(settings),
            mixture: MixtureWatch::new(is_rate),
            units: UnitWatch::default(),
            is_rate,
            batch_line,
            finishing: false,
            trim: (settings.start.is_some() || settings.until.is_some()).then(|| {
                (
                    settings.start.map_or(i64::MIN, secs_to_nanos),
                    settings.until.map_or(i64::MAX, secs_to_nanos),
                )
            }),
            is_followed,
            is_compared: settings.repair == StampRepair::Auto
                && settings.has_arrival
                && matches!(settings.clock, Clock::Header),
            zeros: Vec::new(),
            state: State {
                rails: (is_rate && window == 0 && settings.gyro_range.is_none()).then(Rails::new),
                ..State::default()
            },
            report: Report::of_batches(settings.batches.filter(|_| window == 0)),
        })
    }

    /// Conditions `raw`, the next samples of the stream, and appends what is ready to `out`.
    pub fn push(&mut self, raw: &[RawSample], out: &mut Vec<RateSample>) {
        out.reserve(raw.len());
        for sample in raw {
            self.take(sample, out);
        }
        self.report.spacing_nanos = self.timing.spacing();
        self.report.coarse_nanos = self.timing.coarse();
    }

    /// `n` payloads that could not be decoded stood here in the stream.
    ///
    /// Not the same as leaving them out: they are counted, the next sample says so, and
    /// [`Clock::Index`] gives them their time.
    pub fn push_undecodable(&mut self, n: u64) {
        if n > 0 {
            self.report
                .note(Verdict::Undecodable, self.state.index, None);
            self.report.counts.add_many(Verdict::Undecodable, n - 1);
            self.state.index = self.state.index.saturating_add(n);
            self.state.rejected = true;
        }
    }

    /// The stream has ended: appends what was held back. Later samples continue it.
    pub fn finish(&mut self, out: &mut Vec<RateSample>) {
        for (_, index) in std::mem::take(&mut self.zeros) {
            self.report.note(Verdict::NoStamp, index, Some(Nanos(0)));
        }
        self.order.finish(self.timing.spacing(), &mut self.report);
        self.finishing = true;
        self.drain(out);
        self.finishing = false;
        self.report.spacing_nanos = self.timing.spacing();
        self.report.coarse_nanos = self.timing.coarse();
    }

    /// Somebody can go back to what was before a spike, and takes [`Conditioner::revisions`] for that.
    pub(crate) fn keep_revisions(&mut self) {
        self.passed.iter_mut().for_each(Passed::keep_revisions);
    }

    /// Judgements of samples that have left, since the last call.
    #[inline]
    pub(crate) fn revisions(&mut self) -> Vec<Revised> {
        self.passed
            .as_mut()
            .map(Passed::revisions)
            .unwrap_or_default()
    }

    /// Counts so many spikes as left, which were to be repaired: there was no state to go back to.
    pub(crate) fn leave_spikes(&mut self, samples: u64) {
        let (repaired, left) = (&mut self.report.spikes, &mut self.report.spikes_left);
        let first = left.first.or(repaired.first);
        repaired.samples = repaired.samples.saturating_sub(samples);
        left.samples += samples;
        (left.first, left.largest) = (first, left.largest.max(repaired.largest));
    }

    /// Outcome of the samples so far; those held back have no verdict yet.
    #[must_use]
    pub fn report(&self) -> &Report {
        &self.report
    }

    #[inline]
    fn take(&mut self, raw: &RawSample, out: &mut Vec<RateSample>) {
        let index = self.state.index;
        self.state.index += 1;
        let stamp = match &mut self.index_clock {
            None => self.clock.read(raw),
            Some(clock) => Some(clock.stamp(index, raw.log)),
        };
        match stamp {
            Some(stamp) if stamp.0.unsigned_abs() <= MAX_STAMP as u64 => {
                self.mixture.take_stamp(stamp, &mut self.report.mixture);
                let stamp = match self.is_followed {
                    true => self.followed(stamp),
                    false => stamp,
                };
                if stamp.0.unsigned_abs() > MAX_STAMP as u64 {
                    return self.reject(Verdict::FarStamp, index, Some(stamp));
                }
                if (stamp.0 == 0 || !self.zeros.is_empty())
                    && self.index_clock.is_none()
                    && self.is_zero_in_doubt(raw, stamp, index, out)
                {
                    return;
                }
                self.pass(raw, stamp, index, out);
            }
            Some(_) => self.reject(Verdict::FarStamp, index, stamp),
            None => self.reject(Verdict::NoStamp, index, None),
        }
    }

    #[inline]
    fn pass(&mut self, raw: &RawSample, stamp: Nanos, index: u64, out: &mut Vec<RateSample>) {
        if let Some((start, until)) = self.trim {
            let first = *self.state.trimmed_from.get_or_insert(stamp);
            if !(start..=until).contains(&stamp.since(first)) {
                return self.report.note(Verdict::Trimmed, index, Some(stamp));
            }
        }
        let spacing = self.timing.spacing();
        match self.gate.pass(raw, stamp, index, spacing) {
            Ok(mut entry) => {
                if let (Some(rails), Some(gyro)) = (&mut self.state.rails, &raw.gyro)
                    && rails.push_and_judge(gyro, self.gate.rad())
                {
                    entry.status = entry.status.with(Status::SATURATED);
                }
                if self.state.rejected {
                    self.state.rejected = false;
                    entry.status = entry.status.with(Status::REJECTED_BEFORE);
                }
                if raw.accel.is_some() && gate::finite_accel(&entry.accel).is_none() {
                    self.report.accel_dropped += 1;
                }
                self.mixture.take(&entry, &mut self.report.mixture);
                self.units
                    .take(&entry, self.is_rate, &mut self.report.unit_changes);
                if let Some(learner) = &mut self.batch_learner
                    && let Some(rate) = learner.push(entry.stamp.0, entry.value.into())
                {
                    self.lie_on_line(&rate);
                }
                self.order.arrive(entry, spacing, &mut self.report);
                self.drain(out);
            }
            Err(verdict) => self.reject(verdict, index, Some(stamp)),
        }
    }

    /// A zero stamp is no stamp, unless the clock really begins there: the first samples with one wait for another
    /// stamp, since a coarse clock says zero several times. Says whether the sample has been dealt with.
    #[cold]
    fn is_zero_in_doubt(
        &mut self,
        raw: &RawSample,
        stamp: Nanos,
        index: u64,
        out: &mut Vec<RateSample>,
    ) -> bool {
        if stamp.0 != 0 {
            for (zero, zero_index) in std::mem::take(&mut self.zeros) {
                if stamp.0.abs() <= ZERO_IS_CLOSE_NANOS {
                    self.pass(&zero, Nanos(0), zero_index, out);
                } else {
                    self.reject(Verdict::NoStamp, zero_index, Some(Nanos(0)));
                }
            }
            return false;
        }
        match self.order.high() {
            Some(high) if high.0.abs() <= ZERO_IS_CLOSE_NANOS => return false,
            None if self.zeros.len() < MOST_ZEROS => self.zeros.push((*raw, index)),
            _ => self.reject(Verdict::NoStamp, index, Some(stamp)),
        }
        true
    }

    #[cold]
    fn reject(&mut self, verdict: Verdict, index: u64, stamp: Option<Nanos>) {
        self.report.note(verdict, index, stamp);
        self.state.rejected = true;
    }

    /// Times every entry that need not wait any longer.
    #[inline]
    fn drain(&mut self, out: &mut Vec<RateSample>) {
        loop {
            let line = self.order.line.as_slice();
            let i = self.order.cursor;
            let limit = if self.finishing {
                line.len()
            } else {
                let held = line.len().saturating_sub(self.hold);
                held.max(self.order.epoch_from)
            };
            if i >= limit {
                return;
            }
            if !self.primed {
                let may_wait = self.window > 0 && !self.finishing && self.order.epoch_from == 0;
                if may_wait && line.len() < COARSE_PRIMING && Timing::needs_more(line) {
                    // Twice as many: looking again and again costs no more than looking once.
                    self.hold = line.len().saturating_mul(2);
                    return;
                }
                self.primed = true;
                self.hold = self.window;
                if self.window > 0 || line.len() > 1 {
                    self.timing.prime(line);
                }
                continue;
            }
            if self.is_compared {
                self.compare();
            }
            let line = self.order.line.as_slice();
            let Some((entry, ahead)) = line.get(i..).and_then(<[_]>::split_first) else {
                return;
            };
            if let Some(batch_line) = &mut self.batch_line {
                let at = Nanos(batch_line.push(entry.stamp.0));
                let repaired = self.spikes.as_mut().and_then(|spikes| {
                    let steps = (self.timing.spacing(), self.timing.coarse());
                    spikes.repaired(entry, ahead, steps, &mut self.report)
                });
                let entry = repaired.unwrap_or(*entry);
                self.time_one(entry, at, out);
                continue;
            }
            let is_alone = match ahead.first() {
                Some(next) => next.stamp != entry.stamp || next.epoch != entry.epoch,
                // The end, or live: nothing to wait for.
                None => true,
            };
            // The first of a coarse clock's may be the only one of its step that was recorded.
            let is_first = self.timing.coarse().is_some() && self.timing.is_first(entry);
            let is_spread = is_first || self.timing.is_on_line();
            if !is_alone || is_spread || self.timing.has_passed(entry) {
                if self.drain_shared(out) {
                    continue;
                }
                return;
            }
            let (stamp, epoch) = (entry.stamp, entry.epoch);
            let repaired = self.spikes.as_mut().and_then(|spikes| {
                let steps = (self.timing.spacing(), self.timing.coarse());
                spikes.repaired(entry, ahead, steps, &mut self.report)
            });
            let entry = repaired.as_ref().unwrap_or(entry);
            let sample = self.timing.one(entry, stamp, ahead, &mut self.report);
            if let Some(passed) = &mut self.passed {
                passed.take(entry, &sample, out.len(), &self.timing, &mut self.report);
            }
            out.push(sample);
            match timing::verdict(entry.status) {
                Verdict::Accepted => self.report.counts.add(Verdict::Accepted),
                verdict => self.report.note(verdict, entry.index, Some(stamp)),
            }
            self.order.timed(stamp, epoch);
            self.order.cursor += 1;
        }
    }

    /// Times the entries at the cursor that share one stamp, once it is known what follows them.
    /// Says whether it could.
    #[cold]
    fn drain_shared(&mut self, out: &mut Vec<RateSample>) -> bool {
        let line = self.order.line.as_slice();
        let Some(first) = line.get(self.order.cursor).copied() else {
            return false;
        };
        // Sorted by stamp: nothing follows them yet.
        if !self.finishing
            && line
                .last()
                .is_some_and(|last| last.stamp == first.stamp && last.epoch == first.epoch)
        {
            return false;
        }
        let rest = line.get(self.order.cursor..).unwrap_or_default();
        let n = rest
            .iter()
            .take_while(|e| e.stamp == first.stamp && e.epoch == first.epoch)
            .count();
        let (sharing, ahead) = rest.split_at(n);
        if ahead.is_empty() && !self.finishing {
            return false;
        }
        let next = ahead.first().filter(|next| next.epoch == first.epoch);
        let placement = self.timing.place(sharing, next.map(|next| next.stamp));
        let mut last = None;
        for (i, entry) in sharing.iter().enumerate() {
            // Never an instant that has passed, whatever was put back in between.
            let at = placement.stamp(i).filter(|at| {
                let placed = gate::Entry {
                    stamp: *at,
                    ..*entry
                };
                !self.timing.has_passed(&placed)
            });
            let Some(at) = at else {
                self.report
                    .note(Verdict::DuplicateStamp, entry.index, Some(entry.stamp));
                continue;
            };
            let following = rest.get(i + 1..).unwrap_or_default();
            let repaired = self.spikes.as_mut().and_then(|spikes| {
                let steps = (self.timing.spacing(), self.timing.coarse());
                spikes.repaired(entry, following, steps, &mut self.report)
            });
            let mut entry = repaired.unwrap_or(*entry);
            if placement.moves(at) {
                entry.status = entry.status.with(Status::RESTAMPED);
            }
            let sample = self.timing.one(&entry, at, ahead, &mut self.report);
            if let Some(passed) = &mut self.passed {
                passed.take(&entry, &sample, out.len(), &self.timing, &mut self.report);
            }
            out.push(sample);
            match timing::verdict(entry.status) {
                Verdict::Accepted => self.report.counts.add(Verdict::Accepted),
                verdict => self.report.note(verdict, entry.index, Some(entry.stamp)),
            }
            last = Some(at);
        }
        if let Some(last) = last {
            self.order.timed(last, first.epoch);
        }
        self.order.cursor += n;
        true
    }
}

/// Seconds to whole nanoseconds, saturating.
fn secs_to_nanos(secs: f64) -> i64 {
    (secs * 1e9).round() as i64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn what_has_left_is_forgotten_but_for_a_short_history() {
        for window in [Settings::LIVE_WINDOW, Settings::REPLAY_WINDOW] {
            let settings = Settings {
                reorder_window: window,
                ..Settings::default()
            };
            let mut conditioner = Conditioner::new(&settings).unwrap();
            let mut out = Vec::new();
            for n in 0..20_000 {
                let raw = RawSample {
                    header: Some(Nanos(1 + n * 1_000_000)),
                    gyro: Some([n as f64 * 1e-6, 0.0, 0.0]),
                    ..RawSample::default()
                };
                conditioner.push(&[raw], &mut out);
                assert!(conditioner.order.line.len() <= 1024 + 64);
            }
        }
    }
}
