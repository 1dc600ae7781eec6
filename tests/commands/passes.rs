//! Promise: however often a command goes through the samples of a text, it reads the text once; a report reads it a
//! second time, for its digest.

use crate::program::{ended, strapd};
use std::path::Path;
use std::process::Command;

/// Bytes that a command reads, and what it has waited for, over the size of the file it is given.
fn passes(dir: &Path, file: &str, arguments: &str) -> f64 {
    let mut command = Command::new("/bin/sh");
    // The kernel adds what children have read to what their parent has once it has waited for them.
    command
        .args(["-c", "\"$@\" >out.txt 2>err.txt; echo $?; cat /proc/$$/io"])
        .arg("sh")
        .arg(assert_cmd::cargo::cargo_bin("strapd"))
        .args(arguments.replace("FILE", file).split_whitespace())
        .env("STRAPD_AID", "none")
        .current_dir(dir);
    let said = String::from_utf8(ended(&command, "").stdout).unwrap();
    let said: Vec<&str> = said.lines().collect();
    let err = std::fs::read_to_string(dir.join("err.txt")).unwrap();
    assert!(["0", "3"].contains(&said[0]), "strapd {arguments}: {err}");
    let read = said.iter().find_map(|line| line.strip_prefix("rchar: "));
    let size = std::fs::metadata(dir.join(file)).unwrap().len();
    read.unwrap().parse::<f64>().unwrap() / size as f64
}

#[test]
fn a_text_is_read_once_by_whatever_looks_at_it_more_often() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["long.csv", "long.ndjson"] {
        let made = format!("simulate coning --duration 20 --rate-hz 1000 --seed 3 -o {file}");
        strapd(dir.path(), &made).done();
        let size = std::fs::metadata(dir.path().join(file)).unwrap().len();
        // Beside it a program and its libraries are little.
        assert!(size > 2 << 20, "{size}");
        for (most, arguments) in [
            (1.0, "info FILE"),
            (1.0, "check FILE"),
            (1.0, "cat FILE"),
            (1.0, "allan FILE"),
            (1.0, "replay FILE --topic all -o null:"),
            (2.0, "report FILE -o page.html --force"),
            (1.0, "replay FILE --bias 0,0,0 -o null:"),
            (1.0, "replay FILE --regularise-stamps -o null:"),
        ] {
            let passes = passes(dir.path(), file, arguments);
            println!("{passes:.2} of {file}: strapd {arguments}");
            assert!(
                (0.9..most + 0.1).contains(&passes),
                "{passes:.2} passes over {file}, at most {most}: strapd {arguments}"
            );
        }
    }
}
