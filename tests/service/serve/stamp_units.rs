//! Stamps in another unit than their name says: a replay refuses them, a daemon says so once, in `STATUS` too, and
//! goes on.

use super::client::Client;
use super::daemon::{Daemon, Process, TCP, eventually, listening};
use serde_json::Value;
use std::io::{BufRead, Read};
use std::time::Duration;

/// Samples with these stamps.
fn lines(stamps: impl Iterator<Item = i64>) -> String {
    lines_in("ns", stamps)
}

/// The same with stamps of this unit by their name.
fn lines_in(unit: &str, stamps: impl Iterator<Item = i64>) -> String {
    let line = |(n, stamp): (usize, i64)| {
        format!(
            "{{\"id\":\"imu0\",\"stamp_{unit}\":{stamp},\"gyro\":[0.001,0,0.0{:02}]}}\n",
            n % 100
        )
    };
    stamps.enumerate().map(line).collect()
}

fn codes_said(daemon: &Daemon, sent: &str) -> Vec<Value> {
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    sender.send_bytes(sent.as_bytes());
    sender.shut();
    let said = sender.rest();
    eventually("the sender has gone", || daemon.hub.connected() == 0);
    said.into_iter()
        .filter(|s| s["code"] == "stamp_unit")
        .collect()
}

fn findings(daemon: &Daemon) -> Vec<Value> {
    let status = daemon.status();
    let all = status["sources"][0]["findings"].as_array().unwrap().clone();
    all.into_iter()
        .filter(|f| f["code"] == "stamp-unit")
        .collect()
}

const MS: i64 = 1_700_000_000_000;

#[test]
fn another_unit_is_said_once_with_the_one_that_fits_and_is_in_status() {
    for (unit, stamp) in [
        ("ms", (|n| MS + 10 * n) as fn(i64) -> i64),
        ("us", |n| MS * 1000 + 10_000 * n),
        ("s", |n| MS / 1000 + n),
    ] {
        let daemon = Daemon::tcp();
        let said = codes_said(&daemon, &lines((0..600).map(stamp)));
        assert_eq!(said.len(), 1, "{unit}: {said:?}");
        let message = said[0]["message"].as_str().unwrap();
        for words in [
            format!("stamp_{unit}"),
            format!("--field stamp=stamp_ns:{unit}"),
        ] {
            assert!(message.contains(&words), "{words}: {message}");
        }
        let found = findings(&daemon);
        assert_eq!(found.len(), 1, "{unit}: {found:?}");
        assert_eq!(found[0]["severity"], "error");
        assert_eq!(found[0]["evidence"]["unit"], unit);
    }
}

#[test]
fn the_unit_that_is_said_is_the_one_that_the_name_or_the_columns_state() {
    let table = |stamps: fn(i64) -> i64| {
        let row = |n| format!("{},0.001,0,0.0{:02}\n", stamps(n), n % 100);
        "t,gx,gy,gz\n".to_owned() + &(0..600).map(row).collect::<String>()
    };
    let columns = "?columns=stamp=t:us,gyro=gx:gy:gz:rad/s&id=imu0";
    for (parameters, sent, stated, step, unit) in [
        (
            "",
            lines_in("us", (0..600).map(|n| 11 + 10 * n)),
            "us",
            10,
            "ms",
        ),
        (
            "",
            lines_in("us", (0..600).map(|n| MS / 1000 + n)),
            "us",
            1,
            "s",
        ),
        (columns, table(|n| 11 + 10 * n), "us", 10, "ms"),
    ] {
        let daemon = Daemon::start(listening(&[&format!("{TCP}{parameters}")]));
        let said = codes_said(&daemon, &sent);
        assert_eq!(said.len(), 1, "{stated} {unit}: {said:?}");
        let message = said[0]["message"].as_str().unwrap();
        for words in [
            format!("in {stated} by their name or a setting, but steps of {step} {stated} "),
            format!("those of a gyro only in {unit}; send them as stamp_{unit}"),
            format!("--field stamp=stamp_{stated}:{unit}"),
        ] {
            assert!(message.contains(&words), "{words}: {message}");
        }
        let evidence = &findings(&daemon)[0]["evidence"];
        assert_eq!(evidence["stated"], stated);
        assert_eq!(evidence["unit"], unit);
        assert_eq!(evidence["step_ns"], f64::from(step) * 1000.0);
    }
}

#[test]
fn fast_sensors_and_what_was_held_back_are_no_other_unit() {
    for stamp in [
        (|n| MS + 125_000 * n) as fn(i64) -> i64,
        |n| MS * 1_000_000 + 31_250 * n,
        |n| MS + n / 10 * 100_000_000 + n % 10 * 5_000,
    ] {
        let daemon = Daemon::tcp();
        let said = codes_said(&daemon, &lines((0..600).map(stamp)));
        assert_eq!(said, Vec::<Value>::new());
        assert_eq!(findings(&daemon), Vec::<Value>::new());
    }
}

/// Warnings in the log of a daemon that is sent these lines a hundredth of a second apart.
fn warnings(sent: &str) -> Vec<String> {
    let mut daemon = Process::start(&["--listen", TCP]);
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    for line in sent.lines() {
        sender.send(line);
        std::thread::sleep(Duration::from_millis(10));
    }
    sender.shut();
    sender.rest();
    daemon.signal("TERM");
    assert_eq!(daemon.exit(), Some(0));
    let log = daemon.log.by_ref().lines().map(|line| line.unwrap());
    let warnings = log.filter(|line| line.contains("\"WARN\""));
    warnings.filter(|line| line.contains("imu0: ")).collect()
}

#[test]
fn findings_of_counts_are_in_the_log_once_with_the_unit_that_the_arrivals_tell() {
    for (unit, stamp, words) in [
        (
            "s",
            (|n| 10 * n) as fn(i64) -> i64,
            "milliseconds that are called seconds",
        ),
        (
            "ms",
            |n| 10_000 * n,
            "microseconds that are called milliseconds",
        ),
        ("ms", |n| 100_000 - 10 * n, "a clock was set"),
        ("ms", |n| 10 * n, ""),
    ] {
        let sent = lines_in(unit, (0..150).map(stamp));
        // Slow enough for steps of ten seconds.
        let said = warnings(&sent.replace(",0,0.0", ",0,0.000"));
        assert_eq!(
            said.len(),
            usize::from(!words.is_empty()),
            "{unit}: {said:?}"
        );
        assert!(
            said.iter().all(|line| line.contains(words)),
            "{words}: {said:?}"
        );
    }
}
