//! Recordings by formula, without noise: motion, a gyro and an accelerometer with errors, hard iron.

use crate::frames::In;
use crate::quaternion::{BodyRate, Quaternion, RotationVector};
use crate::record::Nanos;
use crate::smooth::{Estimate, Sample, Settings, Smoothed, smooth};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

pub(super) const BIAS: [f64; 3] = [0.010, -0.008, 0.005];
pub(super) const FORCE_BIAS: [f64; 3] = [0.03, -0.02, 0.04];
const IRON: [f64; 3] = [2.0, -1.0, 0.5];
const FIELD: [f64; 3] = [0.0, 18.0, -45.0];
const STEP_NANOS: i64 = 10_000_000;

/// Motion of the body.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Motion {
    Hand,
    Still,
    Turn,
    Car,
}

/// A recording and its truth.
#[derive(Clone)]
pub(super) struct Log {
    pub(super) samples: Vec<Sample>,
    pub(super) truth: Vec<[f64; 4]>,
}

pub(super) type Q = Quaternion<(), ()>;

pub(super) fn product(a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    (Q::assume_unit(*a) * Q::assume_unit(*b)).wxyz()
}

pub(super) fn conjugate(q: &[f64; 4]) -> [f64; 4] {
    Q::assume_unit(*q).inverse().wxyz()
}

pub(super) fn exp(phi: Vector3<f64>) -> [f64; 4] {
    Q::from_rotation_vector(&RotationVector(phi)).wxyz()
}

/// Gyro matrix less 1.
fn gyro_error() -> Matrix3<f64> {
    Matrix3::new(
        0.002, 0.001, -0.0005, 0.0005, 0.0025, 0.0008, -0.001, 0.0004, 0.0015,
    )
}

fn envelope(motion: Motion, t: f64, end: f64) -> f64 {
    if motion == Motion::Still || t <= 10.0 || t >= end - 10.0 {
        return 0.0;
    }
    (PI * (t - 10.0) / (end - 20.0)).sin().powi(2)
}

fn rate(motion: Motion, t: f64) -> Vector3<f64> {
    match motion {
        Motion::Hand => Vector3::new(
            1.5 * (1.1 * t).sin(),
            1.2 * (0.7 * t + 1.0).sin(),
            0.9 * (1.7 * t + 2.0).sin(),
        ),
        Motion::Still => Vector3::zeros(),
        Motion::Turn => Vector3::z() * 2.0,
        Motion::Car => Vector3::z() * (0.2 * (0.2 * t).sin()),
    }
}

fn acceleration(motion: Motion, t: f64, share: f64) -> Vector3<f64> {
    let within = |from: f64, to: f64| if t > from && t < to { 2.0 } else { 0.0 };
    match motion {
        Motion::Hand => {
            Vector3::new(
                2.0 * (2.3 * t).sin(),
                1.5 * (3.1 * t + 1.0).sin(),
                (2.9 * t + 2.0).sin(),
            ) * share
        }
        Motion::Still | Motion::Turn => Vector3::zeros(),
        Motion::Car => Vector3::x() * (within(20.0, 30.0) - within(80.0, 90.0)),
    }
}

/// 100 Hz over a minute; two for the car.
pub(super) fn log(motion: Motion) -> Log {
    let count: i32 = if motion == Motion::Car { 12001 } else { 6001 };
    let end = f64::from(count - 1) / 100.0;
    let inverse = (Matrix3::identity() + gyro_error()).try_inverse().unwrap();
    let mut q = [1.0, 0.0, 0.0, 0.0];
    let (mut samples, mut truth) = (Vec::new(), Vec::new());
    for i in 0..count {
        let t = f64::from(i) / 100.0;
        let share = envelope(motion, t, end);
        let w = rate(motion, t) * share;
        if i > 0 {
            q = Q::assume_unit(product(&q, &exp(w / 100.0)))
                .normalised()
                .wxyz();
        }
        let to_body = Q::assume_unit(q).to_dcm().as_matrix().transpose();
        let force = acceleration(motion, t, share) + Vector3::z() * 9.81;
        samples.push(Sample {
            stamp: Nanos(i64::from(i) * STEP_NANOS),
            rate: BodyRate(inverse * w + Vector3::from(BIAS)),
            force: Some(In::assume(to_body * force + Vector3::from(FORCE_BIAS))),
            field: Some(In::assume(
                to_body * Vector3::from(FIELD) + Vector3::from(IRON),
            )),
            is_saturated: false,
        });
        truth.push(q);
    }
    Log { samples, truth }
}

impl Log {
    /// Removes the magnetometer.
    pub(super) fn plain(mut self) -> Log {
        self.samples
            .iter_mut()
            .for_each(|sample| sample.field = None);
        self
    }

    /// Smoothed, with the attitude at every sample.
    pub(super) fn smoothed(&self, settings: &Settings) -> (Smoothed, Vec<Estimate>) {
        smoothed(&self.samples, settings)
    }
}

pub(super) fn smoothed(mut samples: &[Sample], settings: &Settings) -> (Smoothed, Vec<Estimate>) {
    let smoothed = smooth(&mut samples, settings).unwrap();
    let mut out = Vec::new();
    smoothed
        .attitudes(&mut samples, |chunk| out.extend_from_slice(chunk))
        .unwrap();
    assert_eq!(out.len(), samples.len());
    (smoothed, out)
}

/// Root mean squares and largest errors of tilt and heading, deg; aligned in heading at the first sample where
/// `is_aligned`.
pub(super) fn errors(estimates: &[Estimate], truth: &[[f64; 4]], is_aligned: bool) -> [f64; 4] {
    let error = |i: usize| product(&estimates[i].q_nb.wxyz(), &conjugate(&truth[i]));
    let first = error(0);
    let size = first[0].hypot(first[3]);
    let align = if is_aligned {
        [first[0] / size, 0.0, 0.0, -first[3] / size]
    } else {
        [1.0, 0.0, 0.0, 0.0]
    };
    let (mut tilt2, mut heading2, mut tilt_most, mut heading_most) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for i in 0..truth.len() {
        let e = product(&align, &error(i));
        let heading = (2.0 * e[3].abs().atan2(e[0].abs())).to_degrees();
        let tilt = (2.0 * e[1].hypot(e[2]).min(1.0).asin()).to_degrees();
        tilt2 += tilt * tilt;
        heading2 += heading * heading;
        tilt_most = tilt_most.max(tilt);
        heading_most = heading_most.max(heading);
    }
    let n = truth.len() as f64;
    [
        (tilt2 / n).sqrt(),
        (heading2 / n).sqrt(),
        tilt_most,
        heading_most,
    ]
}
