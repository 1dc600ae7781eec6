//! A top between two nutations -> its attitude by elliptic functions. Pure.
//!
//! The second way to the truth, with nothing in common with the first ([`crate::rigid_body::HeavyBody`]) but the
//! laws of motion: no steps, no series, no integration.
//!
//! With `u = cos(nutation)`, `u_dot^2` is a cubic in u with roots `u1 <= u2 <= 1 <= u3`; so
//! `u = u1 + (u2 - u1) sn^2`, and precession and spin are integrals of the third kind.
//!
//! # Source
//! Goldstein, Classical Mechanics, 2nd ed., 5-7, eqs. 5-62 to 5-67; Whittaker, Analytical Dynamics, art. 71.
//! Here with both angles by partial fractions in `1 / (1 -+ u)`.

use super::{EulerAngles, EulerState, SymmetricTop, TopError};
use crate::double_double::DoubleDouble;
use crate::elliptic::{
    Jacobi, complete_third_kind, first_kind, jacobi, quarter_period, third_kind,
};

/// A heavy symmetric top that stays clear of the vertical, in closed form.
///
/// # Accuracy
/// 1e-14 rad over 60 s at 20 turns a second (`crates/bodies/tests/bodies/top.rs`): everything that grows with time is
/// kept in 32 digits. The method to use is still [`SymmetricTop::exact`], which has no case to refuse.
#[derive(Clone, Copy, Debug)]
pub struct ClosedForm {
    /// Lowest u, and how far it rises.
    u1: f64,
    rise: f64,
    m: f64,
    mc: f64,
    quarter: DoubleDouble,
    /// Argument of sn: `v0 + kappa t`.
    v0: DoubleDouble,
    kappa: DoubleDouble,
    /// The integrals of `1 / (1 - u)` and `1 / (1 + u)`.
    near: Pole,
    far: Pole,
    /// Spin less precession's share: `w3 - a`.
    own_spin: DoubleDouble,
    at_start: EulerAngles,
}

/// `strength / 2 ∫ dt / (1 -+ u)` as an integral of the third kind.
#[derive(Clone, Copy, Debug)]
struct Pole {
    n: f64,
    factor: DoubleDouble,
    complete: DoubleDouble,
    at_start: DoubleDouble,
}

impl Pole {
    fn value(&self, turns: f64, j: &Jacobi) -> DoubleDouble {
        let integral = self.complete * (2.0 * turns) + DoubleDouble::from(third_kind(self.n, j));
        self.factor * integral
    }
}

