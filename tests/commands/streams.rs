//! Promise: what must not change the result changes no bit of it: threads, speed, the form of the
//! output, and the way the samples came in.

use crate::made_logs::{ImuSample, bytes, imu_message, logged, motion, written};
use crate::replays::{Bits, csv, fixture, mcap, ndjson, replay_of, target};
use assert_cmd::Command;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use strapd::pipeline::replay::run;
use strapd::sink::Compression;
use strapd_recording::pool::Pool;

fn strapd() -> Command {
    let mut command = Command::cargo_bin("strapd").unwrap();
    // The gyro alone: what the runs in this process do.
    command.env("STRAPD_AID", "none");
    command
}

/// Long enough for several batches of 2048 and several chunks of every worker.
fn long_log(dir: &Path) -> PathBuf {
    written(dir, "long.mcap", &motion(9000))
}

#[test]
fn one_two_and_four_threads_write_the_same_bytes_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let logs = [
        long_log(dir.path()),
        fixture("xsens_mti.mcap"),
        fixture("faults.mcap"),
        fixture("coning_jitter.mcap"),
    ];
    for log in &logs {
        let mut first: Option<Vec<Vec<u8>>> = None;
        for threads in [1, 2, 4] {
            let pool = Pool::new(threads).unwrap();
            let mut all = Vec::new();
            for (name, compression, copy_input) in [
                ("a.mcap", Compression::Zstd, false),
                ("a.mcap", Compression::Lz4, true),
                ("a.mcap", Compression::None, false),
                ("a.ndjson", Compression::Zstd, false),
                ("a.csv", Compression::Zstd, false),
            ] {
                let path = dir.path().join(name);
                let mut replay = replay_of(log);
                replay.options.force = true;
                replay.options.compression = compression;
                replay.copy_input = copy_input;
                replay.targets = vec![target(&path)];
                run(&replay, &pool, &mut |_| {}).unwrap();
                all.push(std::fs::read(&path).unwrap());
            }
            match &first {
                None => first = Some(all),
                Some(first) => {
                    for (k, (one, other)) in first.iter().zip(&all).enumerate() {
                        let at = one.iter().zip(other).position(|(a, b)| a != b);
                        assert!(
                            one == other,
                            "{}: output {k} with {threads} threads differs from 1 at {at:?} of {} and {}",
                            log.display(),
                            one.len(),
                            other.len()
                        );
                    }
                }
            }
        }
    }
}

/// The attitudes `strapd replay SOURCE -o -` prints.
fn printed(command: &mut Command) -> Vec<Bits> {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    ndjson(&String::from_utf8(output.stdout).unwrap())
}

#[test]
fn file_standard_input_and_cat_in_a_pipe_give_the_same_attitudes() {
    let dir = tempfile::tempdir().unwrap();
    for log in [
        long_log(dir.path()),
        fixture("xsens_mti.mcap"),
        fixture("ximu3.mcap"),
        fixture("coning_jitter.mcap"),
        fixture("constant_rate_json.mcap"),
        fixture("constant_rate_ros1.mcap"),
        fixture("coning_average.mcap"),
    ] {
        same_every_way(&log, dir.path());
    }
}

/// Stamps of zero, and of a clock that stands: the log time takes over, and has to come through the pipe.
#[test]
fn a_recording_whose_stamps_are_no_clock_gives_the_same_attitudes_through_lines_and_rows() {
    let dir = tempfile::tempdir().unwrap();
    for stamp in [0, 1_600_000_000_000_000_000] {
        let samples = motion(3000);
        let mut messages = logged("/imu", &samples);
        for (message, sample) in messages.iter_mut().zip(samples) {
            message.payload = imu_message("imu_link", &ImuSample { stamp, ..sample });
        }
        let log = dir.path().join("stands.mcap");
        std::fs::write(&log, bytes(None, 4096, &messages)).unwrap();
        same_every_way(&log, dir.path());
    }
}

