//! Samples -> those that can be used, without holes, ready to be integrated. Pure.
//!
//! A stage of its own because it is run again in each pass: what it needs of the whole log is in the
//! [`Survey`], and of the stream it holds a few samples.

use super::bridge::{self, Catmull};
use super::gate::{Gate, LONGEST_BRIDGE};
use super::prepared::{BESIDE, Prepared};
use super::sample::{Numbers, Sample};
use super::settings::{SampleModel, Settings};
use super::survey::{LONGEST, Survey};
use crate::clipped_run::ClippedRun;
use nalgebra::Vector3;

/// Longer steps, in ordinary ones, are gaps.
const GAP: f64 = 1.6;
/// Instantaneous samples farther apart get others between them, s.
const LONGEST_STEP: f64 = 0.005;
/// Samples that gaps may be filled with beyond [`FILLED`] for each that was measured: where stamps come in bursts the
/// ordinary step says nothing of the time between these, and the work is to grow with the samples.
const FILLED_BEFOREHAND: usize = 10_000;
const FILLED: usize = 20;

/// A stream of samples on its way to the sweep.
pub(super) struct Preparer<'a> {
    survey: &'a Survey,
    has_unresolved: bool,
    /// Samples at the end of the gyro's range, up to now.
    clipped: ClippedRun,
    gate: Gate,
    /// Accepted, a few of them given on already.
    window: Vec<(Numbers, u64)>,
    next: usize,
    /// Interpolation for instantaneous samples.
    between: Option<Catmull>,
    /// Samples that gaps may still be filled with.
    fillers: usize,
}

impl<'a> Preparer<'a> {
    pub(super) fn new(survey: &'a Survey, settings: &Settings) -> Preparer<'a> {
        let parts = (survey.interval / LONGEST_STEP - 1e-9)
            .ceil()
            .clamp(1.0, 1000.0) as usize;
        Preparer {
            survey,
            has_unresolved: settings.has_unresolved,
            clipped: ClippedRun::default(),
            gate: Gate::default(),
            window: Vec::new(),
            next: 0,
            between: (settings.sample_model == SampleModel::Instant).then(|| Catmull::new(parts)),
            fillers: FILLED_BEFOREHAND,
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
            let is_far = before.is_some_and(|before| sample.stamp.since(before.stamp) > LONGEST);
            let is_gap = is_far || secs > GAP * self.survey.interval;
            self.fillers = self.fillers.saturating_add(FILLED);
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
                is_bridged: false,
                is_saturated: sample.is_saturated,
                clipped: Vector3::zeros(),
                doubt: [0.0; 2],
            };
            if self.has_unresolved && !is_gap {
                prepared.doubt = bridge::unresolved(&self.window, i, secs);
            }
            let change = before.map_or(0.0, |before| (sample.rate - before.rate).norm_squared());
            prepared.clipped = self
                .clipped
                .add(sample.is_saturated, &sample.rate, change, secs);
            if let Some(before) = &before
                && is_gap
            {
                if secs > LONGEST_BRIDGE {
                    prepared.is_after_break = true;
                } else {
                    prepared.is_bridged = true;
                    prepared.doubt = bridge::doubt(before, &sample, secs);
                    let wanted = (secs / self.survey.interval).round() as usize - 1;
                    let more = wanted.min(self.fillers);
                    self.fillers -= more;
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
                            is_bridged: false,
                            clipped: Vector3::zeros(),
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

fn whole(sample: &Numbers, survey: &Survey) -> Numbers {
    Numbers {
        rate: survey.whole(&sample.rate),
        ..*sample
    }
}
