//! A disk that is full, or may not be written further.

use super::child::{Task, assert_code, handed};
use super::{linear, recovered, sample};
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;
use strapd::error::Error;
use strapd::serve::core::recorder::{Recorder, Settings};

/// The recording child, started by a shell that first narrows what it may write; `SELF` stands for it.
fn starved(script: &str, task: Task, path: &Path, counter: &Path) -> Output {
    let command = task.command(path, counter);
    let (program, arguments) = (command.get_program(), command.get_args());
    let mut shell = Command::new("sh");
    shell
        .arg("-c")
        .arg(script.replace("SELF", "\"$0\" \"$@\""))
        .arg(program)
        .args(arguments);
    for (name, value) in command.get_envs() {
        shell.env(name, value.unwrap_or_default());
    }
    shell.output().unwrap()
}

/// One error, exit 3, and everything said to be recorded is in the file, which ends as it should.
fn assert_stopped_cleanly(output: &Output, path: &Path, counter: &Path, why: &str) {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_code(output.status, 3);
    assert_eq!(said.matches("recording stopped").count(), 1, "{said}");
    assert_eq!(said.matches("ERROR").count(), 1, "{said}");
    assert!(said.contains(why), "{said}");
    let (recovered, [samples, _]) = recovered(path);
    // With or without a summary: the footer is there, and nothing before it is damaged.
    assert!(!recovered.was_damaged(), "{:?}", recovered.survey.problems);
    assert!(samples > 1000, "{samples}");
    assert!(
        said.contains(&format!("recorded {samples} of {}", handed(counter))),
        "{said}"
    );
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(linear(&bytes), samples);
}

#[test]
fn a_limit_on_the_size_of_files_stops_the_recording_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    // Limits that fall at different places of a chunk, in blocks of 512 bytes.
    for blocks in [700, 801, 933] {
        let (path, counter) = (
            dir.path().join(format!("{blocks}.mcap")),
            dir.path().join("count"),
        );
        let script = format!("ulimit -f {blocks}; exec SELF");
        let output = starved(&script, Task::Flood { min_free: 0 }, &path, &counter);
        assert_stopped_cleanly(&output, &path, &counter, "File too large");
    }
}

#[test]
fn a_full_disk_stops_the_recording_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let disk = dir.path().join("disk");
    std::fs::create_dir(&disk).unwrap();
    let counter = dir.path().join("count");
    let kept = dir.path().join("kept.mcap");
    // A file system of 8 MiB that nobody else sees and that goes with the process.
    let narrowed = |task: Task| {
        let script = format!(
            "unshare -m sh -c 'mount -t tmpfs -o size=8m tmpfs {disk} || exit 77; SELF; code=$?; cp {disk}/a.mcap {kept}; exit $code' \"$0\" \"$@\"",
            disk = disk.display(),
            kept = kept.display()
        );
        starved(&script, task, &disk.join("a.mcap"), &counter)
    };
    let output = narrowed(Task::Flood { min_free: 0 });
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.code() == Some(77) || said.contains("unshare:") {
        eprintln!("SKIPPED LOUDLY: this user may not mount a small file system: {said}");
        return;
    }
    assert_stopped_cleanly(&output, &kept, &counter, "No space left on device");
    assert!(std::fs::metadata(&kept).unwrap().len() > 7 << 20);
    // With room to be left it stops before the disk is full, and the file has its summary.
    let output = narrowed(Task::Flood { min_free: 4 << 20 });
    assert_stopped_cleanly(&output, &kept, &counter, "--min-free");
    assert!(std::fs::metadata(&kept).unwrap().len() < 5 << 20);
    super::assert_whole(&kept);
}

#[test]
fn too_little_room_at_the_start_and_an_existing_file_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let mut settings = Settings::new(&path);
    settings.min_free = u64::MAX;
    let error = Recorder::start(settings.clone()).unwrap_err();
    assert!(error.to_string().contains("--min-free"), "{error}");
    assert!(!path.exists());

    settings.min_free = 0;
    std::fs::write(&path, b"precious").unwrap();
    assert!(matches!(
        Recorder::start(settings.clone()),
        Err(Error::OutputExists { .. })
    ));
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
    settings.force = true;
    let recorder = Recorder::start(settings).unwrap();
    recorder
        .handle()
        .input(&Arc::from("imu"), vec![sample(0, 200)]);
    assert!(!recorder.finish().is_lossy());
    assert_eq!(super::assert_whole(&path), 1);
}

#[test]
fn what_a_full_queue_does_not_take_is_counted_and_the_caller_never_waits() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.mcap");
    let mut settings = Settings::new(&path);
    settings.min_free = 0;
    settings.queue = 4;
    let recorder = Recorder::start(settings).unwrap();
    let (handle, id) = (recorder.handle(), Arc::from("imu"));
    let given = 200_000;
    for k in 0..given / 100 {
        let batch = (100 * k..100 * (k + 1)).map(|k| sample(k, 1000)).collect();
        handle.input(&id, batch);
    }
    let status = recorder.finish();
    assert!(
        status.unrecorded > 0 && status.is_lossy(),
        "a queue of four takes it all: {status:?}"
    );
    assert_eq!(status.samples + status.unrecorded, given, "{status:?}");
    assert_eq!(super::assert_whole(&path), status.samples);
}

#[test]
fn a_replay_that_may_not_write_on_says_so_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/xsens_mti.mcap");
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 20; exec \"$0\" replay \"$1\" -o out.mcap"])
        .args([Path::new(env!("CARGO_BIN_EXE_strapd")), &log])
        .current_dir(dir.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_code(output.status, 1);
    assert!(
        said.contains("out.mcap: cannot write: File too large"),
        "{said}"
    );
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{said}");
}
