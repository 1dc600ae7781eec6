//! Entries that share a stamp -> a stamp for each. Pure.
//!
//! Apart from the timing because it is about where there is room between stamps, whatever a sample means.

use super::super::gate::Entry;
use super::{LONE_INTERVAL_NANOS, Timing};
use crate::record::Nanos;

impl Timing {
    /// Stamps for entries that all carry the stamp of the first.
    ///
    /// Two real samples that collided on one stamp leave a longer step beside them: the later ones
    /// go into the step after, evenly, or else the earlier ones into the step before. Where
    /// there is no room, what is too many is dropped: the instant is known already. What a sample means
    /// plays no part in it.
    ///
    /// A coarse clock's samples lie in the step that begins with their stamp: the first ones of a stream
    /// at its end, for a recording begins anywhere in it, and the last ones no further than it reaches.
    pub(in crate::condition) fn place(&self, sharing: &[Entry], next: Option<Nanos>) -> Placement {
        let Some(first) = sharing.first() else {
            return Placement::alone(Nanos::default());
        };
        let at = first.stamp;
        let same_epoch = self.previous.filter(|p| p.epoch == first.epoch);
        // Live, the first of them has left the moment it came.
        let left = i64::from(same_epoch.is_some_and(|p| p.stamp >= at));
        let before = same_epoch.filter(|_| left == 0).map(|p| p.stamp);
        let n = sharing.len() as i64 + left;

        let room_before = before.map_or(0, |before| at.since(before));
        let room_after = next.map(|next| next.since(at)).or(self.coarse);
        let nominal = self.spacing.nominal().unwrap_or(match room_after {
            Some(room) => (room / n).max(1),
            None => LONE_INTERVAL_NANOS,
        });
        // Nothing lies further behind the end of a stream than one more step.
        let room_after = room_after.unwrap_or(nominal.saturating_mul(2));
        if let Some(quantum) = self.coarse
            && left == 0
            && next.is_some()
            && (before.is_none() || room_before > quantum.saturating_add(quantum / 2))
        {
            let room = room_after.min(quantum);
            let step = nominal.min(room / n).max(1);
            return Placement {
                from: Nanos(at.0.saturating_add((room - step.saturating_mul(n)).max(0))),
                step,
                keep: sharing.len(),
                original: at,
            };
        }
        if let (Some(step), Some(quantum), Some(before)) = (self.step, self.coarse, before) {
            return on_line(sharing.len(), (before, at), step, quantum);
        }
        let least = (nominal - nominal / 4).max(1);
        let most = nominal.saturating_add(nominal / 4);
        let spread = |room: i64, n: i64| match room / n {
            // More than enough: samples are missing as well, or the recording ends within the step; keep to
            // the ordinary one.
            step if step > most || (next.is_none() && step > nominal) => nominal,
            step => step,
        };
        let (keep, step, backwards) = if room_after / n >= least {
            (n, spread(room_after, n), false)
        } else if self.coarse.is_some() {
            // A rate that has risen: no clock but this one says how many there are. None was taken before its stamp.
            (n, room_after / n, false)
        } else if room_before / n >= least {
            (n, spread(room_before, n), true)
        } else {
            let keep = (room_after / least).clamp(1, n);
            (keep, spread(room_after, keep), false)
        };
        // Below one nanosecond apart there are no two instants.
        let keep = if step > 0 { keep } else { 1 };
        let from = if backwards {
            at.0.saturating_sub(step.saturating_mul(keep - 1))
        } else {
            at.0.saturating_add(step.saturating_mul(left))
        };
        Placement {
            from: Nanos(from),
            step,
            keep: (keep - left).max(0) as usize,
            original: at,
        }
    }
}

/// Places of `n` samples in the step of a coarse clock that begins `at`: the sensor's own steps go on from the sample
/// `before`. The first of a step of the clock lies within a step of the sensor of its beginning, and none beyond its end.
fn on_line(n: usize, (before, at): (Nanos, Nanos), step: i64, quantum: i64) -> Placement {
    let latest = at.0.saturating_add(step.saturating_sub(1).max(0));
    let from = before.0.saturating_add(step).clamp(at.0, latest);
    let last = at.0.saturating_add(quantum.saturating_sub(1));
    let between = i64::try_from(n).unwrap_or(i64::MAX).saturating_sub(1);
    let most = last.saturating_sub(from) / between.max(1);
    Placement {
        from: Nanos(from),
        step: step.min(most).max(1),
        keep: n,
        original: at,
    }
}

/// Places of samples that shared a stamp: `from`, `from + step`, ...; the first `keep` of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::condition) struct Placement {
    from: Nanos,
    step: i64,
    keep: usize,
    original: Nanos,
}

impl Placement {
    fn alone(at: Nanos) -> Self {
        Placement {
            from: at,
            step: 0,
            keep: 1,
            original: at,
        }
    }

    /// The stamp of the `i`-th, `None` when there is no room for it.
    pub(in crate::condition) fn stamp(&self, i: usize) -> Option<Nanos> {
        let after = self.step.saturating_mul(i64::try_from(i).ok()?);
        (i < self.keep).then_some(Nanos(self.from.0.saturating_add(after)))
    }

    /// Whether this stamp is other than the recorded one.
    pub(in crate::condition) fn moves(&self, stamp: Nanos) -> bool {
        stamp != self.original
    }
}
