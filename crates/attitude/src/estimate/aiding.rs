//! `--aid` and the first specific forces -> what corrects the attitude, or why nothing can. Pure.
//!
//! Apart from the rest of the preparation because a force says nothing of its own unit, and one that is no
//! specific force (phones export acceleration without gravity) would level to anything.

use super::meaning::Meaning;
use super::plan::{Aid, Bias, Initial, Plan};
use crate::aid::{Settings, Start};
use crate::record::AccelUnit;
use crate::record::RawSample;
use nalgebra::Vector3;

/// Standard gravity, m/s^2.
pub(super) const STANDARD_GRAVITY: f64 = 9.806_65;
/// Lengths of a force in g and in m/s^2.
const IN_G: std::ops::Range<f64> = 0.4..4.0;
const IN_SI: std::ops::RangeInclusive<f64> = 4.0..=40.0;
/// How far the mean of the first second may be from gravity, as a share.
const FAR: f64 = 0.15;
/// Of a gyro whose bias was removed, rad/s: what the bias may have become since.
const BIAS_LEFT: f64 = 1e-3;
/// Of an initial attitude that was given, or found at rest, rad.
const TILT_GIVEN: f64 = 0.3;
const TILT_AT_REST: f64 = 0.05;

/// What corrects the attitude.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Aiding {
    /// Of the filter.
    pub settings: Settings,
    /// What is known of the initial attitude.
    pub start: Start,
    /// Multiplies the recorded force, beside what its format states.
    pub force_scale: f64,
}

impl Aiding {
    /// What `plan` asks for, with the first samples of the stream: all there are within a second or so; of a
    /// live stream the first alone, whose mean says nothing yet. What is to be said is added to `warnings`.
    ///
    /// # Errors
    /// In words: no specific force, or none that can be.
    pub(super) fn decide(
        plan: &Plan,
        resolved: &Meaning,
        first: &[RawSample],
        warnings: &mut Vec<String>,
    ) -> Result<Option<Aiding>, String> {
        if plan.aid == Aid::None {
            return Ok(None);
        }
        let forces = || {
            first
                .iter()
                .filter_map(|raw| raw.accel)
                .map(|f| (Vector3::from(f) * resolved.accel_scale).norm())
                .filter(|length| length.is_finite() && *length > 0.0)
        };
        let Some(length) = forces().next() else {
            if first.len() <= 1 {
                warnings.push("--aid gravity: the first sample carries no specific force: the attitude is the gyro's until one comes".to_owned());
                return Ok(Some(Aiding::with_scale(plan, 1.0)));
            }
            return Err(format!(
                "--aid gravity: none of the first {} samples carries a specific force\n  help: --field accel=PATH says where it is, --aid none does without",
                first.len()
            ));
        };
        let mean = forces().sum::<f64>() / forces().count() as f64;
        let in_g = resolved.accel_unit_stated.is_none() && IN_G.contains(&length);
        let scale = if in_g { STANDARD_GRAVITY } else { 1.0 };
        if in_g {
            warnings.push(format!(
                "the first specific force has length {length:.3}: taken to be in g, not in m/s^2"
            ));
        }
        let is_gravity = if first.len() > 1 {
            (mean * scale / STANDARD_GRAVITY - 1.0).abs() <= FAR
        } else {
            IN_SI.contains(&(length * scale))
        };
        if !is_gravity {
            return Err(format!(
                "--aid gravity: the specific force has a mean length of {:.3} m/s^2 in the first {} samples, and gravity {STANDARD_GRAVITY}: acceleration without gravity can not level (force_implausible)\n  help: --field accel=PATH names another, --aid none does without",
                mean * scale,
                forces().count()
            ));
        }
        Ok(Some(Aiding::with_scale(plan, scale)))
    }

    fn with_scale(plan: &Plan, force_scale: f64) -> Aiding {
        let mut settings = Settings {
            gyro_range: plan.gyro_range.unwrap_or(0.0),
            ..Settings::default()
        };
        if plan.bias != Bias::None {
            settings.bias_prior = BIAS_LEFT;
        }
        let known = |tilt| Start::Known { tilt, heading: 0.0 };
        let start = match plan.initial {
            Initial::Identity => Start::Level,
            Initial::Gravity => known(TILT_AT_REST),
            Initial::Given(_) | Initial::FirstOrientation => known(TILT_GIVEN),
        };
        Aiding {
            settings,
            start,
            force_scale,
        }
    }
}

/// Multiplies a recorded force into m/s^2, as far as its format states the unit.
pub(super) fn scale_of(unit: Option<AccelUnit>) -> f64 {
    match unit {
        Some(AccelUnit::StandardGravity) => STANDARD_GRAVITY,
        Some(AccelUnit::MetresPerSecondSquared) | None => 1.0,
    }
}
