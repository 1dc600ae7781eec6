//! Promise: bad lines are answered with line and column, counted, and stop nobody.

use super::client::{Client, rate};
use super::daemon::{Daemon, eventually};
use serde_json::{Value, json};

/// The state of one sensor, once it has taken `samples` samples.
fn source(daemon: &Daemon, id: &str, samples: u64) -> Value {
    let mut found = Value::Null;
    eventually(&format!("{samples} samples of {id}"), || {
        let status = daemon.status();
        let sources = status["sources"].as_array().unwrap();
        found = sources
            .iter()
            .find(|s| s["id"] == id)
            .cloned()
            .unwrap_or_default();
        found["samples"] == samples
    });
    found
}

#[test]
fn a_bad_line_is_answered_with_its_place_and_the_next_one_counts() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    client.send(&rate("a", 0, 1.0));
    client.object("ATT");
    // Line 1 was WATCH, line 2 the sample.
    for (number, (line, code, column)) in (3..).zip([
        ("{\"class\":\"RATE\" \"gyro\":1}", "bad_json", json!(17)),
        ("nonsense\x1b[31m", "bad_json", json!(1)),
        ("{\"a\":1}", "no_rate", Value::Null),
        ("{\"gyro\":[0,0]}", "no_rate", Value::Null),
        (
            "{\"class\":\"WATCH\",\"rate_hz\":-1}",
            "bad_watch",
            Value::Null,
        ),
        ("{\"class\":\"AUTH\",\"token\":7}", "bad_auth", json!(25)),
    ]) {
        client.send(line);
        let error = client.object("ERROR");
        assert_eq!(error["code"], code, "{error}");
        assert_eq!(error["line"], number, "{error}");
        assert_eq!(error["column"], column, "{error}");
        assert!(error["near"].as_str().unwrap().len() <= 64, "{error}");
        assert!(!error["near"].as_str().unwrap().contains('\x1b'), "{error}");
    }
    client.send(&rate("a", 1, 1.0));
    let att = client.object("ATT");
    assert_eq!(att["seq"], 1);
    assert_eq!(att["status"], json!(["rejected-before", "provisional"]));
    assert_eq!(source(&daemon, "a", 8)["counts"]["undecodable"], 6);
}

#[test]
fn names_alike_at_their_beginning_or_when_escaped_are_refused_and_not_mixed() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let longest = "n".repeat(255);
    client.send(&rate(&longest, 0, 1.0));
    assert_eq!(client.object("ATT")["id"], longest);
    client.send(&rate("a\\\\u{1b}", 0, 1.0));
    assert_eq!(client.object("ATT")["id"], "a\\u{1b}");
    for evil in [
        longest.clone() + "1",
        longest.clone() + "2",
        "a\\u001b".to_owned(),
        "a\u{200b}".to_owned(),
    ] {
        for line in [
            rate(&evil, 1, 1.0),
            format!("{{\"class\":\"PACKED\",\"stream\":1,\"id\":\"{evil}\"}}"),
            format!("{{\"class\":\"WATCH\",\"id\":\"{evil}\"}}"),
        ] {
            client.send(&line);
            let error = client.next_of("ERROR");
            assert_eq!(error["code"], "bad_id", "{error}");
            assert!(
                error["message"].as_str().unwrap().contains("255 bytes"),
                "{error}"
            );
            client.send(&rate(&longest, 2, 1.0));
        }
    }
    let status = daemon.status();
    assert_eq!(status["sources"].as_array().unwrap().len(), 2, "{status}");
}

#[test]
fn a_line_that_is_too_long_is_answered_once_and_skipped_to_its_end() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let padded = |length: usize| {
        let line = rate("a", 0, 1.0);
        format!("{line}{}", " ".repeat(length - line.len()))
    };
    client.send(&padded(64 << 10));
    client.object("ATT");
    client.send(&padded((64 << 10) + 1));
    client.send(&"x".repeat(1 << 20));
    client.send(&rate("a", 1, 1.0));
    for line in [3, 4] {
        let error = client.object("ERROR");
        assert_eq!(
            (&error["code"], &error["line"]),
            (&json!("line_too_long"), &json!(line))
        );
    }
    assert_eq!(client.object("ATT")["seq"], 1);
}

