//! Conditioned rates, in doubt or not -> the integrator, which goes back where they were a spike. Pure.
//!
//! Apart from the estimator because nothing else goes back in time: a live sample is integrated when it comes, and what
//! follows may show that it was a spike. From where a doubt begins the state before it is kept, with what came since;
//! where it was a spike, that is taken once more without it. Attitudes that have left stay as they were.

use super::gyro_watch::GyroWatch;
use super::integrator::{Auxiliary, Integrator};
use super::magnetometer_watch::MagnetometerWatch;
use crate::condition::regularise::Regulariser;
use crate::condition::{Revised, Revision};
use crate::propagate::{Executor, Sequential};
use crate::record::{AttitudeSample, Join, Nanos, RateSample, Status};
use std::collections::VecDeque;

/// Inputs kept while there is a doubt: rates are a handful, but forces may go on without them.
const MOST: usize = 1024;

/// Progress of samples that may be a spike.
#[derive(Debug, Default)]
pub(super) struct Retaking {
    doubted: Option<Box<Doubted>>,
    /// The next attitude is the first without a spike that stood in those before.
    goes_back: bool,
}

/// State before samples in doubt, and what came since.
#[derive(Debug)]
struct Doubted {
    integrator: Integrator,
    regulariser: Option<Regulariser>,
    since: VecDeque<Input>,
    scratch: Vec<AttitudeSample>,
}

/// Input of what integrates.
#[derive(Clone, Copy, Debug)]
enum Input {
    Rate(RateSample),
    Beside(Nanos, Auxiliary),
    Heading(f64),
}

/// Stages behind the conditioning, of one estimator.
#[derive(Debug)]
pub(super) struct Stages<'a> {
    pub(super) integrator: &'a mut Integrator,
    pub(super) regulariser: &'a mut Option<Regulariser>,
    /// Watches over the sensors, which are shown what is in no doubt.
    pub(super) gyro: &'a mut Option<GyroWatch>,
    pub(super) magnetometer: &'a mut Option<Box<MagnetometerWatch>>,
    /// The next sample begins anew.
    pub(super) begins_anew: &'a mut bool,
    /// Room for samples with other stamps.
    pub(super) even: &'a mut Vec<RateSample>,
    pub(super) out: &'a mut Vec<AttitudeSample>,
}

/// Vectors that came between the rates, each before the rate of this number.
pub(super) type Besides = Vec<(usize, Nanos, Auxiliary)>;

impl Doubted {
    fn new(integrator: Integrator, regulariser: Option<Regulariser>) -> Doubted {
        Doubted {
            integrator,
            regulariser,
            since: VecDeque::new(),
            scratch: Vec::new(),
        }
    }

    /// Takes an input as the integrator in use has taken it.
    fn take(&mut self, input: &Input) {
        match input {
            Input::Beside(stamp, beside) => self.integrator.take_beside(*stamp, *beside),
            Input::Heading(heading) => drop(self.integrator.turn_heading(*heading)),
            Input::Rate(rate) => {
                let mut even = Vec::new();
                let rates = match &mut self.regulariser {
                    None => std::slice::from_ref(rate),
                    Some(regulariser) => {
                        regulariser.push(std::slice::from_ref(rate), &mut even);
                        &even
                    }
                };
                self.integrator.push(rates, &Sequential, &mut self.scratch);
                self.scratch.clear();
            }
        }
    }
}

impl Stages<'_> {
    /// Shows an input to the watches.
    fn watch(&mut self, input: &Input) {
        match input {
            Input::Rate(rate) => self.watch_rates(std::slice::from_ref(rate)),
            Input::Beside(stamp, Auxiliary::Force(force)) => {
                if let Some(watch) = self.gyro {
                    watch.take_force(*stamp, *force);
                }
                if let Some(watch) = self.magnetometer {
                    watch.take_force(*stamp, *force);
                }
            }
            Input::Beside(_, Auxiliary::Field(_) | Auxiliary::Heading { .. })
            | Input::Heading(_) => {}
        }
    }

    fn watch_rates(&mut self, rates: &[RateSample]) {
        if let Some(watch) = self.gyro {
            watch.push(rates);
        }
        if let Some(watch) = self.magnetometer {
            watch.push(rates);
        }
    }
}

impl Retaking {
    /// A heading was asked of the next sample.
    pub(super) fn note_heading(&mut self, heading: f64) {
        if let Some(doubted) = &mut self.doubted {
            doubted.since.push_back(Input::Heading(heading));
        }
    }

    /// Integrates what was conditioned, with the vectors that came between and the judgements of what came before;
    /// returns the number of spikes that could not be taken back.
    pub(super) fn integrate(
        &mut self,
        stages: &mut Stages<'_>,
        rates: &mut [RateSample],
        (besides, revisions): (Besides, Vec<Revised>),
        exec: &impl Executor,
    ) -> u64 {
        if self.doubted.is_none() && revisions.is_empty() && stages.regulariser.is_none() {
            self.integrate_at_once(stages, rates, besides, exec);
            return 0;
        }
        let mut revisions = revisions.into_iter().peekable();
        let (mut from, mut left) = (0, 0);
        for (place, stamp, beside) in besides {
            while let Some(revised) = revisions.next_if(|revised| revised.place < place) {
                self.push(stages, rates, (from, revised.place), exec);
                from = revised.place;
                left += self.revise(stages, revised.revision);
            }
            self.push(stages, rates, (from, place), exec);
            from = place;
            self.push_beside(stages, stamp, beside);
        }
        for revised in revisions {
            self.push(stages, rates, (from, revised.place), exec);
            from = revised.place;
            left += self.revise(stages, revised.revision);
        }
        let count = rates.len();
        self.push(stages, rates, (from, count), exec);
        left
    }

