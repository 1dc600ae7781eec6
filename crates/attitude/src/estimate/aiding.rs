//! `--aid` and the first specific forces -> what corrects the attitude, or why nothing can. Pure.
//!
//! Apart from the rest of the preparation because a force says nothing of its own unit, and one that is no
//! specific force (phones export acceleration without gravity) would level to anything.

use super::meaning::{Meaning, STANDARD_GRAVITY};
use super::noise_presets::{NOISE_PRESETS, UNCALIBRATED};
use super::plan::{Aid, EstimationSettings, Initial, Noise};
use crate::aid::{self, Settings, Start};
use crate::diagnostic::Diagnostic;
use crate::digits::significant;
use crate::frames::{Body, In, Nav};
use crate::quaternion::Quaternion;
use crate::record::{Nanos, RawSample};
use crate::setting::{ACCEL_TOPIC, AID, FIELD, SMOOTH};
use nalgebra::Vector3;

/// Lengths of a force in g and in m/s^2.
const IN_G: std::ops::Range<f64> = 0.4..4.0;
const IN_SI: std::ops::RangeInclusive<f64> = 4.0..=40.0;
/// Largest deviation of the first second's mean from gravity, as a share.
const FAR: f64 = 0.15;
/// A mean shorter than this share of gravity is that of accelerations without it.
const WITHOUT_GRAVITY: f64 = 0.5;
/// Sigma of an initial attitude that was given, or found at rest, rad.
const TILT_GIVEN: f64 = 0.3;
const TILT_AT_REST: f64 = 0.05;
/// Time over which the mean force that levels is taken, and the least that tells one, s.
const LEVELLED_SECS: f64 = 0.5;
const LEAST_SECS: f64 = 0.2;
/// Sigma of a heading that was given while a field tells it too, rad.
const HEADING_GIVEN: f64 = 0.5;

/// Sensitivity of a bias to gravity, per 1 g along an axis, as a share of the turn-on bias: 0.1 deg/s
/// of 1 (BMI088), 0.009 of 0.14 (ADIS16465), 1 deg/h of 10 (STIM300), by their data sheets.
const BY_TILT: f64 = 0.1;

/// Why gravity cannot be used.
enum Unaided {
    /// Lack of a specific force.
    NoForce,
    /// Vector that is something else: in words.
    Implausible(String),
}

/// Origin of specific forces.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Forces {
    /// Samples of the gyro.
    WithRates,
    /// Messages of their own.
    Beside,
    /// Undecided: none has come, and the first decides.
    Unseen,
}

/// Aiding: what corrects the attitude.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Aiding {
    /// Settings of the filter.
    pub settings: Settings,
    /// Knowledge of the initial attitude.
    pub start: Start,
    /// Multiplies the recorded force, beside what its format states.
    pub force_scale: f64,
    /// Origin of the forces.
    pub forces: Forces,
}