/// Axes FRD, means with an interval of their own: a line must carry what the format says.
#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_format_that_says_more_than_a_line_gives_the_same_attitudes_through_lines_and_rows() {
    let dir = tempfile::tempdir().unwrap();
    for log in [
        "px4_fmuv6c_json_zstd",
        "xsens_mti_ros2_none",
        "ximu3_ros2_zstd",
    ] {
        let log = crate::shared_data::shared(&format!("logs/real/{log}.mcap"));
        same_every_way(&log.unwrap(), dir.path());
    }
}

/// Asserts the same from the file, standard input, `cat` in a pipe and a file of its lines.
fn same_every_way(log: &Path, dir: &Path) {
    let what = log.display();
    let from_file = printed(strapd().arg("replay").arg(log).args(["-o", "-"]));
    assert!(from_file.len() > 200, "{what}: {}", from_file.len());
    let bytes = std::fs::read(log).unwrap();
    let from_stdin = printed(strapd().args(["replay", "-", "-o", "-"]).write_stdin(bytes));
    assert_eq!(from_stdin, from_file, "{what} through standard input");
    let cat = strapd().arg("cat").arg(log).output().unwrap();
    assert!(cat.status.success(), "{what}: {cat:?}");
    let from_cat = printed(
        strapd()
            .args(["replay", "-", "-o", "-"])
            .write_stdin(cat.stdout.clone()),
    );
    assert_eq!(from_cat, from_file, "{what} through cat");
    let lines = dir.join("samples.ndjson");
    std::fs::write(&lines, &cat.stdout).unwrap();
    let from_lines = printed(strapd().arg("replay").arg(&lines).args(["-o", "-"]));
    assert_eq!(from_lines, from_file, "{what} through a file of lines");
    let cat = strapd()
        .arg("cat")
        .arg(log)
        .args(["--format", "csv"])
        .output()
        .unwrap();
    assert!(cat.status.success(), "{what}: {cat:?}");
    let rows = dir.join("samples.csv");
    std::fs::write(&rows, &cat.stdout).unwrap();
    let from_rows = printed(strapd().arg("replay").arg(&rows).args(["-o", "-"]));
    assert_eq!(from_rows, from_file, "{what} through a file of rows");
    let from_cat = printed(
        strapd()
            .args(["replay", "-", "-o", "-"])
            .write_stdin(cat.stdout),
    );
    assert_eq!(from_cat, from_file, "{what} through rows in a pipe");
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn a_stream_takes_the_imu_and_not_a_twist_that_comes_before_it() {
    let Some(log) = crate::shared_data::shared("logs/native/rosbags_rs_all_types.mcap") else {
        return;
    };
    let from_file = printed(strapd().arg("replay").arg(&log).args(["-o", "-"]));
    let bytes = std::fs::read(log).unwrap();
    let from_stdin = printed(strapd().args(["replay", "-", "-o", "-"]).write_stdin(bytes));
    assert_eq!(from_file.len(), 2);
    assert_eq!(from_stdin, from_file);
}

#[test]
fn lines_without_a_time_are_refused_and_not_numbered() {
    let line = |stamp: &str| format!("{{\"class\":\"RATE\",{stamp}\"gyro\":[0.1,0,0]}}\n");
    for stamp in ["\"stamp\":{\"sec\":0,\"nsec\":0},", ""] {
        let output = strapd()
            .args(["replay", "-", "-o", "null:"])
            .write_stdin(line(stamp).repeat(100))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{stamp}: {output:?}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("--time index --rate-hz"), "{stamp}: {said}");
        // And that flag helps.
        let output = strapd()
            .args([
                "replay",
                "-",
                "-o",
                "-",
                "-q",
                "--time",
                "index",
                "--rate-hz",
                "10",
            ])
            .write_stdin(line(stamp).repeat(101))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(0), "{stamp}: {output:?}");
        let found = ndjson(&String::from_utf8(output.stdout).unwrap());
        // 10 s at 0.1 rad/s about x: one radian. 1e-12 is far above the rounding of 100 steps.
        let [w, x, ..] = found[100].numbers();
        assert!((w - 0.5_f64.cos()).abs() < 1e-12 && (x - 0.5_f64.sin()).abs() < 1e-12);
    }
}

