//! Promise: what `info` says to run next runs as it stands, over every recording we have, and leads to an attitude.

use crate::program::strapd;
use crate::shared_data::shared;
use std::path::{Path, PathBuf};

/// Recordings in a folder; no journals and no files that belong to another.
fn recordings(folder: &Path) -> Vec<PathBuf> {
    let kinds = ["mcap", "bag", "db3", "ulg", "tlog", "raw"];
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            path.extension()
                .is_some_and(|e| kinds.iter().any(|kind| e == *kind))
        })
        .collect();
    all.sort();
    assert!(!all.is_empty(), "{}", folder.display());
    all
}

/// Runs what `info` prints to run next of a recording; returns whether there was something.
fn follow(log: &Path) -> bool {
    let dir = tempfile::tempdir().unwrap();
    let info = strapd(dir.path(), &format!("info {}", log.display()));
    assert!(matches!(info.code, Some(0 | 3)), "{info:?}");
    let Some(line) = info.out.lines().find(|line| line.starts_with("next")) else {
        let why = info
            .out
            .lines()
            .find(|line| line.starts_with("no attitude: "));
        assert!(why.is_some(), "{}: {}", log.display(), info.out);
        return false;
    };
    let command = line.trim_start_matches("next").trim();
    let binary = assert_cmd::cargo::cargo_bin("strapd");
    let rest = command.strip_prefix("strapd ").unwrap();
    let ran = std::process::Command::new("bash")
        .current_dir(dir.path())
        .args(["-c", &format!("{} {rest}", binary.display())])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(
        matches!(ran.status.code(), Some(0 | 3)),
        "{command}: {said}"
    );
    let attitude = dir.path().join("attitude.mcap");
    let there = strapd(dir.path(), &format!("info {} --json", attitude.display()));
    let there = there.json();
    let messages = there["messages"].as_u64().unwrap_or(0);
    assert!(messages > 0, "{command} leads to no attitude: {there}");
    true
}

#[test]
fn a_table_without_time_is_told_what_is_missing_and_the_command_runs_with_it() {
    let dir = tempfile::tempdir().unwrap();
    let row = |k: u32| format!("{k},{:.4},0,0,0,0,9.81\n", (f64::from(k) * 0.01).sin());
    let rows: String = (0..500).map(row).collect();
    std::fs::write(
        dir.path().join("a.csv"),
        format!("cnt,gx,gy,gz,ax,ay,az\n{rows}"),
    )
    .unwrap();
    let info = strapd(dir.path(), "info a.csv");
    let line = info.out.lines().last().unwrap();
    assert!(line.starts_with("no attitude: nothing says when"), "{line}");
    // No clock of a table is another one.
    assert!(!info.out.contains("--time log"), "{}", info.out);
    let command = line.split("strapd ").nth(1).unwrap().replace("HZ", "100");
    strapd(dir.path(), &command).done();
    let check = strapd(dir.path(), "check a.csv --json").lines();
    let found = check[0]["findings"].as_array().unwrap();
    let errors = found.iter().filter(|f| f["severity"] == "error");
    let codes: Vec<_> = errors.map(|f| f["code"].clone()).collect();
    assert_eq!(codes, ["no-clock"]);
}

#[test]
fn what_info_says_to_run_next_runs_over_every_fixture() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    for log in recordings(&fixtures) {
        assert!(follow(&log), "{}: nothing to run", log.display());
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn what_info_says_to_run_next_runs_over_every_recording() {
    // A header alone, and two without a gyro.
    let without = [
        "25_header_only",
        "rosbag2_wrong_format",
        "tiryoh_test_sample_truncated",
    ];
    for folder in ["real", "native", "broad", "hostile"] {
        for log in recordings(&shared(&format!("logs/{folder}")).unwrap()) {
            let name = log.file_stem().unwrap().to_string_lossy().into_owned();
            if name.contains("hang") {
                continue;
            }
            let is_empty = without.iter().any(|known| name == *known);
            assert_eq!(follow(&log), !is_empty, "{}", log.display());
        }
    }
}
