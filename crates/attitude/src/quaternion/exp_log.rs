//! Rotation vector <-> quaternion, exact at zero and at half a turn. Pure.
//!
//! Apart from `attitude` because it is the hot spot (one exp per sample) and because its accuracy is
//! a promise: every step of a product of a billion goes through here.

use super::{Quaternion, RotationVector, norm3};
use nalgebra::Vector3;

/// Below this squared angle (0.5 rad) the series is used: it needs neither root nor sine.
const SERIES_BELOW: f64 = 0.25;

/// `(cos(sqrt y) - 1)/y`, highest power first: (-1)^k / (2k)!.
const COS_MINUS_ONE: [f64; 6] = [
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
    -1.0 / 2.0,
];

/// `sin(sqrt y)/(2 sqrt y)`, highest power first: (-1)^k / (2 (2k+1)!).
const HALF_SINC: [f64; 6] = [
    -0.5 / 39_916_800.0,
    0.5 / 362_880.0,
    -0.5 / 5_040.0,
    0.5 / 120.0,
    -0.5 / 6.0,
    0.5,
];

// Products, not quotients: a chain of ten divisions costs three times the rest of the step.
fn horner(coefficients: &[f64; 6], y: f64) -> f64 {
    let [first, rest @ ..] = coefficients;
    rest.iter().fold(*first, |sum, c| sum * y + c)
}

/// `exp(phi) - 1` as a quaternion `[cos(a/2) - 1, sin(a/2)/a * phi]`, a = |phi|.
///
/// The first number is what a compensated product needs: `q exp(phi) = q + q (exp(phi) - 1)`
/// rounds at `|phi|` times the unit roundoff, not at the unit roundoff (`docs/theory/attitude.md` 5).
///
/// # Accuracy
/// Every component to 3e-16 relative below half a radian; above, absolute, 2e-16 (1 + a).
/// NaN or infinity in gives NaN out.
#[must_use]
pub fn exp_minus_one(phi: &Vector3<f64>) -> [f64; 4] {
    let square = phi.norm_squared();
    let (w, s) = if square < SERIES_BELOW {
        // Taylor in y = (a/2)^2 <= 1/16: the first terms left out are 2e-18 and 1e-17 of the sum.
        let y = 0.25 * square;
        (y * horner(&COS_MINUS_ONE, y), horner(&HALF_SINC, y))
    } else {
        let a = norm3(phi);
        let (sin, cos) = (0.25 * a).sin_cos();
        (-2.0 * sin * sin, 2.0 * sin * cos / a)
    };
    [w, s * phi.x, s * phi.y, s * phi.z]
}

impl<To, From> Quaternion<To, From> {
    /// The rotation that turns by |phi| about phi: exp(phi), of unit norm to rounding.
    ///
    /// # Accuracy
    /// 1e-15 rad up to half a turn.
    #[must_use]
    pub fn from_rotation_vector(phi: &RotationVector) -> Self {
        let [w, x, y, z] = exp_minus_one(&phi.0);
        Self::assume_unit([1.0 + w, x, y, z])
    }

    /// The shortest rotation vector: log(q), angle in 0..=pi.
    ///
    /// # Accuracy
    /// 4 ulp of the angle, from 0 to pi, for any norm: no arc cosine, no cut near zero or half
    /// a turn. At exactly half a turn (w = 0) the axis is that of the stored vector part.
    #[must_use]
    pub fn rotation_vector(&self) -> RotationVector {
        let [w, x, y, z] = self.wxyz();
        let sign = if w < 0.0 { -1.0 } else { 1.0 };
        let v = Vector3::new(x, y, z) * sign;
        let sine = norm3(&v);
        if sine == 0.0 {
            return RotationVector(v);
        }
        let angle = 2.0 * sine.atan2(w.abs());
        // Unit axis first: angle / sine overflows for a sine below 1e-308.
        RotationVector(v / sine * angle)
    }
}
