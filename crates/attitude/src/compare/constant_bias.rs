//! An integrated gyro and a recorded orientation -> the constant bias that explains how they part. Pure.
//!
//! Apart from the body's axes because it is another explanation of the same thing, and apart from the drift because
//! that is a line in the world: a bias is constant in the body, and drifts about whatever the body's axes point at.
//!
//! Over windows of a second the rotation of the estimate is that of the reference and `delta`, with
//! `delta = J b`, `J' = R^T J + h exp(-phi/2)` over each step of h seconds and rotation R. Least squares of `delta -
//! J b` with weights that fall with the residual (Huber), since references jump; then the estimate is turned back
//! step by step by the bias found, and the rest is found (Gauss and Newton). How well it is known shows in how parts of
//! the recording agree with each other: what no window knows of the others (a scale error, a bias that wanders, a
//! reference that lags) is in it.

use super::matching::Track;
use super::statistics::quantile;
use super::{Reference, Stamped};
use crate::frames::Body;
use crate::quaternion::{Quaternion, RotationVector};
use crate::record::Nanos;
use nalgebra::{Matrix3, Vector3};

/// Length of a window, ns.
const WINDOW: i64 = 1_000_000_000;
/// Fewest windows that are judged.
const FEWEST: usize = 10;
/// Estimates further apart than this follow no motion within a window, ns.
const COARSE: i64 = 250_000_000;
/// Rounds of least squares with new weights, and of turning the estimate back.
const REWEIGHTED: usize = 8;
const TURNED_BACK: usize = 3;
/// Residuals beyond so many of their medians count less.
const HUBER: f64 = 2.0;
/// Longer stretches over which it is seen whether the bias helps: windows in one, at most.
const LONG: usize = 30;
/// A bias is known when it is so many sigmas from nothing, and worth a word from so much on, rad/s (10 deg/h).
const SIGMAS: f64 = 5.0;
const SMALLEST: f64 = 10.0 / 3600.0 * std::f64::consts::PI / 180.0;
/// Largest bias that is believed, rad/s (10 deg/s): a larger one is a broken gyro.
const LARGEST: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Share of the error below which what is left must be for the bias to help.
const HELPS: f64 = 0.7;

/// A constant bias that explains how an estimate leaves a reference.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BiasFit {
    /// Bias left in the estimate, rad/s, body axes: to be added to what was removed.
    pub bias: Vector3<f64>,
    /// Uncertainty by how parts of the recording agree, rad/s.
    pub sigma: Vector3<f64>,
    /// Windows of a second it is from.
    pub windows: usize,
    /// Median turn of the reference over one, rad.
    pub turn: f64,
    /// Median error of the rotation over a second, rad: with the bias in it, and without.
    pub over_1s: [f64; 2],
    /// Length of the long stretches, s, and the median error over them, rad: with the bias in it, and without.
    pub long_secs: f64,
    /// See [`long_secs`](Self::long_secs).
    pub over_long: [f64; 2],
}

impl BiasFit {
    /// Whether it is a bias, and worth removing: far from nothing by its own uncertainty, not more than gyros have,
    /// and the estimate follows the reference clearly better without it.
    #[must_use]
    pub fn is_worth_removing(&self) -> bool {
        let [before, after] = self.over_long;
        let size = self.bias.norm();
        size > SIGMAS * self.sigma.norm()
            && (SMALLEST..=LARGEST).contains(&size)
            && after < HELPS * before
            && self.over_1s[1] <= self.over_1s[0]
    }
}

