//! The quaternion arithmetic, on bare `[w, x, y, z]`: one place for every product, exponential and matrix. Pure.
//!
//! A stage of its own because integrators and the smoother work on plain arrays of numbers; frames are put back on
//! at the border, in the public signatures of [`Quaternion`](super::Quaternion), which calculates with what is here. Hamilton
//! product, body to navigation.
//!
//! Where two formulas for one thing are kept, the second says whose last bits hang on it. Apart from here, for the same
//! reason, are the turn of the propagator (`propagate/turn.rs`), which is this exponential over lanes with one term more, and
//! its product (`propagate/accumulate.rs`), which adds in another order.

use nalgebra::{Matrix3, Vector3};

/// `a * b`, Hamilton.
#[inline]
pub fn product(a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The inverse of a unit quaternion.
#[inline]
pub fn conjugate(q: &[f64; 4]) -> [f64; 4] {
    [q[0], -q[1], -q[2], -q[3]]
}

/// Sum of the products of the components.
#[inline]
pub(crate) fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// `|q|`.
#[inline]
pub(crate) fn norm(q: &[f64; 4]) -> f64 {
    dot(q, q).sqrt()
}

/// `q / |q|`; NaN where the norm is zero or not finite.
#[inline]
pub(crate) fn unit(q: &[f64; 4]) -> [f64; 4] {
    let norm = norm(q);
    q.map(|c| c / norm)
}

/// `q / |q|`; the identity for a quaternion whose norm is zero or not finite.
pub fn normalised(q: &[f64; 4]) -> [f64; 4] {
    let norm = norm(q);
    if norm > 0.0 && norm.is_finite() {
        q.map(|c| c / norm)
    } else {
        [1.0, 0.0, 0.0, 0.0]
    }
}

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
#[inline]
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
#[inline]
pub fn exp_minus_one(phi: &Vector3<f64>) -> [f64; 4] {
    let square = phi.norm_squared();
    let (w, s) = if square < SERIES_BELOW {
        // Taylor in y = (a/2)^2 <= 1/16: the first terms left out are 2e-18 and 1e-17 of the sum.
        let y = 0.25 * square;
        (y * horner(&COS_MINUS_ONE, y), horner(&HALF_SINC, y))
    } else {
        let a = length(phi);
        let (sin, cos) = (0.25 * a).sin_cos();
        (-2.0 * sin * sin, 2.0 * sin * cos / a)
    };
    [w, s * phi.x, s * phi.y, s * phi.z]
}

/// `q exp(phi)`, phi in body axes; not renormalised.
#[inline]
pub(crate) fn turned(q: &[f64; 4], phi: &Vector3<f64>) -> [f64; 4] {
    let [w, x, y, z] = exp_minus_one(phi);
    product(q, &[1.0 + w, x, y, z])
}

/// `exp(phi) q`, phi in navigation axes; not renormalised.
#[inline]
pub(crate) fn turned_in_navigation(phi: &Vector3<f64>, q: &[f64; 4]) -> [f64; 4] {
    let [w, x, y, z] = exp_minus_one(phi);
    product(&[1.0 + w, x, y, z], q)
}

/// The rotation by the rotation vector `phi` in rad, as the bodies step by it: within a rounding or two of
/// `1 + exp_minus_one`, and apart from it because their motions keep their last bits.
pub fn exp(phi: &Vector3<f64>) -> [f64; 4] {
    let half = 0.5 * phi.norm();
    // Below 1e-4 the next term of the series is 1e-16 of the first.
    let scale = if half < 1e-4 {
        0.5 * (1.0 - half * half / 6.0)
    } else {
        0.5 * half.sin() / half
    };
    [half.cos(), scale * phi.x, scale * phi.y, scale * phi.z]
}

/// Length of a vector, also where its square leaves the range of f64.
pub(crate) fn length(v: &Vector3<f64>) -> f64 {
    let square = v.norm_squared();
    if (1e-280..1e280).contains(&square) {
        return square.sqrt();
    }
    let scale = v.amax();
    if scale == 0.0 || !scale.is_finite() {
        return if v.iter().any(|c| c.is_nan()) {
            f64::NAN
        } else {
            scale
        };
    }
    scale * (v / scale).norm()
}

/// A vector of body axes in navigation axes: `q (0, v) q*` of a unit quaternion, in two cross products.
#[inline(always)]
pub(crate) fn rotated(q: &[f64; 4], [vx, vy, vz]: [f64; 3]) -> [f64; 3] {
    let [w, x, y, z] = *q;
    let (tx, ty, tz) = (
        2.0 * (y * vz - z * vy),
        2.0 * (z * vx - x * vz),
        2.0 * (x * vy - y * vx),
    );
    [
        vx + w * tx + (y * tz - z * ty),
        vy + w * ty + (z * tx - x * tz),
        vz + w * tz + (x * ty - y * tx),
    ]
}

/// The rows of C_nb of a unit quaternion q_nb.
#[inline(always)]
pub(crate) fn rows(q: &[f64; 4]) -> [[f64; 3]; 3] {
    let [w, x, y, z] = *q;
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// C_nb of a unit quaternion q_nb with its diagonal from four squares, as the bodies' equations of motion take it: other
/// last bits than `rows`, which simulated truth keeps.
pub fn matrix(q: &[f64; 4]) -> Matrix3<f64> {
    let [w, x, y, z] = *q;
    Matrix3::new(
        w * w + x * x - y * y - z * z,
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        w * w - x * x + y * y - z * z,
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        w * w - x * x - y * y + z * z,
    )
}

/// Half of `q * (0, w)`: the rate of change of q_nb under the body rate `w` in rad/s.
pub fn derivative(q: &[f64; 4], w: &[f64; 3]) -> [f64; 4] {
    [
        -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]),
        0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]),
        0.5 * (q[0] * w[1] - q[1] * w[2] + q[3] * w[0]),
        0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]),
    ]
}