#[test]
fn twenty_one_bad_lines_in_a_row_close_the_connection_with_a_reason() {
    let daemon = Daemon::tcp();
    let mut patient = Client::tcp(daemon.address(0));
    patient.object("VERSION");
    // The first must be an object: who begins with anything else is not listened to at all.
    patient.send("{}");
    assert_eq!(patient.object("ERROR")["code"], "no_rate");
    patient.send(&rate("a", 1000, 1.0));
    for round in 1001..1004 {
        for _ in 0..20 {
            patient.send("x");
            assert_eq!(patient.object("ERROR")["code"], "bad_json");
        }
        // One good line makes up for twenty bad ones.
        patient.send(&rate("a", round, 1.0));
    }
    // ... and what repeats is thinned: 64 were said, so these may not be.
    let mut other = Client::tcp(daemon.address(0));
    other.send_bytes(&b"{}\n".repeat(500));
    let said = other.rest();
    assert_eq!(said.len(), 1 + 21 + 1, "greeting, errors, reason");
    assert_eq!(said.last().unwrap()["code"], "too_many_errors");
    eventually("the close to be counted", || {
        daemon.status()["counters"]["connections_closed"] == 1
    });
    patient.send("{\"class\":\"POLL\"}");
    patient.next_of("STATUS");
}

#[test]
fn an_unknown_class_is_said_once_and_held_against_nobody() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0));
    client.object("VERSION");
    for _ in 0..50 {
        client.send("{\"class\":\"TPV\",\"lat\":48.1}");
    }
    client.send("{\"class\":\"POLL\"}");
    assert_eq!(client.object("ERROR")["code"], "unknown_class");
    assert_eq!(client.object("STATUS")["class"], "STATUS");
}

#[test]
fn bad_samples_follow_the_rules_of_conditioning_and_are_said_once_each() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let at = |n: u64, gyro: &str| {
        format!(
            "{{\"class\":\"RATE\",\"id\":\"a\",\"sample_kind\":\"rate\",\"stamp\":{{\"sec\":9,\"nsec\":{}}},\"gyro\":{gyro}}}",
            n * 1_000_000
        )
    };
    let good = "[0.1,0,0]";
    for line in [
        at(0, good),
        at(1, "null"),
        at(2, "[NaN,0,0]"),
        at(3, "[1e300,0,0]"),
        at(4, good),
        at(4, good),
        at(5, good),
        at(2, "[0.2,0,0]"),
        "{\"class\":\"RATE\",\"id\":\"a\",\"gyro\":[0.1,0,0]}".to_owned(),
        at(6, good),
        at(6, "[NaN,0,0]"),
        // A second later: held, not turned through.
        at(999, good),
    ] {
        client.send(&line);
    }
    client.send("{\"class\":\"POLL\"}");
    let mut attitudes = Vec::new();
    let mut errors = Vec::new();
    let mut status = Value::Null;
    // Replies overtake attitudes.
    while status.is_null() || attitudes.len() < 5 {
        let value: Value = serde_json::from_str(&client.line().unwrap()).unwrap();
        match value["class"].as_str().unwrap() {
            "ATT" => attitudes.push(value),
            "ERROR" => errors.push(value["code"].as_str().unwrap().to_owned()),
            _ => status = value,
        }
    }
    errors.sort();
    assert_eq!(
        errors,
        ["huge", "late", "no_gyro", "no_stamp", "not_finite"]
    );
    let source = &status["sources"][0];
    assert_eq!(
        source["counts"],
        json!({"accepted": 5, "huge": 1, "late": 1, "no_gyro": 1, "no_stamp": 1, "not_finite": 2, "repeated": 1})
    );
    assert_eq!(source["lost"], 6);
    assert_eq!(source["not_bridged"], 1);
    assert_eq!(source["reset"], 1);
    let [held] = source["findings"].as_array().unwrap().as_slice() else {
        panic!("{source}");
    };
    assert_eq!(held["code"], "gap-held");
    assert_eq!(held["severity"], "error");
    for (name, secs) in [("longest_s", 0.993), ("longest_at_s", 0.006)] {
        let said = held["evidence"][name].as_f64().unwrap();
        assert!((said - secs).abs() < 1e-9, "{held}");
    }
    assert_eq!(held["settings"][0]["on_gap"], "bridge", "{held}");
    let stamps: Vec<u64> = attitudes
        .iter()
        .map(|a| a["stamp"]["nsec"].as_u64().unwrap() / 1_000_000)
        .collect();
    assert_eq!(stamps, [0, 4, 5, 6, 999]);
    let last = attitudes.last().unwrap();
    assert!(last["status"].to_string().contains("held"), "{last}");
    // A tenth of a radian a second for six milliseconds, and nothing across the gap.
    let x = last["q"]["x"].as_f64().unwrap();
    assert!((x - 0.3e-3_f64.sin()).abs() < 1e-15, "{last}");
}

