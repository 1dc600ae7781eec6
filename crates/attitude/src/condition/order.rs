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
/// The same where nothing waits to be put in order: live, perhaps one of many sensors. A line of eight, and of those
/// that leave it stamp and digest are kept.
const COMPACT_LIVE_AT: usize = 7;
/// Number of kept entries at which the first are forgotten.
const FORGET_AT: usize = 96;
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

/// Entry that has left the line, as far as it is still known.
#[derive(Clone, Copy, Debug)]
struct Past {
    stamp: Nanos,
    digest: u64,
}

/// Puts entries in order within a bounded window.
#[derive(Clone, Debug)]
pub(super) struct Order {
    /// Live: those of the current epoch that came before the line, sorted.
    past: Vec<Past>,
    /// Sorted by (epoch, stamp), equal stamps in order of arrival. `..cursor` has been timed.
    pub(super) line: Vec<Entry>,
    pub(super) cursor: usize,
    /// Index in `line` where the current epoch begins.
    pub(super) epoch_from: usize,
    state: State,
    max_run: usize,
    max_gap_nanos: i64,
    /// Nothing waits to be put in order.
    is_live: bool,
    /// Samples share stamps because they came together: equal ones are no repeats.
    is_shared: bool,
}

/// State of an [`Order`] beside its line. A new field is added here alone, with `serde(default)`.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct State {
    pub(super) epoch: u32,
    /// Newest stamp of the current epoch.
    pub(super) high: Option<Nanos>,
    /// Last stamp given to a sample of the current epoch.
    pub(super) floor: Option<Nanos>,
    /// Older than `high`, in order of arrival.
    pub(super) suspects: Vec<Entry>,
}

impl Past {
    fn of(entry: &Entry) -> Past {
        // A multiplication and a shift a number: nobody gains by two samples of one stamp that are taken for one.
        let mix = |sum: u64, bits: u64| {
            let mixed = (sum ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            mixed ^ mixed >> 32
        };
        let values = entry.value.iter().chain(&entry.accel);
        let digest = values.map(|value| value.to_bits()).fold(0, mix);
        Past {
            stamp: entry.stamp,
            digest: mix(digest, entry.interval.cast_unsigned()),
        }
    }
}

impl Order {
    pub(super) fn new(window: usize, max_gap_nanos: i64, is_shared: bool) -> Self {
        Order {
            past: Vec::new(),
            line: Vec::new(),
            cursor: 0,
            epoch_from: 0,
            state: State::default(),
            max_run: window.max(MAX_RUN),
            max_gap_nanos,
            is_live: window == 0,
            is_shared,
        }
    }

    pub(super) fn high(&self) -> Option<Nanos> {
        self.state.high
    }

    pub(super) fn state(&self) -> &State {
        &self.state
    }

    /// Entries in the line that were not timed yet.
    pub(super) fn untimed(&self) -> &[Entry] {
        self.line.get(self.cursor..).unwrap_or_default()
    }

    /// Goes on from this state and these entries instead of its own.
    pub(super) fn recall(&mut self, state: State, untimed: Vec<Entry>) {
        let current = untimed.iter().position(|e| e.epoch == state.epoch);
        self.epoch_from = current.unwrap_or(untimed.len());
        self.cursor = 0;
        self.past.clear();
        self.line = untimed;
        self.state = state;
    }

    /// The sample of `epoch` that was timed last got this stamp: nothing can be put in before it.
    #[inline]
    pub(super) fn timed(&mut self, stamp: Nanos, epoch: u32) {
        if epoch == self.state.epoch {
            self.state.floor = Some(stamp);
        }
    }

    /// Takes `jump` off the stamps of the entries that were not timed yet: their clock was set by so much.
    #[cold]
    pub(super) fn rebase(&mut self, jump: i64) {
        let less = |stamp: &mut Nanos| stamp.0 = stamp.0.saturating_sub(jump);
        let untimed = self.line.iter_mut().skip(self.cursor);
        let waiting = untimed.chain(&mut self.state.suspects);
        waiting.for_each(|e| less(&mut e.stamp));
        self.state.high.iter_mut().for_each(less);
    }

    /// Takes the next entry; `spacing` is the ordinary step.
    #[inline(always)]
    pub(super) fn arrive(&mut self, entry: Entry, spacing: Option<i64>, report: &mut Report) {
        if self.state.suspects.is_empty() && self.state.high.is_none_or(|high| entry.stamp > high) {
            self.append(entry);
        } else {
            self.arrive_unordered(entry, spacing, report);
        }
    }

