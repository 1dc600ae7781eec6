//! `--state`: a restart loses no attitude.

use super::client::{Client, rate};
use super::daemon::{Daemon, Process, TCP, eventually};
use serde_json::Value;
use std::path::Path;

fn started(state: &Path, more: &[&str]) -> (Process, Client, Client) {
    let args = [&["--listen", TCP, "--state", state.to_str().unwrap()], more].concat();
    let process = Process::start(&args);
    let sender = Client::tcp(process.address(0));
    let watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    (process, sender, watcher)
}

fn through(sender: &mut Client, watcher: &mut Client, numbers: std::ops::Range<u64>) -> Value {
    let mut last = Value::Null;
    for n in numbers {
        sender.send(&rate("imu0", n, 1.0));
        last = watcher.object("ATT");
    }
    last
}

#[test]
fn a_second_daemon_with_the_same_state_is_refused_until_the_first_has_gone() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    let (mut process, mut sender, mut watcher) = started(&path, &[]);
    let last = through(&mut sender, &mut watcher, 0..100);
    // A recording that it would have replaced is still there.
    let recording = dir.path().join("a.mcap");
    std::fs::write(&recording, b"precious").unwrap();
    let named = |path: &Path| path.to_str().unwrap().to_owned();
    let (state, recorded) = (named(&path), named(&recording));
    let serve = ["serve", "--listen", TCP, "--min-free", "0", "--force"];
    process.assert_refuses(&[&serve[..], &["--state", &state, "--record", &recorded]].concat());
    let by_another_name = named(&dir.path().join(".").join("state.json"));
    process.assert_refuses(&["serve", "--listen", TCP, "--state", &by_another_name]);
    assert_eq!(std::fs::read(&recording).unwrap(), b"precious");
    eventually("the last attitude in the file", || {
        std::fs::read_to_string(&path).is_ok_and(|text| text.contains("1700000000099000000"))
    });
    // Killed, it leaves no lock behind, and its state.
    process.child.kill().unwrap();
    process.child.wait().unwrap();
    let (_process, mut sender, mut watcher) = started(&path, &[]);
    let first = through(&mut sender, &mut watcher, 100..101);
    assert_eq!(first["reset"], last["reset"]);
    assert!(!first["status"].to_string().contains("started"), "{first}");
}

fn sigma(att: &Value) -> f64 {
    att["sigma_deg"][0].as_f64().unwrap()
}

#[test]
fn killed_and_started_again_it_goes_on_where_it_was_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    let (mut process, mut sender, mut watcher) = started(&path, &[]);
    let last = through(&mut sender, &mut watcher, 0..500);
    let stamp = "1700000000499000000";
    eventually("the last attitude in the file", || {
        std::fs::read_to_string(&path).is_ok_and(|text| text.contains(stamp))
    });
    process.child.kill().unwrap();
    process.child.wait().unwrap();

    // Two seconds later by the sensor's clock.
    let (mut process, mut sender, mut watcher) = started(&path, &[]);
    let first = through(&mut sender, &mut watcher, 2500..2501);
    assert_eq!(first["q"], last["q"], "to the bit");
    let status: Vec<_> = first["status"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s.as_str().unwrap())
        .collect();
    assert!(
        status.contains(&"restarted") && status.contains(&"held"),
        "{status:?}"
    );
    assert_eq!((&last["reset"], &first["reset"]), (&0.into(), &1.into()));
    // At 1 rad/s two seconds may hide two rad.
    assert!(
        sigma(&last) < 1.0 && (sigma(&first) - 2f64.to_degrees()).abs() < 1.0,
        "{first}"
    );
    let second = through(&mut sender, &mut watcher, 2501..2502);
    assert!(
        !second["status"].to_string().contains("restarted"),
        "{second}"
    );
    assert_eq!(second["reset"], 1);

    // Ended in order, the very last one is there, at once.
    let last = through(&mut sender, &mut watcher, 2502..2600);
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let (mut process, mut sender, mut watcher) = started(&path, &["--on-gap", "reset"]);
    // A sensor that has not come back keeps its attitude in the file.
    sender.send(&rate("other", 2600, 1.0));
    watcher.object("ATT");
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let (process, mut sender, mut watcher) = started(&path, &["--on-gap", "reset"]);
    // Other settings than when it was saved: it cannot go on exactly.
    let first = through(&mut sender, &mut watcher, 2600..2601);
    assert_eq!(first["q"], last["q"]);
    assert_eq!(first["reset"], 2);
    // A reset later goes to where the flags say, not to what was saved.
    let after = through(&mut sender, &mut watcher, 9600..9601);
    assert_eq!(after["q"]["w"], 1.0, "{after}");

    sender.send("{\"class\":\"POLL\"}");
    let said = sender.next_of("STATUS");
    assert_eq!(said["sources"][0]["initial"], "as saved before the restart");
    drop(process);
}

