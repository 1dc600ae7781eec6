//! Places for sensors are given back: to whom, and what becomes of who had them.

use super::client::{Client, ask, rate};
use super::daemon::{Daemon, Process, TCP, WS, eventually, listening};
use serde_json::Value;
use std::time::Duration;
use strapd::serve::core::session::{Scratch, Session, Side};
use strapd::serve::guard::limits::Limits;
use strapd_attitude::record::Nanos;

fn with_places(sensors: usize) -> Daemon {
    let mut settings = listening(&[TCP]);
    settings.hub.limits = Limits {
        sensors,
        ..Limits::default()
    };
    Daemon::start(settings)
}

fn ids(status: &Value) -> Vec<&str> {
    let sources = status["sources"].as_array().unwrap();
    sources.iter().map(|s| s["id"].as_str().unwrap()).collect()
}

#[test]
fn the_sensor_nobody_sends_that_is_silent_longest_gives_way_and_goes_on_where_it_was() {
    let daemon = with_places(3);
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut kept = Client::tcp(daemon.address(0));
    let mut gone = Client::tcp(daemon.address(0));
    let mut turned = Value::Null;
    for n in 0..100 {
        // `oldest` is named last and sent first; `kept` is silent still longer, but its sender is there.
        if n == 0 {
            kept.send(&rate("kept", 0, 1.0));
            watcher.object("ATT");
        }
        for id in ["oldest", "a newer one"] {
            gone.send(&rate(id, n, 2.0));
            let att = watcher.object("ATT");
            if id == "oldest" {
                turned = att;
            }
        }
    }
    drop(gone);
    let mut new = Client::tcp(daemon.address(0));
    let mut n = 0;
    // Until the daemon has noticed that the sender has gone, there is no place.
    eventually("a place", || {
        new.send(&rate("new", n, 1.0));
        n += 1;
        daemon.status()["places"]["gave_way"] == 1
    });
    let status = daemon.status();
    assert_eq!(ids(&status), ["a newer one", "kept", "new"]);
    let places = &status["places"];
    assert_eq!(places["gave_way_last"], serde_json::json!(["oldest"]));
    assert_eq!(
        (&places["sensors"], &places["taken"], &places["saved"]),
        (&3.into(), &3.into(), &1.into())
    );
    assert_eq!(status["counters"]["sensors_gave_way"], 1);
    // It comes back, after a gap too long to be bridged, where it was.
    let mut again = Client::tcp(daemon.address(0));
    again.send(&rate("oldest", 9000, 2.0));
    let back = loop {
        let att = watcher.object("ATT");
        if att["id"] == "oldest" {
            break att;
        }
    };
    assert_eq!(back["q"], turned["q"], "{back}");
    assert!(back["q"]["w"].as_f64() < Some(0.999), "it had turned");
    assert!(back["status"].to_string().contains("held"), "{back}");
    assert_eq!(ids(&daemon.status()), ["kept", "new", "oldest"]);
}

#[test]
fn where_all_are_sent_one_more_is_refused_with_the_flag_that_helps() {
    let mut process = Process::start(&["--listen", TCP, "--max-sensors", "2"]);
    let mut sender = Client::tcp(process.address(0));
    for id in ["a", "b", "c"] {
        sender.send(&rate(id, 0, 1.0));
    }
    let said = sender.next_of("ERROR");
    assert_eq!(said["code"], "too_many_sensors");
    assert!(said.to_string().contains("--max-sensors"), "{said}");
    sender.send("{\"class\":\"POLL\"}");
    let status = sender.next_of("STATUS");
    assert_eq!(ids(&status), ["a", "b"]);
    assert_eq!(status["counters"]["samples_refused"], 1);
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}

#[test]
#[cfg(target_os = "linux")]
fn one_connection_sends_256_sensors_and_one_peer_512_and_others_have_the_rest() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let daemon = Daemon::start(listening(&[
        TCP,
        &format!("unix-listen://{}", path.display()),
    ]));
    let count = || ids(&daemon.status()).len();
    // Sent, each with 300 names, and what there is after that.
    let mut senders = Vec::new();
    let mut fill = |mut sender: Client, part: usize, expected: usize| {
        let lines: Vec<String> = (0..300)
            .map(|n| rate(&format!("{part}-{n}"), 0, 0.1))
            .collect();
        sender.send(&lines.join("\n"));
        assert_eq!(sender.next_of("ERROR")["code"], "too_many_sensors");
        eventually("the sensors", || count() == expected);
        senders.push(sender);
    };
    fill(Client::tcp(daemon.address(0)), 0, 256);
    fill(Client::tcp(daemon.address(0)), 1, 512);
    fill(Client::tcp(daemon.address(0)), 2, 512);
    fill(Client::from_another(daemon.address(0)), 3, 768);
    // A user is a peer, whatever its addresses.
    fill(Client::unix(&path), 4, 1024);
    // All are being sent: nobody gives way.
    fill(Client::unix(&path), 5, 1024);
    // Who goes makes room.
    drop(senders.remove(0));
    let mut late = Client::unix(&path);
    eventually("a place", || {
        late.send(&rate("late", 0, 1.0));
        ids(&daemon.status()).contains(&"late")
    });
    assert_eq!(count(), 1024);
}

