//! Entries in time order -> RateSample: intervals, gaps, shared stamps. Pure.
//!
//! A stage of its own because this is where stamps become time: from here on a sample covers an
//! interval, says whether something before it is missing, and never shares its instant.

use super::gate::{Entry, finite_accel};
use super::report::{Gap, Report};
use super::settings::{OnGap, Settings};
use super::spacing::{Spacing, Steps};
use crate::record::{Join, Nanos, RateSample, SampleKind, Status, Verdict};
use nalgebra::Vector3;

/// Interval of a lone increment that says nothing of its own: only its mean rate depends on it.
const LONE_INTERVAL_NANOS: i64 = 10_000_000;
/// How many steps a late stamp may take to catch up.
/// Beyond a dozen steps a few percent of error in the ordinary step look like a sample.
const MAX_LOOK: usize = 12;

/// The sample before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Previous {
    pub(super) stamp: Nanos,
    pub(super) start: Nanos,
    pub(super) value: Vector3<f64>,
    pub(super) epoch: u32,
}

/// Gives every entry its interval and its join.
#[derive(Clone, Debug)]
pub(super) struct Timing {
    kind: SampleKind,
    bias: Vector3<f64>,
    max_gap_nanos: i64,
    on_gap: OnGap,
    spacing: Spacing,
    previous: Option<Previous>,
}

impl Timing {
    pub(super) fn new(settings: &Settings, max_gap_nanos: i64) -> Self {
        Timing {
            kind: settings.kind,
            bias: settings.bias,
            max_gap_nanos,
            on_gap: settings.on_gap,
            spacing: Spacing::new(max_gap_nanos),
            previous: None,
        }
    }

    #[inline]
    pub(super) fn spacing(&self) -> Option<i64> {
        self.spacing.nominal()
    }

    pub(super) fn previous(&self) -> Option<Previous> {
        self.previous
    }

    pub(super) fn set_previous(&mut self, previous: Option<Previous>) {
        self.previous = previous;
    }

    /// What is known of the ordinary step.
    pub(super) fn steps(&self) -> Steps {
        self.spacing.steps()
    }

    /// Whether that can be known; it is from now on.
    pub(super) fn set_steps(&mut self, steps: &Steps) -> bool {
        self.spacing.set_steps(steps)
    }

    /// Learns the ordinary step from the first entries, before any of them is timed.
    pub(super) fn prime(&mut self, line: &[Entry]) {
        let mut steps = Vec::with_capacity(line.len());
        let mut sharing = 1;
        for pair in line.windows(2) {
            let [a, b] = pair else { continue };
            let step = b.stamp.since(a.stamp);
            if a.epoch != b.epoch {
                sharing = 1;
            } else if step == 0 {
                sharing += 1;
            } else {
                // n samples on one stamp and then a step are n samples in that step.
                steps.extend(std::iter::repeat_n(step / sharing, sharing as usize));
                sharing = 1;
            }
        }
        self.spacing.prime(&mut steps);
    }

    /// Whether a sample with this stamp or a later one has left already in this epoch.
    #[inline]
    pub(super) fn has_passed(&self, entry: &Entry) -> bool {
        self.previous
            .is_some_and(|p| p.epoch == entry.epoch && p.stamp >= entry.stamp)
    }

    /// Times one entry at `stamp`; `ahead` are the entries after it, as far as they are known.
    #[inline(always)]
    pub(super) fn one(
        &mut self,
        entry: &Entry,
        stamp: Nanos,
        ahead: &[Entry],
        report: &mut Report,
    ) -> RateSample {
        let mut join = Join::Continuous;
        let mut before = None;
        match &self.previous {
            Some(p) if p.epoch == entry.epoch => {
                before = Some(p.stamp);
                let step = stamp.since(p.stamp);
                let ordinary = if entry.interval > 0 {
                    entry.interval.saturating_add(entry.interval / 2)
                } else {
                    self.spacing.limit()
                };
                if step > ordinary {
                    join = self.judge_step(entry, step, ahead, report);
                }
            }
            Some(_) => join = self.jump_back(stamp, report),
            None => {
                join = Join::Start;
                report.first = Some(stamp);
            }
        }
        let (start, value) = self.integrate(entry, stamp, join, before);
        if let Some(before) = before {
            // Only now: the gap and the interval after it must be judged by the same spacing.
            self.spacing.push(stamp.since(before));
        }
        let mut status = entry.status;
        match join {
            Join::Start | Join::Continuous => {}
            Join::Bridge => status = status.with(Status::BRIDGED),
            Join::Hold => status = status.with(Status::HELD),
            Join::Reset => status = status.with(Status::RESET),
        }
        self.previous = Some(Previous {
            stamp,
            start,
            value,
            epoch: entry.epoch,
        });
        report.saturated += u64::from(status.has(Status::SATURATED));
        report.last = Some(stamp);
        RateSample {
            stamp,
            start,
            value,
            accel: finite_accel(&entry.accel),
            join,
            status,
            log: entry.log,
        }
    }

