//! Nanoseconds per sample of every method, single core, samples in and attitudes out; at last their ratios to a
//! bare exponential a sample, measured in turn.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    unreachable_pub
)]

#[path = "propagate/cases.rs"]
mod cases;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Instant;

const SAMPLES: usize = 65_536;

fn propagate(c: &mut Criterion) {
    let mut group = c.benchmark_group("propagate");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.sample_size(20);
    let mut out = Vec::with_capacity(SAMPLES);
    for (name, input) in cases::INPUTS {
        let samples = cases::log(SAMPLES, &input);
        for (method_name, method) in cases::METHODS {
            group.bench_with_input(
                BenchmarkId::new(method_name, name),
                &samples,
                |b, samples| {
                    b.iter(|| {
                        cases::run(method, input.kind, samples, &mut out).unwrap();
                        black_box(&out);
                    });
                },
            );
        }
    }
    group.finish();
}

/// Runs every method once in each round, one after another: a slow moment hits neighbours alike. Pieces short enough to
/// fit between two interruptions; the least time of all rounds, and the median of the rounds' ratios.
fn ratios(_: &mut Criterion) {
    const ROUNDS: usize = 101;
    const PIECE: usize = 4096;
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    for (name, input) in cases::INPUTS {
        let samples = cases::log(PIECE, &input);
        let mut out = Vec::with_capacity(PIECE);
        let mut seconds = [[0.0; ROUNDS]; cases::METHODS.len()];
        for round in 0..ROUNDS {
            for (row, (_, method)) in seconds.iter_mut().zip(cases::METHODS) {
                let start = Instant::now();
                cases::run(method, input.kind, &samples, &mut out).unwrap();
                black_box(&out);
                row[round] = start.elapsed().as_secs_f64();
            }
        }
        println!("\n| {name} | ns per sample | of the bare exponential's |\n|---|---|---|");
        for (row, (method_name, _)) in seconds.iter().zip(cases::METHODS) {
            let mut ratios: [f64; ROUNDS] = std::array::from_fn(|i| row[i] / seconds[0][i]);
            ratios.sort_by(f64::total_cmp);
            let ratio = ratios[ROUNDS / 2];
            let least = row.iter().fold(f64::INFINITY, |least, t| least.min(*t));
            let nanos = least * 1e9 / PIECE as f64;
            println!("| {method_name} | {nanos:.0} | {ratio:.2} |");
        }
    }
}

criterion_group!(benches, propagate, ratios);
criterion_main!(benches);
