//! The first samples (or a pass over the log) -> clock, bias, initial attitude. Pure.
//!
//! Apart from the estimator because it is all about what is not known yet: when enough has been
//! seen, and what to say when it cannot be known.

mod at_once;
mod bias;
mod initial;
mod kind;
mod rates;
mod stamps;

pub use self::at_once::at_once;
use self::bias::{decide_bias, looks_for_bias, with_bias_of_rest};
use self::initial::Earth;
pub(in crate::estimate) use self::initial::decide_initial;
use self::kind::decide_kind;
use self::rates::{clipped_at, decide_truncation, looks_for_truncation};
use self::stamps::{decide_clock, decide_stamps};
use super::aiding::Aiding;
use super::class_pass::{self, ClassPass};
use super::clock_pass::ClockPass;
use super::first_pass::{FEW, MANY, RestPass};
use super::meaning::Meaning;
use super::noise_presets::UNCALIBRATED;
use super::orientation_lag::LagPass;
use super::plan::{Aid, Bias, EstimationSettings, Initial, Noise, Truncation};
use super::sample_kind::KindChoice;
use super::stamps::{StampPass, Stamps};
use crate::condition::rails::Rails;
use crate::condition::stillness::Rests;
use crate::condition::{BatchRate, Clock, CoarseClock};
use crate::diagnostic::Diagnostic;
use crate::frames::{Body, In, Nav};
use crate::propagate::Method;
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::{Nanos, RawSample, SampleKind};
use crate::setting::BIAS;
use crate::worlds::World;
use nalgebra::Vector3;

/// Seconds of data in which rest is sought when the log cannot be read twice.
const REST_SECS: f64 = 60.0;

/// Decisions made before the first sample was integrated.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The clock.
    pub clock: Clock,
    /// Noise of the sensor: of the class that was stated, or that its data tell.
    pub noise: Noise,
    /// Bias removed.
    pub bias: BodyRate,
    /// Sigma of the bias, rad/s.
    pub bias_sigma: Vector3<f64>,
    /// Origin of the bias.
    pub bias_origin: String,
    /// One standard deviation of what is left of a bias that was given or found at rest, rad/s; `None` where the
    /// bias is neither.
    pub bias_left: Option<f64>,
    /// q_nb at the first sample, ENU (or start) and FLU.
    pub initial: Quaternion<Nav, Body>,
    /// Origin of the initial attitude.
    pub initial_origin: String,
    /// Sigma of the vertical by the rest at the start, of `--init gravity`, rad.
    pub tilt_sigma: f64,
    /// w_ie in ENU, rad/s; zero where the Earth is not taken out.
    pub world_rate: In<Nav>,
    /// The world of the output.
    pub world: World,
    /// Kind of the samples, and why.
    pub sample_kind: KindChoice,
    /// Treatment of the stamps.
    pub stamps: Stamps,
    /// Whether log times tell when samples arrived: those of a recording do, those of a daemon are another in every run.
    pub has_arrival: bool,
    /// Whether the sensor may as well be one that nobody calibrated: nobody said it, and no data did.
    pub is_class_open: bool,
    /// Aiding, if something corrects the attitude.
    pub aiding: Option<Aiding>,
    /// Step in which the driver cut the rates, rad/s, where that is undone.
    pub truncation_step: Option<f64>,
    /// The rate of samples that were stamped when their batch came.
    pub batches: Option<BatchRate>,
    /// The clock, where it is coarser than the sensor.
    pub coarse: Option<CoarseClock>,
    /// Full scale of the gyro, rad/s, that was stated or that its samples were clipped at.
    pub gyro_range: Option<f64>,
    /// Whether the first samples carry a temperature.
    pub has_temperature: bool,
    /// Things to know.
    pub warnings: Vec<Diagnostic>,
}

/// Time for which rest is sought.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Patience {
    /// Whole log: it can be read twice.
    WholeLog,
    /// First minute: what comes cannot be read again, and waits meanwhile.
    FirstMinute,
}