    /// Start of the interval and what was turned in it (for rates: the stamp, and the rate).
    #[inline(always)]
    fn integrate(
        &self,
        entry: &Entry,
        stamp: Nanos,
        join: Join,
        before: Option<Nanos>,
    ) -> (Nanos, Vector3<f64>) {
        if self.kind == SampleKind::Rate {
            return (stamp, entry.value - self.bias);
        }
        let start = match (join, before) {
            (Join::Continuous, Some(before)) => before,
            _ => {
                let own = Nanos(stamp.0.saturating_sub(self.own_interval(entry)));
                // Never across the sample before.
                before.map_or(own, |before| own.max(before))
            }
        };
        let interval = if entry.interval > 0 {
            // The sensor's own clock measured this; the stamps merely carried it.
            entry.interval
        } else {
            stamp.since(start)
        };
        let secs = interval as f64 * 1e-9;
        let angle = match self.kind {
            SampleKind::DeltaAngle => entry.value - self.bias * secs,
            SampleKind::Rate | SampleKind::Average => (entry.value - self.bias) * secs,
        };
        (start, angle)
    }

    /// How long one increment lasts when its predecessor does not say.
    fn own_interval(&self, entry: &Entry) -> i64 {
        if entry.interval > 0 {
            entry.interval
        } else {
            self.spacing.nominal().unwrap_or(LONE_INTERVAL_NANOS)
        }
    }

    /// A step above the ordinary: missing samples, or a late stamp that its successors catch up with.
    #[cold]
    fn judge_step(&self, entry: &Entry, step: i64, ahead: &[Entry], report: &mut Report) -> Join {
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
    fn jump_back(&self, stamp: Nanos, report: &mut Report) -> Join {
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
            SampleKind::DeltaAngle => {
                let secs = self.own_interval(entry) as f64 * 1e-9;
                entry.value.norm() / secs
            }
        }
    }

    /// Stamps for entries that all carry the stamp of the first.
    ///
    /// Two real samples that collided on one stamp leave a longer step beside them: the later ones
    /// go into the step after, evenly, or else the earlier ones into the step before. Where
    /// there is no room, a rate too many is dropped (the instant is known already; a rate at
    /// half the spacing tells nothing more); an increment is never dropped, its rotation was turned: the
    /// wider side is shared evenly, so that time is conserved.
    pub(super) fn place(&self, sharing: &[Entry], next: Option<Nanos>) -> Placement {
        let Some(first) = sharing.first() else {
            return Placement::alone(Nanos::default());
        };
        let at = first.stamp;
        let same_epoch = self.previous.filter(|p| p.epoch == first.epoch);
        // Live, the first of them has left the moment it came.
        let left = i64::from(same_epoch.is_some_and(|p| p.stamp >= at));
        let before = same_epoch.filter(|_| left == 0).map(|p| p.stamp);
        let n = sharing.len() as i64 + left;

        let room_after = next.map_or(i64::MAX, |next| next.since(at));
        let room_before = before.map_or(0, |before| at.since(before));
        let nominal = self.spacing.nominal().unwrap_or(match next {
            Some(_) => (room_after / n).max(1),
            None => LONE_INTERVAL_NANOS,
        });
        let least = (nominal - nominal / 4).max(1);
        let most = nominal.saturating_add(nominal / 4);
        let spread = |room: i64, n: i64| match room / n {
            // More than enough: samples are missing as well; keep to the ordinary step.
            step if step > most => nominal,
            step => step,
        };
        let (keep, step, backwards) = if room_after / n >= least {
            (n, spread(room_after, n), false)
        } else if room_before / n >= least {
            (n, spread(room_before, n), true)
        } else if self.kind == SampleKind::Rate {
            let keep = (room_after / least).clamp(1, n);
            (keep, spread(room_after, keep), false)
        } else if room_after >= room_before {
            (n, room_after / n, false)
        } else {
            (n, room_before / n, true)
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

/// Where samples that shared a stamp go: `from`, `from + step`, ...; the first `keep` of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Placement {
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
    pub(super) fn stamp(&self, i: usize) -> Option<Nanos> {
        let after = self.step.saturating_mul(i64::try_from(i).ok()?);
        (i < self.keep).then_some(Nanos(self.from.0.saturating_add(after)))
    }

    /// Whether this stamp is other than the recorded one.
    pub(super) fn moves(&self, stamp: Nanos) -> bool {
        stamp != self.original
    }
}

/// The verdict of an entry that is used.
pub(super) fn verdict(status: Status) -> Verdict {
    if status.has(Status::RESTAMPED) {
        Verdict::Restamped
    } else if status.has(Status::REORDERED) {
        Verdict::Reordered
    } else {
        Verdict::Accepted
    }
}

/// `a / b` to the nearest whole number.
fn rounded_ratio(a: i64, b: i64) -> u64 {
    let b = b.max(1);
    let half_up = a.saturating_add(b / 2) / b;
    u64::try_from(half_up).unwrap_or(0)
}
