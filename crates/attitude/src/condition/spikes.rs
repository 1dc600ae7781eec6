//! Entry with its neighbours -> the entry, or what stands in for a spike. Pure.
//!
//! A stage of its own because it is the only one that doubts a reading that is finite, plausible and in time: a bus
//! glitch is a run of one to three samples far off the line between its neighbours, while these agree with each other,
//! nothing shortly before was like it, and the accelerometer felt no blow. `docs/theory/spikes.md` derives the rule.
//!
//! It looks at samples that wait for their order anyway, so it delays nothing; where none wait (live), [`passed`] judges by
//! the same rule what has left, and the estimator goes back to the state before it.

mod edges;
mod force;
pub(super) mod passed;
mod past;

use self::past::Past;
use super::gate::{Entry, NO_ACCEL};
use super::repairs::SpikePolicy;
use super::report::Report;
use super::settings::Settings;
use crate::record::{Nanos, SampleKind, Status};
use nalgebra::Vector3;

/// Spikes that were repaired.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SpikeCount {
    /// Samples repaired.
    pub samples: u64,
    /// Stamp of the first.
    pub first: Option<Nanos>,
    /// Farthest that one was off the line between its neighbours, rad/s (of a force m/s^2).
    pub largest: f64,
}

impl SpikeCount {
    /// Adds samples that were so far off.
    fn add(&mut self, at: Nanos, samples: usize, off: f64) {
        self.samples += samples as u64;
        self.first.get_or_insert(at);
        self.largest = self.largest.max(off);
    }
}

/// Longest run of samples that can be a spike.
const LONGEST: usize = 3;
/// Longest time that two or more samples of a spike take, ns: a longer pulse is motion.
const LONGEST_NANOS: i64 = 20_000_000;
/// Longest step, ns, at which one sample alone can be a spike: at a longer one a flick of the hand is one sample.
const LONGEST_STEP_NANOS: i64 = 25_000_000;
/// Longest time, and longest step, ns, of a spike that no body makes while its accelerometer is quiet, and its distance,
/// rad/s: turned by so much, gravity would be elsewhere.
const VIOLENT_NANOS: i64 = 60_000_000;
const VIOLENT: f64 = 20.0;
/// An increment is no spike up to so many times those beside it: it may cover samples that were lost.
const LOST: f64 = 4.0;
/// Steps that a run and its neighbours may take, in times of the ordinary: a burst of stamps passes, a hole does not.
const LONGEST_SPAN: i64 = 4;
/// Samples before a run whose steps tell what is ordinary.
const PAST: usize = 16;
/// Change of the rate that nobody calls a spike, rad/s.
const FLOOR: f64 = 0.02;
/// Distance of a spike, in times of what is ordinary about it, where the accelerometer is quiet.
const QUIET: f64 = 4.0;
/// The same of a single sample, whatever the accelerometer says.
const ANY: f64 = 6.0;
/// Cosine between each sample's distance and their mean, above which a run lies on one side.
const ONE_SIDE: f64 = 0.7;
/// Steps of the specific force that are quiet, m/s^2, beyond twice the ordinary ones.
const QUIET_FORCE: f64 = 0.5;
/// Steps of quantisation that a spike exceeds.
const QUANTA: f64 = 4.0;
/// Change that is a spike after readings that never differed, rad/s: their quantisation is not known.
const UNKNOWN_QUANTUM: f64 = 0.5;

/// Looks for spikes in entries in time order.
#[derive(Clone, Debug)]
pub(super) struct Spikes {
    past: Past,
    /// Samples that wait behind one, at least.
    waits: usize,
    /// Values are increments, and not rates.
    is_increment: bool,
    /// Value of 1 rad/s.
    unit: f64,
    /// The rest of a run that is being replaced: place in the stream, and the line's value.
    run: [Option<(u64, Vector3<f64>)>; LONGEST - 1],
    drops_force: bool,
    /// Samples that are left of a run of wrong forces, and how far these are off, m/s^2.
    wrong_forces: (usize, f64),
}

/// Samples that a spike has at most.
fn most(spacing: i64) -> usize {
    (VIOLENT_NANOS / spacing).clamp(1, LONGEST as i64) as usize
}

/// Whether so many samples take longer than a spike does of which only the distance tells.
fn is_long(samples: usize, spacing: i64) -> bool {
    let longest = if samples == 1 {
        LONGEST_STEP_NANOS
    } else {
        LONGEST_NANOS
    };
    samples as i64 * spacing > longest
}

/// Whether a run of so many samples, and the one behind, have no hole in them.
fn is_whole(span: i64, samples: usize, spacing: i64, coarse: Option<i64>) -> bool {
    let longest = LONGEST_SPAN * (samples as i64 + 1) * spacing;
    (0..=longest.saturating_add(coarse.unwrap_or(0))).contains(&span)
}

fn is_rate(settings: &Settings) -> bool {
    matches!(settings.kind, SampleKind::Rate | SampleKind::Average)
}

/// A run of samples against its neighbours.
struct Run {
    samples: usize,
    /// Neighbours: the one before and the one behind.
    ends: (Vector3<f64>, Vector3<f64>),
    /// Least distance from the line, rad/s.
    distance: f64,
}

