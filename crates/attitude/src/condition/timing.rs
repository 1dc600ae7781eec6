//! Entries in time order -> RateSample: intervals, gaps, shared stamps. Pure.
//!
//! A stage of its own because this is where stamps become time: from here on a sample covers an
//! interval, says whether something before it is missing, and never shares its instant.

use super::gate::{Entry, finite_accel};
use super::report::{Gap, Report};
use super::settings::{OnGap, Settings};
use super::spacing::{Spacing, Steps};
use crate::frames::In;
use crate::record::{Join, Measured, Nanos, RateSample, SampleKind, Status, Verdict};
use nalgebra::Vector3;

/// Interval of a lone increment that says nothing of its own: only its mean rate depends on it.
const LONE_INTERVAL_NANOS: i64 = 10_000_000;
/// Number of steps a late stamp may take to catch up.
/// Beyond a dozen steps a few percent of error in the ordinary step look like a sample.
const MAX_LOOK: usize = 12;

/// Samples on one stamp, on average, from which the clock is coarse: it counts in steps longer than the
/// sensor's, and a stamp says only in which of them a sample was taken. Pairs are collisions.
const COARSE: usize = 3;
/// Stamps that must have been seen of a coarse clock: between the first and the last of them lie two
/// steps that are surely full.
const COARSE_STAMPS: usize = 4;

/// The sample before.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Before", into = "Before")
)]
pub(super) struct Previous {
    pub(super) stamp: Nanos,
    pub(super) start: Nanos,
    pub(super) value: Vector3<f64>,
    pub(super) epoch: u32,
}

/// The sample before as it is saved: stamp, start, value, epoch.
#[cfg(feature = "serde")]
type Before = (i64, i64, [f64; 3], u32);

#[cfg(feature = "serde")]
impl From<Previous> for Before {
    fn from(previous: Previous) -> Before {
        let Previous {
            stamp,
            start,
            value,
            epoch,
        } = previous;
        (stamp.0, start.0, value.into(), epoch)
    }
}

#[cfg(feature = "serde")]
impl From<Before> for Previous {
    fn from((stamp, start, value, epoch): Before) -> Previous {
        Previous {
            stamp: Nanos(stamp),
            start: Nanos(start),
            value: Vector3::from(value),
            epoch,
        }
    }
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
    /// The step of a coarse clock, nanoseconds.
    coarse: Option<i64>,
    /// The step of the sensor behind it, nanoseconds, where that was known before the first entry.
    step: Option<i64>,
}

