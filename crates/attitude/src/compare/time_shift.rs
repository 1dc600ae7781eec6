//! Two tracks -> by how much the clock of one is late. Pure.
//!
//! Apart from the errors because it asks for their cause: what was recorded by another computer, or filtered for long, shows
//! each motion later. How fast the two rotate tells by how much, whatever their worlds and their axes are; that the shift is
//! true shows in the error over a second, which it must take away.

use super::matching::Track;
use super::relative::{self, RelativeError};
use super::{Reference, Stamped};
use crate::frames::{Body, Nav};
use crate::quaternion::Quaternion;
use crate::record::Nanos;

/// Step between the instants that are looked at, ns, and how many steps a rotation is taken over.
const STEP: i64 = 20_000_000;
const OVER: usize = 5;
/// Longest shift that is looked for, steps (2 s), and most instants (11 min).
const LONGEST: usize = 100;
const MOST: i64 = 1 << 15;
/// Fewest instants that both know.
const FEWEST: usize = 250;
/// Shift that is told, in times of the estimate's spacing: what a sample means moves it by half.
const SPACINGS: f64 = 1.5;
/// Share of the error over a second that a true shift leaves at most, and least error that it has to explain, rad.
const LEFT: f64 = 0.3;
const LEAST: f64 = 0.01;

/// Shift of the reference's clock against the estimate's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TimeShift {
    /// Time by which the reference is late, s; negative where it is early.
    pub late_secs: f64,
    /// Median error of the rotation over 1 s as recorded, and with the shift taken off, rad.
    pub over_1s: [f64; 2],
}

/// Looks for the shift of the reference's clock, two seconds at most, that explains most of the error over a second;
/// `None` where none does. Linear in the rows; to some ms.
#[must_use]
pub fn fit_time_shift<'r>(
    estimate: &[Stamped],
    reference: impl Into<Reference<'r>>,
) -> Option<TimeShift> {
    let reference: Reference<'_> = reference.into();
    let (estimated, referred) = (Track::new(estimate), Track::new(reference.rows));
    let before = median_over_1s(&estimated, reference)?;
    if before < LEAST {
        return None;
    }
    let (begin, end) = span(&estimated, &referred)?;
    let steps = ((end.since(begin) / STEP).min(MOST)).try_into().ok()?;
    let speeds = |track: &Track<'_>| speeds(track, begin, steps);
    let late = latest(&speeds(&estimated), &speeds(&referred))? * STEP as f64;
    if late.abs() < SPACINGS * estimated.spacing.max(STEP) as f64 {
        return None;
    }
    let moved = |stamp: &Nanos| Nanos(stamp.0.saturating_sub(late.round() as i64));
    let rows: Vec<Stamped> = reference.rows.iter().map(|(t, q)| (moved(t), *q)).collect();
    let cuts: Vec<Nanos> = reference.cuts.iter().map(moved).collect();
    let shifted = Reference {
        rows: &rows,
        cuts: &cuts,
    };
    let after = median_over_1s(&estimated, shifted)?;
    (after < LEFT * before).then_some(TimeShift {
        late_secs: late * 1e-9,
        over_1s: [before, after],
    })
}

fn median_over_1s(estimate: &Track<'_>, reference: Reference<'_>) -> Option<f64> {
    let referred = Track::new(reference.rows);
    let found = relative::over_one_second(estimate, &referred.parts(reference.cuts));
    found.map(|RelativeError { median, .. }| median)
}

/// Time that both know.
fn span(one: &Track<'_>, other: &Track<'_>) -> Option<(Nanos, Nanos)> {
    let ends = |track: &Track<'_>| Some((track.rows.first()?.0, track.rows.last()?.0));
    let ((a, b), (c, d)) = (ends(one)?, ends(other)?);
    let (begin, end) = (a.max(c), b.min(d));
    (begin < end).then_some((begin, end))
}

/// Angles by which a track turns over [`OVER`] steps from each instant on, rad; NaN where it is not known.
fn speeds(track: &Track<'_>, begin: Nanos, steps: usize) -> Vec<f64> {
    let mut after = track.until(begin);
    let attitudes: Vec<Option<Quaternion<Nav, Body>>> = (0..steps as i64)
        .map(|step| {
            let stamp = Nanos(begin.0 + step * STEP);
            while track.rows.get(after).is_some_and(|(t, _)| *t <= stamp) {
                after += 1;
            }
            track.at(stamp, after).ok()
        })
        .collect();
    let later = attitudes.iter().skip(OVER);
    let pairs = attitudes.iter().zip(later);
    pairs
        .map(|pair| match pair {
            (Some(now), Some(then)) => now.angle_to(then),
            _ => f64::NAN,
        })
        .collect()
}

/// Steps by which `other` shows the same later, by the largest correlation of the two, between the steps by a parabola.
fn latest(one: &[f64], other: &[f64]) -> Option<f64> {
    let longest = LONGEST as i64;
    let all: Vec<f64> = (-longest..=longest)
        .map(|lag| correlation(one, other, lag).unwrap_or(f64::NEG_INFINITY))
        .collect();
    let (at, most) = all.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    let neighbours = (all.get(at.checked_sub(1)?)?, all.get(at + 1)?);
    let (before, behind) = neighbours;
    let curvature = before - 2.0 * most + behind;
    let off = match curvature.is_finite() && curvature < 0.0 {
        true => 0.5 * (before - behind) / curvature,
        false => return None,
    };
    Some(at as f64 - LONGEST as f64 + off)
}