#[test]
fn attitudes_from_lines_are_logged_at_their_stamps() {
    let dir = tempfile::tempdir().unwrap();
    let log = written(dir.path(), "log.mcap", &motion(100));
    let cat = strapd().arg("cat").arg(&log).output().unwrap();
    let out = dir.path().join("out.mcap");
    strapd()
        .args(["replay", "-", "-q", "-o"])
        .arg(&out)
        .write_stdin(cat.stdout)
        .assert()
        .success();
    let bytes = std::fs::read(out).unwrap();
    let times: Vec<u64> = ::mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .filter(|m| m.channel.topic == "/imu/data")
        .map(|m| m.log_time)
        .collect();
    let stamps: Vec<u64> = motion(100).iter().map(|s| s.stamp as u64).collect();
    assert_eq!(times, stamps);
}

#[test]
fn what_is_lost_in_a_log_is_lost_and_counted_through_a_pipe_of_lines_too() {
    // NaN cannot be written as JSON: the line says null, and must not be passed over.
    let dir = tempfile::tempdir().unwrap();
    let mut samples = motion(300);
    samples[0].gyro[1] = f64::NAN;
    samples[100].gyro[0] = f64::NAN;
    samples[200].gyro[2] = f64::INFINITY;
    let log = written(dir.path(), "bad.mcap", &samples);
    let replayed = |source: &Path, stdin: Vec<u8>| {
        let out = dir.path().join("out.ndjson");
        let output = strapd()
            .args(["replay", "--json", "--force", "-o"])
            .arg(&out)
            .arg(source)
            .write_stdin(stdin)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(3), "{output:?}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["topics"][0]["samples"]["total"], 300, "{json}");
        assert_eq!(json["topics"][0]["samples"]["lost"], 3, "{json}");
        ndjson(&std::fs::read_to_string(out).unwrap())
    };
    let from_file = replayed(&log, Vec::new());
    assert_eq!(from_file.len(), 297);
    let cat = strapd().arg("cat").arg(&log).output().unwrap();
    assert_eq!(replayed(Path::new("-"), cat.stdout), from_file);
}

#[test]
fn a_log_on_standard_input_keeps_the_frame_of_its_sensor() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap");
    let frames = |source: &Path, stdin: Vec<u8>| -> Vec<(String, Vec<u8>)> {
        let out = dir.path().join("out.mcap");
        strapd()
            .args(["replay", "-q", "--force", "-o"])
            .arg(&out)
            .arg(source)
            .write_stdin(stdin)
            .assert()
            .success();
        ::mcap::MessageStream::new(&std::fs::read(out).unwrap())
            .unwrap()
            .map(Result::unwrap)
            .take(4)
            .map(|m| (m.channel.topic.clone(), m.data.to_vec()))
            .collect()
    };
    let from_file = frames(&log, Vec::new());
    let has_frame = |data: &[u8]| data.windows(9).any(|w| w == b"imu_link\0");
    assert!(from_file.iter().all(|(_, data)| has_frame(data)));
    assert_eq!(
        frames(Path::new("-"), std::fs::read(log).unwrap()),
        from_file
    );
}

