//! Rotation vector -> the quaternion of one small turn, kept as its difference from "no turn". Pure.
//!
//! `cos(a/2)` of a small angle has lost the digits of the angle; `cos(a/2) - 1` has not. The
//! accumulator adds that difference to the attitude, so it is what every method delivers.

use crate::lanes::{Lanes, Triple};

/// `[cos(a/2) - 1, sin(a/2) * axis]`: a unit quaternion minus the identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn<const N: usize> {
    /// cos(a/2) - 1.
    pub(crate) c: Lanes<N>,
    /// sin(a/2) times the unit axis.
    pub(crate) v: Triple<N>,
}

/// Half angle squared up to which the Taylor sums below are exact to half a unit in the last place:
/// the first term left out is below `0.0625^7 / 14! = 4e-20`.
const SMALL: f64 = 0.0625;

impl<const N: usize> Turn<N> {
    /// exp of the rotation vector (docs/theory/attitude.md 2): [`exp_minus_one`](crate::quaternion::exp_minus_one)
    /// for neighbouring
    /// intervals at once. Its sine has one term more and large angles go by other functions, so the two differ in
    /// last bits.
    #[inline(always)]
    pub(crate) fn exp(phi: Triple<N>) -> Self {
        let z = phi.norm_squared() * 0.25;
        let term = |t: f64| Lanes::<N>::splat(t);
        let c = term(-1.0 / 3_628_800.0) + z * (1.0 / 479_001_600.0);
        let c = term(1.0 / 40_320.0) + z * c;
        let c = term(-1.0 / 720.0) + z * c;
        let c = term(1.0 / 24.0) + z * c;
        let c = z * (term(-0.5) + z * c);
        let s = term(-1.0 / 39_916_800.0) + z * (1.0 / 6_227_020_800.0);
        let s = term(1.0 / 362_880.0) + z * s;
        let s = term(-1.0 / 5_040.0) + z * s;
        let s = term(1.0 / 120.0) + z * s;
        let s = term(-1.0 / 6.0) + z * s;
        let s = term(1.0) + z * s;
        let mut turn = Turn {
            c,
            v: phi.times(s * 0.5),
        };
        for i in 0..N {
            // NaN stays NaN either way, to be seen and refused later.
            if z.0[i] > SMALL {
                let half = z.0[i].sqrt();
                let quarter = (0.5 * half).sin();
                let sinc = 0.5 * half.sin() / half;
                turn.c.0[i] = -2.0 * quarter * quarter;
                turn.v.x.0[i] = phi.x.0[i] * sinc;
                turn.v.y.0[i] = phi.y.0[i] * sinc;
                turn.v.z.0[i] = phi.z.0[i] * sinc;
            }
        }
        turn
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, turn: Turn<1>) {
        let [c, x, y, z] = turn.parts();
        self.c.0[i] = c;
        self.v.x.0[i] = x;
        self.v.y.0[i] = y;
        self.v.z.0[i] = z;
    }

    #[inline(always)]
    pub(crate) fn lane(self, i: usize) -> Turn<1> {
        Turn {
            c: Lanes([self.c.0[i]]),
            v: self.v.lane(i),
        }
    }
}

impl Turn<1> {
    pub(crate) const NONE: Turn<1> = Turn {
        c: Lanes::ZERO,
        v: Triple::ZERO,
    };

    /// Makes it from a quaternion of any norm, given as scalar and vector part.
    pub(crate) fn from_parts(w: f64, v: Triple<1>) -> Self {
        let scale = 1.0 / (w * w + v.norm_squared().0[0]).sqrt();
        let v = v * scale;
        let w = w * scale;
        let c = if w > 0.0 {
            -v.norm_squared().0[0] / (1.0 + w)
        } else {
            w - 1.0
        };
        Turn { c: Lanes([c]), v }
    }

    /// Makes it from `[cos(a/2) - 1, x, y, z]`.
    pub(crate) fn of([c, x, y, z]: [f64; 4]) -> Self {
        let v = Triple {
            x: Lanes([x]),
            y: Lanes([y]),
            z: Lanes([z]),
        };
        Turn { c: Lanes([c]), v }
    }

    /// Composes this turn with `next` about the axes it has turned to.
    pub(crate) fn then(self, next: Self) -> Self {
        // (1 + a)(1 + b) - 1 = a + b + ab, so nothing small is lost against 1.
        let (a, b) = (self.c.0[0], next.c.0[0]);
        let dot = self.v.x.0[0] * next.v.x.0[0]
            + self.v.y.0[0] * next.v.y.0[0]
            + self.v.z.0[0] * next.v.z.0[0];
        Turn {
            c: Lanes([a + b + a * b - dot]),
            v: self.v + next.v + next.v * a + self.v * b + self.v.cross(next.v),
        }
    }

    pub(crate) fn inverse(self) -> Self {
        Turn {
            c: self.c,
            v: self.v * -1.0,
        }
    }

    /// The angle turned, 0 to 2 pi, rad.
    pub(crate) fn angle(self) -> f64 {
        2.0 * self.v.norm().atan2(1.0 + self.c.0[0])
    }

    /// `[cos(a/2) - 1, x, y, z]`.
    pub(crate) fn parts(self) -> [f64; 4] {
        [self.c.0[0], self.v.x.0[0], self.v.y.0[0], self.v.z.0[0]]
    }
}
