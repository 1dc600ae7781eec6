//! Rates or delta angles -> attitude, the way other projects do it: their formulas, written anew. Pure.
//!
//! Each is what its project computes for attitude alone: no Earth rate, no bias, no correction. Projects and
//! commits are those of `docs/theory/attitude.md` 1; `crates/bodies/tests/bodies/accuracy/peers.rs` holds each to the
//! figures measured there. The first sample has the initial attitude; interval k runs from sample k - 1 to k.

use nalgebra::Vector3;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::{Quaternion, RotationVector, YawPitchRoll};
use strapd_attitude::record::RateSample;

type Attitude = Quaternion<Nav, Body>;
type Vector = Vector3<f64>;

/// A peer's way: the attitude at the first sample, the samples -> the attitude at each.
pub type Peer = fn(Attitude, &[RateSample]) -> Vec<Attitude>;

fn advanced(q: &Attitude, phi: Vector) -> Attitude {
    q.advanced(&RotationVector(phi)).normalised()
}

/// Attitudes by each interval's rotation vector: given interval number, its samples' values, its length in seconds.
fn by_vectors(
    start: Attitude,
    samples: &[RateSample],
    mut phi: impl FnMut(usize, Vector, Vector, f64) -> Vector,
) -> Vec<Attitude> {
    let mut out = vec![start];
    for (k, pair) in samples.windows(2).enumerate() {
        let [before, now] = pair else { continue };
        let h = now.stamp.secs_since(before.stamp);
        let last = out[out.len() - 1];
        out.push(advanced(
            &last,
            phi(k + 1, *before.gyro.as_vector(), *now.gyro.as_vector(), h),
        ));
    }
    out
}

/// `q exp(w_i+1 dt)`: gyroflow b5e8828 `imu_integration`, ahrs eb99143 `AngularRate` (closed form), VQF b66ff21
/// (which knows no stamps but one period). First order.
pub fn one_exponential(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    by_vectors(start, rates, |_, _, now, h| now * h)
}

/// `C (I + [w dt x])`, then the nearest rotation: strapdown-rs 714a659 `attitude_update`. First order. Along w
/// nothing is stretched, across it everything by the same factor, so the nearest rotation is about w by atan |w dt|.
pub fn first_order_matrix(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    by_vectors(start, rates, |_, _, now, h| {
        let angle = (now * h).norm();
        if angle > 0.0 {
            now * (h * angle.atan() / angle)
        } else {
            Vector::zeros()
        }
    })
}

/// Forward Euler on yaw, pitch and roll with w_i-1: gnss-ins-sim 966ff27 `free_integration.py`. First order, singular
/// at a pitch of 90 degrees.
pub fn euler_angles(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    let mut angles = start.yaw_pitch_roll();
    let mut out = vec![start];
    for pair in rates.windows(2) {
        let [before, now] = pair else { continue };
        let h = now.stamp.secs_since(before.stamp);
        let (w, [sr, cr]) = (
            *before.gyro.as_vector(),
            [angles.roll.sin(), angles.roll.cos()],
        );
        let across = sr * w.y + cr * w.z;
        let next = YawPitchRoll {
            yaw: angles.yaw + h * across / angles.pitch.cos(),
            pitch: angles.pitch + h * (cr * w.y - sr * w.z),
            roll: angles.roll + h * (w.x + across * angles.pitch.tan()),
        };
        angles = next;
        out.push(Attitude::from_yaw_pitch_roll(&angles));
    }
    out
}

/// Rate linear over the interval, one cross product: pyins 8377ede in rate mode. Second order.
pub fn linear_rate(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    by_vectors(start, rates, |_, before, now, h| {
        (before + now) * (0.5 * h) + before.cross(&now) * (h * h / 12.0)
    })
}

/// Increments corrected by the one before, `d + d_before x d / 12` (half of Savage's `d_before / 6`).
fn with_the_one_before(
    start: Attitude,
    samples: &[RateSample],
    mut increment: impl FnMut(Vector, Vector, f64) -> Vector,
) -> Vec<Attitude> {
    let mut last = None;
    by_vectors(start, samples, |_, before, now, h| {
        let d = increment(before, now, h);
        let coning = last.map_or(Vector::zeros(), |last: Vector| last.cross(&d) / 12.0);
        last = Some(d);
        d + coning
    })
}

/// Trapezoid increments and Savage's term: PX4 `Integrator`. Second order.
pub fn trapezoid_and_one_before(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    with_the_one_before(start, rates, |before, now, h| (before + now) * (0.5 * h))
}

/// `w_i+1 dt` and Savage's term: smsfusion 491aa06 given rates. First order.
pub fn end_rate_and_one_before(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    with_the_one_before(start, rates, |_, now, h| now * h)
}

/// One step of classical Runge-Kutta on the quaternion: rates at start, middle and end of `h` seconds.
fn runge_kutta(q: &Attitude, rates: [Vector; 3], h: f64) -> Attitude {
    let slope = |[w, x, y, z]: [f64; 4], r: Vector| {
        [
            -0.5 * (x * r.x + y * r.y + z * r.z),
            0.5 * (w * r.x + y * r.z - z * r.y),
            0.5 * (w * r.y + z * r.x - x * r.z),
            0.5 * (w * r.z + x * r.y - y * r.x),
        ]
    };
    let q = q.wxyz();
    let at = |k: [f64; 4], h: f64| std::array::from_fn(|i| q[i] + h * k[i]);
    let [start, middle, end] = rates;
    let k1 = slope(q, start);
    let k2 = slope(at(k1, 0.5 * h), middle);
    let k3 = slope(at(k2, 0.5 * h), middle);
    let k4 = slope(at(k3, h), end);
    let sum = std::array::from_fn(|i| k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    Attitude::assume_unit(at(sum, h / 6.0)).normalised()
}

/// Classical Runge-Kutta, rate linear over the interval: the textbook. Second order.
pub fn runge_kutta_linear(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    let mut out = vec![start];
    for pair in rates.windows(2) {
        let [before, now] = pair else { continue };
        let h = now.stamp.secs_since(before.stamp);
        let (a, b) = (*before.gyro.as_vector(), *now.gyro.as_vector());
        let last = out[out.len() - 1];
        out.push(runge_kutta(&last, [a, (a + b) * 0.5, b], h));
    }
    out
}

/// Classical Runge-Kutta over two intervals, the sample between as the middle: fourth order on equal spacings, an
/// attitude at every other sample; those between repeat the one before.
pub fn runge_kutta_over_two(start: Attitude, rates: &[RateSample]) -> Vec<Attitude> {
    let mut out = vec![start];
    for three in rates.windows(3).step_by(2) {
        let [before, middle, now] = three else {
            continue;
        };
        let h = now.stamp.secs_since(before.stamp);
        let last = out[out.len() - 1];
        let rates = [
            *before.gyro.as_vector(),
            *middle.gyro.as_vector(),
            *now.gyro.as_vector(),
        ];
        out.extend([last, runge_kutta(&last, rates, h)]);
    }
    out
}

/// `exp(d)`: an increment taken for a rotation vector. Second order.
pub fn one_increment(start: Attitude, increments: &[RateSample]) -> Vec<Attitude> {
    by_vectors(start, increments, |_, _, now, _| now)
}

/// `d + d_before x d / 12`: pyins 8377ede in increment mode, whatever the spacings. Third order on equal ones.
pub fn increment_and_one_before(start: Attitude, increments: &[RateSample]) -> Vec<Attitude> {
    with_the_one_before(start, increments, |_, now, _| now)
}
