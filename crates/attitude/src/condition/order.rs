//! Entries as they arrive -> entries in time order, cut into epochs. Pure.
//!
//! A stage of its own because of one question that needs hindsight: a stamp older than the
//! newest is either a sample that was overtaken on its way, or a clock that was set back. Put
//! back in place, the second would interleave two stretches of motion; taken for a new epoch,
//! the first would stop the integration. So such samples wait as *suspects* until what follows
//! decides: the stream carries on from the newest stamp (overtaken), or from the suspects (set back).

use super::gate::Entry;
use super::report::Report;
use crate::record::{Nanos, Status, Verdict};

/// Released entries kept, so that data sent a second time is recognised.
const HISTORY: usize = 64;
/// Released entries after which the line is shortened.
const COMPACT_AT: usize = 1024;
/// The same where nothing waits to be put in order: live, perhaps one of many sensors.
const COMPACT_LIVE_AT: usize = 96;
/// Samples with one and the same stamp that are told apart: a second of the fastest gyros, on a clock
/// that counts whole seconds. A stuck clock makes no more.
const MAX_COLLISION: usize = 8192;
/// Samples with one stamp that data sent a second time is looked for among.
const LOOKED_THROUGH: usize = 64;
/// Different measurements on one stamp after which equal ones are no repeats: the clock is too coarse to
/// tell.
const TOO_COARSE: usize = 3;
/// Fewest suspects that can prove a clock set back. Two samples mistaken for overtaken ones
/// cost two intervals; a set-back clock mistaken from two jittery stamps would cost an attitude reset.
const MIN_RUN: usize = 3;
/// Fewest suspects at which the wait ends in favour of a set-back clock.
const MAX_RUN: usize = 8;
/// Longest run of stray stamps that is recognised.
const MAX_STRAYS: usize = 3;

/// Puts entries in order within a bounded window.
#[derive(Clone, Debug)]
pub(super) struct Order {
    /// Sorted by (epoch, stamp), equal stamps in order of arrival. `..cursor` has been timed.
    pub(super) line: Vec<Entry>,
    pub(super) cursor: usize,
    /// Where the current epoch begins in `line`.
    pub(super) epoch_from: usize,
    epoch: u32,
    /// Newest stamp of the current epoch.
    high: Option<Nanos>,
    /// Older than `high`, in order of arrival.
    suspects: Vec<Entry>,
    /// Last stamp given to a sample of the current epoch.
    floor: Option<Nanos>,
    max_run: usize,
    max_gap_nanos: i64,
    compact_at: usize,
}

impl Order {
    pub(super) fn new(window: usize, max_gap_nanos: i64) -> Self {
        Order {
            line: Vec::new(),
            cursor: 0,
            epoch_from: 0,
            epoch: 0,
            high: None,
            suspects: Vec::new(),
            floor: None,
            max_run: window.max(MAX_RUN),
            max_gap_nanos,
            compact_at: if window == 0 {
                COMPACT_LIVE_AT
            } else {
                COMPACT_AT
            },
        }
    }

    pub(super) fn high(&self) -> Option<Nanos> {
        self.high
    }

    pub(super) fn epoch(&self) -> u32 {
        self.epoch
    }

    pub(super) fn floor(&self) -> Option<Nanos> {
        self.floor
    }

    pub(super) fn suspects(&self) -> &[Entry] {
        &self.suspects
    }

    /// Entries in the line that were not timed yet.
    pub(super) fn untimed(&self) -> &[Entry] {
        self.line.get(self.cursor..).unwrap_or_default()
    }

    /// Goes on with these in place of what there was.
    pub(super) fn recall(
        &mut self,
        untimed: Vec<Entry>,
        suspects: Vec<Entry>,
        epoch: u32,
        high: Option<Nanos>,
        floor: Option<Nanos>,
    ) {
        let current = untimed.iter().position(|e| e.epoch == epoch);
        self.epoch_from = current.unwrap_or(untimed.len());
        self.cursor = 0;
        self.line = untimed;
        (self.suspects, self.epoch) = (suspects, epoch);
        (self.high, self.floor) = (high, floor);
    }

