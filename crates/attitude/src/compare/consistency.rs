//! Errors and what was said of them beforehand -> does sigma hold? Pure.
//!
//! Apart from the errors because it asks of the estimate's honesty, not of its size: an attitude that is off by ten
//! degrees under a sigma of five is a good one badly off, one that is off by a degree under a sigma of a tenth is a
//! lie.
//!
//! Tilt and heading are told apart, since what corrects one leaves the other alone: tilt is the part of the error about
//! level axes, its sigma the one in the direction of the error; heading the part about the vertical. A reference has
//! noise of its own. How much shows in its scatter over one step, where the gyro is better than anything, and is
//! counted beside sigma: once for the sample, once for the first one, by which the worlds were laid on each other.
//! What was laid on each other has taken an error of the estimate away, which is in all that is left: its sigma counts
//! as well, at its most.

use super::matching::{Track, for_each_match};
use super::statistics::quantile;
use super::{Align, Reference, Stamped};
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::{AttitudeCovariance, Nanos};
use nalgebra::{Matrix3, Vector2, Vector3};
use std::ops::ControlFlow;

/// An attitude with what is known of its error.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UncertainAttitude {
    /// Stamp.
    pub stamp: Nanos,
    /// The estimate.
    pub q_nb: Quaternion<Nav, Body>,
    /// Covariance of its error, in body axes.
    pub covariance: AttitudeCovariance,
}

/// Error and three sigma of one part of the attitude, over the common time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct WithinSigma {
    /// Share of the errors within three sigma, 0..=1.
    pub inside: f64,
    /// Root of the mean square of the error, rad.
    pub rms: f64,
    /// Root of the mean square of sigma, rad.
    pub sigma: f64,
    /// The largest error in sigma.
    pub worst: f64,
}

/// Whether the errors of an estimate lie within what it said of them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Consistency {
    /// Reference samples judged.
    pub samples: usize,
    /// The error about level axes.
    pub tilt: WithinSigma,
    /// The error about the vertical.
    pub heading: WithinSigma,
    /// Noise of the reference itself, one sigma an axis, rad.
    pub reference_noise: f64,
    /// Alignment of the two worlds.
    pub align: Align,
    /// Angle by which the reference's vertical leans against the estimate's, rad, if that was removed: then the
    /// reference's world is not level.
    pub leaning: Option<f64>,
}

/// The least share within three sigma of an error that sigma is true of.
const ENOUGH_INSIDE: f64 = 0.98;

impl Consistency {
    /// Whether less than 98 % of the errors of tilt or heading lie within three sigma.
    #[must_use]
    pub fn is_beyond(&self) -> bool {
        self.is_beyond_in_tilt() || self.heading.inside < ENOUGH_INSIDE
    }

    /// Whether less than 98 % of the errors of tilt lie within three sigma.
    #[must_use]
    pub fn is_beyond_in_tilt(&self) -> bool {
        self.tilt.inside < ENOUGH_INSIDE
    }
}

/// An error with its three sigma, for plots. Angles in rad.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BoundedError {
    /// Stamp.
    pub stamp: Nanos,
    /// Angle about level axes, and three sigma in its direction.
    pub tilt: [f64; 2],
    /// Angle about the vertical, signed, and three sigma of it.
    pub heading: [f64; 2],
}

/// A world leans when what is left of the tilt without it is less than this share.
const EXPLAINED: f64 = 0.5;

