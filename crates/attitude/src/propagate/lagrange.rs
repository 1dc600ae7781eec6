//! Samples at arbitrary instants -> Legendre moments of the rate over one interval. Pure.
//!
//! The polynomial through the samples is evaluated at Gauss nodes of the interval, as Lagrange's sum
//! with prefix and suffix products (no division, nothing special when a node meets a sample, stable
//! to 24 points), and the nodes are summed to moments. A reference value is taken off first, so a
//! constant rate comes through untouched.

use super::difference::FEWER;
use super::magnus::{MOMENTS, Moments};
use crate::lanes::{Lanes, Triple};
use std::ops::Range;

/// Most points an interpolation has: a window of increments has one more knot than increments.
pub(crate) const POINTS: usize = super::method::LARGEST_WINDOW + 1;

/// Gauss nodes on [-1, 1] and the sums that turn values there into moments.
#[derive(Clone, Debug)]
pub(crate) struct Quadrature {
    nodes: usize,
    live: usize,
    g: [f64; MOMENTS],
    /// `[j][n]`: (2j+1)/2 gamma_n P_j(g_n): values of the rate -> b_j / h.
    rate: [[f64; MOMENTS]; MOMENTS],
    /// `[j][n]`: -(2j+1) gamma_n P_j'(g_n): values of the angle, zero at both ends -> b_j, j > 0.
    angle: [[f64; MOMENTS]; MOMENTS],
}

/// P_0 .. P_9 and their derivatives at x.
pub(crate) fn legendre(x: f64) -> ([f64; MOMENTS + 1], [f64; MOMENTS + 1]) {
    let (mut p, mut d) = ([0.0; MOMENTS + 1], [0.0; MOMENTS + 1]);
    (p[0], p[1], d[1]) = (1.0, x, 1.0);
    for j in 1..MOMENTS {
        let n = j as f64;
        p[j + 1] = ((2.0 * n + 1.0) * x * p[j] - n * p[j - 1]) / (n + 1.0);
        d[j + 1] = d[j - 1] + (2.0 * n + 1.0) * p[j];
    }
    (p, d)
}

impl Quadrature {
    /// Makes them for polynomials through `points` points: exact for their moments up to nine points, and for
    /// b_0 .. b_2 up to sixteen; an odd number of nodes, so that one of them is the middle.
    pub(crate) fn new(points: usize) -> Self {
        let live = points.clamp(1, MOMENTS);
        let nodes = live | 1;
        let mut quadrature = Quadrature {
            nodes,
            live,
            g: [0.0; MOMENTS],
            rate: [[0.0; MOMENTS]; MOMENTS],
            angle: [[0.0; MOMENTS]; MOMENTS],
        };
        for n in 0..nodes {
            // Newton from Chebyshev's guess; the middle one is zero exactly.
            let mut x = -(std::f64::consts::PI * (n as f64 + 0.75) / (nodes as f64 + 0.5)).cos();
            if 2 * n + 1 == nodes {
                x = 0.0;
            }
            for _ in 0..8 {
                let (p, d) = legendre(x);
                x -= p[nodes] / d[nodes];
            }
            let (p, d) = legendre(x);
            let gamma = 2.0 / ((1.0 - x * x) * d[nodes] * d[nodes]);
            quadrature.g[n] = x;
            for j in 0..live {
                let weight = (2 * j + 1) as f64;
                quadrature.rate[j][n] = 0.5 * weight * gamma * p[j];
                quadrature.angle[j][n] = -weight * gamma * d[j];
            }
        }
        quadrature
    }

    /// The Gauss nodes, on [-1, 1].
    pub(crate) fn nodes(&self) -> &[f64] {
        &self.g[..self.nodes]
    }

    /// Weights of the values at the nodes in their mean over the interval.
    pub(crate) fn mean_weights(&self) -> &[f64] {
        &self.rate[0][..self.nodes]
    }

    /// Values of the rate at the nodes, interval length in seconds -> moments.
    #[inline(always)]
    pub(crate) fn of_rate<const N: usize>(
        &self,
        values: &[Triple<N>; MOMENTS],
        h: Lanes<N>,
    ) -> Moments<N> {
        let mut m = self.sum(&self.rate, 0, values);
        for b in &mut m.b[..self.live] {
            *b = b.times(h);
        }
        m
    }

