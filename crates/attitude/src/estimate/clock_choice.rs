//! Samples by two clocks of different speed -> the clock by which gravity stands still. Pure.
//!
//! Apart from the pass over the clocks because it is an estimate of its own: what is turned about the horizontal is the
//! rate times the time, so a filter with a wide prior of the bias runs over the samples twice, with the rates as they are
//! and times the ratio of the speeds, and its residuals of the specific force tell which is likelier.

use super::aiding::Aiding;
use super::meaning::Meaning;
use super::plan::{Aid, Bias, EstimationSettings};
use crate::aid::{AidedPropagator, Settings};
use crate::condition::{self, Clock, Conditioner};
use crate::propagate::{self, Method, Order, Placement};
use crate::quaternion::BodyRate;
use crate::record::{RawSample, SampleKind};

/// Logarithm of how many times likelier one clock must be. Of 287 recordings with truth, at ratios of 1/2 and 2, this
/// was right on 548 of 574; the wrong ones are pendulums with gaps (`docs/theory/clocks.md`).
pub(super) const CLEAR: f64 = 20.0;
/// Prior of the bias, rad/s: that of an uncalibrated gyro, for its bias grows with the factor, too.
const BIAS_PRIOR: f64 = 0.1;
/// Samples by which the length of gravity is told.
const FIRST: usize = 512;
/// Integrates well enough to compare, with a short window.
const METHOD: Method = Method::Magnus {
    window: 3,
    order: Order::M4,
    placement: Placement::Causal,
};

/// Returns the logarithm of how many times likelier it is that the arrival clock is right than that the stamps are, which
/// advance by `speed` in one unit of its time; `None` where no specific force tells.
pub(super) fn for_arrival(
    samples: &[RawSample],
    (plan, resolved): (&EstimationSettings, &Meaning),
    speed: f64,
) -> Option<f64> {
    if matches!(resolved.kind, SampleKind::DeltaAngle | SampleKind::Rotation) {
        // An angle is the same by every clock.
        return None;
    }
    let plan = EstimationSettings {
        aid: Aid::Gravity,
        smooth: false,
        bias: Bias::None,
        gyro_range: None,
        ..plan.clone()
    };
    let first = samples.get(..FIRST).unwrap_or(samples);
    let aiding = Aiding::decide(&plan, resolved, first, &mut Vec::new()).ok()??;
    let cost = |factor| cost(samples, (&plan, resolved), &aiding, factor);
    let log = cost(1.0)? - cost(1.0 / speed)?;
    log.is_finite().then_some(log)
}

/// Negative logarithm of the likelihood of the specific forces with rates times `factor`, but for a constant.
fn cost(
    samples: &[RawSample],
    (plan, resolved): (&EstimationSettings, &Meaning),
    aiding: &Aiding,
    factor: f64,
) -> Option<f64> {
    let conditioning = resolved.conditioning(plan, Clock::Header, BodyRate::ZERO);
    let conditioning = condition::Settings {
        accel_scale: conditioning.accel_scale * aiding.force_scale,
        gyro_scale: conditioning.gyro_scale.map(|scale| scale * factor),
        ..conditioning
    };
    let propagation = propagate::Settings {
        method: METHOD,
        kind: resolved.kind,
        ..propagate::Settings::default()
    };
    let settings = Settings {
        has_field: false,
        hard_iron: 0.0,
        bias_prior: BIAS_PRIOR,
        ..aiding.settings
    };
    let mut conditioner = Conditioner::new(&conditioning).ok()?;
    let mut aided = AidedPropagator::new(propagation, settings, aiding.start).ok()?;
    aided.keep_innovations();
    let (mut rates, mut attitudes) = (Vec::new(), Vec::new());
    let (mut sum, mut count) = (0.0, 0_u64);
    let mut add = |aided: &mut AidedPropagator| {
        for (_, innovation) in aided.innovations() {
            let told = innovation.gravity.iter();
            for (residual, sigma) in told.filter(|(residual, sigma)| {
                residual.is_finite() && *sigma > 0.0 && sigma.is_finite()
            }) {
                sum += sigma.ln() + 0.5 * (residual / sigma).powi(2);
                count += 1;
            }
        }
    };
    for sample in samples {
        conditioner.push(std::slice::from_ref(sample), &mut rates);
        aided.push(&rates, &mut attitudes);
        rates.clear();
        attitudes.clear();
        add(&mut aided);
    }
    conditioner.finish(&mut rates);
    aided.push(&rates, &mut attitudes);
    aided.finish(&mut attitudes);
    add(&mut aided);
    (count > 0).then_some(sum)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::estimate::meaning::STANDARD_GRAVITY;
    use crate::frames::{Body, Nav};
    use crate::quaternion::{Quaternion, RotationVector};
    use crate::record::{Declared, Nanos};
    use nalgebra::Vector3;

    const STEP: f64 = 1e7;

    /// Evidence for the arrival clock of a body that is turned every way for 60 s, by stamps of this speed, while the rates
    /// are those by stamps of speed `right`.
    fn evidence(speed: f64, right: f64, has_force: bool) -> Option<f64> {
        let plan = EstimationSettings::default();
        let meaning = Meaning::new(&plan, &Declared::default());
        let mut attitude = Quaternion::<Nav, Body>::identity();
        let mut sample = |k: i64| {
            let t = k as f64 * 0.01;
            let rate = Vector3::new(0.8 * (1.1 * t).sin(), 0.7 * (0.7 * t).cos(), 0.5);
            attitude = attitude.advanced(&RotationVector(rate * 0.01));
            let up = attitude.to_dcm().as_matrix().row(2).transpose() * STANDARD_GRAVITY;
            RawSample {
                header: Some(Nanos(1_000_000_000 + (k as f64 * STEP * speed) as i64)),
                gyro: Some((rate / right).into()),
                accel: has_force.then_some(up.into()),
                ..RawSample::default()
            }
        };
        let samples: Vec<RawSample> = (0..6000).map(&mut sample).collect();
        for_arrival(&samples, (&plan, &meaning), speed)
    }

    #[test]
    fn the_clock_by_which_gravity_stands_still_is_likelier() {
        for speed in [0.1, 0.5, 0.75, 4.0 / 3.0, 2.0, 10.0] {
            let of_arrival = evidence(speed, 1.0, true).unwrap();
            assert!(of_arrival > CLEAR, "{speed}: {of_arrival}");
            let of_stamps = evidence(speed, speed, true).unwrap();
            assert!(of_stamps < -CLEAR, "{speed}: {of_stamps}");
        }
    }

    #[test]
    fn without_a_force_nothing_tells() {
        assert_eq!(evidence(0.5, 1.0, false), None);
    }
}
