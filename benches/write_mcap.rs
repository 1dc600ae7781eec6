//! Time from a sample to output, per format, on one thread and on two.
//!
//! `cargo bench --bench write_mcap`; the time shown is for one sample. Files go to a temporary
//! directory, and the sync at the end is part of the time, as it is in a run.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Duration;
use strapd::sink::{Compression, Encoding, Flow, Options, Provenance, Sink, Stream, Target};
use strapd_attitude::frames::In;
use strapd_attitude::quaternion::{BodyRate, Quaternion};
use strapd_attitude::record::{AttitudeCovariance, AttitudeSample, Nanos, Status};

/// A slow turn with full-entropy noise in rate and acceleration: the worst a compressor meets.
fn samples(count: usize) -> Vec<AttitudeSample> {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut noise = |scale: f64| scale * (random.random::<f64>() - 0.5);
    (0..count)
        .map(|k| {
            let stamp = Nanos(1_700_000_000_000_000_000 + 1_000_000 * k as i64);
            let angle = 1e-4 * k as f64 + noise(1e-6);
            let (s, c) = (0.5 * angle).sin_cos();
            AttitudeSample {
                stamp,
                q_nb: Quaternion::assume_unit([c, 0.6 * s, 0.0, 0.8 * s]),
                rate: BodyRate(Vector3::new(noise(0.01), noise(0.01), 0.1 + noise(0.01))),
                accel: Some(In::assume(Vector3::new(
                    noise(0.1),
                    noise(0.1),
                    9.8 + noise(0.1),
                ))),
                linear_acceleration: None,
                covariance: AttitudeCovariance::from_sigma(Vector3::repeat(
                    1e-5 * (k as f64).sqrt(),
                )),
                status: Status::OK,
                reset_count: 0,
                log: Nanos(stamp.0 + 150_000),
                temperature: None,
            }
        })
        .collect()
}

fn bench(c: &mut Criterion) {
    let samples = samples(400_000);
    let dir = tempfile::tempdir().unwrap();
    let mut group = c.benchmark_group("write");
    group
        .throughput(Throughput::Elements(samples.len() as u64))
        .sample_size(10)
        .measurement_time(Duration::from_secs(6));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        for (name, file, encoding, compression) in [
            ("mcap-none", "a.mcap", Encoding::Cdr, Compression::None),
            ("mcap-lz4", "b.mcap", Encoding::Cdr, Compression::Lz4),
            ("mcap-zstd", "c.mcap", Encoding::Cdr, Compression::Zstd),
            (
                "mcap-json-zstd",
                "d.mcap",
                Encoding::Json,
                Compression::Zstd,
            ),
            ("ndjson", "e.ndjson", Encoding::Cdr, Compression::None),
            ("csv", "f.csv", Encoding::Cdr, Compression::None),
        ] {
            let target = Target::from_path(&dir.path().join(file)).unwrap();
            let options = Options {
                force: true,
                encoding,
                compression,
                ..Options::default()
            };
            let streams = [Stream::new("/imu/data_raw", "imu_link")];
            let mut bytes = 0;
            group.bench_function(BenchmarkId::new(name, threads), |b| {
                b.iter(|| {
                    let provenance = Provenance::default();
                    let mut sink =
                        Sink::create(&target, &[], options, &streams, &provenance).unwrap();
                    for part in samples.chunks(3000) {
                        assert_eq!(sink.write(0, part, &pool).unwrap(), Flow::Continue);
                    }
                    bytes = sink.finish().unwrap().bytes;
                });
            });
            println!(
                "{name}: {:.1} bytes a sample",
                bytes as f64 / samples.len() as f64
            );
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
