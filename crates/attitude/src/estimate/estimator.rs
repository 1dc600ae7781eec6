//! Samples of one topic -> attitude: the one path that replay, serve, simulate and tests share.
//!
//! Conditions and propagates; what must be known first ([`Prepared`]) is given. Reads no clock and
//! does no I/O.

use super::aiding::{self, Forces};
use super::anew::RestartRequest;
use super::gyro_watch::GyroWatch;
use super::integrator::{AuxiliaryVector, Integrator};
use super::kept::{Spool, SpoolError};
use super::magnetometer_watch::MagnetometerWatch;
use super::meaning::Meaning;
use super::plan::{EstimationSettings, Initial, Noise};
use super::preparation::Prepared;
use super::settings_fingerprint::settings_fingerprint;
use super::smoothing::{Recording, Smoothing, SmoothingInputs};
use crate::aid::{self, AidedPropagator};
use crate::condition::regularise::{self, Regulariser};
use crate::condition::{self, Clock, Conditioner};
use crate::consistency::{Consistency, FieldConsistency};
use crate::diagnostic::Diagnostic;
use crate::frames::{In, Nav};
use crate::propagate::{self, Executor, Method, Propagator};
use crate::quaternion::{BodyRate, Quaternion, RotationVector};
use crate::record::{AttitudeSample, Join, Nanos, RateSample, RawSample};
use crate::smooth::{PriorScale, PriorSigmas};
use crate::worlds::{Convention, World};
use nalgebra::Vector3;

/// Samples at once that memory is kept for.
const FEW: usize = 8;

/// An estimator of one stream.
#[derive(Debug)]
pub struct Estimator {
    conditioner: Conditioner,
    regulariser: Option<Regulariser>,
    integrator: Integrator,
    asked: OutputFrame,
    /// Vectors that came between the rates, each before the rate of this number.
    beside: Vec<(usize, Nanos, AuxiliaryVector)>,
    /// Auxiliary inputs; `None` where nothing of them is used.
    besides: Option<AuxiliaryInputs>,
    /// Watch over the gyro, where somebody wants it; it changes no attitude and is not remembered.
    watch: Option<GyroWatch>,
    /// The same over the magnetometer.
    magnetometer: Option<Box<MagnetometerWatch>>,
    /// Tells settings apart under which a [`Memory`] means something else.
    settings: u64,
    /// The next sample begins anew.
    begins_anew: bool,
    rates: Vec<RateSample>,
    /// The same with their new stamps.
    even: Vec<RateSample>,
    out: Vec<AttitudeSample>,
}

/// Auxiliary inputs: what is taken beside the rates.
#[derive(Debug)]
struct AuxiliaryInputs {
    resolved: Meaning,
    clock: Clock,
    forces: Forces,
    has_field: bool,
    /// Multiplies forces, once the first has come.
    force_scale: Option<f64>,
}

/// State of an estimator at one moment: a few kilobytes of text.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Memory {
    settings: u64,
    conditioning: condition::Memory,
    propagation: propagate::Memory,
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    aiding: Option<aid::Memory>,
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    force_scale: Option<f64>,
}

impl Memory {
    /// The last stamp that was used.
    #[must_use]
    pub fn last(&self) -> Option<Nanos> {
        self.conditioning.last()
    }

    /// Whether an estimator can have known it, whatever its settings: a file may say anything.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        let scale = self.force_scale.unwrap_or(1.0);
        self.conditioning.is_plausible()
            && self.propagation.is_plausible()
            && self.aiding.as_ref().is_none_or(aid::Memory::is_plausible)
            && scale.is_finite()
            && scale > 0.0
    }

    /// Whether specific forces came in messages of their own.
    #[must_use]
    pub fn has_forces_beside(&self) -> bool {
        self.aiding
            .as_ref()
            .is_some_and(aid::Memory::has_forces_beside)
    }
}

