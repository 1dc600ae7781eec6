//! Clocks of a live sensor: batches, a clock that was set or runs at another speed, a counter that wraps. Each is found,
//! said, and mended where it can be; good stamps stay as they are.

use super::client::Client;
use super::daemon::{Daemon, Process, TCP, eventually, listening};
use super::doubts::{codes, good, line};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::session::{Scratch, Session};
use strapd_attitude::record::Nanos;

const T0: i64 = 1_700_000_000_000_000_000;
const STEP: i64 = 10_000_000;

/// Status of a daemon to which the good stream came with these stamps, each at this time after the first.
fn received(stamp: impl Fn(i64) -> String, at: impl Fn(i64) -> i64) -> Value {
    let hub = Arc::new(Hub::new(Settings::default()).unwrap());
    let mut session = Session::new(&hub, "sender".to_owned(), true);
    let mut scratch = Scratch::default();
    for (n, sample) in (0..).zip(&good()) {
        let line = line("imu0", sample, &stamp(n));
        session.bytes(line.as_bytes(), Nanos(T0 + at(n)), &mut scratch);
        while session.is_held() {
            session.go_on(&mut scratch);
        }
    }
    serde_json::from_slice(&hub.status()).unwrap()
}

fn nanos(n: i64) -> String {
    format!("\"stamp_ns\":{n}")
}

/// Arrival of samples that are late by up to 4 ms.
fn late(n: i64) -> i64 {
    STEP * n + 4_000_000 * (n * 7 % 11) / 11
}

fn finding<'a>(status: &'a Value, code: &str) -> &'a Value {
    let all = status["sources"][0]["findings"].as_array().unwrap();
    all.iter()
        .find(|f| f["code"] == code)
        .unwrap_or(&Value::Null)
}

#[test]
fn a_clock_that_is_set_goes_on_and_is_said_and_one_of_another_speed_is_said() {
    let status = received(|n| nanos(T0 + STEP * n), late);
    assert_eq!(codes(&status, "imu0"), Vec::<String>::new());

    let set = |n: i64| if n < 1000 { 0 } else { 500_000_000 };
    let status = received(|n| nanos(T0 + STEP * n + set(n)), late);
    assert_eq!(codes(&status, "imu0"), ["clock-set"], "{status}");
    assert_eq!(status["sources"][0]["gaps"], 0);
    // Samples that are missing are no step.
    let gap = |n: i64| if n < 1000 { 0 } else { 100_000_000 };
    let status = received(|n| nanos(T0 + STEP * n + gap(n)), |n| late(n) + gap(n));
    assert_eq!(codes(&status, "imu0"), Vec::<String>::new(), "{status}");
    assert_eq!(status["sources"][0]["gaps"], 1);

    let status = received(|n| nanos(T0 + STEP / 2 * n), late);
    assert!(
        codes(&status, "imu0").contains(&"clock-speed".to_owned()),
        "{status}"
    );
    let what = finding(&status, "clock-speed")["what"].as_str().unwrap();
    assert!(what.contains("0.500 s"), "{what}");
    // A sender that falls behind for a while, and goes on at its pace; one that falls behind more and more.
    let ms = |n: i64| STEP / 1_000_000 * n;
    let for_a_while = |n: i64| 87_000 * ms(n).min(11_000);
    let more_and_more = |n: i64| 87_000 * ms(n) + 89_000 * (ms(n) - 9_000).max(0);
    for behind in [&for_a_while as &dyn Fn(i64) -> i64, &more_and_more] {
        let status = received(|n| nanos(T0 + STEP * n), |n| late(n) + behind(n));
        assert_eq!(codes(&status, "imu0"), Vec::<String>::new(), "{status}");
    }
    // As fast as it can be sent, and twice as fast as it was recorded at.
    let status = received(|n| nanos(T0 + STEP * n), |n| 1000 * n);
    assert_eq!(codes(&status, "imu0"), Vec::<String>::new());
}

#[test]
fn a_counter_that_wraps_goes_on_and_is_noted() {
    let wrapped = |n: i64| ((1_i64 << 32) - 5_003_000 + 10_000 * n) % (1 << 32);
    let status = received(|n| format!("\"stamp_us\":{}", wrapped(n)), late);
    assert_eq!(codes(&status, "imu0"), Vec::<String>::new(), "{status}");
    assert_eq!(status["sources"][0]["gaps"], 0);
    assert_eq!(finding(&status, "counter-wraps")["evidence"]["count"], 1);
}

/// Ten samples at a time, read 0.3 ms apart when the last was taken.
fn batched(n: i64) -> i64 {
    T0 + STEP * (n / 10 * 10 + 9) + 300_000 * (n % 10)
}

fn batches(range: std::ops::Range<i64>, stamp: impl Fn(i64) -> i64) -> String {
    let samples = good();
    let of = |n: i64| line("imu0", &samples[n as usize], &nanos(stamp(n)));
    range.map(of).collect()
}

fn stamp(att: &Value) -> i64 {
    let part = |name: &str| att["stamp"][name].as_i64().unwrap();
    part("sec") * 1_000_000_000 + part("nsec")
}

#[test]
fn batches_are_spread_evenly_and_said_and_missing_samples_are_none() {
    let daemon = Daemon::start(listening(&[TCP]));
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut stamps = Vec::new();
    for from in (0..2000).step_by(100) {
        sender.send_bytes(batches(from..from + 100, batched).as_bytes());
        stamps.extend((0..100).map(|_| stamp(&watcher.object("ATT"))));
    }
    assert!(stamps.is_sorted_by(|a, b| a < b));
    let steps = stamps.windows(2).skip(200).map(|w| w[1] - w[0]);
    let off = steps.map(|step| (step - STEP).abs()).max().unwrap();
    assert!(off < 500_000, "{off} ns");
    assert_eq!(codes(&daemon.status(), "imu0"), ["batches"]);

    let daemon = Daemon::start(listening(&[TCP]));
    let mut sender = Client::tcp(daemon.address(0));
    // Five samples of twenty-five.
    let kept = |n: i64| T0 + STEP * (n / 5 * 25 + n % 5);
    sender.send_bytes(batches(0..2000, kept).as_bytes());
    eventually("all samples", || {
        daemon.status()["sources"][0]["samples"] == 2000
    });
    assert!(!codes(&daemon.status(), "imu0").contains(&"batches".to_owned()));
}

fn started(state: &Path) -> Process {
    Process::start(&[
        "--listen",
        TCP,
        "--state",
        state.to_str().unwrap(),
        "--aid",
        "auto",
    ])
}

#[test]
fn batches_are_known_from_the_first_sample_after_a_restart() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    let mut process = started(&path);
    let mut sender = Client::tcp(process.address(0));
    sender.send_bytes(batches(0..1000, batched).as_bytes());
    eventually("the batches in the file, and all that was sent", || {
        std::fs::read_to_string(&path)
            .is_ok_and(|text| text.contains("\"batches\":[") && text.contains("\"index\":1000,"))
    });
    process.child.kill().unwrap();
    process.child.wait().unwrap();
    let process = started(&path);
    let mut watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(process.address(0));
    sender.send_bytes(batches(1000..1040, batched).as_bytes());
    let stamps: Vec<i64> = (0..40).map(|_| stamp(&watcher.object("ATT"))).collect();
    let steps = stamps.windows(2).map(|w| w[1] - w[0]);
    let off = steps.map(|step| (step - STEP).abs()).max().unwrap();
    assert!(off < 1_000_000, "{off} ns: {stamps:?}");
}
