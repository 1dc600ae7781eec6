//! All a propagator needs to go on exactly <-> plain numbers. Pure.
//!
//! Apart from the propagator because it is read by another process: nothing in it is believed
//! unseen. Of the samples only those are kept that a window may still hold.

use super::state::State;
use super::{Engine, FASTEST, LARGEST, LOOKED_BACK, PendingSample, Propagator};
use crate::frames::In;
use crate::plausible::{are_numbers, is_unit};
use crate::propagate::accumulate::Accumulator;
use crate::propagate::classical::LOOK_BACK;
use crate::propagate::covariance;
use crate::record::{Nanos, Status};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Most samples that wait for their successors: no window looks further ahead.
const MOST_WAITING: usize = 64;

/// State of a propagator at one moment; [`Propagator::recall`] restores it.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Memory {
    #[cfg_attr(feature = "serde", serde(flatten))]
    state: State,
    /// Relative to the world, or to where that stood at `world_since`.
    #[cfg_attr(feature = "serde", serde(flatten))]
    attitude: Accumulator,
    covariance: covariance::State,
    /// Samples of this run before those in `samples`.
    before: u64,
    /// Index in `samples` of the one that ends the next interval to be integrated.
    next: usize,
    samples: Vec<Element>,
    /// Not yet output, and output but not for good.
    waiting: Vec<Row>,
    open: Vec<Row>,
}

/// ns before the last, ns it was measured over, value x, y, z, whether samples are missing before it.
type Element = (i64, i64, f64, f64, f64, bool);

/// Sample that waits: ns before the last, specific force, status bits, log time, whether it turns.
type Row = (i64, Option<[f64; 3]>, u16, i64, bool);

impl Memory {
    /// Whether a propagator can have known it, whatever the settings.
    pub(crate) fn is_plausible(&self) -> bool {
        let State {
            initial,
            sum,
            rates,
            ..
        } = &self.state;
        is_unit(initial)
            && self.attitude.is_plausible()
            && are_numbers(sum.iter().flatten())
            && are_numbers(rates.output.iter().chain(&rates.sample))
            && self
                .samples
                .iter()
                .all(|e| e.1 >= 0 && are_numbers(&[e.2, e.3, e.4]))
            && self.covariance.is_plausible()
    }
}

impl Propagator {
    /// Returns the state; `None` before the first sample of a run.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        let open = match &self.engine {
            Engine::Commit { open, .. } => open.iter().collect(),
            Engine::Sliding(_) | Engine::Classical(_) => Vec::new(),
        };
        if !self.started || self.queue.len().max(open.len()) > MOST_WAITING {
            return None;
        }
        let last = self.output.state.last;
        let row = |sample: &PendingSample| {
            let accel = sample.accel.map(|force| (*force.as_vector()).into());
            let age = last.saturating_sub(sample.stamp.0);
            (age, accel, sample.status.0, sample.log.0, sample.turns)
        };
        let track = &self.track;
        let from = self.next.saturating_sub(self.looked_back());
        let mut state = self.output.state;
        state.rates.sample = self.last_rate();
        Some(Memory {
            state,
            attitude: self.output.attitude,
            covariance: self.output.covariance.state(),
            before: (track.base + from) as u64,
            next: self.next - from,
            samples: (from..track.len())
                .map(|k| {
                    let stamp = track.stamp[k];
                    (
                        last.saturating_sub(stamp),
                        stamp.saturating_sub(track.start[k]),
                        track.x[k],
                        track.y[k],
                        track.z[k],
                        track.bridged[k],
                    )
                })
                .collect(),
            waiting: self.queue.iter().map(row).collect(),
            open: open.into_iter().map(row).collect(),
        })
    }

    /// Goes on as the propagator with the same settings would have that knew this, before this one's
    /// first sample. Should that begin with a gap, the first output says [`Status::RESTARTED`].
    /// `false`, and nothing has changed, when no propagator can have known it.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        let mut covariance = self.output.covariance;
        let fits = self.can_be(memory) && covariance.recall(&memory.covariance);
        if !fits {
            return false;
        }
        self.track.clear();
        for &(age, length, x, y, z, bridged) in &memory.samples {
            let stamp = memory.state.last.saturating_sub(age);
            let start = stamp.saturating_sub(length);
            self.track.push(stamp, start, [x, y, z], bridged);
        }
        self.track
            .count_from(usize::try_from(memory.before).unwrap_or(usize::MAX / 2));
        self.next = memory.next;
        self.output.state = memory.state;
        self.output.attitude = memory.attitude;
        self.output.covariance = covariance;
        let rows = |rows: &[Row]| -> VecDeque<PendingSample> {
            rows.iter()
                .map(|row| waiting(memory.state.last, row))
                .collect()
        };
        self.queue = rows(&memory.waiting);
        if let Engine::Commit { open, .. } = &mut self.engine {
            *open = rows(&memory.open);
        }
        self.started = true;
        self.resumed = true;
        true
    }

    /// Whether a propagator with these settings can have known this: what is calculated with it can
    /// neither fail nor grow.
    fn can_be(&self, memory: &Memory) -> bool {
        let limit = if self.track.increments {
            LARGEST
        } else {
            FASTEST
        };
        let small = |v: &f64| v.abs() <= limit;
        let elements = memory.samples.iter();
        let in_order = memory.samples.windows(2).all(|pair| match pair {
            [a, b] => a.0 > b.0 && b.0 >= 0,
            _ => true,
        });
        memory.is_plausible()
            && memory.state.sum.is_some() == self.output.state.sum.is_some()
            && memory.state.world_since.is_some() == self.output.state.world_since.is_some()
            && elements.len() <= LOOKED_BACK + MOST_WAITING
            && (1..=elements.len()).contains(&memory.next)
            // Whoever has dropped some looks no further back than to what is there.
            && (memory.before == 0 || memory.next > LOOK_BACK)
            && memory.before < u64::MAX / 4
            && in_order
            && memory.samples.last().is_some_and(|last| last.0 == 0)
            && elements.clone().all(|e| [e.2, e.3, e.4].iter().all(small))
            && memory.waiting.len().max(memory.open.len()) <= MOST_WAITING
    }
}

fn waiting(last: i64, &(age, accel, status, log, turns): &Row) -> PendingSample {
    PendingSample {
        stamp: Nanos(last.saturating_sub(age)),
        log: Nanos(log),
        accel: accel.map(|force| In::assume(Vector3::from(force))),
        status: Status(status),
        turns,
    }
}
