//! Conditioned samples of a whole recording -> its smoothed attitudes, at the end. Pure.
//!
//! Apart from the smoother because that reads samples again and again, and here they come once: they are kept, with the
//! vectors measured beside them, and a filter runs along for what the run says of turns, gaps and sensor.

use crate::aid::{Aided, Beside};
use crate::frames::{Body, Nav};
use crate::propagate::Executor;
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::{AttitudeCovariance, AttitudeSample, Nanos, RateSample, SampleKind, Status};
use crate::smooth::{
    Estimate, FieldUnit, Outcome, Sample, SampleModel, Samples, Settings, SmoothError, Smoothed,
    smooth,
};
use nalgebra::Vector3;
use std::convert::Infallible;
use std::num::NonZero;

/// Between the last sample and the next where the stamps go back: nothing is known of what lies between, ns.
const APART: i64 = 10_000_000_000;

/// Steps no longer than this, ns, hardly tell a rate at its stamp from a mean since the one before; sensors' own filters
/// make them late by more than half a step.
const SHORT: i64 = 5_000_000;
/// Steps that are looked at.
const FEW: usize = 4096;

/// What was said of a recording beforehand.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Told {
    /// What a sample means.
    pub(super) kind: SampleKind,
    /// Somebody said so.
    pub(super) is_kind_stated: bool,
    /// Heading of the first attitude, rad; `None`: that of the smoother.
    pub(super) heading: Option<f64>,
    /// How many times as far off as sensors of the default class this one may be.
    pub(super) looseness: f64,
}

/// A recording on its way to the smoother.
#[derive(Debug)]
pub(super) struct Smoothing {
    /// Runs along: counts, and attitudes where the smoother has none.
    aided: Aided,
    /// Its attitudes, kept only until the end is known to be smoothed.
    along: Vec<AttitudeSample>,
    kept: Kept,
    forces: Option<Beside>,
    fields: Beside,
    told: Told,
    /// Once the end has come; in words why there is none.
    result: Option<Result<Recording, String>>,
}

/// A recording that was smoothed.
#[derive(Debug)]
pub struct Recording {
    /// What was made of it; never [`Outcome::Filter`].
    pub smoothed: Smoothed,
    /// Nobody said what a sample means, and in steps of 5 ms and less they were taken as means since the one before.
    pub is_taken_as_mean: bool,
    /// The sensor is farther off than those of its class, and was smoothed again with priors 2.5 times as wide.
    pub is_beyond_class: bool,
}

/// A gyro whose scale or axes are found so many prior sigmas off is none of its class, and is smoothed again with
/// priors that are so many times as wide: those of one that nobody has calibrated.
const BEYOND: f64 = 2.5;
const LOOSER: f64 = 2.5;

fn is_beyond(smoothed: &Smoothed) -> bool {
    let gyro = &smoothed.calibration().gyro;
    let mut all = gyro.value.iter().zip(&gyro.prior);
    all.any(|(value, prior)| value.abs() > BEYOND * prior)
}

/// What was measured, in memory.
#[derive(Debug)]
struct Kept {
    kind: SampleKind,
    rates: Vec<RateSample>,
    /// Fields by the place of their sample.
    fields: Vec<(usize, Vector3<f64>)>,
    /// Stamps that went back go on from here: places, and what is added to the stamps from there on, ns.
    shifts: Vec<(usize, i64)>,
}

impl Kept {
    /// The median of the first steps, ns.
    fn step(&self) -> Option<i64> {
        let steps = self.rates.windows(2).take(FEW);
        let mut steps: Vec<i64> = steps
            .filter_map(|pair| Some(pair.last()?.stamp.since(pair.first()?.stamp)))
            .collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied()
    }
}

impl Samples for &Kept {
    type Error = Infallible;

    fn pass(&mut self, take: &mut dyn FnMut(&[Sample])) -> Result<(), Infallible> {
        const CHUNK: usize = 4096;
        let mut chunk = Vec::with_capacity(CHUNK);
        let mut fields = self.fields.iter().peekable();
        let mut shifts = self.shifts.iter().peekable();
        let mut shift = 0;
        for (place, rate) in self.rates.iter().enumerate() {
            if let Some((_, by)) = shifts.next_if(|(at, _)| *at == place) {
                shift = *by;
            }
            let field = fields.next_if(|(at, _)| *at == place);
            chunk.push(Sample {
                stamp: Nanos(rate.stamp.0.saturating_add(shift)),
                rate: rate.mean_rate(self.kind),
                force: rate.accel,
                field: field.map(|(_, field)| *field),
            });
            if chunk.len() == CHUNK {
                take(&chunk);
                chunk.clear();
            }
        }
        take(&chunk);
        Ok(())
    }
}

impl Smoothing {
    /// Of a filter that has taken nothing yet.
    pub(super) fn new(aided: Aided, told: Told) -> Smoothing {
        Smoothing {
            forces: aided.has_forces_beside().then(Beside::default),
            fields: Beside::with_repeats(),
            aided,
            along: Vec::new(),
            kept: Kept {
                kind: told.kind,
                rates: Vec::new(),
                fields: Vec::new(),
                shifts: Vec::new(),
            },
            told,
            result: None,
        }
    }

    /// The filter that runs along.
    pub(super) fn aided(&self) -> &Aided {
        &self.aided
    }

    /// What was made of it, once the end has come.
    pub(super) fn result(&self) -> Option<Result<&Recording, &str>> {
        let result = self.result.as_ref()?;
        Some(result.as_ref().map_err(String::as_str))
    }

    pub(super) fn expect_forces_beside(&mut self) {
        self.forces.get_or_insert_default();
        self.aided.expect_forces_beside();
    }

