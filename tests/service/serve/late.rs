//! Promise: a late subscriber gets the last attitude of every sensor at once, and everything after it: nothing
//! between is lost, nothing doubled.

use super::client::{Client, rate};
use super::daemon::{Daemon, TCP, WS, eventually, listening};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use strapd::serve::edge::source::Endpoint;

const WATCH: &str = r#"{"class":"WATCH"}"#;

fn is_last(att: &Value) -> bool {
    att["status"].as_array().unwrap().contains(&json!("last"))
}

/// Sends samples `from..until` of a sensor; their attitudes, as who watches all the time gets them.
fn send(
    sender: &mut Client,
    watcher: &mut Client,
    id: &str,
    range: std::ops::Range<u64>,
) -> Vec<Value> {
    let lines: Vec<String> = range.clone().map(|n| rate(id, n, 0.5)).collect();
    sender.send(&lines.join("\n"));
    range.map(|_| watcher.object("ATT")).collect()
}

/// Nothing waits for this client: the answer to `POLL` is the next it is told.
fn nothing_waits(client: &mut Client) {
    client.send(r#"{"class":"POLL"}"#);
    client.object("STATUS");
}

#[test]
fn a_late_watcher_gets_the_last_attitude_of_every_sensor_at_once_and_then_what_comes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let unix = format!("unix-listen://{}", path.display());
    let daemon = Daemon::start(listening(&[TCP, WS, &unix]));
    let mut early = Client::tcp(daemon.address(0)).watching(WATCH);
    let mut sender = Client::tcp(daemon.address(0));
    let mut gone = Client::tcp(daemon.address(0));
    let mut known: BTreeMap<&str, Value> = BTreeMap::new();
    for (sender, id, until) in [(&mut sender, "a", 10), (&mut gone, "ended", 5)] {
        let last = send(sender, &mut early, id, 0..until).pop().unwrap();
        known.insert(id, last);
    }
    drop(gone);
    let clients = [
        Client::tcp(daemon.address(0)),
        Client::web(daemon.address(1)),
        Client::unix(&path),
    ];
    let mut late = clients.map(|client| client.watching(WATCH));
    for client in &mut late {
        for (id, expected) in &known {
            let mut att = client.object("ATT");
            assert!(is_last(&att), "{att}");
            // In all else it is the one that was sent.
            let status = att["status"].as_array_mut().unwrap();
            assert_eq!(status.pop(), Some(json!("last")));
            assert_eq!(att, *expected, "{id}");
        }
        nothing_waits(client);
    }
    let next = send(&mut sender, &mut early, "a", 10..13);
    for client in &mut late {
        for expected in &next {
            assert_eq!(client.object("ATT"), *expected);
            assert!(!is_last(expected));
        }
        nothing_waits(client);
    }
    // One that was sent is no longer the last; a sensor that ended goes on.
    let mut back = Client::tcp(daemon.address(0));
    send(&mut back, &mut early, "ended", 5..6);
    let mut latest = Client::tcp(daemon.address(0)).watching(WATCH);
    for seq in [12, 5] {
        let att = latest.object("ATT");
        assert_eq!((att["seq"].as_u64(), is_last(&att)), (Some(seq), true));
    }
}

