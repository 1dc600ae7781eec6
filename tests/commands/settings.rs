//! Promise: the page of settings and Python's types are what the table says, and help, completion and files have each row.

use crate::program::strapd;
use std::path::{Path, PathBuf};
use strapd_attitude::estimate::settings::{Default, ROWS, Takes};
use strapd_attitude::setting::SMOOTH;

#[path = "../../crates/attitude/examples/settings.rs"]
mod made;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_page_and_the_types_of_python_are_those_of_the_table() {
    for (path, made, how) in [
        ("docs/settings.md", made::page(), "> docs/settings.md"),
        (
            "python/python/strapd/_settings.py",
            made::python(),
            "-- python > python/python/strapd/_settings.py",
        ),
    ] {
        let file = std::fs::read_to_string(root().join(path)).unwrap();
        let same = file.lines().zip(made.lines()).take_while(|(a, b)| a == b);
        let line = same.count() + 1;
        assert!(
            file == made,
            "{path}:{line}: cargo run -p strapd-attitude --example settings {how}"
        );
    }
}

#[test]
fn without_noise_an_attitude_keeps_its_bits_and_its_sigma_is_not_known() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = root().join("fixtures/xsens_mti.mcap");
    std::fs::copy(log, at.join("log.mcap")).unwrap();
    let rows = |flags: &str| {
        let ran = strapd(at, &format!("replay log.mcap -o out.csv --force {flags}"));
        ran.done();
        let rows = std::fs::read_to_string(at.join("out.csv")).unwrap();
        let cells = |row: &str, from: usize, to: usize| {
            let cells: Vec<&str> = row.split(',').skip(from).take(to - from).collect();
            cells.join(",")
        };
        let part = |from, to| {
            rows.lines()
                .skip(1)
                .map(|row| cells(row, from, to))
                .collect()
        };
        let [attitudes, sigmas]: [Vec<String>; 2] = [part(0, 11), part(11, 14)];
        (attitudes, sigmas, format!("{}{}", ran.out, ran.err))
    };
    let (with, _, _) = rows("--aid none");
    let (without, sigmas, said) = rows("--aid none --noise none");
    assert!(with == without && !with.is_empty());
    assert!(
        sigmas
            .iter()
            .all(|sigma| sigma == "0,0,0" || sigma == "0.0,0.0,0.0"),
        "{:?}",
        sigmas.first()
    );
    assert!(said.contains("not known: no noise was stated"), "{said}");
    let refused = strapd(
        at,
        "replay log.mcap -o out.csv --force --aid gravity --noise none",
    );
    assert!(
        refused.err.contains("--noise none") && refused.err.contains("--aid none"),
        "{}",
        refused.err
    );
}

#[test]
fn every_row_is_in_the_help_of_every_estimation_and_in_its_file() {
    let here = Path::new(".");
    let helps = ["replay", "report", "serve", "check", "calibrate"]
        .map(|command| (command, strapd(here, &format!("{command} --help")).out));
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("serve.toml"), "").unwrap();
    let shown = strapd(dir.path(), "config show serve.toml").out;
    strapd(dir.path(), "man --out-dir .").done();
    let man = std::fs::read_to_string(dir.path().join("strapd-replay.1")).unwrap();
    for row in &ROWS {
        let key = row.setting.key();
        for (command, help) in &helps {
            let is_there = help.contains(&format!("--{key}"));
            let is_due = row.setting != SMOOTH || ["replay", "report"].contains(command);
            assert_eq!(is_there, is_due, "{command} --{key}");
        }
        let roff = format!("\\-\\-{}", key.replace('-', "\\-"));
        assert!(man.contains(&roff), "{key} in the manual");
        if row.setting == SMOOTH {
            continue;
        }
        let line = shown.lines().find(|line| {
            let line = line.trim_start_matches("# ");
            line.starts_with(&format!("{key} "))
        });
        let line = line.unwrap_or_else(|| panic!("{key}: {shown}"));
        // Tests run with some of them.
        if row.environment.is_some() && line.ends_with("# environment") {
            continue;
        }
        match (row.default, row.takes) {
            (_, Takes::Switch(_)) => assert!(line.contains("= false")),
            // Of a stream that is another.
            (Default::Value(_), _) if key == "method" => assert!(line.contains("\"commit\"")),
            (Default::Value(value), _) => {
                assert!(line.contains(&format!("= \"{value}\"")), "{line}")
            }
            (Default::Unset(_), _) => assert!(line.contains("is not set"), "{line}"),
        }
    }
}
