//! The stream: runs, breaks, outputs in order. Pure.
//!
//! Long because it is one machine: what is admitted, integrated, committed and forgotten moves the same queue, the same
//! track and the same place in it.

mod memory;
mod state;
mod world;

pub use memory::Memory;

use super::classical;
use super::columns::{Track, secs};
use super::executor::Executor;
use super::method::{LARGEST_WINDOW, Method, Order, Placement};
use super::report::Report;
use super::settings::{Settings, SettingsError};
use super::turn::Turn;
use super::window::{Step, WindowKernel};
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::{AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status};
use nalgebra::Vector3;
use state::{Output, PendingSample};
use std::collections::VecDeque;
use std::sync::Arc;

/// Intervals one call of the executor's function integrates.
const SEGMENT: usize = 1024;
/// Samples taken in before outputs are made: bounds memory, whatever is pushed at once.
const BLOCK: usize = 32 * SEGMENT;
/// Elements before the interval integrated next that a window may still hold.
const LOOKED_BACK: usize = LARGEST_WINDOW + MARGIN;
/// Number of samples kept beyond the window itself.
const MARGIN: usize = classical::LOOK_BACK + 8;
/// Elements that are forgotten at once: few, for who has many live streams.
const FORGOTTEN: usize = 32;
/// Fastest rate, and largest increment, that is believed: those of [`crate::record::Verdict::Huge`].
const FASTEST: f64 = 1e4;
const LARGEST: f64 = 1e3;

/// Integrates a stream of samples to attitude. See the [module](crate::propagate).
///
/// # Example
/// ```
/// use strapd_attitude::quaternion::{BodyRate, Quaternion};
/// use strapd_attitude::propagate::{Method, Propagator, Sequential, Settings};
/// use strapd_attitude::record::{Join, Measured, Nanos, RateSample, SampleKind, Status};
///
/// let mut propagator = Propagator::new(Settings {
///     method: Method::Auto,
///     kind: SampleKind::Rate,
///     initial: Quaternion::identity(),
///     ..Settings::default()
/// })?;
/// // A quarter turn about z in one second.
/// let samples: Vec<RateSample> = (0..=100)
///     .map(|i| RateSample {
///         stamp: Nanos(i * 10_000_000),
///         start: Nanos(i * 10_000_000),
///         gyro: Measured::Rate(BodyRate([0.0, 0.0, std::f64::consts::FRAC_PI_2].into())),
///         accel: None,
///         join: if i == 0 { Join::Start } else { Join::Continuous },
///         status: Status::OK,
///         log: Nanos(i * 10_000_000),
///     })
///     .collect();
/// let mut attitudes = Vec::new();
/// propagator.push(&samples, &Sequential, &mut attitudes);
/// propagator.finish(&Sequential, &mut attitudes);
/// assert_eq!(attitudes.len(), 101);
/// let [w, x, y, z] = attitudes[100].q_nb.wxyz();
/// let half = std::f64::consts::FRAC_1_SQRT_2;
/// assert!((w - half).abs() < 1e-15 && (z - half).abs() < 1e-15 && x == 0.0 && y == 0.0);
/// # Ok::<(), strapd_attitude::propagate::SettingsError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Propagator {
    method: Method,
    engine: Engine,
    track: Track,
    /// Samples not yet output. Those that turn nothing come out with the attitude before them.
    queue: VecDeque<PendingSample>,
    /// Element whose interval is integrated next.
    next: usize,
    output: Output,
    started: bool,
    /// The attitude is not that of this stream's beginning, but one that was saved.
    resumed: bool,
    /// Attitude of the next reset, if it is not the initial one.
    anew: Option<[f64; 4]>,
    /// Provisional steps, kept for its memory.
    scratch: Vec<Step>,
}

/// Engine that computes the steps.
#[derive(Clone, Debug)]
enum Engine {
    Sliding(Arc<WindowKernel>),
    Commit {
        plan: Arc<WindowKernel>,
        /// Whether finals are wanted.
        finals: bool,
        /// Attitudes that have come out provisionally and are to come out for good.
        open: VecDeque<PendingSample>,
    },
    Classical(Method),
}

