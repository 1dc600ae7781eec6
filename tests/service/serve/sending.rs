//! `strapd send`: a recording through a daemon, in time, over every transport.

use super::client::Client;
use super::daemon::{Daemon, TCP, WS, eventually, listening, strapd};
use serde_json::Value;
use std::net::TcpListener;
use std::process::{Command, Output, Stdio};
use strapd::serve::guard::admission::Token;
use strapd_attitude::estimate::Aid;

const LOG: &str = "fixtures/xsens_mti.mcap";
const SAMPLES: usize = 953;

fn run(args: &[&str]) -> Output {
    let mut command = Command::new(strapd());
    command.args(args).stdin(Stdio::null());
    command.env_remove("STRAPD_AID").output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Attitudes that `replay` makes of the log with the method of a daemon.
fn replayed() -> Vec<Value> {
    let output = run(&["replay", LOG, "--method", "commit", "-o", "-"]);
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn what_is_sent_becomes_the_attitude_of_a_replay_over_every_transport() {
    let expected = replayed();
    assert_eq!(expected.len(), SAMPLES);
    let dir = tempfile::tempdir().unwrap();
    let unix = format!("unix-listen://{}", dir.path().join("s").display());
    for way in ["tcp", "ws", "unix"] {
        let mut settings = listening(&[TCP, WS, &unix]);
        settings.hub.plan.aid = Aid::Auto;
        let daemon = Daemon::start(settings);
        let address = match way {
            "tcp" => format!("tcp://{}", daemon.address(0)),
            "ws" => format!("ws://{}", daemon.address(1)),
            _ => unix.replace("unix-listen", "unix"),
        };
        let mut watcher = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
        let sent = std::thread::spawn(move || {
            run(&[
                "send", LOG, &address, "--speed", "20", "--id", "left", "--json",
            ])
        });
        for expected in &expected {
            let attitude = watcher.next_of("ATT");
            for part in ["stamp", "q", "rate", "sigma_deg", "seq"] {
                assert_eq!(attitude[part], expected[part], "{way}: {attitude}");
            }
            assert_eq!(attitude["id"], "left");
        }
        let sent = sent.join().unwrap();
        assert!(sent.status.success(), "{way}: {}", said(&sent));
        let summary: Value = serde_json::from_slice(&sent.stdout).unwrap();
        assert_eq!(summary["sent"], SAMPLES);
        // The field has a topic of its own.
        assert_eq!(summary["sent_beside"], SAMPLES);
        assert_eq!(summary["errors"], 0);
        // 19 s of data, twenty times as fast.
        let secs = summary["elapsed_secs"].as_f64().unwrap();
        assert!(secs > 0.95, "{way}: {secs} s");
    }
}

#[test]
fn all_of_it_has_been_read_when_a_hurried_send_ends() {
    let daemon = Daemon::tcp();
    let address = format!("tcp://{}", daemon.address(0));
    let sent = run(&["send", LOG, &address, "--speed", "max"]);
    assert!(sent.status.success(), "{}", said(&sent));
    assert!(
        said(&sent).contains(&format!(
            "sent {SAMPLES} samples of /imu/data and {SAMPLES} lines of forces or fields to tcp://"
        )),
        "{}",
        said(&sent)
    );
    eventually("every sample is taken", || {
        daemon.status()["sources"][0]["samples"] == SAMPLES
    });
}

#[test]
fn the_token_is_shown_and_its_absence_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("token");
    std::fs::write(&file, "correct horse battery\n").unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o600)).unwrap();
    }
    let mut settings = listening(&[TCP, WS]);
    settings.hub.token = Some(Token::new("correct horse battery"));
    let daemon = Daemon::start(settings);
    for address in [
        format!("tcp://{}", daemon.address(0)),
        format!("ws://{}", daemon.address(1)),
    ] {
        let send =
            |more: &[&str]| run(&[&["send", LOG, &address, "--speed", "max"][..], more].concat());
        let refused = send(&[]);
        assert!(!refused.status.success(), "{address}");
        assert!(said(&refused).contains("token"), "{}", said(&refused));
        let taken = send(&["--token-file", file.to_str().unwrap()]);
        assert!(taken.status.success(), "{}", said(&taken));
    }
}

#[test]
fn an_output_that_asks_for_a_token_took_nothing_and_that_is_a_failure() {
    let mut settings = listening(&[TCP]);
    settings.hub.token = Some(Token::new("correct horse battery"));
    let daemon = Daemon::start(settings);
    let output = format!("tcp://{}", daemon.address(0));
    // All is written before the answer comes, and far more than a socket holds.
    for duration in ["0.1", "5"] {
        let refused = run(&["simulate", "hand", "--duration", duration, "-o", &output]);
        let words = said(&refused);
        assert_eq!(refused.status.code(), Some(3), "{duration} s: {words}");
        assert!(words.contains("asks for a token"), "{duration} s: {words}");
        assert!(
            words.contains(&format!("strapd send - {output}")),
            "{words}"
        );
    }
}

#[test]
fn complaints_are_heard_and_counted() {
    let daemon = Daemon::tcp();
    let address = format!("tcp://{}", daemon.address(0));
    // No sensor is called so.
    let id = "n".repeat(300);
    let output = run(&["send", LOG, &address, "--speed", "max", "--id", &id]);
    assert!(!output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("bad_id"), "{}", said(&output));
}

#[test]
fn nobody_there_and_nothing_to_send_are_said_at_once() {
    // Bound and let go: nobody listens.
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let address = format!("tcp://{free}");
    let output = run(&["send", LOG, &address]);
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains(&address), "{}", said(&output));
    for (args, words) in [
        (vec!["send", "no_such.mcap", &*address], "no_such.mcap"),
        (vec!["send", LOG, "udp-listen://127.0.0.1:1"], "listens"),
        (vec!["send", LOG, "127.0.0.1:4550"], "known: tcp://"),
        (vec!["send", LOG, "--speed", "0"], "--speed 0"),
    ] {
        let output = run(&args);
        assert!(!output.status.success());
        assert!(said(&output).contains(words), "{}", said(&output));
    }
}
