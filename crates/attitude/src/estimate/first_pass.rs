//! A pass over samples before the first is integrated. Pure.
//!
//! Apart from the preparation because it decides, and a pass only looks: at samples conditioned as in
//! the run, with no bias taken out, on the clock the first of them choose.

use super::clock_pass::{SharedStamps, coarse_clock};
use super::meaning::Meaning;
use super::plan::EstimationSettings;
use super::sample_kind::AHEAD;
use crate::condition::stillness::{Limits, Rests, Stillness};
use crate::condition::{self, ClockSet, Conditioner, choose_clock_as};
use crate::diagnostic::Diagnostic;
use crate::quaternion::BodyRate;
use crate::record::{Counts, RateSample, RawSample};

/// Samples that tell the clock and hold the first orientation.
pub const FEW: usize = AHEAD;
/// Samples in which is sought what nobody asked for, or what cannot be read twice: three minutes at 1 kHz.
pub(super) const MANY: usize = 200_000;

/// Samples as the run will condition them.
#[derive(Debug)]
pub struct Conditioned {
    plan: EstimationSettings,
    resolved: Meaning,
    gathered: Vec<RawSample>,
    shared: SharedStamps,
    running: Option<Conditioner>,
    rates: Vec<RateSample>,
}

impl Conditioned {
    /// Makes one for samples understood as `resolved`.
    #[must_use]
    pub fn new(plan: &EstimationSettings, resolved: &Meaning) -> Conditioned {
        Conditioned {
            plan: plan.clone(),
            resolved: resolved.clone(),
            gathered: Vec::new(),
            shared: SharedStamps::default(),
            running: None,
            rates: Vec::new(),
        }
    }

    /// Takes samples; those that are conditioned are handed on.
    ///
    /// # Errors
    /// In words, when the settings do not fit.
    pub fn push(
        &mut self,
        raw: &[RawSample],
        take: impl FnMut(&RateSample),
    ) -> Result<(), Diagnostic> {
        match &mut self.running {
            Some(conditioner) => conditioner.push(raw, &mut self.rates),
            None => {
                self.gathered.extend_from_slice(raw);
                raw.iter().for_each(|raw| self.shared.take(raw));
                if self.gathered.len() >= FEW && !self.shared.want_more() {
                    self.begin()?;
                }
            }
        }
        self.hand_on(take);
        Ok(())
    }

    /// Outcome of those that were conditioned so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let running = self.running.as_ref();
        running.map_or_else(Counts::default, |conditioner| conditioner.report().counts)
    }

    /// Steps of the stamp clock that were taken off so far.
    #[must_use]
    pub fn clock_set(&self) -> Option<ClockSet> {
        self.running.as_ref()?.report().clock_set
    }

    /// Hands on what is left.
    ///
    /// # Errors
    /// In words, when the settings do not fit.
    pub fn finish(&mut self, take: impl FnMut(&RateSample)) -> Result<(), Diagnostic> {
        if self.running.is_none() {
            self.begin()?;
        }
        if let Some(conditioner) = &mut self.running {
            conditioner.finish(&mut self.rates);
        }
        self.hand_on(take);
        Ok(())
    }

    fn begin(&mut self) -> Result<(), Diagnostic> {
        let gathered = std::mem::take(&mut self.gathered);
        let (clock, _) = choose_clock_as(&gathered, self.plan.clock, self.plan.stamps);
        let settings =
            self.resolved
                .settled(&gathered, clock)
                .conditioning(&self.plan, clock, BodyRate::ZERO);
        let settings = condition::Settings {
            coarse: coarse_clock(&gathered, clock, settings.repair),
            ..settings
        };
        let mut conditioner = Conditioner::new(&settings).map_err(|e| e.to_string())?;
        conditioner.push(&gathered, &mut self.rates);
        self.running = Some(conditioner);
        Ok(())
    }

    fn hand_on(&mut self, mut take: impl FnMut(&RateSample)) {
        self.rates.drain(..).for_each(|sample| take(&sample));
    }
}

/// A pass over samples that only looks for rest.
#[derive(Debug)]
pub(super) struct RestPass {
    conditioned: Conditioned,
    detector: Stillness,
}

impl RestPass {
    /// Makes one for samples understood as `resolved`.
    pub(super) fn new(plan: &EstimationSettings, resolved: &Meaning) -> RestPass {
        RestPass {
            conditioned: Conditioned::new(plan, resolved),
            detector: Stillness::new(Limits::default()),
        }
    }

    /// Takes samples.
    ///
    /// # Errors
    /// In words, when the settings do not fit.
    pub(super) fn push(&mut self, raw: &[RawSample]) -> Result<(), Diagnostic> {
        let RestPass {
            conditioned,
            detector,
        } = self;
        conditioned.push(raw, |sample| detector.push(sample))
    }

    /// Rests that were found.
    ///
    /// # Errors
    /// As [`RestPass::push`].
    pub(super) fn finish(mut self) -> Result<Rests, Diagnostic> {
        self.conditioned
            .finish(|sample| self.detector.push(sample))?;
        Ok(self.detector.finish())
    }
}
