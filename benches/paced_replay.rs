//! Timing of `strapd replay --speed 1`: when each attitude arrives at a
//! watcher over TCP, against when it is due. The figures stand in `docs/performance.md`, "Paced replay".
//!
//! `cargo bench --bench paced_replay -- [SECONDS]`, default 60. Made by `strapd simulate` first. Due is
//! the median arrival plus the time in the data: a constant delay is no unevenness.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Samples a second of the logs.
const RATES_HZ: [u64; 3] = [100, 1000, 8000];

fn strapd() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_strapd"));
    // The gyro alone, as ever: figures are compared with older ones.
    command.env("STRAPD_AID", "none");
    command
}

fn stamp_nanos(object: &serde_json::Value) -> i64 {
    let stamp = &object["stamp"];
    stamp["sec"].as_i64().unwrap() * 1_000_000_000 + stamp["nsec"].as_i64().unwrap()
}

/// Milliseconds too late (or early) of every attitude but the first tenth of a second's, with its time
/// in the data, s.
fn lateness(log: &Path, hz: u64) -> Vec<(f64, f64)> {
    let mut child = strapd()
        .arg("replay")
        .arg(log)
        .args([
            "--method",
            "commit",
            "--speed",
            "1",
            "--paused",
            "--log-format",
            "json",
        ])
        .args(["-o", "tcp-listen://127.0.0.1:0"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap()).lines();
    let ready =
        said.find_map(|line| Some(line.ok()?.split_once("ready tcp-listen://")?.1.to_owned()));
    let address = ready.unwrap();
    let stream = TcpStream::connect(address.split('"').next().unwrap()).unwrap();
    stream.set_nodelay(true).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(10)))
        .unwrap();
    (&stream)
        .write_all(b"{\"class\":\"WATCH\"}\n{\"class\":\"PLAYBACK\",\"action\":\"play\"}\n")
        .unwrap();
    let begin = Instant::now();
    let mut arrivals = Vec::new();
    let mut line = String::new();
    let mut reader = BufReader::new(&stream);
    while reader.read_line(&mut line).is_ok_and(|n| n > 0) {
        let now = begin.elapsed().as_secs_f64();
        if line.starts_with("{\"class\":\"ATT\"") {
            let object: serde_json::Value = serde_json::from_str(&line).unwrap();
            arrivals.push((now, stamp_nanos(&object)));
        }
        line.clear();
    }
    child.wait().unwrap();
    let first = arrivals.first().unwrap().1;
    let early = (hz / 10) as usize;
    let late: Vec<(f64, f64)> = arrivals
        .iter()
        .skip(early)
        .map(|(at, stamp)| {
            let due = (stamp - first) as f64 * 1e-9;
            (due, (at - due) * 1e3)
        })
        .collect();
    let mut sorted: Vec<f64> = late.iter().map(|(_, ms)| *ms).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    late.into_iter()
        .map(|(due, ms)| (due, ms - middle))
        .collect()
}

fn main() {
    let secs: u64 = std::env::args()
        .skip(1)
        .find_map(|a| a.parse().ok())
        .unwrap_or(60);
    let dir = tempfile::tempdir().unwrap();
    println!(
        "| Hz | attitudes | p50 of abs(late - median) ms | p99 | p99.9 | max | drift ms over {secs} s |"
    );
    println!("|---|---|---|---|---|---|---|");
    for hz in RATES_HZ {
        let log = dir.path().join(format!("{hz}.mcap"));
        let made = strapd()
            .args([
                "simulate",
                "coning",
                "--quiet",
                "--rate-hz",
                &hz.to_string(),
            ])
            .args(["--duration", &secs.to_string(), "-o"])
            .arg(&log)
            .status()
            .unwrap();
        assert!(made.success());
        let late = lateness(&log, hz);
        let mut sizes: Vec<f64> = late.iter().map(|(_, ms)| ms.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let at = |share: f64| sizes[((sizes.len() - 1) as f64 * share) as usize];
        // Medians of the first and the last tenth: single late ones are no drift.
        let tenth = late.len() / 10;
        let median = |part: &[(f64, f64)]| {
            let mut ms: Vec<f64> = part.iter().map(|(_, ms)| *ms).collect();
            ms.sort_by(f64::total_cmp);
            ms[ms.len() / 2]
        };
        println!(
            "| {hz} | {} | {:.3} | {:.3} | {:.3} | {:.3} | {:+.3} |",
            late.len(),
            at(0.5),
            at(0.99),
            at(0.999),
            at(1.0),
            median(&late[late.len() - tenth..]) - median(&late[..tenth])
        );
    }
}
