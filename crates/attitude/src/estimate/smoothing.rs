//! Conditioned samples of a whole recording -> its smoothed attitudes, at the end. Pure.
//!
//! Apart from the smoother because that reads samples again and again, and here they come once: they are kept, with the
//! vectors measured beside them ([`SampleStore`]), and a filter runs along for what the run says of turns, gaps and sensor.

mod class;
mod reading;

use self::class::{LOOSER, LOOSER_KNOWN, is_beyond, is_held};
use self::reading::Reading;
use super::kept::{Event, SampleStore, Spool, SpoolError};
use crate::aid::{AidedPropagator, VectorPairing};
use crate::consistency::{FieldConsistency, FieldIron, FieldReading};
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, In, Nav};
use crate::propagate::Executor;
use crate::quaternion::{BodyRate, Quaternion, RotationVector};
use crate::record::{
    AttitudeCovariance, AttitudeSample, Join, LinearAcceleration, Nanos, RateSample, SampleKind,
    Status,
};
use crate::smooth::{
    Estimate, FieldUnit, OtherClass, Outcome, PriorScale, PriorSigmas, SampleModel, Settings,
    Sizes, SmoothError, Smoothed, smooth,
};
use nalgebra::Vector3;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::num::NonZero;

/// Samples that are handed on at once.
const CHUNK: usize = 4096;

/// Inputs of a smoother about a recording.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct SmoothingInputs {
    /// Kind of a sample.
    pub(super) kind: SampleKind,
    /// Heading of the first attitude, rad; `None`: that of the smoother.
    pub(super) heading: Option<f64>,
    /// Ratio of this sensor's errors to those of the default class.
    pub(super) looseness: PriorScale,
    /// The same of a sensor that nobody calibrated, where it may as well be one.
    pub(super) other: Option<PriorScale>,
    /// The class, and so that ratio, is one that the data told.
    pub(super) is_class_found: bool,
    /// Standard deviation of the gyro's bias in its class, rad/s.
    pub(super) bias_sigma: f64,
    /// Prior knowledge of this sensor.
    pub(super) known: PriorSigmas,
}

/// A recording on its way to the smoother.
#[derive(Debug)]
pub(super) struct Smoothing {
    /// Runs along for its counts: nobody gets its attitudes.
    aided: AidedPropagator,
    /// The same before the first sample.
    fresh: AidedPropagator,
    kept: SampleStore,
    /// Gyro held against the field, for iron beyond what a smoother's priors allow.
    fields: (VectorPairing, FieldConsistency),
    told: SmoothingInputs,
    /// Once the end has come; in words why there is none.
    result: Option<Result<Recording, Diagnostic>>,
}

/// A recording that was smoothed.
#[derive(Debug)]
pub struct Recording {
    /// Result; never [`Outcome::Filter`].
    pub smoothed: Smoothed,
    /// The sensor is farther off than those of its class, and was smoothed again with the priors of one that nobody
    /// calibrated.
    pub is_beyond_class: bool,
    /// Bytes of it that were kept in a temporary file.
    pub spooled_bytes: u64,
    /// Iron beyond that of a calibrated sensor: taken out of the fields before they were smoothed.
    pub iron: Option<FieldIron>,
    /// Sizes of forces at rest and of fields, as measured (less that iron) and as calibrated.
    pub sizes: Vec<Sizes>,
}

impl Smoothing {
    /// Makes one of a filter that has taken nothing yet.
    pub(super) fn new(aided: AidedPropagator, told: SmoothingInputs) -> Smoothing {
        Smoothing {
            fresh: aided.clone(),
            aided,
            kept: SampleStore::default(),
            fields: (VectorPairing::with_repeats(), FieldConsistency::default()),
            told,
            result: None,
        }
    }

    /// Sets the spool for what does not fit in memory.
    pub(super) fn spool_to(&mut self, spool: Box<dyn Spool>) {
        self.kept.spool_to(spool);
    }

    /// The filter that runs along.
    pub(super) fn aided(&self) -> &AidedPropagator {
        &self.aided
    }

    /// Result, once the end has come.
    pub(super) fn result(&self) -> Option<Result<&Recording, &Diagnostic>> {
        Some(self.result.as_ref()?.as_ref())
    }

    pub(super) fn expect_forces_beside(&mut self) {
        self.kept.push(&Event::ForcesBeside);
        self.aided.expect_forces_beside();
    }

    pub(super) fn take_force(&mut self, stamp: Nanos, force: In<Body>) {
        self.kept.push(&Event::Force(stamp, force));
        self.aided.take_force(stamp, force);
    }