/// The constant bias that explains best how `estimate` turns otherwise than `reference`; `None` where fewer than ten
/// seconds can be compared.
#[must_use]
pub fn fit_constant_bias<'r>(
    estimate: &[Stamped],
    reference: impl Into<Reference<'r>>,
) -> Option<BiasFit> {
    let Reference { rows, cuts } = reference.into();
    let (estimate, reference) = (Track::new(estimate), Track::new(rows));
    if estimate.spacing > COARSE {
        return None;
    }
    let parts = reference.parts(cuts);
    let windows: Vec<Window> = parts
        .iter()
        .flat_map(|part| windows(&estimate, part))
        .collect();
    if windows.len() < FEWEST {
        return None;
    }
    let mut bias = Vector3::zeros();
    let mut weights = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    for _ in 0..TURNED_BACK {
        rows = windows.iter().map(|w| w.row(&estimate, &bias)).collect();
        let (more, last) = solve(&rows)?;
        bias += more;
        weights = last;
    }
    let parts = (windows.len() / 4).clamp(4, 16);
    let size = windows.len().div_ceil(parts);
    let found: Vec<Vector3<f64>> = rows
        .chunks(size)
        .zip(weights.chunks(size))
        .filter_map(|(rows, weights)| weighted(rows, weights))
        .collect();
    let n = found.len() as f64;
    if n < 3.0 {
        return None;
    }
    let mean: Vector3<f64> = found.iter().sum::<Vector3<f64>>() / n;
    let squares: Vector3<f64> = found.iter().map(|b| (b - mean).map(|v| v * v)).sum();
    let sigma = (squares / (n * (n - 1.0))).map(f64::sqrt);

    let long = (windows.len() / 6).clamp(2, LONG);
    let errors = |bias: &Vector3<f64>| -> Option<[f64; 2]> {
        let turns: Vec<_> = windows.iter().map(|w| w.turn(&estimate, bias)).collect();
        let each = turns.iter().zip(&windows);
        let mut short: Vec<f64> = each.map(|((q, _), w)| w.truth.angle_to(q)).collect();
        let mut over: Vec<f64> = Vec::new();
        for (turns, windows) in turns.chunks(long).zip(windows.chunks(long)) {
            // Only what hangs together can be strung together.
            let joined = windows.windows(2).all(|w| match w {
                [a, b] => a.end == b.start,
                _ => true,
            });
            if !joined || windows.len() < long {
                continue;
            }
            let mut truth: Quaternion<Body, Body> = Quaternion::identity();
            let mut found = truth;
            for ((turn, _), window) in turns.iter().zip(windows) {
                truth = (truth * window.truth).normalised();
                found = (found * *turn).normalised();
            }
            over.push(truth.angle_to(&found));
        }
        let short_median = quantile(&mut short, 0.5)?;
        // Torn into pieces shorter than that, the seconds must do.
        Some([
            short_median,
            quantile(&mut over, 0.5).unwrap_or(short_median),
        ])
    };
    let mut turned: Vec<f64> = windows
        .iter()
        .map(|w| w.truth.angle_to(&Quaternion::identity()))
        .collect();
    let turn = quantile(&mut turned, 0.5)?;
    let ([short, over], [short_less, over_less]) = (errors(&Vector3::zeros())?, errors(&bias)?);
    Some(BiasFit {
        bias,
        sigma,
        windows: windows.len(),
        turn,
        over_1s: [short, short_less],
        long_secs: long as f64 * WINDOW as f64 * 1e-9,
        over_long: [over, over_less],
    })
}

/// About a second between two samples of the reference.
struct Window {
    start: Nanos,
    end: Nanos,
    /// The reference's turn over it.
    truth: Quaternion<Body, Body>,
    /// The estimate at both ends, and its rows between them.
    ends: [Quaternion<crate::frames::Nav, Body>; 2],
    rows: std::ops::Range<usize>,
}

/// Equation for the bias that a window gives.
struct Row {
    delta: Vector3<f64>,
    by_bias: Matrix3<f64>,
}

