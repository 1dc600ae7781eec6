//! Outputs that must not be written, cannot be written, or are not read to their end.

use super::{bench, names, strapd};
use crate::made_logs::{motion, written};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

#[test]
fn an_output_that_exists_is_kept_unless_forced() {
    let dir = bench();
    let at = dir.path();
    for name in ["a.mcap", "a.ndjson", "a.csv"] {
        std::fs::write(at.join(name), b"precious").unwrap();
        strapd(at, &format!("replay log.mcap -o {name}"))
            .refused(1, &[name, "already exists", "--force"]);
        assert_eq!(std::fs::read(at.join(name)).unwrap(), b"precious");
        strapd(at, &format!("replay log.mcap -o {name} --force")).done();
        assert!(std::fs::read(at.join(name)).unwrap().len() > 10_000);
    }
    assert_eq!(names(at), ["a.csv", "a.mcap", "a.ndjson", "log.mcap"]);
}

#[cfg(unix)]
#[test]
fn the_input_is_never_overwritten_by_whatever_name() {
    let dir = bench();
    let at = dir.path();
    std::os::unix::fs::symlink("log.mcap", at.join("soft.mcap")).unwrap();
    std::fs::hard_link(at.join("log.mcap"), at.join("hard.mcap")).unwrap();
    std::fs::create_dir(at.join("folder")).unwrap();
    std::os::unix::fs::symlink(at, at.join("folder/round")).unwrap();
    let before = std::fs::read(at.join("log.mcap")).unwrap();
    for (input, output) in [
        ("log.mcap", "log.mcap"),
        ("log.mcap", "./log.mcap"),
        ("log.mcap", "soft.mcap"),
        ("log.mcap", "hard.mcap"),
        ("soft.mcap", "log.mcap"),
        ("soft.mcap", "hard.mcap"),
        ("log.mcap", "folder/round/log.mcap"),
    ] {
        for force in ["", "--force"] {
            strapd(at, &format!("replay {input} -o {output} {force}"))
                .refused(1, &[output, "is the input", "another name"]);
        }
    }
    assert!(before == std::fs::read(at.join("log.mcap")).unwrap());
}

#[test]
fn several_logs_never_share_an_output() {
    let dir = bench();
    let at = dir.path();
    for folder in ["a", "b", "out"] {
        std::fs::create_dir(at.join(folder)).unwrap();
    }
    std::fs::copy(at.join("log.mcap"), at.join("a/log.mcap")).unwrap();
    std::fs::copy(at.join("log.mcap"), at.join("b/log.mcap")).unwrap();
    strapd(at, "replay a/log.mcap b/log.mcap -o one.mcap").refused(2, &["one.mcap", "{stem}"]);
    for output in ["out/", "out", "out/{stem}.csv"] {
        for more in ["", "--force", "--shard 0/2"] {
            strapd(
                at,
                &format!("replay a/log.mcap b/log.mcap -o {output} {more}"),
            )
            .refused(2, &["a/log.mcap", "b/log.mcap", "different names"]);
        }
    }
    strapd(at, "replay log.mcap -o out/a.csv -o ./out/a.csv").refused(2, &["given twice"]);
    strapd(at, "replay log.mcap -o - -o -").refused(2, &["given twice"]);
    assert!(names(&at.join("out")).is_empty());
}

#[test]
fn a_directory_takes_one_output_per_log() {
    let dir = bench();
    let at = dir.path();
    std::fs::create_dir(at.join("out")).unwrap();
    std::fs::copy(at.join("log.mcap"), at.join("more.mcap")).unwrap();
    strapd(at, "replay log.mcap more.mcap -o out").done();
    assert_eq!(
        names(&at.join("out")),
        ["log.attitude.mcap", "more.attitude.mcap"]
    );
    strapd(at, "replay log.mcap -o nowhere/a.csv").refused(
        1,
        &[
            "nowhere/a.csv",
            "directory nowhere does not exist",
            "help: make it: mkdir -p nowhere",
        ],
    );
    for what in [
        "report log.mcap -o s3://bucket/a.html",
        "report log.mcap -o https://host/a.html",
        "replay log.mcap -o null: --aid gravity --save-calibration s3://bucket/a.toml",
    ] {
        let words = &["to a file, not to an address", "copy it there"];
        strapd(at, what).refused(1, words);
    }
}

