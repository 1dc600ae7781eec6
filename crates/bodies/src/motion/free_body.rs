//! A free body with three moments of inertia -> its motion by Jacobi's functions. Pure.
//!
//! Euler's torque-free body: the rates are `cn`, `sn` and `dn`, the attitude follows from the
//! constant angular momentum and one angle about it, an integral of the third kind; the integrals of
//! the rates are elementary. The body axes are the principal axes.
//!
//! # Source
//! Landau, Lifshitz, Mechanics (1976), §37 (rates). Van Zon, Schofield, J. Comput. Phys. 225 (2007)
//! 145 (attitude). Here the node line is taken across the first axis of the sorted three, which the
//! momentum never reaches, so that nothing is singular; and differences of squares are sums of
//! squares of one sign.

use super::{FASTEST, MotionError, within};
use crate::double_double::DoubleDouble;
use crate::elliptic::{
    Jacobi, complete_third_kind, first_kind, jacobi, quarter_period, third_kind,
};
use crate::rigid_body::Spin;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::quaternion::kernel as quat;

/// A free rigid body in its principal axes.
///
/// # Accuracy
/// Attitude and delta angle within 5e-14 rad over 60 s at 5 rad/s, against the power series
/// (`crates/bodies/tests/bodies/motions.rs`): everything that grows with time is kept in 32 digits. Loses digits
/// towards the separatrix, as the motion itself does: there it is
/// unstable, and 1e-16 of rate grows to 1 within 37 time constants.
#[derive(Clone, Copy, Debug)]
pub struct FreeBody {
    start: [f64; 4],
    moments: [f64; 3],
    w0: Vector3<f64>,
    tumbling: Option<Tumbling>,
}

/// The part that does more than turn about one axis. Index 3 of the sorted axes is the one the rate
/// runs round, either the largest or the smallest moment; 2 is the middle one.
#[derive(Clone, Copy, Debug)]
struct Tumbling {
    /// Body axis of sorted axis 1, 2, 3.
    axis: [usize; 3],
    /// Amplitudes of cn, sn, dn, with their signs.
    amplitude: [f64; 3],
    /// Rate of the argument, rad/s.
    p: DoubleDouble,
    m: f64,
    mc: f64,
    quarter: DoubleDouble,
    v0: DoubleDouble,
    /// Size of the angular momentum over the first moment: what the angle about it gains a second.
    gain: DoubleDouble,
    /// The integral of the third kind's parameter, factor, complete value and value at the start.
    n: f64,
    factor: DoubleDouble,
    complete: DoubleDouble,
    third_at_start: DoubleDouble,
    /// Navigation axes from momentum axes.
    q_nl: [f64; 4],
}

impl FreeBody {
    /// Makes it from principal moments in kg m^2 about x, y, z and the attitude and rate at zero.
    ///
    /// # Errors
    /// [`MotionError`] for moments that are not positive or more than 1e6 apart, for a rate that is
    /// not a number or above 1e5 rad/s, for a start on the separatrix itself.
    pub fn new(moments: [f64; 3], start: Spin) -> Result<Self, MotionError> {
        let largest = moments.iter().fold(0.0_f64, |m, x| m.max(*x));
        for value in moments {
            if !(value > 1e-6 * largest && (1e-60..1e60).contains(&value)) {
                return Err(MotionError {
                    what: "moment of inertia",
                    value,
                });
            }
        }
        within("body rate (rad/s)", start.w_nb_b.norm(), FASTEST)?;
        let q = quat::normalised(&start.q_nb.wxyz());
        Ok(Self {
            start: q,
            moments,
            w0: start.w_nb_b,
            tumbling: Tumbling::new(moments, &q, &start.w_nb_b)?,
        })
    }

    /// Attitude and body rate at `nanos` nanoseconds; the quaternion's sign has no history.
    #[must_use]
    pub fn at_nanos(&self, nanos: u64) -> Spin {
        let t = DoubleDouble::from_nanos(nanos);
        let Some(tumbling) = &self.tumbling else {
            // A rotation about a principal axis.
            let (s, c) = (DoubleDouble::from(self.w0.norm()) * t * 0.5).sin_cos();
            let axis = self.w0.try_normalize(0.0).unwrap_or_default();
            let turn = [c, s * axis.x, s * axis.y, s * axis.z];
            return Spin {
                q_nb: Quaternion::assume_unit(quat::normalised(&quat::product(&self.start, &turn))),
                w_nb_b: self.w0,
            };
        };
        let (turns, j) = tumbling.phase(t);
        let w = tumbling.rate(&j, turns);
        let momentum = w.component_mul(&Vector3::from(self.moments));
        let across = tumbling.momentum_axes(&momentum);
        let (s, c) = (tumbling.angle(t, turns, &j) * 0.5).sin_cos();
        let q = quat::product(&tumbling.q_nl, &quat::product(&[c, 0.0, 0.0, s], &across));
        Spin {
            q_nb: Quaternion::assume_unit(quat::normalised(&q)),
            w_nb_b: w,
        }
    }

