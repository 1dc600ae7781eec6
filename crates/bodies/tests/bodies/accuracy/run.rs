//! Samples -> attitudes through the public door, and how far they are from truth.

use strapd_attitude::propagate::{Method, Propagator, Sequential, Settings};
use strapd_attitude::quaternion::Quaternion;
use strapd_attitude::record::{
    AttitudeSample, Join, Measured, Nanos, RateSample, SampleKind, Status,
};

pub const ARCSEC: f64 = 3600.0;

/// A rate where it has no interval, otherwise an increment.
pub fn sample(start: i64, stamp: i64, value: [f64; 3]) -> RateSample {
    let kind = if start == stamp {
        SampleKind::Rate
    } else {
        SampleKind::DeltaAngle
    };
    RateSample {
        stamp: Nanos(stamp),
        start: Nanos(start),
        gyro: Measured::assume(kind, value.into()),
        accel: None,
        join: Join::Continuous,
        status: Status::OK,
        log: Nanos(stamp),
    }
}

pub fn propagator(method: Method, kind: SampleKind, initial: [f64; 4]) -> Propagator {
    Propagator::new(Settings {
        method,
        kind,
        initial: Quaternion::assume_unit(initial),
        ..Settings::default()
    })
    .unwrap()
}

pub fn propagate(
    method: Method,
    kind: SampleKind,
    initial: [f64; 4],
    samples: &[RateSample],
) -> Vec<AttitudeSample> {
    attitudes(propagator(method, kind, initial), samples)
}

/// Attitudes that a propagator makes of all samples of a run.
pub fn attitudes(mut propagator: Propagator, samples: &[RateSample]) -> Vec<AttitudeSample> {
    let mut out = Vec::new();
    propagator.push(samples, &Sequential, &mut out);
    propagator.finish(&Sequential, &mut out);
    assert_eq!(out.len(), samples.len(), "one attitude for every sample");
    out
}

/// Angle between two attitudes in degrees; exact for small ones.
pub fn angle_degrees(a: [f64; 4], b: [f64; 4]) -> f64 {
    let [aw, ax, ay, az] = a;
    let [bw, bx, by, bz] = b;
    let w = aw * bw + ax * bx + ay * by + az * bz;
    let x = aw * bx - ax * bw - ay * bz + az * by;
    let y = aw * by - ay * bw - az * bx + ax * bz;
    let z = aw * bz - az * bw - ax * by + ay * bx;
    let s = (x * x + y * y + z * z).sqrt();
    (2.0 * s.atan2(w.abs())).to_degrees()
}

/// Worst angle between outputs and truth, degrees.
pub fn worst(out: &[AttitudeSample], truth: impl Fn(usize) -> [f64; 4]) -> f64 {
    out.iter()
        .enumerate()
        .map(|(i, a)| angle_degrees(a.q_nb.wxyz(), truth(i)))
        .fold(0.0, f64::max)
}

/// Worst angle, in degrees, between what was turned since output `margin` and what truly was; the last
/// `margin` outputs left out. Keeps the ends of a run, where windows are one-sided, out of a figure.
pub fn worst_inside(
    out: &[AttitudeSample],
    truth: impl Fn(usize) -> [f64; 4],
    margin: usize,
) -> f64 {
    let since = |q0: [f64; 4], q: [f64; 4]| {
        let [w, x, y, z] = q0;
        product([w, -x, -y, -z], q)
    };
    (margin..out.len() - margin)
        .map(|i| {
            let estimate = since(out[margin].q_nb.wxyz(), out[i].q_nb.wxyz());
            angle_degrees(estimate, since(truth(margin), truth(i)))
        })
        .fold(0.0, f64::max)
}

/// Hamilton product.
pub fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let [aw, ax, ay, az] = a;
    let [bw, bx, by, bz] = b;
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
    ]
}