impl Estimator {
    /// Makes one for samples understood as `resolved`, from what `prepared` states.
    ///
    /// The method without latency takes them as [`Estimator::live`] does, in a replay, too: what it gives
    /// is what a daemon would have said.
    ///
    /// # Errors
    /// In words, with the flag that helps: settings that cannot be.
    pub fn new(
        plan: &EstimationSettings,
        resolved: &Meaning,
        prepared: &Prepared,
    ) -> Result<Estimator, Diagnostic> {
        if matches!(
            plan.method,
            Method::Live { .. } | Method::CommitProvisional { .. }
        ) {
            return Estimator::live(plan, resolved, prepared);
        }
        let settings = conditioning(plan, resolved, prepared);
        Estimator::with(plan, resolved, prepared, &settings)
    }

    /// The same for a live stream: no sample waits for its successors, so one that comes late is
    /// dropped and counted.
    ///
    /// # Errors
    /// As [`Estimator::new`].
    pub fn live(
        plan: &EstimationSettings,
        resolved: &Meaning,
        prepared: &Prepared,
    ) -> Result<Estimator, Diagnostic> {
        let settings = condition::Settings {
            reorder_window: condition::Settings::LIVE_WINDOW,
            ..conditioning(plan, resolved, prepared)
        };
        Estimator::with(plan, resolved, prepared, &settings)
    }

    fn with(
        plan: &EstimationSettings,
        resolved: &Meaning,
        prepared: &Prepared,
        settings: &condition::Settings,
    ) -> Result<Estimator, Diagnostic> {
        // What corrects the attitude has a noise of its own.
        let noise = match (prepared.aiding.is_some(), plan.initial) {
            (true, _) => Noise {
                scale: 0.0,
                misalignment: 0.0,
                ..prepared.noise.clone()
            },
            (false, Initial::Gravity) => prepared.noise.levelled(prepared.tilt_sigma),
            (false, _) => prepared.noise.clone(),
        };
        let noise = match (&plan.calibration, &prepared.aiding) {
            (Some(known), None) => known.narrowed(&noise),
            _ => noise,
        };
        let propagation = propagate::Settings {
            method: plan.method,
            kind: resolved.kind,
            initial: prepared.initial,
            world_rate: prepared.world_rate,
            noise: noise.with_bias(prepared.bias_sigma.into()),
        };
        let noise = propagation.noise;
        let integrator = match &prepared.aiding {
            None => Propagator::new(propagation).map(|p| Integrator::Alone(Box::new(p))),
            Some(aiding) => {
                AidedPropagator::new(propagation, aiding.settings, aiding.start).map(|aided| {
                    let aided = match aiding.forces {
                        Forces::Beside => aided.with_forces_beside(),
                        Forces::WithRates | Forces::Unseen => aided,
                    };
                    if plan.smooth {
                        let heading = match aiding.start {
                            aid::Start::Level | aid::Start::LevelBy(_) => None,
                            aid::Start::Known { .. } => Some(prepared.initial.yaw_pitch_roll().yaw),
                        };
                        let usual = aid::Settings::default();
                        let told = SmoothingInputs {
                            kind: resolved.kind,
                            is_kind_stated: resolved.is_kind_stated,
                            heading,
                            looseness: PriorScale {
                                scale: aiding.settings.scale_prior / usual.scale_prior,
                                axes: aiding.settings.cross_prior / usual.cross_prior,
                                force: aiding.settings.force_bias_prior / usual.force_bias_prior,
                            },
                            bias_sigma: prepared.noise.bias_of_class(),
                            gyro_range: aiding.settings.gyro_range,
                            known: PriorSigmas {
                                gyro_bias: aiding.stated_bias(prepared.bias_left.is_some()),
                                ..resolved.beforehand()
                            },
                        };
                        let smoothing = Smoothing::new(aided, told);
                        Integrator::Smoothed(Box::new(smoothing))
                    } else {
                        Integrator::Aided(Box::new(aided))
                    }
                })
            }
        }
        .map_err(|e| Diagnostic::from(&e))?;
        Ok(Estimator {
            settings: settings_fingerprint(settings, plan, prepared, &noise),
            conditioner: Conditioner::new(settings).map_err(|e| e.to_string())?,
            regulariser: prepared.stamps.regulariser(resolved.kind)?,
            integrator,
            asked: OutputFrame {
                delay: plan.sensor_delay_secs,
                world: prepared.world,
                north: (plan.declination != 0.0 && prepared.aiding.is_some())
                    .then(|| turned_north(plan.declination)),
            },
            beside: Vec::new(),
            besides: prepared.aiding.map(|aiding| AuxiliaryInputs {
                resolved: resolved.clone(),
                clock: prepared.clock,
                forces: aiding.forces,
                has_field: aiding.settings.has_field,
                force_scale: None,
            }),
            watch: None,
            magnetometer: None,
            begins_anew: false,
            rates: Vec::new(),
            even: Vec::new(),
            out: Vec::new(),
        })
    }

