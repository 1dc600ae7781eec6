//! Intervals that disagree with the stamps: a replay refuses them, a daemon says so once and goes on.

use super::bare_stamps::replayed;
use super::client::Client;
use super::daemon::{Daemon, eventually};
use serde_json::Value;

/// Samples of 5 ms each, from the number `from` on, that say how long they last in the words of `dt`.
fn lines(kind: &str, dt: &str, from: u64, n: u64) -> String {
    (from..from + n)
        .map(|n| {
            format!(
                "{{\"id\":\"imu0\",\"sample_kind\":\"{kind}\",\"stamp_ns\":{},\"gyro\":[0.001,0,0.0{:02}],{dt}}}\n",
                1_700_000_000_000_000_000 + n * 5_000_000,
                n % 100
            )
        })
        .collect()
}

/// Answers to who sends this on one connection.
fn said(daemon: &Daemon, sent: &str) -> Vec<Value> {
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    sender.send_bytes(sent.as_bytes());
    sender.shut();
    let said = sender.rest();
    eventually("the sender has gone", || daemon.hub.connected() == 0);
    said
}

fn codes(said: &[Value]) -> Vec<&str> {
    said.iter().map(|s| s["code"].as_str().unwrap()).collect()
}

fn source(daemon: &Daemon) -> Value {
    daemon.status()["sources"][0].clone()
}

#[test]
fn an_interval_in_another_unit_is_said_once_with_numbers_and_every_sample_is_taken() {
    for (kind, dt, lasts) in [
        ("delta-angle", "\"dt\":5", "lasts 5.00 s"),
        ("average", "\"dt\":5000", "lasts 5000 s"),
        ("delta-angle", "\"dt_ns\":5000", "lasts 5.00e-6 s"),
        ("average", "\"dt_us\":5", "lasts 5.00e-6 s"),
    ] {
        let daemon = Daemon::tcp();
        let all = said(&daemon, &lines(kind, dt, 0, 300));
        let of_intervals: Vec<_> = all
            .iter()
            .filter(|s| s["code"] == "interval_mismatch")
            .collect();
        let [one] = of_intervals.as_slice() else {
            panic!("{kind} {dt}: {all:?}");
        };
        assert_eq!(
            (&one["class"], &one["id"]),
            (&"ERROR".into(), &"imu0".into())
        );
        let message = one["message"].as_str().unwrap();
        for words in [
            lasts,
            "0.00500 s apart (medians of 8)",
            "dt_s, dt_ms, dt_us or dt_ns",
        ] {
            assert!(message.contains(words), "{kind} {dt}: `{words}`: {message}");
        }
        let source = source(&daemon);
        assert_eq!(
            (&source["samples"], &source["interval_mismatches"]),
            (&300.into(), &1.into())
        );
        assert_eq!(source["warnings"], serde_json::json!([message]));
        assert_eq!(source["attitudes"], 300, "{source}");
        assert_eq!(daemon.status()["counters"]["faults"], all.len());
    }
}

#[test]
fn what_agrees_what_plays_no_part_and_what_is_too_little_is_not_said() {
    for (kind, dt, n) in [
        ("delta-angle", "\"dt\":0.005", 600),
        ("average", "\"dt_us\":5000", 600),
        // Every second sample left out is no other unit.
        ("average", "\"dt_ms\":2.5", 600),
        ("rate", "\"dt\":5", 600),
        ("average", "\"dt\":5", 7),
        ("average", "\"dt\":0", 600),
    ] {
        let daemon = Daemon::tcp();
        let all = said(&daemon, &lines(kind, dt, 0, n));
        assert!(
            !codes(&all).contains(&"interval_mismatch"),
            "{kind} {dt}: {all:?}"
        );
        let source = source(&daemon);
        assert_eq!(source["interval_mismatches"], 0, "{kind} {dt}: {source}");
        assert_eq!(source["warnings"], serde_json::json!([]), "{kind} {dt}");
    }
}

#[test]
fn it_is_said_again_in_another_run_and_no_longer_once_it_is_right() {
    let daemon = Daemon::tcp();
    let wrong = "\"dt\":5";
    assert_eq!(
        codes(&said(&daemon, &lines("delta-angle", wrong, 0, 100))),
        ["interval_mismatch"]
    );
    // The same samples once more begin another run.
    let again = said(&daemon, &lines("delta-angle", wrong, 0, 100));
    assert_eq!(codes(&again), ["new_run", "interval_mismatch"]);
    assert_eq!(source(&daemon)["interval_mismatches"], 2);
    // The run goes on, with the right unit.
    let right = said(&daemon, &lines("delta-angle", "\"dt_ms\":5", 100, 100));
    assert_eq!(right, Vec::<Value>::new());
    let source = source(&daemon);
    assert_eq!(
        (&source["interval_mismatches"], &source["new_runs"]),
        (&2.into(), &1.into())
    );
    assert_eq!(source["warnings"], serde_json::json!([]));
}

#[test]
fn a_few_samples_a_connection_are_looked_at_together() {
    let daemon = Daemon::tcp();
    let mut heard = Vec::new();
    for n in 0..4 {
        heard.extend(said(&daemon, &lines("average", "\"dt\":5", n * 3, 3)));
    }
    assert_eq!(codes(&heard), ["interval_mismatch"]);
}

#[test]
fn what_a_daemon_complains_of_a_replay_refuses() {
    let refused = replayed(&lines("delta-angle", "\"dt\":5", 0, 300));
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(
        said.contains("lasts 5.00 s") && said.contains("0.00500 s apart"),
        "{said}"
    );
}
