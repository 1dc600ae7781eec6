//! How fast a log is read: our walk with one and two threads against `mcap::MessageStream`, on a
//! generated log of 324-byte `sensor_msgs/msg/Imu` messages in 1 MiB chunks.
//!
//! `cargo bench --bench read_mcap`; `STRAPD_BENCH_MESSAGES` sets the size (default 1,000,000).
//! Figures are the best of five, so that a busy machine disturbs the ratio least.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]

use std::hint::black_box;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use strapd::source::mcap::{Message, Reader, WalkOptions, walk};

const RUNS: usize = 5;

/// What a decoder needs at least: the header's stamp and the rate.
#[derive(Clone, Copy)]
struct Rate {
    #[allow(dead_code)]
    stamp: i64,
    rate: [f64; 3],
}

/// Little-endian CDR of an Imu with a frame id of 8 bytes: stamp at 4, rate at 72 of 324.
fn payload(i: u64, noise: &mut impl FnMut() -> f64) -> Vec<u8> {
    let mut p = vec![0, 1, 0, 0];
    p.extend((1_700_000_000 + (i / 1000) as u32).to_le_bytes());
    p.extend(((i % 1000) as u32 * 1_000_000).to_le_bytes());
    p.extend(9u32.to_le_bytes());
    p.extend(b"imu_link\0");
    while p.len() % 8 != 4 {
        p.push(0);
    }
    let t = i as f64 * 1e-3;
    for k in 0..37 {
        let value = match k {
            0..=3 => 0.5,
            13 | 17 | 21 => 1e-4,
            22..=24 => (t * (k as f64)).sin() + 1e-3 * noise(),
            34..=36 => 9.81 * (t + k as f64).cos() + 1e-2 * noise(),
            4 | 25 => -1.0,
            _ => 0.0,
        };
        p.extend(f64::to_le_bytes(value));
    }
    p
}

fn decode(p: &[u8]) -> Option<Rate> {
    let u32_at = |at: usize| Some(u32::from_le_bytes(*p.get(at..)?.first_chunk()?));
    let f64_at = |at: usize| Some(f64::from_le_bytes(*p.get(at..)?.first_chunk()?));
    let stamp = i64::from(u32_at(4)?) * 1_000_000_000 + i64::from(u32_at(8)?);
    let at = 28 + 13 * 8;
    Some(Rate { stamp, rate: [f64_at(at)?, f64_at(at + 8)?, f64_at(at + 16)?] })
}

fn generate(path: &Path, messages: u64, compression: Option<mcap::Compression>, chunked: bool) {
    let out = BufWriter::new(std::fs::File::create(path).unwrap());
    let options = mcap::WriteOptions::new()
        .compression(compression)
        .use_chunks(chunked)
        .compression_threads(0)
        .chunk_size(Some(1 << 20))
        .profile("ros2");
    let mut writer = options.create(out).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/Imu", "ros2msg", b"# Imu").unwrap();
    let id = writer.add_channel(schema, "/imu/data_raw", "cdr", &Default::default()).unwrap();
    // A fixed linear congruential sequence: incompressible low bits, as a sensor has.
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for i in 0..messages {
        let log_time = 1_700_000_000_000_000_000 + i * 1_000_000;
        let header = mcap::records::MessageHeader {
            channel_id: id,
            sequence: i as u32,
            log_time,
            publish_time: log_time,
        };
        let payload = payload(i, &mut noise);
        debug_assert_eq!(payload.len(), 324);
        writer.write_to_known_channel(&header, &payload).unwrap();
    }
    writer.finish().unwrap();
}

fn best(mut run: impl FnMut() -> f64) -> (f64, f64) {
    let mut least = f64::INFINITY;
    let mut sum = 0.0;
    for _ in 0..RUNS {
        let start = Instant::now();
        sum = run();
        least = least.min(start.elapsed().as_secs_f64());
    }
    (least, sum)
}

fn theirs(path: &Path, check: bool) -> f64 {
    let bytes = std::fs::read(path).unwrap();
    let (time, sum) = best(|| {
        let flags = if check {
            mcap::read::Options::ValidateChunkCrcs.into()
        } else {
            Default::default()
        };
        let mut sum = 0.0;
        for message in mcap::MessageStream::new_with_options(&bytes, flags).unwrap() {
            sum += decode(&message.unwrap().data).unwrap().rate[0];
        }
        sum
    });
    black_box(sum);
    time
}

fn ours(path: &Path, threads: usize, messages: u64) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut options = WalkOptions { pool: Some(&pool), ..WalkOptions::default() };
    if let Some(n) = std::env::var("INF").ok().and_then(|n| n.parse().ok()) { options.in_flight = n; }
    if let Some(n) = std::env::var("LOOK").ok().and_then(|n| n.parse().ok()) { options.lookahead.bytes = n; }
    let (time, sum) = best(|| {
        let mut sum = 0.0;
        let report = walk(
            Reader::open(path).unwrap(),
            &options,
            |_| Some(()),
            |(), m: &Message<'_>, out: &mut Vec<Rate>| out.extend(decode(m.data)),
            |batch| {
                sum += batch.iter().map(|r| r.rate[0]).sum::<f64>();
                ControlFlow::Continue(())
            },
        )
        .unwrap();
        assert_eq!(report.items, messages);
        assert!(report.survey.problems.is_empty());
        sum
    });
    black_box(sum);
    time
}

fn main() {
    let messages = std::env::var("STRAPD_BENCH_MESSAGES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(1_000_000u64);
    let dir = tempfile::tempdir().unwrap();
    println!("{messages} messages; M messages/s, and how often MessageStream's rate");
    println!(
        "{:<10} {:>8} {:>14} {:>10} {:>16} {:>16}",
        "", "MB", "MessageStream", "with CRC", "1 thread", "2 threads"
    );
    let kinds = [
        ("none", None, true),
        ("lz4", Some(mcap::Compression::Lz4), true),
        ("zstd", Some(mcap::Compression::Zstd), true),
        ("unchunked", None, false),
    ];
    for (name, compression, chunked) in kinds {
        let path = dir.path().join(format!("{name}.mcap"));
        generate(&path, messages, compression, chunked);
        let size = std::fs::metadata(&path).unwrap().len() as f64 / 1e6;
        let rate = |time: f64| messages as f64 / time / 1e6;
        let (stream, checked) = (theirs(&path, false), theirs(&path, true));
        let (one, two) = (ours(&path, 1, messages), ours(&path, 2, messages));
        println!(
            "{name:<10} {size:>8.0} {:>14.2} {:>10.2} {:>8.2} ({:>4.1}x) {:>8.2} ({:>4.1}x)",
            rate(stream),
            rate(checked),
            rate(one),
            stream / one,
            rate(two),
            stream / two,
        );
        std::fs::remove_file(&path).unwrap();
    }
}