#[cfg(unix)]
#[test]
fn a_named_pipe_is_read_like_standard_input() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap");
    let expected = printed(strapd().arg("replay").arg(&log).args(["-o", "-"]));
    let pipe = dir.path().join("pipe.mcap");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let writer = {
        let pipe = pipe.clone();
        std::thread::spawn(move || {
            let bytes = std::fs::read(log).unwrap();
            let mut to = std::fs::OpenOptions::new().write(true).open(pipe).unwrap();
            // The reader may have refused it: then what matters is its answer.
            let _ = to.write_all(&bytes);
        })
    };
    let found = strapd()
        .arg("replay")
        .arg(&pipe)
        .args(["-o", "-"])
        // A second open of the pipe would wait for a second writer, forever: by the clock, as a last resort.
        .timeout(std::time::Duration::from_secs(600))
        .output()
        .unwrap();
    writer.join().unwrap();
    assert!(found.status.success(), "{found:?}");
    assert_eq!(ndjson(&String::from_utf8(found.stdout).unwrap()), expected);
}

#[test]
fn every_format_holds_the_same_attitudes() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| dir.path().join(name);
    strapd()
        .arg("replay")
        .arg(fixture("coning.mcap"))
        .args(["--quiet", "-o"])
        .arg(file("a.mcap"))
        .arg("-o")
        .arg(file("a.ndjson"))
        .arg("-o")
        .arg(file("a.csv"))
        .assert()
        .success();
    let lines = ndjson(&std::fs::read_to_string(file("a.ndjson")).unwrap());
    assert_eq!(lines.len(), 2001);
    assert_eq!(csv(&std::fs::read_to_string(file("a.csv")).unwrap()), lines);
    let topic = "/imu/data";
    assert_eq!(mcap(&std::fs::read(file("a.mcap")).unwrap(), topic), lines);
}

#[test]
fn the_speed_changes_when_a_result_is_written_and_not_which() {
    // 2 s of data.
    let dir = tempfile::tempdir().unwrap();
    let log = written(dir.path(), "short.mcap", &motion(200));
    let at_speed = |speed: &str| {
        let begun = std::time::Instant::now();
        let found = printed(
            strapd()
                .arg("replay")
                .arg(&log)
                .args(["-o", "-", "--speed", speed]),
        );
        (found, begun.elapsed().as_secs_f64())
    };
    let (expected, _) = at_speed("max");
    for (speed, least) in [("40", 0.04), ("4", 0.4), ("1.9", 0.9)] {
        let (found, secs) = at_speed(speed);
        assert_eq!(found, expected, "--speed {speed}");
        // A little under 1.99 s / speed: the first slice of 5 ms goes at once, and so does the last.
        assert!(secs >= least, "--speed {speed} took {secs} s");
    }
}

#[test]
fn a_line_is_answered_while_the_pipe_stays_open() {
    // The order of a filter in a pipe: with the centred default a sample's attitude is known some
    // samples later, and must not wait for a buffer to fill.
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("strapd"))
        .args(["replay", "-", "-o", "-", "--method", "dcm-left", "-q"])
        .env("STRAPD_AID", "none")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = child.stdin.take().unwrap();
    let mut from = std::io::BufReader::new(child.stdout.take().unwrap());
    // Reads from the start: a pipe holds less than the answers to what is about to be written.
    let (sender, receiver) = std::sync::mpsc::channel();
    let reader = std::thread::spawn(move || {
        let mut line = String::new();
        std::io::BufRead::read_line(&mut from, &mut line).unwrap();
        sender.send(line).unwrap();
        let mut rest = String::new();
        std::io::Read::read_to_string(&mut from, &mut rest).unwrap();
        rest.lines().count() + 1
    });
    for k in 0..2000 {
        writeln!(
            to,
            r#"{{"class":"RATE","stamp":{{"sec":1700000000,"nsec":{}}},"gyro":[0.1,0,0]}}"#,
            k * 100_000
        )
        .unwrap();
    }
    to.flush().unwrap();
    // The pipe is still open: what is known must come out.
    let first = receiver.recv_timeout(std::time::Duration::from_secs(600));
    drop(to);
    let lines = reader.join();
    assert!(child.wait().unwrap().success());
    assert!(
        first.is_ok(),
        "timed out: no attitude of 2000 samples within 600 s by the clock, a last resort"
    );
    assert_eq!(lines.unwrap(), 2000);
}
