//! Bare quaternion arithmetic on `[w, x, y, z]` for the models' inner loops. Pure.
//!
//! A stage of its own because integrators work on plain arrays of numbers; frames are put back on
//! at the border, in the public signatures. Hamilton product, body to navigation.

use nalgebra::{Matrix3, Vector3};

/// `a * b`, Hamilton.
pub fn product(a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The inverse of a unit quaternion.
pub fn conjugate(q: &[f64; 4]) -> [f64; 4] {
    [q[0], -q[1], -q[2], -q[3]]
}

/// `q / |q|`; the identity for a quaternion whose norm is zero or not finite.
pub fn normalised(q: &[f64; 4]) -> [f64; 4] {
    let n = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    if n > 0.0 && n.is_finite() {
        [q[0] / n, q[1] / n, q[2] / n, q[3] / n]
    } else {
        [1.0, 0.0, 0.0, 0.0]
    }
}

/// The rotation by the rotation vector `phi` in rad.
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

/// Half of `q * (0, w)`: the rate of change of q_nb under the body rate `w` in rad/s.
pub fn derivative(q: &[f64; 4], w: &[f64; 3]) -> [f64; 4] {
    [
        -0.5 * (q[1] * w[0] + q[2] * w[1] + q[3] * w[2]),
        0.5 * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]),
        0.5 * (q[0] * w[1] - q[1] * w[2] + q[3] * w[0]),
        0.5 * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]),
    ]
}

/// C_nb of a unit quaternion q_nb.
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

/// Angle in rad of the rotation from `a` to `b`, exact down to zero, in `[0, pi]`.
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