impl Aiding {
    /// Name in `--aid`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        if self.settings.has_field {
            "gravity+mag"
        } else {
            "gravity"
        }
    }

    /// Aiding that `plan` asks for, with the first samples of the stream: all there are within a second or so; of a
    /// live stream the first alone, whose mean says nothing yet. What is to be said is added to `warnings`.
    ///
    /// # Errors
    /// In words: no specific force, or none that can be. With [`Aid::Auto`] that is a warning.
    pub fn decide(
        plan: &EstimationSettings,
        resolved: &Meaning,
        first: &[RawSample],
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Option<Aiding>, Diagnostic> {
        let asked = match plan.aid {
            Aid::None => return Ok(None),
            Aid::Auto if plan.smooth => format!("{SMOOTH}"),
            Aid::Auto => format!("{AID} auto"),
            Aid::Gravity => format!("{AID} gravity"),
            Aid::GravityAndField => format!("{AID} gravity+mag"),
        };
        // Who asks for a smoother asks for forces.
        let may_do_without = plan.aid == Aid::Auto && !plan.smooth;
        let without = if plan.smooth {
            format!("or leave {SMOOTH} out")
        } else {
            format!("{AID} none does without")
        };
        let found = Aiding::by_force(plan, resolved, first, warnings);
        match found {
            Ok(found) => Ok(Some(found)),
            Err(Unaided::NoForce) if may_do_without => Ok(None),
            Err(Unaided::NoForce) if first.len() <= 1 => {
                warnings.push(format!("{asked}: the first sample carries no specific force: the attitude is the gyro's until one comes").into());
                let unscaled = Aiding::with_scale((plan, resolved), 1.0);
                Ok(Some(Aiding {
                    forces: Forces::Unseen,
                    ..unscaled
                }))
            }
            Err(Unaided::NoForce) => Err(Diagnostic::new(format!(
                "{asked}: none of the first {} samples carries a specific force",
                first.len()
            ))
            .help(format!(
                "{FIELD} accel=PATH or {ACCEL_TOPIC} NAME says where it is, {without}"
            ))),
            Err(Unaided::Implausible(why)) if may_do_without => {
                let what = format!("{why}: the attitude is the gyro's alone");
                warnings.push(Diagnostic::new(what).coded("force-implausible"));
                Ok(None)
            }
            Err(Unaided::Implausible(why)) => Err(Diagnostic::new(format!("{asked}: {why}")).help(
                format!("{FIELD} accel=PATH or {ACCEL_TOPIC} NAME names another, {without}"),
            )),
        }
    }

    /// The same levelled by the mean force of the first half second instead of that of one sample, where it begins
    /// level and these samples, and forces of their own, are known before the first attitude is wanted.
    pub(super) fn levelled_by_mean(
        mut self,
        resolved: &Meaning,
        first: &[RawSample],
        beside: &[RawSample],
    ) -> Aiding {
        let stamps = first.first().map(stamp_of);
        let beside = beside.iter().filter(|raw| Some(stamp_of(raw)) >= stamps);
        let (beside, scale) = match self.forces {
            Forces::Beside => {
                let beside: Vec<RawSample> = beside.copied().collect();
                let length = beside.first().and_then(|raw| raw.accel);
                let length = length.map(|force| resolved.force(force).as_vector().norm());
                let scale = length.map_or(1.0, |length| force_scale(resolved, length));
                (beside, scale)
            }
            _ => (Vec::new(), self.force_scale),
        };
        let mut all: Vec<RawSample> = first.iter().copied().chain(beside).collect();
        all.sort_by_key(stamp_of);
        let calibrated = |force| *resolved.calibrated_force(force, scale).as_vector();
        if self.start == Start::Level
            && let Some((sum, secs)) = force_at_first(resolved, &all, LEVELLED_SECS, calibrated)
        {
            let mean = sum / secs;
            // One that is no gravity levels no better than one sample.
            if (0.5..1.5).contains(&(mean.norm() / STANDARD_GRAVITY)) {
                self.start = Start::LevelBy(In::assume(mean));
            }
        }
        self
    }

    fn by_force(
        plan: &EstimationSettings,
        resolved: &Meaning,
        first: &[RawSample],
        warnings: &mut Vec<Diagnostic>,
    ) -> Result<Aiding, Unaided> {
        if plan.has_forces_beside {
            // Its unit shows in its first, its plausibility in the filter.
            let unscaled = Aiding::with_scale((plan, resolved), 1.0);
            return Ok(Aiding {
                forces: Forces::Beside,
                ..unscaled
            });
        }
        let forces = first.iter().filter_map(|raw| raw.accel);
        let is_number = |v: &f64| v.is_finite();
        let lengths = forces
            .filter(|f| f.iter().all(is_number))
            .map(|f| resolved.force(f).as_vector().norm())
            .filter(|length| *length > 0.0);
        let (mut lengths, endless): (Vec<f64>, Vec<f64>) = lengths.partition(is_number);
        if lengths.is_empty() && !endless.is_empty() {
            return Err(Unaided::Implausible(
                "the specific force is beyond all numbers: no accelerometer measures that (force_implausible)".to_owned(),
            ));
        }
        let length = *lengths.first().ok_or(Unaided::NoForce)?;
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        let middle = lengths.len() / 2;
        let median = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let scale = force_scale(resolved, length);
        if scale != 1.0 {
            let what = format!(
                "the first specific force has length {length:.3}: taken to be in g, not in m/s^2"
            );
            warnings.push(Diagnostic::new(what).coded("accel-unit"));
        }
        let is_plausible = if first.len() > 1 {
            // Who stands first and then runs has gravity in the middle one.
            let is_near = |length: f64| (length * scale / STANDARD_GRAVITY - 1.0).abs() <= FAR;
            is_near(mean)
                || is_near(median)
                || not_turning(resolved, first).is_some_and(|(mean, secs)| {
                    aid::is_gravity(mean * scale, secs, STANDARD_GRAVITY)
                })
        } else {
            IN_SI.contains(&(length * scale))
        };
        if !is_plausible {
            return Err(Unaided::Implausible(format!(
                "the specific force has a mean length of {:.3} m/s^2 in the first {} samples, and gravity {STANDARD_GRAVITY}: {} (force_implausible)",
                mean * scale,
                first.len(),
                no_gravity(mean * scale),
            )));
        }
        Ok(Aiding::with_scale((plan, resolved), scale))
    }

    /// The same for a sensor of the class of `plan`.
    fn of_class(self, plan: &EstimationSettings, resolved: &Meaning) -> Aiding {
        let mut settings = Aiding::with_scale((plan, resolved), self.force_scale).settings;
        if plan.bias.left().is_some() {
            settings.bias_prior = self.settings.bias_prior;
        }
        Aiding { settings, ..self }
    }

    /// The same for a sensor that nobody calibrated.
    pub(super) fn uncalibrated(self, plan: &EstimationSettings, resolved: &Meaning) -> Aiding {
        let plan = EstimationSettings {
            noise: Noise::preset(UNCALIBRATED),
            ..plan.clone()
        };
        self.of_class(&plan, resolved)
    }

    fn with_scale((plan, resolved): (&EstimationSettings, &Meaning), force_scale: f64) -> Aiding {
        let mut settings = Settings {
            has_field: plan.aid == Aid::GravityAndField,
            hard_iron: plan.mag_hard_iron,
            ..Settings::default()
        };
        // The filter's own numbers are those of the class that is the default; who names another knows better.
        if plan.noise.taken() != Noise::preset(&NOISE_PRESETS[0]) {
            of_class(&mut settings, &plan.noise);
        }
        if let Some(left) = plan.bias.left() {
            settings.bias_prior = settings.bias_prior.min(left);
        }
        settings.prior = resolved.prior(&settings, plan.bias.left().is_none());
        Aiding {
            settings,
            start: start(plan.initial, settings.has_field),
            force_scale,
            forces: Forces::WithRates,
        }
    }
}

