//! Counts of what happened to a stream. Pure.
//!
//! A stage of its own because bad data never ends a run: this is where it is accounted for, in
//! bounded memory, with the first case of each kind kept so that a message can point at it.

use super::clock::{BatchRate, Period};
use super::mixture::Mixture;
use super::spikes::SpikeCount;
use super::unit_change::UnitChanges;
use crate::record::{Counts, Join, Nanos, Verdict};

/// Number of gaps kept one by one; all are counted.
pub const GAPS_KEPT: usize = 1000;

/// One place where samples are missing.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gap {
    /// The last instant before it that is covered.
    pub start: Nanos,
    /// Nanoseconds not covered. Negative where a clock jumped back: the time lost is unknown.
    pub length_nanos: i64,
    /// Treatment: [`Join::Bridge`], [`Join::Hold`] or [`Join::Reset`].
    pub join: Join,
    /// Number of missing samples, from the ordinary spacing; 0 where that is unknown.
    pub missing: u64,
    /// Rotation that can have happened unseen, rad: the larger of the rates on both edges times
    /// the length (0 where the clock jumped back). A bound as long as the motion in the gap was
    /// not faster than at its edges.
    pub rotation_bound: f64,
}

/// Every gap of a stream.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Gaps {
    /// Number of gaps.
    pub count: u64,
    /// Number of these that were held or reset, not bridged.
    pub not_bridged: u64,
    /// Number of times the clock jumped back (each counted in `count` and `not_bridged` too).
    pub jumps_back: u64,
    /// Samples missing in all gaps together.
    pub missing: u64,
    /// Nanoseconds in all gaps together (jumps back add nothing).
    pub total_nanos: i64,
    /// The longest, nanoseconds.
    pub longest_nanos: i64,
    /// Sum of all jumps back of the clock, nanoseconds.
    pub back_nanos: i64,
    /// Nanoseconds in those that were not bridged, together and in the longest.
    pub not_bridged_nanos: (i64, i64),
    /// Sum of the rotation bounds, rad.
    pub rotation_bound: f64,
    /// The first [`GAPS_KEPT`].
    pub kept: Vec<Gap>,
}

impl Gaps {
    pub(super) fn add(&mut self, gap: Gap) {
        self.count += 1;
        self.not_bridged += u64::from(gap.join != Join::Bridge);
        self.jumps_back += u64::from(gap.length_nanos < 0);
        self.missing = self.missing.saturating_add(gap.missing);
        self.total_nanos = self.total_nanos.saturating_add(gap.length_nanos.max(0));
        let back = gap.length_nanos.min(0).saturating_abs();
        self.back_nanos = self.back_nanos.saturating_add(back);
        self.longest_nanos = self.longest_nanos.max(gap.length_nanos);
        if gap.join != Join::Bridge {
            let (total, longest) = &mut self.not_bridged_nanos;
            *total = total.saturating_add(gap.length_nanos.max(0));
            *longest = (*longest).max(gap.length_nanos);
        }
        self.rotation_bound += gap.rotation_bound;
        if self.kept.len() < GAPS_KEPT {
            self.kept.push(gap);
        }
    }
}

/// The first sample that got a verdict other than accepted.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FirstBad {
    /// Number of samples before it in the stream.
    pub index: u64,
    /// Stamp, if it had one.
    pub stamp: Option<Nanos>,
}

/// Wraps of the counter that the stamps are read from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Wraps {
    /// Number of wraps.
    pub count: u64,
    /// Period of the last one.
    pub period: Period,
    /// Stamp, on the line of those before it, with which the first turn ended.
    pub first: Nanos,
}

/// Steps of the stamp clock, which the arrival clock did not make.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ClockSet {
    /// Number of steps.
    pub count: u64,
    /// Largest of them, nanoseconds; positive: ahead.
    pub largest_nanos: i64,
    /// Recorded stamp behind the first, less the steps before it.
    pub first: Nanos,
}

