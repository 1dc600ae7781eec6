//! Samples of one topic -> attitude: the one path that replay, serve, simulate and tests share.
//!
//! Conditions and propagates; what must be known first ([`Prepared`]) is given. Reads no clock and
//! does no I/O.

use super::meaning::Meaning;
use super::plan::Plan;
use super::preparation::Prepared;
use crate::aid::{self, Aided};
use crate::condition::regularise::{self, Regulariser};
use crate::condition::{self, Conditioner};
use crate::propagate::{self, Executor, Method, Propagator};
use crate::quaternion::RotationVector;
use crate::record::{AttitudeSample, Nanos, RateSample, RawSample};
use crate::worlds::{Convention, World};

/// An estimator of one stream.
#[derive(Debug)]
pub struct Estimator {
    conditioner: Conditioner,
    regulariser: Option<Regulariser>,
    integrator: Integrator,
    /// Of the sensor's own filters, s.
    delay: f64,
    world: World,
    /// Tells settings apart under which a [`Memory`] means something else.
    settings: u64,
    rates: Vec<RateSample>,
    /// The same with their new stamps.
    even: Vec<RateSample>,
    out: Vec<AttitudeSample>,
}

/// Rates -> attitudes.
#[derive(Debug)]
enum Integrator {
    Alone(Box<Propagator>),
    Aided(Box<Aided>),
}

impl Integrator {
    fn push(&mut self, rates: &[RateSample], exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        match self {
            Integrator::Alone(propagator) => propagator.push(rates, exec, out),
            // What a sample is corrected by hangs on those before it.
            Integrator::Aided(aided) => aided.push(rates, out),
        }
    }

    fn finish(&mut self, exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        match self {
            Integrator::Alone(propagator) => propagator.finish(exec, out),
            Integrator::Aided(aided) => aided.finish(out),
        }
    }
}

/// What an estimator knows at one moment: a few kilobytes of text.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Memory {
    settings: u64,
    conditioning: condition::Memory,
    propagation: propagate::Memory,
}

impl Memory {
    /// The last stamp that was used.
    #[must_use]
    pub fn last(&self) -> Option<Nanos> {
        self.conditioning.last()
    }
}

impl Estimator {
    /// For samples understood as `resolved`, from what `prepared` says.
    ///
    /// The method without latency takes them as [`Estimator::live`] does, in a replay, too: what it gives
    /// is what a daemon would have said.
    ///
    /// # Errors
    /// In words, with the flag that helps: settings that can not be.
    pub fn new(plan: &Plan, resolved: &Meaning, prepared: &Prepared) -> Result<Estimator, String> {
        if matches!(
            plan.method,
            Method::Live { .. } | Method::CommitProvisional { .. }
        ) {
            return Estimator::live(plan, resolved, prepared);
        }
        let settings = conditioning(plan, resolved, prepared);
        Estimator::with(plan, resolved, prepared, &settings)
    }

    /// The same for a live stream: no sample waits for its successors, so one that comes late is
    /// dropped and counted.
    ///
    /// # Errors
    /// As [`Estimator::new`].
    pub fn live(plan: &Plan, resolved: &Meaning, prepared: &Prepared) -> Result<Estimator, String> {
        let settings = condition::Settings {
            reorder_window: condition::Settings::LIVE_WINDOW,
            ..conditioning(plan, resolved, prepared)
        };
        Estimator::with(plan, resolved, prepared, &settings)
    }

