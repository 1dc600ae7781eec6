//! A number that changes in time, with its first two derivatives. Pure.
//!
//! What is written with it once is known with its rate and its acceleration, to rounding.

use std::ops::{Add, Mul, Neg, Sub};

/// Value, rate of change and its rate of change.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Jet {
    pub(super) value: f64,
    pub(super) rate: f64,
    pub(super) bend: f64,
}

impl Jet {
    pub(super) fn constant(value: f64) -> Self {
        Self {
            value,
            ..Self::default()
        }
    }

    /// The rate of change as a number of its own. Its second derivative is not known and stands as 0:
    /// nothing may read it.
    pub(super) fn derivative(self) -> Self {
        Self {
            value: self.rate,
            rate: self.bend,
            bend: 0.0,
        }
    }

    /// Sine and cosine of an angle in rad.
    pub(super) fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        let square = self.rate * self.rate;
        let sine = Self {
            value: s,
            rate: c * self.rate,
            bend: c * self.bend - s * square,
        };
        let cosine = Self {
            value: c,
            rate: -s * self.rate,
            bend: -s * self.bend - c * square,
        };
        (sine, cosine)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self {
            value: self.value + b.value,
            rate: self.rate + b.rate,
            bend: self.bend + b.bend,
        }
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            rate: self.rate * b.value + self.value * b.rate,
            bend: self.bend * b.value + 2.0 * self.rate * b.rate + self.value * b.bend,
        }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        Self {
            value: self.value * b,
            rate: self.rate * b,
            bend: self.bend * b,
        }
    }
}
