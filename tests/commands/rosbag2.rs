//! Promise: a recording of ROS 2 in SQLite is a log like any other, for every command, and holds what SQLite itself
//! reads in it.

use crate::made_databases::database;
use crate::mcap_logs::read_some;
use crate::program::{strapd, strapd_fed};
use crate::replays::fixture;
use sha2::{Digest, Sha256};
use std::path::Path;
use std::process::Command;
use strapd_recording::mcap::{Order, Reader, WalkOptions};

fn bench(files: &[&str]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for file in files {
        std::fs::copy(fixture(file), dir.path().join(file)).unwrap();
    }
    dir
}

fn text(dir: &Path, file: &str) -> String {
    std::fs::read_to_string(dir.join(file)).unwrap()
}

const KILLED: [&str; 2] = ["constant_rate_killed.db3", "constant_rate_killed.db3-wal"];

#[test]
fn a_recording_in_sqlite_gives_the_attitude_of_the_mcap_to_the_last_bit() {
    let dir = bench(&["constant_rate.db3", KILLED[0], KILLED[1]]);
    let at = dir.path();
    // What is made of it is an MCAP, which other readers take.
    for (file, messages) in [("constant_rate.db3", 200), (KILLED[0], 80)] {
        strapd(at, &format!("recover {file} -o copy.mcap --force")).done();
        let log = std::fs::read(at.join("copy.mcap")).unwrap();
        let read = mcap::MessageStream::new(&log).unwrap().map(Result::unwrap);
        let texts = read.map(|m| m.channel.schema.clone().unwrap().data.len());
        assert_eq!(
            texts.filter(|length| *length > 100).count(),
            messages,
            "{file}"
        );
        strapd(at, "replay copy.mcap -o mcap.csv --force").done();
        let expected = text(at, "mcap.csv");
        assert_eq!(expected.lines().count(), messages / 2 + 1, "{file}");
        for threads in [1, 8] {
            let replay = format!("replay {file} -o db.csv --force --threads {threads}");
            strapd(at, &replay).done();
            assert!(text(at, "db.csv") == expected, "{file}, {threads} threads");
        }
    }
    let bytes = std::fs::read(at.join("constant_rate.db3")).unwrap();
    strapd(at, "replay constant_rate.db3 -o file.csv").done();
    strapd_fed(at, "replay - -o piped.csv", bytes.clone()).done();
    assert!(text(at, "piped.csv") == text(at, "file.csv"));
    strapd(at, "recover constant_rate.db3 -o copy.mcap --force").done();
    strapd_fed(at, "recover - -o piped.mcap", bytes).done();
    let copies = ["copy.mcap", "piped.mcap"].map(|file| std::fs::read(at.join(file)).unwrap());
    assert!(copies[0] == copies[1]);
    let info = strapd(at, "info constant_rate.db3");
    let words = [
        "200 messages on 2 topics; rosbag2 SQLite; written by rosbag2 of ROS 2 rosbags",
        "sensor_msgs/msg/Imu [cdr]",
    ];
    for words in words {
        assert!(info.done().out.contains(words), "{words}: {info:?}");
    }
}

#[test]
fn the_folder_of_a_recording_is_the_recording_and_its_metadata_name_the_way_in() {
    let dir = bench(&[]);
    let folder = dir.path().join("bag");
    std::fs::create_dir(&folder).unwrap();
    for file in KILLED {
        std::fs::copy(fixture(file), folder.join(file)).unwrap();
    }
    std::fs::write(
        folder.join("metadata.yaml"),
        "rosbag2_bagfile_information:\n",
    )
    .unwrap();
    let info = strapd(dir.path(), "info bag");
    assert!(info.done().out.contains("80 messages"), "{info:?}");
    strapd(dir.path(), "info bag/metadata.yaml").refused(1, &["rosbag2", "folder", ".db3"]);
    std::fs::copy(fixture("constant_rate.db3"), folder.join("b.db3")).unwrap();
    strapd(dir.path(), "info bag").refused(
        1,
        &[
            "parts of one recording are of one device",
            "b.db3",
            "without --join",
        ],
    );
}

#[test]
fn a_database_cut_short_exits_with_3_and_one_of_something_else_says_which_table_is_missing() {
    let dir = bench(&[]);
    let at = dir.path();
    let whole = std::fs::read(fixture("constant_rate.db3")).unwrap();
    std::fs::write(at.join("cut.db3"), &whole[..whole.len() * 6 / 10]).unwrap();
    let ran = strapd(at, "replay cut.db3 -o null: --json");
    assert_eq!(ran.code, Some(3), "{ran:?}");
    for words in ["of 19 pages 11 are there", "it is not there"] {
        assert!(ran.out.contains(words), "{words}: {ran:?}");
    }
    std::fs::write(at.join("history.db"), database(512, &[], &[])).unwrap();
    strapd(at, "replay history.db").refused(1, &["history.db", "no IMU topic"]);
    let mut other = whole;
    for table in ["topics", "messages"] {
        let at = memchr::memmem::find(&other, format!("{table}(").as_bytes()).unwrap();
        for at in memchr::memmem::find_iter(&other.clone()[..at], table.as_bytes()) {
            other[at] = b'x';
        }
    }
    std::fs::write(at.join("x.db"), &other).unwrap();
    strapd(at, "replay x.db").refused(1, &["x.db", "no table", "messages"]);
}

/// Sums of messages, as the oracle has them.
fn sum(path: &Path) -> (u64, String, u64) {
    let options = WalkOptions {
        order: Order::File,
        ..WalkOptions::default()
    };
    let (messages, report) = read_some(Reader::open(path).unwrap(), &options, |_| true);
    let mut sha = Sha256::new();
    for (topic, time, _, data) in &messages {
        for number in [topic.len() as u64, *time, data.len() as u64] {
            sha.update(number.to_le_bytes());
        }
        sha.update(topic);
        sha.update(data);
    }
    let sha = sha.finalize().iter().map(|b| format!("{b:02x}")).collect();
    (messages.len() as u64, sha, report.survey.problems.total())
}

#[test]
#[cfg_attr(not(has_python), ignore = "needs python3")]
fn databases_of_every_shape_hold_the_rows_that_sqlite_reads_in_the_order_of_their_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let ours = dir.path().join("ours.db3");
    let payloads: Vec<Vec<u8>> = (0..90_u8).map(|n| vec![n; 300]).collect();
    let messages: Vec<_> = payloads.iter().map(|p| (0, 7, p.as_slice())).collect();
    std::fs::write(&ours, database(1024, &[("/a", "b/msg/C")], &messages)).unwrap();
    let ran = Command::new("python3")
        .arg("tests/oracles/sqlite_rows.py")
        .arg(dir.path())
        .args([ours, fixture("constant_rate.db3"), fixture(KILLED[0])])
        .output()
        .unwrap();
    assert!(ran.status.success(), "{ran:?}");
    let mut read = 0;
    for line in String::from_utf8(ran.stdout).unwrap().lines() {
        let said: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(said["check"], "ok", "{line}");
        let (count, sha, problems) = sum(Path::new(said["file"].as_str().unwrap()));
        assert_eq!(said["messages"].as_u64(), Some(count), "{line}");
        assert_eq!(said["sha256"].as_str(), Some(sha.as_str()), "{line}");
        assert_eq!(problems, 0, "{line}");
        read += 1;
    }
    assert_eq!(read, 18);
}
