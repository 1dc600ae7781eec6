//! Increments with holes between them -> Legendre moments of the rate over any interval. Pure.
//!
//! Where increments do not join, their sum is no longer a function that could be interpolated. Instead
//! the polynomial rate is solved for whose integrals over the recorded intervals are the increments
//! (`docs/theory/attitude.md` 3.2), in Legendre polynomials over the whole window, which keeps the system mild.

use super::columns::{Track, secs};
use super::lagrange::{Quadrature, legendre};
use super::magnus::{MOMENTS, Moments};
use crate::lanes::{Lanes, Triple};

/// Unknowns at most: enough beside a hole, where more would only amplify noise (docs/theory/attitude.md 6.4).
pub(crate) const UNKNOWNS: usize = 9;

/// Moments over `target` (nanoseconds from, to) from increments `first .. first + count` of the track,
/// of which the [`UNKNOWNS`] nearest count. Moments of a mean rate where the system has no solution.
pub(crate) fn moments(
    track: &Track,
    first: usize,
    count: usize,
    target: (i64, i64),
    quadrature: &Quadrature,
) -> Moments<1> {
    let excess = count.saturating_sub(UNKNOWNS);
    let (first, count) = (first + excess / 2, count - excess);
    let (a, b) = (track.start[first], track.stamp[first + count - 1]);
    // An increment without length can only be the first of a run, and is never in a window.
    let mut rows = [[0.0; UNKNOWNS + 3]; UNKNOWNS];
    let half_span = 0.5 * secs(b.saturating_sub(a));
    for (row, k) in rows.iter_mut().zip(first..first + count) {
        let from = integrals(Track::coordinate(track.start[k], a, b));
        let to = integrals(Track::coordinate(track.stamp[k], a, b));
        for j in 0..count {
            row[j] = to[j] - from[j];
        }
        let rhs = track.value(k);
        (row[count], row[count + 1], row[count + 2]) = (rhs.x.0[0], rhs.y.0[0], rhs.z.0[0]);
        // Rows of like size, so that pivoting compares like with like.
        let scale = 1.0 / row[0];
        for value in &mut row[..count + 3] {
            *value *= scale;
        }
    }
    let h = secs(target.1.saturating_sub(target.0));
    let Some(c) = solve(&mut rows, count) else {
        let k = first + count / 2;
        let mut flat = Moments::ZERO;
        flat.b[0] = track.rate(k) * h;
        return flat;
    };
    let from = Track::coordinate(target.0, a, b);
    let to = Track::coordinate(target.1, a, b);
    let mut values = [Triple::ZERO; MOMENTS];
    for (value, g) in values.iter_mut().zip(quadrature.nodes()) {
        let (p, _) = legendre(0.5 * ((to - from) * g + (to + from)));
        for (j, c) in c[..count].iter().enumerate() {
            *value = *value + *c * p[j];
        }
        *value = *value * (1.0 / half_span);
    }
    quadrature.of_rate(&values, Lanes([h]))
}

/// Integrals of P_0 .. from -1 to x.
fn integrals(x: f64) -> [f64; UNKNOWNS] {
    let (p, _) = legendre(x);
    std::array::from_fn(|j| {
        if j == 0 {
            x + 1.0
        } else {
            (p[j + 1] - p[j - 1]) / (2 * j + 1) as f64
        }
    })
}

/// Gauss with row pivoting; `None` when the system is singular to rounding or not finite.
fn solve(rows: &mut [[f64; UNKNOWNS + 3]; UNKNOWNS], n: usize) -> Option<[Triple<1>; UNKNOWNS]> {
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs()))?;
        rows.swap(k, pivot);
        let top = rows[k];
        if top[k].abs() < 1e-13 || !top[k].is_finite() {
            return None;
        }
        for row in &mut rows[k + 1..n] {
            let factor = row[k] / top[k];
            for j in k..n + 3 {
                row[j] -= factor * top[j];
            }
        }
    }
    let mut c = [Triple::ZERO; UNKNOWNS];
    for k in (0..n).rev() {
        let row = &rows[k];
        let mut sum = Triple::new(row[n], row[n + 1], row[n + 2]);
        for j in k + 1..n {
            sum = sum - c[j] * row[j];
        }
        c[k] = sum * (1.0 / row[k]);
    }
    c.iter().all(|c| c.norm().is_finite()).then_some(c)
}
