//! Gyro noise, turns and time -> how well attitude and bias are known. Pure.
//!
//! The error is `e`, rad, in body axes: `q_true = q_est exp(e)`; the bias that was not removed is `b`,
//! rad/s. Over a step of h seconds and rotation vector phi (docs/theory/attitude.md 8):
//!
//! ```text
//! e' = R^T e - h J_r b - noise        R = exp([phi x]), J_r the right Jacobian of phi
//! b' = alpha b + noise                alpha = exp(-h/tau), 1 for a random walk
//! ```
//!
//! The 6x6 of (e, b) is carried in the pieces that move. What is the same about all axes stays a multiple
//! of the identity however the body turns, and is one number. A bias that does not change makes an error
//! that is linear in it, `e = -B b` with `B' = R^T B + h J_r`, so nine numbers hold the whole history of
//! a tumbling body exactly. Only noise that differs between the axes and a bias that wanders need the
//! recursion of the 3x3 blocks; the 3x3 of the bias itself stays diagonal always.
//!
//! Errors of scale and axes are as constant as that bias, but act on the turn itself: of the nine entries of G the
//! errors are `D_k` (a matrix for each component k of the turn, a column for each axis it acts about),
//! `D_k' = R^T D_k + J_r phi_k`, and their covariance is the sum of `D_k diag(sigma^2) D_k^T`.
//!
//! # Accuracy
//! Exact for a rate constant over each step and noise equal about all axes: within 1e-11 of the plain
//! 6x6 recursion. White noise that differs between the axes is taken at the ends of a step (the trapezoid
//! rule): up to a^2/3 of the difference over a step of a rad, and less over many. The wander of the bias
//! within one step is taken along the mean axes of the step: up to a^2/4 of the share of one step.
//! `crates/attitude/tests/attitude/covariance.rs` sweeps all three.

mod matrix;
mod noise;

pub use noise::Noise;

use crate::plausible::{are_numbers, is_amount, is_covariance};
use crate::quaternion::{RotationVector, exp_minus_one};
use crate::record::AttitudeCovariance;
use matrix::{PLACES, Rows, Transition, Triangle, ZERO};
use matrix::{columns_times, congruent, congruent_diagonal, product, product_transposed};
use nalgebra::{Matrix3, Matrix6};

/// About an axis of which nothing is known: no error of an attitude is larger.
const LOST: f64 = std::f64::consts::PI;

/// Covariance of attitude error and bias: what [`Propagator`](crate::propagate::Propagator) carries along, for use on
/// its own.
///
/// # Example
/// ```
/// use nalgebra::Vector3;
/// use strapd_attitude::quaternion::RotationVector;
/// use strapd_attitude::propagate::covariance::{Covariance, Noise};
///
/// // 0.01 rad/sqrt(s) of white noise and 0.001 rad/s of bias, about x alone: a second of rest.
/// let mut covariance = Covariance::new(Noise {
///     arw: [0.01, 0.0, 0.0],
///     bias: [0.001, 0.0, 0.0],
///     ..Noise::default()
/// });
/// covariance.step(RotationVector(Vector3::zeros()), 1.0);
/// let sigma = covariance.attitude().sigma();
/// assert!((sigma.x - 1.01e-4f64.sqrt()).abs() < 1e-15 && sigma.y == 0.0);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Covariance {
    noise: Noise,
    kind: Kind,
    /// White noise equal about all axes, rad^2/s.
    alike_arw: f64,
    state: State,
}

/// Pieces that move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// Only what is alike about all axes.
    Alike,
    /// Attitude, and a bias that does not change.
    ConstantBias,
    /// Everything.
    Wandering,
}

impl Covariance {
    /// Makes it before the first step: the initial attitude's own uncertainty, and that of the bias.
    #[must_use]
    pub fn new(noise: Noise) -> Covariance {
        let wandering = Noise::differs(noise.initial)
            || Noise::differs(noise.arw)
            || noise.rrw != [0.0; 3]
            || noise.bias_tau.is_some();
        let kind = if wandering {
            Kind::Wandering
        } else if noise.bias != [0.0; 3] {
            Kind::ConstantBias
        } else {
            Kind::Alike
        };
        let alike_arw = if Noise::differs(noise.arw) {
            0.0
        } else {
            noise.arw[0] * noise.arw[0]
        };
        let is_distorted = noise.scale != 0.0 || noise.misalignment != 0.0;
        let mut covariance = Covariance {
            noise,
            kind,
            alike_arw,
            state: State {
                resumed: false,
                alike: 0.0,
                turned: ZERO,
                attitude: [0.0; 6],
                cross: ZERO,
                bias: noise.bias.map(|b| b * b),
                distorted: is_distorted.then_some([ZERO; 3]),
            },
        };
        covariance.restart();
        covariance
    }

