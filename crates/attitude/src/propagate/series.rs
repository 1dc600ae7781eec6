//! Legendre moments -> turn, to the last bit, by a power series about mid-interval. Pure.
//!
//! The reference the closed forms are held against, and what `exact` falls back on when the turn
//! per interval is large. Expanded about the middle: about the start it loses every digit to
//! cancellation on coarse data (`docs/theory/attitude.md` 3).

use super::magnus::{MOMENTS, Moments, halves};
use super::turn::Turn;
use crate::lanes::Triple;

/// Sum of `|b_j|` beyond which neither samples nor series mean anything: more than a turn in one step.
const HOPELESS: f64 = 8.0;
/// Sum of the polynomial's coefficients, half turns, up to which the series loses no digit to
/// cancellation; beyond, the interval is halved.
const MILD: f64 = 1.0;
/// Halvings at most: a b_8 of size [`HOPELESS`] needs four.
const DEPTH: u32 = 6;
/// A rate that is all x^8 adds a power (MILD/9)^n / n! only with every ninth term: n = 11 is the last bit.
const TERMS: usize = 104;

/// Coefficients of x^s in P_j, row j.
const LEGENDRE: [[f64; MOMENTS]; MOMENTS] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-0.5, 0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, -1.5, 0.0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.375, 0.0, -3.75, 0.0, 4.375, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.875, 0.0, -8.75, 0.0, 7.875, 0.0, 0.0, 0.0],
    [-0.3125, 0.0, 6.5625, 0.0, -19.6875, 0.0, 14.4375, 0.0, 0.0],
    [0.0, -2.1875, 0.0, 19.6875, 0.0, -43.3125, 0.0, 26.8125, 0.0],
    [
        0.273_437_5,
        0.0,
        -9.843_75,
        0.0,
        54.140_625,
        0.0,
        -93.843_75,
        0.0,
        50.273_437_5,
    ],
];

/// The exact turn for the rate these moments describe. Beyond [`HOPELESS`] the delta angle alone
/// is used (exact for a fixed axis, and always a rotation).
///
/// # Accuracy
/// A few units in the last place of the largest component of the turn's vector part.
pub(crate) fn turn(m: &Moments<1>) -> Turn<1> {
    let size: f64 = m.b.iter().map(|b| b.norm()).sum();
    // NaN is not small either; it then shows in the result and is refused by the caller.
    if size <= HOPELESS {
        divided(m, DEPTH)
    } else {
        Turn::exp(m.b[0])
    }
}

fn divided(m: &Moments<1>, depth: u32) -> Turn<1> {
    let mut rate = [Triple::ZERO; MOMENTS];
    for j in (0..m.live).rev() {
        for s in 0..=j {
            rate[s] = rate[s] + m.b[j] * (0.5 * LEGENDRE[j][s]);
        }
    }
    let size: f64 = rate.iter().map(|w| w.norm()).sum();
    if size <= MILD {
        return summed(&rate, m.live, size);
    }
    if depth == 0 {
        return Turn::exp(m.b[0]);
    }
    let (first, second) = halves(m);
    divided(&first, depth - 1).then(divided(&second, depth - 1))
}

/// `Q' = 1/2 Q w(x)`, coefficient by coefficient.
fn summed(rate: &[Triple<1>; MOMENTS], live: usize, size: f64) -> Turn<1> {
    let mut w = [0.0; TERMS];
    let mut v = [Triple::ZERO; TERMS];
    w[0] = 1.0;
    let (mut even_w, mut odd_w) = (1.0, 0.0);
    let (mut even_v, mut odd_v) = (Triple::<1>::ZERO, Triple::<1>::ZERO);
    let mut quiet = 0;
    for k in 0..TERMS - 1 {
        let (mut next_w, mut next_v) = (0.0, Triple::<1>::ZERO);
        for s in 0..live.min(k + 1) {
            let (qw, qv) = (w[k - s], v[k - s]);
            next_w -= qv.x.0[0] * rate[s].x.0[0]
                + qv.y.0[0] * rate[s].y.0[0]
                + qv.z.0[0] * rate[s].z.0[0];
            next_v = next_v + rate[s] * qw + qv.cross(rate[s]);
        }
        let scale = 0.5 / (k + 1) as f64;
        (w[k + 1], v[k + 1]) = (next_w * scale, next_v * scale);
        if k % 2 == 0 {
            odd_w += w[k + 1];
            odd_v = odd_v + v[k + 1];
        } else {
            even_w += w[k + 1];
            even_v = even_v + v[k + 1];
        }
        // The recurrence looks back `live` terms: only that many small ones in a row end it.
        let small = w[k + 1].abs() + v[k + 1].norm() < 1e-18 * size;
        quiet = if small { quiet + 1 } else { 0 };
        if quiet > live {
            break;
        }
    }
    // Q(-1)* Q(+1) with Q(+-1) = E +- O: the vector part is 2 vec(E* O), which keeps the relative
    // precision of small turns; the scalar part is |E|^2 - |O|^2.
    let vector = (odd_v * even_w - even_v * odd_w - even_v.cross(odd_v)) * 2.0;
    let scalar =
        even_w * even_w + even_v.norm_squared().0[0] - odd_w * odd_w - odd_v.norm_squared().0[0];
    Turn::from_parts(scalar, vector)
}
