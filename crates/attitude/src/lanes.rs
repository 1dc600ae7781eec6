//! `f64` times N -> the same arithmetic on each. Pure.
//!
//! Neighbouring intervals of a log, and a segment under several maps, go through identical operations, so the kernels are written
//! once over `[f64; N]` and the compiler lays them on whatever vector registers there are.
//! Each lane does exactly the operations N = 1 does, in the same order (Rust never contracts
//! to fused multiply-add), so how intervals are grouped cannot change a bit.

use std::array::from_fn;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// N numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lanes<const N: usize>(pub(crate) [f64; N]);

impl<const N: usize> Lanes<N> {
    pub(crate) const ZERO: Self = Lanes([0.0; N]);

    #[inline(always)]
    pub(crate) fn splat(value: f64) -> Self {
        Lanes([value; N])
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Lanes(from_fn(|i| self.0[i].sqrt()))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Lanes(from_fn(|i| self.0[i].abs()))
    }

    #[inline(always)]
    pub(crate) fn recip(self) -> Self {
        Lanes(from_fn(|i| 1.0 / self.0[i]))
    }
}

impl<const N: usize> Add for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl<const N: usize> Sub for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl<const N: usize> Mul for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl<const N: usize> Mul<f64> for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Lanes(from_fn(|i| self.0[i] * factor))
    }
}

impl<const N: usize> Div<f64> for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, divisor: f64) -> Self {
        Lanes(from_fn(|i| self.0[i] / divisor))
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Lanes(from_fn(|i| -self.0[i]))
    }
}

/// N vectors side by side, one array per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Triple<const N: usize> {
    pub(crate) x: Lanes<N>,
    pub(crate) y: Lanes<N>,
    pub(crate) z: Lanes<N>,
}

impl From<[f64; 3]> for Triple<1> {
    #[inline(always)]
    fn from([x, y, z]: [f64; 3]) -> Self {
        Triple::new(x, y, z)
    }
}

impl From<Triple<1>> for [f64; 3] {
    #[inline(always)]
    fn from(triple: Triple<1>) -> Self {
        [triple.x.0[0], triple.y.0[0], triple.z.0[0]]
    }
}

impl<const N: usize> Triple<N> {
    pub(crate) const ZERO: Self = Triple {
        x: Lanes::ZERO,
        y: Lanes::ZERO,
        z: Lanes::ZERO,
    };

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Triple {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    pub(crate) fn norm_squared(self) -> Lanes<N> {
        self.x * self.x + self.y * self.y + self.z * self.z
    }

    /// A size not below the norm, and cheaper: the sum of the components' sizes.
    #[inline(always)]
    pub(crate) fn size(self) -> Lanes<N> {
        self.x.abs() + self.y.abs() + self.z.abs()
    }

    /// Each vector times its own lane's number.
    #[inline(always)]
    pub(crate) fn times(self, factor: Lanes<N>) -> Self {
        Triple {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    /// Makes it lane by lane.
    #[inline(always)]
    pub(crate) fn of_lanes(lane: impl Fn(usize) -> Triple<1>) -> Self {
        let each: [Triple<1>; N] = from_fn(lane);
        Triple {
            x: Lanes(from_fn(|i| each[i].x.0[0])),
            y: Lanes(from_fn(|i| each[i].y.0[0])),
            z: Lanes(from_fn(|i| each[i].z.0[0])),
        }
    }

    /// One lane as a vector of a single lane.
    #[inline(always)]
    pub(crate) fn lane(self, i: usize) -> Triple<1> {
        Triple {
            x: Lanes([self.x.0[i]]),
            y: Lanes([self.y.0[i]]),
            z: Lanes([self.z.0[i]]),
        }
    }
}

impl Triple<1> {
    pub(crate) fn new(x: f64, y: f64, z: f64) -> Self {
        Triple {
            x: Lanes([x]),
            y: Lanes([y]),
            z: Lanes([z]),
        }
    }

    pub(crate) fn norm(self) -> f64 {
        self.norm_squared().0[0].sqrt()
    }
}

impl<const N: usize> Add for Triple<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Triple {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }
}

impl<const N: usize> Sub for Triple<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Triple {
            x: self.x - other.x,
            y: self.y - other.y,
            z: self.z - other.z,
        }
    }
}

impl<const N: usize> Mul<f64> for Triple<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Triple {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }
}
