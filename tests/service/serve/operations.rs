//! Starting, looking at and stopping the daemon.

use super::client::{Client, get, rate};
use super::daemon::{Daemon, PATIENCE, Process, TCP, WS, eventually, listening, strapd};
use std::net::TcpListener;
use std::process::Command;

#[test]
fn an_address_in_use_is_named_with_what_helps() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    for scheme in ["tcp-listen", "ws-listen"] {
        let uri = format!("{scheme}://{address}");
        let output = Command::new(strapd())
            .args(["serve", "--listen", TCP, "--listen", &uri])
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(&uri) && said.contains("port 0"), "{said}");
        assert!(!said.contains("INFO"), "nothing was ready: {said}");
    }
}

#[test]
fn what_a_live_stream_can_not_do_is_refused_before_anything_is_bound() {
    for (args, complaint) in [
        (["--bias", "auto"], "--bias x,y,z"),
        (["--init", "gravity"], "rpy="),
        (["--topic", "a"], "WATCH"),
        (["--listen", "ftp://x"], "known: tcp-listen"),
    ] {
        // Of a gyro alone: what a filter corrects begins with the first two.
        let output = Command::new(strapd())
            .args(["serve", "--aid", "none"])
            .args(args)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(complaint), "{args:?}: {said}");
    }
}

#[test]
fn what_has_arrived_before_the_end_reaches_whoever_watches() {
    let mut settings = listening(&[TCP, WS]);
    // Two seconds are the promise; how busy this machine is is not part of it.
    settings.hub.limits.drain = PATIENCE;
    let daemon = Daemon::start(settings);
    let mut watchers = [
        Client::tcp(daemon.address(0)),
        Client::web(daemon.address(1)),
    ]
    .map(|c| c.watching("{\"class\":\"WATCH\"}"));
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&rate("a", 0, 1.0));
    for watcher in &mut watchers {
        watcher.object("ATT");
    }
    let lines: Vec<String> = (1..500).map(|n| rate("a", n, 1.0)).collect();
    sender.send(&lines.join("\n"));
    assert!(daemon.stop());
    for watcher in &mut watchers {
        let rest = watcher.rest();
        assert_eq!(rest.len(), 499, "{:?}", rest.last());
        assert_eq!(rest.last().unwrap()["seq"], 499);
    }
}

#[test]
fn a_signal_closes_everybody_and_ends_with_zero() {
    for name in ["TERM", "INT", "HUP"] {
        let mut process = Process::start(&["--listen", TCP, "--listen", WS]);
        let mut watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
        let mut on_web = Client::web(process.address(1)).watching("{\"class\":\"WATCH\"}");
        process.signal(name);
        for client in [&mut watcher, &mut on_web] {
            assert!(client.rest().is_empty(), "SIG{name}");
        }
        assert_eq!(process.exit(), Some(0), "SIG{name}");
    }
}

#[test]
fn a_second_signal_ends_it_at_once() {
    let mut process = Process::start(&["--listen", TCP]);
    // A watcher that reads nothing while much waits for it keeps the drain busy.
    let _stalled = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(process.address(0));
    let mut n = 0;
    let dropped = |sender: &mut Client| {
        sender.send("{\"class\":\"POLL\"}");
        let status = sender.next_of("STATUS");
        status["clients"]
            .as_array()
            .unwrap()
            .iter()
            .any(|c| c["dropped"].as_u64() > Some(0))
    };
    while !dropped(&mut sender) {
        let lines: Vec<String> = (n..n + 500).map(|n| rate("a", n, 1.0)).collect();
        sender.send(&lines.join("\n"));
        for _ in 0..500 {
            watcher.object("ATT");
        }
        n += 500;
    }
    process.signal("TERM");
    // The others are closed when the drain has begun.
    assert!(watcher.rest().is_empty());
    process.signal("INT");
    assert_eq!(process.exit(), Some(130));
}