    /// Values at the nodes of the angle that vanishes at both ends -> moments without b_0.
    #[inline(always)]
    fn of_angle<const N: usize>(&self, values: &[Triple<N>; MOMENTS]) -> Moments<N> {
        self.sum(&self.angle, 1, values)
    }

    /// Nodes lie symmetric: rows of even polynomials see sums of opposite nodes, odd ones differences.
    #[inline(always)]
    fn sum<const N: usize>(
        &self,
        rows: &[[f64; MOMENTS]; MOMENTS],
        parity: usize,
        values: &[Triple<N>; MOMENTS],
    ) -> Moments<N> {
        let half = self.nodes / 2;
        let mut m = Moments {
            live: self.live,
            ..Moments::ZERO
        };
        for n in 0..half {
            let (left, right) = (values[n], values[self.nodes - 1 - n]);
            let folded = [left + right, left - right];
            for j in 0..self.live {
                m.b[j] = m.b[j] + folded[(j + parity) % 2] * rows[j][n];
            }
        }
        for j in (parity..self.live).step_by(2) {
            m.b[j] = m.b[j] + values[half] * rows[j][half];
        }
        m
    }
}

/// The points of a narrower window: [`FEWER`] samples less, or as many as leave the interval its ends. From
/// both sides, where the window has them to lose. The interval ends at sample `place` of the window.
pub(crate) fn inner(window: usize, place: usize, increments: bool) -> Range<usize> {
    let (smallest, points, ahead, behind) = if increments {
        (1, window + 1, window - 1 - place, place)
    } else {
        (2, window, window - 1 - place, place - 1)
    };
    let fewer = FEWER.min(window.saturating_sub(smallest));
    let newer = (FEWER / 2)
        .min(ahead)
        .max(fewer.saturating_sub(behind))
        .min(fewer);
    fewer - newer..points - newer
}

/// A polynomial: its values at the Gauss nodes; its noise gain, the sum of squares of Lagrange's coefficients at
/// mid-interval (1/2 for the mean of two samples); and these coefficients.
struct AtNodes<const N: usize, const P: usize> {
    values: [Triple<N>; MOMENTS],
    gain: Lanes<N>,
    coefficient: [Lanes<N>; P],
}

/// The polynomial through at most P points `(x_i, f_i)`.
#[inline(always)]
fn at_nodes<const N: usize, const P: usize>(
    x: &[Lanes<N>],
    f: &[Triple<N>],
    quadrature: &Quadrature,
) -> AtNodes<N, P> {
    let p = x.len().min(P);
    let (x, f) = (&x[..p], &f[..p]);
    let mut product = [Lanes::<N>::splat(1.0); P];
    for i in 0..p {
        let mut own = product[i];
        for j in i + 1..p {
            let d = x[i] - x[j];
            own = own * d;
            product[j] = product[j] * d;
        }
        // Lower half of the product came with the opposite sign i times.
        product[i] = if i % 2 == 0 { own } else { -own };
    }
    let mut weight = [Lanes::<N>::ZERO; P];
    let mut weighted = [Triple::<N>::ZERO; P];
    for i in 0..p {
        weight[i] = product[i].recip();
        weighted[i] = f[i].times(weight[i]);
    }
    let mut at = AtNodes {
        values: [Triple::ZERO; MOMENTS],
        gain: Lanes::ZERO,
        coefficient: [Lanes::ZERO; P],
    };
    let middle = quadrature.nodes / 2;
    let mut suffix = [Lanes::<N>::splat(1.0); P];
    for (n, &g) in quadrature.nodes().iter().enumerate() {
        let g = Lanes::splat(g);
        for i in (1..p).rev() {
            suffix[i - 1] = suffix[i] * (g - x[i]);
        }
        let mut prefix = Lanes::splat(1.0);
        let mut value = Triple::ZERO;
        for i in 0..p {
            let l = prefix * suffix[i];
            value = value + weighted[i].times(l);
            suffix[i] = l;
            prefix = prefix * (g - x[i]);
        }
        at.values[n] = value;
        if n == middle {
            for i in 0..p {
                let l = suffix[i] * weight[i];
                at.gain = at.gain + l * l;
                at.coefficient[i] = l;
            }
        }
        if let Some(last) = suffix[..p].last_mut() {
            *last = Lanes::splat(1.0);
        }
    }
    at
}