    fn with(
        plan: &Plan,
        resolved: &Meaning,
        prepared: &Prepared,
        settings: &condition::Settings,
    ) -> Result<Estimator, String> {
        let propagation = propagate::Settings {
            method: plan.method,
            kind: resolved.kind,
            initial: prepared.initial,
            world_rate: prepared.world_rate,
            noise: plan.noise.with_bias(prepared.bias_sigma.into()),
        };
        let noise = propagation.noise;
        let integrator = match &prepared.aiding {
            None => Propagator::new(propagation).map(|p| Integrator::Alone(Box::new(p))),
            Some(aiding) => Aided::new(propagation, aiding.settings, aiding.start)
                .map(|aided| Integrator::Aided(Box::new(aided))),
        }
        .map_err(|e| e.to_string())?;
        Ok(Estimator {
            settings: told_apart(&format!(
                "{settings:?} {:?} {:?} {noise:?}",
                plan.method, prepared.world_rate
            )),
            conditioner: Conditioner::new(settings).map_err(|e| e.to_string())?,
            regulariser: prepared.stamps.regulariser(resolved.kind)?,
            integrator,
            delay: plan.sensor_delay_secs,
            world: prepared.world,
            rates: Vec::new(),
            even: Vec::new(),
            out: Vec::new(),
        })
    }

    /// Goes on from the last attitude of an estimator whose settings were the same, before the first
    /// sample of this one: see [`Propagator::resume`].
    ///
    /// # Errors
    /// In words: it is no rotation.
    pub fn resume(&mut self, last: &AttitudeSample) -> Result<(), String> {
        let mut last = *last;
        if let Some(from) = self.world.convention() {
            last = relabelled(&last, from, Convention::EnuFlu);
        }
        if self.delay != 0.0 {
            let back = RotationVector(last.rate * -self.delay);
            last.q_nb = last.q_nb.advanced(&back).normalised();
        }
        match &mut self.integrator {
            Integrator::Alone(propagator) => propagator.resume(&last),
            Integrator::Aided(aided) => aided.resume(&last),
        }
        .map_err(|e| e.to_string())
    }

