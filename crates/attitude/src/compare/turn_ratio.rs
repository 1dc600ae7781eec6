//! Two tracks -> how many times farther one turns than the other. Pure.
//!
//! Apart from the errors because it asks for their cause: rates in another unit turn by a factor, in whatever direction.

use super::matching::Track;
use super::statistics::quantile;
use super::{Reference, Stamped};
use crate::record::Nanos;

/// Time over which turns are compared, ns: noise of a reference is little beside them, and little comes back.
const INTERVAL_NANOS: i64 = 100_000_000;
/// Longest step of an estimate, rad: a longer one may have gone round the other way.
const LONGEST_STEP: f64 = 2.0;
/// Turn of the farther of the two from which it counts, rad.
const LEAST: f64 = 0.02;
/// Fewest turns, and the share of them that must be within this of the median ratio.
const FEWEST: usize = 30;
const AGREEING: f64 = 0.6;
const NEAR: f64 = 0.2;

/// Ratio of the turns of an estimate to those of a reference.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TurnRatio {
    /// Median.
    pub ratio: f64,
    /// Median distance from it, as a share.
    pub spread: f64,
}

/// Ratio of the turns of `estimate` to those of the reference over a tenth of a second: the median where most agree,
/// and `None` where they do not, or too few turn. What is up to two rad in one step is told; noise of the reference below
/// some mrad moves it by a few percent.
#[must_use]
pub fn turn_ratio<'r>(
    estimate: &[Stamped],
    reference: impl Into<Reference<'r>>,
) -> Option<TurnRatio> {
    let reference: Reference<'_> = reference.into();
    let (estimate, referred) = (Track::new(estimate), Track::new(reference.rows));
    let mut turns = Vec::new();
    for part in referred.parts(reference.cuts) {
        each_turn(&estimate, &part, |found, truth| turns.push((found, truth)));
    }
    // The half that turns most.
    let size = |(found, truth): &(f64, f64)| found.max(*truth);
    let mut sizes: Vec<f64> = turns.iter().map(size).collect();
    let least = quantile(&mut sizes, 0.5)?.max(LEAST);
    let mut ratios: Vec<f64> = turns
        .iter()
        .filter(|turn| size(turn) >= least)
        .map(|(found, truth)| found / truth)
        .filter(|ratio| ratio.is_finite() && *ratio > 0.0)
        .collect();
    let ratio = quantile(&mut ratios, 0.5)?;
    let mut off: Vec<f64> = ratios.iter().map(|r| (r / ratio - 1.0).abs()).collect();
    let agreeing = off.iter().filter(|off| **off < NEAR).count();
    let is_told = off.len() >= FEWEST && agreeing as f64 >= AGREEING * off.len() as f64;
    let spread = quantile(&mut off, 0.5)?;
    is_told.then_some(TurnRatio { ratio, spread })
}

