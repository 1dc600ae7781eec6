//! Samples at one constant spacing -> Legendre moments. Pure.
//!
//! With equal spacings the map from samples to moments is a constant; with the interval in the middle
//! of its window it splits in two halves: even moments see sums of samples left and right, odd ones
//! differences. The tables come from the general path, so both agree to rounding by construction.

use super::lagrange::{self, POINTS, Quadrature};
use super::magnus::{MOMENTS, Moments};
use crate::lanes::{Lanes, Triple};

const EVEN: usize = 5;
const ODD: usize = 4;

/// Contribution of each sample of a window to each moment, in a run of 1s between equal spacings.
fn response(window: usize, place: usize, increments: bool) -> (Vec<Moments<1>>, f64) {
    let mut noise_gain = 0.0;
    let inner = [lagrange::inner(window, place, increments)];
    let rows = (0..window)
        .map(|i| {
            let mut unit = vec![Triple::ZERO; window];
            unit[i] = Triple::new(1.0, 0.0, 0.0);
            // In half spacings, the interval from -1 to 1.
            let at = |i: usize, end: usize| Lanes([2.0 * i as f64 - 2.0 * end as f64 + 1.0]);
            let (m, gain) = if increments {
                let x: Vec<Lanes<1>> = (0..=window).map(|i| at(i, place + 1)).collect();
                lagrange::from_increments::<1, POINTS>(
                    &x,
                    &unit,
                    place,
                    &inner,
                    &Quadrature::new(window + 1),
                )
            } else {
                let x: Vec<Lanes<1>> = (0..window).map(|i| at(i, place)).collect();
                let (one, zero) = (Lanes([1.0]), Triple::ZERO);
                lagrange::from_rates::<1, POINTS>(
                    &x,
                    &mut unit,
                    zero,
                    one,
                    &inner,
                    &Quadrature::new(window),
                )
            };
            noise_gain = gain.0[0];
            m
        })
        .collect();
    (rows, noise_gain)
}

/// Moments about one axis, and what the outermost samples have changed.
type Axis<const N: usize> = ([Lanes<N>; MOMENTS], Lanes<N>);

#[inline(always)]
fn moments<const N: usize>(live: usize, [x, y, z]: [Axis<N>; 3]) -> Moments<N> {
    let triple = |x, y, z| Triple { x, y, z };
    Moments {
        b: std::array::from_fn(|j| triple(x.0[j], y.0[j], z.0[j])),
        live,
        outer: triple(x.1, y.1, z.1),
    }
}

/// Coefficients of one pair of samples, symmetric about the interval.
#[derive(Clone, Copy, Debug)]
struct Pair {
    even: [f64; EVEN],
    odd: [f64; ODD],
    outer: f64,
}

/// The constant map of a centred window.
#[derive(Clone, Debug)]
pub(crate) struct Centred {
    live: usize,
    increments: bool,
    /// The innermost pair (of an odd window of increments: the interval's own increment, twice).
    left: usize,
    right: usize,
    inner_odd: [f64; ODD],
    /// The others, outwards.
    pairs: Vec<Pair>,
}

impl Centred {
    /// Makes the table for instantaneous rates; `window` even, 2 or more.
    pub(crate) fn for_rates(window: usize) -> Self {
        Self::assemble(window, window / 2 - 1, window / 2, false)
    }

    /// Makes the table for increments; `window` odd.
    pub(crate) fn for_increments(window: usize) -> Self {
        Self::assemble(window, window / 2, window / 2, true)
    }

    fn assemble(window: usize, left: usize, right: usize, increments: bool) -> Self {
        let (rows, _) = response(window, right, increments);
        let even = |i: usize| std::array::from_fn(|k| rows[i].b[2 * k].x.0[0]);
        let odd = |i: usize| std::array::from_fn(|k| rows[i].b[2 * k + 1].x.0[0]);
        Centred {
            live: rows[0].live,
            increments,
            left,
            right,
            inner_odd: odd(right),
            pairs: (1..=left)
                .map(|k| Pair {
                    even: even(right + k),
                    odd: odd(right + k),
                    outer: rows[right + k].outer.x.0[0],
                })
                .collect(),
        }
    }

    /// Moments of N neighbouring intervals: `x`, `y`, `z` begin with the first one's window and hold
    /// `window + N - 1` samples. For rates times `h`; increments take `h = 1`.
    #[inline(always)]
    pub(crate) fn moments<const N: usize>(&self, xyz: [&[f64]; 3], h: Lanes<N>) -> Moments<N> {
        match self.increments {
            true => moments(self.live, xyz.map(|v| self.axis::<N, true>(v, h))),
            false => moments(self.live, xyz.map(|v| self.axis::<N, false>(v, h))),
        }
    }