/// Takes the first samples (or all of them, when rest is sought), then decides.
#[derive(Debug)]
pub struct Preparation {
    plan: EstimationSettings,
    resolved: Meaning,
    patience: Patience,
    first: Vec<RawSample>,
    taken: usize,
    last: Option<RawSample>,
    rest: Option<RestPass>,
    stamps: Option<StampPass>,
    /// Rates (rad/s, sensor axes), where it is to be seen whether they were cut.
    rates: Option<Vec<[f64; 3]>>,
    /// Readings at the end of the range, where nobody states it.
    rails: Option<Rails>,
    /// The first specific forces that came in messages of their own.
    beside: Vec<RawSample>,
    /// Stamps that may be those of batches.
    clocks: Option<ClockPass>,
    /// Samples by which the class of the sensor is found.
    class: Option<ClassPass>,
    /// Whether there are any such forces; before the first sample.
    forces_beside: [bool; 2],
    /// Rates and orientations of a file that states no kind.
    lag: Option<LagPass>,
}

impl Preparation {
    /// Makes one for samples understood as `resolved`.
    #[must_use]
    pub fn new(plan: &EstimationSettings, resolved: &Meaning, patience: Patience) -> Preparation {
        Preparation {
            plan: plan.clone(),
            resolved: resolved.clone(),
            patience,
            first: Vec::new(),
            taken: 0,
            last: None,
            rest: (needs_rest(plan) || looks_for_bias(plan, resolved, patience))
                .then(|| RestPass::new(plan, resolved)),
            stamps: None,
            rates: (looks_for_truncation(plan)
                && patience == Patience::WholeLog
                && !matches!(resolved.kind, SampleKind::DeltaAngle | SampleKind::Rotation))
            .then(Vec::new),
            rails: (plan.gyro_range.is_none()
                && patience == Patience::WholeLog
                && !is_causal(plan)
                && matches!(resolved.kind, SampleKind::Rate | SampleKind::Average))
            .then(Rails::new),
            beside: Vec::new(),
            clocks: ClockPass::of(plan).map(|pass| match patience {
                Patience::WholeLog => pass,
                Patience::FirstMinute => pass.of_stream(),
            }),
            class: ClassPass::of(plan).filter(|_| patience == Patience::WholeLog),
            forces_beside: [false; 2],
            lag: LagPass::of(resolved)
                .filter(|_| patience == Patience::WholeLog && !is_causal(plan)),
        }
    }

    /// The same with a look at the stamps, as in [`StampPass::new`].
    #[must_use]
    pub fn with_stamps(self, stamps: Option<StampPass>) -> Preparation {
        Preparation { stamps, ..self }
    }

    /// Takes the next sample.
    ///
    /// # Errors
    /// In words, when the settings do not fit.
    pub fn take(&mut self, raw: &RawSample) -> Result<(), Diagnostic> {
        if raw.is_beside {
            self.take_beside(raw);
            return Ok(());
        }
        if self.first.len() < FEW {
            self.first.push(*raw);
        }
        self.taken += 1;
        self.last = Some(*raw);
        // Of a stream, the beginning: enough to see that there is no constant rate.
        if let Some(pass) = &mut self.stamps
            && (self.patience == Patience::WholeLog || self.taken <= FEW)
        {
            pass.push(raw)?;
        }
        if let (Some(rates), Some(gyro)) = (&mut self.rates, raw.gyro)
            && rates.len() < MANY
        {
            rates.push(self.resolved.rates(gyro));
        }
        if let (Some(rails), Some(gyro)) = (&mut self.rails, raw.gyro) {
            rails.push(&self.resolved.rates(gyro));
        }
        if let Some(class) = &mut self.class {
            class.take(raw);
        }
        if let Some(lag) = &mut self.lag {
            lag.take(raw, &self.resolved, self.plan.clock);
        }
        if let Some(clocks) = &mut self.clocks {
            clocks.take(raw);
        }
        match &mut self.rest {
            // What nobody asked for is not worth a pass over hours.
            Some(rest) if self.taken <= MANY || needs_rest(&self.plan) => {
                rest.push(std::slice::from_ref(raw))
            }
            _ => Ok(()),
        }
    }