/// Visits the angles by which `estimate` and the reference turned, rad, over each tenth of a second that both know.
fn each_turn(estimate: &Track<'_>, reference: &Track<'_>, mut visit: impl FnMut(f64, f64)) {
    let mut after = 0;
    let mut truth_at = |stamp: Nanos| {
        while reference.rows.get(after).is_some_and(|(t, _)| *t <= stamp) {
            after += 1;
        }
        reference.at(stamp, after).ok()
    };
    // Where the interval began, and the way since.
    let mut begun: Option<(Stamped, Option<_>)> = None;
    let (mut last, mut way): (Option<Stamped>, f64) = (None, 0.0);
    for (stamp, q) in estimate.rows.iter() {
        if let Some((before, was)) = last.replace((*stamp, *q)) {
            let step = was.angle_to(q);
            way += step;
            let gap = stamp.since(before);
            if step > LONGEST_STEP || gap > INTERVAL_NANOS {
                begun = None;
            }
        }
        match &begun {
            Some(((start, was), Some(truth))) if stamp.since(*start) >= INTERVAL_NANOS => {
                let now = truth_at(*stamp);
                if let Some(now) = &now {
                    let turned = was.angle_to(q);
                    // Farther than half a turn, what counts is the way.
                    let found = if way < LONGEST_STEP { turned } else { way };
                    let truth: &crate::quaternion::Quaternion<_, _> = truth;
                    visit(found, truth.angle_to(now));
                }
                (begun, way) = (Some(((*stamp, *q), now)), 0.0);
            }
            Some((_, Some(_))) => {}
            _ => (begun, way) = (Some(((*stamp, *q), truth_at(*stamp))), 0.0),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::frames::{Body, Nav};
    use crate::quaternion::{Quaternion, RotationVector};
    use nalgebra::Vector3;

    /// A minute at 100 Hz of rates `times` those of a body that turns every way, 2 rad/s at most, less `off`.
    fn track(times: f64, noise: f64) -> Vec<Stamped> {
        let mut q: Quaternion<Nav, Body> = Quaternion::identity();
        (0..6000_i64)
            .map(|n| {
                let t = n as f64 * 0.01;
                let rate = Vector3::new((1.3 * t).sin(), (0.7 * t).cos(), (2.1 * t).sin()) * 1.1;
                q = q.advanced(&RotationVector(rate * (0.01 * times)));
                let of = |k: f64| noise * (k * n as f64).sin();
                let off = RotationVector(Vector3::new(of(91.7), of(57.3), of(123.1)));
                (Nanos(n * 10_000_000), q.advanced(&off).normalised())
            })
            .collect()
    }

    /// A minute at 100 Hz of a body that turns about one axis at this rate, rad/s.
    fn turning(rate: f64) -> Vec<Stamped> {
        let about = |t: f64| RotationVector(Vector3::new(0.6, 0.0, 0.8) * (rate * t));
        (0..6000_i64)
            .map(|n| {
                let q = Quaternion::from_rotation_vector(&about(n as f64 * 0.01));
                (Nanos(n * 10_000_000), q)
            })
            .collect()
    }

    #[test]
    fn a_factor_of_the_rates_is_found_either_way_under_the_noise_of_a_reference() {
        let reference = track(1.0, 2e-3);
        for times in [1.0, 0.5, 2.0, 57.3, 1.0 / 57.3, 1e-3] {
            let found = turn_ratio(&track(times, 0.0), &reference).unwrap();
            assert!(
                (found.ratio / times - 1.0).abs() < 0.05,
                "{times}: {found:?}"
            );
        }
    }

    #[test]
    fn what_rests_for_half_of_the_time_is_told_by_the_other_half() {
        let moving = track(1.0, 0.0);
        let half = |noise: f64| -> Vec<Stamped> {
            let noisy = track(1.0, noise);
            let rows = moving.iter().zip(noisy).enumerate();
            rows.map(|(n, ((t, q), (_, off)))| match n < 3000 {
                true => (*t, *q),
                false => (*t, Quaternion::identity() * (q.inverse() * off)),
            })
            .collect()
        };
        let found = turn_ratio(&half(1e-3), &half(0.03)).unwrap();
        assert!((found.ratio - 1.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn nothing_is_told_of_what_does_not_turn_of_another_motion_and_of_what_goes_round() {
        let reference = track(1.0, 0.0);
        let still: Vec<Stamped> = reference
            .iter()
            .map(|(t, _)| (*t, Quaternion::identity()))
            .collect();
        assert_eq!(turn_ratio(&still, &still), None);
        assert_eq!(turn_ratio(&still, &reference), None);
        assert_eq!(turn_ratio(&[], &reference), None);
        assert_eq!(turn_ratio(&reference, &reference[..20]), None);
        let later: Vec<Stamped> = reference
            .iter()
            .map(|(t, q)| (Nanos(t.0 / 3), *q))
            .collect();
        assert_eq!(turn_ratio(&later, &reference), None);
        // Two rad and more in each step.
        assert_eq!(turn_ratio(&track(400.0, 0.0), &reference), None);
        // Four rad in each step look like 2.3 the other way, each time.
        let one = turning(1.0);
        assert!((turn_ratio(&turning(150.0), &one).unwrap().ratio / 150.0 - 1.0).abs() < 1e-3);
        assert_eq!(turn_ratio(&turning(400.0), &one), None);
        // Two drifts: no motion.
        assert_eq!(turn_ratio(&turning(0.1), &turning(0.05)), None);
    }
}