    #[inline(always)]
    fn append(&mut self, mut entry: Entry) {
        entry.epoch = self.state.epoch;
        self.state.high = Some(entry.stamp);
        let most = match self.is_live {
            true => COMPACT_LIVE_AT,
            false => COMPACT_AT,
        };
        if self.cursor >= most {
            self.compact();
        }
        self.line.push(entry);
    }

    #[cold]
    fn compact(&mut self) {
        let gone = if self.is_live {
            let gone = self.cursor.min(self.line.len());
            if self.past.len() + gone > FORGET_AT {
                let forgotten = self.past.len().saturating_sub(HISTORY);
                self.past.drain(..forgotten);
            }
            // Not doubled: there are many of these.
            self.past
                .reserve_exact(FORGET_AT.saturating_sub(self.past.len()));
            let of_epoch = self
                .line
                .drain(..gone)
                .filter(|e| e.epoch == self.state.epoch);
            self.past.extend(of_epoch.map(|e| Past::of(&e)));
            gone
        } else {
            let gone = self.cursor.saturating_sub(HISTORY);
            self.line.drain(..gone);
            gone
        };
        self.cursor -= gone;
        self.epoch_from = self.epoch_from.saturating_sub(gone);
    }

    #[cold]
    fn arrive_unordered(&mut self, entry: Entry, spacing: Option<i64>, report: &mut Report) {
        let Some(high) = self.state.high else {
            return self.append(entry);
        };
        if entry.stamp <= high && self.is_repeat(&entry) {
            return report.note(Verdict::Repeated, entry.index, Some(entry.stamp));
        }
        if self.state.suspects.is_empty() {
            if entry.stamp == high {
                if self.collisions_at(high) < MAX_COLLISION {
                    self.append(entry);
                } else {
                    report.note(Verdict::DuplicateStamp, entry.index, Some(entry.stamp));
                }
            } else {
                self.state.suspects.push(entry);
            }
        } else if entry.stamp <= high {
            self.state.suspects.push(entry);
            if self.state.suspects.len() > self.max_run {
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

    /// Ends the stream: no more entries come.
    pub(super) fn finish(&mut self, spacing: Option<i64>, report: &mut Report) {
        let misfits = self.misfits(spacing);
        if misfits >= MIN_RUN && misfits == self.state.suspects.len() {
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
        let (past, line) = self.sharing(entry.stamp);
        if self.is_shared || past.len() + line.len() >= TOO_COARSE {
            return false;
        }
        let digest = (!past.is_empty()).then(|| Past::of(entry).digest);
        if past.iter().any(|p| Some(p.digest) == digest) {
            return true;
        }
        line.iter()
            .chain(
                self.state
                    .suspects
                    .iter()
                    .filter(|e| e.stamp == entry.stamp),
            )
            .take(LOOKED_THROUGH)
            .any(|e| e.same_data(entry))
    }

    /// The entries of the current epoch that have this stamp.
    fn sharing(&self, stamp: Nanos) -> (&[Past], &[Entry]) {
        let (past, line) = (&self.past, self.current());
        let from = past.partition_point(|e| e.stamp < stamp);
        let to = past.partition_point(|e| e.stamp <= stamp);
        let past = past.get(from..to).unwrap_or_default();
        let from = line.partition_point(|e| e.stamp < stamp);
        let to = line.partition_point(|e| e.stamp <= stamp);
        (past, line.get(from..to).unwrap_or_default())
    }

    fn collisions_at(&self, stamp: Nanos) -> usize {
        let (past, line) = self.sharing(stamp);
        past.len() + line.len()
    }

    /// The stamps of the current epoch next to this one: at or before it, and after it.
    fn around(&self, stamp: Nanos) -> (Option<Nanos>, Option<Nanos>) {
        let (past, line) = (&self.past, self.current());
        let in_line = line.partition_point(|e| e.stamp <= stamp);
        let in_past = past.partition_point(|e| e.stamp <= stamp);
        let before = match in_line.checked_sub(1).and_then(|i| line.get(i)) {
            Some(entry) => Some(entry.stamp),
            None => in_past
                .checked_sub(1)
                .and_then(|i| past.get(i))
                .map(|p| p.stamp),
        };
        let after = match past.get(in_past) {
            Some(past) => Some(past.stamp),
            None => line.get(in_line).map(|e| e.stamp),
        };
        (before, after)
    }

    /// Suspects that no hole in the line was waiting for.
    fn misfits(&self, spacing: Option<i64>) -> usize {
        let hole = spacing.map_or(i64::MAX, |s| s.saturating_add(s / 2));
        let fits = |s: &Entry| {
            let (Some(before), Some(after)) = self.around(s.stamp) else {
                return false;
            };
            before < s.stamp && after.since(before) >= hole
        };
        self.state.suspects.iter().filter(|s| !fits(s)).count()
    }

    /// Whether a stream that reaches `next`, beyond `high`, carries on from the suspects.
    fn was_set_back(&self, next: Nanos, high: Nanos, spacing: Option<i64>) -> bool {
        let (Some(spacing), Some(suspect)) = (spacing, self.state.suspects.last()) else {
            return false;
        };
        let off = |from: Nanos| next.since(from).saturating_sub(spacing).saturating_abs();
        self.state.suspects.len() >= MIN_RUN
            && self.misfits(Some(spacing)) * 2 > self.state.suspects.len()
            && off(suspect.stamp) <= off(high)
    }

    /// Handles so many suspects in a row that the line is not coming back: the clock was set back, or
    /// what led the line astray was a few stray stamps at its end.
    fn resolve_long_run(&mut self, spacing: Option<i64>, report: &mut Report) {
        if let Some(strays) = self.strays_at_end() {
            for stray in self.line.split_off(self.line.len() - strays) {
                report.note(Verdict::StrayStamp, stray.index, Some(stray.stamp));
            }
            self.state.high = match self.current().last() {
                Some(entry) => Some(entry.stamp),
                None => self.past.last().map(|p| p.stamp),
            };
            for entry in std::mem::take(&mut self.state.suspects) {
                self.arrive(entry, spacing, report);
            }
        } else {
            self.begin_epoch(spacing, report);
        }
    }

    /// Number of entries at the end of the line, none of them timed yet, that leap ahead so that the
    /// suspects carry on from the entry before them.
    fn strays_at_end(&self) -> Option<usize> {
        let first = self.state.suspects.first()?.stamp;
        let untimed = self.line.get(self.cursor.max(self.epoch_from)..)?;
        (1..=untimed.len().min(MAX_STRAYS)).find(|strays| {
            let cut = self.line.len() - strays;
            let Some(stray) = self.line.get(cut) else {
                return false;
            };
            let leap = |from: Nanos| stray.stamp.since(from) > self.max_gap_nanos;
            let before = match cut.checked_sub(1).filter(|i| *i >= self.epoch_from) {
                Some(before) => self.line.get(before).map(|e| e.stamp),
                None => self.past.last().map(|p| p.stamp),
            };
            match before {
                Some(before) => {
                    let step = first.since(before);
                    step > 0 && step <= self.max_gap_nanos && leap(before)
                }
                // Nothing but the stray in this epoch: the suspects are the stream.
                None => *strays == 1 && self.state.epoch == 0 && leap(first),
            }
        })
    }

    /// The clock was set back: the line so far is complete, the suspects begin a new epoch.
    fn begin_epoch(&mut self, spacing: Option<i64>, report: &mut Report) {
        self.state.epoch = self.state.epoch.wrapping_add(1);
        self.epoch_from = self.line.len();
        self.past.clear();
        self.state.high = None;
        self.state.floor = None;
        for entry in std::mem::take(&mut self.state.suspects) {
            self.arrive(entry, spacing, report);
        }
    }

    /// The suspects were overtaken: each goes to its place, unless time has passed it.
    fn put_back(&mut self, report: &mut Report) {
        for mut entry in std::mem::take(&mut self.state.suspects) {
            if self.state.floor.is_some_and(|floor| entry.stamp <= floor) {
                report.note(Verdict::Late, entry.index, Some(entry.stamp));
            } else if self.collisions_at(entry.stamp) >= MAX_COLLISION {
                report.note(Verdict::DuplicateStamp, entry.index, Some(entry.stamp));
            } else {
                entry.epoch = self.state.epoch;
                entry.status = entry.status.with(Status::REORDERED);
                let from = self.cursor.max(self.epoch_from);
                let untimed = self.line.get(from..).unwrap_or_default();
                let at = from + untimed.partition_point(|e| e.stamp <= entry.stamp);
                self.line.insert(at, entry);
            }
        }
    }
}

#[cfg(test)]
mod tests;