    /// The sample of `epoch` that was timed last got this stamp: nothing can be put in before it.
    #[inline]
    pub(super) fn timed(&mut self, stamp: Nanos, epoch: u32) {
        if epoch == self.epoch {
            self.floor = Some(stamp);
        }
    }

    /// Takes the next entry; `spacing` is the ordinary step.
    #[inline(always)]
    pub(super) fn arrive(&mut self, entry: Entry, spacing: Option<i64>, report: &mut Report) {
        if self.suspects.is_empty() && self.high.is_none_or(|high| entry.stamp > high) {
            self.append(entry);
        } else {
            self.arrive_unordered(entry, spacing, report);
        }
    }

    #[inline(always)]
    fn append(&mut self, mut entry: Entry) {
        entry.epoch = self.epoch;
        self.high = Some(entry.stamp);
        if self.cursor >= self.compact_at {
            self.compact();
        }
        self.line.push(entry);
    }

    #[cold]
    fn compact(&mut self) {
        let gone = self.cursor.saturating_sub(HISTORY);
        self.line.drain(..gone);
        self.cursor -= gone;
        self.epoch_from = self.epoch_from.saturating_sub(gone);
    }

    #[cold]
    fn arrive_unordered(&mut self, entry: Entry, spacing: Option<i64>, report: &mut Report) {
        let Some(high) = self.high else {
            return self.append(entry);
        };
        if entry.stamp <= high && self.is_repeat(&entry) {
            return report.note(Verdict::Repeated, entry.index, Some(entry.stamp));
        }
        if self.suspects.is_empty() {
            if entry.stamp == high {
                if self.collisions_at(high) < MAX_COLLISION {
                    self.append(entry);
                } else {
                    report.note(Verdict::DuplicateStamp, entry.index, Some(entry.stamp));
                }
            } else {
                self.suspects.push(entry);
            }
        } else if entry.stamp <= high {
            self.suspects.push(entry);
            if self.suspects.len() > self.max_run {
                self.resolve_long_run(spacing, report);
            }
        } else if self.was_set_back(entry.stamp, high, spacing) {
            self.begin_epoch(spacing, report);
            self.arrive(entry, spacing, report);
        } else {
            self.put_back(report);
            self.arrive(entry, spacing, report);
        }
    }

    /// No more entries will come.
    pub(super) fn finish(&mut self, spacing: Option<i64>, report: &mut Report) {
        let misfits = self.misfits(spacing);
        if misfits >= MIN_RUN && misfits == self.suspects.len() {
            self.begin_epoch(spacing, report);
        }
        // In the new epoch there can be overtaken samples again.
        self.put_back(report);
    }

    fn current(&self) -> &[Entry] {
        self.line.get(self.epoch_from..).unwrap_or_default()
    }

    /// Whether the current epoch holds this very measurement at this very stamp.
    fn is_repeat(&self, entry: &Entry) -> bool {
        let sharing = self.sharing(entry.stamp);
        if sharing.len() >= TOO_COARSE {
            return false;
        }
        sharing
            .iter()
            .chain(self.suspects.iter().filter(|e| e.stamp == entry.stamp))
            .take(LOOKED_THROUGH)
            .any(|e| e.same_data(entry))
    }

    /// The entries of the current epoch that have this stamp.
    fn sharing(&self, stamp: Nanos) -> &[Entry] {
        let line = self.current();
        let from = line.partition_point(|e| e.stamp < stamp);
        let to = line.partition_point(|e| e.stamp <= stamp);
        line.get(from..to).unwrap_or_default()
    }

    fn collisions_at(&self, stamp: Nanos) -> usize {
        self.sharing(stamp).len()
    }

