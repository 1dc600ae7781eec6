//! The first samples of a file -> whether its sensor is one that nobody calibrated. Pure.
//!
//! Apart from the preparation because it is an estimate of its own: a filter with wide priors runs over the samples
//! first, and what it finds of scale, axes and accelerometer is weighed under both classes.

use super::aiding::Aiding;
use super::first_pass::MANY;
use super::meaning::{Meaning, STANDARD_GRAVITY};
use super::noise_presets::{NOISE_PRESETS, UNCALIBRATED};
use super::plan::{Aid, EstimationSettings};
use crate::aid::{AidedPropagator, Calibration, OtherClass, Settings};
use crate::condition::{self, Clock, CoarseClock, Conditioner};
use crate::diagnostic::Diagnostic;
use crate::digits::significant;
use crate::frames::{Body, In, Nav};
use crate::propagate::{self, Method, Order, Placement};
use crate::quaternion::{BodyRate, Quaternion};
use crate::record::{AttitudeSample, Nanos, RawSample, Status};
use crate::setting::NOISE;
use nalgebra::Vector3;

/// Logarithm of how many times likelier a sensor must be of that class to be taken for one. Calibrated ones had -1.6 to
/// -15 on the 14 recordings of BROAD, and 4.5 at most in simulations: on a circle, whose steady acceleration looks like
/// an accelerometer's bias.
const CLEAR: f64 = 5.0;
/// Integrates well enough to find a class, with a short window.
const METHOD: Method = Method::Magnus {
    window: 3,
    order: Order::M4,
    placement: Placement::Causal,
};
/// Sigmas of the length of a specific force at rest less standard gravity, m/s^2: of a calibrated accelerometer,
/// gravity's own differences over the Earth included, and what is added to it where nobody calibrated.
const CALIBRATED: f64 = 0.04;
const LOOSE: f64 = 0.2;

/// A sample, as far as it is kept.
#[derive(Clone, Copy, Debug)]
struct StoredSample {
    header: Option<Nanos>,
    log: Nanos,
    gyro: Option<[f64; 3]>,
    accel: Option<[f64; 3]>,
    interval: Option<i64>,
}

/// Decisions of the run, but for the class.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run<'a> {
    pub(super) plan: &'a EstimationSettings,
    pub(super) resolved: &'a Meaning,
    pub(super) clock: Clock,
    pub(super) coarse: Option<CoarseClock>,
    pub(super) bias: BodyRate,
    pub(super) initial: Quaternion<Nav, Body>,
    pub(super) world_rate: In<Nav>,
    pub(super) truncation_step: Option<f64>,
    pub(super) aiding: Aiding,
}

/// Whether neither the plan nor a calibration says of which class the sensor is, and something tells it.
pub(super) fn is_open(plan: &EstimationSettings) -> bool {
    plan.noise.is_by_data() && plan.calibration.is_none() && plan.aid != Aid::None
}

/// Samples kept until they can be weighed.
#[derive(Debug, Default)]
pub(super) struct ClassPass(Vec<StoredSample>);

/// Evidence that a sensor is one that nobody calibrated.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Evidence {
    /// Logarithm of how many times likelier it is.
    log: f64,
    found: Calibration,
    /// Length of the specific force at rest less gravity, m/s^2, where the body rested: the one farthest off.
    off_at_rest: Option<f64>,
}

impl ClassPass {
    /// Makes one where the class is to be found.
    pub(super) fn of(plan: &EstimationSettings) -> Option<ClassPass> {
        is_open(plan).then(ClassPass::default)
    }

    /// Takes the next sample.
    pub(super) fn take(&mut self, raw: &RawSample) {
        if self.wants_more() {
            self.0.push(StoredSample {
                header: raw.header,
                log: raw.log,
                gyro: raw.gyro,
                accel: raw.accel,
                interval: raw.interval_nanos,
            });
        }
    }

    /// Whether more samples would tell more.
    pub(super) fn wants_more(&self) -> bool {
        self.0.len() < MANY
    }

    /// Aiding with the priors of a sensor that nobody calibrated, and why it is taken for one, where
    /// that is clear.
    pub(super) fn told(self, run: &Run<'_>) -> Option<(Aiding, Diagnostic)> {
        let aiding = run.aiding.uncalibrated(run.plan, run.resolved);
        let evidence = self.weigh(run, &aiding)?;
        let is_clear = evidence.log > CLEAR && evidence.is_within(&aiding.settings);
        is_clear.then(|| (aiding, evidence.said()))
    }

