//! Samples at one constant spacing -> Legendre moments. Pure.
//!
//! With equal spacings the map from samples to moments is a constant; with the interval in the middle
//! of its window it splits in two halves: even moments see sums of samples left and right, odd ones
//! differences. The table comes from the general path, so both agree to rounding by construction.

use super::lagrange::{self, Quadrature};
use super::lanes::{Lanes, Triple};
use super::magnus::{MOMENTS, Moments};

const EVEN: usize = 5;
const ODD: usize = 4;

/// Coefficients of one pair of samples, `distance` to either side.
#[derive(Clone, Copy, Debug)]
struct Pair {
    left: usize,
    right: usize,
    even: [f64; EVEN],
    odd: [f64; ODD],
}

/// The constant map of a centred window.
#[derive(Clone, Debug)]
pub(crate) struct Centred {
    live: usize,
    /// The innermost pair (of an odd window of increments: the interval's own increment, twice).
    left: usize,
    right: usize,
    inner_odd: [f64; ODD],
    pairs: Vec<Pair>,
}

fn split(m: &Moments<1>, sign: f64) -> ([f64; EVEN], [f64; ODD]) {
    let b = |j: usize| sign * m.b[j].x.0[0];
    (
        std::array::from_fn(|k| b(2 * k)),
        std::array::from_fn(|k| b(2 * k + 1)),
    )
}

impl Centred {
    /// For instantaneous rates; `window` even, 2 or more.
    pub(crate) fn for_rates(window: usize) -> Self {
        let quadrature = Quadrature::new(window);
        let x: Vec<Lanes<1>> = (0..window)
            .map(|i| Lanes([2.0 * i as f64 - (window - 1) as f64]))
            .collect();
        let response = |i: usize| {
            let mut unit = vec![Triple::ZERO; window];
            unit[i] = Triple::new(1.0, 0.0, 0.0);
            let one = Lanes([1.0]);
            let (m, _) = lagrange::from_rates(&x, &mut unit, Triple::ZERO, one, &quadrature);
            split(&m, 1.0)
        };
        Self::assemble(window, window / 2 - 1, window / 2, response)
    }

    /// For increments; `window` odd.
    pub(crate) fn for_increments(window: usize) -> Self {
        let quadrature = Quadrature::new(window + 1);
        let own = window / 2;
        let x: Vec<Lanes<1>> = (0..=window)
            .map(|i| Lanes([2.0 * i as f64 - window as f64]))
            .collect();
        let response = |i: usize| {
            let mut unit = vec![Triple::ZERO; window];
            unit[i] = Triple::new(1.0, 0.0, 0.0);
            let (m, _) = lagrange::from_increments(&x, &unit, own, &quadrature);
            split(&m, 1.0)
        };
        Self::assemble(window, own, own, response)
    }

    fn assemble(
        window: usize,
        left: usize,
        right: usize,
        response: impl Fn(usize) -> ([f64; EVEN], [f64; ODD]),
    ) -> Self {
        let pairs = (1..=left)
            .map(|k| {
                let (even, odd) = response(right + k);
                Pair {
                    left: left - k,
                    right: right + k,
                    even,
                    odd,
                }
            })
            .collect();
        Centred {
            live: window.min(MOMENTS),
            left,
            right,
            inner_odd: response(right).1,
            pairs,
        }
    }

    /// Moments of N neighbouring intervals: `x`, `y`, `z` begin with the first one's window and hold
    /// `window + N - 1` samples. For rates times `h`; increments take `h = 1`.
    #[inline(always)]
    pub(crate) fn moments<const N: usize>(
        &self,
        x: &[f64],
        y: &[f64],
        z: &[f64],
        h: Lanes<N>,
    ) -> Moments<N> {
        let x = self.axis(x, h);
        let y = self.axis(y, h);
        let z = self.axis(z, h);
        Moments {
            b: std::array::from_fn(|j| Triple {
                x: x[j],
                y: y[j],
                z: z[j],
            }),
            live: self.live,
        }
    }

    #[inline(always)]
    fn axis<const N: usize>(&self, v: &[f64], h: Lanes<N>) -> [Lanes<N>; MOMENTS] {
        let at = |i: usize| -> Lanes<N> {
            let v = &v[i..i + N];
            Lanes(std::array::from_fn(|k| v[k]))
        };
        let (l, r) = (at(self.left), at(self.right));
        let inner = l + r;
        let slope = r - l;
        let mut even = [Lanes::<N>::ZERO; EVEN];
        for pair in &self.pairs {
            let sum = (at(pair.left) + at(pair.right)) - inner;
            for k in 0..EVEN {
                even[k] = even[k] + sum * pair.even[k];
            }
        }
        let mut odd = self.inner_odd.map(|c| slope * c);
        for pair in &self.pairs {
            let difference = at(pair.right) - at(pair.left);
            for k in 0..ODD {
                odd[k] = odd[k] + difference * pair.odd[k];
            }
        }
        // Constants have no moment but b_0: taking the inner pair off the others left all else alone.
        even[0] = even[0] + inner * 0.5;
        std::array::from_fn(|j| h * if j % 2 == 0 { even[j / 2] } else { odd[j / 2] })
    }
}
