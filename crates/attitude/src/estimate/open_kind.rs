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
        if let Some(open) = &mut self.open {
            open.events.push(event());
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

    /// Decides the kind as an estimator of the same sensor has before.
    pub(super) fn keep_kind(&mut self, choice: KindChoice) {
        if self.open.is_none() {
            return;
        }
        self.sample_kind = self.as_chosen(choice);
        self.open = None;
    }

    /// Becomes an estimator of the kind chosen; the choice that came of it.
    fn as_chosen(&mut self, choice: KindChoice) -> KindChoice {
        let is_made = choice.kind == self.sample_kind.kind || self.begin_as(choice);
        let kind = match is_made {
            true => choice.kind,
            false => self.sample_kind.kind,
        };
        KindChoice { kind, ..choice }
    }

    /// Begins again as of this kind, with what has come so far; attitudes that have left stay as they were. `false`, and
    /// nothing changes, where the settings allow no samples of this kind.
    fn begin_as(&mut self, choice: KindChoice) -> bool {
        let Some(mut open) = self.open.take() else {
            return false;
        };
        self.make(&Sequential);
        let mut before = std::mem::take(&mut self.before);
        open.note_out(&before);
        let resolved = open.resolved.with_kind(&choice);
        let made = Estimator::live_of_kind(&open.plan, &resolved, &open.prepared);
        let Ok(mut made) = made else {
            self.before = before;
            self.open = Some(open);
            return false;
        };
        made.watch_as(self, &resolved, &open.prepared);
        for event in &open.events {
            made.repeat(event);
        }
        made.left_until = open.last_out;
        made.make(&Sequential);
        before.append(&mut made.before);
        made.before = before;
        made.open = Some(open);
        *self = made;
        true
    }

    /// Becomes what it was before its kind was decided: with `open`, and what came until then.
    pub(super) fn reopen(&mut self, open: Box<OpenKind>) {
        let Ok(mut made) = Estimator::live(&open.plan, &open.resolved, &open.prepared) else {
            return;
        };
        made.watch_as(self, &open.resolved, &open.prepared);
        for event in &open.events {
            made.repeat(event);
        }
        made.left_until = open.last_out;
        *self = made;
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
        }
    }
}
