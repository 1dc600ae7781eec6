//! Settings and what was prepared -> an estimator before its first sample. Pure.
//!
//! Apart from what samples go through because it is decided here once: kind of stream, noise, propagator, filter or
//! smoother.

use super::super::aiding::Forces;
use super::super::integrator::Integrator;
use super::super::meaning::Meaning;
use super::super::noise_presets::UNCALIBRATED;
use super::super::open_kind::OpenKind;
use super::super::output_frame::OutputFrame;
use super::super::plan::{EstimationSettings, Initial, Noise};
use super::super::preparation::{Prepared, is_causal};
use super::super::retaking::Retaking;
use super::super::sample_kind::{KindChoice, KindReason};
use super::super::settings_fingerprint::settings_fingerprint;
use super::super::smoothing::{Smoothing, SmoothingInputs};
use super::super::smoothing_priors::looseness;
use super::super::temperatures::Temperatures;
use super::{AuxiliaryInputs, Estimator};
use crate::aid::{self, AidedPropagator, OtherClass};
use crate::condition::{self, Conditioner};
use crate::diagnostic::Diagnostic;
use crate::propagate::{self, Method, Propagator};
use crate::smooth::PriorSigmas;

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
        let resolved = &match resolved.is_kind_open() {
            true => resolved.with_kind(&prepared.sample_kind),
            false => resolved.clone(),
        };
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
        let is_open = is_causal(plan)
            && matches!(
                resolved.kind_reason,
                KindReason::Unknown | KindReason::Step(_)
            );
        if !is_open {
            return Estimator::live_of_kind(plan, resolved, prepared);
        }
        // Undecided until there is a step, whoever has looked ahead.
        let resolved = resolved.with_kind(&KindChoice::OPEN);
        let prepared = Prepared {
            sample_kind: KindChoice::OPEN,
            ..prepared.clone()
        };
        let mut estimator = Estimator::live_of_kind(plan, &resolved, &prepared)?;
        estimator.open = Some(Box::new(OpenKind::new(plan, &resolved, &prepared)));
        Ok(estimator)
    }

    pub(in crate::estimate) fn live_of_kind(
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
                    let wide = prepared.is_class_open.then(|| {
                        let wide = aiding.uncalibrated(plan, resolved).settings;
                        let noise = Noise::preset(UNCALIBRATED);
                        (looseness(&wide, &noise), wide)
                    });
                    let aided = aided
                        .or_of(wide.map(|(_, wide)| OtherClass::of(&wide)))
                        .with_linear_acceleration(plan.linear_acceleration);
                    if plan.smooth {
                        let heading = match aiding.start {
                            aid::Start::Level | aid::Start::LevelBy(_) => None,
                            aid::Start::Known { .. } => Some(prepared.initial.yaw_pitch_roll().yaw),
                        };
                        let told = SmoothingInputs {
                            kind: resolved.kind,
                            heading,
                            looseness: looseness(&aiding.settings, &prepared.noise),
                            other: wide.map(|(looseness, _)| looseness),
                            is_class_found: plan.noise.is_by_data()
                                && prepared.noise != plan.noise.taken(),
                            bias_sigma: prepared.noise.bias_of_class(),
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
            conditioner: {
                let mut conditioner = Conditioner::new(settings).map_err(|e| e.to_string())?;
                conditioner.keep_revisions();
                conditioner
            },
            retaking: Retaking::default(),
            regulariser: prepared.stamps.regulariser(resolved.kind)?,
            integrator,
            asked: OutputFrame::of(plan, prepared),
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
            sample_kind: resolved.kind_choice(),
            open: None,
            before: Vec::new(),
            left_until: None,
            temperatures: Temperatures::default(),
        })
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
