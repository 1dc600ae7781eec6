//! Speed of reading a log: our walk with one and two threads against `mcap::MessageStream`, on a
//! generated log of 324-byte `sensor_msgs/msg/Imu` messages in 1 MiB chunks.
//!
//! `cargo bench --bench read_mcap`; `STRAPD_BENCH_MESSAGES` sets the size (default 1,000,000),
//! `STRAPD_BENCH_CHUNK` the chunk size in bytes.
//! Figures are the best of five, so that a busy machine disturbs the ratio least.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]

use std::hint::black_box;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use strapd_recording::mcap::{Message, Reader, WalkOptions, walk};

const RUNS: usize = 5;

/// Fields that a decoder needs at least: the header's stamp and the rate.
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
    Some(Rate {
        stamp,
        rate: [f64_at(at)?, f64_at(at + 8)?, f64_at(at + 16)?],
    })
}

/// A number given in the environment.
fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

fn generate(path: &Path, messages: u64, compression: Option<mcap::Compression>, chunked: bool) {
    let out = BufWriter::new(std::fs::File::create(path).unwrap());
    let options = mcap::WriteOptions::new()
        .compression(compression)
        .use_chunks(chunked)
        .compression_threads(0)
        .chunk_size(Some(setting("STRAPD_BENCH_CHUNK").unwrap_or(1 << 20)))
        .profile("ros2");
    let mut writer = options.create(out).unwrap();
    let schema = writer
        .add_schema("sensor_msgs/msg/Imu", "ros2msg", b"# Imu")
        .unwrap();
    let id = writer
        .add_channel(schema, "/imu/data_raw", "cdr", &Default::default())
        .unwrap();
    // A fixed linear congruential sequence: incompressible low bits, as a sensor has.
    let mut state = 1u64;
    let mut noise = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
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

/// Seconds of processor the threads of this process have had (Linux; 0 elsewhere).
fn cpu() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return 0.0;
    };
    tasks
        .flatten()
        .filter_map(|t| std::fs::read_to_string(t.path().join("schedstat")).ok())
        .filter_map(|s| s.split(' ').next()?.parse::<f64>().ok())
        .sum::<f64>()
        * 1e-9
}

/// `MessageStream` over a file already in memory: the sum of the first rates.
fn theirs(bytes: &[u8], check: bool) -> f64 {
    let flags = if check {
        mcap::read::Options::ValidateChunkCrcs.into()
    } else {
        Default::default()
    };
    mcap::MessageStream::new_with_options(bytes, flags)
        .unwrap()
        .map(|message| decode(&message.unwrap().data).unwrap().rate[0])
        .sum()
}

/// Our walk over the file: the sum of the first rates.
fn ours(path: &Path, pool: &rayon::ThreadPool, messages: u64) -> f64 {
    let options = WalkOptions {
        pool: Some(pool),
        ..WalkOptions::default()
    };
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
}

/// Least wall and processor seconds of each contender; they take turns, so that a busy moment of
/// the machine falls on all of them.
fn race(contenders: &[&dyn Fn() -> f64]) -> Vec<(f64, f64)> {
    let mut least = vec![(f64::INFINITY, f64::INFINITY); contenders.len()];
    for _ in 0..RUNS {
        for (run, least) in contenders.iter().zip(&mut least) {
            let (start, before) = (Instant::now(), cpu());
            black_box(run());
            least.0 = least.0.min(start.elapsed().as_secs_f64());
            least.1 = least.1.min(cpu() - before);
        }
    }
    least
}

fn main() {
    let messages = setting("STRAPD_BENCH_MESSAGES").unwrap_or(1_000_000);
    let dir = tempfile::tempdir().unwrap();
    let pools = [1, 2].map(|n| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap()
    });
    println!("{messages} messages; M messages/s by wall clock, [ns of processor per message]");
    println!("MessageStream: in memory already; also with the reading of the file, as ours has it");
    println!(
        "{:<10} {:>6} {:>14} {:>14} {:>14} {:>14} {:>14} {:>8}",
        "", "MB", "MessageStream", "with CRC", "with reading", "walk, 1", "walk, 2", "ratio"
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
        let bytes = std::fs::read(&path).unwrap();
        let times = race(&[
            &|| theirs(&bytes, false),
            &|| theirs(&bytes, true),
            &|| theirs(&std::fs::read(&path).unwrap(), false),
            &|| ours(&path, &pools[0], messages),
            &|| ours(&path, &pools[1], messages),
        ]);
        print!("{name:<10} {:>6.0}", bytes.len() as f64 / 1e6);
        for (wall, cpu) in &times {
            let n = messages as f64;
            print!(" {:>8.2} [{:>3.0}]", n / wall / 1e6, cpu / n * 1e9);
        }
        println!(
            " {:>4.1} {:>3.1}",
            times[0].0 / times[3].0,
            times[0].0 / times[4].0
        );
        std::fs::remove_file(&path).unwrap();
    }
}
