//! Attitudes in memory are those of the file, to the bit.

use crate::replays::{done, replay_of};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use strapd::sink::Target;
use strapd_attitude::estimate::Aid;
use strapd_recording::pool::Pool;

/// Two sensors that turn about other axes, line by line in turn.
fn two_sensors() -> String {
    (0..400)
        .map(|k| {
            let stamp = f64::from(k / 2) * 0.01;
            match k % 2 {
                0 => format!("{{\"id\":\"left\",\"stamp\":{stamp},\"gyro\":[0.3,0,0.1]}}\n"),
                _ => format!("{{\"id\":\"right\",\"stamp\":{stamp},\"gyro\":[0,-0.7,0]}}\n"),
            }
        })
        .collect()
}

#[test]
fn attitudes_in_memory_are_those_of_the_file() {
    let out = tempfile::tempdir().unwrap();
    let fixture = Path::new("fixtures/xsens_mti.mcap");
    let two = out.path().join("two_sensors.ndjson");
    std::fs::write(&two, two_sensors()).unwrap();
    for (log, topic, aid, smooth) in [
        (fixture, None, Aid::Auto, false),
        (fixture, None, Aid::None, false),
        (fixture, None, Aid::Auto, true),
        (&two, Some("all"), Aid::None, false),
    ] {
        let name = log.file_name().unwrap().to_str().unwrap();
        let mut replay = replay_of(log);
        replay.selection.topic = topic.map(str::to_owned);
        replay.plan.aid = aid;
        replay.plan.smooth = smooth;
        let lines = out.path().join(format!("{aid:?}{smooth}{name}.ndjson"));
        replay.targets = vec![Target::parse(lines.to_str().unwrap()).unwrap()];
        let by_file = done(&replay).unwrap();

        replay.targets = Vec::new();
        let (topics, summary) = replay.attitudes(&Pool::new(2).unwrap()).unwrap();
        assert_eq!(topics.len(), by_file.topics.len());
        assert_eq!(summary.topics.len(), by_file.topics.len());
        let mut in_file = 0;
        let mut next = vec![0; topics.len()];
        for line in std::fs::read_to_string(&lines).unwrap().lines() {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            let number = |v: &serde_json::Value| v.as_f64().unwrap();
            let stamp = line["stamp"]["sec"].as_i64().unwrap() * 1_000_000_000
                + line["stamp"]["nsec"].as_i64().unwrap();
            let place = topics
                .iter()
                .position(|t| t.stream.id == line["id"].as_str().unwrap())
                .unwrap();
            let sample = &topics[place].samples[next[place]];
            next[place] += 1;
            assert_eq!(sample.stamp.0, stamp);
            let q = ["w", "x", "y", "z"].map(|axis| number(&line["q"][axis]).to_bits());
            assert_eq!(q, sample.q_nb.wxyz().map(f64::to_bits), "{name} {stamp}");
            in_file += 1;
        }
        let in_memory: usize = topics.iter().map(|t| t.samples.len()).sum();
        assert_eq!(in_memory, in_file);
        assert!(in_file > 100, "{name}: {in_file}");
    }
}

#[test]
fn who_has_enough_gets_no_more() {
    let replay = replay_of(Path::new("fixtures/xsens_mti.mcap"));
    let pool = Pool::new(1).unwrap();
    let (all, _) = replay.attitudes(&pool).unwrap();
    let calls = Arc::new(AtomicUsize::new(0));
    let count = Arc::new(AtomicUsize::new(0));
    let (called, counted) = (calls.clone(), count.clone());
    replay
        .each_attitude(&pool, move |_, _, samples| {
            called.fetch_add(1, Ordering::Relaxed);
            counted.fetch_add(samples.len(), Ordering::Relaxed);
            ControlFlow::Break(())
        })
        .unwrap();
    assert_eq!(calls.load(Ordering::Relaxed), 1);
    let got = count.load(Ordering::Relaxed);
    assert!(got > 0 && got < all[0].samples.len(), "{got}");
}