/// Correlation of `one` with what `other` shows so many steps later; `None` of too few.
fn correlation(one: &[f64], other: &[f64], lag: i64) -> Option<f64> {
    let skip = |lag: i64| usize::try_from(lag).unwrap_or(0);
    let pairs = one
        .iter()
        .skip(skip(-lag))
        .zip(other.iter().skip(skip(lag)));
    let known = pairs.filter(|(a, b)| a.is_finite() && b.is_finite());
    let [mut n, mut a, mut b, mut aa, mut bb, mut ab] = [0.0; 6];
    for (x, y) in known {
        n += 1.0;
        a += x;
        b += y;
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    let variance = (aa - a * a / n) * (bb - b * b / n);
    (n >= FEWEST as f64 && variance > 0.0).then(|| (ab - a * b / n) / variance.sqrt())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::quaternion::RotationVector;
    use nalgebra::Vector3;

    /// A minute at 100 Hz of a body that turns every way, `late` ns late, in a world of its own where it is another's.
    fn track(late: i64, world: f64, noise: f64) -> Vec<Stamped> {
        turning(1.1, late, world, noise)
    }

    /// The same at up to this rate, rad/s about each axis.
    fn turning(most: f64, late: i64, world: f64, noise: f64) -> Vec<Stamped> {
        let mut q: Quaternion<Nav, Body> =
            Quaternion::from_rotation_vector(&RotationVector(Vector3::new(0.3, -0.2, 1.0) * world));
        (0..6000_i64)
            .map(|n| {
                let t = n as f64 * 0.01;
                let rate = Vector3::new((1.3 * t).sin(), (0.71 * t).cos(), (2.17 * t).sin());
                q = q.advanced(&RotationVector(rate * (most * (0.37 * t).sin() * 0.01)));
                let of = |k: f64| noise * (k * n as f64).sin();
                let off = RotationVector(Vector3::new(of(91.7), of(57.3), of(123.1)));
                (Nanos(n * 10_000_000 + late), q.advanced(&off).normalised())
            })
            .collect()
    }

    #[test]
    fn a_reference_that_is_late_or_early_is_found_whatever_its_world_is() {
        let estimate = track(0, 0.0, 0.0);
        for millis in [-1500, -80, 47, 300, 1900] {
            let reference = track(millis * 1_000_000, 1.0, 1e-3);
            let found = fit_time_shift(&estimate, &reference).unwrap();
            let late = millis as f64 * 1e-3;
            assert!((found.late_secs - late).abs() < 4e-3, "{late}: {found:?}");
            assert!(found.over_1s[1] < 0.1 * found.over_1s[0], "{found:?}");
        }
    }

    #[test]
    fn no_shift_is_claimed_of_one_clock_of_another_motion_and_of_what_a_sample_means() {
        let estimate = track(0, 0.0, 0.0);
        assert_eq!(fit_time_shift(&estimate, &track(0, 1.0, 5e-3)), None);
        assert_eq!(fit_time_shift(&estimate, &track(5_000_000, 1.0, 0.0)), None);
        assert_eq!(
            fit_time_shift(&estimate, &track(5_000_000_000, 1.0, 0.0)),
            None
        );
        let stretched: Vec<Stamped> = estimate.iter().map(|(t, q)| (Nanos(t.0 / 3), *q)).collect();
        assert_eq!(fit_time_shift(&estimate, &stretched), None);
        let still: Vec<Stamped> = estimate
            .iter()
            .map(|(t, _)| (*t, Quaternion::identity()))
            .collect();
        assert_eq!(fit_time_shift(&estimate, &still), None);
        assert_eq!(fit_time_shift(&still, &estimate), None);
        assert_eq!(fit_time_shift(&[], &estimate), None);
    }

    #[test]
    fn no_shift_is_claimed_of_four_seconds_of_what_explains_little_and_of_about_a_spacing() {
        let estimate = track(0, 0.0, 0.0);
        let late = track(300_000_000, 1.0, 0.0);
        assert!(fit_time_shift(&estimate, &late[..600]).is_some());
        assert_eq!(fit_time_shift(&estimate, &late[..400]), None);
        // As late, and so slow that an error over a second is a few mrad.
        let slow = |late| turning(0.005, late, 0.0, 0.0);
        assert_eq!(fit_time_shift(&slow(0), &slow(300_000_000)), None);
        // Of 20 Hz little more than from one sample to the next.
        let sparse: Vec<Stamped> = estimate.iter().step_by(5).copied().collect();
        let found = fit_time_shift(&sparse, &late).unwrap();
        assert!((found.late_secs - 0.3).abs() < 5e-3, "{found:?}");
        for little in [-60_000_000, 60_000_000] {
            assert_eq!(fit_time_shift(&sparse, &track(little, 1.0, 0.0)), None);
        }
    }
}