    /// Goes on from the last attitude of an estimator whose settings were the same, before the first
    /// sample of this one: see [`Propagator::resume`].
    ///
    /// # Errors
    /// In words: it is no rotation.
    pub fn resume(&mut self, last: &AttitudeSample) -> Result<(), Diagnostic> {
        let last = self.asked.undone(last);
        self.integrator.resume(&last)
    }

    /// State, for another estimator to go on exactly; `None` where there is nothing yet, and
    /// where stamps are regularised, which is not kept.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        if self.regulariser.is_some() || !self.beside.is_empty() {
            return None;
        }
        let (propagation, aiding) = self.integrator.memory()?;
        Some(Memory {
            settings: self.settings,
            conditioning: self.conditioner.memory()?,
            propagation,
            aiding,
            force_scale: self.besides.as_ref().and_then(|b| b.force_scale),
        })
    }

    /// Goes on as the estimator would have that knew this; what was counted here stays. `false`, and it
    /// is as before, when that had other settings or no estimator can have known it.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        if self.regulariser.is_some() || self.settings != memory.settings {
            return false;
        }
        let mut conditioner = self.conditioner.clone();
        let fits = conditioner.recall(&memory.conditioning)
            && self
                .integrator
                .recall(&memory.propagation, memory.aiding.as_ref());
        if fits {
            self.conditioner = conditioner;
            if let Some(besides) = &mut self.besides {
                besides.force_scale = memory.force_scale.filter(|s| s.is_finite());
            }
        }
        fits
    }

    /// Begins as the run after that of `before`, whose samples stay counted: the first attitude says
    /// that it was reset.
    pub fn continue_counts_of(&mut self, before: &condition::Report, resets: u32) {
        self.conditioner.continue_counts_of(before);
        self.integrator.continue_counts_of(resets);
    }

    /// The next sample begins the attitude anew, and says so ([`Status::RESET`]); the run and what was learned of
    /// the sensor go on.
    ///
    /// [`Status::RESET`]: crate::record::Status::RESET
    pub fn begin_anew(&mut self, anew: &RestartRequest) {
        self.integrator.begin_anew(anew);
        self.begins_anew = true;
    }

    /// Turns the world so that the next sample has this heading (rad), and says [`Status::RESET`]: see
    /// [`AidedPropagator::turn_heading`]. `false`, and nothing changes, of a gyro alone: it has no vertical.
    ///
    /// [`Status::RESET`]: crate::record::Status::RESET
    /// [`AidedPropagator::turn_heading`]: crate::aid::AidedPropagator::turn_heading
    pub fn turn_heading(&mut self, heading: f64) -> bool {
        self.integrator.turn_heading(heading)
    }

    /// See [`Conditioner::stamp_of`].
    #[must_use]
    pub fn stamp_of(&self, raw: &RawSample, near: Nanos) -> Option<Nanos> {
        self.conditioner.stamp_of(raw, near)
    }

    /// A sample came that its sender has sent before: it is counted, and nothing else.
    pub fn take_late(&mut self, stamp: Nanos) {
        self.conditioner.push_late(stamp);
    }

    /// Takes the next sample.
    #[inline]
    pub fn take(&mut self, raw: &RawSample) {
        if raw.is_beside {
            return self.take_beside(raw);
        }
        if raw.mag.is_some() {
            self.take_field(raw);
        }
        if let Some(besides) = &mut self.besides
            && besides.forces == Forces::Unseen
            && raw.accel.is_some()
        {
            besides.forces = Forces::WithRates;
        }
        self.conditioner
            .push(std::slice::from_ref(raw), &mut self.rates);
    }

    /// Takes the specific force, or the magnetic field, of a message that carries no rate: of topics, and at
    /// rates, of their own. What is not asked for ([`EstimationSettings::aid`]), and a force where forces come with the rates
    /// ([`Forces`]), is passed over.
    pub fn take_beside(&mut self, raw: &RawSample) {
        self.take_field(raw);
        let Some(besides) = &mut self.besides else {
            return;
        };
        let (Some(force), Some(stamp)) = (raw.accel, besides.clock.read(raw)) else {
            return;
        };
        let stamp = self.conditioner.of_auxiliary(stamp);
        match besides.forces {
            Forces::WithRates => return,
            Forces::Beside => {}
            Forces::Unseen => {
                besides.forces = Forces::Beside;
                self.integrator.expect_forces_beside();
            }
        }
        let resolved = &besides.resolved;
        let scale = *besides.force_scale.get_or_insert_with(|| {
            aiding::force_scale(resolved, resolved.force(force).as_vector().norm())
        });
        let force = resolved.calibrated_force(force, scale);
        let place = self.rates.len();
        self.beside
            .push((place, stamp, AuxiliaryVector::Force(force)));
    }

    fn take_field(&mut self, raw: &RawSample) {
        if let Some(watch) = &mut self.magnetometer {
            watch.take_field(raw, |stamp| self.conditioner.of_auxiliary(stamp));
        }
        let Some(besides) = self.besides.as_ref().filter(|b| b.has_field) else {
            return;
        };
        let Some((field, stamp)) = raw.mag.zip(besides.clock.read(raw)) else {
            return;
        };
        let stamp = self.conditioner.of_auxiliary(stamp);
        let (field, lead) = besides.resolved.field(field);
        let stamp = Nanos(stamp.0.saturating_add((lead * 1e9).round() as i64));
        let place = self.rates.len();
        self.beside
            .push((place, stamp, AuxiliaryVector::Field(field)));
    }

    /// A payload that could not be decoded stood here in the stream.
    pub fn take_undecodable(&mut self) {
        self.conditioner.push_undecodable(1);
    }

    /// The attitudes that are known by now. Their bits do not depend on when they are asked for.
    pub fn attitudes(&mut self, exec: &impl Executor) -> &[AttitudeSample] {
        self.out.clear();
        self.propagate(exec);
        self.asked.apply(&mut self.out);
        &self.out
    }

    /// Gives back the memory that only many samples at once need: one of many sensors waits for its next ones.
    pub fn trim(&mut self) {
        self.rates.shrink_to(FEW);
        self.out.clear();
        self.out.shrink_to(FEW);
    }

    /// Keeps in `spool` what a recording that is smoothed needs beyond some hundred megabytes: for
    /// [`Estimator::finish_into`], before the first sample.
    pub fn spool_to(&mut self, spool: Box<dyn Spool>) {
        self.integrator.spool_to(spool);
    }

    /// Ends it: returns the rest of the attitudes, at once.
    pub fn finish(&mut self, exec: &impl Executor) -> Vec<AttitudeSample> {
        let mut all = Vec::new();
        let done = self.finish_into(exec, |attitudes| {
            all.extend_from_slice(attitudes);
            Ok::<(), SpoolError>(())
        });
        debug_assert!(done.is_ok(), "nothing fails in memory: {done:?}");
        all
    }

    /// Ends it: gives the rest of the attitudes to `take`, in pieces; of a recording that is smoothed these are
    /// all.
    ///
    /// # Errors
    /// Those of `take`, which is not called again then; of the spool.
    pub fn finish_into<E: From<SpoolError>>(
        &mut self,
        exec: &impl Executor,
        mut take: impl FnMut(&[AttitudeSample]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.out.clear();
        self.conditioner.finish(&mut self.rates);
        self.propagate(exec);
        if let Some(regulariser) = &mut self.regulariser {
            regulariser.finish(&mut self.even);
            self.integrator.push(&self.even, exec, &mut self.out);
            self.even.clear();
        }
        let asked = self.asked;
        let mut taken = Ok(());
        self.integrator
            .finish(exec, &mut self.out, &mut |attitudes| {
                if taken.is_ok() {
                    asked.apply(attitudes);
                    taken = take(attitudes);
                }
            })?;
        taken
    }

    fn propagate(&mut self, exec: &impl Executor) {
        if self.beside.is_empty() {
            self.push_rates(exec);
            return;
        }
        let rates = std::mem::take(&mut self.rates);
        let mut from = 0;
        for (place, stamp, beside) in std::mem::take(&mut self.beside) {
            self.rates
                .extend_from_slice(rates.get(from..place).unwrap_or(&[]));
            self.push_rates(exec);
            if let AuxiliaryVector::Force(force) = &beside {
                if let Some(watch) = &mut self.watch {
                    watch.take_force(stamp, *force);
                }
                if let Some(watch) = &mut self.magnetometer {
                    watch.take_force(stamp, *force);
                }
            }
            self.integrator.take_beside(stamp, beside);
            from = place;
        }
        self.rates
            .extend_from_slice(rates.get(from..).unwrap_or(&[]));
        self.push_rates(exec);
    }

    fn push_rates(&mut self, exec: &impl Executor) {
        if let Some(watch) = &mut self.watch {
            watch.push(&self.rates);
        }
        if let Some(watch) = &mut self.magnetometer {
            watch.push(&self.rates);
        }
        let rates = match &mut self.regulariser {
            None => &mut self.rates,
            Some(regulariser) => {
                regulariser.push(&self.rates, &mut self.even);
                &mut self.even
            }
        };
        if let Some(first) = rates.first_mut()
            && std::mem::take(&mut self.begins_anew)
        {
            first.join = Join::Reset;
        }
        self.integrator.push(rates, exec, &mut self.out);
        self.even.clear();
        self.rates.clear();
    }

    /// Holds the gyro against accelerometer and magnetometer from now on, for [`Estimator::consistency`] and
    /// [`Estimator::field_consistency`]; `resolved` and `prepared` are those by which this was made.
    pub fn watch_sensors(&mut self, resolved: &Meaning, prepared: &Prepared) {
        self.watch = Some(GyroWatch::new(&resolved.to_body()));
        let watch = MagnetometerWatch::new(resolved, prepared.clock);
        self.magnetometer = Some(Box::new(watch));
    }

    /// Gyro against accelerometer as far as was seen; `None` where nobody asked to watch.
    #[must_use]
    pub fn consistency(&self) -> Option<&Consistency> {
        self.watch.as_ref().map(GyroWatch::consistency)
    }

    /// Gyro against magnetometer as far as was seen; `None` where nobody asked to watch.
    #[must_use]
    pub fn field_consistency(&self) -> Option<&FieldConsistency> {
        Some(self.magnetometer.as_ref()?.consistency())
    }

    /// Report of conditioning.
    #[must_use]
    pub fn conditioning(&self) -> &condition::Report {
        self.conditioner.report()
    }

    /// Report of the stamps, if they were regularised: whether causally, and how.
    #[must_use]
    pub fn regularising(&self) -> Option<(bool, regularise::Report)> {
        let regulariser = self.regulariser.as_ref()?;
        Some((regulariser.is_causal(), regulariser.report()))
    }

    /// Report of propagation.
    #[must_use]
    pub fn propagation(&self) -> propagate::Report {
        self.integrator.propagation()
    }

    /// Filter that corrects the attitude, if there is one; beside a smoother, the one that runs along with it.
    #[must_use]
    pub fn filter(&self) -> Option<&aid::Filter> {
        self.integrator.filter()
    }

    /// Result of a smoother, once it is finished; `None` where nobody asked for one.
    ///
    /// # Errors
    /// In words: why it made nothing of it. The attitudes are the filter's then, to the bit.
    #[must_use]
    pub fn smoothed(&self) -> Option<Result<&Recording, &Diagnostic>> {
        self.integrator.smoothed()
    }

    /// Keeps the innovations of what corrects the attitude, for [`Estimator::innovations`].
    pub fn keep_innovations(&mut self) {
        self.integrator.keep_innovations();
    }

    /// Takes the innovations kept since the last call, each with the stamp of the correction.
    pub fn innovations(&mut self) -> Vec<(Nanos, aid::Innovation)> {
        self.integrator.innovations()
    }

    /// The method, with its window and order.
    #[must_use]
    pub fn method(&self) -> Method {
        self.integrator.method()
    }
}