    /// Takes a message of its own that carries a specific force; what carries none is passed over.
    pub fn take_beside(&mut self, raw: &RawSample) {
        if raw.accel.is_none() {
            return;
        }
        self.forces_beside[0] = true;
        self.forces_beside[1] |= self.taken == 0;
        if self.beside.len() < FEW {
            self.beside.push(*raw);
        }
    }

    /// Whether more samples would tell more.
    #[must_use]
    pub fn wants_more(&self) -> bool {
        if self.first.len() < FEW {
            return true;
        }
        let (Some(first), Some(last)) = (self.first.first(), &self.last) else {
            return true;
        };
        let secs =
            |a: Option<Nanos>, b: Option<Nanos>| a.zip(b).map_or(0.0, |(a, b)| b.secs_since(a));
        match self.patience {
            Patience::WholeLog => {
                let wants_rates = self.rates.as_ref().is_some_and(|rates| rates.len() < MANY);
                let wants_rest = needs_rest(&self.plan) || self.taken < MANY;
                let wants_clocks = self.clocks.as_ref().is_some_and(ClockPass::wants_more);
                let wants_class = self.class.as_ref().is_some_and(ClassPass::wants_more);
                let wants_lag = self.lag.as_ref().is_some_and(LagPass::wants_more);
                (self.rest.is_some() && wants_rest)
                    || self.stamps.is_some()
                    || wants_rates
                    || wants_clocks
                    || wants_class
                    || wants_lag
            }
            Patience::FirstMinute => {
                if self.clocks.as_ref().is_some_and(ClockPass::wants_more) {
                    return true;
                }
                self.rest.is_some()
                    && self.taken < MANY
                    && secs(first.header, last.header) < REST_SECS
                    && last.log.secs_since(first.log) < REST_SECS
            }
        }
    }

