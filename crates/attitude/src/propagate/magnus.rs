//! Legendre moments of the rate over one interval -> its rotation vector, or the turn itself. Pure.
//!
//! Interval of length h, `x` from -1 to 1 along it, `w_nb_b(t) = (1/h) sum_j b_j P_j(x)`:
//! `b_0` is the delta angle, every `b_j` is in rad and of order h^(j+1). The rotation vector is
//! then a closed form in cross products, whatever the samples were and wherever they lay.
//!
//! # Source
//! Magnus 1954; Blanes, Casas, Ros 2000 (time-symmetric truncation); coefficients for Legendre
//! moments as in `docs/theory/attitude.md` 3, checked here against the power series and golden vectors.

use super::method::Order;
use super::series;
use super::turn::Turn;
use crate::lanes::{Lanes, Triple};

/// Number of moments carried: b_0 .. b_8.
pub(crate) const MOMENTS: usize = 9;

/// Moments of N neighbouring intervals, and how many of the nine can differ from zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments<const N: usize> {
    pub(crate) b: [Triple<N>; MOMENTS],
    pub(crate) live: usize,
    /// Change by the outermost samples of the window, rad, in the middle of the interval:
    /// of the delta angle from rates, of two thirds of the angle half-way from increments.
    pub(crate) outer: Triple<N>,
}

impl<const N: usize> Moments<N> {
    pub(crate) const ZERO: Self = Moments {
        b: [Triple::ZERO; MOMENTS],
        live: 1,
        outer: Triple::ZERO,
    };

    #[inline(always)]
    fn lane(&self, i: usize) -> Moments<1> {
        Moments {
            b: self.b.map(|b| b.lane(i)),
            live: self.live,
            outer: self.outer.lane(i),
        }
    }
}

impl Moments<1> {
    /// Moments of this interval and of another, side by side; of windows with as many points.
    #[inline(always)]
    pub(crate) fn beside(&self, other: &Moments<1>) -> Moments<2> {
        let pair = |a: Triple<1>, b: Triple<1>| Triple::of_lanes(|lane| [a, b][lane]);
        Moments {
            b: std::array::from_fn(|j| pair(self.b[j], other.b[j])),
            live: self.live,
            outer: pair(self.outer, other.outer),
        }
    }
}

/// The second-order term, exact for any polynomial rate: only neighbours couple.
#[inline(always)]
fn coning_sum<const N: usize>(m: &Moments<N>) -> Triple<N> {
    let mut sum = Triple::ZERO;
    for j in (0..m.live - 1).rev() {
        add_cross(&mut sum, &m.b[j], &m.b[j + 1], CONING[j]);
    }
    sum
}

/// Adds a weighted cross product.
// Called, since in the loop the compiler keeps each moment for the next product, and takes lanes apart for it.
#[inline(never)]
fn add_cross<const N: usize>(sum: &mut Triple<N>, a: &Triple<N>, b: &Triple<N>, weight: f64) {
    *sum = *sum + a.cross(*b) * weight;
}

/// Weights of the coning sum: 1/2 / ((2j + 1)(2j + 3)).
const CONING: [f64; MOMENTS - 1] = {
    let mut weights = [0.0; MOMENTS - 1];
    let mut j = 0;
    while j < MOMENTS - 1 {
        weights[j] = 0.5 / ((2 * j + 1) * (2 * j + 3)) as f64;
        j += 1;
    }
    weights
};

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
    let deepest =
        w * (1.0 / 2520.0) + y * (1.0 / 840.0) - b0.cross(v) * (1.0 / 2520.0) - s * (1.0 / 2520.0)
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

/// Order 8 where its truncation is bounded below notice; otherwise over halves of the interval, where
/// the bound is some 500 times smaller, or quarters, or eighths; at last the power series.
///
/// # Accuracy
/// Within `1e-16 rad + 1e-14 |b_0| + 1e-3 |b_8|` of the exact solution for the interpolated rate (sizes
/// as sums of components), and on motion and noise of gyros some hundred times closer, for the bound
/// assumes the worst directions. `b_8` is zero for windows of fewer than nine samples. For wider ones a
/// thousandth of it is far below what the interpolation itself leaves open: on smooth data below
/// 1e-16 rad, and on noise a 1e-8th of what the noise turns. `exact_is_as_exact_as_it_says` sweeps it.
#[inline(always)]
fn exact<const N: usize>(m: &Moments<N>) -> Turn<N> {
    let allowed = allowed(m);
    let whole = left_out(m);
    let mut turn = Turn::exp(order8(m));
    if (0..N).all(|i| whole.0[i] <= allowed.0[i]) {
        return turn;
    }
    let (left, right) = halves(m);
    let halved = left_out(&left) + left_out(&right);
    let (first, second) = (Turn::exp(order8(&left)), Turn::exp(order8(&right)));
    for i in 0..N {
        // NaN is never small enough: it goes the long way, to be seen and refused.
        if whole.0[i] <= allowed.0[i] {
            continue;
        }
        let finer = if halved.0[i] <= allowed.0[i] {
            first.lane(i).then(second.lane(i))
        } else {
            divided(&left.lane(i), 0.5 * allowed.0[i], 2)
                .and_then(|first| Some(first.then(divided(&right.lane(i), 0.5 * allowed.0[i], 2)?)))
                .unwrap_or_else(|| series::turn(&m.lane(i)))
        };
        turn.set(i, finer);
    }
    turn
}