    /// What it knows, for another estimator to go on exactly; `None` where there is nothing yet, and
    /// where stamps are regularised or the attitude is aided, which is not kept.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        let Integrator::Alone(propagator) = &self.integrator else {
            return None;
        };
        if self.regulariser.is_some() {
            return None;
        }
        Some(Memory {
            settings: self.settings,
            conditioning: self.conditioner.memory()?,
            propagation: propagator.memory()?,
        })
    }

    /// Goes on as the estimator would have that knew this; what was counted here stays. `false`, and it
    /// is as before, when that had other settings or no estimator can have known it.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        let Integrator::Alone(propagator) = &mut self.integrator else {
            return false;
        };
        if self.regulariser.is_some() || self.settings != memory.settings {
            return false;
        }
        let mut conditioner = self.conditioner.clone();
        let fits =
            conditioner.recall(&memory.conditioning) && propagator.recall(&memory.propagation);
        if fits {
            self.conditioner = conditioner;
        }
        fits
    }

    /// Begins as the run after that of `before`, whose samples stay counted: the first attitude says
    /// that it was reset.
    pub fn succeed(&mut self, before: &condition::Report, resets: u32) {
        self.conditioner.succeed(before);
        match &mut self.integrator {
            Integrator::Alone(propagator) => propagator.succeed(resets),
            Integrator::Aided(aided) => aided.succeed(resets),
        }
    }

    /// See [`Conditioner::stamp_of`].
    #[must_use]
    pub fn stamp_of(&self, raw: &RawSample, near: Nanos) -> Option<Nanos> {
        self.conditioner.stamp_of(raw, near)
    }

    /// See [`Conditioner::push_late`].
    pub fn take_late(&mut self, stamp: Nanos) {
        self.conditioner.push_late(stamp);
    }

    /// Takes the next sample.
    #[inline]
    pub fn take(&mut self, raw: &RawSample) {
        self.conditioner
            .push(std::slice::from_ref(raw), &mut self.rates);
    }

    /// A payload that could not be decoded stood here in the stream.
    pub fn take_undecodable(&mut self) {
        self.conditioner.push_undecodable(1);
    }

    /// The attitudes that are known by now. Their bits do not depend on when they are asked for.
    pub fn attitudes(&mut self, exec: &impl Executor) -> &[AttitudeSample] {
        self.out.clear();
        self.propagate(exec);
        self.catch_up();
        self.relabel();
        &self.out
    }

    /// No more samples: the rest of the attitudes.
    pub fn finish(&mut self, exec: &impl Executor) -> &[AttitudeSample] {
        self.out.clear();
        self.conditioner.finish(&mut self.rates);
        self.propagate(exec);
        if let Some(regulariser) = &mut self.regulariser {
            regulariser.finish(&mut self.even);
            self.integrator.push(&self.even, exec, &mut self.out);
            self.even.clear();
        }
        self.integrator.finish(exec, &mut self.out);
        self.catch_up();
        self.relabel();
        &self.out
    }

    fn propagate(&mut self, exec: &impl Executor) {
        match &mut self.regulariser {
            None => self.integrator.push(&self.rates, exec, &mut self.out),
            Some(regulariser) => {
                regulariser.push(&self.rates, &mut self.even);
                self.integrator.push(&self.even, exec, &mut self.out);
                self.even.clear();
            }
        }
        self.rates.clear();
    }

    /// What conditioning did.
    #[must_use]
    pub fn conditioning(&self) -> &condition::Report {
        self.conditioner.report()
    }

    /// What became of the stamps, where they were regularised: whether causally, and how.
    #[must_use]
    pub fn regularising(&self) -> Option<(bool, regularise::Report)> {
        let regulariser = self.regulariser.as_ref()?;
        Some((regulariser.is_causal(), regulariser.report()))
    }

    /// What propagation did.
    #[must_use]
    pub fn propagation(&self) -> propagate::Report {
        match &self.integrator {
            Integrator::Alone(propagator) => propagator.report(),
            Integrator::Aided(aided) => aided.propagation(),
        }
    }

    /// What corrects the attitude, where something does.
    #[must_use]
    pub fn filter(&self) -> Option<&aid::Filter> {
        match &self.integrator {
            Integrator::Alone(_) => None,
            Integrator::Aided(aided) => Some(aided.filter()),
        }
    }

    /// The method, with its window and order.
    #[must_use]
    pub fn method(&self) -> Method {
        match &self.integrator {
            Integrator::Alone(propagator) => propagator.method(),
            Integrator::Aided(aided) => aided.method(),
        }
    }

    /// What a sensor measured late has happened at the stamp already.
    fn catch_up(&mut self) {
        if self.delay == 0.0 {
            return;
        }
        for sample in &mut self.out {
            let turn = RotationVector(sample.rate * self.delay);
            sample.q_nb = sample.q_nb.advanced(&turn).normalised();
        }
    }

    /// From the convention everything is computed in (ENU or start, FLU) to the one asked for. World
    /// and body change together.
    fn relabel(&mut self) {
        let to = match self.world.convention() {
            None | Some(Convention::EnuFlu) => return,
            Some(to) => to,
        };
        for sample in &mut self.out {
            *sample = relabelled(sample, Convention::EnuFlu, to);
        }
    }
}

fn conditioning(plan: &Plan, resolved: &Meaning, prepared: &Prepared) -> condition::Settings {
    let settings = resolved.conditioning(plan, prepared.clock, prepared.bias);
    let scale = prepared.aiding.map_or(1.0, |aiding| aiding.force_scale);
    condition::Settings {
        accel_scale: settings.accel_scale * scale,
        truncation_step: prepared.truncation_step,
        ..settings
    }
}

/// A number for a text, the same in every release (FNV-1a).
fn told_apart(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The same attitude between other axes: world and body change together.
fn relabelled(sample: &AttitudeSample, from: Convention, to: Convention) -> AttitudeSample {
    AttitudeSample {
        q_nb: from.convert(to, sample.q_nb),
        rate: from.convert_body(to, sample.rate),
        covariance: sample.covariance.relabelled(|v| from.convert_body(to, v)),
        accel: sample.accel.map(|a| from.convert_body(to, a)),
        ..*sample
    }
}
