//! Samples -> those that can be used, without holes, ready to be integrated. Pure.
//!
//! A stage of its own because it is run again in each pass: what it needs of the whole log is in the
//! [`Survey`], and of the stream it holds a few samples.

use super::bridge::{self, Catmull};
use super::sample::Sample;
use super::settings::{SampleModel, Settings};
use super::survey::Survey;
use crate::record::Nanos;
use nalgebra::Vector3;

/// A rate beyond this (each component, rad/s), and a force (m/s^2), are none.
const LARGEST_RATE: f64 = 100.0;
const LARGEST_FORCE: f64 = 2000.0;
/// A single stamp so far ahead of those around it is none, ns.
const LEAP: i64 = 10_000_000_000;
/// Longer steps, in ordinary ones, are gaps.
const GAP: f64 = 1.6;
/// Longer gaps are breaks, s: nothing is known of the motion.
const LONGEST_BRIDGE: f64 = 0.25;
/// So many samples on both sides of a gap say how the rate goes on.
pub(super) const BESIDE: usize = 5;
/// Instantaneous samples farther apart get others between them, s.
const LONGEST_STEP: f64 = 0.005;

/// A sample as the sweep wants it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub stamp: i64,
    /// Since the one before, s.
    pub secs: f64,
    /// Mean since the one before, rad/s.
    pub rate: Vector3<f64>,
    pub force: Vector3<f64>,
    /// NaN where none was measured.
    pub field: Vector3<f64>,
    /// Which one of the input it is, or which one it comes before.
    pub input: u64,
    pub is_input: bool,
    /// Nothing is known of the time before it.
    pub is_after_break: bool,
    /// Variance that a gap before it leaves of attitude and velocity: rad^2, (m/s)^2.
    pub doubt: [f64; 2],
}

/// Leaves out samples that are none: not finite, beyond what there is, or not later than the ones before. One without
/// a force gets that between its neighbours', for an accelerometer slower than the gyro.
#[derive(Default)]
pub(super) struct Gate {
    offered: u64,
    last: Option<i64>,
    /// Accepted unless its stamp turns out to have leapt.
    waiting: Option<(Sample, u64)>,
    /// The last force that was measured.
    force: Option<(Nanos, Vector3<f64>)>,
    /// Samples since then, without one.
    lacking: Vec<(Sample, u64)>,
}

impl Gate {
    /// Gives those that are accepted to `take`, some of them late, with their place in the input.
    pub(super) fn offer(&mut self, sample: &Sample, take: &mut dyn FnMut(&Sample, u64)) {
        let place = self.offered;
        self.offered += 1;
        if !is_usable(sample) {
            return;
        }
        let stamp = sample.stamp.0;
        if let Some((waiting, its_place)) = self.waiting {
            let ahead = waiting.stamp.0;
            if stamp > ahead {
                self.accept(&waiting, its_place, take);
                self.last = Some(ahead);
            } else {
                let has_leapt = match self.last {
                    Some(last) => ahead.saturating_sub(last) > LEAP && stamp > last,
                    None => ahead.saturating_sub(stamp) > LEAP,
                };
                if !has_leapt {
                    return;
                }
            }
        }
        self.waiting = Some((*sample, place));
    }

    fn accept(&mut self, sample: &Sample, place: u64, take: &mut dyn FnMut(&Sample, u64)) {
        let Some(force) = sample.force else {
            let since = |(stamp, _): &(Nanos, _)| sample.stamp.secs_since(*stamp);
            if self
                .force
                .as_ref()
                .is_some_and(|force| since(force) <= LONGEST_BRIDGE)
            {
                self.lacking.push((*sample, place));
            }
            return;
        };
        if let Some((stamp, before)) = self.force {
            let secs = sample.stamp.secs_since(stamp);
            for (lacking, its_place) in self.lacking.drain(..) {
                if secs <= LONGEST_BRIDGE {
                    let share = lacking.stamp.secs_since(stamp) / secs;
                    let force = Some(before + (force - before) * share);
                    take(&Sample { force, ..lacking }, its_place);
                }
            }
        }
        self.force = Some((sample.stamp, force));
        take(sample, place);
    }

    /// The last ones.
    pub(super) fn finish(&mut self, take: &mut dyn FnMut(&Sample, u64)) {
        if let Some((sample, place)) = self.waiting.take() {
            self.accept(&sample, place, take);
        }
        let force = self.force.map(|(_, force)| force);
        for (lacking, place) in self.lacking.drain(..) {
            take(&Sample { force, ..lacking }, place);
        }
    }
}

