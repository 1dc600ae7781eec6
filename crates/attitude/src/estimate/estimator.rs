//! Samples of one topic -> attitude: the one path that replay, serve, simulate and tests share.
//!
//! Conditions and propagates; what must be known first ([`Prepared`]) is given. Reads no clock and
//! does no I/O.

mod build;
mod headings;
mod told;

use super::aiding::{self, Forces};
use super::anew::RestartRequest;
use super::gyro_watch::GyroWatch;
use super::integrator::{Auxiliary, Integrator};
use super::kept::{Spool, SpoolError};
use super::magnetometer_watch::MagnetometerWatch;
use super::meaning::Meaning;
use super::memory::Memory;
use super::open_kind::{Event, OpenKind};
use super::output_frame::OutputFrame;
use super::preparation::Prepared;
use super::retaking::{Besides, Retaking, Stages};
use super::sample_kind::{KindChoice, KindReason};
use super::temperatures::Temperatures;
use crate::condition::regularise::Regulariser;
use crate::condition::{self, Clock, Conditioner};
use crate::diagnostic::Diagnostic;
use crate::propagate::Executor;
use crate::record::{AttitudeSample, Nanos, RateSample, RawSample};

/// Samples at once that memory is kept for.
const FEW: usize = 8;

/// An estimator of one stream.
#[derive(Debug)]
pub struct Estimator {
    conditioner: Conditioner,
    regulariser: Option<Regulariser>,
    integrator: Integrator,
    /// Progress of samples that may be a spike.
    retaking: Retaking,
    asked: OutputFrame,
    /// Vectors that came between the rates, each before the rate of this number.
    beside: Besides,
    /// Auxiliary inputs; `None` where nothing of them is used.
    besides: Option<AuxiliaryInputs>,
    /// Watch over the gyro, where somebody wants it; it changes no attitude and is not remembered.
    watch: Option<GyroWatch>,
    /// The same over the magnetometer.
    magnetometer: Option<Box<MagnetometerWatch>>,
    /// Tells settings apart under which a [`Memory`] means something else.
    settings: u64,
    /// The next sample begins anew.
    begins_anew: bool,
    rates: Vec<RateSample>,
    /// The same with their new stamps.
    even: Vec<RateSample>,
    pub(super) out: Vec<AttitudeSample>,
    /// Kind of the samples by now, and why.
    pub(super) sample_kind: KindChoice,
    /// Beginning of a stream whose kind is still to be decided.
    pub(super) open: Option<Box<OpenKind>>,
    /// Attitudes that were made before the kind was decided, and have not left.
    pub(super) before: Vec<AttitudeSample>,
    /// Attitudes up to this stamp have left as of another kind; until the first beyond it.
    pub(super) left_until: Option<Nanos>,
    /// Temperatures of the samples, which change no attitude and are not remembered.
    pub(super) temperatures: Temperatures,
}

/// Auxiliary inputs: what is taken beside the rates.
#[derive(Debug)]
struct AuxiliaryInputs {
    resolved: Meaning,
    clock: Clock,
    forces: Forces,
    has_field: bool,
    /// Multiplies forces, once the first has come.
    force_scale: Option<f64>,
}

impl Estimator {
    /// Goes on from the last attitude of an estimator whose settings were the same, before the first
    /// sample of this one: see [`Propagator::resume`].
    ///
    /// [`Propagator::resume`]: crate::propagate::Propagator::resume
    ///
    /// # Errors
    /// In words: it is no rotation.
    pub fn resume(&mut self, last: &AttitudeSample) -> Result<(), Diagnostic> {
        self.note(|| Event::Resume(Box::new(*last)));
        let last = self.asked.undone(last);
        self.keep_doubted();
        self.integrator.resume(&last)
    }

