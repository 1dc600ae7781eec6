//! Stamps as recorded -> stamps that go on where their counter wraps and where their clock was set. Pure.
//!
//! Apart from the rest of the conditioner because what is known of the clock is asked from outside, too: auxiliary
//! measurements and samples that are sent again have stamps of the same clock.

use super::clock::{BatchLine, BatchRate};
use super::gate::Entry;
use super::{Conditioner, timing};
use crate::record::{Nanos, RateSample, Verdict};

impl Conditioner {
    /// The stamp on the turn of its counter.
    #[inline]
    pub(super) fn followed(&mut self, stamp: Nanos) -> Nanos {
        let (followed, wrap) = self.state.turns.push(stamp.0);
        if let Some(period) = wrap {
            self.report.note_wrap(period, Nanos(followed));
        }
        Nanos(followed.saturating_sub(self.state.set.0))
    }

    /// Holds the next entry against its arrival: where the clock was set before it, this entry and all after it go on
    /// where it was.
    #[inline]
    pub(super) fn compare(&mut self) {
        let Some(entry) = self.order.line.get(self.order.cursor) else {
            return;
        };
        let (stamp, epoch) = (entry.stamp, entry.epoch);
        if let Some(jump) = self.state.against_arrival.push(stamp.0, entry.log.0) {
            self.go_on(jump, stamp, epoch);
        }
    }

    #[cold]
    fn go_on(&mut self, jump: i64, stamp: Nanos, epoch: u32) {
        self.order.rebase(jump);
        self.timing.join_epoch(epoch);
        self.state.set = (self.state.set.0.saturating_add(jump), jump);
        self.report.note_set(jump, stamp);
    }

    /// Samples from now on lie on the line of batches of this rate, behind those that have left.
    #[cold]
    pub(super) fn lie_on_line(&mut self, rate: &BatchRate) {
        if self.timing.coarse().is_some() {
            // Spread over its steps already.
            return;
        }
        let mut line = BatchLine::new(rate);
        if let Some(last) = self.timing.previous() {
            line.begin_after(last.stamp.0);
        }
        self.timing.expect(line.step());
        self.batch_line = Some(line);
        self.batch_learner = None;
        self.report.batches = Some(*rate);
    }

    /// A stamp of the same clock, of this stream or another of its sensor, as the samples of this one are stamped; of the
    /// turns of a counter the one that brings it nearest to `near`.
    #[must_use]
    pub fn followed_near(&self, stamp: Nanos, near: Nanos) -> Nanos {
        if !self.is_followed {
            return stamp;
        }
        let (all, last) = self.state.set;
        let near_as_recorded = near.0.saturating_add(all);
        let turned = self.state.turns.near(stamp.0, near_as_recorded);
        let now = Nanos(turned.saturating_sub(all));
        let before = Nanos(now.0.saturating_add(last));
        let off = |at: Nanos| at.since(near).saturating_abs();
        if off(before) < off(now) { before } else { now }
    }

    /// The stamp of an auxiliary measurement as the samples of this stream are stamped.
    pub(crate) fn of_auxiliary(&self, stamp: Nanos) -> Nanos {
        match self.order.high() {
            Some(newest) => self.followed_near(stamp, newest),
            None => stamp,
        }
    }

    /// Times one entry at a stamp that is not its own, with nothing to wait for.
    pub(super) fn time_one(&mut self, entry: Entry, at: Nanos, out: &mut Vec<RateSample>) {
        let sample = self.timing.one(&entry, at, &[], &mut self.report);
        if let Some(passed) = &mut self.passed {
            passed.take(&entry, &sample, out.len(), &self.timing, &mut self.report);
        }
        out.push(sample);
        match timing::verdict(entry.status) {
            Verdict::Accepted => self.report.counts.add(Verdict::Accepted),
            verdict => self.report.note(verdict, entry.index, Some(entry.stamp)),
        }
        self.order.timed(entry.stamp, entry.epoch);
        self.order.cursor += 1;
    }
}
