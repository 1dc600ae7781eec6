//! Allan deviation -> coefficients of the noise terms, with their uncertainty. Pure.
//!
//! All terms at once, and not one slope after the other: the sum of the five theoretical variances is
//! held against the measured curve in its logarithm, each point weighted with its own error, no
//! coefficient below zero. Steps are those of Gauss and Newton; each is a small non-negative
//! least-squares problem, solved exactly by trying every set of terms.
//!
//! Then terms that are less than three of their standard errors are left out one by one, weakest
//! first, until those that stay are seen. What is left out has an upper bound instead.
//!
//! The points of one curve are not independent: neighbours share their data. The standard errors
//! count that in, with the correlation white noise has (from its two difference filters).

use super::theory::per_square;
use super::{Point, variance};
use crate::noise::sensor_error::ImuError;
use nalgebra::{DMatrix, DVector};

/// Terms fitted: Q, N, B, K, R.
const TERMS: usize = 5;
/// Limit in standard errors of a squared coefficient: below, it is not seen.
const SEEN: f64 = 3.0;
/// Points beyond this many standard errors from the fit: the five terms do not explain the curve.
pub const MAX_MISFIT: f64 = 5.0;

/// One coefficient.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct FittedTerm {
    /// The coefficient, SI; `None` = not seen in this record.
    pub value: Option<f64>,
    /// Standard error where it was seen.
    pub error: f64,
    /// Upper bound (2 sigma) where it was not.
    pub at_most: f64,
}

/// Terms of which a curve is made.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct AllanFit {
    /// Angle quantisation Q, rad.
    pub quantization: FittedTerm,
    /// Angle random walk N, rad/sqrt(s).
    pub arw: FittedTerm,
    /// Bias instability B, rad/s: the floor over 0.664.
    pub bias_instability: FittedTerm,
    /// Rate random walk K, rad/s/sqrt(s).
    pub rrw: FittedTerm,
    /// Rate ramp R, rad/s^2.
    pub rate_ramp: FittedTerm,
    /// The point farthest from the fit, in standard errors of that point; see [`MAX_MISFIT`].
    pub misfit: f64,
}

impl AllanFit {
    /// The terms seen, as sizes of an error model.
    #[must_use]
    pub fn error(&self) -> ImuError {
        ImuError {
            quantization: self.quantization.value.unwrap_or(0.0),
            arw: self.arw.value.unwrap_or(0.0),
            bias_instability: self.bias_instability.value.unwrap_or(0.0),
            rrw: self.rrw.value.unwrap_or(0.0),
            rate_ramp: self.rate_ramp.value.unwrap_or(0.0),
            ..ImuError::default()
        }
    }

    /// Allan deviation of the fit at `tau` seconds, rad/s.
    #[must_use]
    pub fn deviation(&self, tau: f64) -> f64 {
        variance(&self.error(), tau).sqrt()
    }
}

/// Fits the five terms. `None` when fewer than three points are not zero: a stuck axis.
#[must_use]
pub fn fit(points: &[Point]) -> Option<AllanFit> {
    let points: Vec<Point> = points
        .iter()
        .copied()
        .filter(|p| p.sigma > 0.0 && p.sigma.is_finite() && p.error.is_finite())
        .collect();
    if points.len() < 3 {
        return None;
    }
    let problem = Problem::new(&points);
    let (allowed, solution, error) = problem.terms_seen();
    let term = |i: usize| {
        let scale = problem.scale[i];
        let seen = allowed[i] && solution[i] > 0.0;
        let value = (scale * solution[i]).sqrt();
        FittedTerm {
            value: seen.then_some(value),
            // d sqrt(x) = dx / (2 sqrt(x)).
            error: if seen {
                0.5 * scale * error[i] / value
            } else {
                0.0
            },
            at_most: if seen {
                0.0
            } else {
                (scale * problem.at_most(i, &solution, allowed)).sqrt()
            },
        }
    };
    let misfit = (0..points.len())
        .map(|k| (problem.log[k] - problem.model(&solution, k).ln()).abs() / problem.error[k])
        .fold(0.0, f64::max);
    Some(AllanFit {
        quantization: term(0),
        arw: term(1),
        bias_instability: term(2),
        rrw: term(3),
        rate_ramp: term(4),
        misfit,
    })
}

