//! Kept samples -> those of the smoother, each with force and field at its instant, pass after pass. Pure.
//!
//! Apart from the smoothing because vectors are paired anew in every pass, and stamps go on where they went back.

use super::super::kept::{Event, SampleStore, SpoolError};
use super::CHUNK;
use crate::aid::VectorPairing;
use crate::consistency::FieldIron;
use crate::frames::In;
use crate::record::{Nanos, RateSample, Status};
use crate::smooth::{Sample, Samples};
use std::cell::RefCell;
use std::collections::VecDeque;

/// Time put between the last sample and the next where the stamps go back: nothing is known of what lies between, ns.
const APART: i64 = 10_000_000_000;

/// Kept samples, as the smoother reads them.
pub(super) struct Reading<'a> {
    pub(super) kept: &'a mut SampleStore,
    pub(super) iron: Option<FieldIron>,
    pub(super) has_forces_beside: bool,
    /// Rates whose attitudes have not come yet, where they are wanted.
    pub(super) waiting: Option<&'a RefCell<VecDeque<RateSample>>>,
}

impl Samples for Reading<'_> {
    type Error = SpoolError;

    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), SpoolError> {
        let mut forces = self.has_forces_beside.then(VectorPairing::default);
        let mut fields = VectorPairing::with_repeats();
        let (mut last, mut shift): (Option<Nanos>, i64) = (None, 0);
        let mut chunk = Vec::with_capacity(CHUNK);
        let iron = self.iron;
        self.kept.give(|event| match event {
            Event::ForcesBeside => {
                forces.get_or_insert_default();
            }
            Event::Force(stamp, force) => {
                if let Some(forces) = &mut forces {
                    forces.take(stamp, *force.as_vector());
                }
            }
            Event::Field(stamp, field) => {
                let measured = field.as_vector();
                fields.take(stamp, iron.map_or(*measured, |iron| iron.undone(measured)));
            }
            Event::Rate(rate) => {
                let turning = rate.mean_rate();
                if let Some(last) = last.filter(|last| *last >= rate.stamp) {
                    shift = shift.saturating_add(last.since(rate.stamp).saturating_add(APART));
                }
                last = Some(rate.stamp);
                let force = match &mut forces {
                    None => rate.accel,
                    Some(forces) => forces.at(rate.stamp, &turning.0).map(In::assume),
                };
                chunk.push(Sample {
                    stamp: Nanos(rate.stamp.0.saturating_add(shift)),
                    rate: turning,
                    force,
                    field: fields.at(rate.stamp, &turning.0).map(In::assume),
                    is_saturated: rate.status.has(Status::SATURATED),
                });
                if let Some(waiting) = self.waiting {
                    let rate = RateSample {
                        accel: force,
                        ..rate
                    };
                    waiting.borrow_mut().push_back(rate);
                }
                if chunk.len() == CHUNK {
                    take(&chunk);
                    chunk.clear();
                }
            }
        })?;
        take(&chunk);
        Ok(())
    }
}