#[test]
fn lines_in_single_bytes_count_as_lines() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    for n in 0..3 {
        for byte in format!("{}\r\n", rate("é", n, 1.0)).as_bytes() {
            client.send_bytes(std::slice::from_ref(byte));
        }
        assert_eq!(client.object("ATT")["seq"], n);
    }
}

#[test]
fn two_connections_never_feed_one_attitude_and_the_second_takes_over_from_one_that_left() {
    let daemon = Daemon::tcp();
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut first = Client::tcp(daemon.address(0));
    first.send(&rate("a", 0, 1.0));
    watcher.object("ATT");
    let mut second = Client::tcp(daemon.address(0));
    second.object("VERSION");
    second.send(&rate("a", 1, 9.0));
    assert_eq!(second.object("ERROR")["code"], "id_in_use");
    second.send(&rate("b", 0, 1.0));
    assert_eq!(watcher.object("ATT")["id"], "b");
    drop(first);
    eventually("the first to leave", || daemon.hub.connected() == 2);
    second.send(&rate("a", 2, 1.0));
    let att = watcher.object("ATT");
    assert_eq!((&att["id"], &att["seq"]), (&json!("a"), &json!(1)));
    assert_eq!(daemon.status()["counters"]["samples_refused"], 1);
}

#[test]
fn a_connection_that_means_something_else_begins_a_run_in_that_meaning() {
    let daemon = Daemon::tcp();
    let table = |header: &str, from: u64| {
        let row = |n| format!("{},0,0,90\n", from + 10 * n);
        header.to_owned() + &(0..21_u64).map(row).collect::<String>()
    };
    let send = |sent: String| {
        let mut client = Client::tcp(daemon.address(0));
        client.send_bytes(sent.as_bytes());
        client.shut();
        let said = client.rest();
        eventually("the sender to leave", || daemon.hub.connected() == 1);
        said
    };
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    send(table("time_ms,gx,gy,gz\n", 1000));
    // The stamps go on: the run would, too.
    let said = send(table("time_ms,gyro_x_dps,gyro_y_dps,gyro_z_dps\n", 2000));
    let notes: Vec<_> = said.iter().filter(|s| s["class"] == "NOTE").collect();
    assert_eq!(notes.len(), 1, "{said:?}");
    assert_eq!(notes[0]["code"], "new_run");
    let words = "something else now (rad/s before, deg/s now): begun again, reset 1";
    assert!(
        notes[0]["message"].as_str().unwrap().ends_with(words),
        "{}",
        notes[0]
    );
    assert!(said.iter().all(|s| s["class"] != "ERROR"), "{said:?}");
    let last = (0..42).map(|_| watcher.object("ATT")).last().unwrap();
    let half = last["q"]["w"].as_f64().unwrap().acos();
    // 90 deg/s for 0.2 s, from where the attitude began again.
    assert!((2.0 * half.to_degrees() - 18.0).abs() < 0.1, "{last}");
    let status = daemon.status();
    let source = &status["sources"][0];
    assert_eq!(source["gyro_unit"], "deg");
    for (key, count) in [("new_runs", 1), ("reset", 1), ("samples", 42), ("lost", 0)] {
        assert_eq!(source[key], count, "{key}: {source}");
    }
    assert_eq!(status["counters"]["samples_refused"], 0);
}

#[test]
fn a_sensor_that_changes_its_meaning_is_refused_and_missing_numbers_are_counted() {
    let daemon = Daemon::tcp();
    let mut client = Client::tcp(daemon.address(0));
    client.object("VERSION");
    client.send(&rate("a", 0, 1.0));
    client.send(&rate("a", 5, 1.0));
    client.send("{\"class\":\"RATE\",\"id\":\"a\",\"sample_kind\":\"delta-angle\",\"stamp\":{\"sec\":1700000000,\"nsec\":6000000},\"gyro\":[1,0,0]}");
    let error = client.object("ERROR");
    assert_eq!(error["code"], "meaning_changed");
    let message = error["message"].as_str().unwrap();
    assert!(message.contains("before, delta-angle now"), "{message}");
    assert!(message.contains("?id=NAME"), "{message}");
    let source = source(&daemon, "a", 2);
    assert_eq!(source["missing"], 4);
    // Nothing stated it: by the step of 5 ms.
    assert_eq!(source["sample_kind"], "average");
}