/// Judges the sigma of `estimate`, row by row, by `reference`, the worlds laid on each other as `align` says; `None`
/// without a common instant, or where no sigma is stated. Who claims to be level (an alignment of the heading alone)
/// and leaves the reference's tilt by a constant is judged by what is left without it: `leaning` says so.
#[must_use]
pub fn consistency<'r>(
    estimate: &[UncertainAttitude],
    reference: impl Into<Reference<'r>>,
    align: Align,
    mut visit: impl FnMut(&BoundedError),
) -> Option<Consistency> {
    let reference: Reference<'_> = reference.into();
    let mut rows: Vec<&UncertainAttitude> = estimate
        .iter()
        .filter(|known| {
            Quaternion::<Nav, Body>::try_from_wxyz(known.q_nb.wxyz()).is_ok()
                && known.covariance.upper().iter().all(|v| v.is_finite())
        })
        .collect();
    rows.sort_by_key(|known| known.stamp);
    let stamped: Vec<Stamped> = rows.iter().map(|k| (k.stamp, k.q_nb)).collect();
    let (estimated, referred) = (Track::new(&stamped), Track::new(reference.rows));
    let parts = referred.parts(reference.cuts);
    let longest = parts.iter().max_by_key(|part| part.rows.len())?;
    let reference_noise = scatter_of_a_step(&estimated, &referred)?;

    let judge = |align: Align, visit: &mut dyn FnMut(&BoundedError)| {
        let mut sums = Sums::default();
        for part in &parts {
            let rotation = align.rotation(&estimated, part);
            let own_at = |place: usize| {
                let known = rows.get(place)?;
                let attitude = rotation * known.q_nb;
                Some(known.covariance.in_navigation_axes(&attitude))
            };
            let taken_away = taken_away(align, &estimated, part, own_at);
            let _ = for_each_match(&estimated, part, |stamp, q_ref_est, place| {
                // Between two estimates the later one's sigma: it is the larger of the gyro alone.
                let Some(own) = own_at(place) else {
                    return ControlFlow::Continue(());
                };
                let error = (q_ref_est * rotation.inverse()).inverse();
                sums.is_stated |= own.trace() > 0.0;
                let own = own + taken_away;
                let at = bounded(stamp, &error, &own, 2.0 * reference_noise.powi(2));
                sums.add(&at);
                visit(&at);
                ControlFlow::Continue(())
            });
        }
        sums
    };
    let mut align = align;
    let mut silent = |_: &BoundedError| {};
    let mut leaning = None;
    if matches!(align, Align::FirstHeading | Align::Heading) {
        let level = judge(align, &mut silent);
        let best = judge(Align::Best, &mut silent);
        let [w, x, y, z] = Align::Best.rotation(&estimated, longest).wxyz();
        let lean = 2.0 * x.hypot(y).atan2(w.hypot(z));
        let is_beyond = level.tilt.finish(level.samples)?.inside < ENOUGH_INSIDE;
        if is_beyond && best.tilt.squares < EXPLAINED.powi(2) * level.tilt.squares {
            leaning = Some(lean);
            align = Align::Best;
        }
    }
    let sums = judge(align, &mut visit);
    // Without any noise stated there is nothing to judge; nor by one orientation, to which the estimate was aligned.
    (sums.is_stated && sums.samples > 1).then_some(())?;
    Some(Consistency {
        samples: sums.samples,
        tilt: sums.tilt.finish(sums.samples)?,
        heading: sums.heading.finish(sums.samples)?,
        reference_noise,
        align,
        leaning,
    })
}