#[test]
fn the_folder_of_a_pattern_is_made_and_that_of_a_plain_name_is_not() {
    let dir = bench();
    let at = dir.path();
    strapd(
        at,
        "replay log.mcap -o a/{stem}.csv -o b/{stem}/x.mcap -o c/d/ --aid gravity --save-calibration e/{stem}.toml",
    )
    .done();
    for made in [
        "a/log.csv",
        "b/log/x.mcap",
        "c/d/log.attitude.mcap",
        "e/log.toml",
    ] {
        assert!(at.join(made).is_file(), "{made}: {:?}", names(at));
    }
    for (flags, code) in [
        ("-o f/a.csv", 1),
        ("-o g/{stem}.bag", 2),
        ("-o tcp://127.0.0.1:1/{stem}", 2),
        // Before the work, not after it.
        ("-o h.csv --aid gravity --save-calibration h/a.toml", 1),
    ] {
        strapd(at, &format!("replay log.mcap {flags}")).refused(code, &[]);
    }
    assert_eq!(names(at), ["a", "b", "c", "e", "log.mcap"]);
    // What is in the way is said.
    strapd(at, "replay log.mcap -o log.mcap/{stem}.csv").refused(1, &["log.mcap", "cannot write"]);
}

#[test]
fn a_name_that_is_no_sink_lists_those_that_are() {
    let dir = bench();
    for output in ["a.bag", "a", "tcp://localhost", "http://b/a.mcap"] {
        let ran = strapd(dir.path(), &format!("replay log.mcap -o {output}"));
        ran.refused(2, &[output, "FILE.mcap", "FILE.csv"]);
        // Who wrote an ending wants a file.
        assert_eq!(ran.err.contains("null:"), output != "a.bag", "{}", ran.err);
    }
    assert_eq!(names(dir.path()), ["log.mcap"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_one_error_and_leaves_nothing_that_looks_finished() {
    let dir = bench();
    let at = dir.path();
    for name in ["full.csv", "full.ndjson", "full.mcap"] {
        std::os::unix::fs::symlink("/dev/full", at.join(name)).unwrap();
        strapd(at, &format!("replay log.mcap -o {name}"))
            .refused(1, &[name, "cannot write", "No space left"]);
    }
    // A real file on a disk with room for 8 blocks of 512 bytes. The signal is ignored, as a
    // service manager would have it; without that the kernel ends the process itself.
    for name in ["a.csv", "a.mcap"] {
        let ran = Command::new("sh")
            .current_dir(at)
            .args([
                "-c",
                "trap '' XFSZ; ulimit -f 8; exec \"$0\" replay log.mcap -o \"$1\"",
            ])
            .arg(assert_cmd::cargo::cargo_bin("strapd"))
            .arg(name)
            .output()
            .unwrap();
        let err = String::from_utf8(ran.stderr).unwrap();
        assert_eq!(ran.status.code(), Some(1), "{err}");
        assert!(err.contains(name) && err.contains("cannot write"), "{err}");
    }
    assert_eq!(
        names(at),
        ["full.csv", "full.mcap", "full.ndjson", "log.mcap"]
    );
}

#[test]
fn a_reader_that_has_enough_ends_the_run_quietly() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // 2 MB of lines: far more than a pipe holds.
    written(at, "long.mcap", &motion(6000));
    for command in [
        "replay long.mcap -o -",
        "cat long.mcap",
        "cat long.mcap --format csv",
    ] {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("strapd"))
            .current_dir(at)
            .args(command.split(' '))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        assert!(line.contains("stamp"), "{command}: {line}");
        // The reader is dropped here: the pipe is broken.
        let ended = child.wait_with_output().unwrap();
        let err = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(0), "{command}: {err}");
        assert_eq!(err, "", "{command}");
    }
}

#[test]
fn a_reader_that_has_enough_does_not_cut_the_file_written_beside_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // More batches than the sinks keep in flight: that the pipe is broken shows before the end.
    written(at, "long.mcap", &motion(50_000));
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("strapd"))
        .current_dir(at)
        .args(["replay", "long.mcap", "-o", "-", "-o", "all.csv"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0), "{ended:?}");
    let rows = std::fs::read_to_string(at.join("all.csv"))
        .unwrap()
        .lines()
        .count();
    assert_eq!(rows, 50_001, "a header and every attitude");
}

#[test]
fn nothing_is_written_where_nothing_is_asked_for() {
    let dir = bench();
    let ran = strapd(dir.path(), "replay log.mcap");
    assert!(ran.done().out.contains("nothing: add -o"), "{ran:?}");
    strapd(dir.path(), "replay log.mcap -o null:").done();
    assert_eq!(names(dir.path()), ["log.mcap"]);
}