#[test]
fn ended_and_started_again_a_stream_goes_on_to_the_byte() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    let mut lines = Vec::new();
    for (from, to) in [(0, 300), (300, 301), (301, 700)] {
        let (mut process, mut sender, mut watcher) = started(&path, &[]);
        for n in from..to {
            sender.send(&rate("imu0", n, (n as f64 * 0.1).sin()));
            lines.push(watcher.line().unwrap());
        }
        process.signal("TERM");
        assert_eq!(process.exit(), Some(0));
    }
    let daemon = Daemon::tcp();
    let mut unbroken = Client::tcp(daemon.address(0)).watching("{\"class\":\"WATCH\"}");
    for (n, line) in lines.iter().enumerate() {
        unbroken.send(&rate("imu0", n as u64, (n as f64 * 0.1).sin()));
        assert_eq!(unbroken.line().as_ref(), Some(line), "{n}");
    }
}

#[test]
fn what_is_no_regular_file_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let fifo = dir.path().join("fifo");
    let made = std::process::Command::new("mkfifo")
        .arg(&fifo)
        .status()
        .unwrap();
    assert!(made.success());
    for path in [fifo.as_path(), dir.path(), Path::new("/dev/null")] {
        let mut child = std::process::Command::new(super::daemon::strapd())
            .args(["serve", "--listen", TCP, "--state"])
            .arg(path)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        eventually("it has refused", || child.try_wait().unwrap().is_some());
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("no regular file"), "{said}");
    }
}

#[test]
fn between_other_axes_it_begins_anew_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    let (mut process, mut sender, mut watcher) =
        started(&path, &["--world", "ned", "--body", "frd"]);
    let ned = through(&mut sender, &mut watcher, 0..100);
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let (mut process, mut sender, mut watcher) =
        started(&path, &["--world", "ned", "--body", "frd"]);
    // After a gap too long to be bridged, so that it is held.
    let same = through(&mut sender, &mut watcher, 1100..1101);
    for c in ["w", "x", "y", "z"] {
        let difference = same["q"][c].as_f64().unwrap() - ned["q"][c].as_f64().unwrap();
        assert!(difference.abs() < 1e-15, "{ned} {same}");
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));

    let (_process, mut sender, mut watcher) = started(&path, &[]);
    let anew = through(&mut sender, &mut watcher, 1101..1102);
    assert_eq!(
        (&anew["q"]["w"], &anew["reset"]),
        (&1.0.into(), &0.into()),
        "{anew}"
    );
    sender.send("{\"class\":\"POLL\"}");
    let said = sender.next_of("STATUS");
    let warnings = said["sources"][0]["warnings"].to_string();
    assert!(
        warnings.contains("ned") && warnings.contains("begun anew"),
        "{said}"
    );
}

#[test]
fn a_file_that_is_none_of_ours_or_can_not_be_written_is_said_before_anything_listens() {
    let dir = tempfile::tempdir().unwrap();
    let foreign = dir.path().join("foreign");
    std::fs::write(&foreign, b"precious").unwrap();
    let nowhere = dir.path().join("no/such/folder");
    for (path, code, words) in [
        (&foreign, 2, "move it away"),
        (&nowhere, 1, "no/such/folder"),
    ] {
        let output = std::process::Command::new(super::daemon::strapd())
            .args(["serve", "--listen", TCP, "--state"])
            .arg(path)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains(words), "{said}");
    }
    assert_eq!(std::fs::read(&foreign).unwrap(), b"precious");
}
