//! Entries in time order -> RateSample: intervals, gaps, shared stamps. Pure.
//!
//! A stage of its own because this is where stamps become time: from here on a sample covers an
//! interval, says whether something before it is missing, and never shares its instant.

mod gaps;
mod placement;

use super::gate::{Entry, finite_accel};
use super::report::Report;
use super::settings::{OnGap, Settings};
use super::spacing::{Spacing, Steps};
use crate::frames::In;
use crate::record::{Join, Measured, Nanos, RateSample, SampleKind, Status, Verdict};
use nalgebra::Vector3;

/// Interval of a lone increment that says nothing of its own: only its mean rate depends on it.
const LONE_INTERVAL_NANOS: i64 = 10_000_000;
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