    /// The same where nothing is in doubt. A vector newer than the rates before it waits where it is paired with a rate, so
    /// that it may be given before them: rates are integrated together, and the bits are those of one after the other.
    fn integrate_at_once(
        &mut self,
        stages: &mut Stages<'_>,
        rates: &mut [RateSample],
        besides: Besides,
        exec: &impl Executor,
    ) {
        let mut from = 0;
        for (place, stamp, beside) in &besides {
            stages.watch_rates(rates.get(from..*place).unwrap_or_default());
            stages.watch(&Input::Beside(*stamp, *beside));
            from = *place;
        }
        stages.watch_rates(rates.get(from..).unwrap_or_default());
        let (mut from, mut seen, mut early) = (0, 0, 0);
        let mut newest = Nanos(i64::MIN);
        for (place, stamp, beside) in besides {
            let between = rates.get(seen..place).unwrap_or_default();
            newest = between
                .iter()
                .fold(newest, |newest, rate| newest.max(rate.stamp));
            seen = place;
            if place > from && (stamp <= newest || early >= MOST) {
                self.integrate_rates(stages, rates, (from, place), exec);
                (from, early) = (place, 0);
            }
            early += 1;
            stages.integrator.take_beside(stamp, beside);
        }
        let count = rates.len();
        self.integrate_rates(stages, rates, (from, count), exec);
    }

    fn push_beside(&mut self, stages: &mut Stages<'_>, stamp: Nanos, beside: Auxiliary) {
        let input = Input::Beside(stamp, beside);
        match &mut self.doubted {
            None => stages.watch(&input),
            Some(doubted) => doubted.since.push_back(input),
        }
        stages.integrator.take_beside(stamp, beside);
        let doubted = self.doubted.as_ref();
        if doubted.is_some_and(|doubted| doubted.since.len() > MOST) {
            self.keep(stages);
        }
    }

    /// Takes the rates of these numbers.
    fn push(
        &mut self,
        stages: &mut Stages<'_>,
        rates: &mut [RateSample],
        (from, to): (usize, usize),
        exec: &impl Executor,
    ) {
        let new = rates.get(from..to).unwrap_or_default();
        match &mut self.doubted {
            None => stages.watch_rates(new),
            Some(doubted) => doubted.since.extend(new.iter().copied().map(Input::Rate)),
        }
        self.integrate_rates(stages, rates, (from, to), exec);
    }

    /// Integrates the rates of these numbers.
    fn integrate_rates(
        &mut self,
        stages: &mut Stages<'_>,
        rates: &mut [RateSample],
        (from, to): (usize, usize),
        exec: &impl Executor,
    ) {
        let Some(rates) = rates.get_mut(from..to) else {
            return;
        };
        let rates = match stages.regulariser {
            None => rates,
            Some(regulariser) => {
                regulariser.push(rates, stages.even);
                stages.even.as_mut_slice()
            }
        };
        if let Some(first) = rates.first_mut() {
            if std::mem::take(stages.begins_anew) {
                first.join = Join::Reset;
            }
            if std::mem::take(&mut self.goes_back) {
                first.status = first.status.with(Status::REPAIRED);
            }
        }
        stages.integrator.push(rates, exec, stages.out);
        stages.even.clear();
    }

    /// Takes a judgement of the samples in doubt; returns the number of spikes that are left as they were.
    #[cold]
    fn revise(&mut self, stages: &mut Stages<'_>, revision: Revision) -> u64 {
        match revision {
            // What is reset at the next sample keeps nothing of those before.
            Revision::Doubt if *stages.begins_anew => {}
            Revision::Doubt => {
                let integrator = stages.integrator.checkpoint();
                let regulariser = || stages.regulariser.clone();
                self.doubted = integrator.map(|made| Box::new(Doubted::new(made, regulariser())));
            }
            Revision::Sound(count) => self.settle(stages, count, None),
            Revision::Repaired(samples) => {
                if self.doubted.is_none() {
                    let is_spike = |rate: &&RateSample| rate.status.has(Status::REPAIRED);
                    return samples.iter().filter(is_spike).count() as u64;
                }
                self.settle(stages, samples.len(), Some(&samples));
                self.go_back(stages);
            }
            Revision::Over => self.keep(stages),
        }
        0
    }

    /// The first rates of those in doubt are in none any more, as they are or as `repaired`.
    fn settle(&mut self, stages: &mut Stages<'_>, count: usize, repaired: Option<&[RateSample]>) {
        let Some(doubted) = &mut self.doubted else {
            return;
        };
        let mut settled = 0;
        while settled < count
            && let Some(mut input) = doubted.since.pop_front()
        {
            if let Input::Rate(rate) = &mut input {
                let other = repaired.and_then(|samples| samples.get(settled));
                *rate = other.copied().unwrap_or(*rate);
                settled += 1;
            }
            doubted.take(&input);
            stages.watch(&input);
        }
    }

    /// Goes on from the state before the doubt, with what came since.
    fn go_back(&mut self, stages: &mut Stages<'_>) {
        let Some(doubted) = &mut self.doubted else {
            return;
        };
        let Some(integrator) = doubted.integrator.checkpoint() else {
            return;
        };
        let mut now = Doubted::new(integrator, doubted.regulariser.clone());
        doubted.since.iter().for_each(|input| now.take(input));
        stages.integrator.go_on_as(now.integrator);
        *stages.regulariser = now.regulariser;
        self.goes_back = true;
    }

    /// Samples in doubt stay as they are.
    #[cold]
    pub(super) fn keep(&mut self, stages: &mut Stages<'_>) {
        if let Some(doubted) = self.doubted.take() {
            doubted.since.iter().for_each(|input| stages.watch(input));
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing)]
mod tests;
