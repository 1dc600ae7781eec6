//! Legendre moments of the rate over one interval -> its rotation vector, or the turn itself. Pure.
//!
//! Interval of length h, `x` from -1 to 1 along it, `w_nb_b(t) = (1/h) sum_j b_j P_j(x)`:
//! `b_0` is the delta angle, every `b_j` is in rad and of order h^(j+1). The rotation vector is
//! then a closed form in cross products, whatever the samples were and wherever they lay.
//!
//! # Source
//! Magnus 1954; Blanes, Casas, Ros 2000 (time-symmetric truncation); coefficients for Legendre
//! moments as in `attitude.md` 3, checked here against the power series and golden vectors.

use super::lanes::{Lanes, Triple};
use super::method::Order;
use super::series;
use super::turn::Turn;

/// How many moments are carried: b_0 .. b_8.
pub(crate) const MOMENTS: usize = 9;

/// Moments of N neighbouring intervals, and how many of the nine can differ from zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments<const N: usize> {
    pub(crate) b: [Triple<N>; MOMENTS],
    pub(crate) live: usize,
}

impl<const N: usize> Moments<N> {
    pub(crate) const ZERO: Self = Moments {
        b: [Triple::ZERO; MOMENTS],
        live: 1,
    };

    fn lane(&self, i: usize) -> Moments<1> {
        Moments {
            b: self.b.map(|b| b.lane(i)),
            live: self.live,
        }
    }
}

/// The second-order term, exact for any polynomial rate: only neighbours couple.
#[inline(always)]
fn coning_sum<const N: usize>(m: &Moments<N>) -> Triple<N> {
    let mut sum = Triple::ZERO;
    for j in (0..m.live - 1).rev() {
        let weight = 0.5 / ((2 * j + 1) * (2 * j + 3)) as f64;
        sum = sum + m.b[j].cross(m.b[j + 1]) * weight;
    }
    sum
}

#[inline(always)]
fn order4<const N: usize>(m: &Moments<N>) -> Triple<N> {
    m.b[0] + m.b[0].cross(m.b[1]) * (1.0 / 6.0)
}

#[inline(always)]
fn order6<const N: usize>(m: &Moments<N>) -> Triple<N> {
    let [b0, b1, b2, ..] = m.b;
    let u = b0.cross(b1);
    let v = b0.cross(b2);
    let inner = v * (1.0 / 60.0) - b0.cross(u) * (1.0 / 360.0);
    b0 + (coning_sum(m) + (b0.cross(inner) + u.cross(b1) * (1.0 / 60.0)))
}

#[inline(always)]
fn order8<const N: usize>(m: &Moments<N>) -> Triple<N> {
    let [b0, b1, b2, b3, ..] = m.b;
    let u = b0.cross(b1);
    let v = b0.cross(b2);
    let w = b1.cross(b2);
    let y = b0.cross(b3);
    let s = u.cross(b1);
    let r = b0.cross(u);
    let deepest = w * (1.0 / 2520.0) + y * (1.0 / 840.0)
        - b0.cross(v) * (1.0 / 2520.0)
        - s * (1.0 / 2520.0)
        + b0.cross(r) * (1.0 / 15120.0);
    let inner = v * (1.0 / 60.0) - r * (1.0 / 360.0)
        + b1.cross(b3) * (1.0 / 210.0)
        + v.cross(b1) * (1.0 / 420.0)
        + b0.cross(deepest);
    let rest = s * (1.0 / 60.0) + v.cross(b2) * (1.0 / 420.0)
        - y.cross(b1) * (1.0 / 420.0)
        - b1.cross(w) * (1.0 / 210.0)
        + u.cross(v) * (1.0 / 280.0)
        + s.cross(b1) * (1.0 / 840.0)
        + r.cross(u) * (1.0 / 1890.0);
    b0 + (coning_sum(m) + (b0.cross(inner) + rest))
}

/// Moments -> turns, by the order asked for.
#[inline(always)]
pub(crate) fn turn<const N: usize>(m: &Moments<N>, order: Order) -> Turn<N> {
    match order {
        Order::M2 => Turn::exp(m.b[0]),
        Order::M4 => Turn::exp(order4(m)),
        Order::M6 => Turn::exp(order6(m)),
        Order::M8 => Turn::exp(order8(m)),
        Order::Exact => exact(m),
    }
}

/// Order 8 where its truncation is bounded below notice, the power series where it is not.
///
/// # Accuracy
/// Within `1e-16 rad + 1e-4 |b_8|` of the exact solution for the interpolated rate
/// (`|b_8|` counts for windows of 12 samples and more: there the last moment is far below the
/// interpolation's own uncertainty, noise or not). `order8_is_used_only_where_...` sweeps it.
#[inline(always)]
fn exact<const N: usize>(m: &Moments<N>) -> Turn<N> {
    let phi = order8(m);
    let mut turn = Turn::exp(phi);
    let enough = order8_is_enough(m);
    for (i, enough) in enough.into_iter().enumerate() {
        if !enough {
            let exact = series::turn(&m.lane(i));
            turn.c.0[i] = exact.c.0[0];
            turn.v.x.0[i] = exact.v.x.0[0];
            turn.v.y.0[i] = exact.v.y.0[0];
            turn.v.z.0[i] = exact.v.z.0[0];
        }
    }
    turn
}

/// Every term order 8 leaves out has grade (sum of j + 1) nine or more, at least three factors,
/// one of them not b_0. With `|b_j| <= e g^(j+1)` (j > 0), `|b_0| <= g`, `e <= 1`, their sum is
/// below `OMITTED e g^9`; the constant is four times the worst found by search up to g = 0.5.
const OMITTED: f64 = 2.0e-2;

/// What the order-8 truncation may be, besides a share of the last moment, rad.
const UNNOTICED: f64 = 1e-16;
const SHARE: f64 = 1e-4;

#[inline(always)]
fn order8_is_enough<const N: usize>(m: &Moments<N>) -> [bool; N] {
    let n: [Lanes<N>; MOMENTS] = m.b.map(Triple::norm_squared);
    let last = n[MOMENTS - 1].sqrt();
    std::array::from_fn(|i| {
        let allowed = (UNNOTICED + SHARE * last.0[i]) / OMITTED;
        let g = ninth_root_from_below(allowed);
        let g2 = (g * g).max(n[0].0[i]);
        let g4 = g2 * g2;
        let g9 = g4 * g4 * g2.sqrt();
        let e = (allowed / g9).min(1.0);
        let mut limit = e * e * g2;
        let mut fits = g2 <= 0.25;
        for moment in &n[1..] {
            limit *= g2;
            // `e` bounds each b_j on its own, so the largest counts.
            fits &= moment.0[i] <= limit;
        }
        fits
    })
}

/// Between 0.93 and 1 times the ninth root of a positive normal number, without `powf`: dividing
/// the bit pattern divides the logarithm.
#[inline(always)]
fn ninth_root_from_below(x: f64) -> f64 {
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    // ln2-wise the pattern is off by at most 0.0861 at either end: (2^0.0861) / 0.94 >= 1.
    0.94 * f64::from_bits(x.to_bits() / 9 + (ONE - ONE / 9))
}

#[cfg(test)]
mod tests;
