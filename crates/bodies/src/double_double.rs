//! Two `f64` -> one number of about 32 digits. Pure.
//!
//! Its own stage because the truth must be better than what it judges: a state carried in `f64`
//! loses 1e-16 of a full turn at every step, and a top turns 1200 times a minute. Only the few
//! operations the exact references need are here.
//!
//! # Accuracy
//! Relative error of one operation at most 2^-102 (addition of numbers of opposite sign: relative to
//! the larger operand). Holds for magnitudes between 1e-290 and 1e290, far outside anything a body does.
//!
//! # Source
//! Dekker, Numer. Math. 18 (1971) 224: exact product by splitting, no fused multiply-add (which
//! would be a library call on the portable x86-64 target). Knuth, TAOCP 2, 4.2.2: exact sum.
//! Joldes, Muller, Popescu, ACM TOMS 44 (2017): the error bounds.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// An unevaluated sum `hi + lo` with `|lo| <= ulp(hi) / 2`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct DoubleDouble {
    hi: f64,
    lo: f64,
}

/// `a + b` and what rounding lost, exactly.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

/// Same as [`two_sum`], for `|a| >= |b|` or `a == 0`.
fn quick_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

/// The two 26-bit halves of `a`.
fn split(a: f64) -> (f64, f64) {
    const SPLITTER: f64 = 134_217_729.0; // 2^27 + 1
    let t = SPLITTER * a;
    let hi = t - (t - a);
    (hi, a - hi)
}

/// `a * b` and what rounding lost, exactly.
fn two_prod(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

impl DoubleDouble {
    pub(crate) const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    pub(crate) const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    /// pi to 32 digits.
    pub(crate) const PI: Self = Self {
        hi: std::f64::consts::PI,
        lo: 1.224_646_799_147_353_2e-16,
    };

    /// Exactly `nanos * 1e-9` to 32 digits.
    pub(crate) fn from_nanos(nanos: u64) -> Self {
        // Whole seconds and the rest are both exact in f64; u64 itself is not.
        let secs = Self::from((nanos / 1_000_000_000) as f64);
        let rest = Self::from((nanos % 1_000_000_000) as f64);
        secs + rest / Self::from(1e9)
    }

    /// The nearest `f64`.
    pub(crate) fn to_f64(self) -> f64 {
        self.hi
    }

    /// Fractional part: the number less the whole number below it, in `[0, 1]`.
    pub(crate) fn fraction(self) -> f64 {
        let rest = self - Self::from(self.hi.floor());
        // The low part may lie below a whole high one.
        if rest.hi < 0.0 {
            rest.hi + 1.0
        } else {
            rest.hi
        }
    }

    /// Square root; zero for zero and for negative numbers.
    pub(crate) fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        let x = self.hi.sqrt();
        let (p, e) = two_prod(x, x);
        let rest = (self - Self { hi: p, lo: e }).hi;
        let (hi, lo) = quick_two_sum(x, rest / (2.0 * x));
        Self { hi, lo }
    }

    /// The angle less whole turns, in `[-pi, pi]` give or take one rounding.
    pub(crate) fn reduced_angle(self) -> Self {
        let turn = Self::PI * 2.0;
        self - turn * (self.hi / turn.hi).round()
    }

    /// Sine and cosine of an angle in rad of any size, each within 1 ulp of 1.
    pub(crate) fn sin_cos(self) -> (f64, f64) {
        let a = self.reduced_angle();
        let (s, c) = a.hi.sin_cos();
        (s + c * a.lo, c - s * a.lo)
    }
}

impl From<f64> for DoubleDouble {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        let (s, e) = two_sum(self.hi, b.hi);
        let (t, f) = two_sum(self.lo, b.lo);
        let (s, e) = quick_two_sum(s, e + t);
        let (hi, lo) = quick_two_sum(s, e + f);
        Self { hi, lo }
    }
}

impl AddAssign for DoubleDouble {
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        let (p, e) = two_prod(self.hi, b.hi);
        let (hi, lo) = quick_two_sum(p, e + (self.hi * b.lo + self.lo * b.hi));
        Self { hi, lo }
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        let (p, e) = two_prod(self.hi, b);
        let (hi, lo) = quick_two_sum(p, e + self.lo * b);
        Self { hi, lo }
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let q1 = self.hi / b.hi;
        let r = self - b * q1;
        let q2 = r.hi / b.hi;
        let r = r - b * q2;
        let q3 = r.hi / b.hi;
        let (hi, lo) = quick_two_sum(q1, q2);
        Self { hi, lo } + Self::from(q3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dd(x: f64) -> DoubleDouble {
        DoubleDouble::from(x)
    }

    /// 2^-100: four operations of 2^-102 each.
    const TINY: f64 = 8e-31;

    #[test]
    fn a_third_times_three_is_one_to_thirty_digits() {
        let third = dd(1.0) / dd(3.0);
        assert!((third * dd(3.0) - dd(1.0)).to_f64().abs() < TINY);
        assert!(
            (third - dd(1.0 / 3.0)).to_f64() != 0.0,
            "the low part carries the rest"
        );
    }

    #[test]
    fn a_sum_keeps_what_one_f64_would_lose() {
        let x = dd(1.0) + dd(1e-25);
        assert_eq!((x - dd(1.0)).to_f64(), 1e-25);
    }

    #[test]
    fn the_root_of_two_squares_to_two() {
        let r = dd(2.0).sqrt();
        assert!((r * r - dd(2.0)).to_f64().abs() < TINY);
    }

    #[test]
    fn nanoseconds_of_a_century_keep_their_last_digit() {
        let century = 3_155_760_000_000_000_001_u64;
        let second = DoubleDouble::from_nanos(century) - dd(3_155_760_000.0);
        // 32 digits hold 3e9 s to 1e-22 s.
        assert!((second.to_f64() - 1e-9).abs() < 1e-21, "{second:?}");
    }

    #[test]
    fn the_sine_of_a_million_turns_and_a_tenth_is_the_sine_of_a_tenth() {
        let a = DoubleDouble::PI * 2e6 + dd(0.1);
        let (s, c) = a.sin_cos();
        // One ulp of 1 each.
        assert!((s - 0.1_f64.sin()).abs() < 2.3e-16);
        assert!((c - 0.1_f64.cos()).abs() < 2.3e-16);
    }

    #[test]
    fn large_angles_are_reduced_as_the_standard_library_does() {
        // Its reduction is exact; ours must know pi to 32 digits to keep up.
        for a in [1e3, 1e6, 123_456_789.0, -4e9] {
            let (s, c) = dd(a).sin_cos();
            assert!((s - a.sin()).abs() < 2.3e-16, "{a}");
            assert!((c - a.cos()).abs() < 2.3e-16, "{a}");
        }
    }
}