/// Most that the covariance of the error may be which `align` took away, rad^2 in the reference's axes: that of the
/// first instant, or of the mean of all, which is at most the mean of theirs, however they go together. `own` is the
/// estimate's by its place.
fn taken_away(
    align: Align,
    estimate: &Track<'_>,
    reference: &Track<'_>,
    own: impl Fn(usize) -> Option<Matrix3<f64>>,
) -> Matrix3<f64> {
    let is_of_the_first = match align {
        Align::None => return Matrix3::zeros(),
        Align::First | Align::FirstHeading => true,
        Align::Heading | Align::Best => false,
    };
    let (mut sum, mut n) = (Matrix3::zeros(), 0.0_f64);
    let _ = for_each_match(estimate, reference, |_, _, place| {
        if let Some(own) = own(place) {
            sum += own;
            n += 1.0;
        }
        match is_of_the_first {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    let all = sum / n.max(1.0);
    match align {
        Align::FirstHeading | Align::Heading => {
            Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, all.m33))
        }
        Align::None | Align::First | Align::Best => all,
    }
}

/// `more` is the variance of the reference about each axis, rad^2.
fn bounded(
    stamp: Nanos,
    error: &Quaternion<Nav, Nav>,
    own: &Matrix3<f64>,
    more: f64,
) -> BoundedError {
    let [w, x, y, z] = error.same_sign_as(&Quaternion::identity()).wxyz();
    let level = Vector2::new(x, y);
    let size = level.norm();
    // Where there is no error, that of the worse axis.
    let variance = if size > 0.0 {
        let along = level / size;
        along.dot(&(own.fixed_view::<2, 2>(0, 0) * along))
    } else {
        own.m11.max(own.m22)
    };
    let three = |own: f64| 3.0 * (own.max(0.0) + more).sqrt();
    BoundedError {
        stamp,
        tilt: [2.0 * size.atan2(w.hypot(z)), three(variance)],
        heading: [2.0 * z.atan2(w), three(own.m33)],
    }
}

#[derive(Default)]
struct Sum {
    inside: usize,
    squares: f64,
    sigmas: f64,
    worst: f64,
}

impl Sum {
    fn add(&mut self, [error, three]: [f64; 2]) {
        let error = error.abs();
        self.inside += usize::from(error <= three);
        self.squares += error * error;
        self.sigmas += (three / 3.0).powi(2);
        if error > 0.0 && three > 0.0 {
            self.worst = self.worst.max(3.0 * error / three);
        }
    }

    fn finish(&self, samples: usize) -> Option<WithinSigma> {
        (samples > 0).then(|| {
            let n = samples as f64;
            WithinSigma {
                inside: self.inside as f64 / n,
                rms: (self.squares / n).sqrt(),
                sigma: (self.sigmas / n).sqrt(),
                worst: self.worst,
            }
        })
    }
}

#[derive(Default)]
struct Sums {
    samples: usize,
    is_stated: bool,
    tilt: Sum,
    heading: Sum,
}

impl Sums {
    fn add(&mut self, at: &BoundedError) {
        self.samples += 1;
        self.tilt.add(at.tilt);
        self.heading.add(at.heading);
    }
}

/// Noise of the reference about one axis, rad: how far its turns over one step scatter about those of the estimate,
/// whose own noise over a step is far less. By medians, so that jumps do not count. `None` of fewer than three.
fn scatter_of_a_step(estimate: &Track<'_>, reference: &Track<'_>) -> Option<f64> {
    /// Ratio of sigma to the median deviation of a normal distribution.
    const SIGMA_OF_MEDIAN: f64 = 1.4826;
    let mut axes: [Vec<f64>; 3] = Default::default();
    let mut before: Option<(Nanos, Quaternion<Nav, Nav>)> = None;
    let _ = for_each_match(estimate, reference, |stamp, q_ref_est, _| {
        if let Some((last, was)) = before
            && stamp.since(last) <= reference.spacing.saturating_mul(2)
        {
            let step = (q_ref_est * was.inverse()).same_sign_as(&Quaternion::identity());
            let step = step.rotation_vector().0;
            for (axis, value) in axes.iter_mut().zip(step.iter()) {
                axis.push(*value);
            }
        }
        before = Some((stamp, q_ref_est));
        ControlFlow::Continue(())
    });
    let mut variance = 0.0;
    for axis in &mut axes {
        if axis.len() < 2 {
            return before.map(|_| 0.0);
        }
        let middle = quantile(axis, 0.5)?;
        axis.iter_mut().for_each(|v| *v = (*v - middle).abs());
        // A difference of two samples has twice the variance of one.
        variance += (SIGMA_OF_MEDIAN * quantile(axis, 0.5)?).powi(2) / 2.0;
    }
    Some((variance / 3.0).sqrt())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::quaternion::RotationVector;

    const ROWS: i64 = 2000;

    fn truth(i: i64) -> Quaternion<Nav, Body> {
        let t = 0.01 * i as f64;
        let phi = Vector3::new((0.9 * t).sin(), 0.7 * (1.7 * t).sin(), 0.3 * t);
        Quaternion::from_rotation_vector(&RotationVector(phi))
    }

    fn reference() -> Vec<Stamped> {
        (0..ROWS)
            .map(|i| (Nanos(i * 10_000_000), truth(i)))
            .collect()
    }

    /// Off by `error(share of the time)`, rad in the world's axes, and said to be by `sigma` about each body axis.
    fn estimate(error: impl Fn(f64) -> Vector3<f64>, sigma: f64) -> Vec<UncertainAttitude> {
        (0..ROWS)
            .map(|i| {
                let error = RotationVector(error(i as f64 / ROWS as f64));
                let turn: Quaternion<Nav, Nav> = Quaternion::from_rotation_vector(&error);
                UncertainAttitude {
                    stamp: Nanos(i * 10_000_000),
                    q_nb: (turn * truth(i)).normalised(),
                    covariance: AttitudeCovariance::from_sigma(Vector3::from_element(sigma)),
                }
            })
            .collect()
    }

    fn about_the_vertical(
        heading: f64,
        tilt: f64,
        q_nb: &Quaternion<Nav, Body>,
    ) -> AttitudeCovariance {
        let variances = Vector3::new(tilt, tilt, heading).map(|sigma| sigma * sigma);
        AttitudeCovariance::of_navigation_axes(&Matrix3::from_diagonal(&variances), q_nb)
    }

    fn judged(known: &[UncertainAttitude], align: Align) -> Consistency {
        consistency(known, &reference(), align, |_| {}).unwrap()
    }

    #[test]
    fn an_error_of_heading_is_no_error_of_tilt_and_the_share_is_that_of_the_time() {
        // Heading grows to 0.4 rad under a sigma of 0.1: within three sigma for three quarters.
        let found = judged(&estimate(|t| Vector3::z() * 0.4 * t, 0.1), Align::None);
        assert!((found.heading.inside - 0.75).abs() < 0.01, "{found:?}");
        assert!(
            found.tilt.inside == 1.0 && found.tilt.rms < 1e-3,
            "{found:?}"
        );
        assert!(
            (found.heading.worst - 4.0).abs() < 0.01 && found.is_beyond(),
            "{found:?}"
        );
        assert!(found.reference_noise < 1e-4, "{found:?}");
        let honest = judged(&estimate(|t| Vector3::z() * 0.4 * t, 0.14), Align::None);
        assert!(!honest.is_beyond(), "{honest:?}");
    }

    #[test]
    fn the_sigma_of_what_an_alignment_takes_away_counts() {
        // Heading drifts by 0.4 rad under a sigma that grows as it does: honest, and wherever the worlds are laid on
        // each other it stays so.
        let mut drifting = estimate(|t| Vector3::z() * 0.4 * t, 0.0);
        for (i, known) in drifting.iter_mut().enumerate() {
            let sigma = 0.25 * i as f64 / ROWS as f64;
            known.covariance = AttitudeCovariance::from_sigma(Vector3::from_element(sigma));
        }
        for align in Align::ALL {
            let found = judged(&drifting, align);
            assert!(!found.is_beyond(), "{align} {found:?}");
        }
        // Heading that is found in the first second, from 0.3 rad off under a sigma of 0.3.
        let off = |t: f64| 0.3 * (1.0 - 20.0 * t).max(0.0);
        let mut finding = estimate(|t| Vector3::z() * off(t), 0.01);
        for (i, known) in finding.iter_mut().enumerate() {
            let sigma = off(i as f64 / ROWS as f64).max(0.01);
            known.covariance = about_the_vertical(sigma, 0.01, &known.q_nb);
        }
        let found = judged(&finding, Align::FirstHeading);
        assert!(!found.is_beyond(), "{found:?}");
        // An error that no alignment takes away, under a sigma that is a tenth of it.
        let wrong = estimate(|t| Vector3::z() * 0.4 * (9.0 * t).sin(), 0.03);
        for align in Align::ALL {
            assert!(judged(&wrong, align).is_beyond(), "{align}");
        }
        // Nor does a heading's sigma excuse a tilt.
        let mut tilted = estimate(|t| Vector3::x() * 0.1 * (9.0 * t).sin(), 0.0);
        for known in &mut tilted {
            known.covariance = about_the_vertical(0.3, 0.005, &known.q_nb);
        }
        let found = judged(&tilted, Align::Heading);
        assert!(found.tilt.inside < 0.5, "{found:?}");
        // Nor the sigma of a first tilt, which an alignment by the heading leaves as it is.
        if let Some(first) = tilted.first_mut() {
            first.covariance = about_the_vertical(0.3, 0.3, &first.q_nb);
        }
        let found = judged(&tilted, Align::FirstHeading);
        assert!(found.tilt.inside < 0.5, "{found:?}");
    }

    #[test]
    fn a_reference_whose_world_leans_is_said_to_and_one_that_does_not_is_held_to_the_vertical() {
        let leaning = judged(&estimate(|_| Vector3::x() * 0.2, 0.01), Align::FirstHeading);
        assert!((leaning.leaning.unwrap() - 0.2).abs() < 1e-3, "{leaning:?}");
        assert!(!leaning.is_beyond(), "{leaning:?}");
        // An error of tilt that comes and goes is none of the world's.
        let wrong = judged(
            &estimate(|t| Vector3::x() * 0.2 * (20.0 * t).sin(), 0.01),
            Align::FirstHeading,
        );
        assert!(
            wrong.leaning.is_none() && wrong.tilt.inside < 0.2,
            "{wrong:?}"
        );
    }

    #[test]
    fn noise_of_the_reference_is_not_laid_at_the_estimate_s_door() {
        // A thousandth of a rad of noise on every row of the reference, a sigma of a ten thousandth.
        let noisy: Vec<Stamped> = reference()
            .iter()
            .enumerate()
            .map(|(i, (stamp, q))| {
                let noise = |k: f64| 1.7e-3 * (k * i as f64).sin();
                let off = RotationVector(Vector3::new(noise(91.7), noise(57.3), noise(123.1)));
                (*stamp, q.advanced(&off).normalised())
            })
            .collect();
        let known = estimate(|_| Vector3::zeros(), 1e-4);
        let found = consistency(&known, &noisy, Align::First, |_| {}).unwrap();
        assert!(!found.is_beyond(), "{found:?}");
        assert!((0.7e-3..2e-3).contains(&found.reference_noise), "{found:?}");
        // A slow error is none of the reference's noise.
        let slow = estimate(|t| Vector3::z() * 0.1 * t, 1e-4);
        assert!(
            consistency(&slow, &noisy, Align::First, |_| {})
                .unwrap()
                .is_beyond()
        );
    }

    #[test]
    fn without_a_sigma_or_an_instant_in_common_nothing_is_judged() {
        let known = estimate(|_| Vector3::zeros(), 0.0);
        assert!(consistency(&known, &reference(), Align::First, |_| {}).is_none());
        let known = estimate(|_| Vector3::zeros(), 0.1);
        let later: Vec<Stamped> = reference()
            .iter()
            .map(|(t, q)| (Nanos(t.0 + 1_000_000_000_000), *q))
            .collect();
        assert!(consistency(&known, &later, Align::First, |_| {}).is_none());
        assert!(consistency(&[], &reference(), Align::First, |_| {}).is_none());
    }
}