#[test]
fn a_sensor_that_a_broker_brings_no_more_is_nobodys_after_a_while() {
    let mut settings = listening(&[TCP]);
    settings.hub.limits = Limits {
        sensors: 2,
        sender_silence: Duration::from_secs(2),
        ..Limits::default()
    };
    let daemon = Daemon::start(settings);
    let side = Side::source(None, None);
    let mut broker = Session::with(&daemon.hub, "broker".to_owned(), side);
    broker.client().speaks_for_many();
    let mut scratch = Scratch::default();
    let mut bring = |id: &str, n: u64| {
        broker.message(rate(id, n, 1.0).as_bytes(), Nanos(0), &mut scratch);
    };
    let mut sender = Client::tcp(daemon.address(0));
    sender.object("VERSION");
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    bring("b", 0);
    bring("a", 0);
    sender.send(&rate("a", 1, 1.0));
    assert_eq!(sender.object("ERROR")["code"], "id_in_use");
    sender.send(&rate("c", 1, 1.0));
    assert_eq!(sender.object("ERROR")["code"], "too_many_sensors");
    let taken = |watcher: &mut Client, id: &str| {
        let said = watcher.object("ATT");
        assert_eq!((&said["id"], said["seq"].is_u64()), (&id.into(), true));
    };
    taken(&mut watcher, "b");
    taken(&mut watcher, "a");
    // Its publishers have gone, and it stays.
    let mut n = 2;
    eventually("the sensor to be nobody's", || {
        sender.send(&rate("a", n, 1.0));
        n += 1;
        std::thread::sleep(Duration::from_millis(20));
        daemon.status()["sources"][0]["samples"].as_u64() > Some(1)
    });
    taken(&mut watcher, "a");
    sender.send(&rate("c", 1, 1.0));
    while watcher.object("ATT")["id"] != "c" {}
    let status = daemon.status();
    assert_eq!(ids(&status), ["a", "c"]);
    assert_eq!(status["places"]["gave_way_last"], serde_json::json!(["b"]));
    // Who sends them keeps them, and when it goes they are the broker's again.
    let refused = || {
        daemon.status()["counters"]["samples_refused"]
            .as_u64()
            .unwrap()
    };
    let before = refused();
    bring("a", 100);
    bring("b", 100);
    assert_eq!(refused(), before + 2);
    drop(sender);
    eventually("both to be free", || {
        bring("b", 100);
        ids(&daemon.status()).contains(&"b")
    });
}

#[test]
fn a_sensor_that_was_silent_for_long_goes_on_as_if_nothing_had_happened() {
    // The same samples to one that forgets and one that does not.
    let [forgetful, patient] = [Some(Duration::from_millis(500)), None].map(|forget_after| {
        let mut settings = listening(&[TCP, WS]);
        settings.hub.limits.forget_after = forget_after;
        let daemon = Daemon::start(settings);
        let watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
        let sender = Client::tcp(daemon.address(0));
        (daemon, watcher, sender)
    });
    let mut both = [forgetful, patient];
    let same = |both: &mut [(Daemon, Client, Client); 2], n: u64| {
        let said = both.each_mut().map(|(daemon, watcher, sender)| {
            sender.send(&rate("sent", n, 2.0));
            let sent = watcher.object("ATT");
            let host = daemon.address(1).to_string();
            let headers = [("Host", &*host), ("Content-Type", "application/json")];
            let body = rate("posted", n, 1.0);
            let (status, answer) = ask(
                daemon.address(1),
                "POST /samples",
                &headers,
                body.as_bytes(),
            );
            assert_eq!(status, 200, "{n}: {answer}");
            (sent, watcher.object("ATT"))
        });
        assert_eq!(said[0], said[1], "{n}");
    };
    for n in 0..30 {
        same(&mut both, n);
    }
    let daemon = &both[0].0;
    eventually("their places are free", || {
        daemon.status()["counters"]["sensors_forgotten"] == 2
    });
    assert!(ids(&daemon.status()).is_empty());
    assert_eq!(daemon.status()["places"]["saved"], 2);
    assert_eq!(ids(&both[1].0.status()), ["posted", "sent"]);
    // No sample is refused: the next one asks for a place again, and the attitude goes on to the bit.
    for n in 30..60 {
        same(&mut both, n);
    }
    let counters = both[0].0.status()["counters"].clone();
    assert_eq!(
        (&counters["samples_refused"], &counters["faults"]),
        (&0.into(), &0.into())
    );
}