    /// Weighs the samples by a filter of the wide class.
    fn weigh(self, run: &Run<'_>, wide: &Aiding) -> Option<Evidence> {
        let conditioning = run.resolved.conditioning(run.plan, run.clock, run.bias);
        let conditioning = condition::Settings {
            accel_scale: conditioning.accel_scale * wide.force_scale,
            truncation_step: run.truncation_step,
            coarse: run.coarse,
            ..conditioning
        };
        let propagation = propagate::Settings {
            method: METHOD,
            kind: run.resolved.kind,
            initial: run.initial,
            world_rate: run.world_rate,
            ..propagate::Settings::default()
        };
        let mut conditioner = Conditioner::new(&conditioning).ok()?;
        let settings = Settings {
            // Constants are looked for: what a class leaves unexplained must not pass for a bias that drifts.
            bias_drift: 0.0,
            force_carried: f64::INFINITY,
            has_field: false,
            hard_iron: 0.0,
            ..wide.settings
        };
        let mut aided = AidedPropagator::new(propagation, settings, wide.start).ok()?;
        let (mut rests, mut rates, mut attitudes) = (Rests::default(), Vec::new(), Vec::new());
        for kept in &self.0 {
            conditioner.push(std::slice::from_ref(&kept.raw()), &mut rates);
            aided.push(&rates, &mut attitudes);
            rates.clear();
            rests.take(&attitudes);
            attitudes.clear();
        }
        conditioner.finish(&mut rates);
        aided.push(&rates, &mut attitudes);
        aided.finish(&mut attitudes);
        rests.take(&attitudes);
        let filter = aided.filter();
        let off_at_rest = rests.farthest();
        let other = OtherClass::of(&run.aiding.settings);
        let by_motion = filter.likelier_than(&other).unwrap_or(0.0);
        Some(Evidence {
            log: by_motion + off_at_rest.map_or(0.0, by_length),
            found: *filter.calibration(),
            off_at_rest,
        })
    }
}

impl StoredSample {
    fn raw(&self) -> RawSample {
        RawSample {
            header: self.header,
            log: self.log,
            publish: self.log,
            gyro: self.gyro,
            accel: self.accel,
            interval_nanos: self.interval,
            ..RawSample::default()
        }
    }
}

impl Evidence {
    /// Whether what was found is what units of the class have, three sigmas: what is farther off is the motion's, or that
    /// of another fault, and no class explains it. The Husky's tilt was 2.05 instead of 0.68 deg rms with this class.
    fn is_within(&self, class: &Settings) -> bool {
        let Calibration {
            scale,
            cross,
            force_bias,
            ..
        } = &self.found;
        scale.amax() < 3.0 * class.scale_prior
            && cross.amax() < 3.0 * class.cross_prior
            && force_bias.amax() < 3.0 * class.force_bias_prior
    }

    fn said(&self) -> Diagnostic {
        let largest = |v: &Vector3<f64>, scale: f64| significant(v.amax() * scale, 2);
        let mut what = format!(
            "taken for a sensor that nobody calibrated (class {}): by these data that is e^{:.0} times likelier (scale {} %, axes {} deg, accelerometer {} m/s^2",
            UNCALIBRATED.name,
            self.log,
            largest(&self.found.scale, 100.0),
            largest(&self.found.cross, 1f64.to_degrees()),
            largest(&self.found.force_bias, 1.0),
        );
        if let Some(off) = self.off_at_rest {
            what += &format!(", {} m/s^2 off gravity at rest", significant(off, 2));
        }
        let class = NOISE.to(NOISE_PRESETS[0].name);
        Diagnostic::new(what + ")")
            .help(format!(
                "{class} keeps the priors of one that its maker calibrated"
            ))
            .coded("class-by-data")
    }
}

/// Evidence of the length of a specific force at rest.
fn by_length(off: f64) -> f64 {
    let narrow = CALIBRATED * CALIBRATED;
    let wide = narrow + LOOSE * LOOSE;
    0.5 * ((narrow / wide).ln() + off * off * (1.0 / narrow - 1.0 / wide))
}

/// Specific forces at rest.
#[derive(Default)]
struct Rests {
    sum: Vector3<f64>,
    count: f64,
    farthest: Option<f64>,
}

impl Rests {
    fn take(&mut self, attitudes: &[AttitudeSample]) {
        for attitude in attitudes {
            match attitude.accel.filter(|_| attitude.status.has(Status::REST)) {
                Some(force) => {
                    self.sum += force.as_vector();
                    self.count += 1.0;
                }
                None if !attitude.status.has(Status::REST) => self.end(),
                None => {}
            }
        }
    }