/// Value of a sample that can be calculated with.
struct Trusted {
    /// Rate or increment, as announced.
    value: Vector3<f64>,
    /// Start of its interval.
    start: Nanos,
    status: Status,
}

impl Propagator {
    /// Ready for the first sample.
    ///
    /// # Errors
    /// A window out of range, an initial attitude that is no rotation, impossible noise.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        let increments = settings.kind != SampleKind::Rate;
        let initial = settings.checked()?;
        let method = settings.method.for_kind(settings.kind);
        let engine = match method {
            Method::Auto => {
                let window = if increments { 15 } else { 16 };
                let plan = plan(window, Order::Exact, Placement::Centred, increments, false)?;
                Engine::Sliding(plan)
            }
            Method::Magnus {
                window,
                order,
                placement,
            } => Engine::Sliding(plan(window, order, placement, increments, false)?),
            Method::CommitProvisional {
                window,
                order,
                finals,
            } => Engine::Commit {
                plan: plan(window, order, Placement::Centred, increments, true)?,
                finals,
                open: VecDeque::new(),
            },
            classical => Engine::Classical(classical),
        };
        Ok(Propagator {
            method,
            engine,
            track: Track::new(increments),
            queue: VecDeque::new(),
            next: 1,
            output: Output::new(&settings, initial),
            started: false,
            resumed: false,
            anew: None,
            scratch: Vec::new(),
        })
    }

    /// Goes on from the last attitude of a stream that has ended, before this one's first sample: it is
    /// held until then, and less is known of it the longer that was, as over any gap; the first output
    /// says [`Status::RESTARTED`] and is one reset further. A later reset goes to the initial attitude of
    /// the settings all the same.
    ///
    /// # Errors
    /// [`SettingsError::Initial`] when it is no rotation.
    pub fn resume(&mut self, last: &AttitudeSample) -> Result<(), SettingsError> {
        let wxyz = last.q_nb.wxyz();
        let norm = wxyz.iter().map(|c| c * c).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > 1e-6 || norm.is_nan() {
            return Err(SettingsError::Initial { wxyz });
        }
        self.output.resume(last);
        self.resumed = true;
        self.output.state.last = last.stamp.0;
        if last.rate.0.iter().all(|w| w.abs() <= FASTEST) {
            self.output.state.rates.sample = last.rate.0.into();
        }
        Ok(())
    }

    /// Begins as the run after one that was reset so often: the first output says [`Status::RESET`].
    pub fn continue_counts_of(&mut self, resets: u32) {
        self.output.state.resets = resets.saturating_add(1);
        self.output.state.added = self.output.state.added.with(Status::RESET);
    }

    /// The next sample that says [`Join::Reset`] begins with this attitude, and not with the initial one.
    pub fn begin_anew(&mut self, attitude: &Quaternion<Nav, Body>) {
        self.anew = Some(attitude.wxyz());
    }

    /// Takes samples in and appends the attitudes that are ready: all but the last few, which wait
    /// for the method's look-ahead.
    pub fn push(
        &mut self,
        samples: &[RateSample],
        exec: &impl Executor,
        out: &mut Vec<AttitudeSample>,
    ) {
        for block in samples.chunks(BLOCK) {
            for sample in block {
                let breaks =
                    !self.started || matches!(sample.join, Join::Start | Join::Hold | Join::Reset);
                if breaks {
                    self.advance(true, exec, out);
                    self.begin(sample, out);
                } else {
                    self.admit(sample);
                }
                if matches!(self.engine, Engine::Commit { .. }) {
                    self.advance_live(out);
                    self.forget();
                }
            }
            self.advance(false, exec, out);
            self.forget();
        }
    }

    /// The stream has ended: appends the attitudes still waiting. More samples may follow; unless they
    /// say otherwise, the attitude is held between.
    pub fn finish(&mut self, exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        self.advance(true, exec, out);
        self.started = false;
    }

    /// Report of what has happened so far.
    #[must_use]
    pub fn report(&self) -> Report {
        let report = &self.output.report;
        let tells = match &self.engine {
            Engine::Sliding(plan) | Engine::Commit { plan, .. } => plan.tells_error(),
            Engine::Classical(_) => false,
        };
        Report {
            integration_error: tells.then(|| self.output.difference.worst(report.angle_turned)),
            integrated_secs: secs(self.output.integrated_nanos),
            ..*report
        }
    }

    /// The method, with its window and order.
    #[must_use]
    pub fn method(&self) -> Method {
        self.method
    }

    /// Samples the outputs lag behind the input.
    #[must_use]
    pub fn latency(&self) -> usize {
        match &self.engine {
            Engine::Sliding(plan) => plan.look_ahead,
            Engine::Commit { .. } | Engine::Classical(_) => 0,
        }
    }

    /// First sample of a run.
    fn begin(&mut self, sample: &RateSample, out: &mut Vec<AttitudeSample>) {
        self.output.state.rates.sample = self.last_rate();
        self.track.clear();
        self.next = 1;
        let trusted = self.trusted(sample);
        let resumed = std::mem::take(&mut self.resumed);
        let first = self.output.report.samples == 0 && !resumed;
        self.output.begin(sample.stamp.0);
        if sample.join == Join::Reset {
            self.output
                .reset(self.anew.take().unwrap_or(self.output.state.initial));
        }
        if !first {
            self.output.state.resets = self.output.state.resets.saturating_add(1);
            let gap = secs(sample.stamp.0.saturating_sub(self.output.state.last));
            let status = if sample.join == Join::Reset {
                self.output.report.resets += 1;
                self.output.covariance.pass(gap);
                Status::RESET
            } else {
                self.output.report.holds += 1;
                let [x, y, z] = self.output.state.rates.sample;
                self.output
                    .covariance
                    .hold(Vector3::new(x, y, z).norm(), gap);
                Status::HELD
            };
            self.output.state.added = self.output.state.added.with(status);
        }
        if resumed {
            self.output.state.added = self.output.state.added.with(Status::RESTARTED);
        }
        self.started = true;
        self.append(sample, &trusted);
        let rate = self.track.rate(0);
        let pending = PendingSample::of(sample, trusted.status, true);
        self.output.output_at(&pending, Some(rate), out);
    }

    /// Any later sample of a run.
    #[inline]
    fn admit(&mut self, sample: &RateSample) {
        let mut trusted = self.trusted(sample);
        // Nothing is missing, or it was held: `begin` says so itself.
        if std::mem::take(&mut self.resumed) && sample.join == Join::Bridge {
            trusted.status = trusted.status.with(Status::RESTARTED);
        }
        let turns = sample.stamp.0 > self.output.state.last;
        if turns {
            self.append(sample, &trusted);
        } else {
            self.output.report.stalled += 1;
        }
        self.queue
            .push_back(PendingSample::of(sample, trusted.status, turns));
    }

    #[inline]
    fn append(&mut self, sample: &RateSample, trusted: &Trusted) {
        let bridged = sample.join == Join::Bridge;
        self.track.push(
            sample.stamp.0,
            trusted.start.0,
            trusted.value.into(),
            bridged,
        );
        self.output.state.last = sample.stamp.0;
    }

    /// Value of a sample that can be calculated with, a rate or an increment, whichever [`Settings::kind`] has said:
    /// windows hold one of the two.
    #[inline]
    fn trusted(&mut self, sample: &RateSample) -> Trusted {
        let (value, start) = match (sample.gyro, self.track.increments) {
            (Measured::Rate(_), false) | (Measured::Increment(_), true) => {
                (*sample.gyro.as_vector(), sample.start)
            }
            // Whatever interval it had: its rate counts since the sample before.
            (other, _) => (self.converted(sample, other), sample.stamp),
        };
        let limit = self.limit();
        let trusted = Trusted {
            value,
            start,
            status: sample.status,
        };
        match value.iter().all(|v| v.abs() <= limit) {
            true => trusted,
            false => self.replaced(sample, &trusted),
        }
    }

    /// Rate of the last sample, rad/s; before the first that of the run before.
    fn last_rate(&self) -> [f64; 3] {
        match self.track.len().checked_sub(1) {
            Some(last) => self.track.rate(last).into(),
            None => self.output.state.rates.sample,
        }
    }

    /// Largest value that a gyro delivers.
    fn limit(&self) -> f64 {
        match self.track.increments {
            true => LARGEST,
            false => FASTEST,
        }
    }

    /// The rate before stands in for a value that is not finite, or that no gyro delivers, and says so.
    #[cold]
    fn replaced(&mut self, sample: &RateSample, trusted: &Trusted) -> Trusted {
        self.output.report.rejected += 1;
        let [x, y, z] = self.last_rate();
        let factor = match self.track.increments {
            true => secs(sample.stamp.since(trusted.start).max(0)),
            false => 1.0,
        };
        let before = Vector3::new(x, y, z) * factor;
        let is_small = before.iter().all(|v| v.abs() <= self.limit());
        Trusted {
            value: if is_small { before } else { Vector3::zeros() },
            start: trusted.start,
            status: trusted.status.with(Status::REJECTED_BEFORE),
        }
    }

    /// Converts a value of a kind that was not announced: a rate is taken as held since the sample before, an
    /// increment as its mean rate.
    #[cold]
    fn converted(&self, sample: &RateSample, other: Measured) -> Vector3<f64> {
        match other {
            Measured::Increment(_) => sample.mean_rate().0,
            Measured::Rate(rate) => {
                let since = sample.stamp.0.saturating_sub(self.output.state.last).max(0);
                let is_first = self.track.len() == 0;
                rate.held_for(if is_first { 0.0 } else { secs(since) }).0
            }
        }
    }

    /// Integrates every interval whose window is known: to the end of the run if it has `ended`.
    fn advance(&mut self, ended: bool, exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        let known = self.known(ended);
        // Those at the front follow the sample output last.
        self.output.flush_stalled(&mut self.queue, out);
        match &self.engine {
            Engine::Sliding(plan) => {
                let (track, first) = (&self.track, self.next);
                let count = known.saturating_sub(first);
                let segments = exec.map(count.div_ceil(SEGMENT), |i| {
                    let from = first + i * SEGMENT;
                    plan.steps(track, from, (from + SEGMENT).min(known) - 1)
                });
                out.reserve(count);
                for step in segments.iter().flatten() {
                    self.next += 1;
                    self.output.step(step, &self.track, self.next - 1);
                    self.output
                        .emit(&mut self.queue, &self.track, self.next - 1, out);
                }
            }
            Engine::Classical(method) => {
                for k in self.next..known {
                    let step = classical::step(*method, &self.track, k);
                    self.next += 1;
                    self.output.step(&step, &self.track, k);
                    self.output.emit(&mut self.queue, &self.track, k, out);
                }
            }
            Engine::Commit { .. } => {
                if ended {
                    self.commit(known, out);
                }
            }
        }
    }

    /// End of the intervals that can be integrated for good.
    fn known(&self, ended: bool) -> usize {
        let plan = match &self.engine {
            Engine::Sliding(plan) | Engine::Commit { plan, .. } => plan,
            Engine::Classical(_) => return self.track.len(),
        };
        if ended {
            return self.track.len();
        }
        // A centred window at the start of a run is one-sided: its samples must all have come.
        let starting = self.track.base == 0 && plan.look_ahead > 0;
        if starting && self.track.len() < plan.window + self.track.first() {
            return 0;
        }
        self.track.len().saturating_sub(plan.look_ahead)
    }

    /// Elements before the next that a window may still look at.
    fn looked_back(&self) -> usize {
        match &self.engine {
            Engine::Sliding(plan) | Engine::Commit { plan, .. } => plan.window + MARGIN,
            Engine::Classical(_) => MARGIN,
        }
    }

    /// Drops elements no window needs any more, now and then.
    fn forget(&mut self) {
        let needed = self.next.saturating_sub(self.looked_back());
        if needed >= FORGOTTEN {
            self.track.drop_front(needed);
            self.next -= needed;
        }
    }

    /// Commit/provisional: after each sample, commits what has its look-ahead and outputs the newest
    /// attitude with provisional steps on top (docs/theory/attitude.md 4.3).
    fn advance_live(&mut self, out: &mut Vec<AttitudeSample>) {
        let known = self.known(false);
        self.commit(known, out);
        let Engine::Commit { plan, finals, open } = &mut self.engine else {
            return;
        };
        while let Some(sample) = self.queue.pop_front() {
            let newest = self.track.len() - 1;
            let rate = sample.turns.then(|| self.track.rate(newest));
            let mut ahead = self.output.attitude;
            let mut covariance = self.output.covariance;
            let mut difference = self.output.difference;
            if newest >= self.next {
                self.scratch.clear();
                plan.append_steps(&self.track, self.next, newest, &mut self.scratch);
                // Sigma goes ahead in one turn: the order of a few samples is nothing it shows, and their steps are most of
                // what a live sample costs it.
                let (mut turned, mut span) = (Turn::NONE, 0.0);
                for (i, step) in self.scratch.iter().enumerate() {
                    ahead.turn(step.turn);
                    difference.add(&ahead, step.outer);
                    turned = turned.then(Turn::of(step.turn));
                    span += self.track.step(self.next + i);
                    covariance.bridge(step.gap_variance);
                }
                covariance.advance(turned.parts(), span);
                if let (true, Some(step)) = (sample.turns, self.scratch.last()) {
                    self.output.state.added = self.output.state.added.with(step.status());
                }
                self.output.state.added = self.output.state.added.with(Status::PROVISIONAL);
                if *finals {
                    open.push_back(sample);
                }
            }
            self.output.difference.seen(&difference);
            let committed = std::mem::replace(&mut self.output.attitude, ahead);
            let now = std::mem::replace(&mut self.output.state.now, self.track.stamp[newest]);
            self.output
                .output_known(&sample, rate, covariance.attitude(), out);
            (self.output.attitude, self.output.state.now) = (committed, now);
        }
    }

    fn commit(&mut self, known: usize, out: &mut Vec<AttitudeSample>) {
        let Engine::Commit { plan, finals, open } = &mut self.engine else {
            return;
        };
        if known <= self.next {
            return;
        }
        self.scratch.clear();
        plan.append_steps(&self.track, self.next, known - 1, &mut self.scratch);
        for step in &self.scratch {
            let k = self.next;
            self.next += 1;
            self.output.step(step, &self.track, k);
            if !self.queue.is_empty() && k + 1 == self.track.len() {
                // Without look-ahead the newest is final at once, and its output is still to come.
                break;
            }
            if *finals {
                // The second output of the same samples: they count once.
                let counted = self.output.report.samples;
                self.output.emit(open, &self.track, k, out);
                self.output.report.samples = counted;
            } else {
                self.output.state.added = Status::OK;
            }
        }
    }
}

fn plan(
    window: usize,
    order: Order,
    placement: Placement,
    increments: bool,
    provisional: bool,
) -> Result<Arc<WindowKernel>, SettingsError> {
    let smallest = if increments { 1 } else { 2 };
    if !(smallest..=LARGEST_WINDOW).contains(&window) {
        return Err(SettingsError::Window {
            given: window,
            smallest,
            largest: LARGEST_WINDOW,
        });
    }
    Ok(WindowKernel::shared(
        window,
        order,
        placement,
        increments,
        provisional,
    ))
}