#[test]
fn packed_it_has_bit_10_behind_the_line_that_names_its_stream() {
    let daemon = Daemon::tcp();
    let mut early = Client::tcp(daemon.address(0)).watching(WATCH);
    let mut sender = Client::tcp(daemon.address(0));
    send(&mut sender, &mut early, "a", 0..7);
    let mut late =
        Client::tcp(daemon.address(0)).watching(r#"{"class":"WATCH","packed":true,"rate_hz":500}"#);
    assert_eq!(late.object("PACKED")["id"], "a");
    let numbers = |object: &[u8]| {
        let seq = u64::from_le_bytes(object[8..16].try_into().unwrap());
        let status = u32::from_le_bytes(object[104..108].try_into().unwrap());
        (seq, status >> 10 & 1)
    };
    assert_eq!(numbers(&late.packed()), (6, 1));
    send(&mut sender, &mut early, "a", 7..10);
    // At 500 Hz every other one, and the first of them.
    for seq in [7, 9] {
        assert_eq!(numbers(&late.packed()), (seq, 0), "named once");
    }
}

#[test]
fn only_of_sensors_that_are_watched_and_were_not_before_and_not_where_it_is_not_wanted() {
    let daemon = Daemon::tcp();
    let mut early = Client::tcp(daemon.address(0)).watching(WATCH);
    let mut sender = Client::tcp(daemon.address(0));
    for id in ["a", "b", "c"] {
        send(&mut sender, &mut early, id, 0..3);
    }
    let mut client = Client::tcp(daemon.address(0));
    client.object("VERSION");
    let mut ask = |request: &str, ids: &[&str]| {
        client.send(request);
        let answer = client.object("WATCH");
        for id in ids {
            let att = client.object("ATT");
            assert_eq!((&att["id"], &att["seq"]), (&json!(id), &json!(2)));
            assert!(is_last(&att), "{att}");
        }
        nothing_waits(&mut client);
        answer
    };
    ask(r#"{"class":"WATCH","ids":["a"],"rate_hz":10}"#, &["a"]);
    ask(r#"{"class":"WATCH","ids":["a","b"]}"#, &["b"]);
    ask(WATCH, &["c"]);
    ask(r#"{"class":"WATCH","rate_hz":10,"packed":false}"#, &[]);
    ask(r#"{"class":"WATCH","enable":false}"#, &[]);
    let answer = ask(r#"{"class":"WATCH","last":false}"#, &[]);
    assert_eq!(answer["last"], false);
    ask(r#"{"class":"WATCH","enable":false}"#, &[]);
    let answer = ask(WATCH, &["a", "b", "c"]);
    assert_eq!(answer["last"], Value::Null);
}

#[test]
fn a_thousand_last_attitudes_are_more_than_may_wait_and_all_come() {
    let daemon = Daemon::tcp();
    let sensors = 1000;
    // Two peers: one may send half of them.
    let mut senders: Vec<Client> = (0..4)
        .map(|part| {
            let mut sender = match part % 2 {
                0 => Client::tcp(daemon.address(0)),
                _ => Client::from_another(daemon.address(0)),
            };
            let lines: Vec<String> = (0..sensors / 4)
                .map(|n| rate(&format!("gyro{part}-{n}"), 0, 0.5))
                .collect();
            sender.send(&lines.join("\n"));
            sender
        })
        .collect();
    eventually("all sensors", || {
        daemon.status()["counters"]["attitudes"] == sensors
    });
    let mut late = Client::tcp(daemon.address(0)).watching(WATCH);
    // Newer ones of each, all at once, before this client has read anything.
    for (part, sender) in senders.iter_mut().enumerate() {
        let lines: Vec<String> = (0..sensors / 4)
            .map(|n| rate(&format!("gyro{part}-{n}"), 1, 0.5))
            .collect();
        sender.send(&lines.join("\n"));
    }
    let mut next: BTreeMap<String, u64> = BTreeMap::new();
    let mut done = 0;
    while done < sensors {
        let said: Value = serde_json::from_str(&late.line().unwrap()).unwrap();
        let of = next
            .entry(said["id"].as_str().unwrap().to_owned())
            .or_default();
        if said["class"] == "GAP" {
            // Only the newer one can be dropped.
            assert_eq!(
                (*of, &said["first_seq"], &said["dropped"]),
                (1, &json!(1), &json!(1))
            );
            *of = 2;
        } else {
            assert_eq!(
                (said["seq"].as_u64(), is_last(&said)),
                (Some(*of), *of == 0),
                "{said}"
            );
            *of += 1;
        }
        done += u64::from(*of == 2);
    }
    nothing_waits(&mut late);
}

/// Watchers come while samples do: each sees one last attitude, and then every one.
#[test]
fn what_comes_while_somebody_starts_to_watch_is_neither_lost_nor_doubled() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let stop = Arc::new(AtomicBool::new(false));
    // The last attitude that a late watcher has read.
    let seen = Arc::new(AtomicU64::new(0));
    let sending = {
        let (stop, seen, address) = (stop.clone(), seen.clone(), daemon.address(0));
        std::thread::spawn(move || {
            let mut sender = Client::tcp(address).watching(r#"{"class":"WATCH","id":"a"}"#);
            let mut n = 0;
            while !stop.load(Ordering::Relaxed) {
                // As it is answered, and never more ahead of a watcher that does not get the processor than waits
                // for it without a gap.
                if n > seen.load(Ordering::Relaxed) + 100 {
                    std::thread::sleep(Duration::from_micros(100));
                    continue;
                }
                sender.send(&rate("a", n, 0.5));
                sender.object("ATT");
                n += 1;
            }
        })
    };
    eventually("the first attitude", || {
        daemon.status()["counters"]["attitudes"].as_u64() > Some(0)
    });
    for n in 0..300 {
        let mut late = match n % 2 {
            0 => Client::tcp(daemon.address(0)),
            _ => Client::web(daemon.address(1)),
        }
        .watching(WATCH);
        let mut before = None;
        for _ in 0..4 {
            let att = late.object("ATT");
            let seq = att["seq"].as_u64().unwrap();
            match before {
                None => {}
                Some(before) => assert_eq!((seq, is_last(&att)), (before + 1, false), "{att}"),
            }
            before = Some(seq);
            seen.store(seq, Ordering::Relaxed);
        }
    }
    stop.store(true, Ordering::Relaxed);
    sending.join().unwrap();
}

#[test]
fn a_daemon_behind_a_daemon_takes_no_last_attitude_for_a_sample() {
    let first = Daemon::tcp();
    let mut early = Client::tcp(first.address(0)).watching(WATCH);
    let mut sender = Client::tcp(first.address(0));
    send(&mut sender, &mut early, "a", 0..5);
    let mut settings = listening(&[TCP]);
    settings.sources = vec![Endpoint::parse(&format!("tcp://{}", first.address(0))).unwrap()];
    let second = Daemon::start(settings);
    let mut far = Client::tcp(second.address(0)).watching(WATCH);
    eventually("the second watches the first", || {
        let status = first.status();
        let clients = status["clients"].as_array().unwrap();
        clients.iter().filter(|c| c["watching"] == true).count() == 2
    });
    let next = send(&mut sender, &mut early, "a", 5..6);
    let att = far.object("ATT");
    assert_eq!((&att["seq"], &att["stamp"]), (&json!(0), &next[0]["stamp"]));
}
