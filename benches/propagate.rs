//! Nanoseconds per sample of every method, single core, samples in and attitudes out.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::hint::black_box;
use strapd::model::attitude::Quaternion;
use strapd::propagate::{Method, Noise, Order, Placement, Propagator, Sequential, Settings};
use strapd::record::{AttitudeSample, Join, Nanos, RateSample, SampleKind, Status};

const SAMPLES: usize = 65_536;

/// 200 Hz, 2 rad/s, a few Hz; optionally white noise of 5 mrad/s and stamps off by up to a fifth.
fn log(kind: SampleKind, noise: f64, jitter: bool) -> Vec<RateSample> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut before = 0;
    (0..SAMPLES)
        .map(|i| {
            let mut stamp = i as i64 * 5_000_000;
            if jitter {
                stamp += rng.random_range(-500_000..500_000);
            }
            let t = stamp as f64 * 1e-9;
            let mut axis = |f: f64, phase: f64| {
                (f * t * std::f64::consts::TAU + phase).sin() * 2.0
                    + noise * rng.random_range(-1.7..1.7)
            };
            let mut value = [axis(2.3, 0.0), axis(3.1, 1.0), axis(4.7, 2.0)];
            let start = if i == 0 { stamp - 5_000_000 } else { before };
            if kind != SampleKind::Rate {
                value = value.map(|v| v * (stamp - start) as f64 * 1e-9);
            }
            before = stamp;
            RateSample {
                stamp: Nanos(stamp),
                start: Nanos(if kind == SampleKind::Rate {
                    stamp
                } else {
                    start
                }),
                value: value.into(),
                accel: None,
                join: if i == 0 {
                    Join::Start
                } else {
                    Join::Continuous
                },
                status: Status::OK,
                log: Nanos(stamp),
            }
        })
        .collect()
}

fn run(method: Method, kind: SampleKind, samples: &[RateSample], out: &mut Vec<AttitudeSample>) {
    let noise = Noise::isotropic(2.4e-4, 1e-3);
    let mut propagator = Propagator::new(Settings {
        method,
        kind,
        initial: Quaternion::identity(),
        noise,
        ..Settings::default()
    })
    .unwrap();
    out.clear();
    for chunk in samples.chunks(8192) {
        propagator.push(chunk, &Sequential, out);
    }
    propagator.finish(&Sequential, out);
    black_box(out);
}

fn propagate(c: &mut Criterion) {
    let magnus = |window, order, placement| Method::Magnus {
        window,
        order,
        placement,
    };
    let commit = |window| Method::CommitProvisional {
        window,
        order: Order::M8,
        finals: false,
    };
    let methods = [
        ("dcm-right", Method::DcmRight),
        ("auto", Method::Auto),
        ("causal5-6", magnus(5, Order::M6, Placement::Causal)),
        ("centred8-8", magnus(8, Order::M8, Placement::Centred)),
        ("commit6", commit(6)),
        ("coning3", Method::Coning3),
        ("rk4", Method::Rk4),
    ];
    let inputs = [
        (
            "smooth",
            log(SampleKind::Rate, 0.0, false),
            SampleKind::Rate,
        ),
        (
            "noisy",
            log(SampleKind::Rate, 5e-3, false),
            SampleKind::Rate,
        ),
        (
            "jittered",
            log(SampleKind::Rate, 5e-3, true),
            SampleKind::Rate,
        ),
        (
            "increments",
            log(SampleKind::DeltaAngle, 5e-3, false),
            SampleKind::DeltaAngle,
        ),
        (
            "increments-jittered",
            log(SampleKind::DeltaAngle, 5e-3, true),
            SampleKind::DeltaAngle,
        ),
    ];
    let mut group = c.benchmark_group("propagate");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.sample_size(20);
    let mut out = Vec::with_capacity(SAMPLES);
    for (input, samples, kind) in &inputs {
        for (name, method) in methods {
            group.bench_with_input(BenchmarkId::new(name, input), samples, |b, samples| {
                b.iter(|| run(method, *kind, samples, &mut out));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, propagate);
criterion_main!(benches);