    /// Rate of change of a body rate `w`, by Euler's equations, rad/s^2.
    #[must_use]
    pub fn rate_change(&self, w: &Vector3<f64>) -> Vector3<f64> {
        let [x, y, z] = self.moments;
        Vector3::new(
            (y - z) / x * w.y * w.z,
            (z - x) / y * w.z * w.x,
            (x - y) / z * w.x * w.y,
        )
    }

    /// Integral of the body rate, rad.
    #[must_use]
    pub fn delta_angle(&self, from: u64, to: u64) -> Vector3<f64> {
        let (a, b) = (DoubleDouble::from_nanos(from), DoubleDouble::from_nanos(to));
        match &self.tumbling {
            None => self.w0 * (b - a).to_f64(),
            Some(tumbling) => tumbling.delta_angle(a, b),
        }
    }
}

impl Tumbling {
    /// `None` for a rotation about a principal axis (of which a sphere has many).
    fn new(moments: [f64; 3], q: &[f64; 4], w: &Vector3<f64>) -> Result<Option<Self>, MotionError> {
        let mut axis = [0, 1, 2];
        axis.sort_by(|a, b| moments[*a].total_cmp(&moments[*b]));
        let sorted = |axis: [usize; 3]| (axis.map(|k| moments[k]), axis.map(|k| w[k]));
        let dd = DoubleDouble::from;
        let (i, v) = sorted(axis);
        // L^2 - 2 T I2, whose sign says which axis the momentum runs round.
        let side = |i: [f64; 3], v: [f64; 3]| {
            dd(i[0]) * (dd(i[0]) - dd(i[1])) * v[0] * v[0]
                + dd(i[2]) * (dd(i[2]) - dd(i[1])) * v[2] * v[2]
        };
        if side(i, v).to_f64() < 0.0 {
            axis.swap(0, 2);
        }
        let (i, v) = sorted(axis);
        let [i1, i2, i3] = i.map(dd);
        let [v1, v2, v3] = v;
        // L^2 - 2 T I1 and L^2 - 2 T I3: each a sum of terms of one sign.
        let above = i2 * (i2 - i1) * v2 * v2 + i3 * (i3 - i1) * v3 * v3;
        let below = i1 * (i1 - i3) * v1 * v1 + i2 * (i2 - i3) * v2 * v2;
        let middle = side(i, v);
        let p2 = above * (i3 - i2) / (i1 * i2 * i3);
        // What does not tumble turns about an axis for good; written so that NaN ends here too.
        let wanders = below.to_f64() != 0.0 && (v1 != 0.0 || v3 != 0.0);
        if !(p2.to_f64() > 0.0 && wanders) {
            return Ok(None);
        }
        let p = p2.sqrt();
        let ratio = (i3 - i1) / ((i3 - i2) * above);
        let mc = middle * ratio;
        // Closer than this the quarter period is more than 35 time constants: what happens after
        // one is decided by digits the rates do not have.
        let clear = mc.to_f64() > 1e-30;
        if !clear {
            return Err(MotionError {
                what: "distance from the separatrix (use the power series there)",
                value: mc.to_f64(),
            });
        }
        let m = (below * (i1 - i2) / ((i3 - i2) * above))
            .to_f64()
            .clamp(0.0, 1.0);
        let size = |a: DoubleDouble, b: DoubleDouble| (a / b).sqrt().to_f64();
        let cn = size(below, i1 * (i1 - i3));
        let sn = size(below, i2 * (i2 - i3));
        let dn = size(above, i3 * (i3 - i1)).copysign(v3);
        // From I1 w1' = (I2 - I3) w2 w3: the product of the three signs is that of I3 - I2.
        let hand = if (axis[1] + 3 - axis[0]) % 3 == 1 {
            1.0
        } else {
            -1.0
        };
        let sn = sn * ((i3 - i2).to_f64() * hand * v3).signum();
        let phi0 = (v2 / sn).atan2(v1 / cn);
        let quarter = quarter_period(mc);
        // Amplitude beyond a quarter turn: a whole half period less the rest.
        let half_turns = (phi0 / PI).round();
        let v0 = quarter * (2.0 * half_turns) + dd(first_kind(phi0 - half_turns * PI, m));
        let squares = i1 * i1 * v1 * v1 + i2 * i2 * v2 * v2 + i3 * i3 * v3 * v3;
        let momentum = squares.sqrt();
        // L^2 - (I1 w1)^2 at its least, again a sum.
        let least = i3 * i3 * v3 * v3 + i2 * i3 * (i2 - i1) / (i3 - i1) * v2 * v2;
        let n = -(i1 * i1 * below / (i1 * (i1 - i3)) / least);
        let mut it = Self {
            axis,
            amplitude: [cn, sn, dn],
            p,
            m,
            mc: mc.to_f64(),
            quarter,
            v0,
            gain: momentum / i1,
            n: n.to_f64(),
            factor: momentum / i1 * above / (least * p),
            complete: complete_third_kind(dd(1.0) - n, mc),
            third_at_start: DoubleDouble::ZERO,
            q_nl: [1.0, 0.0, 0.0, 0.0],
        };
        let (turns, j) = it.phase(DoubleDouble::ZERO);
        it.third_at_start = it.third(turns, &j);
        let l_b = w.component_mul(&Vector3::from(moments));
        it.q_nl = quat::product(q, &quat::conjugate(&it.momentum_axes(&l_b)));
        Ok(Some(it))
    }

