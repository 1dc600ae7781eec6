//! A sender's first stamps -> whether its samples go on where the run is, repeat what was taken, or begin a run. Pure.
//!
//! Apart from the samples because it happens once a connection: afterwards a sample is only taken.

use super::doubting::Logged;
use super::pace::Pace;
use super::run::{OrderedBy, RunPlacement, Span};
use super::{SensorStream, expecting};
use crate::pipeline::session_builder::labelled;
use crate::serve::core::recorder::stream_of;
use crate::serve::guard::fault::Fault;
use std::time::Duration;
use strapd_attitude::condition::{Clock, StampRepair};
use strapd_attitude::diagnostic::Diagnostic;
use strapd_attitude::estimate::{EstimationSettings, Estimator, Forces, Meaning, at_once};
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::Bare;

/// Nobody who goes on in the same unit begins later than so long after the last stamp.
const NEAR_NANOS: i64 = 3_600_000_000_000;

/// Progress in finding where a sender stands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Joining {
    /// Undecided: no stamp of it has come yet.
    Undecided,
    /// Repetition: it sends again what was taken, up to this.
    Again(Nanos),
    /// Joined: it is where the run is.
    Joined,
}

impl SensorStream {
    /// Somebody else sends it from now on, and hears again what is wrong with its samples.
    pub fn meet(&mut self) {
        self.joining = Joining::Undecided;
        self.told = 0;
        self.counted = self.conditioning().counts;
        self.intervals.reopen();
        self.stamp_unit.meet();
        self.still_stamps.meet();
        self.pace = Pace::default();
        self.is_meaning_open = true;
        self.arrivals = None;
    }

    /// Whether a new connection's first number goes on in the unit settled for the run; where it does
    /// not, that may be another run, or somebody who counts in another unit.
    pub(super) fn continues(&self, bare: Bare) -> bool {
        let (Some(span), Some(unit)) = (self.span(), self.stamps.unit()) else {
            return false;
        };
        let stamp = bare.in_unit(unit);
        span.first.is_some_and(|first| stamp > first) && stamp.since(span.last) < NEAR_NANOS
    }

    /// The run as far as it has come.
    pub(in crate::serve::core) fn span(&self) -> Option<Span> {
        match &self.saved {
            Some(saved) => Some(saved.span()),
            None => self.conditioning().last.map(|last| Span {
                first: self.first,
                last,
            }),
        }
    }

    /// Decides by the first stamp of a sender whether the run goes on, before samples are taken.
    /// `plan` is that of [`SensorStream::new`]. What is to be known of a run that has begun comes back.
    ///
    /// # Errors
    /// The fault to answer with: a run cannot begin with these samples.
    pub fn join(
        &mut self,
        plan: &EstimationSettings,
        samples: &[RawSample],
        window: Duration,
        placed: OrderedBy,
    ) -> Result<Option<Fault>, Fault> {
        if self.joining != Joining::Undecided || samples.iter().all(|raw| raw.is_beside) {
            return Ok(None);
        }
        let span = self.span();
        let near = span.map_or(Nanos(0), |span| span.last);
        let first = samples
            .iter()
            .filter(|raw| !raw.is_beside)
            .find_map(|raw| Some((raw, self.estimator.stamp_of(raw, near)?)));
        let (span, raw, stamp) = match (span, first) {
            (Some(span), Some((raw, stamp))) => (span, raw, stamp),
            // Nothing to stand in yet, or nothing that tells where.
            (None, Some(_)) => {
                self.joining = Joining::Joined;
                return Ok(None);
            }
            (_, None) if matches!(plan.clock, Clock::Index { .. }) => {
                self.go_on(plan, None);
                return Ok(None);
            }
            (_, None) => return Ok(None),
        };
        match span.standing(stamp, window, placed) {
            RunPlacement::GoesOn => {
                self.go_on(plan, Some(stamp));
                Ok(None)
            }
            RunPlacement::Again => {
                self.joining = Joining::Again(span.last);
                Ok(None)
            }
            RunPlacement::Anew => self.begin_anew(plan, raw, stamp, span).map(Some),
        }
    }

