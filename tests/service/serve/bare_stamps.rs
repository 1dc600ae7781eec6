//! A stamp that is a bare number means the same in a daemon and in a replay: one unit for a stream.

use super::client::Client;
use super::daemon::{Daemon, eventually, strapd};
use serde_json::Value;
use std::io::Write;
use std::process::{Command, Output, Stdio};

pub(crate) fn replayed(lines: &str) -> Output {
    replayed_with(lines, &[])
}

/// The same with these flags.
pub(crate) fn replayed_with(lines: &str, flags: &[&str]) -> Output {
    let mut child = Command::new(strapd())
        .args(["replay", "-", "--method", "commit", "-o", "-"])
        .env("STRAPD_AID", "none")
        .args(flags)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It may refuse before it has read all.
    let _ = child.stdin.take().unwrap().write_all(lines.as_bytes());
    child.wait_with_output().unwrap()
}

fn lines(stamp: impl Fn(u64) -> String) -> String {
    (0..60)
        .map(|n| {
            format!(
                "{{\"id\":\"imu0\",{},\"gyro\":[0.{n:02},0,0.5]}}\n",
                stamp(n)
            )
        })
        .collect()
}

#[test]
fn every_clock_gives_the_bytes_of_a_replay_and_ends_when_it_should() {
    let streams = [
        // From 0, in ns, us and s; since 1970 in ns, us, ms and s; in words.
        (
            lines(|n| format!("\"stamp\":{}", n * 5_000_000)),
            295_000_000,
        ),
        (
            lines(|n| format!("\"timestamp\":{}", n * 4_000)),
            236_000_000,
        ),
        (
            lines(|n| format!("\"timestamp\":{:.3}", n as f64 * 5e-3)),
            295_000_000,
        ),
        (
            lines(|n| format!("\"stamp\":{}", 1_700_000_000_000_000_000 + n * 10_000_000)),
            1_700_000_000_590_000_000_i64,
        ),
        (
            lines(|n| format!("\"stamp\":{}", 1_700_000_000_000_000 + n * 10_000)),
            1_700_000_000_590_000_000,
        ),
        (
            lines(|n| format!("\"t\":{}", 1_700_000_000_000 + n * 10)),
            1_700_000_000_590_000_000,
        ),
        (
            lines(|n| format!("\"stamp\":{}", 1_700_000_000.0 + n as f64 / 64.0)),
            1_700_000_000_921_875_000,
        ),
        (
            lines(|n| format!("\"time\":\"{}\"", 1_700_000_000_000 + n * 10)),
            1_700_000_000_590_000_000,
        ),
    ];
    for (sent, last) in streams {
        let expected = replayed(&sent);
        assert!(expected.status.success(), "{expected:?}");
        let daemon = Daemon::tcp();
        let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
        let mut sender = Client::tcp(daemon.address(0));
        sender.object("VERSION");
        sender.send_bytes(sent.as_bytes());
        let got: Vec<String> = (0..60).map(|_| watcher.line().unwrap() + "\n").collect();
        assert!(
            got.concat().as_bytes() == expected.stdout,
            "{} {}",
            got[0],
            String::from_utf8_lossy(&expected.stdout)
        );
        let end: Value = serde_json::from_str(&got[59]).unwrap();
        let stamp = &end["stamp"];
        let nanos =
            stamp["sec"].as_i64().unwrap() * 1_000_000_000 + stamp["nsec"].as_i64().unwrap();
        assert_eq!(nanos, last, "{}", &sent[..80]);
        sender.shut();
        assert_eq!(sender.rest(), Vec::<Value>::new());
    }
}

#[test]
fn what_can_not_be_told_is_said_once_with_the_names_that_help() {
    let sent = lines(|n| format!("\"stamp\":{}", n * 1_000_000));
    let names = "stamp_ns, stamp_us, stamp_ms or stamp_s";
    let refused = replayed(&sent);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains(names) && said.contains("ns or us"), "{said}");
    let daemon = Daemon::tcp();
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    sender.send_bytes(sent.as_bytes());
    sender.shut();
    let said = sender.rest();
    assert_eq!(said.len(), 1, "{said:?}");
    assert_eq!(
        (&said[0]["code"], &said[0]["id"]),
        (&"ambiguous_stamp".into(), &"imu0".into())
    );
    assert!(
        said[0]["message"].as_str().unwrap().contains(names),
        "{said:?}"
    );
    let status = daemon.status();
    assert_eq!(status["sources"][0]["counts"]["no_stamp"], 60);
    let named = replayed(&sent.replace("\"stamp\"", "\"stamp_ns\""));
    assert!(named.status.success(), "{named:?}");
    assert_eq!(named.stdout.iter().filter(|b| **b == b'\n').count(), 60);
}

#[test]
fn a_few_samples_wait_no_longer_than_two_seconds_and_not_beyond_their_connection() {
    let daemon = Daemon::tcp();
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let sample = |id: &str, n: u64| {
        format!(
            "{{\"id\":\"{id}\",\"stamp\":{},\"gyro\":[0,0,1]}}",
            1_700_000_000_000 + n * 10
        )
    };
    let began = std::time::Instant::now();
    (0..3).for_each(|n| sender.send(&sample("a", n)));
    for _ in 0..3 {
        assert_eq!(watcher.object("ATT")["id"], "a");
    }
    assert!(began.elapsed() >= std::time::Duration::from_millis(1900));
    // From then on nobody waits.
    sender.send(&sample("a", 3));
    assert_eq!(watcher.object("ATT")["stamp"]["nsec"], 30_000_000);
    sender.send(&sample("b", 0));
    sender.shut();
    assert_eq!(watcher.object("ATT")["id"], "b");
    eventually("the sender has gone", || daemon.hub.connected() == 1);
    let unit = &daemon.status()["sources"][0]["stamp_unit"];
    assert_eq!(unit, "ms");
}