    /// State, for another estimator to go on exactly; `None` where there is nothing yet, and
    /// where stamps are regularised, which is not kept.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        let is_open = self.open.is_some() && self.sample_kind.reason == KindReason::Unknown;
        if self.regulariser.is_some() || !self.beside.is_empty() || is_open {
            return None;
        }
        let (propagation, aiding) = self.integrator.memory()?;
        Some(Memory {
            settings: self.settings,
            conditioning: self.conditioner.memory()?,
            propagation,
            aiding,
            force_scale: self.besides.as_ref().and_then(|b| b.force_scale),
            sample_kind: match self.sample_kind.reason {
                KindReason::Step(step) => Some((self.sample_kind.kind, step)),
                _ => None,
            },
        })
    }

    /// Goes on as the estimator would have that knew this; what was counted here stays. `false`, and it
    /// is as before, when that had other settings or no estimator can have known it.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        let Some(choice) = memory.sample_kind().filter(|_| self.open.is_some()) else {
            return self.recall_of_kind(memory);
        };
        // Another one, since this one is to stay as it is: of a kind it would wait with its first sample for a step.
        let mut other = match choice.kind == self.sample_kind.kind {
            true => None,
            false => self.of_kind(choice),
        };
        let fits = other.as_mut().unwrap_or(&mut *self).recall_of_kind(memory);
        if let Some(other) = other.filter(|_| fits) {
            *self = other;
        }
        if fits {
            self.sample_kind.reason = choice.reason;
        }
        fits
    }

    fn recall_of_kind(&mut self, memory: &Memory) -> bool {
        if self.regulariser.is_some() || self.settings != memory.settings {
            return false;
        }
        let mut conditioner = self.conditioner.clone();
        let fits = conditioner.recall(&memory.conditioning)
            && self
                .integrator
                .recall(&memory.propagation, memory.aiding.as_ref());
        if fits {
            self.keep_doubted();
            // What is recalled cannot be estimated again.
            self.open = None;
            self.conditioner = conditioner;
            if let Some(besides) = &mut self.besides {
                besides.force_scale = memory.force_scale.filter(|s| s.is_finite());
            }
        }
        fits
    }

    /// Begins as the run after that of `before`, whose samples stay counted: the first attitude says
    /// that it was reset.
    pub fn continue_counts_of(&mut self, before: &condition::Report, resets: u32) {
        self.note(|| Event::ContinueCounts(Box::new(before.clone()), resets));
        self.conditioner.continue_counts_of(before);
        self.integrator.continue_counts_of(resets);
    }

    /// The next sample begins the attitude anew, and says so ([`Status::RESET`]); the run and what was learned of
    /// the sensor go on.
    ///
    /// [`Status::RESET`]: crate::record::Status::RESET
    pub fn begin_anew(&mut self, anew: &RestartRequest) {
        self.note(|| Event::Restart(Box::new(anew.clone())));
        self.keep_doubted();
        self.integrator.begin_anew(anew);
        self.begins_anew = true;
    }

    /// See [`Conditioner::stamp_of`].
    #[must_use]
    pub fn stamp_of(&self, raw: &RawSample, near: Nanos) -> Option<Nanos> {
        self.conditioner.stamp_of(raw, near)
    }

    /// A sample came that its sender has sent before: it is counted, and nothing else.
    pub fn take_late(&mut self, stamp: Nanos) {
        self.note(|| Event::Late(stamp));
        self.conditioner.push_late(stamp);
    }

    /// Takes the next sample.
    #[inline]
    pub fn take(&mut self, raw: &RawSample) {
        if self.open.is_some() {
            self.decide_kind_with(raw);
        }
        if raw.is_beside {
            return self.take_beside(raw);
        }
        self.temperatures.take(raw);
        if raw.mag.is_some() {
            self.take_field(raw);
        }
        if let Some(besides) = &mut self.besides
            && besides.forces == Forces::Unseen
            && raw.accel.is_some()
        {
            besides.forces = Forces::WithRates;
        }
        self.conditioner
            .push(std::slice::from_ref(raw), &mut self.rates);
    }

    /// Takes the specific force, or the magnetic field, of a message that carries no rate: of topics, and at
    /// rates, of their own. What is not asked for ([`EstimationSettings::aid`]), and a force where forces come with the rates
    /// ([`Forces`]), is passed over.
    ///
    /// [`EstimationSettings::aid`]: super::EstimationSettings::aid
    pub fn take_beside(&mut self, raw: &RawSample) {
        self.temperatures.take(raw);
        self.take_field(raw);
        let Some(besides) = &mut self.besides else {
            return;
        };
        let (Some(force), Some(stamp)) = (raw.accel, besides.clock.read(raw)) else {
            return;
        };
        let stamp = self.conditioner.of_auxiliary(stamp);
        match besides.forces {
            Forces::WithRates => return,
            Forces::Beside => {}
            Forces::Unseen => {
                besides.forces = Forces::Beside;
                self.integrator.expect_forces_beside();
            }
        }
        let resolved = &besides.resolved;
        let scale = *besides.force_scale.get_or_insert_with(|| {
            aiding::force_scale(resolved, resolved.force(force).as_vector().norm())
        });
        let force = resolved.calibrated_force(force, scale);
        let place = self.rates.len();
        self.beside.push((place, stamp, Auxiliary::Force(force)));
    }

    fn take_field(&mut self, raw: &RawSample) {
        if let Some(watch) = &mut self.magnetometer {
            watch.take_field(raw, |stamp| self.conditioner.of_auxiliary(stamp));
        }
        let Some(besides) = self.besides.as_ref().filter(|b| b.has_field) else {
            return;
        };
        let Some((field, stamp)) = raw.mag.zip(besides.clock.read(raw)) else {
            return;
        };
        let stamp = self.conditioner.of_auxiliary(stamp);
        let (field, lead) = besides.resolved.field(field);
        let stamp = Nanos(stamp.0.saturating_add((lead * 1e9).round() as i64));
        let place = self.rates.len();
        self.beside.push((place, stamp, Auxiliary::Field(field)));
    }

    /// A payload that could not be decoded stood here in the stream.
    pub fn take_undecodable(&mut self) {
        self.note(|| Event::Undecodable);
        self.conditioner.push_undecodable(1);
    }

    /// The attitudes that are known by now. Their bits do not depend on when they are asked for.
    pub fn attitudes(&mut self, exec: &impl Executor) -> &[AttitudeSample] {
        self.make(exec);
        std::mem::swap(&mut self.out, &mut self.before);
        if let Some(open) = &mut self.open {
            open.note_out(&self.out);
        }
        self.asked.apply(&mut self.out);
        self.temperatures.apply(&mut self.out);
        &self.out
    }

    /// Makes the attitudes that are known by now, for the next that asks.
    pub(super) fn make(&mut self, exec: &impl Executor) {
        self.out.clear();
        self.propagate(exec);
        if self.left_until.is_some() {
            self.leave_out_what_left();
        }
        match self.before.is_empty() {
            true => std::mem::swap(&mut self.out, &mut self.before),
            false => self.before.append(&mut self.out),
        }
    }

    /// Watches sensors and keeps innovations where the one before did, from the first sample on.
    pub(super) fn watch_as(&mut self, before: &Estimator, resolved: &Meaning, prepared: &Prepared) {
        match (&before.watch, before.field_consistency()) {
            (None, _) => {}
            (_, Some(field)) if field.is_live() => self.watch_sensors_live(resolved, prepared),
            _ => self.watch_sensors(resolved, prepared),
        }
        if before.integrator.keeps_innovations() {
            self.keep_innovations();
        }
    }

    /// Gives back the memory that only many samples at once need: one of many sensors waits for its next ones.
    pub fn trim(&mut self) {
        self.rates.shrink_to(FEW);
        self.out.clear();
        self.out.shrink_to(FEW);
    }

    /// Keeps in `spool` what a recording that is smoothed needs beyond some hundred megabytes: for
    /// [`Estimator::finish_into`], before the first sample.
    pub fn spool_to(&mut self, spool: Box<dyn Spool>) {
        self.integrator.spool_to(spool);
    }

    /// Ends it: returns the rest of the attitudes, at once.
    pub fn finish(&mut self, exec: &impl Executor) -> Vec<AttitudeSample> {
        let mut all = Vec::new();
        let done = self.finish_into(exec, |attitudes| {
            all.extend_from_slice(attitudes);
            Ok::<(), SpoolError>(())
        });
        debug_assert!(done.is_ok(), "nothing fails in memory: {done:?}");
        all
    }

    /// Ends it: gives the rest of the attitudes to `take`, in pieces; of a recording that is smoothed these are
    /// all.
    ///
    /// # Errors
    /// Those of `take`, which is not called again then; of the spool.
    pub fn finish_into<E: From<SpoolError>>(
        &mut self,
        exec: &impl Executor,
        mut take: impl FnMut(&[AttitudeSample]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.conditioner.finish(&mut self.rates);
        self.make(exec);
        self.keep_doubted();
        std::mem::swap(&mut self.out, &mut self.before);
        if let Some(regulariser) = &mut self.regulariser {
            regulariser.finish(&mut self.even);
            self.integrator.push(&self.even, exec, &mut self.out);
            self.even.clear();
        }
        let asked = self.asked;
        let mut temperatures = std::mem::take(&mut self.temperatures);
        let mut taken = Ok(());
        self.integrator
            .finish(exec, &mut self.out, &mut |attitudes| {
                if taken.is_ok() {
                    asked.apply(attitudes);
                    temperatures.apply(attitudes);
                    taken = take(attitudes);
                }
            })?;
        taken
    }

    /// Integrates what was conditioned.
    fn propagate(&mut self, exec: &impl Executor) {
        let besides = std::mem::take(&mut self.beside);
        let between = (besides, self.conditioner.revisions());
        let mut rates = std::mem::take(&mut self.rates);
        let (retaking, mut stages) = self.stages();
        let left = retaking.integrate(&mut stages, &mut rates, between, exec);
        if left > 0 {
            self.conditioner.leave_spikes(left);
        }
        rates.clear();
        self.rates = rates;
    }

    /// Samples that may be a spike stay as they are.
    fn keep_doubted(&mut self) {
        let (retaking, mut stages) = self.stages();
        retaking.keep(&mut stages);
    }

    fn stages(&mut self) -> (&mut Retaking, Stages<'_>) {
        let stages = Stages {
            integrator: &mut self.integrator,
            regulariser: &mut self.regulariser,
            gyro: &mut self.watch,
            magnetometer: &mut self.magnetometer,
            begins_anew: &mut self.begins_anew,
            even: &mut self.even,
            out: &mut self.out,
        };
        (&mut self.retaking, stages)
    }
}