/// Output frame of attitudes: in which world, of which instant.
#[derive(Clone, Copy, Debug)]
struct OutputFrame {
    /// Delay of the sensor's own filters, s.
    delay: f64,
    world: World,
    /// True north to the axes of the filter, whose north is magnetic; `None` = the same.
    north: Option<Quaternion<Nav, Nav>>,
}

impl OutputFrame {
    /// Converts from the convention everything is computed in (ENU or start, FLU) to the one asked for: world and
    /// body change together.
    fn apply(&self, out: &mut [AttitudeSample]) {
        let to = self
            .world
            .convention()
            .filter(|to| *to != Convention::EnuFlu);
        for sample in out {
            // What a sensor measured late has happened at the stamp already.
            if self.delay != 0.0 {
                let turn = sample.rate.held_for(self.delay).about_fixed_axis();
                sample.q_nb = sample.q_nb.advanced(&turn).normalised();
            }
            if let Some(north) = &self.north {
                sample.q_nb = (*north * sample.q_nb).normalised();
            }
            if let Some(to) = to {
                *sample = relabelled(sample, Convention::EnuFlu, to);
            }
        }
    }

    /// An attitude that was asked for, as it was computed.
    fn undone(&self, given: &AttitudeSample) -> AttitudeSample {
        let mut sample = *given;
        if let Some(from) = self.world.convention() {
            sample = relabelled(&sample, from, Convention::EnuFlu);
        }
        if let Some(north) = &self.north {
            sample.q_nb = (north.inverse() * sample.q_nb).normalised();
        }
        if self.delay != 0.0 {
            let back = sample.rate.held_for(-self.delay).about_fixed_axis();
            sample.q_nb = sample.q_nb.advanced(&back).normalised();
        }
        sample
    }
}

