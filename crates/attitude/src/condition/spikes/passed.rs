//! Sample that leaves at once -> what is to be taken back of it. Pure.
//!
//! Apart from the repair in a recording because the samples have left when those behind them show what they were. A doubt
//! begins where the rate steps by so much that a spike can begin there (for any spike it must: the rule's distance is
//! at most the step, and exceeds four times what is ordinary), and ends when the rule has all it needs: one to four
//! samples later. What integrates keeps its state from the one to the other.

use super::super::gate::{Entry, NO_ACCEL};
use super::super::report::Report;
use super::super::timing::Timing;
use super::edges::AHEAD;
use super::{
    FLOOR, LONGEST, LONGEST_STEP_NANOS, PAST, QUIET, Run, Spikes, VIOLENT_NANOS, is_rate, most,
};
use crate::condition::{Settings, SpikePolicy};
use crate::record::{RateSample, Status};

/// Step of the rate, rad/s, at which one of the first samples may be a spike.
const BEGINS: f64 = 0.5;
/// Samples that wait for a judgement at most, but for the first ones: a run, and the two behind it by which it is judged.
const MOST: usize = LONGEST + 2;

/// Judgement of samples that have left.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Revision {
    /// Samples may be taken back from here on.
    Doubt,
    /// The first samples of those in doubt are as they left.
    Sound(usize),
    /// The first samples of those in doubt are to be these instead.
    Repaired(Vec<RateSample>),
    /// The doubt is over.
    Over,
}

/// Judgement, and the sample before which it came.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Revised {
    /// Number of samples put out before it.
    pub(crate) place: usize,
    pub(crate) revision: Revision,
}

/// Looks for spikes in samples that have left.
#[derive(Clone, Debug)]
pub(in crate::condition) struct Passed {
    spikes: Spikes,
    /// Samples in doubt, oldest first.
    waiting: Vec<(Entry, RateSample)>,
    /// Somebody goes back to what was before a spike, by these.
    revisions: Option<Vec<Revised>>,
}

/// Opinion about the oldest sample in doubt.
enum Judgement {
    Sound,
    /// Samples behind it are still needed.
    Open,
    Spike(Run, bool),
    /// The forces of so many samples are a glitch, so far off, m/s^2.
    WrongForces(usize, f64),
}

impl Passed {
    /// The stage that `settings` ask for, where nothing waits.
    pub(in crate::condition) fn of(settings: &Settings) -> Option<Passed> {
        let is_on = settings.spikes == SpikePolicy::Repair && settings.reorder_window == 0;
        (is_on && is_rate(settings)).then(|| Passed {
            spikes: Spikes::new(AHEAD, false),
            waiting: Vec::new(),
            revisions: None,
        })
    }

    /// Keeps revisions from now on, for [`Passed::revisions`].
    pub(in crate::condition) fn keep_revisions(&mut self) {
        self.revisions.get_or_insert_default();
    }

    /// Takes the revisions since the last call.
    #[inline]
    pub(in crate::condition) fn revisions(&mut self) -> Vec<Revised> {
        match &mut self.revisions {
            Some(kept) if !kept.is_empty() => std::mem::take(kept),
            _ => Vec::new(),
        }
    }

    /// Takes the next entry, which leaves as `sample` behind `place` others.
    #[inline]
    pub(in crate::condition) fn take(
        &mut self,
        entry: &Entry,
        sample: &RateSample,
        place: usize,
        timing: &Timing,
        report: &mut Report,
    ) {
        let steps = (timing.spacing(), timing.coarse());
        if self.waiting.is_empty() && !self.is_suspect(entry, steps) {
            self.spikes.past.push(entry, &entry.value);
            return;
        }
        self.doubt(entry, sample, place, timing, report);
    }

    /// Whether a spike can begin at this entry, where a step, and the clock's if that is longer, are such.
    #[inline]
    fn is_suspect(&self, entry: &Entry, (spacing, coarse): (Option<i64>, Option<i64>)) -> bool {
        let past = &self.spikes.past;
        let step = (entry.value - past.rates[0]).norm_squared();
        let may_be_force = past.may_be_force(entry);
        if step <= QUIET * QUIET * FLOOR * FLOOR && !may_be_force {
            return false;
        }
        let has_step = |most: i64| spacing.is_some_and(|step| (1..=most).contains(&step));
        let ordinary = QUIET * (past.ordinary().0 + FLOOR);
        if self.is_beginning(entry, (spacing, coarse)) {
            let may_be = spacing.is_none() || has_step(VIOLENT_NANOS);
            return may_be && step > (ordinary * ordinary).max(BEGINS * BEGINS);
        }
        if may_be_force && has_step(LONGEST_STEP_NANOS) {
            return true;
        }
        has_step(VIOLENT_NANOS) && step > ordinary * ordinary
    }

    /// Whether what is ordinary is told by what follows.
    #[inline]
    fn is_beginning(&self, entry: &Entry, (spacing, coarse): (Option<i64>, Option<i64>)) -> bool {
        let past = &self.spikes.past;
        past.count <= PAST || spacing.is_some_and(|spacing| past.is_hole(entry, spacing, coarse))
    }

