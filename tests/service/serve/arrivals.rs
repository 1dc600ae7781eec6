//! Promise: samples without a stamp are not used unless the address says so; then they are stamped when they come, and
//! lie evenly, however they are bundled.

use super::client::Client;
use super::daemon::{Daemon, TCP, eventually, listening};
use serde_json::Value;
use std::collections::VecDeque;
use std::sync::Arc;
use strapd::serve::core::hub::{Hub, Settings};
use strapd::serve::core::reading::LineParameters;
use strapd::serve::core::session::{Scratch, Session};
use strapd_attitude::record::Nanos;

const T0: i64 = 1_700_000_000_000_000_000;
/// Amplitude and frequency of a rotation about z: rate, rad/s, and angle, rad, are known exactly.
const RATE: f64 = 2.0;
const OMEGA: f64 = 3.0;

/// Yaws that a hub makes of lines, each with the time it is received at, rad, and its `STATUS`.
fn yaws(by_arrival: bool, lines: &[(i64, String)]) -> (Vec<f64>, Value) {
    let hub = Arc::new(
        Hub::new(Settings {
            lines: LineParameters {
                by_arrival,
                ..LineParameters::default()
            },
            ..Settings::default()
        })
        .unwrap(),
    );
    let mut sender = Session::new(&hub, "sender".to_owned(), true);
    let mut watcher = Session::new(&hub, "watcher".to_owned(), true);
    let mut scratch = Scratch::default();
    watcher.bytes(b"{\"class\":\"WATCH\"}\n", Nanos(0), &mut scratch);
    let mut out = Vec::new();
    // What comes together is read at once.
    for read in lines.chunk_by(|a, b| a.0 == b.0) {
        let text: String = read.iter().map(|(_, line)| format!("{line}\n")).collect();
        sender.bytes(text.as_bytes(), Nanos(read[0].0), &mut scratch);
        let mut chunks = VecDeque::new();
        let outbox = &watcher.client().outbox;
        let bytes = outbox.take(usize::MAX, &mut chunks);
        outbox.written(bytes);
        chunks.iter().for_each(|c| out.extend_from_slice(c));
    }
    let yaw = |line: &str| {
        let value: Value = serde_json::from_str(line).unwrap();
        let q = value.get("q")?;
        Some(2.0 * q["z"].as_f64()?.atan2(q["w"].as_f64()?))
    };
    let yaws = String::from_utf8(out)
        .unwrap()
        .lines()
        .filter_map(yaw)
        .collect();
    (yaws, serde_json::from_slice(&hub.status()).unwrap())
}

/// Mean rate over the step up to `t`, of a sensor with this step.
fn line(stamp: Option<i64>, t: f64, step: f64) -> String {
    let angle = |t: f64| RATE / OMEGA * (1.0 - (OMEGA * t).cos());
    let rate = (angle(t) - angle(t - step)) / step;
    let stamp = stamp.map_or(String::new(), |stamp| format!("\"stamp_ns\":{stamp},"));
    format!("{{{stamp}\"sample_kind\":\"average\",\"gyro\":[0,0,{rate}]}}")
}

#[test]
fn samples_of_a_fifo_give_the_attitude_of_even_stamps() {
    for (step_ns, size) in [(1_000_000, 10), (5_000_000, 10), (10_000_000, 1)] {
        let step = step_ns as f64 * 1e-9;
        let count = 4000;
        let truth = |n: i64| RATE / OMEGA * (1.0 - (OMEGA * n as f64 * step).cos());
        let at = |n: i64| n as f64 * step;
        let even: Vec<_> = (0..count)
            .map(|n| (T0 + n * step_ns, line(Some(T0 + n * step_ns), at(n), step)))
            .collect();
        let bundled: Vec<_> = (0..count)
            .map(|n| {
                let last = n / size * size + size - 1;
                // Late by up to 0.3 ms, as USB is.
                let late = last * 7919 % 300_000;
                (T0 + last * step_ns + late, line(None, at(n), step))
            })
            .collect();
        let (expected, _) = yaws(false, &even);
        let (got, status) = yaws(true, &bundled);
        assert_eq!(
            (expected.len(), got.len()),
            (count as usize, count as usize)
        );
        let off = |yaws: &[f64], of: &dyn Fn(usize) -> f64| {
            let each = yaws.iter().enumerate();
            each.map(|(n, yaw)| (yaw - yaws[0] - of(n)).abs().to_degrees())
                .fold(0.0, f64::max)
        };
        let against_even = off(&got, &|n| expected[n] - expected[0]);
        let against_truth = off(&got, &|n| truth(n as i64));
        println!(
            "{step_ns} ns, {size} at once: {against_even:.4} deg of even stamps, {against_truth:.4} of the truth"
        );
        assert!(
            against_even < 0.1 && against_truth < 0.1,
            "{step_ns} {size}"
        );
        let arrival = &status["sources"][0]["arrival"];
        let rate = arrival["rate_hz"].as_f64().unwrap();
        assert!((rate * step - 1.0).abs() < 1e-3, "{arrival}");
        let latency = arrival["latency_s"].as_f64().unwrap();
        let expected = (size - 1) as f64 / 2.0 * step;
        assert!((latency - expected).abs() < 1e-3, "{arrival}");
        assert!(arrival["waited_s"].as_f64().unwrap() < 2.1, "{arrival}");
    }
}

#[test]
fn without_the_setting_they_are_refused_with_its_name() {
    let daemon = Daemon::start(listening(&[TCP, &format!("{TCP}?stamp=arrival&id=board")]));
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    for _ in 0..20 {
        sender.send("{\"gyro\":[0.1,0,0]}");
    }
    let error = sender.object("ERROR");
    assert_eq!(error["code"], "no_stamp");
    assert!(
        error["message"]
            .as_str()
            .unwrap()
            .contains("?stamp=arrival"),
        "{error}"
    );
    eventually("all of them are refused", || {
        daemon.status()["refused"][0]["count"] == 20
    });
    assert_eq!(daemon.status()["sources"][0]["attitudes"], 0);
    // Rows without a column of time, with it: all are used, the last ones at the latest after two seconds.
    let mut watcher =
        Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\",\"id\":\"board\"}");
    let mut sender = Client::tcp(daemon.address(1));
    sender.send_bytes(b"gx_dps,gy_dps,gz_dps\n");
    for n in 0..40 {
        sender.send_bytes(format!("{n},0,1\n").as_bytes());
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let stamps: Vec<f64> = (0..40)
        .map(|_| {
            let stamp = &watcher.object("ATT")["stamp"];
            stamp["sec"].as_f64().unwrap() + 1e-9 * stamp["nsec"].as_f64().unwrap()
        })
        .collect();
    assert!(
        stamps.windows(2).all(|pair| pair[0] < pair[1]),
        "{stamps:?}"
    );
}