fn windows(estimate: &Track<'_>, reference: &Track<'_>) -> Vec<Window> {
    let mut found: Vec<Window> = Vec::new();
    let rows = &reference.rows;
    let (mut at, mut later) = (0, 0);
    // The first estimate later than the window's start.
    let mut place = rows.first().map_or(0, |(start, _)| estimate.until(*start));
    while let Some((start, q_start)) = rows.get(at) {
        at += 1;
        let wanted = start.0.saturating_add(WINDOW);
        later = later.max(at);
        // The last that is not after a second, or the one behind it where that is nearer.
        while rows.get(later + 1).is_some_and(|(t, _)| t.0 <= wanted) {
            later += 1;
        }
        let off = |row: &Stamped| row.0.0.saturating_sub(wanted).saturating_abs();
        let nearest = (later..later + 2)
            .filter_map(|n| Some((n, rows.get(n)?)))
            .min_by_key(|(_, row)| off(row));
        let Some((n, (end, q_end))) = nearest else {
            break;
        };
        if off(&(*end, *q_end)).saturating_mul(4) > WINDOW {
            continue;
        }
        let is_not_after = |n: usize, t: Nanos| estimate.rows.get(n).is_some_and(|r| r.0 <= t);
        while is_not_after(place, *start) {
            place += 1;
        }
        let mut behind = place;
        while is_not_after(behind, *end) {
            behind += 1;
        }
        let (Ok(first), Ok(last)) = (estimate.at(*start, place), estimate.at(*end, behind)) else {
            continue;
        };
        let within = estimate
            .rows
            .get(place.saturating_sub(1)..=behind.min(estimate.rows.len() - 1));
        let is_whole = within.is_some_and(|rows| {
            rows.windows(2).all(|w| match w {
                [a, b] => b.0.since(a.0) <= estimate.spacing.saturating_mul(4),
                _ => true,
            })
        });
        if !is_whole {
            continue;
        }
        found.push(Window {
            start: *start,
            end: *end,
            truth: (q_start.inverse() * *q_end).normalised(),
            ends: [first, last],
            rows: place..behind,
        });
        // The next begins where this ends.
        at = n;
    }
    found
}

impl Window {
    /// The estimate's turn over it with `bias` taken out step by step, and how that turn moves with the bias.
    fn turn(
        &self,
        estimate: &Track<'_>,
        bias: &Vector3<f64>,
    ) -> (Quaternion<Body, Body>, Matrix3<f64>) {
        let mut turned = Quaternion::identity();
        let mut by_bias = Matrix3::zeros();
        let [first, last] = self.ends;
        let (mut t0, mut q0) = (self.start, first);
        let inner = estimate.rows.get(self.rows.clone()).unwrap_or(&[]);
        for (t1, q1) in inner.iter().copied().chain([(self.end, last)]) {
            let secs = t1.secs_since(t0);
            if secs <= 0.0 {
                continue;
            }
            let half = Quaternion::from_rotation_vector(&RotationVector(bias * (-0.5 * secs)));
            let step: Quaternion<Body, Body> = (half * (q0.inverse() * q1) * half).normalised();
            let back = step.to_dcm().as_matrix().transpose();
            by_bias = back * by_bias + (back + Matrix3::identity()) * (0.5 * secs);
            turned = (turned * step).normalised();
            (t0, q0) = (t1, q1);
        }
        (turned, by_bias)
    }

    fn row(&self, estimate: &Track<'_>, bias: &Vector3<f64>) -> Row {
        let (turned, by_bias) = self.turn(estimate, bias);
        let delta = (self.truth.inverse() * turned).same_sign_as(&Quaternion::identity());
        Row {
            delta: delta.rotation_vector().0,
            by_bias,
        }
    }
}

/// Least squares with weights that fall where the residual is beyond the ordinary; and the weights.
fn solve(rows: &[Row]) -> Option<(Vector3<f64>, Vec<f64>)> {
    let mut weights = vec![1.0; rows.len()];
    let mut bias = weighted(rows, &weights)?;
    for _ in 0..REWEIGHTED {
        let left: Vec<f64> = rows
            .iter()
            .map(|row| (row.delta - row.by_bias * bias).norm())
            .collect();
        let ordinary = HUBER * quantile(&mut left.clone(), 0.5)?;
        for (weight, left) in weights.iter_mut().zip(&left) {
            *weight = if *left > ordinary {
                ordinary / left
            } else {
                1.0
            };
        }
        bias = weighted(rows, &weights)?;
    }
    Some((bias, weights))
}

