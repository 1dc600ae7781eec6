//! A step that is not the ordinary one -> the join over it, and the gap in the report. Pure.
//!
//! Apart from the timing because it is asked only where a sample seems to be missing, and looks ahead for one that is late.

use super::super::gate::Entry;
use super::super::report::{Gap, Report};
use super::super::settings::OnGap;
use super::{Previous, Timing};
use crate::record::{Join, Nanos, SampleKind};

/// Number of steps a late stamp may take to catch up.
/// Beyond a dozen steps a few percent of error in the ordinary step look like a sample.
const MAX_LOOK: usize = 12;

impl Timing {
    /// A step above the ordinary: missing samples, or a late stamp that its successors catch up with.
    #[cold]
    pub(super) fn judge_step(
        &self,
        entry: &Entry,
        step: i64,
        ahead: &[Entry],
        report: &mut Report,
    ) -> Join {
        let Some(previous) = self.previous else {
            return Join::Start;
        };
        // An increment covers its own interval: only what is before that is missing.
        let length = match self.kind {
            SampleKind::Rate => step,
            _ => step.saturating_sub(self.own_interval(entry)).max(0),
        };
        if length <= self.max_gap_nanos && self.is_caught_up(entry, previous.stamp, ahead) {
            return Join::Continuous;
        }
        let join = match self.on_gap {
            _ if length <= self.max_gap_nanos => Join::Bridge,
            OnGap::Bridge => Join::Bridge,
            OnGap::Hold => Join::Hold,
            OnGap::Reset => Join::Reset,
        };
        let missing = match self.spacing.nominal() {
            _ if entry.interval > 0 => rounded_ratio(length, entry.interval),
            Some(nominal) => rounded_ratio(step, nominal).saturating_sub(1),
            None => 0,
        };
        let rate = self.rate_of(&previous).max(self.entry_rate(entry));
        report.gaps.add(Gap {
            start: previous.stamp,
            length_nanos: length,
            join,
            missing,
            rotation_bound: rate * (length as f64 * 1e-9),
        });
        join
    }

    /// Whether the entries ahead arrive early by as much as this one is late: then nothing is
    /// missing, the stamp was delayed. The first of them (or a later one) must be where it would be had
    /// every sample since `before` taken its own interval.
    fn is_caught_up(&self, entry: &Entry, before: Nanos, ahead: &[Entry]) -> bool {
        if self.spacing.nominal().is_none() && entry.interval == 0 {
            return false;
        }
        let mut covered = self.own_interval(entry);
        let mut stamp = entry.stamp;
        for next in ahead.iter().take(MAX_LOOK) {
            if next.epoch != entry.epoch {
                return false;
            }
            let interval = self.own_interval(next);
            covered = covered.saturating_add(interval);
            // A sample that shares its stamp has none of its own: it proves nothing.
            let shares = next.stamp == stamp;
            stamp = next.stamp;
            if !shares && stamp.since(before) <= covered.saturating_add(interval / 4) {
                return true;
            }
        }
        false
    }

    #[cold]
    pub(super) fn jump_back(&self, stamp: Nanos, report: &mut Report) -> Join {
        let Some(previous) = self.previous else {
            return Join::Start;
        };
        let join = match self.on_gap {
            OnGap::Hold | OnGap::Bridge => Join::Hold,
            OnGap::Reset => Join::Reset,
        };
        report.gaps.add(Gap {
            start: previous.stamp,
            // A new epoch may begin later than the old one ended only through strays.
            length_nanos: stamp.since(previous.stamp).min(-1),
            join,
            missing: 0,
            rotation_bound: 0.0,
        });
        join
    }

    fn rate_of(&self, sample: &Previous) -> f64 {
        let secs = sample.stamp.secs_since(sample.start);
        match self.kind {
            SampleKind::Rate => sample.value.norm(),
            _ if secs > 0.0 => sample.value.norm() / secs,
            _ => 0.0,
        }
    }

    fn entry_rate(&self, entry: &Entry) -> f64 {
        match self.kind {
            SampleKind::Rate | SampleKind::Average => (entry.value - self.bias).norm(),
            SampleKind::DeltaAngle | SampleKind::Rotation => {
                let secs = self.own_interval(entry) as f64 * 1e-9;
                entry.value.norm() / secs
            }
        }
    }
}

/// `a / b` to the nearest whole number.
fn rounded_ratio(a: i64, b: i64) -> u64 {
    let b = b.max(1);
    let half_up = a.saturating_add(b / 2) / b;
    u64::try_from(half_up).unwrap_or(0)
}