    #[cold]
    fn doubt(
        &mut self,
        entry: &Entry,
        sample: &RateSample,
        place: usize,
        timing: &Timing,
        report: &mut Report,
    ) {
        let note = |revisions: &mut Option<Vec<Revised>>, revision| {
            if let Some(kept) = revisions {
                kept.push(Revised { place, revision });
            }
        };
        let mut is_new = self.waiting.is_empty();
        self.waiting.push((*entry, *sample));
        while let [(first, _), behind @ ..] = self.waiting.as_slice() {
            let first = *first;
            if behind.is_empty() && !is_new {
                note(&mut self.revisions, Revision::Over);
                is_new = true;
                if !self.is_suspect(&first, (timing.spacing(), timing.coarse())) {
                    self.spikes.past.push(&first, &first.value);
                    self.waiting.clear();
                    // Of a beginning there were more.
                    self.waiting.shrink_to(MOST);
                    return;
                }
            }
            if is_new {
                note(&mut self.revisions, Revision::Doubt);
                return;
            }
            let (count, revision) = match self.judgement(&first, timing) {
                Judgement::Open => return,
                Judgement::Sound => {
                    self.spikes.past.push(&first, &first.value);
                    (1, Revision::Sound(1))
                }
                Judgement::WrongForces(samples, off) => {
                    if self.revisions.is_some() {
                        report.force_spikes.add(first.stamp, samples, off);
                    }
                    (
                        samples,
                        Revision::Repaired(self.without_force(samples, off)),
                    )
                }
                Judgement::Spike(run, drops_force) => {
                    let repaired = self.repaired(&run, drops_force, timing, report);
                    (run.samples, Revision::Repaired(repaired))
                }
            };
            note(&mut self.revisions, revision);
            self.waiting.drain(..count.min(self.waiting.len()));
        }
    }

    /// Judges the oldest sample by those behind it.
    fn judgement(&self, first: &Entry, timing: &Timing) -> Judgement {
        let steps = (timing.spacing(), timing.coarse());
        if !self.is_suspect(first, steps) {
            return Judgement::Sound;
        }
        if self.is_beginning(first, steps) {
            return self.judgement_of_beginning(first, steps);
        }
        let Some(spacing) = timing.spacing() else {
            return Judgement::Sound;
        };
        let mut ahead = [*first; MOST];
        let behind = self.waiting.get(1..).unwrap_or_default();
        for (slot, (entry, _)) in ahead.iter_mut().zip(behind) {
            *slot = *entry;
        }
        let ahead = ahead.get(..behind.len()).unwrap_or(&ahead);
        for samples in 1..=most(spacing) {
            if ahead.len() < samples {
                return Judgement::Open;
            }
            let run = self
                .spikes
                .run_of(first, ahead, samples, spacing, timing.coarse());
            let Some(run) = run else {
                continue;
            };
            let ordinary = (spacing, self.spikes.past.ordinary());
            let weight = self.spikes.weight(&run, first, ahead, ordinary);
            // Until it has come, the force behind may still tell of a blow.
            if weight.is_spike() && !weight.is_certain() && ahead.len() <= samples {
                return Judgement::Open;
            }
            if weight.is_spike() {
                return Judgement::Spike(run, weight.drops_force);
            }
        }
        let coarse = timing.coarse();
        match self.spikes.wrong_forces(first, ahead, spacing, coarse) {
            Some((samples, off)) => Judgement::WrongForces(samples, off),
            None => Judgement::Sound,
        }
    }

    /// Judges the oldest sample, one of the first, once as many have come as a recording has waiting.
    fn judgement_of_beginning(
        &self,
        first: &Entry,
        (spacing, coarse): (Option<i64>, Option<i64>),
    ) -> Judgement {
        let behind = self.waiting.get(1..).unwrap_or_default();
        if behind.len() < AHEAD {
            return Judgement::Open;
        }
        let ahead: Vec<Entry> = behind.iter().map(|(entry, _)| *entry).collect();
        let spacing = spacing.filter(|step| (1..=VIOLENT_NANOS).contains(step));
        let run = spacing.and_then(|spacing| {
            let steps = (spacing, coarse);
            self.spikes.at_edge(first, &ahead, steps, true)
        });
        match run {
            Some((run, drops_force)) => Judgement::Spike(run, drops_force),
            None => Judgement::Sound,
        }
    }

    /// Samples that are the oldest, so many, without their forces.
    fn without_force(&mut self, samples: usize, off: f64) -> Vec<RateSample> {
        let mut without = Vec::new();
        for (entry, sample) in self.waiting.iter().take(samples) {
            let accel = NO_ACCEL;
            self.spikes
                .past
                .push_without_force(&Entry { accel, ..*entry }, off);
            without.push(RateSample {
                accel: None,
                ..*sample
            });
        }
        without
    }

    /// The samples of `run`, which are the oldest, as they should have left.
    fn repaired(
        &mut self,
        run: &Run,
        drops_force: bool,
        timing: &Timing,
        report: &mut Report,
    ) -> Vec<RateSample> {
        let count = match self.revisions.is_some() {
            true => &mut report.spikes,
            false => &mut report.spikes_left,
        };
        let mut repaired = Vec::new();
        for (n, (entry, sample)) in self.waiting.iter().take(run.samples).enumerate() {
            let value = run.line(n);
            self.spikes.past.push(entry, &value);
            count.add(entry.stamp, 1, (entry.value - value).norm());
            let status = Status(sample.status.0 & !Status::SATURATED.0);
            repaired.push(RateSample {
                gyro: timing.revalued(sample, &Entry { value, ..*entry }),
                accel: sample.accel.filter(|_| !drops_force),
                status: status.with(Status::REPAIRED),
                ..*sample
            });
        }
        repaired
    }
}