/// The squared coefficients in units in which each alone reaches the curve somewhere.
struct Problem {
    /// Logarithm of the measured variance, freed of the bias of a logarithm.
    log: Vec<f64>,
    /// Standard error of that.
    error: Vec<f64>,
    tau: Vec<f64>,
    /// Theory per unit of each squared coefficient.
    basis: Vec<[f64; TERMS]>,
    scale: [f64; TERMS],
}

impl Problem {
    /// Terms that are seen, their squared coefficients and errors: the weakest is left out until all that remain are seen.
    fn terms_seen(&self) -> ([bool; TERMS], [f64; TERMS], [f64; TERMS]) {
        let mut allowed = [true; TERMS];
        let mut solution = self.solve(allowed);
        let mut error = self.errors(&solution, allowed);
        loop {
            let strength = |i: usize| match solution[i] > 0.0 {
                true => solution[i] / error[i],
                false => 0.0,
            };
            let weakest = (0..TERMS)
                .filter(|&i| allowed[i])
                .map(|i| (i, strength(i)))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            match weakest {
                Some((i, strength))
                    if strength < SEEN && allowed.iter().filter(|a| **a).count() > 1 =>
                {
                    allowed[i] = false;
                    solution = self.solve(allowed);
                    error = self.errors(&solution, allowed);
                }
                _ => return (allowed, solution, error),
            }
        }
    }

    fn new(points: &[Point]) -> Problem {
        let mut scale = [f64::INFINITY; TERMS];
        for p in points {
            for (s, f) in scale.iter_mut().zip(per_square(p.tau)) {
                *s = s.min(p.sigma * p.sigma / f);
            }
        }
        Problem {
            // A variance of nu degrees of freedom has the expected logarithm ln - 1/nu, and
            // error = 1 / sqrt(2 nu).
            log: points
                .iter()
                .map(|p| 2.0 * p.sigma.ln() + 2.0 * p.error * p.error)
                .collect(),
            error: points.iter().map(|p| 2.0 * p.error).collect(),
            tau: points.iter().map(|p| p.tau).collect(),
            basis: points
                .iter()
                .map(|p| {
                    let mut row = per_square(p.tau);
                    row.iter_mut().zip(scale).for_each(|(f, s)| *f *= s);
                    row
                })
                .collect(),
            scale,
        }
    }

    fn model(&self, x: &[f64; TERMS], k: usize) -> f64 {
        self.basis[k].iter().zip(x).map(|(f, x)| f * x).sum()
    }

    /// Gauss-Newton on the logarithms, from a start where every term is as large as it can be.
    fn solve(&self, allowed: [bool; TERMS]) -> [f64; TERMS] {
        let mut x = allowed.map(|a| if a { 1.0 } else { 0.0 });
        let mut cost = self.cost(&x);
        for _ in 0..60 {
            let next = self.step(&x, allowed);
            // Half as far until it does not get worse.
            let mut part = 1.0;
            let (mut tried, mut tried_cost) = (next, self.cost(&next));
            while tried_cost.is_nan() || tried_cost > cost {
                part *= 0.5;
                if part < 1e-4 {
                    return x;
                }
                tried = std::array::from_fn(|i| x[i] + part * (next[i] - x[i]));
                tried_cost = self.cost(&tried);
            }
            let moved = (0..TERMS).any(|i| (tried[i] - x[i]).abs() > 1e-10 * (x[i] + 1e-12));
            (x, cost) = (tried, tried_cost);
            if !moved {
                break;
            }
        }
        x
    }

    fn cost(&self, x: &[f64; TERMS]) -> f64 {
        (0..self.log.len())
            .map(|k| ((self.log[k] - self.model(x, k).ln()) / self.error[k]).powi(2))
            .sum()
    }

