//! A stream of which nothing is used is in the log, in `STATUS` and on the page, though its sender reads no answer.

use super::client::{Client, ask};
use super::daemon::{PATIENCE, Process, TCP, UDP, WS};
use std::io::BufRead;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A daemon, and the warnings it logs from now on.
fn logged(more: &[&str], stdin: std::process::Stdio) -> (Process, Receiver<String>) {
    let script = "exec \"$0\" serve \"$@\"";
    let mut process = Process::start_by(script, stdin, more);
    let log = std::mem::replace(&mut process.log, empty());
    let (to, warnings) = channel();
    std::thread::spawn(move || {
        for line in log.lines().map_while(Result::ok) {
            let said: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
            if said["level"] == "WARN" {
                let message = said["fields"]["message"].as_str().unwrap_or_default();
                let _ = to.send(message.to_owned());
            }
        }
    });
    (process, warnings)
}

/// Nobody's log.
fn empty() -> std::io::BufReader<std::process::ChildStderr> {
    let mut child = std::process::Command::new("true")
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let log = child.stderr.take().unwrap();
    child.wait().unwrap();
    std::io::BufReader::new(log)
}

/// A sample without a stamp.
fn unstamped(id: &str) -> String {
    format!("{{\"id\":\"{id}\",\"gyro\":[0.1,0,0]}}")
}

#[test]
fn samples_without_a_stamp_are_reported_once_over_every_way_in() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s.sock");
    let unix = format!("unix-listen://{}", path.display());
    let input = dir.path().join("lines");
    std::fs::write(&input, format!("{}\n", unstamped("stdin")).repeat(200)).unwrap();
    let stdin = std::fs::File::open(&input).unwrap().into();
    let listen = [
        "--listen", TCP, "--listen", UDP, "--listen", WS, "--listen", &unix, "-",
    ];
    let (process, warnings) = logged(&listen, stdin);
    let ways = ["tcp", "udp", "ws", "unix", "post", "stdin"];
    let mut clients = [
        ("tcp", Client::tcp(process.address(0))),
        ("udp", Client::udp(process.address(1))),
        ("ws", Client::web(process.address(2))),
        ("unix", Client::unix(&path)),
    ];
    for (id, client) in &mut clients {
        for _ in 0..200 {
            client.send(&unstamped(id));
        }
    }
    let body = format!("{}\n", unstamped("post")).repeat(200);
    let host = process.address(2).to_string();
    let headers = [("Host", &*host), ("Content-Type", "application/x-ndjson")];
    let (status, answer) = ask(
        process.address(2),
        "POST /samples",
        &headers,
        body.as_bytes(),
    );
    let answer: serde_json::Value = serde_json::from_str(&answer).unwrap();
    assert_eq!((status, &answer["errors"]), (400, &200.into()), "{answer}");
    let mut said: Vec<String> = Vec::new();
    let is_of = |id: &str, line: &str| line.starts_with(&format!("{id}: "));
    while !ways
        .iter()
        .all(|id| said.iter().any(|line| is_of(id, line)))
    {
        said.push(warnings.recv_timeout(PATIENCE).unwrap());
    }
    // Nothing more comes of it for a minute.
    while let Ok(more) = warnings.recv_timeout(Duration::from_secs(3)) {
        said.push(more);
    }
    for id in ways {
        let own: Vec<_> = said.iter().filter(|line| is_of(id, line)).collect();
        assert_eq!(own.len(), 1, "{said:?}");
        for part in ["without a usable stamp", "--time log", "line 1, column 1"] {
            assert!(own[0].contains(part), "{own:?}");
        }
    }
    // Whoever asks is told.
    let mut asking = Client::tcp(process.address(0));
    asking.send("{\"class\":\"POLL\"}");
    let status = asking.next_of("STATUS");
    let refused = status["refused"].as_array().unwrap();
    for id in ways {
        let own = refused.iter().find(|loss| loss["source"] == id).unwrap();
        assert_eq!(
            (&own["code"], &own["count"]),
            (&"no_stamp".into(), &200.into())
        );
    }
}

#[test]
fn lines_of_the_wrong_shape_are_reported_with_their_column_and_good_ones_are_not() {
    let (process, warnings) = logged(&["--listen", TCP], std::process::Stdio::null());
    let mut good = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut bad = Client::tcp(process.address(0));
    for n in 0..15 {
        good.send(&super::client::rate("good", n, 1.0));
        good.next_of("ATT");
        bad.send("{\"id\":\"bad\",\"gyro\":[0.1,0]}");
    }
    let said = warnings.recv_timeout(PATIENCE).unwrap();
    assert!(
        said.starts_with("bad: none of 10 samples is used: `gyro` is a list of 2, not of 3"),
        "{said}"
    );
    assert!(said.contains("line 1, column 13"), "{said}");
    // One now and then that is sent twice or cannot be is no stream that is lost.
    for n in 15..60 {
        good.send(&super::client::rate("good", n, 1.0));
        good.next_of("ATT");
        if n % 5 == 0 {
            good.send(&super::client::rate("good", n - 10, 1.0));
            good.send("nonsense");
        }
    }
    drop(good);
    let more = warnings.recv_timeout(Duration::from_secs(4));
    assert!(more.is_err(), "{more:?}");
}