fn weighted(rows: &[Row], weights: &[f64]) -> Option<Vector3<f64>> {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for (row, weight) in rows.iter().zip(weights) {
        normal += row.by_bias.transpose() * row.by_bias * *weight;
        right += row.by_bias.transpose() * row.delta * *weight;
    }
    let bias = normal.try_inverse()? * right;
    bias.iter().all(|v| v.is_finite()).then_some(bias)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::frames::Nav;

    const HZ: i64 = 100;

    fn stamp(i: i64) -> Nanos {
        Nanos(i * 1_000_000_000 / HZ)
    }

    /// A hand's motion about all axes, rad/s.
    fn rate(t: f64) -> Vector3<f64> {
        Vector3::new(
            (0.9 * t).sin(),
            1.2 * (1.7 * t).sin(),
            0.8 * (0.4 * t).cos(),
        )
    }

    /// A minute of it, turned by `more` rad/s too much, step by step.
    fn track(more: impl Fn(f64) -> Vector3<f64>) -> Vec<Stamped> {
        let mut q: Quaternion<Nav, Body> = Quaternion::identity();
        (0..60 * HZ)
            .map(|i| {
                let t = i as f64 / HZ as f64;
                let before = q;
                q = q
                    .advanced(&RotationVector((rate(t) + more(t)) / HZ as f64))
                    .normalised();
                (stamp(i), before)
            })
            .collect()
    }

    #[test]
    fn a_bias_as_large_as_that_of_euroc_is_found_and_leaves_nothing() {
        let bias = Vector3::new(-0.0022, 0.0208, 0.0758);
        let fit = fit_constant_bias(&track(|_| bias), &track(|_| Vector3::zeros())).unwrap();
        // A hundred-thousandth of it: halves of it are taken out at both ends of a step of 10 ms, in which the body turns.
        assert!((fit.bias - bias).norm() < 1e-6, "{fit:?}");
        assert!(fit.is_worth_removing(), "{fit:?}");
        assert!(fit.over_long[0] > 0.3 && fit.over_long[1] < 1e-5, "{fit:?}");
    }

    #[test]
    fn a_reference_that_jumps_does_not_move_it() {
        let bias = Vector3::new(0.01, -0.02, 0.005);
        let mut reference = track(|_| Vector3::zeros());
        // Every tenth second the cameras take the body for another, for a fifth of a second.
        for (i, row) in reference.iter_mut().enumerate() {
            if i % 1000 < 20 {
                row.1 = row
                    .1
                    .advanced(&RotationVector(Vector3::new(1.0, 0.5, -0.7)))
                    .normalised();
            }
        }
        let fit = fit_constant_bias(&track(|_| bias), &reference).unwrap();
        assert!((fit.bias - bias).norm() < 0.02 * bias.norm(), "{fit:?}");
    }

    #[test]
    fn no_bias_is_advised_where_there_is_none() {
        let truth = track(|_| Vector3::zeros());
        let same = fit_constant_bias(&truth, &truth).unwrap();
        assert!(!same.is_worth_removing(), "{same:?}");
        // A scale error of 3 %: large, and no bias.
        let scaled = fit_constant_bias(&track(|t| 0.03 * rate(t)), &truth).unwrap();
        assert!(!scaled.is_worth_removing(), "{scaled:?}");
        // One that changes its sign.
        let turning = |t: f64| Vector3::z() * 0.02 * (0.3 * t).sin();
        let changing = fit_constant_bias(&track(turning), &truth).unwrap();
        assert!(!changing.is_worth_removing(), "{changing:?}");
        // No gyro has 20 deg/s: something else is wrong.
        let wild = fit_constant_bias(&track(|_| Vector3::x() * 0.35), &truth).unwrap();
        assert!(!wild.is_worth_removing(), "{wild:?}");
    }

    #[test]
    fn too_little_is_not_judged() {
        let truth = track(|_| Vector3::zeros());
        assert!(fit_constant_bias(&truth, &truth[..900]).is_none());
        assert!(fit_constant_bias(&[], &truth).is_none());
        assert!(fit_constant_bias(&truth, &[]).is_none());
        let coarse: Vec<Stamped> = truth.iter().copied().step_by(40).collect();
        assert!(fit_constant_bias(&coarse, &truth).is_none());
    }
}