    #[inline(always)]
    fn axis<const N: usize, const INCREMENTS: bool>(&self, v: &[f64], h: Lanes<N>) -> Axis<N> {
        let at = |v: &[f64]| -> Lanes<N> {
            let v = &v[..N];
            Lanes(std::array::from_fn(|k| v[k]))
        };
        let (l, r) = (at(&v[self.left..]), at(&v[self.right..]));
        let inner = l + r;
        let slope = r - l;
        // The pairs outwards: each begins one further to the left, and to the right.
        let lefts = v[..self.left + N - 1].windows(N).rev();
        let rights = v[self.right + 1..].windows(N);
        let pairs = || self.pairs.iter().zip(lefts.clone().zip(rights.clone()));
        let mut even = [Lanes::<N>::ZERO; EVEN];
        let mut outer = Lanes::<N>::ZERO;
        for (pair, (left, right)) in pairs() {
            let sum = (at(left) + at(right)) - inner;
            if !INCREMENTS {
                outer = outer + sum * pair.outer;
            }
            for k in 0..EVEN {
                even[k] = even[k] + sum * pair.even[k];
            }
        }
        let mut odd = self.inner_odd.map(|c| slope * c);
        for (pair, (left, right)) in pairs() {
            let difference = at(right) - at(left);
            if INCREMENTS {
                outer = outer + difference * pair.outer;
            }
            for k in 0..ODD {
                odd[k] = odd[k] + difference * pair.odd[k];
            }
        }
        // Constants have no moment but b_0: taking the inner pair off the others left all else alone.
        even[0] = even[0] + inner * 0.5;
        let b = std::array::from_fn(|j| h * if j % 2 == 0 { even[j / 2] } else { odd[j / 2] });
        (b, outer * h)
    }
}

/// The constant map of a window in which the interval lies anywhere.
#[derive(Clone, Debug)]
pub(crate) struct Skewed {
    live: usize,
    /// Sample at the end of the interval.
    place: usize,
    increments: bool,
    /// Noise gain of the window, as the general path gives it.
    pub(crate) gain: f64,
    rows: Vec<([f64; MOMENTS], f64)>,
}

impl Skewed {
    /// Makes the table for instantaneous rates, the interval ending at sample `place` of the window, 1 or more.
    pub(crate) fn for_rates(window: usize, place: usize) -> Self {
        Self::assemble(window, place, false)
    }

    /// Makes the table for increments, of which `place` is the interval's own.
    pub(crate) fn for_increments(window: usize, place: usize) -> Self {
        Self::assemble(window, place, true)
    }

    fn assemble(window: usize, place: usize, increments: bool) -> Self {
        let (rows, gain) = response(window, place, increments);
        Skewed {
            live: rows[0].live,
            place,
            increments,
            gain,
            rows: rows
                .iter()
                .map(|m| (m.b.map(|b| b.x.0[0]), m.outer.x.0[0]))
                .collect(),
        }
    }

    /// Same as [`Centred::moments`].
    #[inline(always)]
    pub(crate) fn moments<const N: usize>(&self, xyz: [&[f64]; 3], h: Lanes<N>) -> Moments<N> {
        moments(self.live, xyz.map(|v| self.axis(v, h)))
    }

    #[inline(always)]
    fn axis<const N: usize>(&self, v: &[f64], h: Lanes<N>) -> Axis<N> {
        let at = |i: usize| -> Lanes<N> {
            let v = &v[i..i + N];
            Lanes(std::array::from_fn(|k| v[k]))
        };
        // Constants have no moment but b_0, so a reference near the values may be taken off them.
        let reference = if self.increments {
            at(self.place)
        } else {
            (at(self.place - 1) + at(self.place)) * 0.5
        };
        let mut moments = [Lanes::<N>::ZERO; MOMENTS];
        let mut outer = Lanes::<N>::ZERO;
        for (i, (row, own)) in self.rows.iter().enumerate() {
            let difference = at(i) - reference;
            outer = outer + difference * *own;
            // Rows are zero beyond `live`. The fixed count unrolls: 6 to 9 % fewer instructions for `commit`,
            // 6 % more for a causal window of 5.
            for j in 0..MOMENTS {
                moments[j] = moments[j] + difference * row[j];
            }
        }
        moments[0] = moments[0] + reference;
        (moments.map(|m| m * h), outer * h)
    }
}
