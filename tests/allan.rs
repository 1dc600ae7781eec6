//! Allan deviation: against theory, against what was put in, and at its limits.
#![allow(clippy::print_stdout, reason = "figures, with --nocapture")]
#![cfg(feature = "random")]
#![allow(clippy::unwrap_used)]

#[path = "allan/estimator.rs"]
mod estimator;
#[path = "allan/recovery.rs"]
mod recovery;
#[path = "allan/theory.rs"]
mod theory;

use strapd::model::allan::{AngleRecord, Point, cluster_sizes, deviation};
use strapd::model::imu_error::{ConstantErrors, GyroModel, ImuError, Truth};
use strapd::record::{Nanos, SampleKind};

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
            SampleKind::DeltaAngle => read,
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
