//! The gyro error model: what each term does, that a seed means the same everywhere, what is refused.

mod chain;
mod magnetometer;
mod numbers;
mod parameters;
mod stamps;

use nalgebra::Vector3;
use strapd_attitude::noise::sensor_error::{ConstantErrors, GyroModel, ImuError, Measured, Truth};
use strapd_attitude::record::{Nanos, SampleKind};

/// A sensor without constant errors.
fn sensor(text: &str, kind: SampleKind, seed: u64) -> GyroModel {
    let error = ImuError::parse(text).unwrap();
    GyroModel::with_constants(&error, ConstantErrors::none(), kind, seed).unwrap()
}

/// Readings over `n` intervals of `step` nanoseconds of a motion given as rate and angle over time (s).
fn read(
    gyro: &mut GyroModel,
    step: i64,
    n: i64,
    rate: impl Fn(f64) -> Vector3<f64>,
    angle: impl Fn(f64) -> Vector3<f64>,
) -> Vec<Measured> {
    (0..n)
        .map(|i| {
            let (from, to) = (i * step, (i + 1) * step);
            let (a, b) = (from as f64 * 1e-9, to as f64 * 1e-9);
            let truth = Truth {
                rate: rate(b),
                delta_angle: angle(b) - angle(a),
                ..Truth::default()
            };
            gyro.measure(Nanos(from), Nanos(to), &truth).unwrap()
        })
        .collect()
}

/// Readings at rest.
fn rest(gyro: &mut GyroModel, step: i64, n: i64) -> Vec<Vector3<f64>> {
    read(gyro, step, n, |_| Vector3::zeros(), |_| Vector3::zeros())
        .iter()
        .map(|m| m.gyro)
        .collect()
}
