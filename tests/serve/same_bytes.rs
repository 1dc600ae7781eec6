//! The way in changes no byte of the attitude (service.md T3).

use super::client::Client;
use super::daemon::{Daemon, Process, TCP, UDP, WS, listening, strapd};
use crate::made_logs::{motion, written};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// `strapd ARGS` with this on standard input.
fn output(args: &[&str], input: &[u8]) -> Vec<u8> {
    let mut child = Command::new(strapd())
        .args(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    let writer = std::thread::spawn(move || {
        // A command that reads no standard input closes it.
        let _ = stdin.write_all(&input);
    });
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success(), "{args:?}");
    output.stdout
}

/// Lines sent before as many attitudes are read: an outbox holds them all, so nothing is dropped on
/// either side, and the two sides seldom wait for each other.
const ROUND: usize = 400;

/// Sends lines, `piece` of them at once, and reads as many attitudes.
fn through(
    sender: &mut dyn FnMut(&[u8]),
    lines: &[&[u8]],
    watcher: &mut Client,
    piece: usize,
) -> Vec<u8> {
    let mut out = Vec::new();
    for round in lines.chunks(ROUND) {
        for some in round.chunks(piece) {
            sender(&some.concat());
        }
        for _ in round {
            out.extend_from_slice(watcher.line().unwrap().as_bytes());
            out.push(b'\n');
        }
    }
    out
}

fn check(log: &Path) {
    let name = log.display();
    let samples = output(&["cat", log.to_str().unwrap()], b"");
    let expected = output(&["replay", "-", "--method", "commit", "-o", "-"], &samples);
    let lines: Vec<&[u8]> = samples.split_inclusive(|b| *b == b'\n').collect();
    assert!(lines.len() > 200, "{name}");
    assert_eq!(
        expected.iter().filter(|b| **b == b'\n').count(),
        lines.len(),
        "{name}"
    );

    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("s");
    let unix = format!("unix-listen://{}", path.display());
    for (way, piece) in [
        ("tcp", 1),
        ("tcp", ROUND),
        ("udp", 20),
        ("web", 7),
        ("unix", 64),
    ] {
        // A sensor goes on where it stopped: each way gets a daemon of its own.
        let daemon = Daemon::start(listening(&[TCP, UDP, WS, &unix]));
        let watcher = if way == "tcp" {
            Client::web(daemon.address(2))
        } else {
            Client::tcp(daemon.address(0))
        };
        let mut watcher = watcher.watching("{\"class\":\"WATCH\"}");
        let mut sender = match way {
            "tcp" => Client::tcp(daemon.address(0)),
            "udp" => Client::udp(daemon.address(1)),
            "web" => Client::web(daemon.address(2)),
            _ => Client::unix(&path),
        };
        let got = through(&mut |b| sender.send_bytes(b), &lines, &mut watcher, piece);
        assert!(got == expected, "{name} over {way}, {piece} at once");
    }

    let mut process = Process::start(&["-", "--listen", TCP, "--threads", "1"]);
    let mut stdin = process.child.stdin.take().unwrap();
    let mut watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    let got = through(
        &mut |b| stdin.write_all(b).unwrap(),
        &lines,
        &mut watcher,
        50,
    );
    assert!(got == expected, "{name} on standard input");
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}

#[test]
fn file_tcp_udp_websocket_unix_and_stdin_give_the_same_attitudes_to_the_byte() {
    let dir = tempfile::tempdir().unwrap();
    check(&written(dir.path(), "motion.mcap", &motion(1000)));
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    check(&fixtures.join("xsens_mti.mcap"));
    // Means over intervals: they need their predecessor.
    check(&fixtures.join("coning_average.mcap"));
}