    pub(super) fn take_field(&mut self, stamp: Nanos, field: In<Body>) {
        self.kept.push(&Event::Field(stamp, field));
        self.fields.0.take(stamp, *field.as_vector());
        self.aided.take_field(stamp, field);
    }

    /// `scratch` is empty, and is left so.
    pub(super) fn push(&mut self, rates: &[RateSample], scratch: &mut Vec<AttitudeSample>) {
        for rate in rates {
            self.kept.push(&Event::Rate(*rate));
            self.watch_field(rate);
        }
        self.aided.push(rates, scratch);
        scratch.clear();
    }

    /// Holds the gyro against the field that belongs to the sample.
    fn watch_field(&mut self, rate: &RateSample) {
        let (pairing, consistency) = &mut self.fields;
        if matches!(rate.join, Join::Hold | Join::Reset) {
            consistency.interrupt();
        }
        consistency.push(&FieldReading {
            stamp: rate.stamp,
            gyro: rate.gyro,
            field: pairing.at(rate.stamp, &rate.mean_rate().0),
            force: rate.accel.map(|force| *force.as_vector()),
        });
    }

    /// The recording has ended: gives all its attitudes, in pieces.
    ///
    /// # Errors
    /// Of the file that it was kept in.
    pub(super) fn finish(
        &mut self,
        exec: &impl Executor,
        out: &mut Vec<AttitudeSample>,
        give: &mut dyn FnMut(&mut [AttitudeSample]),
    ) -> Result<(), SpoolError> {
        self.aided.finish(out);
        out.clear();
        let iron = self.fields.1.iron().filter(FieldIron::has_soft_iron);
        let mut result = match self.smooth(exec.threads(), iron) {
            Err(SmoothError::Read(error)) => return Err(error),
            Err(other) => Err(Diagnostic::from(&other)),
            Ok(result) => result,
        };
        match &mut result {
            Ok(recording) => recording.sizes = self.write(recording, out, give)?,
            Err(_) => self.filter_again(out, give)?,
        }
        self.result = Some(result);
        Ok(())
    }

    /// Attitudes as they are without a smoother.
    fn filter_again(
        &mut self,
        out: &mut Vec<AttitudeSample>,
        give: &mut dyn FnMut(&mut [AttitudeSample]),
    ) -> Result<(), SpoolError> {
        let filter = &mut self.fresh;
        self.kept.give(|event| match event {
            Event::ForcesBeside => filter.expect_forces_beside(),
            Event::Force(stamp, force) => filter.take_force(stamp, force),
            Event::Field(stamp, field) => filter.take_field(stamp, field),
            Event::Rate(rate) => {
                filter.push(&[rate], out);
                if out.len() >= CHUNK {
                    give(out);
                    out.clear();
                }
            }
        })?;
        filter.finish(out);
        give(out);
        out.clear();
        Ok(())
    }