fn is_usable(sample: &Sample) -> bool {
    // NaN is not below anything.
    let is_force = |force: &Vector3<f64>| force.iter().all(|f| f.abs() < LARGEST_FORCE);
    sample.rate.iter().all(|w| w.abs() < LARGEST_RATE) && sample.force.as_ref().is_none_or(is_force)
}

/// A stream of samples on its way to the sweep.
pub(super) struct Preparer<'a> {
    survey: &'a Survey,
    gate: Gate,
    /// Accepted, a few of them given on already.
    window: Vec<(Sample, u64)>,
    next: usize,
    /// For instantaneous samples.
    between: Option<Catmull>,
}

impl<'a> Preparer<'a> {
    pub(super) fn new(survey: &'a Survey, settings: &Settings) -> Preparer<'a> {
        let parts = (survey.interval / LONGEST_STEP - 1e-9)
            .ceil()
            .clamp(1.0, 1000.0) as usize;
        Preparer {
            survey,
            gate: Gate::default(),
            window: Vec::new(),
            next: 0,
            between: (settings.sample_model == SampleModel::Instant).then(|| Catmull::new(parts)),
        }
    }

    /// Appends what is ready.
    pub(super) fn push(&mut self, chunk: &[Sample], out: &mut Vec<Prepared>) {
        let (gate, window, survey) = (&mut self.gate, &mut self.window, self.survey);
        for sample in chunk {
            gate.offer(sample, &mut |sample, place| {
                window.push((whole(sample, survey), place))
            });
        }
        self.emit(self.window.len().saturating_sub(BESIDE), out);
        if self.next > BESIDE {
            self.window.drain(..self.next - BESIDE);
            self.next = BESIDE;
        }
    }

    /// And the rest.
    pub(super) fn finish(&mut self, out: &mut Vec<Prepared>) {
        let (gate, window, survey) = (&mut self.gate, &mut self.window, self.survey);
        gate.finish(&mut |sample, place| window.push((whole(sample, survey), place)));
        self.emit(self.window.len(), out);
        if let Some(between) = &mut self.between {
            between.finish(out);
        }
    }

    fn emit(&mut self, end: usize, out: &mut Vec<Prepared>) {
        while self.next < end {
            let i = self.next;
            self.next += 1;
            let (sample, place) = self.window[i];
            let before = i.checked_sub(1).map(|j| self.window[j].0);
            let secs = before.map_or(0.0, |before| sample.stamp.secs_since(before.stamp));
            let mut prepared = Prepared {
                stamp: sample.stamp.0,
                secs,
                rate: sample.rate,
                force: sample.force.unwrap_or_default(),
                field: sample.field.map_or(Vector3::repeat(f64::NAN), |field| {
                    field * self.survey.field_scale
                }),
                input: place,
                is_input: true,
                is_after_break: false,
                doubt: [0.0; 2],
            };
            if let Some(before) = &before
                && secs > GAP * self.survey.interval
            {
                if secs > LONGEST_BRIDGE {
                    prepared.is_after_break = true;
                } else {
                    prepared.doubt = bridge::doubt(before, &sample, secs);
                    let more = (secs / self.survey.interval).round() as usize - 1;
                    let parts = (more + 1) as f64;
                    let curve = bridge::Hermite::across(&self.window, i, self.survey.interval);
                    for j in 1..=more {
                        let (rate, force) = curve.at(j as f64 / parts);
                        let filler = Prepared {
                            stamp: before.stamp.0 + (secs * 1e9 * j as f64 / parts).round() as i64,
                            secs: secs / parts,
                            rate,
                            force,
                            field: Vector3::repeat(f64::NAN),
                            is_input: false,
                            doubt: [0.0; 2],
                            ..prepared
                        };
                        self.give(filler, out);
                    }
                    prepared.secs = secs / parts;
                }
            }
            self.give(prepared, out);
        }
    }

    fn give(&mut self, prepared: Prepared, out: &mut Vec<Prepared>) {
        match &mut self.between {
            Some(between) => between.take(prepared, out),
            None => out.push(prepared),
        }
    }
}

fn whole(sample: &Sample, survey: &Survey) -> Sample {
    Sample {
        rate: survey.whole(&sample.rate),
        ..*sample
    }
}
