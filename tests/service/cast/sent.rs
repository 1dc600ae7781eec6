//! `-o tcp://` and `-o udp://`: to somebody who listens.

use super::lines::{LOG, SIMULATION, lines_of, of_class};
use crate::program::{self, strapd};
use crate::serve::daemon::{Daemon, PATIENCE, eventually};
use serde_json::Value;
use std::io::Read;
use std::net::{TcpListener, UdpSocket};
use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn whoever_listens_on_tcp_gets_the_bytes_of_standard_output_and_an_end() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let reader = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
    });
    strapd(root(), &format!("replay {LOG} -o tcp://{address}")).done();
    let text = reader.join().unwrap();
    assert!(text.lines().eq(lines_of(&format!("replay {LOG}"))));
    assert!(text.ends_with('\n'), "the last line is cut");
}

#[test]
fn a_simulation_feeds_a_daemon_and_every_sample_arrives() {
    let daemon = Daemon::tcp();
    let arguments = format!("{SIMULATION} -o tcp://{}", daemon.address(0));
    strapd(root(), &arguments).done();
    let samples = of_class(&lines_of(SIMULATION), "RATE").len();
    // It has sent them all; whether they were read is the daemon's matter.
    eventually("every sample", || {
        daemon.status()["sources"][0]["samples"] == samples
    });
    let status = daemon.status();
    assert_eq!(status["sources"][0]["lost"], 0);
    assert_eq!(status["counters"]["samples_refused"], 0);
}

#[test]
fn a_listener_that_breaks_off_ends_that_sink_alone_and_the_run_says_that_something_was_lost() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("whole.ndjson");
    let reader = std::thread::spawn(move || drop(listener.accept().unwrap()));
    let arguments = format!(
        "{SIMULATION} --speed 4 -o tcp://{address} -o {}",
        file.display()
    );
    let ran = strapd(root(), &arguments);
    reader.join().unwrap();
    assert_eq!(ran.code, Some(3), "{ran:?}");
    assert!(ran.err.contains("nothing more is sent there"), "{ran:?}");
    let written = std::fs::read_to_string(file).unwrap();
    assert_eq!(written.lines().count(), lines_of(SIMULATION).len());
}

#[test]
fn nobody_listening_is_an_error_that_says_where() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let ran = strapd(root(), &format!("replay {LOG} -o tcp://{address}"));
    ran.refused(1, &["cannot connect", &address.to_string(), "help"]);
}

/// Datagrams up to the end of the run.
fn datagrams(arguments: &str, profile: &str) -> Vec<String> {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let address = socket.local_addr().unwrap();
    let expected = lines_of(arguments).len();
    let arguments = format!("{arguments} --speed 2 -o udp://{address}{profile}");
    let run = std::thread::spawn(move || program::strapd(root(), &arguments));
    let mut buffer = [0; 65_536];
    let heard: Vec<String> = (0..expected)
        .map(|_| {
            let n = socket.recv(&mut buffer).unwrap();
            assert!(n <= 2048, "PlotJuggler reads no more: {n}");
            String::from_utf8(buffer[..n].to_vec()).unwrap()
        })
        .collect();
    run.join().unwrap().done();
    heard
}

#[test]
fn over_udp_every_object_is_a_datagram() {
    let mut expected = lines_of(SIMULATION);
    let mut heard = datagrams(SIMULATION, "");
    for text in &mut heard {
        assert_eq!(text.pop(), Some('\n'));
    }
    // A pace cuts samples and truth into other turns.
    heard.sort();
    expected.sort();
    assert!(heard == expected);
}

#[test]
fn for_plotjuggler_an_object_is_a_timestamp_and_numbers() {
    let heard = datagrams(
        "simulate coning --rate-hz 100 --duration 1",
        "?profile=plotjuggler",
    );
    let mut seen = std::collections::BTreeSet::new();
    for text in &heard {
        let value: Value = serde_json::from_str(text).unwrap();
        assert!(value["timestamp"].as_f64().unwrap() >= 1.7e9);
        let fields = value.as_object().unwrap();
        assert_eq!(fields.len(), 2, "{text}");
        seen.extend(fields.keys().cloned());
        assert!(!text.contains('['), "{text}");
    }
    assert_eq!(
        seen.into_iter().collect::<Vec<_>>(),
        ["imu", "timestamp", "truth"]
    );
}

#[test]
fn datagrams_nobody_takes_are_no_failure() {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap();
    drop(socket);
    let ran = strapd(
        root(),
        &format!("{SIMULATION} --speed 20 -o udp://{address}"),
    );
    assert!(ran.done().err.contains("found nobody listening"), "{ran:?}");
}
