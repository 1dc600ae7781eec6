//! One pass over the samples: prepared, cut into segments, swept on several threads, given on in order. Pure.
//!
//! A stage of its own because it decides what runs beside what. Segments go in jobs of a fixed size, each with its
//! own sums: which thread does a job, and when, moves no bit. While a batch of jobs is swept, the one before it is
//! given to whoever takes them in order.

use super::border::{self, Constants};
use super::factors::{Blocks, Node, assemble};
use super::motion::Bound;
use super::prepare::Preparer;
use super::prepared::Prepared;
use super::sample::Samples;
use super::segments::Segment;
use super::settings::Settings;
use super::survey::Survey;
use super::sweep::{Sensor, sweep};
use crate::smooth::border::WIDE;
use std::num::NonZero;
use std::ops::Range;
use std::sync::Mutex;

/// Segments of a job.
const JOB: usize = 8;
/// Jobs of a batch, and samples after which one is full.
const BATCH: usize = 32;
const BATCH_SAMPLES: usize = 1 << 16;

/// What a sweep starts from: the same for all its segments.
pub(super) struct Model<'a> {
    pub(super) segments: &'a [Segment],
    pub(super) nodes: &'a [Node],
    pub(super) constants: &'a Constants,
    pub(super) bound: &'a Bound,
    /// Of the field of each segment, 1/uT^2.
    pub(super) field_weights: &'a [f64],
}

/// Reads the samples once and gives those of each segment to `take`: its number, and they. The first of all belongs to
/// no segment, and comes with none.
pub(super) fn by_segment<S: Samples>(
    samples: &mut S,
    (survey, settings): (&Survey, &Settings),
    segments: &[Segment],
    mut take: impl FnMut(Option<usize>, &mut Vec<Prepared>),
) -> Result<(), S::Error> {
    let mut preparer = Preparer::new(survey, settings);
    let mut ready = Vec::new();
    let mut held: Vec<Prepared> = Vec::new();
    let mut next: Option<usize> = None;
    let mut sort = |ready: &mut Vec<Prepared>| {
        for sample in ready.drain(..) {
            held.push(sample);
            let is_full = match next {
                None => true,
                Some(k) => segments
                    .get(k)
                    .is_some_and(|segment| held.len() >= segment.samples),
            };
            if is_full {
                take(next, &mut held);
                held.clear();
                next = Some(next.map_or(0, |k| k + 1));
            }
        }
    };
    samples.pass(&mut |chunk| {
        preparer.push(chunk, &mut ready);
        sort(&mut ready);
    })?;
    preparer.finish(&mut ready);
    sort(&mut ready);
    Ok(())
}

/// Some segments one after the other, and what they add.
pub(super) struct Job<const W: usize> {
    pub(super) first: usize,
    ranges: Vec<Range<usize>>,
    pub(super) blocks: Vec<Blocks<W>>,
    /// What a segment did that is wanted later: mean field (samples and sum), push.
    pub(super) seen: Vec<Seen>,
    pub(super) border: Box<[[f64; W]; W]>,
}

/// What a segment is remembered for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Mean field as measured, earth axes, uT; `None` without.
    pub(super) field: Option<[f64; 3]>,
    /// Change of velocity less gravity, m/s.
    pub(super) velocity: [f64; 3],
}

impl<const W: usize> Job<W> {
    fn new(first: usize) -> Job<W> {
        Job {
            first,
            ranges: Vec::with_capacity(JOB),
            blocks: Vec::new(),
            seen: Vec::new(),
            border: Box::new([[0.0; W]; W]),
        }
    }

    fn work(&mut self, samples: &[Prepared], model: &Model<'_>, sensor: &Sensor) {
        *self.border = [[0.0; W]; W];
        self.blocks.resize_with(self.ranges.len(), Blocks::zero);
        self.seen.clear();
        let centre = border::vector(model.constants, border::CENTRE);
        for (i, range) in self.ranges.iter().enumerate() {
            let k = self.first + i;
            let (a, b) = (&model.nodes[k], &model.nodes[k + 1]);
            let samples = &samples[range.clone()];
            let swept = if W == WIDE {
                sweep::<true>(samples, &a.q, &a.bias, sensor)
            } else {
                sweep::<false>(samples, &a.q, &a.bias, sensor)
            };
            let segment = &model.segments[k];
            let into = (&mut self.blocks[i], &mut *self.border);
            assemble(
                segment,
                &swept,
                [a, b],
                model.constants,
                model.bound.rows((k, segment), [a, b], &centre),
                model.field_weights[k],
                into,
            );
            let has_field = swept.field.samples > 0.0 && !segment.is_break;
            self.seen.push(Seen {
                field: has_field.then_some(swept.field.measured),
                velocity: swept.velocity,
            });
        }
    }
}

struct Batch<const W: usize> {
    samples: Vec<Prepared>,
    jobs: Vec<Job<W>>,
    /// Jobs that are made already, to be used again.
    spare: Vec<Job<W>>,
}

impl<const W: usize> Batch<W> {
    fn new() -> Batch<W> {
        Batch {
            samples: Vec::new(),
            jobs: Vec::new(),
            spare: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.samples.clear();
        self.spare.append(&mut self.jobs);
    }

    fn push(&mut self, k: usize, samples: &[Prepared]) {
        if k.is_multiple_of(JOB) || self.jobs.is_empty() {
            let mut job = self.spare.pop().unwrap_or_else(|| Job::new(k));
            job.first = k;
            job.ranges.clear();
            self.jobs.push(job);
        }
        let start = self.samples.len();
        self.samples.extend_from_slice(samples);
        if let Some(job) = self.jobs.last_mut() {
            job.ranges.push(start..self.samples.len());
        }
    }

    /// Only after a whole job: where a batch ends is not seen in the sums.
    fn is_full(&self, k: usize) -> bool {
        (k + 1).is_multiple_of(JOB)
            && (self.jobs.len() >= BATCH || self.samples.len() >= BATCH_SAMPLES)
    }
}

/// Sweeps and assembles all segments; `take` gets the jobs in order.
pub(super) fn sweep_all<S: Samples, const W: usize>(
    samples: &mut S,
    with: (&Survey, &Settings),
    model: &Model<'_>,
    mut take: impl FnMut(&Job<W>),
) -> Result<(), S::Error> {
    let sensor = Sensor::of(model.constants);
    let threads = with.1.threads;
    let (mut filling, mut done) = (Batch::<W>::new(), Batch::<W>::new());
    by_segment(samples, with, model.segments, |k, held| {
        let Some(k) = k else { return };
        filling.push(k, held);
        if filling.is_full(k) {
            work(&mut filling, &done, (model, &sensor), threads, &mut take);
            std::mem::swap(&mut filling, &mut done);
            filling.clear();
        }
    })?;
    work(&mut filling, &done, (model, &sensor), threads, &mut take);
    filling.jobs.iter().for_each(take);
    Ok(())
}

/// Sweeps one batch and gives the other on.
fn work<const W: usize>(
    batch: &mut Batch<W>,
    done: &Batch<W>,
    (model, sensor): (&Model<'_>, &Sensor),
    threads: NonZero<usize>,
    take: &mut impl FnMut(&Job<W>),
) {
    let samples = &batch.samples;
    let jobs = Mutex::new(batch.jobs.iter_mut());
    let next = || jobs.lock().ok().and_then(|mut jobs| jobs.next());
    let help = || {
        while let Some(job) = next() {
            job.work(samples, model, sensor);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.get() {
            scope.spawn(help);
        }
        done.jobs.iter().for_each(take);
        help();
    });
}
