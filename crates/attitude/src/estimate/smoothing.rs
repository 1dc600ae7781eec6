//! Conditioned samples of a whole recording -> its smoothed attitudes, at the end. Pure.
//!
//! Apart from the smoother because that reads samples again and again, and here they come once: they are kept, with the
//! vectors measured beside them ([`SampleStore`]), and a filter runs along for what the run says of turns, gaps and sensor.

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
    Estimate, Estimated, FORCE_SCALE, FieldUnit, OtherClass, Outcome, PriorScale, PriorSigmas,
    Sample, SampleModel, Samples, Settings, Sizes, SmoothError, Smoothed, smooth,
};
use nalgebra::Vector3;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::num::NonZero;

/// Time put between the last sample and the next where the stamps go back: nothing is known of what lies between, ns.
const APART: i64 = 10_000_000_000;

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

/// A sensor is none of its class if a constant is found so many sigmas off: of what a log finds where the class is
/// right, which is the less the less it sees (the prior's variance less what the log leaves of it).
const BEYOND: f64 = 3.5;
/// Least of that, beside the prior's sigma: what a log hardly sees is not looked at.
const LEAST_SEEN: f64 = 0.1;
/// And is smoothed again with priors that are so many times as wide: those of one that nobody has calibrated
/// (`uncalibrated` beside what is expected where nobody says anything). Of acceleration it feels what its class does: with
/// more the 14 recordings of BROAD are worse, and simulated bodies no better.
const LOOSER: PriorScale = PriorScale {
    scale: 2.5,
    axes: 6.0,
    force: 9.8,
    sensitivity: 1.0,
};
/// Factor by which the sigmas of a calibration file are widened.
const LOOSER_KNOWN: f64 = 2.5;

fn is_beyond(smoothed: &Smoothed, looseness: PriorScale) -> bool {
    let calibration = smoothed.calibration();
    let force = own_scales(calibration.force, FORCE_SCALE * looseness.scale);
    is_off(&calibration.gyro) || is_off(&calibration.force_bias) || is_off(&force)
}

/// Whether something beside gravity holds the attitudes: a rest, a bias about an upright axis that was held, or a north.
/// Without any, priors that are too narrow make motion of what is wrong with the sensor.
fn is_held(smoothed: &Smoothed) -> bool {
    smoothed.counts().standstills > 0
        || smoothed.held().is_some()
        || smoothed.sections().iter().any(|section| section.has_north)
}

/// Removes what the scales of all axes share, which is known of no accelerometer: each is then known to `own`.
fn own_scales(mut force: Estimated<9>, own: f64) -> Estimated<9> {
    const SCALES: [usize; 3] = [0, 4, 8];
    if SCALES.iter().all(|i| force.prior[*i] > own) {
        let common = SCALES.iter().map(|i| force.value[*i]).sum::<f64>() / 3.0;
        for i in SCALES {
            force.value[i] -= common;
            (force.sigma[i], force.prior[i]) = (0.0, own);
        }
    }
    force
}

fn is_off<const N: usize>(learned: &Estimated<N>) -> bool {
    let sigmas = learned.sigma.iter().zip(&learned.prior);
    let mut all = learned.value.iter().zip(sigmas);
    all.any(|(value, (sigma, prior))| {
        let seen = (prior * prior - sigma * sigma).max(0.0).sqrt();
        value.abs() > BEYOND * seen.max(LEAST_SEEN * prior)
    })
}