/// Evidence for and against a spike.
struct Weight {
    /// Distance from the line, in times of what is ordinary about it.
    ratio: f64,
    /// One sample only.
    is_alone: bool,
    /// Duration at which it may be motion.
    is_long: bool,
    /// Distance at which, with a quiet force, it is none.
    is_violent: bool,
    /// The accelerometer felt nothing about it.
    is_quiet: bool,
    is_above_quanta: bool,
    /// The force stepped onto it, or off it: it is as wrong as the rate.
    drops_force: bool,
}

impl Spikes {
    /// The stage that `settings` ask for.
    pub(super) fn of(settings: &Settings) -> Option<Spikes> {
        let is_on = settings.spikes == SpikePolicy::Repair && settings.reorder_window > LONGEST;
        is_on.then(|| Spikes::new(settings.reorder_window, !is_rate(settings)))
    }

    fn new(waits: usize, is_increment: bool) -> Spikes {
        Spikes {
            waits,
            is_increment,
            unit: 1.0,
            past: Past::new(),
            run: [None; LONGEST - 1],
            drops_force: false,
            wrong_forces: (0, 0.0),
        }
    }

    /// The entry to use instead of `entry`, or `None` for itself. `ahead` are those behind it in time; `spacing` is
    /// the ordinary step, and `coarse` the clock's, if that is longer.
    #[inline]
    pub(super) fn repaired(
        &mut self,
        entry: &Entry,
        ahead: &[Entry],
        (spacing, coarse): (Option<i64>, Option<i64>),
        report: &mut Report,
    ) -> Option<Entry> {
        let value = self.judged(entry, ahead, spacing, coarse);
        let Some(value) = value else {
            let Some((without, off)) = self.without_force(entry, ahead, (spacing, coarse), report)
            else {
                self.past.push(entry, &entry.value);
                return None;
            };
            self.past.push_without_force(&without, off);
            return Some(without);
        };
        self.past.push(entry, &value);
        report
            .spikes
            .add(entry.stamp, 1, (entry.value - value).norm() / self.unit);
        let status = Status(entry.status.0 & !Status::SATURATED.0);
        Some(Entry {
            value,
            accel: match self.drops_force {
                true => NO_ACCEL,
                false => entry.accel,
            },
            status: status.with(Status::REPAIRED),
            ..*entry
        })
    }

    /// The entry without its force, where that is a glitch of the accelerometer alone.
    #[inline]
    fn without_force(
        &mut self,
        entry: &Entry,
        ahead: &[Entry],
        (spacing, coarse): (Option<i64>, Option<i64>),
        report: &mut Report,
    ) -> Option<(Entry, f64)> {
        if self.wrong_forces.0 == 0 && !self.past.may_be_force(entry) {
            return None;
        }
        if self.wrong_forces.0 == 0 {
            let (samples, off) = self.wrong_forces(entry, ahead, spacing?, coarse)?;
            self.wrong_forces = (samples, off);
            report.force_spikes.add(entry.stamp, samples, off);
        }
        self.wrong_forces.0 -= 1;
        let accel = NO_ACCEL;
        Some((Entry { accel, ..*entry }, self.wrong_forces.1))
    }

    /// Samples from this one on whose forces are a glitch, and how far they are off, m/s^2.
    #[cold]
    fn wrong_forces(
        &self,
        entry: &Entry,
        ahead: &[Entry],
        spacing: i64,
        coarse: Option<i64>,
    ) -> Option<(usize, f64)> {
        if self.past.count <= PAST || !(1..=LONGEST_STEP_NANOS).contains(&spacing) {
            return None;
        }
        let mut samples = (1..=most(spacing)).take_while(|samples| !is_long(*samples, spacing));
        samples.find_map(|samples| {
            let span = ahead.get(samples - 1)?.stamp.since(self.past.last);
            let off = self.past.force_off(entry, ahead, samples, self.unit)?;
            is_whole(span, samples, spacing, coarse).then_some((samples, off))
        })
    }

    #[inline]
    fn judged(
        &mut self,
        entry: &Entry,
        ahead: &[Entry],
        spacing: Option<i64>,
        coarse: Option<i64>,
    ) -> Option<Vector3<f64>> {
        if let [Some((index, value)), rest] = self.run {
            self.run = [rest, None];
            if index == entry.index {
                return Some(value);
            }
        }
        let spacing = spacing.filter(|step| (1..=VIOLENT_NANOS).contains(step))?;
        if self.is_increment {
            self.unit = spacing as f64 * 1e-9;
        }
        let is_beginning = self.past.count <= PAST || self.past.is_hole(entry, spacing, coarse);
        if is_beginning || ahead.len() < LONGEST {
            let run = self.at_edge(entry, ahead, (spacing, coarse), is_beginning);
            if run.is_some() || is_beginning {
                return run.map(|(run, drops_force)| self.begin(&run, drops_force, ahead));
            }
        }
        (1..=most(spacing)).find_map(|samples| {
            let run = self.run_of(entry, ahead, samples, spacing, coarse)?;
            let weight = self.weight(&run, entry, ahead, (spacing, self.past.ordinary()));
            let is_spike = weight.is_spike();
            is_spike.then(|| self.begin(&run, weight.drops_force, ahead))
        })
    }

