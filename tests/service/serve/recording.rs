//! `--record`: what came in is in the file, and replays to what went out.

use super::client::{Client, rate};
use super::daemon::{Process, TCP, eventually};
use std::path::Path;

/// A daemon that records there, one who sends and one who watches.
fn recording(path: &Path, more: &[&str]) -> (Process, Client, Client) {
    let path = path.to_str().unwrap();
    let args = ["--listen", TCP, "--min-free", "0", "--record", path];
    let process = Process::start(&[&args, more].concat());
    let sender = Client::tcp(process.address(0));
    let watcher = Client::tcp(process.address(0)).watching("{\"class\":\"WATCH\"}");
    (process, sender, watcher)
}

#[test]
fn everything_sent_before_sigterm_is_in_the_recording_with_its_attitudes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let (mut process, mut sender, mut watcher) =
        recording(&path, &["--world", "ned", "--body", "frd"]);
    let lines: Vec<String> = (0..500).map(|n| rate("imu0", n, 1.0)).collect();
    sender.send(&lines.join("\n"));
    let mut sent = Vec::new();
    for _ in 0..500 {
        sent.push(watcher.object("ATT"));
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let bytes = std::fs::read(&path).unwrap();
    let stats = mcap::Summary::read(&bytes)
        .unwrap()
        .expect("a summary")
        .stats
        .unwrap();
    assert_eq!(stats.message_count, 1500, "sample, attitude, transform");
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let of = |topic: &str, key: &str| {
        let channel = summary.channels.values().find(|c| c.topic == topic);
        channel.unwrap().metadata.get(key).cloned()
    };
    for (key, value) in [
        ("world", "ned"),
        ("body", "frd"),
        ("rotates", "sensor_to_world"),
    ] {
        assert_eq!(of("imu0/data", key).as_deref(), Some(value));
        assert_eq!(of("imu0/data_raw", key), None);
    }
    let (mut samples, mut attitudes) = (0, Vec::new());
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(
            message.log_time > 1_600_000_000_000_000_000,
            "received today"
        );
        match message.channel.topic.as_str() {
            "imu0/data_raw" => samples += 1,
            "imu0/data" => attitudes.push(message.data.to_vec()),
            _ => {}
        }
    }
    assert_eq!(samples, 500);
    // Behind the encapsulation, stamp and "imu0": x, y, z, w on a multiple of eight.
    let recorded = |data: &[u8], i: usize| {
        f64::from_le_bytes(data[28 + 8 * i..36 + 8 * i].try_into().unwrap())
    };
    for (att, data) in sent.iter().zip(&attitudes) {
        for (i, name) in ["x", "y", "z", "w"].iter().enumerate() {
            assert_eq!(att["q"][name].as_f64().unwrap(), recorded(data, i), "{att}");
        }
    }
    assert_eq!(attitudes.len(), sent.len());
}

#[test]
fn a_hang_up_ends_the_file_and_goes_on_in_a_new_one() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let (mut process, mut sender, mut watcher) = recording(&path, &[]);
    let moved = dir.path().join("moved.mcap");
    for round in 0..3 {
        for n in 0..100 {
            sender.send(&rate("imu0", 100 * round + n, 1.0));
            watcher.object("ATT");
        }
        match round {
            // As a log rotation does it.
            0 => {
                std::fs::rename(&path, &moved).unwrap();
                process.signal("HUP");
                eventually("a new file of the same name", || path.exists());
            }
            // The name is taken: the next one is numbered.
            1 => {
                process.signal("HUP");
                let next = dir.path().join("a_0001.mcap");
                eventually("a numbered file", || next.exists());
            }
            _ => {}
        }
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    for file in ["moved.mcap", "a.mcap", "a_0001.mcap"] {
        let bytes = std::fs::read(dir.path().join(file)).unwrap();
        let stats = mcap::Summary::read(&bytes).unwrap().unwrap().stats.unwrap();
        assert_eq!(stats.message_count, 300, "{file}");
    }
}

#[test]
fn a_recording_that_can_not_begin_is_said_before_anything_listens() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    std::fs::write(&path, b"precious").unwrap();
    let path = path.to_str().unwrap();
    for (args, code, word) in [
        (vec!["--record", path], 1, "--force"),
        (vec!["--record", "x.csv"], 2, ".mcap"),
        (
            vec!["--record", path, "--record-split", "7 parsecs"],
            2,
            "--record-split",
        ),
        (
            vec!["--record", path, "--min-free", "lots"],
            2,
            "--min-free",
        ),
    ] {
        let output = std::process::Command::new(super::daemon::strapd())
            .args(["serve", "--listen", TCP])
            .args(&args)
            .current_dir(dir.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(word), "{args:?}: {said}");
    }
    assert_eq!(std::fs::read(path).unwrap(), b"precious");
}

#[test]
fn what_one_daemon_records_no_other_process_replaces() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let (mut process, mut sender, mut watcher) = recording(&path, &["--force"]);
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/xsens_mti.mcap");
    let (name, log) = (path.to_str().unwrap(), log.to_str().unwrap());
    let serve = ["serve", "--listen", TCP, "--min-free", "0", "--force"];
    process.assert_refuses(&[&serve[..], &["--record", name]].concat());
    process.assert_refuses(&["replay", log, "-o", name, "--force"]);
    for n in 0..100 {
        sender.send(&rate("imu0", n, 1.0));
        watcher.object("ATT");
    }
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
    let bytes = std::fs::read(&path).unwrap();
    let stats = mcap::Summary::read(&bytes).unwrap().unwrap().stats.unwrap();
    assert_eq!(stats.message_count, 300, "sample, attitude, transform");
    // With nobody writing it, it is replaced as ever; and a lock that a killed process had holds nobody up.
    let (mut process, ..) = recording(&path, &["--force"]);
    process.child.kill().unwrap();
    process.child.wait().unwrap();
    let (mut process, ..) = recording(&path, &["--force"]);
    process.signal("TERM");
    assert_eq!(process.exit(), Some(0));
}
