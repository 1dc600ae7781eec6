//! Samples of one topic -> attitude: the one path that replay, serve, simulate and tests share.
//!
//! Holds the first samples back until it knows the clock, the bias and the initial attitude, then
//! conditions and propagates. Reads no clock and does no I/O.

use super::preparation::{Preparation, Prepared, Resolved};
use crate::condition::stillness::Rests;
use crate::condition::{self, Conditioner};
use crate::config::Plan;
use crate::model::frames::{Convention, World};
use crate::propagate::{self, Executor, Propagator};
use crate::record::{AttitudeSample, RateSample, RawSample};

/// An estimator of one stream.
#[derive(Debug)]
pub struct Estimator {
    plan: Plan,
    resolved: Resolved,
    preparation: Preparation,
    gathered: Vec<RawSample>,
    running: Option<Running>,
    out: Vec<AttitudeSample>,
}

/// From the first samples known on.
#[derive(Debug)]
pub struct Running {
    /// What was decided before the first sample was integrated.
    pub prepared: Prepared,
    conditioner: Conditioner,
    propagator: Propagator,
    rates: Vec<RateSample>,
}

impl Estimator {
    /// For samples understood as `resolved`. `rests` are those of the whole log, where a pass over it
    /// was made; otherwise they are sought in the first samples when the plan needs them.
    #[must_use]
    pub fn new(plan: Plan, resolved: Resolved, rests: Option<Rests>) -> Estimator {
        Estimator {
            preparation: Preparation::new(&plan, rests),
            plan,
            resolved,
            gathered: Vec::new(),
            running: None,
            out: Vec::new(),
        }
    }

    /// Takes samples and gives the attitudes that are now known. Output bits do not depend on how
    /// the stream is cut into calls.
    ///
    /// # Errors
    /// In words, with the flag that helps: the plan can not be carried out on these samples.
    pub fn push(
        &mut self,
        raw: &[RawSample],
        exec: &impl Executor,
    ) -> Result<&[AttitudeSample], String> {
        self.out.clear();
        if self.running.is_none() {
            self.gathered.extend_from_slice(raw);
            if self.preparation.wants_more(&self.gathered) {
                return Ok(&self.out);
            }
            self.begin(exec)?;
        } else if let Some(running) = &mut self.running {
            running.push(raw, exec, &mut self.out);
        }
        self.relabel();
        Ok(&self.out)
    }

    /// No more samples: the rest of the attitudes.
    ///
    /// # Errors
    /// As [`Estimator::push`].
    pub fn finish(&mut self, exec: &impl Executor) -> Result<&[AttitudeSample], String> {
        self.out.clear();
        if self.running.is_none() {
            self.begin(exec)?;
        }
        if let Some(running) = &mut self.running {
            running.finish(exec, &mut self.out);
        }
        self.relabel();
        Ok(&self.out)
    }

    /// How the samples are understood.
    #[must_use]
    pub fn resolved(&self) -> &Resolved {
        &self.resolved
    }

    /// What was decided; `None` before enough samples came.
    #[must_use]
    pub fn prepared(&self) -> Option<&Prepared> {
        self.running.as_ref().map(|r| &r.prepared)
    }

    /// What conditioning did.
    #[must_use]
    pub fn conditioning(&self) -> Option<&condition::Report> {
        self.running.as_ref().map(|r| r.conditioner.report())
    }

    /// What propagation did.
    #[must_use]
    pub fn propagation(&self) -> Option<&propagate::Report> {
        self.running.as_ref().map(|r| r.propagator.report())
    }

    fn begin(&mut self, exec: &impl Executor) -> Result<(), String> {
        let gathered = std::mem::take(&mut self.gathered);
        let prepared = self.preparation.decide(&self.plan, &self.resolved, &gathered)?;
        let conditioner =
            Conditioner::new(self.resolved.conditioning(&self.plan, prepared.clock, prepared.bias))
                .map_err(|e| e.to_string())?;
        let propagator = Propagator::new(propagate::Settings {
            method: self.plan.method,
            kind: self.resolved.kind,
            initial: prepared.initial,
            noise: propagate::Noise {
                arw: self.plan.noise.arw,
                bias_sigma: prepared.bias_sigma,
            },
        })
        .map_err(|e| e.to_string())?;
        let mut running = Running { prepared, conditioner, propagator, rates: Vec::new() };
        running.push(&gathered, exec, &mut self.out);
        self.running = Some(running);
        Ok(())
    }

    /// From the convention everything is computed in (ENU or start, FLU) to the one asked for. World
    /// and body change together.
    fn relabel(&mut self) {
        let Some(world) = self.running.as_ref().map(|r| r.prepared.world) else {
            return;
        };
        if matches!(world, World::Start | World::Enu) {
            return;
        }
        let Some(to) = world.convention() else { return };
        for sample in &mut self.out {
            sample.q_nb = Convention::EnuFlu.convert(to, sample.q_nb);
            sample.rate = Convention::EnuFlu.convert_body(to, sample.rate);
            sample.accel = sample.accel.map(|a| Convention::EnuFlu.convert_body(to, a));
        }
    }
}

impl Running {
    fn push(&mut self, raw: &[RawSample], exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        self.rates.clear();
        self.conditioner.push(raw, &mut self.rates);
        self.propagator.push(&self.rates, exec, out);
    }

    fn finish(&mut self, exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        self.rates.clear();
        self.conditioner.finish(&mut self.rates);
        self.propagator.push(&self.rates, exec, out);
        self.propagator.finish(exec, out);
    }
}