    /// The run of so many samples that begins at `entry`, where it and its stamps are such that it can be a spike.
    #[inline]
    fn run_of(
        &self,
        entry: &Entry,
        ahead: &[Entry],
        samples: usize,
        spacing: i64,
        coarse: Option<i64>,
    ) -> Option<Run> {
        let run = Run::of(&self.past.rates[0], entry, ahead, samples, self.unit)?;
        let within = || std::iter::once(entry).chain(ahead).take(samples);
        if self.is_increment && !within().all(|sample| run.is_beyond_lost(&sample.value)) {
            return None;
        }
        let span = ahead.get(samples - 1)?.stamp.since(self.past.last);
        is_whole(span, samples, spacing, coarse).then_some(run)
    }

    /// Evidence for a spike, by the samples in `ahead`, their step, and the changes of rate and force that are ordinary.
    #[cold]
    fn weight(
        &self,
        run: &Run,
        entry: &Entry,
        ahead: &[Entry],
        (spacing, (rate, force)): (i64, (f64, f64)),
    ) -> Weight {
        let ends_apart = (run.ends.1 - run.ends.0).norm();
        let is_quiet = |step: f64| step < 2.0 * force + QUIET_FORCE;
        let step = |behind| {
            self.past
                .force_step(entry, ahead, run.samples + behind, run.samples)
        };
        Weight {
            ratio: run.distance / (ends_apart + rate + FLOOR * self.unit),
            is_alone: run.samples == 1,
            is_long: is_long(run.samples, spacing),
            is_violent: run.distance > VIOLENT * self.unit,
            is_quiet: step(2).is_some_and(is_quiet),
            is_above_quanta: match self.past.quantum.is_finite() {
                true => run.distance > QUANTA * self.past.quantum,
                false => run.distance > UNKNOWN_QUANTUM * self.unit,
            },
            drops_force: step(1).is_some_and(|step| !is_quiet(step)),
        }
    }

    /// The value of the first sample of `run`, which is a spike; the others are noted.
    #[cold]
    fn begin(&mut self, run: &Run, drops_force: bool, ahead: &[Entry]) -> Vector3<f64> {
        self.drops_force = drops_force;
        for (n, slot) in self.run.iter_mut().enumerate() {
            *slot = ahead
                .get(n)
                .filter(|_| n + 1 < run.samples)
                .map(|next| (next.index, run.line(n + 1)));
        }
        run.line(0)
    }
}

impl Weight {
    /// Whether it is one whatever the accelerometer says.
    fn is_certain(&self) -> bool {
        self.is_alone && !self.is_long && self.ratio > ANY && self.is_above_quanta
    }

    fn is_spike(&self) -> bool {
        let is_short = !self.is_long || self.is_violent;
        let is_quiet = self.ratio > QUIET && self.is_quiet && self.is_above_quanta;
        self.is_certain() || (is_quiet && is_short)
    }
}

impl Run {
    /// The run of so many samples that begins at `entry`, where it can be a spike at all; `unit` is the value of 1 rad/s.
    #[inline]
    fn of(
        before: &Vector3<f64>,
        entry: &Entry,
        ahead: &[Entry],
        samples: usize,
        unit: f64,
    ) -> Option<Run> {
        let behind = ahead.get(samples - 1)?;
        if behind.epoch != entry.epoch {
            return None;
        }
        let mut run = Run {
            samples,
            ends: (*before, behind.value),
            distance: f64::INFINITY,
        };
        let apart = (run.ends.1 - run.ends.0).norm_squared();
        let floor = FLOOR * unit;
        let within = std::iter::once(entry).chain(ahead).take(samples);
        let mut off = [Vector3::zeros(); LONGEST];
        for (n, (off, sample)) in off.iter_mut().zip(within).enumerate() {
            *off = sample.value - run.line(n);
            let size = off.norm_squared();
            // The cheap half of the rule: nearly every sample leaves here.
            if size <= QUIET * QUIET * (apart + floor * floor) {
                return None;
            }
            run.distance = run.distance.min(size);
        }
        run.distance = run.distance.sqrt();
        let off = off.get(..samples)?;
        let mean = off.iter().sum::<Vector3<f64>>() / samples as f64;
        let is_on_one_side = off
            .iter()
            .all(|off| off.dot(&mean) > ONE_SIDE * off.norm() * mean.norm());
        is_on_one_side.then_some(run)
    }

    /// Whether an increment is more than those beside it with some that were lost.
    fn is_beyond_lost(&self, increment: &Vector3<f64>) -> bool {
        let (before, behind) = &self.ends;
        increment.norm() > LOST * before.norm().max(behind.norm())
    }

    /// The line between the neighbours at the `n`th sample.
    #[inline]
    fn line(&self, n: usize) -> Vector3<f64> {
        let (before, behind) = &self.ends;
        let share = (n + 1) as f64 / (self.samples + 1) as f64;
        before + (behind - before) * share
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
pub(crate) mod tests;
