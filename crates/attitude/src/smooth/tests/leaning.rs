//! A body that leans about every axis and never rests: gravity tells its bias, if nothing else claims to.

use super::logs::{Log, Q, errors, exp};
use crate::frames::In;
use crate::quaternion::BodyRate;
use crate::record::Nanos;
use crate::smooth::{Outcome, PriorScale, Sample, Settings};
use nalgebra::{Matrix3, Vector3};

const HZ: f64 = 50.0;
const SECS: f64 = 100.0;

/// Sines of these rates, rad/s, with unit rms about each axis.
fn sines(rates: [[f64; 3]; 3], t: f64) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let wave = |(i, rate): (usize, &f64)| (rate * t + (2 * i + 3 * axis) as f64).sin();
        rates[axis].iter().enumerate().map(wave).sum::<f64>() * (2.0_f64 / 3.0).sqrt()
    })
}

/// A camera in the hand that looks about; `bias` of its gyro, deg/s, and `off` of its accelerometer, m/s^2.
fn camera(bias: [f64; 3], off: [f64; 3]) -> Log {
    let attitude = |t: f64| {
        let looks = [[0.5, 1.3, 2.7], [0.4, 1.7, 2.3], [0.6, 1.1, 2.9]];
        Q::assume_unit(exp(sines(looks, t) * 0.35))
    };
    let place = |t: f64| sines([[0.7, 1.9, 2.5], [0.9, 1.5, 2.2], [0.8, 1.4, 2.8]], t) * 0.12;
    let bias = Vector3::from(bias.map(f64::to_radians));
    // A share of scale and axes, and 0.1 deg/s per g.
    let errors_of =
        Matrix3::identity() + Matrix3::new(0.8, -1.2, 0.7, 1.0, -0.9, 1.1, -0.8, 0.6, 1.0) * 0.01;
    let sensitive = Matrix3::new(0.9, 1.1, -0.8, -1.0, 0.8, 0.7, 1.2, -0.9, 1.0)
        * (0.1_f64.to_radians() / 9.81);
    let (step, wide) = (1.0 / HZ, 1e-3);
    let sample = |k: usize| {
        let t = k as f64 * step;
        let turn = (attitude(t - step).inverse() * attitude(t))
            .rotation_vector()
            .0;
        let mid = t - 0.5 * step;
        let push = (place(mid + wide) + place(mid - wide) - place(mid) * 2.0) / (wide * wide);
        let to_body = attitude(mid).to_dcm().as_matrix().transpose();
        let force = to_body * (push + Vector3::z() * 9.81);
        Sample {
            stamp: Nanos((t * 1e9).round() as i64),
            rate: BodyRate(errors_of * (turn / step) + bias + sensitive * force),
            force: Some(In::assume(force + Vector3::from(off))),
            field: None,
            is_saturated: false,
        }
    };
    let count = (SECS * HZ) as usize;
    Log {
        samples: (1..=count).map(sample).collect(),
        truth: (1..=count)
            .map(|k| attitude(k as f64 * step).wxyz())
            .collect(),
    }
}

#[test]
fn a_camera_that_never_rests_is_no_worse_off_than_its_sigma() {
    let log = camera([0.3, -0.4, 0.9], [0.2, -0.2, 0.2]);
    let settings = Settings {
        looseness: PriorScale {
            scale: 2.5,
            axes: 6.0,
            force: 5.0,
            sensitivity: 16.7,
        },
        ..Settings::default()
    };
    let (smoothed, estimates) = log.smoothed(&settings);
    assert!(
        !matches!(smoothed.outcome(), Outcome::Filter(_)),
        "{:?}",
        smoothed.outcome()
    );
    let [_, rms, _, most] = errors(&estimates, &log.truth, true);
    let last = estimates.last().unwrap();
    let sigma = last.covariance[(2, 2)].sqrt().to_degrees();
    assert!(rms < 10.0 && most < 3.0 * sigma, "{rms} {most} {sigma}");
    // As far as it strays (0.12 m rms), not as far as wrong tilts would bring it.
    let [_, place] = smoothed.bound;
    assert!(place < 0.25, "{place}");
}