    /// The body has turned by `phi` over `secs` seconds of integrated rate.
    pub fn step(&mut self, phi: RotationVector, secs: f64) {
        self.advance(exp_minus_one(&phi.0), secs);
    }

    /// Same as [`step`](Self::step), by `[cos(a/2) - 1, sin(a/2) axis]`.
    #[inline(always)]
    pub(crate) fn advance(&mut self, turn: [f64; 4], secs: f64) {
        self.state.alike += self.alike_arw * secs;
        if self.kind == Kind::Alike && self.state.distorted.is_none() {
            return;
        }
        let transition = Transition::of(turn);
        match self.kind {
            Kind::Alike => {}
            Kind::ConstantBias => {
                let Transition { back, mean } = transition;
                let mut turned = product(&back, &self.state.turned);
                for i in 0..3 {
                    for j in 0..3 {
                        turned[i][j] += secs * mean[i][j];
                    }
                }
                self.state.turned = turned;
            }
            Kind::Wandering => self.wander(&transition, secs),
        }
        self.distort(&transition, turn);
    }

    /// Adds the effect of errors of scale and axes on a turn.
    #[inline(always)]
    fn distort(&mut self, Transition { back, mean }: &Transition, turn: [f64; 4]) {
        // The rotation vector: twice the sine of its half is 4 % short of it at a rad, which sigma does not show.
        let [_, x, y, z] = turn;
        let distorted = self.state.distorted.iter_mut().flatten();
        for (distorted, component) in distorted.zip([x, y, z]) {
            let mut next = product(back, distorted);
            for (row, mean) in next.iter_mut().zip(mean) {
                for (entry, mean) in row.iter_mut().zip(mean) {
                    *entry += 2.0 * component * mean;
                }
            }
            *distorted = next;
        }
    }

    /// Variance of the attitude from errors of scale and axes, rad^2.
    fn distortion(&self) -> Triangle {
        let (scale, beside) = (self.noise.scale.powi(2), self.noise.misalignment.powi(2));
        let mut sum = [0.0; 6];
        for (k, distorted) in self.state.distorted.iter().flatten().enumerate() {
            let mut variances = [beside; 3];
            variances[k] = scale;
            let part = congruent_diagonal(distorted, variances);
            for (sum, part) in sum.iter_mut().zip(part) {
                *sum += part;
            }
        }
        sum
    }

    fn wander(&mut self, Transition { back, mean }: &Transition, secs: f64) {
        let step = mean.map(|row| row.map(|m| m * secs));
        let Wander {
            alpha,
            held,
            own_attitude,
            own_cross,
            own_bias,
        } = Wander::over(secs, self.noise.bias_tau);
        let driven = self.noise.rrw.map(|k| k * k * secs);
        let axis = |f: &dyn Fn(usize) -> f64| [f(0), f(1), f(2)];

        let before = congruent(back, &self.halfway(secs));
        let carried = product(back, &self.state.cross);
        let swept = columns_times(
            &step,
            axis(&|i| 0.5 * (held * held * self.state.bias[i] + driven[i] * own_attitude)),
        );
        // P = R^T P R + H + H^T with H = (G diag/2 - held R^T X) G^T.
        let mut half = ZERO;
        for i in 0..3 {
            for j in 0..3 {
                half[i][j] = swept[i][j] - held * carried[i][j];
            }
        }
        for (n, (i, j)) in PLACES.into_iter().enumerate() {
            self.state.attitude[n] = before[n]
                + (product_transposed(&half, &step, (i, j))
                    + product_transposed(&half, &step, (j, i)));
        }
        self.state.attitude = self.halfway(secs);
        let added = columns_times(
            &step,
            axis(&|i| alpha * held * self.state.bias[i] + driven[i] * own_cross),
        );
        for i in 0..3 {
            for j in 0..3 {
                self.state.cross[i][j] = alpha * carried[i][j] - added[i][j];
            }
            self.state.bias[i] = alpha * alpha * self.state.bias[i] + driven[i] * own_bias;
        }
    }

