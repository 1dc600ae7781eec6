//! Cost of one more sensor in one daemon: bytes, its birth, and a sample, from 1 to 100,000 sensors at the same
//! number of samples in all. The figures stand in `docs/scale.md`.
//!
//! `cargo bench --bench fleet -- [gyro|aided] [SENSORS...]`, each in a process of its own, since memory is that of the
//! process. In process, over the hub and its sessions, packed, blocks of ten samples.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]

use std::process::Command;
use std::sync::Arc;
use std::time::Instant;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::session::{Scratch, Session};
use strapd::serve::guard::limits::Limits;
use strapd_attitude::estimate::{Aid, EstimationSettings};
use strapd_attitude::record::Nanos;

/// Samples in all, but for what makes each sensor known.
const SAMPLES: usize = 2_000_000;
/// Samples in a block.
const BLOCK: usize = 10;
/// Blocks until a sensor holds all it ever will.
const FIRST: usize = 40;
/// Sensors of one connection.
const OF_ONE: usize = 200;

/// Bytes of the process in memory.
fn resident() -> usize {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|l| l.starts_with("VmRSS:")).unwrap();
    line.split_whitespace()
        .nth(1)
        .unwrap()
        .parse::<usize>()
        .unwrap()
        * 1024
}

fn packed(out: &mut Vec<u8>, stream: u32, nanos: i64, rate: f64, is_aided: bool) {
    out.extend_from_slice(&[0xF8, 1]);
    let length: u16 = if is_aided { 72 } else { 48 };
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(&stream.to_le_bytes());
    out.extend_from_slice(&u64::MAX.to_le_bytes());
    out.extend_from_slice(&nanos.to_le_bytes());
    for value in [rate, 0.1, -0.2] {
        out.extend_from_slice(&value.to_le_bytes());
    }
    if is_aided {
        for value in [0.1, rate, 9.8] {
            out.extend_from_slice(&f64::to_le_bytes(value));
        }
    }
}

fn one(is_aided: bool, sensors: usize) {
    let limits = Limits {
        sensors,
        sensors_of_client: OF_ONE,
        ..Limits::default()
    };
    let plan = EstimationSettings {
        aid: if is_aided { Aid::Gravity } else { Aid::None },
        ..EstimationSettings::default()
    };
    let settings = Settings {
        limits,
        plan,
        ..Settings::default()
    };
    let hub = Arc::new(Hub::new(settings).unwrap());
    let mut scratch = Scratch::default();
    let connections = sensors.div_ceil(OF_ONE);
    let mut sessions: Vec<Session> = (0..connections)
        .map(|n| Session::new(&hub, format!("sender {n}"), true))
        .collect();
    let mut bytes = Vec::new();
    let block = |bytes: &mut Vec<u8>, sensor: usize, first: usize| {
        bytes.clear();
        for k in first..first + BLOCK {
            let nanos = 1_000_000_000_000 + k as i64 * 10_000_000;
            let rate = (k as f64 * 0.013 + sensor as f64).sin();
            packed(bytes, (sensor % OF_ONE) as u32, nanos, rate, is_aided);
        }
    };
    let before = resident();
    let begin = Instant::now();
    for sensor in 0..sensors {
        let session = &mut sessions[sensor / OF_ONE];
        let line = format!(
            "{{\"class\":\"PACKED\",\"stream\":{},\"id\":\"s{sensor}\"}}\n",
            sensor % OF_ONE
        );
        session.bytes(line.as_bytes(), Nanos(0), &mut scratch);
        block(&mut bytes, sensor, 0);
        session.bytes(&bytes, Nanos(0), &mut scratch);
        while session.is_held() {
            session.go_on(&mut scratch);
        }
    }
    let born = begin.elapsed().as_secs_f64() / sensors as f64;
    let mut turn = |rounds: std::ops::Range<usize>| {
        for round in rounds {
            for sensor in 0..sensors {
                let session = &mut sessions[sensor / OF_ONE];
                block(&mut bytes, sensor, round * BLOCK);
                session.bytes(&bytes, Nanos(0), &mut scratch);
                while session.is_held() {
                    session.go_on(&mut scratch);
                }
            }
        }
    };
    turn(1..FIRST);
    let each = (resident() - before.min(resident())) / sensors;
    let rounds = (SAMPLES / BLOCK / sensors).max(1);
    let begin = Instant::now();
    turn(FIRST..FIRST + rounds);
    let sample = begin.elapsed().as_secs_f64() / (rounds * sensors * BLOCK) as f64;
    let state: usize = hub
        .saved()
        .values()
        .take(1)
        .map(|saved| serde_json::to_vec(saved).unwrap().len())
        .sum();
    println!(
        "{} {sensors:7} sensors: {:6.1} KiB each, {:6.1} us at birth (10 samples), {:5.2} us a sample, {:.1} KiB of state",
        if is_aided { "aided" } else { "gyro " },
        each as f64 / 1024.0,
        born * 1e6,
        sample * 1e6,
        state as f64 / 1024.0,
    );
    let taken = hub
        .counters
        .samples
        .load(std::sync::atomic::Ordering::Relaxed);
    assert_eq!(
        taken as usize,
        sensors * BLOCK * (FIRST + rounds),
        "all were taken"
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let kinds: Vec<&str> = ["gyro", "aided"]
        .into_iter()
        .filter(|kind| {
            !arguments
                .iter()
                .any(|a| ["gyro", "aided"].contains(&&**a) && a != kind)
        })
        .collect();
    let counts: Vec<usize> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    if let ([kind], [count]) = (&kinds[..], &counts[..]) {
        return one(*kind == "aided", *count);
    }
    let counts = match counts.is_empty() {
        true => vec![1, 10, 100, 1000, 10_000, 100_000],
        false => counts,
    };
    for kind in kinds {
        for count in &counts {
            let status = Command::new(std::env::current_exe().unwrap())
                .args([kind, &count.to_string()])
                .status()
                .unwrap();
            assert!(status.success());
        }
    }
}