impl ClosedForm {
    /// Makes it from a top and its start.
    ///
    /// # Errors
    /// [`TopError::Singular`] when the axis passes within 1e-3 rad of the vertical, where the
    /// integrals' poles are; [`TopError::OutOfRange`] without gravity or arm (no cubic), or for a
    /// start that is not finite.
    pub fn new(top: &SymmetricTop, start: &EulerState) -> Result<Self, TopError> {
        let dd = DoubleDouble::from;
        let i1 = top.transverse();
        let nutation = start.angles.nutation;
        if nutation.abs() > std::f64::consts::PI {
            return Err(TopError::OutOfRange {
                what: "nutation beyond half a turn (rad), for the closed form",
                value: nutation,
            });
        }
        if top.largest_torque() <= 0.0 {
            return Err(TopError::OutOfRange {
                what: "torque of gravity, for the closed form",
                value: top.largest_torque(),
            });
        }
        let (sin, u0) = start.angles.nutation.sin_cos();
        let (p, nutation_rate) = (start.precession_rate, start.nutation_rate);
        // What multiplies time is kept in 32 digits: 60 s hold 1e4 rad.
        let torque = dd(top.mass()) * top.gravity() * top.arm();
        let beta = torque * 2.0 / dd(i1);
        let a = dd(top.axial()) * start.w3 / dd(i1);
        let b = dd(p) * (dd(1.0) - dd(u0)) * (dd(1.0) + dd(u0)) + a * u0;
        let [u1, u2, u3] = roots(beta, a, u0, p, nutation_rate);
        let span = u3 - u1;
        let kappa = (beta * span).sqrt() * 0.5;
        let mc = (u3 - u2) / span;
        let rise = (u2 - u1).to_f64();
        let singular = |u: f64| TopError::Singular {
            nutation: u.clamp(-1.0, 1.0).acos(),
            t: 0.0,
        };
        // cos(1e-3) = 1 - 5e-7.
        for u in [u1.to_f64(), u2.to_f64()] {
            let clear = u.abs() < 1.0 - 5e-7;
            if !clear {
                return Err(singular(u));
            }
        }
        let m = (rise / span.to_f64()).clamp(0.0, 1.0);
        // Phase of the start: sn^2 is the share of the rise.
        let share = if rise > 0.0 {
            ((dd(u0) - u1).to_f64() / rise).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let phi0 = share.sqrt().atan2((1.0 - share).sqrt());
        let u_dot = -nutation_rate * sin;
        let quarter = quarter_period(mc);
        let v0 = if share == 1.0 {
            quarter
        } else {
            dd(first_kind(phi0, m).copysign(u_dot))
        };
        // 1 / (1 - u) with u = u1 + rise sn^2 is 1 / (1 - u1) over 1 - n sn^2; the other likewise.
        let pole = |rise: DoubleDouble, strength: DoubleDouble, distance: DoubleDouble| {
            let n = rise / distance;
            Pole {
                n: n.to_f64(),
                factor: strength * 0.5 / (distance * kappa),
                complete: complete_third_kind(dd(1.0) - n, mc),
                at_start: DoubleDouble::ZERO,
            }
        };
        let mut form = Self {
            u1: u1.to_f64(),
            rise,
            m,
            mc: mc.to_f64(),
            quarter,
            v0,
            kappa,
            near: pole(u2 - u1, b - a, dd(1.0) - u1),
            far: pole(u1 - u2, b + a, dd(1.0) + u1),
            own_spin: dd(start.w3) - a,
            at_start: start.angles,
        };
        let (turns, j) = form.phase(DoubleDouble::ZERO);
        form.near.at_start = form.near.value(turns, &j);
        form.far.at_start = form.far.value(turns, &j);
        Ok(form)
    }

    /// Half periods passed, and Jacobi's functions within the one under way.
    fn phase(&self, t: DoubleDouble) -> (f64, Jacobi) {
        let v = self.v0 + self.kappa * t;
        let turns = (v.to_f64() / (2.0 * self.quarter.to_f64())).round();
        let rest = (v - self.quarter * (2.0 * turns)).to_f64();
        (turns, jacobi(rest, self.m, self.mc))
    }

    /// z-x'-z'' angles at `nanos` nanoseconds, each within one turn; nutation has the start's sign.
    #[must_use]
    pub fn at_nanos(&self, nanos: u64) -> EulerAngles {
        let t = DoubleDouble::from_nanos(nanos);
        let (turns, j) = self.phase(t);
        let u = self.u1 + self.rise * j.sn * j.sn;
        let near = self.near.value(turns, &j) - self.near.at_start;
        let far = self.far.value(turns, &j) - self.far.at_start;
        let nutation = ((1.0 - u) * (1.0 + u)).sqrt().atan2(u);
        let dd = DoubleDouble::from;
        let spin = self.own_spin * t + far - near + dd(self.at_start.spin);
        EulerAngles {
            precession: (near + far + dd(self.at_start.precession))
                .reduced_angle()
                .to_f64(),
            nutation: nutation.copysign(self.at_start.nutation),
            spin: spin.reduced_angle().to_f64(),
        }
    }

    /// Smallest and largest nutation, rad.
    #[must_use]
    pub fn nutation_range(&self) -> (f64, f64) {
        (
            (self.u1 + self.rise).clamp(-1.0, 1.0).acos(),
            self.u1.clamp(-1.0, 1.0).acos(),
        )
    }
}

/// The three roots, ascending, of
/// `f(u) = (1 - u^2)(alpha - beta u) - (b - a u)^2`, alpha and b from the start.
fn roots(
    beta: DoubleDouble,
    a: DoubleDouble,
    u0: f64,
    p: f64,
    nutation_rate: f64,
) -> [DoubleDouble; 3] {
    let dd = DoubleDouble::from;
    // About u0, x = u - u0: f = beta x^3 + c2 x^2 + c1 x + c0, where c0 = u_dot(0)^2 is known
    // without cancellation and zero when the start is a turning point.
    let u0 = dd(u0);
    let sin2 = (dd(1.0) - u0) * (dd(1.0) + u0);
    let nutation2 = dd(nutation_rate) * nutation_rate;
    let kinetic = sin2 * p * p + nutation2;
    let c0 = nutation2 * sin2;
    let c1 = a * sin2 * (2.0 * p) - u0 * kinetic * 2.0 - beta * sin2;
    let c2 = beta * u0 * 2.0 - kinetic - a * a;
    let mut x = if c0.to_f64() == 0.0 {
        let (y, z) = quadratic(beta, c2, c1);
        [DoubleDouble::ZERO, y, z]
    } else {
        // The largest root lies at u >= 1; from far right, Newton falls on it.
        let size = c2.to_f64().abs() + c1.to_f64().abs() + c0.to_f64().abs();
        let mut x = dd(3.0 + size / beta.to_f64());
        for _ in 0..200 {
            let f = ((beta * x + c2) * x + c1) * x + c0;
            let slope = (beta * x * 3.0 + c2 * 2.0) * x + c1;
            let step = f / slope;
            x = x - step;
            let moves = step.to_f64().abs() > 1e-30 * x.to_f64().abs();
            if !moves {
                break;
            }
        }
        // f = (x - r)(beta x^2 + s x + q), from the constant end, where a large r loses nothing.
        let q = -(c0 / x);
        let s = (q - c1) / x;
        let (y, z) = quadratic(beta, s, q);
        [x, y, z]
    };
    x.sort_by(|a, b| a.to_f64().total_cmp(&b.to_f64()));
    x.map(|x| u0 + x)
}

/// Roots of `a x^2 + b x + c`; real ones, as a rounding below zero under the root is a double root.
fn quadratic(a: DoubleDouble, b: DoubleDouble, c: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let root = (b * b - a * c * 4.0).sqrt();
    let sum = if b.to_f64() < 0.0 {
        root - b
    } else {
        -(b + root)
    };
    let q = sum * 0.5;
    if q.to_f64() == 0.0 {
        (DoubleDouble::ZERO, DoubleDouble::ZERO)
    } else {
        (q / a, c / q)
    }
}