    /// Suspects that no hole in the line was waiting for.
    fn misfits(&self, spacing: Option<i64>) -> usize {
        let line = self.current();
        let hole = spacing.map_or(i64::MAX, |s| s.saturating_add(s / 2));
        let fits = |s: &Entry| {
            let after = line.partition_point(|e| e.stamp <= s.stamp);
            let (Some(before), Some(after)) = (
                after.checked_sub(1).and_then(|i| line.get(i)),
                line.get(after),
            ) else {
                return false;
            };
            before.stamp < s.stamp && after.stamp.since(before.stamp) >= hole
        };
        self.suspects.iter().filter(|s| !fits(s)).count()
    }

    /// Whether a stream that reaches `next`, beyond `high`, carries on from the suspects.
    fn was_set_back(&self, next: Nanos, high: Nanos, spacing: Option<i64>) -> bool {
        let (Some(spacing), Some(suspect)) = (spacing, self.suspects.last()) else {
            return false;
        };
        let off = |from: Nanos| next.since(from).saturating_sub(spacing).saturating_abs();
        self.suspects.len() >= MIN_RUN
            && self.misfits(Some(spacing)) * 2 > self.suspects.len()
            && off(suspect.stamp) <= off(high)
    }

    /// So many suspects in a row that the line is not coming back: the clock was set back, or
    /// what led the line astray was a few stray stamps at its end.
    fn resolve_long_run(&mut self, spacing: Option<i64>, report: &mut Report) {
        if let Some(strays) = self.strays_at_end() {
            for stray in self.line.split_off(self.line.len() - strays) {
                report.note(Verdict::StrayStamp, stray.index, Some(stray.stamp));
            }
            self.high = self.current().last().map(|e| e.stamp);
            for entry in std::mem::take(&mut self.suspects) {
                self.arrive(entry, spacing, report);
            }
        } else {
            self.begin_epoch(spacing, report);
        }
    }

    /// How many entries at the end of the line, none of them timed yet, leap ahead so that the
    /// suspects carry on from the entry before them.
    fn strays_at_end(&self) -> Option<usize> {
        let first = self.suspects.first()?.stamp;
        let untimed = self.line.get(self.cursor.max(self.epoch_from)..)?;
        (1..=untimed.len().min(MAX_STRAYS)).find(|strays| {
            let cut = self.line.len() - strays;
            let Some(stray) = self.line.get(cut) else {
                return false;
            };
            let leap = |from: Nanos| stray.stamp.since(from) > self.max_gap_nanos;
            match cut.checked_sub(1).filter(|i| *i >= self.epoch_from) {
                Some(before) => self.line.get(before).is_some_and(|before| {
                    let step = first.since(before.stamp);
                    step > 0 && step <= self.max_gap_nanos && leap(before.stamp)
                }),
                // Nothing but the stray in this epoch: the suspects are the stream.
                None => *strays == 1 && self.epoch == 0 && leap(first),
            }
        })
    }

    /// The clock was set back: the line so far is complete, the suspects begin a new epoch.
    fn begin_epoch(&mut self, spacing: Option<i64>, report: &mut Report) {
        self.epoch = self.epoch.wrapping_add(1);
        self.epoch_from = self.line.len();
        self.high = None;
        self.floor = None;
        for entry in std::mem::take(&mut self.suspects) {
            self.arrive(entry, spacing, report);
        }
    }

    /// The suspects were overtaken: each goes to its place, unless time has passed it.
    fn put_back(&mut self, report: &mut Report) {
        for mut entry in std::mem::take(&mut self.suspects) {
            if self.floor.is_some_and(|floor| entry.stamp <= floor) {
                report.note(Verdict::Late, entry.index, Some(entry.stamp));
            } else if self.collisions_at(entry.stamp) >= MAX_COLLISION {
                report.note(Verdict::DuplicateStamp, entry.index, Some(entry.stamp));
            } else {
                entry.epoch = self.epoch;
                entry.status = entry.status.with(Status::REORDERED);
                let from = self.cursor.max(self.epoch_from);
                let untimed = self.line.get(from..).unwrap_or_default();
                let at = from + untimed.partition_point(|e| e.stamp <= entry.stamp);
                self.line.insert(at, entry);
            }
        }
    }
}