    /// The run goes on with a sample stamped so.
    fn go_on(&mut self, plan: &EstimationSettings, stamp: Option<Nanos>) {
        self.joining = Joining::Joined;
        let Some(saved) = self.saved.take() else {
            return;
        };
        self.first = saved.span().first;
        let step = stamp.map(|stamp| stamp.since(saved.span().last));
        let is_near = step.is_some_and(|step| plan.bridges(step));
        let resumed = match saved.memory().filter(|_| is_near) {
            Some(memory) if self.estimator.recall(memory) => Ok(()),
            _ => saved
                .attitude(self.channel.stream())
                .and_then(|last| self.estimator.resume(&last)),
        };
        match resumed {
            Ok(()) => "as saved before the restart".clone_into(&mut self.prepared.initial_origin),
            Err(why) => self.prepared.warnings.push(why),
        }
        self.last = saved.attitude(self.channel.stream()).ok();
    }

    /// A run begins with `raw`: the world is there anew, and only what was counted goes on.
    fn begin_anew(
        &mut self,
        plan: &EstimationSettings,
        raw: &RawSample,
        stamp: Nanos,
        before: Span,
    ) -> Result<Fault, Fault> {
        let resets = self.rebuild(plan, self.resolved.clone(), &[*raw])?;
        self.joining = Joining::Joined;
        let secs = |nanos: Nanos| nanos.0 as f64 * 1e-9;
        let seen = match before.first {
            Some(first) => format!("{:.6} s to {:.6} s", secs(first), secs(before.last)),
            None => format!("until {:.6} s", secs(before.last)),
        };
        Ok(Fault {
            id: Some(self.id.to_string()),
            ..Fault::new(
                "new_run",
                format!(
                    "the first stamp of this connection, {:.6} s, was passed already ({seen}): a new run begins, reset {}",
                    secs(stamp),
                    resets.saturating_add(1)
                ),
            )
        })
    }

    /// Makes the estimator anew for samples that mean this, of which `together` are the first: only what was counted goes
    /// on. The number of resets so far comes back.
    ///
    /// # Errors
    /// The fault to answer with, and nothing has changed: a run cannot begin with these samples.
    pub(super) fn rebuild(
        &mut self,
        plan: &EstimationSettings,
        resolved: Meaning,
        together: &[RawSample],
    ) -> Result<u32, Fault> {
        let fault = |what: Diagnostic| Fault {
            id: Some(self.id.to_string()),
            ..Fault::new("not_ready", what.to_string())
        };
        let forces = self.prepared.aiding.map(|aiding| aiding.forces);
        let plan = &expecting(plan, forces == Some(Forces::Beside));
        let mut prepared = at_once(plan, &resolved, together).map_err(fault)?;
        prepared.has_arrival = plan.stamps == StampRepair::Auto;
        prepared.batches = self.conditioning().batches;
        let mut estimator = Estimator::live(plan, &resolved, &prepared).map_err(fault)?;
        let labels = labelled(stream_of(&self.id), plan, &resolved, &prepared);
        if labels.world_axes != self.channel.stream().world_axes {
            return Err(fault(format!(
                "a run that begins between other axes ({}) than those announced ({}); give it another `id`",
                labels.world_axes,
                self.channel.stream().world_axes
            ).into()));
        }
        let saved = self.saved.take().map(|saved| saved.resets());
        let resets = saved.or(self.last.map(|l| l.reset_count)).unwrap_or(0);
        estimator.continue_counts_of(self.conditioning(), resets);
        if let Some(doubts) = &mut self.doubts {
            doubts.begin(&resolved, &prepared, &mut estimator);
        }
        (self.estimator, self.resolved, self.prepared) = (estimator, resolved, prepared);
        (self.first, self.last) = (None, None);
        self.intervals.begin();
        self.stamp_unit.begin();
        self.still_stamps.begin();
        self.logged = Logged::default();
        self.runs += 1;
        Ok(resets)
    }

    /// Whether a sample is one that was taken before, and now is only counted.
    pub(super) fn is_again(&mut self, plan: &EstimationSettings, raw: &RawSample) -> bool {
        let Joining::Again(last) = self.joining else {
            return false;
        };
        match self.estimator.stamp_of(raw, last) {
            Some(stamp) if stamp > last => {
                self.go_on(plan, Some(stamp));
                false
            }
            Some(stamp) => {
                self.estimator.take_late(stamp);
                true
            }
            None => false,
        }
    }
}