fn conditioning(
    plan: &EstimationSettings,
    resolved: &Meaning,
    prepared: &Prepared,
) -> condition::Settings {
    let settings = resolved.conditioning(plan, prepared.clock, prepared.bias);
    let scale = prepared.aiding.map_or(1.0, |aiding| aiding.force_scale);
    condition::Settings {
        accel_scale: settings.accel_scale * scale,
        truncation_step: prepared.truncation_step,
        has_arrival: prepared.has_arrival,
        batches: prepared.batches,
        coarse: prepared.coarse,
        gyro_range: prepared.gyro_range,
        ..settings
    }
}

/// True north in axes whose north is magnetic: what a magnetic attitude is turned by, from the left.
fn turned_north(declination: f64) -> Quaternion<Nav, Nav> {
    Quaternion::from_rotation_vector(&RotationVector(Vector3::z() * -declination))
}

/// The same attitude between other axes: world and body change together.
fn relabelled(sample: &AttitudeSample, from: Convention, to: Convention) -> AttitudeSample {
    AttitudeSample {
        q_nb: from.convert(to, sample.q_nb),
        rate: BodyRate(from.convert_body(to, sample.rate.0)),
        covariance: sample.covariance.relabelled(|v| from.convert_body(to, v)),
        accel: sample
            .accel
            .map(|a| In::assume(from.convert_body(to, *a.as_vector()))),
        ..*sample
    }
}