    fn reading(&mut self, iron: Option<FieldIron>) -> Reading<'_> {
        Reading {
            iron,
            has_forces_beside: self.fresh.has_forces_beside(),
            kept: &mut self.kept,
            waiting: None,
        }
    }

    /// Smooths it.
    ///
    /// # Errors
    /// It cannot be smoothed at all.
    fn smooth(
        &mut self,
        threads: usize,
        iron: Option<FieldIron>,
    ) -> Result<Result<Recording, Diagnostic>, SmoothError<SpoolError>> {
        let sample_model = match self.told.kind {
            SampleKind::Rate => SampleModel::Instant,
            _ => SampleModel::Interval,
        };
        let mut known = self.told.known;
        if let Some(iron) = &iron {
            known.field = std::array::from_fn(|n| Some(iron.matrix_sigma[(n / 3, n % 3)]));
        }
        let settings = Settings {
            sample_model,
            field_unit: FieldUnit::Unknown,
            bias_sigma: self.told.bias_sigma,
            looseness: self.told.looseness,
            other: self.told.other.map(|looseness| OtherClass {
                looseness,
                probability: self.aided.filter().other_class_probability(),
            }),
            known,
            // What a driver cut off is put back before, where it is.
            undo_truncation: false,
            threads: NonZero::new(threads).unwrap_or(NonZero::<usize>::MIN),
            ..Settings::default()
        };
        let mut settings = settings;
        let mut smoothed = self.smooth_by(&settings, iron)?;
        if smoothed.is_err() && self.told.is_class_found {
            // Priors that lead nowhere are none to prefer.
            let usual = Settings {
                looseness: PriorScale::default(),
                ..settings
            };
            let again = self.smooth_by(&usual, iron)?;
            if again.as_ref().is_ok_and(is_held) {
                (settings, smoothed) = (usual, again);
            }
        }
        let smoothed = match smoothed {
            Ok(smoothed) => smoothed,
            Err(why) => return Ok(Err(why)),
        };
        let looser = Settings {
            looseness: settings.looseness.times(LOOSER),
            other: None,
            known: settings.known.widened(LOOSER_KNOWN),
            ..settings
        };
        let again = if is_beyond(&smoothed, settings.looseness) {
            self.smooth_by(&looser, iron)?.ok()
        } else {
            None
        };
        Ok(Ok(Recording {
            is_beyond_class: again.is_some(),
            smoothed: again.unwrap_or(smoothed),
            spooled_bytes: self.kept.spooled_bytes(),
            iron,
            sizes: Vec::new(),
        }))
    }

    fn smooth_by(
        &mut self,
        settings: &Settings,
        iron: Option<FieldIron>,
    ) -> Result<Result<Smoothed, Diagnostic>, SmoothError<SpoolError>> {
        let smoothed = smooth(&mut self.reading(iron), settings)?;
        Ok(match smoothed.outcome() {
            // As it is without a smoother: nothing that runs along for its sake is better.
            Outcome::Filter(why) => Err(format!("it did not converge ({why})").into()),
            _ => Ok(smoothed),
        })
    }

    fn write(
        &mut self,
        Recording { smoothed, iron, .. }: &Recording,
        out: &mut Vec<AttitudeSample>,
        give: &mut dyn FnMut(&mut [AttitudeSample]),
    ) -> Result<Vec<Sizes>, SpoolError> {
        let heading = self.told.heading;
        let waiting = RefCell::new(VecDeque::new());
        let (mut before, gives_acceleration) = (None::<Nanos>, self.aided.gives_acceleration());
        let gravity = self.aided.filter().settings().gravity;
        let mut reading = Reading {
            waiting: Some(&waiting),
            ..self.reading(*iron)
        };
        let mut turn: Option<Quaternion<Nav, Nav>> = None;
        let (mut section, mut last): (usize, Option<Quaternion<Nav, Body>>) = (0, None);
        smoothed.attitudes(&mut reading, |estimates| {
            for estimate in estimates {
                let Some(rate) = waiting.borrow_mut().pop_front() else {
                    return;
                };
                let turn = *turn.get_or_insert_with(|| turned(smoothed, heading, estimate));
                let q_nb = (turn * estimate.q_nb).normalised();
                let q_nb = last.map_or(q_nb, |last| q_nb.same_sign_as(&last));
                last = Some(q_nb);
                let mut status = rate.status.with(Status::AIDED);
                if estimate.section > section {
                    section = estimate.section;
                    status = status.with(Status::RESET);
                }
                let covariance =
                    AttitudeCovariance::of_navigation_axes(&estimate.covariance, &estimate.q_nb);
                let secs = before
                    .replace(rate.stamp)
                    .map_or(0.0, |t| rate.stamp.secs_since(t));
                let force = rate.accel.filter(|_| gives_acceleration);
                out.push(AttitudeSample {
                    stamp: rate.stamp,
                    q_nb,
                    rate: BodyRate(estimate.rate),
                    accel: rate.accel,
                    linear_acceleration: force.map(|force| {
                        let (force, variance) = smoothed
                            .calibration()
                            .calibrated_force(force.as_vector(), &estimate.rate);
                        let variance = variance.add_scalar(LinearAcceleration::white(secs));
                        LinearAcceleration::at(&q_nb, &covariance, &force, &variance, gravity)
                    }),
                    covariance,
                    status,
                    reset_count: u32::try_from(section).unwrap_or(u32::MAX),
                    log: rate.log,
                    temperature: None,
                });
            }
            give(out);
            out.clear();
        })
    }
}

/// About the vertical, so that the first attitude has the heading that was said, where there is no north.
fn turned(smoothed: &Smoothed, heading: Option<f64>, first: &Estimate) -> Quaternion<Nav, Nav> {
    let has_north = smoothed.sections().iter().any(|section| section.has_north);
    let by = match heading.filter(|_| !has_north) {
        Some(heading) => heading - first.q_nb.yaw_pitch_roll().yaw,
        None => 0.0,
    };
    Quaternion::from_rotation_vector(&RotationVector(Vector3::z() * by))
}

#[cfg(test)]
mod tests;