/// Text of what a mean specific force of this length is, m/s^2, that is not gravity.
fn no_gravity(length: f64) -> String {
    let share = length / STANDARD_GRAVITY;
    if share < WITHOUT_GRAVITY {
        return "acceleration without gravity cannot level".to_owned();
    }
    let why = if (length * 1e-3 - 1.0).abs() <= FAR {
        "it looks like mg"
    } else if share > IN_SI.end() / STANDARD_GRAVITY {
        "its unit or scale is wrong"
    } else {
        "its unit or scale is wrong, or the body accelerates all the time"
    };
    format!("{} times as long as that, so {why}", significant(share, 3))
}

impl Aiding {
    /// One standard deviation of what is left of a bias that was said, measured at rest or calibrated, rad/s, body
    /// axes.
    pub(super) fn stated_bias(&self, is_removed: bool) -> [Option<f64>; 3] {
        let left = is_removed.then_some(self.settings.bias_prior);
        match self.settings.prior.bias {
            Some(known) => known
                .diagonal()
                .map(|variance| Some(variance.sqrt()))
                .into(),
            None => [left; 3],
        }
    }
}

/// Puts in what a class of sensors says, and leaves what it says nothing of.
fn of_class(settings: &mut Settings, class: &Noise) {
    let largest = |axes: [f64; 3]| axes.into_iter().fold(0.0, f64::max);
    for (number, known) in [
        (&mut settings.bias_prior, largest(class.unremoved_bias())),
        (&mut settings.scale_prior, class.scale),
        (&mut settings.cross_prior, class.misalignment),
        (
            &mut settings.force_bias_prior,
            class.tilt * STANDARD_GRAVITY,
        ),
        (&mut settings.gyro_noise, largest(class.arw)),
        (&mut settings.case, class.misalignment),
        (&mut settings.delay, class.delay),
    ] {
        if known > 0.0 {
            *number = known;
        }
    }
    // What changes on the way is smaller where the constant is. It is not larger: the filter's own was chosen where
    // accelerations say more that is wrong than a chip wanders.
    let default = Settings::default();
    let share = |of: f64, whole: f64| if of > 0.0 { (of / whole).min(1.0) } else { 1.0 };
    settings.bias_walk *= share(settings.bias_prior, default.bias_prior);
    settings.rate_noise *= share(class.scale, default.scale_prior);
    settings.force_bias_walk *= share(settings.force_bias_prior, default.force_bias_prior);
    let by_tilt = BY_TILT * largest(class.turn_on_bias);
    if by_tilt > 0.0 {
        settings.bias_by_tilt = settings.bias_by_tilt.min(by_tilt);
    }
}