impl Wraps {
    /// Wraps with one more after `before`.
    pub(super) fn after(before: Option<Wraps>, period: Period, at: Nanos) -> Wraps {
        Wraps {
            count: before.map_or(1, |wraps| wraps.count.saturating_add(1)),
            period,
            first: before.map_or(at, |wraps| wraps.first),
        }
    }
}

/// Outcome of a stream.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Report {
    /// Exactly one verdict per sample.
    pub counts: Counts,
    /// Missing samples and jumps.
    pub gaps: Gaps,
    /// Used samples with a component at or beyond the stated range.
    pub saturated: u64,
    /// Samples with a good gyro whose acceleration was not finite and was left out.
    pub accel_dropped: u64,
    /// Spikes that were repaired.
    pub spikes: SpikeCount,
    /// Spikes that had left when what came behind them showed them, and were not taken back.
    pub spikes_left: SpikeCount,
    /// Forces that were glitches of the accelerometer alone, and were left out.
    pub force_spikes: SpikeCount,
    /// Two sensors that take turns in the stream; `None` where there is one.
    pub mixture: Option<Mixture>,
    /// Units that changed on the way.
    pub unit_changes: UnitChanges,
    /// The ordinary spacing, nanoseconds; `None` until two samples were used.
    pub spacing_nanos: Option<i64>,
    /// The step of the clock, nanoseconds, where it is coarser than the sensor's: its samples were spread
    /// over it.
    pub coarse_nanos: Option<i64>,
    /// Wraps of the counter behind the stamps, which went on; `None` where there were none.
    pub wraps: Option<Wraps>,
    /// Steps of the stamp clock by the arrival clock, taken off; `None` where there were none.
    pub clock_set: Option<ClockSet>,
    /// Rate of batches that were found, or known, in a live stream, and spread evenly.
    pub batches: Option<BatchRate>,
    /// Stamp of the first sample used.
    pub first: Option<Nanos>,
    /// Stamp of the last sample used so far.
    pub last: Option<Nanos>,
    first_bad: [Option<FirstBad>; Verdict::ALL.len()],
}

impl Report {
    /// Report of a stream whose batches are known before its first sample.
    pub(super) fn of_batches(batches: Option<BatchRate>) -> Report {
        Report {
            batches,
            ..Report::default()
        }
    }

    /// Nanoseconds from the first sample used to the last, as if the clock had never jumped back.
    #[must_use]
    pub fn duration_nanos(&self) -> i64 {
        let span = self.first.zip(self.last);
        let span = span.map_or(0, |(first, last)| last.0.saturating_sub(first.0));
        span.saturating_add(self.gaps.back_nanos)
    }

    /// The first sample that got this verdict; `None` for [`Verdict::Accepted`] and where there was none.
    #[must_use]
    pub fn first_bad(&self, verdict: Verdict) -> Option<FirstBad> {
        self.first_bad.get(verdict as usize).copied().flatten()
    }

    /// Samples that shared their stamp with another: repeats, those given a stamp of their own,
    /// and those dropped.
    #[must_use]
    pub fn duplicates(&self) -> u64 {
        [
            Verdict::Repeated,
            Verdict::Restamped,
            Verdict::DuplicateStamp,
        ]
        .into_iter()
        .map(|v| self.counts.get(v))
        .sum()
    }

    #[cold]
    pub(super) fn note_wrap(&mut self, period: Period, at: Nanos) {
        self.wraps = Some(Wraps::after(self.wraps, period, at));
    }

    #[cold]
    pub(super) fn note_set(&mut self, jump: i64, at: Nanos) {
        let set = self.clock_set.get_or_insert(ClockSet {
            count: 0,
            largest_nanos: 0,
            first: at,
        });
        set.count = set.count.saturating_add(1);
        if jump.saturating_abs() > set.largest_nanos.saturating_abs() {
            set.largest_nanos = jump;
        }
    }

    #[cold]
    pub(super) fn note(&mut self, verdict: Verdict, index: u64, stamp: Option<Nanos>) {
        self.counts.add(verdict);
        if let Some(slot) = self.first_bad.get_mut(verdict as usize) {
            slot.get_or_insert(FirstBad { index, stamp });
        }
    }
}