#[test]
fn health_says_what_does_not_go_on_and_is_health_all_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("states");
    std::fs::create_dir(&folder).unwrap();
    let state = folder.join("state.json");
    let process = Process::start(&[
        "--listen",
        TCP,
        "--listen",
        WS,
        "--state",
        state.to_str().unwrap(),
    ]);
    let mut sender = Client::tcp(process.address(0));
    let health = || get(process.address(1), "/healthz", &[("Host", "localhost")]);
    sender.send(&rate("a", 0, 1.0));
    eventually("a saved state", || state.exists());
    assert_eq!(health(), (200, "ok\n".to_owned()));
    std::fs::rename(&folder, dir.path().join("gone")).unwrap();
    let mut n = 1;
    eventually("a state that cannot be saved", || {
        sender.send(&rate("a", n, 1.0));
        n += 1;
        let (status, text) = health();
        assert_eq!(status, 200);
        text.starts_with("ok\nbut attitudes are not saved: ")
    });
}

#[test]
fn health_and_metrics_are_on_the_same_http() {
    let daemon = Daemon::start(listening(&[TCP, WS]));
    let mut sender = Client::tcp(daemon.address(0));
    sender.send(&rate("a\\\"b", 0, 1.0));
    sender.send(&rate("a\\\"b", 0, 1.0));
    sender.send("nonsense");
    eventually("the lines", || daemon.status()["counters"]["lines"] == 3);
    let host = [("Host", "localhost")];
    assert_eq!(get(daemon.address(1), "/healthz", &host).0, 200);
    let (status, text) = get(daemon.address(1), "/metrics", &host);
    assert_eq!(status, 200);
    for line in [
        "strapd_samples_total 2",
        "strapd_lines_total 3",
        "strapd_faults_total 1",
        "strapd_attitudes_total 1",
        "strapd_sensor_samples_total{id=\"a\\\"b\",verdict=\"accepted\"} 1",
        "strapd_sensor_samples_total{id=\"a\\\"b\",verdict=\"repeated\"} 1",
        "# TYPE strapd_samples_total counter",
    ] {
        assert!(text.lines().any(|l| l == line), "no `{line}` in\n{text}");
    }
    // Every line is a comment, or a name with a number.
    for line in text.lines().filter(|l| !l.starts_with('#')) {
        let (name, number) = line.rsplit_once(' ').unwrap();
        assert!(
            name.starts_with("strapd_") && number.parse::<f64>().is_ok(),
            "{line}"
        );
    }
}

/// Whether no text in it would do anything to a terminal.
fn is_harmless(value: &serde_json::Value) -> bool {
    match value {
        serde_json::Value::String(text) => !text.contains(['\x1b', '\x07', '\u{202e}']),
        serde_json::Value::Array(all) => all.iter().all(is_harmless),
        serde_json::Value::Object(all) => all.values().all(is_harmless),
        _ => true,
    }
}

#[test]
fn a_hostile_name_reaches_no_terminal() {
    let mut process = Process::start(&["--listen", TCP]);
    let mut client = Client::tcp(process.address(0));
    client.send("{\"class\":\"\\u001b[2J\"}");
    client.send("{\"class\":\"RATE\",\"id\":\"\\u001b]0;owned\\u0007\\u202e\",\"stamp\":{\"sec\":1},\"gyro\":[1,0,0]}");
    client.send("\x1b[31m");
    client.send("{\"class\":\"POLL\"}");
    let mut was_refused = false;
    loop {
        let line = client.line().unwrap();
        assert!(is_harmless(&serde_json::from_str(&line).unwrap()), "{line}");
        was_refused |= line.contains("bad_id") && line.contains("owned");
        if line.contains("\"STATUS\"") {
            assert!(was_refused && !line.contains("owned"), "{line}");
            break;
        }
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let mut log = String::new();
    std::io::Read::read_to_string(&mut process.log, &mut log).unwrap();
    assert!(!log.contains('\x1b'), "{log}");
}