    pub(super) fn take_force(&mut self, stamp: Nanos, force: Vector3<f64>) {
        if let Some(forces) = &mut self.forces {
            forces.take(stamp, force);
        }
        self.aided.take_force(stamp, force);
    }

    pub(super) fn take_field(&mut self, stamp: Nanos, field: Vector3<f64>) {
        self.fields.take(stamp, field);
        self.aided.take_field(stamp, field);
    }

    pub(super) fn push(&mut self, rates: &[RateSample]) {
        for rate in rates {
            let turning = rate.mean_rate(self.kept.kind);
            let place = self.kept.rates.len();
            if let Some(last) = self
                .kept
                .rates
                .last()
                .filter(|last| last.stamp >= rate.stamp)
            {
                let so_far = self.kept.shifts.last().map_or(0, |(_, by)| *by);
                let by = last.stamp.since(rate.stamp).saturating_add(APART);
                self.kept.shifts.push((place, so_far.saturating_add(by)));
            }
            let accel = match &mut self.forces {
                None => rate.accel,
                Some(forces) => forces.at(rate.stamp, &turning),
            };
            if let Some(field) = self.fields.at(rate.stamp, &turning) {
                self.kept.fields.push((place, field));
            }
            self.kept.rates.push(RateSample { accel, ..*rate });
        }
        self.aided.push(rates, &mut self.along);
    }

    /// The recording has ended: appends all its attitudes.
    pub(super) fn finish(&mut self, exec: &impl Executor, out: &mut Vec<AttitudeSample>) {
        self.aided.finish(&mut self.along);
        let result = self.smooth(exec.threads());
        match &result {
            Ok(recording) => {
                self.along = Vec::new();
                self.write(&recording.smoothed, out);
            }
            Err(_) => out.append(&mut self.along),
        }
        self.result = Some(result);
    }

    fn smooth(&self, threads: usize) -> Result<Recording, String> {
        let is_taken_as_mean = self.kept.kind == SampleKind::Rate
            && !self.told.is_kind_stated
            && self.kept.step().is_some_and(|step| step <= SHORT);
        let sample_model = match self.kept.kind {
            SampleKind::Rate if !is_taken_as_mean => SampleModel::Instant,
            _ => SampleModel::Interval,
        };
        let settings = Settings {
            sample_model,
            field_unit: FieldUnit::Unknown,
            looseness: self.told.looseness,
            // What a driver cut off is put back before, where it is.
            undo_truncation: false,
            threads: NonZero::new(threads).unwrap_or(NonZero::<usize>::MIN),
            ..Settings::default()
        };
        let smoothed = self.smooth_by(&settings)?;
        let again = is_beyond(&smoothed).then(|| {
            self.smooth_by(&Settings {
                looseness: LOOSER * settings.looseness,
                ..settings
            })
        });
        // Priors that lead nowhere are none to prefer.
        let (smoothed, is_beyond_class) = match again {
            Some(Ok(again)) => (again, true),
            Some(Err(_)) | None => (smoothed, false),
        };
        Ok(Recording {
            smoothed,
            is_taken_as_mean,
            is_beyond_class,
        })
    }

    fn smooth_by(&self, settings: &Settings) -> Result<Smoothed, String> {
        let smoothed = smooth(&mut &self.kept, settings).map_err(|why| match why {
            SmoothError::Read(never) => match never {},
            other => other.to_string(),
        })?;
        match smoothed.outcome() {
            // As it is without a smoother: nothing that runs along for its sake is better.
            Outcome::Filter(why) => Err(format!("it did not converge ({why})")),
            _ => Ok(smoothed),
        }
    }

    fn write(&self, smoothed: &Smoothed, out: &mut Vec<AttitudeSample>) {
        let mut rates = self.kept.rates.iter();
        let mut turn: Option<Quaternion<Nav, Nav>> = None;
        let (mut section, mut last): (usize, Option<Quaternion<Nav, Body>>) = (0, None);
        let taken = smoothed.attitudes(&mut &self.kept, |estimates| {
            for (estimate, rate) in estimates.iter().zip(&mut rates) {
                let turn = *turn.get_or_insert_with(|| self.turn(smoothed, estimate));
                let q_nb = (turn * estimate.q_nb).normalised();
                let q_nb = last.map_or(q_nb, |last| q_nb.same_sign_as(&last));
                last = Some(q_nb);
                let mut status = rate.status.with(Status::AIDED);
                if estimate.section > section {
                    section = estimate.section;
                    status = status.with(Status::RESET);
                }
                out.push(AttitudeSample {
                    stamp: rate.stamp,
                    q_nb,
                    rate: estimate.rate,
                    accel: rate.accel,
                    covariance: AttitudeCovariance::of_navigation_axes(
                        &estimate.covariance,
                        &estimate.q_nb,
                    ),
                    status,
                    reset_count: u32::try_from(section).unwrap_or(u32::MAX),
                    log: rate.log,
                });
            }
        });
        match taken {
            Ok(()) => {}
            Err(never) => match never {},
        }
    }

    /// About the vertical, so that the first attitude has the heading that was said, where there is no north.
    fn turn(&self, smoothed: &Smoothed, first: &Estimate) -> Quaternion<Nav, Nav> {
        let has_north = smoothed.sections().iter().any(|section| section.has_north);
        let by = match self.told.heading.filter(|_| !has_north) {
            Some(heading) => heading - first.q_nb.yaw_pitch_roll().yaw,
            None => 0.0,
        };
        Quaternion::from_rotation_vector(&RotationVector(Vector3::z() * by))
    }
}
