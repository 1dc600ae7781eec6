//! Stamps in the order they came -> whether they jump back and forth between two clocks. Pure.

use crate::record::Nanos;

/// Step of one clock at most, ns: two that are nearer than this are one by their stamps.
const STEP: i64 = 1_000_000_000;
/// Returns from one clock to the other before that is certain.
const RETURNS: u64 = 16;

/// The two clocks that stamps may come from.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Clocks {
    /// Last stamp of the clock of the newest sample, and of the other.
    now: Option<i64>,
    other: Option<i64>,
    returns: u64,
    first: Nanos,
}

impl Clocks {
    /// Takes the next stamp; returns the time between the clocks, the returns, and the first of these, once certain.
    #[inline]
    pub(super) fn take(&mut self, stamp: Nanos) -> Option<(i64, u64, Nanos)> {
        let now = *self.now.get_or_insert(stamp.0);
        if stamp.0.saturating_sub(now).saturating_abs() <= STEP {
            self.now = Some(stamp.0);
            return None;
        }
        self.jump(stamp, now)
    }

    #[cold]
    fn jump(&mut self, stamp: Nanos, now: i64) -> Option<(i64, u64, Nanos)> {
        let on = self.other.map(|other| stamp.0.saturating_sub(other));
        self.other = Some(now);
        self.now = Some(stamp.0);
        match on {
            // A clock goes on; a stamp that is always the same is none.
            Some(1..=STEP) => self.returns += 1,
            _ => self.returns = 0,
        }
        if self.returns == 1 {
            self.first = stamp;
        }
        let apart = stamp.0.saturating_sub(now).saturating_abs();
        (self.returns >= RETURNS).then_some((apart, self.returns, self.first))
    }
}