/// Kept samples, as the smoother reads them.
struct Reading<'a> {
    kept: &'a mut SampleStore,
    iron: Option<FieldIron>,
    has_forces_beside: bool,
    /// Rates whose attitudes have not come yet, where they are wanted.
    waiting: Option<&'a RefCell<VecDeque<RateSample>>>,
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
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::aid::{self, Start};
    use crate::propagate::{self, Sequential};
    use crate::record::Measured;
    use crate::smooth::BIAS_SIGMA;
    use std::io::Cursor;

    const SAMPLES: i64 = 24_000;

    /// A hand that rests, turns and rests: rates, and forces and fields at rates and stamps of their own.
    fn taken(smoothing: &mut Smoothing, is_smooth: bool) {
        taken_by(smoothing, is_smooth, Vector3::zeros());
    }

    /// Accounts for an accelerometer that is off by `bias`.
    fn taken_by(smoothing: &mut Smoothing, is_smooth: bool, bias: Vector3<f64>) {
        let mut q = Quaternion::<Nav, Body>::identity();
        for i in 0..SAMPLES {
            let stamp = Nanos(i * 2_500_000);
            let t = i as f64 * 0.0025;
            let share = if (20.0..40.0).contains(&t) { 1.0 } else { 0.0 };
            let rate = Vector3::new((1.1 * t).sin(), (0.7 * t).cos(), (1.7 * t).sin()) * share;
            q = q.advanced(&RotationVector(rate * 0.0025));
            let to_body = q.to_dcm().as_matrix().transpose();
            // What never rests and goes far is not smoothed.
            let push = if is_smooth {
                0.0
            } else {
                9.0 * (0.2 * t).sin()
            };
            if i % 8 == 0 {
                let force = to_body * Vector3::new(push, 0.0, 9.81);
                smoothing.take_force(Nanos(stamp.0 - 1_000_000), In::assume(force + bias));
            }
            if i % 40 == 0 {
                smoothing.take_field(
                    Nanos(stamp.0 - 3_000_000),
                    In::assume(to_body * Vector3::new(0.0, 20.0, -40.0)),
                );
            }
            let wobble = Vector3::new(1.0, -2.0, 1.5) * (1e-3 * (31.0 * t).sin());
            let shaken = if is_smooth { wobble } else { wobble * 200.0 };
            let sample = RateSample {
                stamp,
                start: stamp,
                gyro: Measured::Rate(BodyRate(rate + Vector3::repeat(0.01) + shaken)),
                accel: None,
                join: if i == 0 {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: Nanos(stamp.0 + 5),
            };
            smoothing.push(&[sample], &mut Vec::new());
        }
    }

    fn aided() -> AidedPropagator {
        let settings = aid::Settings {
            has_field: true,
            ..aid::Settings::default()
        };
        let aided = AidedPropagator::new(propagate::Settings::default(), settings, Start::Level);
        aided.unwrap().with_forces_beside()
    }

    fn attitudes(mut smoothing: Smoothing) -> (Vec<AttitudeSample>, Option<String>) {
        let mut all = Vec::new();
        let given = smoothing.finish(&Sequential, &mut Vec::new(), &mut |some| {
            all.extend_from_slice(some)
        });
        given.unwrap();
        (
            all,
            smoothing
                .result()
                .and_then(Result::err)
                .map(ToString::to_string),
        )
    }

    fn new() -> Smoothing {
        Smoothing::new(
            aided(),
            SmoothingInputs {
                kind: SampleKind::Rate,
                heading: None,
                bias_sigma: BIAS_SIGMA,
                looseness: PriorScale::default(),
                other: None,
                is_class_found: false,
                known: PriorSigmas::default(),
            },
        )
    }

    #[test]
    fn a_recording_kept_in_a_file_gives_the_bits_of_one_in_memory() {
        for is_smooth in [true, false] {
            let (mut held, mut spooled) = (new(), new());
            spooled.kept = SampleStore::of_at_most(0);
            spooled.spool_to(Box::new(Cursor::new(Vec::new())));
            taken(&mut held, is_smooth);
            taken(&mut spooled, is_smooth);
            let (held, why) = attitudes(held);
            assert_eq!(why.is_none(), is_smooth, "{why:?}");
            assert_eq!(held.len() as i64, SAMPLES);
            assert!(spooled.kept.spooled_bytes() > 0);
            assert_eq!(attitudes(spooled), (held, why));
        }
    }

    #[test]
    fn an_accelerometer_far_off_its_class_is_smoothed_as_one_nobody_calibrated() {
        for (off, is_beyond) in [(0.05, false), (0.4, true)] {
            let bias = Vector3::new(off, -off, 0.5 * off);
            let mut smoothing = new();
            taken_by(&mut smoothing, true, bias);
            let given = smoothing.finish(&Sequential, &mut Vec::new(), &mut |_| {});
            given.unwrap();
            let recording = smoothing.result().unwrap().unwrap();
            assert_eq!(recording.is_beyond_class, is_beyond, "{off}");
            let found = recording.smoothed.calibration().force_bias;
            for axis in 0..3 {
                let error = (found.value[axis] - bias[axis]).abs();
                assert!(error < 3.0 * found.sigma[axis], "{off}: {found:?}");
            }
        }
    }

    #[test]
    fn where_nothing_is_smoothed_the_attitudes_are_the_filters_with_what_came_beside() {
        let mut smoothing = new();
        taken(&mut smoothing, false);
        // The same events to a filter alone.
        let (mut alone, mut filtered) = (aided(), Vec::new());
        let events = smoothing.kept.give(|event| match event {
            Event::Rate(rate) => alone.push(&[rate], &mut filtered),
            Event::Force(stamp, force) => alone.take_force(stamp, force),
            Event::Field(stamp, field) => alone.take_field(stamp, field),
            Event::ForcesBeside => alone.expect_forces_beside(),
        });
        events.unwrap();
        alone.finish(&mut filtered);
        let running = format!("{:?}", smoothing.aided().filter().report());
        let (given, why) = attitudes(smoothing);
        assert!(why.is_some());
        assert_eq!(given, filtered);
        assert_eq!(running, format!("{:?}", alone.filter().report()));
    }
}
