//! A first-order differential equation and a state -> the state one step later. Pure.

use nalgebra::Vector3;
use std::fmt;

/// Rate that stands for a whole step in a direction cosine recursion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum HeldRate {
    /// `w(t_i)`
    Left,
    /// `w(t_i+1)`, the source document's choice
    Right,
    /// Mean of both
    Mean,
}

impl HeldRate {
    /// The rate held between `w0` at the start and `w1` at the end.
    #[must_use]
    pub fn of(self, w0: &Vector3<f64>, w1: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Left => *w0,
            Self::Right => *w1,
            Self::Mean => 0.5 * (w0 + w1),
        }
    }
}

/// Method of a step.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Method {
    /// The source document's: torque held over the step, RK4 on the rate, one rotation by a held rate.
    HeldTorque(HeldRate),
    /// Classical fourth-order Runge-Kutta on quaternion and rate together.
    Rk4,
    /// Gauss-Legendre collocation with three stages, order 6.
    #[default]
    GaussLegendre6,
}

/// The implicit equations of a step have no solution near its start: the step is too long for the
/// rate, or the right-hand side is not finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NotConverged {
    /// Length of the step, s.
    pub step_secs: f64,
    /// Last change of the iteration, relative to the state.
    pub remaining: f64,
}

impl fmt::Display for NotConverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a step of {:e} s does not converge (still moving by {:e}): the body turns too far in one step, use a higher rate",
            self.step_secs, self.remaining
        )
    }
}

impl std::error::Error for NotConverged {}

/// Classical Runge-Kutta, order 4.
pub(crate) fn rk4<const N: usize>(
    f: &mut impl FnMut(f64, &[f64; N]) -> [f64; N],
    t: f64,
    y: &[f64; N],
    h: f64,
) -> [f64; N] {
    let along = |k: &[f64; N], scale: f64| std::array::from_fn(|i| y[i] + scale * k[i]);
    let k1 = f(t, y);
    let k2 = f(t + 0.5 * h, &along(&k1, 0.5 * h));
    let k3 = f(t + 0.5 * h, &along(&k2, 0.5 * h));
    let k4 = f(t + h, &along(&k3, h));
    std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}

/// Gauss-Legendre collocation with three stages: order 6, symmetric, symplectic, keeps every
/// quadratic invariant (the quaternion's norm; a free body's energy and momentum squared).
///
/// # Source
/// Butcher, Math. Comp. 18 (1964) 50. Hairer, Lubich, Wanner, Geometric Numerical Integration (2006),
/// II.1.3 for the coefficients, IV.2.1 for the invariants.
pub(crate) fn gauss_legendre6<const N: usize>(
    f: &mut impl FnMut(f64, &[f64; N]) -> [f64; N],
    t: f64,
    y: &[f64; N],
    h: f64,
) -> Result<[f64; N], NotConverged> {
    const S15: f64 = 3.872_983_346_207_417;
    const C: [f64; 3] = [0.5 - S15 / 10.0, 0.5, 0.5 + S15 / 10.0];
    const A: [[f64; 3]; 3] = [
        [5.0 / 36.0, 2.0 / 9.0 - S15 / 15.0, 5.0 / 36.0 - S15 / 30.0],
        [5.0 / 36.0 + S15 / 24.0, 2.0 / 9.0, 5.0 / 36.0 - S15 / 24.0],
        [5.0 / 36.0 + S15 / 30.0, 2.0 / 9.0 + S15 / 15.0, 5.0 / 36.0],
    ];
    const B: [f64; 3] = [5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0];
    // Fixed-point iteration gains log10(2/(h rate)) digits a round; past 100 rounds there is no
    // fixed point, or it is not the solution.
    const ROUNDS: usize = 100;
    const FLOOR: f64 = 1e-14;

    let size = y.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let mut k = [f(t, y); 3];
    let mut last = f64::INFINITY;
    let mut remaining = f64::INFINITY;
    for _ in 0..ROUNDS {
        remaining = 0.0;
        for stage in 0..3 {
            let at = std::array::from_fn(|i| {
                let a = &A[stage];
                y[i] + h * (a[0] * k[0][i] + a[1] * k[1][i] + a[2] * k[2][i])
            });
            let new = f(t + C[stage] * h, &at);
            for i in 0..N {
                let moved = (h * (new[i] - k[stage][i])).abs() / size;
                // NaN must not hide behind max().
                remaining = if moved > remaining || moved.is_nan() {
                    moved
                } else {
                    remaining
                };
            }
            k[stage] = new;
        }
        // At the rounding floor the changes stop shrinking; above it they shrink every round.
        if remaining.is_nan() || remaining == 0.0 || (remaining <= FLOOR && remaining >= last) {
            break;
        }
        last = remaining;
    }
    // False for NaN.
    let converged = remaining <= FLOOR;
    if !converged {
        return Err(NotConverged {
            step_secs: h,
            remaining,
        });
    }
    Ok(std::array::from_fn(|i| {
        y[i] + h * (B[0] * k[0][i] + B[1] * k[1][i] + B[2] * k[2][i])
    }))
}