    /// The attitude's part with half a step of white noise, where it differs between the axes.
    #[inline(always)]
    fn halfway(&self, secs: f64) -> Triangle {
        let mut p = self.state.attitude;
        if self.alike_arw == 0.0 {
            for (place, arw) in [0, 3, 5].into_iter().zip(self.noise.arw) {
                p[place] += 0.5 * secs * arw * arw;
            }
        }
        p
    }

    /// The attitude is the initial one again. What is known of the bias is not lost with it.
    pub(crate) fn restart(&mut self) {
        let initial = self.noise.initial.map(|s| s * s);
        self.state.alike = 0.0;
        self.state.attitude = [0.0; 6];
        if self.kind == Kind::Wandering {
            let [x, y, z] = initial;
            self.state.attitude = [x, 0.0, 0.0, y, 0.0, z];
        } else {
            self.state.alike = initial[0];
        }
        self.state.turned = ZERO;
        self.state.cross = ZERO;
        self.state.distorted = self.state.distorted.map(|_| [ZERO; 3]);
    }

    /// The attitude is one that was known so well when it was saved. How its error hangs together with
    /// that of the bias was not saved, and is taken for nothing.
    pub(crate) fn resume(&mut self, saved: AttitudeCovariance) {
        self.restart();
        self.state.resumed |= self.kind != Kind::Wandering;
        self.kind = Kind::Wandering;
        self.state.alike = 0.0;
        self.state.attitude = saved.upper();
    }

    /// Adds what a bridged gap may hide: rad^2 about every axis.
    pub(crate) fn bridge(&mut self, variance: f64) {
        self.state.alike += variance;
    }

    /// Adds what may have been turned about any axis in `secs` during which no sample was seen, were the
    /// rate kept, rad/s.
    pub(crate) fn hold(&mut self, rate: f64, secs: f64) {
        let turned = (rate * secs.max(0.0)).min(LOST);
        self.state.alike += turned * turned;
        self.pass(secs);
    }

    /// Time passes without a turn: a bias that wanders has wandered on.
    pub(crate) fn pass(&mut self, secs: f64) {
        let secs = secs.max(0.0);
        let wander = Wander::over(secs, self.noise.bias_tau);
        for i in 0..3 {
            let driven = self.noise.rrw[i] * self.noise.rrw[i] * secs;
            self.state.bias[i] =
                wander.alpha * wander.alpha * self.state.bias[i] + driven * wander.own_bias;
            for row in &mut self.state.cross {
                row[i] *= wander.alpha;
            }
        }
    }

    /// Covariance of the attitude, in body axes. An axis about which more than half a turn is unknown is one about
    /// which nothing is: its variance ends at pi^2.
    #[must_use]
    #[inline(always)]
    pub fn attitude(&self) -> AttitudeCovariance {
        let mut p = match self.kind {
            Kind::Alike => [0.0; 6],
            Kind::ConstantBias => congruent_diagonal(&self.state.turned, self.state.bias),
            Kind::Wandering => self.state.attitude,
        };
        if self.state.distorted.is_some() {
            for (p, more) in p.iter_mut().zip(self.distortion()) {
                *p += more;
            }
        }
        for place in [0, 3, 5] {
            p[place] += self.state.alike;
        }
        if p[0].max(p[3]).max(p[5]) >= LOST * LOST {
            capped(&mut p);
        }
        AttitudeCovariance::from_upper(p)
    }

    /// Covariance of attitude error (rad, body axes) and bias (rad/s), in this order; not capped.
    #[must_use]
    pub fn matrix(&self) -> Matrix6<f64> {
        let (p, cross) = match self.kind {
            Kind::Alike => ([0.0; 6], ZERO),
            Kind::ConstantBias => (
                congruent_diagonal(&self.state.turned, self.state.bias),
                columns_times(&self.state.turned, self.state.bias.map(|b| -b)),
            ),
            Kind::Wandering => (self.state.attitude, self.state.cross),
        };
        let mut m = Matrix6::zeros();
        let distortion = self.distortion();
        for (n, (i, j)) in PLACES.into_iter().enumerate() {
            let value = p[n] + distortion[n] + if i == j { self.state.alike } else { 0.0 };
            (m[(i, j)], m[(j, i)]) = (value, value);
        }
        let cross = Matrix3::from_fn(|i, j| cross[i][j]);
        m.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross);
        m.fixed_view_mut::<3, 3>(3, 0).copy_from(&cross.transpose());
        for i in 0..3 {
            m[(i + 3, i + 3)] = self.state.bias[i];
        }
        m
    }
}