    /// Ends a rest.
    fn end(&mut self) {
        if self.count > 0.0 {
            let off = (self.sum / self.count).norm() - STANDARD_GRAVITY;
            if self.farthest.is_none_or(|other| off.abs() > other.abs()) {
                self.farthest = Some(off);
            }
        }
        (self.sum, self.count) = (Vector3::zeros(), 0.0);
    }

    fn farthest(mut self) -> Option<f64> {
        self.end();
        self.farthest
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::estimate::Noise;
    use crate::estimate::{Patience, Preparation, Prepared};
    use crate::quaternion::RotationVector;
    use crate::record::Declared;

    /// A body that rests for 5 s and is then turned every way for 35, with a gyro whose scale is off by `scale` and an
    /// accelerometer that is off by `force`.
    fn prepared(noise: Noise, scale: f64, force: Vector3<f64>) -> Prepared {
        let plan = EstimationSettings {
            aid: Aid::Gravity,
            noise,
            ..EstimationSettings::default()
        };
        prepared_by(&plan, scale, force)
    }

    fn prepared_by(plan: &EstimationSettings, scale: f64, force: Vector3<f64>) -> Prepared {
        let meaning = Meaning::new(plan, &Declared::default());
        let mut preparation = Preparation::new(plan, &meaning, Patience::WholeLog);
        let mut attitude = Quaternion::<Nav, Body>::identity();
        for k in 0..4000 {
            let t = f64::from(k) * 0.01;
            let rate = if k < 500 {
                Vector3::zeros()
            } else {
                Vector3::new((1.1 * t).sin(), (0.7 * t).cos(), (1.7 * t).sin())
            };
            attitude = attitude.advanced(&RotationVector(rate * 0.01));
            let up = attitude.to_dcm().as_matrix().row(2).transpose();
            let sample = RawSample {
                header: Some(Nanos(i64::from(k) * 10_000_000)),
                gyro: Some((rate * (1.0 + scale)).into()),
                accel: Some((up * STANDARD_GRAVITY + force).into()),
                ..RawSample::default()
            };
            preparation.take(&sample).unwrap();
        }
        preparation.decide().unwrap()
    }

    fn codes(prepared: &Prepared) -> Vec<&str> {
        prepared
            .warnings
            .iter()
            .filter_map(Diagnostic::code)
            .collect()
    }

    #[test]
    fn a_sensor_that_nobody_calibrated_is_taken_for_one_and_that_is_said() {
        let off = Vector3::new(0.2, -0.15, 0.1);
        let found = prepared(Noise::by_data(), 0.015, off);
        assert_eq!(found.noise.name, UNCALIBRATED.name);
        assert_eq!(codes(&found), ["class-by-data"]);
        assert!((found.aiding.unwrap().settings.scale_prior - 0.01).abs() < 1e-12);
        // Who states a class is believed.
        let stated = prepared(Noise::preset(&NOISE_PRESETS[0]), 0.015, off);
        assert_eq!(stated.noise.name, NOISE_PRESETS[0].name);
        assert!(codes(&stated).is_empty());
    }

    #[test]
    fn a_calibrated_sensor_is_not() {
        for scale in [0.0, 0.004, -0.004] {
            let found = prepared(Noise::by_data(), scale, Vector3::new(0.02, 0.0, -0.02));
            assert_eq!(found.noise.name, NOISE_PRESETS[0].name, "{scale}");
            assert!(codes(&found).is_empty());
        }
    }

    #[test]
    fn what_no_class_explains_keeps_the_class_and_what_is_smoothed_takes_it() {
        let wide = Settings {
            force_bias_prior: 0.2,
            ..Settings::default()
        };
        let found = |off: f64| Evidence {
            log: 9.0,
            found: Calibration {
                force_bias: Vector3::new(off, 0.0, 0.0),
                ..Calibration::default()
            },
            off_at_rest: None,
        };
        assert!(found(0.59).is_within(&wide) && !found(0.66).is_within(&wide));
        let plan = EstimationSettings {
            aid: Aid::Gravity,
            smooth: true,
            ..EstimationSettings::default()
        };
        let found = prepared_by(&plan, 0.015, Vector3::new(0.2, -0.15, 0.1));
        assert_eq!(found.noise.name, NOISE_PRESETS[1].name);
    }

    #[test]
    fn the_length_at_rest_tells_an_accelerometer() {
        assert!(by_length(0.0) < 0.0 && by_length(0.05) < 0.0);
        assert!(by_length(0.2) > CLEAR);
    }
}