/// Knowledge of an initial attitude.
pub(super) fn start(initial: Initial, has_field: bool) -> Start {
    // By a field the heading is that of north, and what was given may be another.
    let heading = if has_field { HEADING_GIVEN } else { 0.0 };
    let known = |tilt| Start::Known { tilt, heading };
    match initial {
        Initial::Identity => Start::Level,
        Initial::Gravity if has_field => Start::Level,
        Initial::Gravity => known(TILT_AT_REST),
        Initial::Given(_) | Initial::FirstOrientation => known(TILT_GIVEN),
    }
}

/// Multiplies a specific force into m/s^2 whose first has this length: of one in g it shows, where the format
/// does not state its unit.
pub(super) fn force_scale(resolved: &Meaning, length: f64) -> f64 {
    if resolved.accel_unit_stated.is_none() && IN_G.contains(&length) {
        STANDARD_GRAVITY
    } else {
        1.0
    }
}

/// Length of the mean specific force in a frame that does not turn, and over how many seconds.
fn not_turning(resolved: &Meaning, first: &[RawSample]) -> Option<(f64, f64)> {
    let recorded = |force| *resolved.force(force).as_vector();
    let (sum, secs) = force_at_first(resolved, first, f64::INFINITY, recorded)?;
    Some((sum.norm() / secs, secs))
}

fn stamp_of(raw: &RawSample) -> Nanos {
    raw.header.unwrap_or(raw.log)
}

/// Integral of the specific force over at most `longest` seconds in the body axes of the first sample, and over how
/// many seconds: gravity and what the velocity changed by, however the body shakes and turns. By sums, which over a
/// second is good enough. `samples` in time; `force` makes one of a recorded one.
fn force_at_first(
    resolved: &Meaning,
    samples: &[RawSample],
    longest: f64,
    force: impl Fn([f64; 3]) -> Vector3<f64>,
) -> Option<(Vector3<f64>, f64)> {
    let is_finite = |v: &Vector3<f64>| v.iter().all(|v| v.is_finite());
    let mut attitude: Quaternion<Nav, Body> = Quaternion::identity();
    let (mut sum, mut secs) = (Vector3::zeros(), 0.0);
    let (mut last_rate, mut last_force): (Option<Nanos>, Option<Nanos>) = (None, None);
    for raw in samples {
        let stamp = stamp_of(raw);
        let step = |last: &mut Option<Nanos>| {
            let step = last.map_or(0.0, |last| stamp.secs_since(last));
            *last = Some(stamp);
            (0.0..1.0).contains(&step).then_some(step)
        };
        if let Some(gyro) = raw.gyro {
            let turn = resolved.turned(gyro, step(&mut last_rate)?);
            if is_finite(&turn.0) {
                attitude = attitude.advanced(&turn.about_fixed_axis());
            }
        }
        if let Some(force) = raw.accel.map(&force) {
            let step = step(&mut last_force)?;
            if secs + step > longest {
                break;
            }
            if is_finite(&force) {
                sum += attitude.to_dcm().as_matrix() * force * step;
                secs += step;
            }
        }
    }
    (secs > LEAST_SECS).then_some((sum, secs))
}

#[cfg(test)]
mod tests;