    /// The linearised problem, non-negative: the best of all sets of terms.
    fn step(&self, x: &[f64; TERMS], allowed: [bool; TERMS]) -> [f64; TERMS] {
        let n = self.log.len();
        let rows = DMatrix::from_fn(n, TERMS, |k, i| {
            self.basis[k][i] / (self.model(x, k) * self.error[k])
        });
        let target = DVector::from_fn(n, |k, _| {
            (1.0 + self.log[k] - self.model(x, k).ln()) / self.error[k]
        });
        let mut best = ([0.0; TERMS], f64::INFINITY);
        for set in 1..1usize << TERMS {
            let members: Vec<usize> = (0..TERMS).filter(|i| set >> i & 1 == 1).collect();
            if members.iter().any(|&i| !allowed[i]) {
                continue;
            }
            let part = rows.select_columns(&members);
            let Some(solved) = (part.transpose() * &part)
                .cholesky()
                .map(|c| c.solve(&(part.transpose() * &target)))
            else {
                continue;
            };
            if solved.iter().any(|v| *v < 0.0) {
                continue;
            }
            let cost = (part * &solved - &target).norm_squared();
            if cost < best.1 {
                let mut whole = [0.0; TERMS];
                for (i, v) in members.iter().zip(solved.iter()) {
                    whole[*i] = *v;
                }
                best = (whole, cost);
            }
        }
        best.0
    }

    /// Standard errors of the squared coefficients of the terms allowed.
    fn errors(&self, x: &[f64; TERMS], allowed: [bool; TERMS]) -> [f64; TERMS] {
        let members: Vec<usize> = (0..TERMS).filter(|&i| allowed[i]).collect();
        let n = self.log.len();
        let rows = DMatrix::from_fn(n, members.len(), |k, j| {
            self.basis[k][members[j]] / (self.model(x, k) * self.error[k])
        });
        let mut errors = [f64::INFINITY; TERMS];
        let Some(inverse) = (rows.transpose() * &rows).try_inverse() else {
            return errors;
        };
        let related = DMatrix::from_fn(n, n, |k, l| correlation(self.tau[k] / self.tau[l]));
        let gain = inverse * rows.transpose();
        let covariance = &gain * related * gain.transpose();
        for (j, &i) in members.iter().enumerate() {
            errors[i] = covariance[(j, j)].max(0.0).sqrt();
        }
        errors
    }

    /// Two standard errors above what a term left out would have, beside those that stay.
    fn at_most(&self, i: usize, solution: &[f64; TERMS], mut allowed: [bool; TERMS]) -> f64 {
        allowed[i] = true;
        let x = self.solve(allowed);
        let error = self.errors(solution, allowed)[i];
        x[i] + 2.0 * error
    }
}

/// Correlation of two overlapping Allan variances of white noise whose clusters have this ratio.
///
/// For filters h1, h2 (a box of one sign followed by one of the other) it is
/// `sum R12^2 / sqrt(sum R11^2 sum R22^2)` with R their cross-correlation, a piecewise line:
/// integrated by Simpson's rule between its corners.
fn correlation(ratio: f64) -> f64 {
    let r = if ratio < 1.0 { 1.0 / ratio } else { ratio };
    // Longer than this it is below 1e-3.
    if r.is_nan() || r > 1e4 {
        return 0.0;
    }
    // Of the short filter, boxes at 0 and 1, with the long one begun at t.
    let cross = |t: f64| {
        let overlap = |t: f64| (1f64.min(t + r) - 0f64.max(t)).max(0.0);
        overlap(t) - overlap(t + r) - overlap(t - 1.0) + overlap(t + r - 1.0)
    };
    let mut corners: Vec<f64> = [-2.0 * r, -r, 0.0]
        .iter()
        .flat_map(|t| [*t, t + 1.0, t + 2.0])
        .collect();
    corners.sort_by(f64::total_cmp);
    let power: f64 = corners
        .windows(2)
        .map(|w| {
            let (a, b) = (w[0], w[1]);
            let f = |t: f64| cross(t).powi(2);
            (b - a) / 6.0 * (f(a) + 4.0 * f(0.5 * (a + b)) + f(b))
        })
        .sum();
    // Of a unit cluster with itself: 2 at 0, -1 at +-1, 0 at +-2; its square integrates to 8/3.
    power / (8.0 / 3.0 * r.powi(3).sqrt())
}
