//! The first samples of a stream whose kind nothing states -> its kind, and an estimator of that kind. Pure.
//!
//! Apart from the estimator because it is only its beginning: attitudes leave as they would, by the steps seen so far, and
//! nothing waits. Where the next step tells another kind, the few samples are estimated again as of that kind, and from
//! then on the attitudes are those of a stream that had stated it.

use super::anew::RestartRequest;
use super::estimator::Estimator;
use super::meaning::Meaning;
use super::plan::EstimationSettings;
use super::preparation::Prepared;
use super::sample_kind::{KindChoice, OrdinaryStep, STEPS_LIVE};
use crate::aid::OutsideHeading;
use crate::condition;
use crate::propagate::Sequential;
use crate::record::{AttitudeSample, Nanos, RawSample};

/// Events that are kept: with more the kind stays as it is. Other sensors' samples may come between.
const MOST: usize = 256;

/// An event of a stream that another estimator is to take as well.
#[derive(Clone, Debug)]
pub(super) enum Event {
    Sample(RawSample),
    Late(Nanos),
    Undecodable,
    Resume(Box<AttitudeSample>),
    ContinueCounts(Box<condition::Report>, u32),
    Restart(Box<RestartRequest>),
    Heading(f64),
    OutsideHeading(Option<Nanos>, OutsideHeading),
}

/// Beginning of a stream whose kind is not decided for good.
#[derive(Clone, Debug)]
pub(super) struct OpenKind {
    pub(super) plan: EstimationSettings,
    pub(super) resolved: Meaning,
    pub(super) prepared: Prepared,
    step: OrdinaryStep,
    pub(super) events: Vec<Event>,
    /// Stamp of the last attitude that has left.
    pub(super) last_out: Option<Nanos>,
}

impl OpenKind {
    pub(super) fn new(
        plan: &EstimationSettings,
        resolved: &Meaning,
        prepared: &Prepared,
    ) -> OpenKind {
        OpenKind {
            plan: plan.clone(),
            resolved: resolved.clone(),
            prepared: prepared.clone(),
            step: OrdinaryStep::of(prepared.clock, STEPS_LIVE),
            events: Vec::new(),
            last_out: None,
        }
    }

    /// Kind by the samples up to this one, which is noted.
    pub(super) fn choice_with(&mut self, raw: &RawSample) -> KindChoice {
        self.step.take(raw);
        self.step.choice()
    }

    /// Whether nothing that follows changes it.
    pub(super) fn is_decided(&self) -> bool {
        self.step.is_known() || self.events.len() >= MOST
    }

    /// Notes the attitudes that leave.
    pub(super) fn note_out(&mut self, out: &[AttitudeSample]) {
        self.last_out = out
            .iter()
            .map(|sample| sample.stamp)
            .chain(self.last_out)
            .max();
    }
}

impl Estimator {
    /// Notes an event, as long as the kind is not decided for good.
    pub(super) fn note(&mut self, event: impl FnOnce() -> Event) {
        match &mut self.open {
            Some(open) if open.events.len() >= MOST => self.open = None,
            Some(open) => open.events.push(event()),
            None => {}
        }
    }

    /// Decides the kind by the steps up to this sample, which is then taken.
    #[cold]
    pub(super) fn decide_kind_with(&mut self, raw: &RawSample) {
        let Some(open) = &mut self.open else {
            return;
        };
        let choice = open.choice_with(raw);
        self.sample_kind = self.as_chosen(choice);
        match &mut self.open {
            Some(open) if !open.is_decided() => open.events.push(Event::Sample(*raw)),
            _ => self.open = None,
        }
    }

    /// Becomes an estimator of the kind chosen; the choice that came of it.
    fn as_chosen(&mut self, choice: KindChoice) -> KindChoice {
        if choice.kind != self.sample_kind.kind
            && let Some(made) = self.of_kind(choice)
        {
            *self = made;
        }
        // Settings may allow no samples of that kind: they stay as they are.
        let kind = self.sample_kind.kind;
        KindChoice { kind, ..choice }
    }

    /// An estimator of this kind that has taken what has come so far; attitudes that have left stay as they were. `None`
    /// where the kind is decided, or the settings allow no samples of this one.
    pub(super) fn of_kind(&mut self, choice: KindChoice) -> Option<Estimator> {
        self.make(&Sequential);
        let mut open = self.open.clone()?;
        open.note_out(&self.before);
        let resolved = open.resolved.with_kind(&choice);
        let mut made = Estimator::live_of_kind(&open.plan, &resolved, &open.prepared).ok()?;
        made.watch_as(self, &resolved, &open.prepared);
        for event in &open.events {
            made.repeat(event);
        }
        made.temperatures = self.temperatures.clone();
        made.left_until = open.last_out;
        made.make(&Sequential);
        made.before.splice(..0, self.before.iter().copied());
        made.open = Some(open);
        Some(made)
    }

    /// Leaves out the attitudes that have left as of another kind.
    #[cold]
    pub(super) fn leave_out_what_left(&mut self) {
        let Some(last) = self.left_until else {
            return;
        };
        let first = self.out.iter().position(|sample| sample.stamp > last);
        if first.is_some() {
            self.left_until = None;
        }
        self.out.drain(..first.unwrap_or(self.out.len()));
    }

    fn repeat(&mut self, event: &Event) {
        match event {
            Event::Sample(raw) => self.take(raw),
            Event::Late(stamp) => self.take_late(*stamp),
            Event::Undecodable => self.take_undecodable(),
            // It was a rotation before.
            Event::Resume(last) => drop(self.resume(last)),
            Event::ContinueCounts(report, resets) => self.continue_counts_of(report, *resets),
            Event::Restart(anew) => self.begin_anew(anew),
            Event::Heading(heading) => {
                self.turn_heading(*heading);
            }
            Event::OutsideHeading(stamp, measured) => {
                self.take_heading(*stamp, *measured);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::estimate::at_once;
    use crate::propagate::Method;
    use crate::record::{Declared, SampleKind};

    #[test]
    fn a_stream_that_turns_out_to_be_of_means_is_watched_in_bounded_memory_as_before() {
        let plan = EstimationSettings {
            method: Method::COMMIT,
            ..EstimationSettings::default()
        };
        let sample = |n: i64| RawSample {
            header: Some(Nanos(n * 5_000_000)),
            gyro: Some([0.1, 0.01 * n as f64, 0.0]),
            accel: Some([0.0, 0.0, 9.8]),
            ..RawSample::default()
        };
        let meaning = Meaning::new(&plan, &Declared::default());
        let prepared = at_once(&plan, &meaning, &[sample(0)]).unwrap();
        let mut estimator = Estimator::live(&plan, &meaning, &prepared).unwrap();
        estimator.watch_sensors_live(&meaning, &prepared);
        (0..9).for_each(|n| estimator.take(&sample(n)));
        assert_eq!(estimator.sample_kind().kind, SampleKind::Average);
        assert!(estimator.field_consistency().unwrap().is_live());
    }
}