/// Order 8 over as many pieces as it takes, none if that would be more than 2^depth.
fn divided(m: &Moments<1>, allowed: f64, depth: u32) -> Option<Turn<1>> {
    if left_out(m).0[0] <= allowed {
        return Some(Turn::exp(order8(m)));
    }
    if depth == 0 {
        return None;
    }
    let (left, right) = halves(m);
    let first = divided(&left, 0.5 * allowed, depth - 1)?;
    Some(first.then(divided(&right, 0.5 * allowed, depth - 1)?))
}

/// Moments over the first and the second half of the interval.
#[inline(always)]
pub(crate) fn halves<const N: usize>(m: &Moments<N>) -> (Moments<N>, Moments<N>) {
    let (mut left, mut right) = (*m, *m);
    for j in 0..m.live {
        // P_k((x +- 1)/2) in Legendre polynomials of x; the two signs differ where k - j is odd.
        let (mut even, mut odd) = (m.b[j] * HALVED[j][j], Triple::ZERO);
        for k in j + 1..m.live {
            if (k - j) % 2 == 0 {
                even = even + m.b[k] * HALVED[j][k];
            } else {
                odd = odd + m.b[k] * HALVED[j][k];
            }
        }
        left.b[j] = even - odd;
        right.b[j] = even + odd;
    }
    (left, right)
}

/// Row j, column k: half the coefficient of P_j(x) in P_k((x + 1)/2), the share of b_k in b_j of the
/// second half. Computed once, by the compiler: every entry is a dyadic fraction, so it is exact.
const HALVED: [[f64; MOMENTS]; MOMENTS] = {
    // Columns by the three-term recurrence (k+1) P_k+1(y) = (2k+1) y P_k(y) - k P_k-1(y), where
    // y = (x+1)/2 and x P_j = ((j+1) P_j+1 + j P_j-1)/(2j+1).
    let mut columns = [[0.0; MOMENTS + 1]; MOMENTS];
    columns[0][0] = 1.0;
    columns[1][0] = 0.5;
    columns[1][1] = 0.5;
    let mut k = 1;
    while k + 1 < MOMENTS {
        let mut j = 0;
        while j <= k + 1 {
            let mut times_x = if j > 0 {
                columns[k][j - 1] * j as f64 / (2 * j - 1) as f64
            } else {
                0.0
            };
            if j < MOMENTS {
                times_x += columns[k][j + 1] * (j + 1) as f64 / (2 * j + 3) as f64;
            }
            let times_y = 0.5 * (times_x + columns[k][j]);
            columns[k + 1][j] =
                ((2 * k + 1) as f64 * times_y - k as f64 * columns[k - 1][j]) / (k + 1) as f64;
            j += 1;
        }
        k += 1;
    }
    let mut rows = [[0.0; MOMENTS]; MOMENTS];
    let mut j = 0;
    while j < MOMENTS {
        let mut k = 0;
        while k < MOMENTS {
            rows[j][k] = 0.5 * columns[k][j];
            k += 1;
        }
        j += 1;
    }
    rows
};

/// Largest cost of truncation, see [`exact`], rad.
#[inline(always)]
fn allowed<const N: usize>(m: &Moments<N>) -> Lanes<N> {
    m.b[MOMENTS - 1].size() * SHARE + m.b[0].size() * RELATIVE + Lanes::splat(UNNOTICED)
}

const UNNOTICED: f64 = 1e-16;
const RELATIVE: f64 = 1e-14;
const SHARE: f64 = 1e-3;

/// A bound on what order 8 leaves out, rad; infinite where all sizes together exceed one radian.
///
/// Left out are brackets of n = 3, 4, .. moments whose indices sum to at least 9 - n (docs/theory/attitude.md 3:
/// grade nine and more). A bracket of n moments is bounded by the product of their sizes, whatever
/// their directions; `s[k]` is the sum of sizes from b_k on, so each product below covers every
/// combination of that shape. The constants are three times the largest ratios a search found for
/// each shape (`the_bound_on_what_order_8_leaves_out_holds`).
#[inline(always)]
fn left_out<const N: usize>(m: &Moments<N>) -> Lanes<N> {
    let size = m.b.map(Triple::size);
    let s4 = (size[4] + size[5]) + (size[6] + size[7]) + size[8];
    let s3 = s4 + size[3];
    let s2 = s3 + size[2];
    let s1 = s2 + size[1];
    let b = s1 + size[0];
    let (s13, s22) = (s1 * s3, s2 * s2);
    let s12 = s1 * s2;
    let s11 = s1 * s1;
    let third = b * (s2 * s4 + s3 * s3) + s12 * s3 + s11 * s4;
    let fourth = b * (b * (s1 * s4 + s2 * s3) + s1 * (s13 + s22)) + s11 * s12;
    let fifth = b * (b * (b * (b * s4 + (s13 + s22)) + s11 * s2) + s11 * s11);
    let b3 = b * b * b;
    let sixth = b3 * (b * (b * s3 + s12) + s11 * s1);
    let seventh = b3 * (b * b * (b * s2 + s11));
    let eighth = b3 * (b3 * (b * s1));
    let bound = third * BRACKETS[0]
        + fourth * BRACKETS[1]
        + fifth * BRACKETS[2]
        + sixth * BRACKETS[3]
        + seventh * BRACKETS[4]
        + eighth * BRACKETS[5];
    Lanes(std::array::from_fn(|i| {
        if b.0[i] <= 1.0 {
            bound.0[i]
        } else {
            f64::INFINITY
        }
    }))
}

/// Limits by number of moments in the bracket, from three.
const BRACKETS: [f64; 6] = [5e-3, 2e-3, 1.2e-3, 1e-3, 2e-4, 5e-5];

#[cfg(test)]
mod tests;