    /// Half periods passed, and Jacobi's functions within the one under way.
    fn phase(&self, t: DoubleDouble) -> (f64, Jacobi) {
        let v = self.v0 + self.p * t;
        let turns = (v.to_f64() / (2.0 * self.quarter.to_f64())).round();
        let rest = (v - self.quarter * (2.0 * turns)).to_f64();
        (turns, jacobi(rest, self.m, self.mc))
    }

    /// cn and sn change sign from one half period to the next.
    fn sign(turns: f64) -> f64 {
        if turns.rem_euclid(2.0) == 0.0 {
            1.0
        } else {
            -1.0
        }
    }

    fn rate(&self, j: &Jacobi, turns: f64) -> Vector3<f64> {
        let sign = Self::sign(turns);
        let [cn, sn, dn] = self.amplitude;
        self.unsorted([sign * cn * j.cn, sign * sn * j.sn, dn * j.dn])
    }

    fn unsorted(&self, values: [f64; 3]) -> Vector3<f64> {
        let mut v = Vector3::zeros();
        for (axis, value) in self.axis.iter().zip(values) {
            v[*axis] = value;
        }
        v
    }

    fn third(&self, turns: f64, j: &Jacobi) -> DoubleDouble {
        self.complete * (2.0 * turns) + DoubleDouble::from(third_kind(self.n, j))
    }

    /// Angle about the momentum since the start.
    fn angle(&self, t: DoubleDouble, turns: f64, j: &Jacobi) -> DoubleDouble {
        self.gain * t - self.factor * (self.third(turns, j) - self.third_at_start)
    }

    /// The rotation from body axes to axes whose z is the momentum and whose y lies across the
    /// sorted axis 1.
    fn momentum_axes(&self, l_b: &Vector3<f64>) -> [f64; 4] {
        let z = l_b.normalize();
        let mut e1 = Vector3::zeros();
        e1[self.axis[0]] = 1.0;
        let y = z.cross(&e1).normalize();
        let x = y.cross(&z);
        from_rows(&Matrix3::from_rows(&[
            x.transpose(),
            y.transpose(),
            z.transpose(),
        ]))
    }

    fn delta_angle(&self, a: DoubleDouble, b: DoubleDouble) -> Vector3<f64> {
        let (ta, ja) = self.phase(a);
        let (tb, jb) = self.phase(b);
        let k = self.m.sqrt();
        let kc = self.mc.sqrt();
        // Antiderivatives over k; for small k their first terms are all an f64 sees.
        let over_k = |f: f64, small: f64| if k > 1e-9 { f / k } else { small };
        let cn = |t: f64, j: &Jacobi| Self::sign(t) * over_k((k * j.sn).atan2(j.dn), j.sn);
        let sn = |t: f64, j: &Jacobi| -Self::sign(t) * over_k((k * j.cn / kc).asinh(), j.cn / kc);
        let p = self.p.to_f64();
        let [x, y, z] = self.amplitude;
        self.unsorted([
            x / p * (cn(tb, &jb) - cn(ta, &ja)),
            y / p * (sn(tb, &jb) - sn(ta, &ja)),
            z / p * (PI * (tb - ta) + (jb.am - ja.am)),
        ])
    }
}

/// The quaternion of a rotation matrix, by its largest component.
fn from_rows(c: &Matrix3<f64>) -> [f64; 4] {
    let (xx, yy, zz) = (c[(0, 0)], c[(1, 1)], c[(2, 2)]);
    let squares = [
        1.0 + xx + yy + zz,
        1.0 + xx - yy - zz,
        1.0 - xx + yy - zz,
        1.0 - xx - yy + zz,
    ];
    let (wx, wy, wz) = (
        c[(2, 1)] - c[(1, 2)],
        c[(0, 2)] - c[(2, 0)],
        c[(1, 0)] - c[(0, 1)],
    );
    let (xy, xz, yz) = (
        c[(0, 1)] + c[(1, 0)],
        c[(0, 2)] + c[(2, 0)],
        c[(1, 2)] + c[(2, 1)],
    );
    let best = (0..4)
        .max_by(|a, b| squares[*a].total_cmp(&squares[*b]))
        .unwrap_or(0);
    quat::normalised(&match best {
        0 => [squares[0], wx, wy, wz],
        1 => [wx, squares[1], xy, xz],
        2 => [wy, xy, squares[2], yz],
        _ => [wz, xz, yz, squares[3]],
    })
}