impl Timing {
    pub(super) fn new(settings: &Settings, max_gap_nanos: i64) -> Self {
        let mut spacing = Spacing::new(max_gap_nanos);
        if let Some(coarse) = &settings.coarse {
            spacing.prime(&mut [coarse.step.round() as i64; 16]);
        }
        Timing {
            kind: settings.kind,
            bias: settings.bias.0,
            max_gap_nanos,
            on_gap: settings.on_gap,
            spacing,
            previous: None,
            coarse: settings.coarse.map(|coarse| coarse.tick),
            step: settings.coarse.map(|coarse| coarse.step.round() as i64),
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

    /// The ordinary step is this, nanoseconds: known before the first entry.
    pub(super) fn expect(&mut self, step: f64) {
        self.spacing.prime(&mut [step.round() as i64; 16]);
    }

    /// Time goes on into `epoch`: its clock was set by what has been taken off.
    pub(super) fn join_epoch(&mut self, epoch: u32) {
        self.previous.iter_mut().for_each(|p| p.epoch = epoch);
    }

    /// Ordinary steps, as far as they are known.
    pub(super) fn steps(&self) -> Steps {
        self.spacing.steps()
    }

    /// Whether that can be known; it is from now on.
    pub(super) fn set_steps(&mut self, steps: &Steps) -> bool {
        self.spacing.set_steps(steps)
    }

    /// Whether more entries must be seen before the ordinary step can be learnt: of a coarse clock, so
    /// many that some of its steps are whole.
    pub(super) fn needs_more(line: &[Entry]) -> bool {
        let groups = groups_of(line);
        is_coarse(line.len(), groups.len()) && groups.len() < COARSE_STAMPS
    }

    /// The step of a coarse clock, nanoseconds; `None` where stamps are as fine as samples.
    pub(super) fn coarse(&self) -> Option<i64> {
        self.coarse
    }

    /// Whether every entry lies on the line of an even sensor behind a coarse clock, those alone on their stamp, too.
    #[inline]
    pub(super) fn is_on_line(&self) -> bool {
        self.step.is_some()
    }

    /// Learns the ordinary step from the first entries, before any of them is timed.
    pub(super) fn prime(&mut self, line: &[Entry]) {
        let groups = groups_of(line);
        let mut known: Vec<(i64, i64)> = groups
            .iter()
            .filter_map(|g| g.step.zip(Some(g.n)))
            .collect();
        if is_coarse(line.len(), groups.len()) && !known.is_empty() {
            if known.len() > 1 {
                // The first began anywhere in its step; the last has no end yet, and is not known.
                known.remove(0);
            } else if let (Some(first), Some(last)) = (known.first_mut(), groups.last()) {
                // Neither is whole: the fuller one is nearer to it.
                first.1 = first.1.max(last.n);
            }
            let mut steps: Vec<i64> = known.iter().map(|(step, _)| *step).collect();
            let middle = (steps.len() - 1) / 2;
            let quantum = *steps.select_nth_unstable(middle).1;
            // Not where a clock stood still for a while and then went on in the sensor's steps.
            let shares = known.iter().filter(|(_, n)| *n > 1).count();
            self.coarse = (2 * shares > known.len()).then_some(quantum);
        }
        // n samples on one stamp and then a step are n samples in that step.
        let mut steps: Vec<i64> = known
            .into_iter()
            .flat_map(|(step, n)| std::iter::repeat_n(step / n, usize::try_from(n).unwrap_or(0)))
            .collect();
        self.spacing.prime(&mut steps);
    }

    /// Whether a sample with this stamp or a later one has left already in this epoch.
    #[inline]
    pub(super) fn has_passed(&self, entry: &Entry) -> bool {
        self.previous
            .is_some_and(|p| p.epoch == entry.epoch && p.stamp >= entry.stamp)
    }

    /// Whether nothing has left before it in its epoch.
    pub(super) fn is_first(&self, entry: &Entry) -> bool {
        self.previous.is_none_or(|p| p.epoch != entry.epoch)
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
            gyro: Measured::assume(self.kind, value),
            accel: finite_accel(&entry.accel).map(In::assume),
            join,
            status,
            log: entry.log,
        }
    }

    /// Measurement of `sample`, which this has timed, if it were made of this entry.
    pub(super) fn revalued(&self, sample: &RateSample, entry: &Entry) -> Measured {
        let interval = match entry.interval {
            0 => sample.stamp.since(sample.start),
            own => own,
        };
        sample.gyro.with(match self.kind {
            SampleKind::Rate => entry.value - self.bias,
            _ => self.angle(entry, interval),
        })
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
        (start, self.angle(entry, interval))
    }

    /// Angle of an entry over an interval, nanoseconds.
    #[inline(always)]
    fn angle(&self, entry: &Entry, interval: i64) -> Vector3<f64> {
        let secs = interval as f64 * 1e-9;
        match self.kind {
            SampleKind::DeltaAngle | SampleKind::Rotation => entry.value - self.bias * secs,
            SampleKind::Rate | SampleKind::Average => (entry.value - self.bias) * secs,
        }
    }

    /// Duration of one increment when its predecessor does not state it.
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
            SampleKind::DeltaAngle | SampleKind::Rotation => {
                let secs = self.own_interval(entry) as f64 * 1e-9;
                entry.value.norm() / secs
            }
        }
    }

    /// Stamps for entries that all carry the stamp of the first.
    ///
    /// Two real samples that collided on one stamp leave a longer step beside them: the later ones
    /// go into the step after, evenly, or else the earlier ones into the step before. Where
    /// there is no room, what is too many is dropped: the instant is known already. What a sample means
    /// plays no part in it.
    ///
    /// A coarse clock's samples lie in the step that begins with their stamp: the first ones of a stream
    /// at its end, for a recording begins anywhere in it, and the last ones no further than it reaches.
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

/// Entries in a row that share one stamp.
struct Group {
    n: i64,
    /// Step to the next stamp, where one follows in the same epoch.
    step: Option<i64>,
}

fn groups_of(line: &[Entry]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut before: Option<&Entry> = None;
    for entry in line {
        match (before, groups.last_mut()) {
            (Some(b), Some(group)) if b.epoch == entry.epoch && b.stamp == entry.stamp => {
                group.n += 1;
            }
            (Some(b), Some(group)) => {
                group.step = (b.epoch == entry.epoch).then(|| entry.stamp.since(b.stamp));
                groups.push(Group { n: 1, step: None });
            }
            _ => groups.push(Group { n: 1, step: None }),
        }
        before = Some(entry);
    }
    groups
}

/// Whether so many entries on so many stamps are a coarse clock's. The first and the last stamp may have
/// any number of them.
fn is_coarse(entries: usize, stamps: usize) -> bool {
    entries > COARSE * stamps.saturating_sub(1).max(1)
}

/// Places of samples that shared a stamp: `from`, `from + step`, ...; the first `keep` of them.
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