    /// Decides from what was taken.
    ///
    /// # Errors
    /// In words: no usable stamps, no rest, no orientation, and the flag that helps.
    pub fn decide(self) -> Result<Prepared, Diagnostic> {
        let Preparation {
            plan,
            resolved,
            patience,
            first,
            rest,
            stamps,
            rates,
            rails,
            beside,
            forces_beside,
            clocks,
            class,
            lag,
            ..
        } = self;
        let mut warnings = Vec::new();
        let sample_kind = decide_kind((&plan, &resolved), &first, lag, &mut warnings);
        let resolved = resolved.with_kind(&sample_kind);
        let clocks = decide_clock((&plan, &resolved), &first, clocks, &mut warnings)?;
        let clock = clocks.clock;
        let rests = rest.map_or_else(|| Ok(Rests::default()), RestPass::finish)?;
        // The method of a daemon decides as a daemon: by the first sample.
        let (looked_at, is_beside) = match plan.method {
            method if is_live(method) && plan.aid == Aid::Auto => {
                (first.get(..1).unwrap_or(&first), forces_beside[1])
            }
            _ => (first.as_slice(), forces_beside[0]),
        };
        let plan = EstimationSettings {
            has_forces_beside: plan.has_forces_beside
                || (is_beside && looked_at.iter().all(|raw| raw.accel.is_none())),
            ..plan
        };
        let plan = EstimationSettings {
            gyro_range: plan.gyro_range.or_else(|| clipped_at(rails, &mut warnings)),
            ..plan
        };
        let is_bias_unsaid = plan.bias == Bias::Unsaid;
        let (mut plan, told, turn) = match looks_for_bias(&plan, &resolved, patience) {
            true => with_bias_of_rest(plan, &rests),
            false => (plan, rests.clone(), None),
        };
        let mut aiding = Aiding::decide(&plan, &resolved, looked_at, &mut warnings)?;
        if aiding.is_some() {
            warnings.extend(turn);
        } else if is_bias_unsaid {
            // The gyro alone is as it was recorded.
            plan.bias = Bias::None;
        }
        // A run that begins later, and a method that waits for nothing, has the first sample alone.
        let is_read_ahead = !is_live(plan.method);
        aiding = aiding.map(|mut aiding| {
            aiding.settings.rest_by_direction = is_read_ahead && patience == Patience::WholeLog;
            if is_read_ahead && plan.start.is_none() {
                aiding.levelled_by_mean(&resolved, &first, &beside)
            } else {
                aiding
            }
        });
        let (initial, initial_origin, world) = decide_initial(
            (&plan, aiding.as_ref()),
            &resolved,
            &first,
            &rests,
            &mut warnings,
        )?;
        let earth = plan.latitude_deg.map(|deg| Earth::at(deg.to_radians()));
        let (bias, bias_sigma, mut bias_origin) = decide_bias(
            (&plan, &resolved),
            &told,
            earth.map(|e| e.felt_by(&initial)),
        )?;
        let mut bias_left = plan.bias.left();
        if let (Some(left), Bias::Auto) = (&mut bias_left, plan.bias) {
            // Rests that differ tell it no better than that.
            *left = left.hypot(bias_sigma.max());
            if told.can_be_a_turn() {
                bias_origin += " (or a steady turn about the vertical: nothing here can tell)";
            }
            if is_bias_unsaid {
                bias_origin += &format!(", by default ({BIAS} none: left in)");
            }
            if let Some(aiding) = &mut aiding {
                let prior = &mut aiding.settings.bias_prior;
                *prior = prior.hypot(bias_sigma.max());
            }
        }
        let stamps = decide_stamps(stamps, patience, &mut warnings)?;
        warnings.extend(earth.and_then(|e| e.heading_warning(plan.initial)));
        // What was gathered for an attitude that is aided is of no use to another.
        let is_wanted = aiding.is_some() || plan.truncation != Truncation::Unsaid;
        let rates = rates.as_deref().filter(|_| is_wanted);
        let truncation_step = decide_truncation(&plan, rates, &mut warnings)?;
        let mut prepared = Prepared {
            sample_kind,
            noise: plan.noise.taken(),
            aiding,
            truncation_step,
            gyro_range: plan.gyro_range,
            clock,
            bias,
            bias_sigma,
            bias_origin,
            bias_left,
            initial,
            initial_origin,
            tilt_sigma: rests.kept.first().map_or(0.0, |rest| rest.tilt_sigma),
            world_rate: earth.map_or_else(|| In::assume(Vector3::zeros()), |e| e.w_ie),
            world,
            stamps,
            has_arrival: true,
            is_class_open: class_pass::is_open(&plan),
            has_temperature: first.iter().any(|raw| raw.temperature.is_some()),
            batches: clocks.batches,
            coarse: clocks.coarse,
            warnings,
        };
        let told = class.zip(prepared.aiding).and_then(|(class, aiding)| {
            class.told(&class_pass::Run {
                plan: &plan,
                resolved: &resolved,
                clock,
                coarse: clocks.coarse,
                bias,
                initial,
                world_rate: prepared.world_rate,
                truncation_step,
                aiding,
            })
        });
        if let Some((aiding, why)) = told {
            prepared.noise = Noise::preset(UNCALIBRATED);
            prepared.aiding = Some(aiding);
            prepared.warnings.push(why);
            prepared.is_class_open = false;
        }
        Ok(prepared)
    }
}

/// Settings with what only rest tells, as the beginning of what a filter learns: level by the first specific force,
/// no bias.
pub(super) fn learned_on_the_way(plan: &EstimationSettings) -> EstimationSettings {
    EstimationSettings {
        initial: match plan.initial {
            Initial::Gravity => Initial::Identity,
            other => other,
        },
        bias: match plan.bias {
            Bias::Auto => Bias::None,
            other => other,
        },
        ..plan.clone()
    }
}

/// Whether the plan asks for something only rest can tell.
fn needs_rest(plan: &EstimationSettings) -> bool {
    plan.bias == Bias::Auto || plan.initial == Initial::Gravity
}

/// Whether attitudes are those of a daemon: nothing is decided by later samples.
pub(super) fn is_causal(plan: &EstimationSettings) -> bool {
    is_live(plan.method) && !plan.smooth
}

/// Whether the method waits for nothing, as a daemon.
fn is_live(method: Method) -> bool {
    matches!(
        method,
        Method::Live { .. } | Method::CommitProvisional { .. }
    )
}