/// State of a [`Covariance`], which is saved as it is.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub(crate) struct State {
    /// Whether it was begun from a saved attitude: then all pieces move.
    resumed: bool,
    /// The part of the attitude's covariance that is this times the identity, rad^2.
    alike: f64,
    /// `B`: attitude error made by a bias that does not change is `-B b`, s.
    turned: Rows,
    /// The rest of the attitude's covariance, rad^2.
    attitude: Triangle,
    /// Covariance of attitude (rows) and bias (columns), rad^2/s.
    cross: Rows,
    /// Variance of the bias, (rad/s)^2.
    bias: [f64; 3],
    /// `D`: attitude error made by each entry of G, by the component of the turn it multiplies.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    distorted: Option<[Rows; 3]>,
}

impl State {
    /// Whether a covariance can have been so: what a file says may be anything.
    pub(crate) fn is_plausible(&self) -> bool {
        let distorted = self.distorted.iter().flatten().flatten();
        let rows = self.turned.iter().chain(&self.cross).chain(distorted);
        let mut attitude = self.attitude;
        for place in [0, 3, 5] {
            attitude[place] += self.alike;
        }
        are_numbers(rows.flatten().chain(&self.attitude))
            && is_amount(self.alike)
            && self.bias.into_iter().all(is_amount)
            && is_covariance(&attitude)
    }
}

impl Covariance {
    pub(crate) fn state(&self) -> State {
        self.state
    }

    /// Goes on from the state of another of the same noise; `false`, and nothing has changed, when that cannot be.
    pub(crate) fn recall(&mut self, state: &State) -> bool {
        let fits =
            state.is_plausible() && state.distorted.is_some() == self.state.distorted.is_some();
        if fits {
            self.state = *state;
            if state.resumed {
                self.kind = Kind::Wandering;
            }
        }
        fits
    }
}

/// Brings variances beyond pi^2 back to it and keeps the correlations.
#[cold]
fn capped(p: &mut Triangle) {
    let scale = [0, 3, 5].map(|place| (LOST / p[place].sqrt()).min(1.0));
    for (n, (i, j)) in PLACES.into_iter().enumerate() {
        p[n] *= scale[i] * scale[j];
    }
}

/// Change of a bias over one step of h seconds, for a driving noise of K^2 h.
#[derive(Clone, Copy, Debug)]
struct Wander {
    /// Share that remains: exp(-h/tau).
    alpha: f64,
    /// Mean over the step, as a share of the bias at its start.
    held: f64,
    /// Variance of the angle from the noise of this step, times h^2.
    own_attitude: f64,
    /// Covariance of that angle and the bias, times h (with the sign of their coupling left out).
    own_cross: f64,
    /// Variance of the bias from it.
    own_bias: f64,
}

impl Wander {
    /// # Source
    /// Integrals of exp(-t/tau); for tau = infinity K^2 h^3/3, K^2 h^2/2 and K^2 h (docs/theory/attitude.md 8).
    #[inline(always)]
    fn over(h: f64, tau: Option<f64>) -> Wander {
        match tau {
            None => Wander {
                alpha: 1.0,
                held: 1.0,
                own_attitude: 1.0 / 3.0,
                own_cross: 0.5,
                own_bias: 1.0,
            },
            Some(tau) => Wander::decaying(h / tau),
        }
    }

    fn decaying(x: f64) -> Wander {
        // Far beyond what is left of it, and its cube is still a number.
        let x = x.min(1e60);
        let decay = (-x).exp_m1();
        let alpha = 1.0 + decay;
        let (held, own_bias) = if x < 1e-9 {
            (1.0, 1.0)
        } else {
            (-decay / x, -(-2.0 * x).exp_m1() / (2.0 * x))
        };
        // (x - 2 (1 - e^-x) + (1 - e^-2x)/2) / x^3, which loses its digits where x is small.
        let own_attitude = if x < 0.02 {
            1.0 / 3.0 + x * (-0.25 + x * (7.0 / 60.0 + x * (-1.0 / 24.0 + x * (31.0 / 2520.0))))
        } else {
            (x + 2.0 * decay - 0.5 * (-2.0 * x).exp_m1()) / (x * x * x)
        };
        Wander {
            alpha,
            held,
            own_attitude,
            own_cross: 0.5 * held * held,
            own_bias,
        }
    }
}
