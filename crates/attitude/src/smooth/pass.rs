//! One pass over the samples: prepared, cut into segments, swept on several threads, given on in order. Pure.
//!
//! A stage of its own because it decides what runs beside what. Segments go in jobs of a fixed size, each with its
//! own samples and sums: which thread does a job, and when, moves no bit. One thread reads, prepares and takes the
//! results in order; it sweeps, too, where jobs come faster than the others do them.

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
use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError, mpsc};

/// Segments of a job.
const JOB: usize = 8;
/// Jobs that wait for each thread that helps.
const WAITING: usize = 2;

/// Model from which a sweep starts: the same for all its segments.
pub(super) struct Model<'a> {
    pub(super) segments: &'a [Segment],
    pub(super) nodes: &'a [Node],
    pub(super) constants: &'a Constants,
    pub(super) bound: &'a Bound,
    /// Weights of the field of each segment, 1/uT^2.
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
    samples: Vec<Prepared>,
    ranges: Vec<Range<usize>>,
    pub(super) blocks: Vec<Blocks<W>>,
    /// Results of a segment that are wanted later: mean field (samples and sum), push.
    pub(super) seen: Vec<Seen>,
    pub(super) border: Box<[[f64; W]; W]>,
}

/// Results for which a segment is remembered.
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
            samples: Vec::new(),
            ranges: Vec::with_capacity(JOB),
            blocks: Vec::new(),
            seen: Vec::new(),
            border: Box::new([[0.0; W]; W]),
        }
    }

    fn push(&mut self, samples: &[Prepared]) {
        let start = self.samples.len();
        self.samples.extend_from_slice(samples);
        self.ranges.push(start..self.samples.len());
    }

    /// Empties it, to be filled again from segment `first` on.
    fn reused(mut self, first: usize) -> Job<W> {
        self.first = first;
        self.samples.clear();
        self.ranges.clear();
        self
    }

    fn work(&mut self, model: &Model<'_>, sensor: &Sensor) {
        *self.border = [[0.0; W]; W];
        self.blocks.resize_with(self.ranges.len(), Blocks::zero);
        self.seen.clear();
        let centre = border::vector(model.constants, border::CENTRE);
        for (i, range) in self.ranges.iter().enumerate() {
            let k = self.first + i;
            let (a, b) = (&model.nodes[k], &model.nodes[k + 1]);
            let samples = &self.samples[range.clone()];
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

/// Jobs that wait for a thread.
struct Queue<const W: usize> {
    /// And whether there will be no more.
    jobs: Mutex<(VecDeque<Job<W>>, bool)>,
    changed: Condvar,
}

impl<const W: usize> Queue<W> {
    fn new() -> Queue<W> {
        Queue {
            jobs: Mutex::new((VecDeque::new(), false)),
            changed: Condvar::new(),
        }
    }

    fn held(&self) -> MutexGuard<'_, (VecDeque<Job<W>>, bool)> {
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a job; returns how many wait now.
    fn push(&self, job: Job<W>) -> usize {
        let mut held = self.held();
        held.0.push_back(job);
        self.changed.notify_one();
        held.0.len()
    }

    fn pop(&self) -> Option<Job<W>> {
        self.held().0.pop_front()
    }

    /// The next one, as soon as there is one; `None` after the last.
    fn next(&self) -> Option<Job<W>> {
        let mut held = self.held();
        loop {
            if let Some(job) = held.0.pop_front() {
                return Some(job);
            }
            if held.1 {
                return None;
            }
            let waited = self.changed.wait(held);
            held = waited.unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Closes a queue whatever becomes of whoever fills it: those who wait for jobs are let go.
struct Closing<'a, const W: usize>(&'a Queue<W>);

impl<const W: usize> Drop for Closing<'_, W> {
    fn drop(&mut self) {
        self.0.held().1 = true;
        self.0.changed.notify_all();
    }
}

/// Done jobs on their way to whoever takes them in order.
struct InOrder<const W: usize, F> {
    take: F,
    /// First segment of the next one.
    next: usize,
    early: BTreeMap<usize, Job<W>>,
    /// Memory that was taken, to be filled again.
    spare: Vec<Job<W>>,
}

impl<const W: usize, F: FnMut(&Job<W>)> InOrder<W, F> {
    fn push(&mut self, job: Job<W>) {
        self.early.insert(job.first, job);
        while let Some(job) = self.early.remove(&self.next) {
            (self.take)(&job);
            self.next += JOB;
            self.spare.push(job);
        }
    }

    fn empty_job(&mut self, first: usize) -> Job<W> {
        match self.spare.pop() {
            Some(job) => job.reused(first),
            None => Job::new(first),
        }
    }
}

/// Sweeps and assembles all segments; `take` gets the jobs in order.
pub(super) fn sweep_all<S: Samples, const W: usize>(
    samples: &mut S,
    with: (&Survey, &Settings),
    model: &Model<'_>,
    take: impl FnMut(&Job<W>),
) -> Result<(), S::Error> {
    let sensor = &Sensor::of(model.constants, with.0.force);
    let helpers = with.1.threads.get() - 1;
    let queue = &Queue::<W>::new();
    let (sender, done) = mpsc::channel();
    let mut in_order = InOrder {
        take,
        next: 0,
        early: BTreeMap::new(),
        spare: Vec::new(),
    };
    std::thread::scope(|scope| {
        let closing = Closing(queue);
        for _ in 0..helpers {
            let sender = sender.clone();
            scope.spawn(move || {
                while let Some(mut job) = queue.next() {
                    job.work(model, sensor);
                    // Whoever takes it outlives the scope.
                    if sender.send(job).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let hand_on = |job: Job<W>, in_order: &mut InOrder<W, _>| {
            if queue.push(job) > WAITING * helpers
                && let Some(mut job) = queue.pop()
            {
                job.work(model, sensor);
                in_order.push(job);
            }
            done.try_iter().for_each(|job| in_order.push(job));
        };
        let mut filling = Job::new(0);
        by_segment(samples, with, model.segments, |k, held| {
            let Some(k) = k else { return };
            filling.push(held);
            if (k + 1).is_multiple_of(JOB) {
                let full = std::mem::replace(&mut filling, in_order.empty_job(k + 1));
                hand_on(full, &mut in_order);
            }
        })?;
        if !filling.ranges.is_empty() {
            hand_on(filling, &mut in_order);
        }
        drop(closing);
        while let Some(mut job) = queue.pop() {
            job.work(model, sensor);
            in_order.push(job);
        }
        // Until the last of the helpers has ended.
        done.iter().for_each(|job| in_order.push(job));
        Ok(())
    })
}
