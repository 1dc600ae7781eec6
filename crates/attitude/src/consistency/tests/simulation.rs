//! Motions of a body under gravity that another language makes, too. Pure.

use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::PI;

const GRAVITY: f64 = 9.806_65;
const HZ: f64 = 50.0;

/// Rate in rad/s and specific force in m/s^2, body axes, and the derivatives of roll, pitch and yaw, rad/s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    pub(super) rate: Vector3<f64>,
    pub(super) force: Vector3<f64>,
    pub(super) angles: Vector3<f64>,
}

/// Numbers of mean 0 and deviation 1, uniform, from a 64-bit linear congruence.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let product = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = product.wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / 2_f64.powi(53) - 0.5) * 12_f64.sqrt()
    }

    fn vector(&mut self) -> Vector3<f64> {
        let [x, y, z] = [self.next(), self.next(), self.next()];
        Vector3::new(x, y, z)
    }
}

/// Smooth step from 3 s to 4 s, and its derivative.
fn beginning(t: f64) -> (f64, f64) {
    let v = (t - 3.0).clamp(0.0, 1.0);
    (v * v * (3.0 - 2.0 * v), 6.0 * v * (1.0 - v))
}

/// Still for 3 s, then roll, pitch and yaw swing by 50, 40 and 120 degrees; `walk`: accelerations, m/s^2.
pub(super) fn simulate(samples: usize, walk: f64) -> Vec<Sample> {
    let mut noise = Noise(1);
    let sample = |n: usize| {
        let t = n as f64 / HZ;
        let (u, du) = beginning(t);
        let swing = |degrees: f64, k: f64| {
            let (sin, cos) = (k * (t - 3.0)).sin_cos();
            let size = degrees.to_radians();
            (size * sin * u, size * (k * cos * u + sin * du))
        };
        let [(r, dr), (p, dp), (y, dy)] = [swing(50.0, 1.7), swing(40.0, 1.1), swing(120.0, 0.6)];
        let ((sr, cr), (sp, cp)) = (r.sin_cos(), p.sin_cos());
        let rate = Vector3::new(dr - dy * sp, dp * cr + dy * cp * sr, dy * cp * cr - dp * sr);
        let c: Matrix3<f64> = Rotation3::from_euler_angles(r, p, y).into_inner();
        let shaken = Vector3::new(
            (4.0 * PI * t).sin(),
            (2.0 * PI * t).cos(),
            (4.0 * PI * t + 1.0).sin(),
        );
        let force = c.transpose() * (Vector3::z() * GRAVITY + shaken * (walk * u));
        let [of_rate, of_force, _] = [noise.vector(), noise.vector(), noise.vector()];
        Sample {
            rate: rate + of_rate * 0.1_f64.to_radians(),
            force: force + of_force * 0.03,
            angles: Vector3::new(dr, dp, dy) + of_rate * 0.1_f64.to_radians(),
        }
    };
    (0..samples).map(sample).collect()
}

/// Turns about x alone.
pub(super) fn roll_only() -> Vec<Sample> {
    let mut noise = Noise(7);
    let sample = |n: usize| {
        let t = n as f64 / HZ;
        let (u, du) = beginning(t);
        let (sin, cos) = (1.3 * (t - 3.0)).sin_cos();
        let roll = 0.9 * sin * u;
        let rate = Vector3::x() * (0.9 * (1.3 * cos * u + sin * du));
        let force = Vector3::new(0.0, roll.sin(), roll.cos()) * GRAVITY;
        let [of_rate, of_force] = [noise.vector(), noise.vector()];
        Sample {
            rate: rate + of_rate * 0.1_f64.to_radians(),
            force: force + of_force * 0.03,
            angles: rate,
        }
    };
    (0..2000).map(sample).collect()
}
