//! Attitudes that strapd made before lie beside the recordings they were made of, and are not taken for some.

use super::{bench, names, strapd};
use crate::program::strapd_fed;
use std::path::Path;

/// Expansion by the shell of `*.mcap`, and the like.
fn pattern(at: &Path, ending: &str) -> String {
    let mut found = names(at);
    found.retain(|name| name.ends_with(ending));
    found.join(" ")
}

/// Two recordings, and the attitudes of one.
fn folder() -> tempfile::TempDir {
    let dir = bench();
    let at = dir.path();
    std::fs::copy(at.join("log.mcap"), at.join("more.mcap")).unwrap();
    strapd(at, "replay log.mcap -q -o log.attitude.mcap").done();
    dir
}

#[test]
fn among_several_files_they_are_left_out_with_a_line_that_says_so() {
    let dir = folder();
    let at = dir.path();
    let all = pattern(at, ".mcap");
    assert_eq!(all, "log.attitude.mcap log.mcap more.mcap");
    let line = "log.attitude.mcap: left out: attitudes that strapd made of log.mcap, and no recording; alone, or with --topic NAME, it is read";
    let ran = strapd(at, &format!("replay {all} -o out/{{stem}}.csv --json"));
    assert_eq!(ran.json().as_array().map(Vec::len), Some(2), "{ran:?}");
    assert!(ran.err.contains(line), "{}", ran.err);
    assert_eq!(names(&at.join("out")), ["log.csv", "more.csv"]);
    // The shares of two processes are those of the recordings, whatever either has written before.
    let mut shares = Vec::new();
    for share in ["0/2", "1/2"] {
        let run = format!(
            "replay {} -o {{stem}}.att.mcap --shard {share}",
            pattern(at, ".mcap")
        );
        let ran = strapd(at, &run);
        shares.push(ran.done().out.lines().next().unwrap_or_default().to_owned());
    }
    assert!(
        shares[0].starts_with("log.mcap ") && shares[1].starts_with("more.mcap "),
        "{shares:?}"
    );
    for command in ["check", "report -o all.html --force"] {
        let ran = strapd(at, &format!("{command} {all}"));
        assert!(ran.err.contains(line), "{command}: {}", ran.err);
        assert!(!ran.out.contains("log.attitude.mcap"), "{}", ran.out);
    }
    let page = std::fs::read_to_string(at.join("all.html")).unwrap();
    assert!(page.contains("<h1>2 logs</h1>"));
    // Nothing is kept back from who asks what is in files.
    let info = strapd(at, &format!("info {all}"));
    assert!(
        info.done().out.contains(
            "next      strapd compare log.attitude.mcap log.mcap   # attitudes that strapd made"
        ),
        "{}",
        info.out
    );
    // Who names a topic means it; of these three, one has it.
    let named = strapd(at, &format!("replay {all} --topic /imu/data -o null:"));
    assert!(!named.err.contains("left out") && named.out.contains("log.attitude.mcap"));
    let none = strapd(at, "replay log.attitude.mcap log.att.mcap -o null:");
    assert_eq!((none.code, none.out.as_str()), (Some(2), ""), "{none:?}");
    let said = "error: none of these 2 files is a recording\n  help: name the recordings";
    assert!(none.err.contains(said), "{}", none.err);
}

#[test]
fn alone_they_are_read_and_every_command_says_what_they_are() {
    let dir = folder();
    let at = dir.path();
    strapd(at, "replay log.mcap -q -o table.csv -o lines.ndjson").done();
    strapd(at, "replay log.mcap -q -o json.mcap --encoding json").done();
    for file in [
        "log.attitude.mcap",
        "json.mcap",
        "table.csv",
        "lines.ndjson",
    ] {
        let ran = strapd(at, &format!("replay {file} -o null:"));
        let said = "and no recording: its rates are integrated again";
        assert!(ran.done().out.contains(said), "{file}: {}", ran.out);
        let checked = strapd(at, &format!("check {file}"));
        assert!(
            checked.out.contains("made-before") && checked.code == Some(3),
            "{file}: {checked:?}"
        );
    }
    // From a pipe, too, as far as its first bytes tell.
    for file in ["table.csv", "lines.ndjson"] {
        let bytes = std::fs::read(at.join(file)).unwrap();
        let ran = strapd_fed(at, "replay - -o null:", bytes.clone());
        let said = "and no recording: its rates are integrated again";
        assert!(ran.done().out.contains(said), "{file}: {}", ran.out);
        let checked = strapd_fed(at, "check -", bytes);
        assert!(checked.out.contains("made-before"), "{file}: {checked:?}");
    }
    let named = strapd(at, "replay log.attitude.mcap --topic /imu/data -o null:");
    assert!(!named.done().out.contains("no recording"), "{}", named.out);
    // A recording, and what a simulation made, are none.
    strapd(
        at,
        "simulate top --duration 1 -q -o top.mcap -o top.ndjson -o top.csv",
    )
    .done();
    strapd(at, "replay log.mcap -q --copy-input -o both.mcap").done();
    for file in ["log.mcap", "top.mcap", "top.ndjson", "top.csv", "both.mcap"] {
        let ran = strapd(at, &format!("replay {file} -o null:"));
        assert!(
            !ran.done().out.contains("no recording"),
            "{file}: {}",
            ran.out
        );
    }
}

#[test]
fn in_a_folder_the_recording_beside_them_is_the_one() {
    let dir = bench();
    let at = dir.path();
    std::fs::create_dir(at.join("day")).unwrap();
    std::fs::rename(at.join("log.mcap"), at.join("day/log.mcap")).unwrap();
    let alone = strapd(at, "replay day -q -o first.csv");
    assert_eq!(alone.done().err, "");
    strapd(at, "replay day/log.mcap -q -o day/ -o day/log.csv").done();
    let beside = strapd(at, "replay day -q -o second.csv");
    for file in ["log.attitude.mcap", "log.csv"] {
        let line = format!("day: {file} is not read: attitudes that strapd made");
        assert!(beside.done().err.contains(&line), "{}", beside.err);
    }
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    assert_eq!(read("first.csv"), read("second.csv"));
}