/// Angle in rad of the rotation from `a` to `b`, exact down to zero, in `[0, pi]`: by the
/// product, with which the tables of the top were made; [`Quaternion::angle_to`](super::Quaternion::angle_to) is by the difference, and better by
/// a digit for stored numbers.
pub fn angle_between(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let d = product(&conjugate(a), b);
    let v = (d[1] * d[1] + d[2] * d[2] + d[3] * d[3]).sqrt();
    2.0 * v.atan2(d[0].abs())
}

/// Angle in rad between the body z axes of two attitudes.
pub fn angle_between_z_axes(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    // The z axis of b seen from a: the third column of C(conj(a) * b); its sine is 2 |cos| |sin| of
    // half angles, which keeps every digit near zero where 1 - cos would lose half of them.
    let d = product(&conjugate(a), b);
    let tilt = (d[1] * d[1] + d[2] * d[2]).sqrt();
    let twist = (d[0] * d[0] + d[3] * d[3]).sqrt();
    2.0 * tilt.atan2(twist)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_quarter_turn_about_x_takes_y_to_z() {
        let q = exp(&Vector3::new(FRAC_PI_2, 0.0, 0.0));
        let z = matrix(&q) * Vector3::y();
        assert!((z - Vector3::z()).norm() < 1e-15);
    }

    #[test]
    fn two_quarter_turns_compose_left_to_right_as_matrices_do() {
        let a = exp(&Vector3::new(FRAC_PI_2, 0.0, 0.0));
        let b = exp(&Vector3::new(0.0, 0.0, FRAC_PI_2));
        let ab = matrix(&product(&a, &b));
        assert!((ab - matrix(&a) * matrix(&b)).norm() < 1e-15);
        assert!((ab - matrix(&b) * matrix(&a)).norm() > 1.0, "order matters");
    }

    #[test]
    fn the_derivative_is_half_the_product_with_the_rate() {
        let q = exp(&Vector3::new(0.3, -1.0, 0.7));
        let w = [0.4, -2.0, 5.0];
        let p = product(&q, &[0.0, w[0], w[1], w[2]]);
        for (d, p) in derivative(&q, &w).iter().zip(p) {
            // One rounding of terms up to 2.5.
            assert!((d - 0.5 * p).abs() < 1e-15);
        }
    }

    #[test]
    fn angles_between_attitudes_are_exact_down_to_1e_12_rad() {
        let a = exp(&Vector3::new(0.3, -1.0, 0.7));
        for angle in [1e-12, 1e-6, 1.0, 3.0] {
            let b = product(&a, &exp(&Vector3::new(angle, 0.0, 0.0)));
            // A few roundings of unit quaternions.
            assert!((angle_between(&a, &b) - angle).abs() < 1e-15);
            assert!((angle_between_z_axes(&a, &b) - angle).abs() < 1e-15);
            let spun = product(&a, &exp(&Vector3::new(0.0, 0.0, angle)));
            assert!(
                angle_between_z_axes(&a, &spun) < 1e-15,
                "spin leaves the axis"
            );
        }
    }
}
