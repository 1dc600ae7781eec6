//! Allan deviation: against theory, against what was put in, and at its limits.

mod estimator;
mod recovery;
mod theory;

use strapd_attitude::noise::allan::{AngleRecord, Point, cluster_sizes, deviation};
use strapd_attitude::noise::sensor_error::{ConstantErrors, GyroModel, ImuError, Truth};
use strapd_attitude::record::{Nanos, SampleKind};

/// A sensor at rest (turning at `rate`, rad/s, about each axis) for `n` samples, gathered.
fn at_rest(
    error: &ImuError,
    kind: SampleKind,
    interval_nanos: i64,
    n: usize,
    seed: u64,
    rate: f64,
) -> AngleRecord {
    let constants = ConstantErrors::none();
    let mut gyro = GyroModel::with_constants(error, constants, kind, seed).unwrap();
    let secs = interval_nanos as f64 * 1e-9;
    let mut record = AngleRecord::new(usize::MAX);
    let mut truth = Truth::default();
    truth.rate.fill(rate);
    truth.delta_angle.fill(rate * secs);
    for i in 0..n as i64 {
        let (from, to) = (Nanos(i * interval_nanos), Nanos((i + 1) * interval_nanos));
        let read = gyro.measure(from, to, &truth).unwrap().gyro;
        record.push(&match kind {
            SampleKind::DeltaAngle | SampleKind::Rotation => read,
            _ => read * secs,
        });
    }
    record
}

/// The curve of one axis.
fn curve(record: &AngleRecord, axis: usize, interval_nanos: i64) -> Vec<Point> {
    let pieces = record.pieces(axis);
    let interval = interval_nanos as f64 * 1e-9 * record.stride() as f64;
    let longest = pieces.iter().map(|p| p.len()).max().unwrap();
    deviation(&pieces, interval, &cluster_sizes(longest, 12)).unwrap()
}
