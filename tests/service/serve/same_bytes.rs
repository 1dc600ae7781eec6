//! The way in changes no byte of the attitude, as it is corrected by default.

use super::client::Client;
use super::daemon::{Daemon, Process, TCP, UDP, WS, listening, strapd};
use crate::made_logs::{motion, written};
use crate::shared_data;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use strapd_attitude::estimate::Aid;
use strapd_attitude::record::SampleKind;

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

fn is_rate(line: &[u8]) -> bool {
    line.windows(7).any(|part| part == b"\"gyro\":")
}

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
        // A field in a line of its own is no attitude.
        for _ in round.iter().filter(|line| is_rate(line)) {
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
        lines.iter().filter(|line| is_rate(line)).count(),
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
        let mut settings = listening(&[TCP, UDP, WS, &unix]);
        settings.hub.plan.aid = Aid::Auto;
        let daemon = Daemon::start(settings);
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

    let mut process = Process::start(&["-", "--listen", TCP, "--threads", "1", "--aid", "auto"]);
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

/// Samples of most recordings that are sent: past the first seconds, where steps are learnt, and past gaps.
const MANY: usize = 4000;

/// Output of `strapd ARGS`, whether or not samples were lost on the way; `None` where it cannot begin.
fn printed(args: &[&str], input: &[u8]) -> Option<Vec<u8>> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("input");
    std::fs::write(&path, input).unwrap();
    let output = Command::new(strapd())
        .args(args)
        .stdin(std::fs::File::open(path).unwrap())
        .output()
        .unwrap();
    matches!(output.status.code(), Some(0 | 3)).then_some(output.stdout)
}

/// The attitudes a daemon that takes samples for this kind makes of these lines.
fn served(kind: SampleKind, lines: &[&[u8]]) -> Vec<u8> {
    let mut settings = listening(&[TCP]);
    settings.hub.plan.kind = Some(kind);
    settings.hub.plan.aid = Aid::Auto;
    let daemon = Daemon::start(settings);
    let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    let mut sender = Client::tcp(daemon.address(0));
    let mut out = Vec::new();
    // Another sensor says when a round has been answered: attitudes come in the order of their samples.
    let mut marks = 0;
    let mut mark = |sender: &mut Client| {
        marks += 1;
        let line = format!(
            "{{\"class\":\"RATE\",\"id\":\"mark\",\"stamp\":{{\"sec\":1700000000,\"nsec\":{}}},\"gyro\":[0,0,0]}}\n",
            marks * 1_000_000
        );
        sender.send_bytes(line.as_bytes());
    };
    // The first mean waits for the second.
    mark(&mut sender);
    mark(&mut sender);
    let mut expected = 2;
    for round in lines.chunks(ROUND) {
        sender.send_bytes(&round.concat());
        mark(&mut sender);
        expected += 1;
        let last = format!("\"id\":\"mark\",\"seq\":{},", expected - 1);
        loop {
            let line = watcher.line().unwrap();
            if line.contains(&last) {
                break;
            }
            if !line.contains("\"id\":\"mark\"") {
                out.extend_from_slice(line.as_bytes());
                out.push(b'\n');
            }
        }
    }
    out
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_recording_gives_the_bytes_of_a_replay_whatever_its_stamps_and_samples_are_like() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let folders = [Some(fixtures), shared_data::shared("logs/real")];
    let logs = folders.iter().flatten().flat_map(|folder| {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().path())
    });
    let mut compared = 0;
    for log in logs.filter(|path| path.extension().is_some_and(|e| e == "mcap")) {
        let Some(samples) = printed(&["cat", log.to_str().unwrap()], b"") else {
            // Several topics, or none.
            continue;
        };
        let lines: Vec<&[u8]> = samples
            .split_inclusive(|b| *b == b'\n')
            .take(MANY)
            .collect();
        let sent = lines.concat();
        for kind in [SampleKind::Rate, SampleKind::Average] {
            let args = [
                "replay",
                "-",
                "--method",
                "commit",
                "--sample-kind",
                kind.name(),
            ];
            let Some(expected) = printed(&[&args[..], &["-o", "-"]].concat(), &sent) else {
                continue;
            };
            let got = served(kind, &lines);
            // What shares the last stamp of all waits for a later one, which a replay knows not to come.
            let rest = expected.strip_prefix(&got[..]).unwrap_or_else(|| {
                let at = got
                    .iter()
                    .zip(&expected)
                    .take_while(|(a, b)| a == b)
                    .count();
                let line = got[..at].iter().filter(|b| **b == b'\n').count();
                panic!(
                    "{} as {}: differs at attitude {line}",
                    log.display(),
                    kind.name()
                )
            });
            let rest = rest.iter().filter(|b| **b == b'\n').count();
            assert!(
                rest < 20,
                "{} as {}: {rest} short",
                log.display(),
                kind.name()
            );
            compared += 1;
        }
    }
    assert!(compared >= 16, "{compared} compared");
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

#[test]
fn forces_in_lines_of_their_own_give_the_bytes_of_a_replay_whichever_comes_first() {
    for forces_first in [true, false] {
        let lines: Vec<String> = super::besides::phone(0..MANY as u64, forces_first)
            .into_iter()
            .map(|line| line + "\n")
            .collect();
        let lines: Vec<&[u8]> = lines.iter().map(|line| line.as_bytes()).collect();
        let args = [
            "replay",
            "-",
            "--method",
            "commit",
            "--sample-kind",
            "rate",
            "-o",
            "-",
        ];
        let expected = printed(&args, &lines.concat()).unwrap();
        let got = served(SampleKind::Rate, &lines);
        assert!(got == expected, "forces first: {forces_first}");
        assert_eq!(got.iter().filter(|b| **b == b'\n').count(), MANY);
    }
}