/// Value at mid-interval, where x = 0, by the points `inner` alone, which differ where lanes share one window.
#[inline(always)]
fn narrower<const N: usize, const P: usize>(
    x: &[Lanes<N>],
    f: &[Triple<N>],
    coefficient: &[Lanes<N>; P],
    inner: &[Range<usize>; N],
) -> Triple<N> {
    if inner.iter().all(|range| *range == inner[0]) {
        return narrower_by(x, f, coefficient, &inner[0]);
    }
    Triple::of_lanes(|lane| {
        let (mut own_x, mut own_f) = ([Lanes::ZERO; P], [Triple::ZERO; P]);
        for i in 0..x.len().min(P) {
            (own_x[i], own_f[i]) = (Lanes([x[i].0[lane]]), f[i].lane(lane));
        }
        let coefficient = coefficient.map(|c| Lanes([c.0[lane]]));
        narrower_by(&own_x[..x.len().min(P)], &own_f, &coefficient, &inner[lane])
    })
}

/// The same by one range of points.
#[inline(always)]
fn narrower_by<const N: usize>(
    x: &[Lanes<N>],
    f: &[Triple<N>],
    coefficient: &[Lanes<N>],
    inner: &Range<usize>,
) -> Triple<N> {
    let p = x.len().min(coefficient.len());
    let outer = || (0..inner.start).chain(inner.end..p);
    let mut reciprocal = [Lanes::<N>::ZERO; FEWER];
    for (reciprocal, j) in reciprocal.iter_mut().zip(outer()) {
        *reciprocal = x[j].recip();
    }
    let mut narrow = Triple::ZERO;
    for i in inner.clone() {
        let mut without = coefficient[i];
        for (reciprocal, _) in reciprocal.iter().zip(outer()) {
            without = without * (Lanes::splat(1.0) - x[i] * *reciprocal);
        }
        narrow = narrow + f[i].times(without);
    }
    narrow
}

/// Moments over an interval of `h` seconds from rates at `x` (interval from -1 to 1), and the noise gain.
///
/// `reference` should be near the rates: only differences from it meet rounding.
#[inline(always)]
pub(crate) fn from_rates<const N: usize, const P: usize>(
    x: &[Lanes<N>],
    rates: &mut [Triple<N>],
    reference: Triple<N>,
    h: Lanes<N>,
    inner: &[Range<usize>; N],
    quadrature: &Quadrature,
) -> (Moments<N>, Lanes<N>) {
    for rate in rates.iter_mut() {
        *rate = *rate - reference;
    }
    let at = at_nodes::<N, P>(x, rates, quadrature);
    let difference = at.values[quadrature.nodes / 2] - narrower(x, rates, &at.coefficient, inner);
    let mut m = quadrature.of_rate(&at.values, h);
    m.b[0] = m.b[0] + reference.times(h);
    // Both polynomials pass through the ends of the interval: between them they differ by about a parabola.
    m.outer = difference.times(h) * (2.0 / 3.0);
    (m, at.gain)
}

/// Moments over the interval of increment `own` from contiguous increments between the knots `x`
/// (one more than increments), and the noise gain. The delta angle itself passes untouched.
#[inline(always)]
pub(crate) fn from_increments<const N: usize, const P: usize>(
    x: &[Lanes<N>],
    increments: &[Triple<N>],
    own: usize,
    inner: &[Range<usize>; N],
    quadrature: &Quadrature,
) -> (Moments<N>, Lanes<N>) {
    let count = increments.len().min(P - 1);
    let delta = increments[own];
    // The angle beyond what a constant rate would have made; it vanishes at both ends of the interval.
    let mut angle = [Triple::<N>::ZERO; P];
    let surplus = |i: usize| increments[i] - delta.times((x[i + 1] - x[i]) * 0.5);
    for i in own + 1..count {
        angle[i + 1] = angle[i] + surplus(i);
    }
    for i in (0..own).rev() {
        angle[i] = angle[i + 1] - surplus(i);
    }
    let angle = &angle[..=count];
    let at = at_nodes::<N, P>(x, angle, quadrature);
    let difference = at.values[quadrature.nodes / 2] - narrower(x, angle, &at.coefficient, inner);
    let mut m = quadrature.of_angle(&at.values);
    m.live = m.live.min(count.max(1));
    m.b[0] = delta;
    m.outer = difference * (2.0 / 3.0);
    (m, at.gain)
}

#[cfg(test)]
mod tests;
