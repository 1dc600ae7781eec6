//! Promise: what strapd writes it reads back, whatever the file is called and however it comes.

use crate::program::{strapd, strapd_fed};
use crate::replays::fixture;
use std::path::Path;

/// A directory with the same samples as `s.mcap`, `s.ndjson` and `s.csv`: means over 5 ms, with accelerations.
fn bench() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::copy(fixture("coning_average.mcap"), at.join("s.mcap")).unwrap();
    for (format, name) in [("ndjson", "s.ndjson"), ("csv", "s.csv")] {
        let ran = strapd(at, &format!("cat s.mcap --format {format}"));
        std::fs::write(at.join(name), &ran.done().out).unwrap();
    }
    dir
}

fn read(at: &Path, name: &str) -> Vec<u8> {
    std::fs::read(at.join(name)).unwrap()
}

/// The attitudes of a replay with these arguments, and what it said beside them. The name of the topic may differ.
fn attitudes(at: &Path, arguments: &str, stdin: Vec<u8>) -> (String, String) {
    let ran = strapd_fed(at, &format!("replay {arguments} -o a.csv --force"), stdin);
    let ran = ran.done();
    (
        std::fs::read_to_string(at.join("a.csv")).unwrap(),
        ran.err.clone(),
    )
}

#[test]
fn what_a_file_holds_wins_over_what_it_is_called_and_that_is_said() {
    let dir = bench();
    let at = dir.path();
    let (expected, said) = attitudes(at, "s.mcap", Vec::new());
    assert!(!said.contains("is called"), "{said}");
    for (from, holds) in [("s.mcap", "MCAP"), ("s.ndjson", "NDJSON"), ("s.csv", "CSV")] {
        for (to, called) in [
            ("x.mcap", "MCAP"),
            ("x.JSONL", "NDJSON"),
            ("x.csv", "CSV"),
            ("x.txt", ""),
            ("x", ""),
        ] {
            std::fs::copy(at.join(from), at.join(to)).unwrap();
            let (got, said) = attitudes(at, to, Vec::new());
            assert_eq!(got, expected, "{from} as {to}");
            let words = format!("is called {called}, but holds {holds}");
            let contradicts = !called.is_empty() && called != holds;
            assert_eq!(said.contains(&words), contradicts, "{from} as {to}: {said}");
            std::fs::remove_file(at.join(to)).unwrap();
        }
        let (got, _) = attitudes(at, "-", read(at, from));
        assert_eq!(got, expected, "{from} on standard input");
    }
}

#[test]
fn a_mark_of_byte_order_line_ends_of_other_systems_and_blank_lines_change_nothing() {
    let dir = bench();
    let at = dir.path();
    let (expected, _) = attitudes(at, "s.mcap", Vec::new());
    let text = String::from_utf8(read(at, "s.csv")).unwrap();
    let other = format!("\u{feff}{}", text.replace('\n', "\r\n\r\n"));
    std::fs::write(at.join("other.csv"), &other).unwrap();
    assert_eq!(attitudes(at, "other.csv", Vec::new()).0, expected);
    assert_eq!(attitudes(at, "-", other.into_bytes()).0, expected);
    // Two tables, one behind the other.
    let rows: Vec<&str> = text.lines().collect();
    let (first, second) = rows.split_at(rows.len() / 2);
    let joined = [first, &rows[..1], second].concat().join("\n");
    assert_eq!(attitudes(at, "-", joined.into_bytes()).0, expected);
}

#[test]
fn a_row_that_is_none_is_counted_and_the_first_one_is_shown_with_its_line() {
    let dir = bench();
    let at = dir.path();
    let text = String::from_utf8(read(at, "s.csv")).unwrap();
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    rows[10] = rows[10].replacen(',', ",x", 2);
    rows[20].push_str(",7");
    std::fs::write(at.join("bad.csv"), rows.join("\n")).unwrap();
    let ran = strapd(at, "replay bad.csv -o null:");
    assert_eq!(ran.code, Some(3), "{ran:?}");
    for words in ["2 undecodable", "line 11: column `log_ns`: `x"] {
        assert!(ran.out.contains(words), "`{words}` is missing: {ran:?}");
    }
    rows[1] = "1,2".to_owned();
    strapd_fed(at, "replay - -o null:", rows.join("\n")).refused(
        1,
        &[
            "standard input",
            "line 2: 2 cells, but 14 columns",
            "help: one row per sample",
        ],
    );
}

#[test]
fn a_table_that_is_not_ours_says_which_columns_are_needed() {
    let dir = bench();
    let at = dir.path();
    for (header, why) in [
        ("time,gx,gy,gz", "no column stamp_ns"),
        ("stamp_ns,temperature", "neither columns gyro_x"),
        ("stamp_ns,gyro_x,gyro_y", "not all are there"),
        ("\u{1b}[2Jstamp_ns", "no column stamp_ns"),
    ] {
        std::fs::write(at.join("other.csv"), format!("{header}\n1,2,3,4\n")).unwrap();
        strapd(at, "replay other.csv -o null:")
            .refused(1, &["other.csv", why, "help: columns stamp_ns and gyro_x"]);
    }
    std::fs::write(at.join("still.csv"), "stamp_ns,qw,qx,qy,qz\n1,1,0,0,0\n").unwrap();
    strapd(at, "replay still.csv -o null:").refused(1, &["no row carries a body rate"]);
    strapd(at, "replay s.csv --field gyro=accel -o null:")
        .refused(1, &["s.csv", "--field", "names its columns"]);
    // No line end in three megabytes.
    std::fs::write(at.join("long.csv"), vec![b'7'; 3 << 20]).unwrap();
    strapd(at, "replay long.csv -o null:").refused(1, &["long.csv", "no column stamp_ns"]);
}

#[test]
fn attitudes_that_were_written_as_rows_are_held_against_those_of_the_log_in_their_own_world() {
    let dir = bench();
    let at = dir.path();
    for world in ["enu", "ned"] {
        for name in ["a.csv", "a.ndjson", "a.mcap"] {
            strapd(
                at,
                &format!("replay s.mcap --world {world} -o {world}-{name}"),
            )
            .done();
        }
    }
    let head = String::from_utf8(read(at, "ned-a.csv")).unwrap();
    let head: Vec<&str> = head.lines().take(2).collect();
    assert!(
        head[0].starts_with("stamp_ns,qw,qx,qy,qz,roll_deg"),
        "{head:?}"
    );
    assert!(
        head[0].ends_with(",status,world") && head[1].ends_with(",ned"),
        "{head:?}"
    );
    for world in ["enu", "ned"] {
        for name in ["a.csv", "a.ndjson"] {
            let flags = "--align none --json";
            let ran = strapd(
                at,
                &format!("compare {world}-{name} {world}-a.mcap {flags}"),
            );
            let worst = ran.json()["total"]["max_deg"].as_f64().unwrap();
            // Taken for the wrong world they are half a turn apart; the conversion rounds a few times, 1e-14 deg.
            assert!(worst < 1e-12, "{world}-{name}: {worst:e}");
        }
    }
    // As the columns were called at first.
    let old = String::from_utf8(read(at, "enu-a.csv")).unwrap();
    let old = old.replacen("qw,qx,qy,qz", "w,x,y,z", 1);
    std::fs::write(at.join("old.txt"), old).unwrap();
    strapd(
        at,
        "compare old.txt enu-a.mcap --align none --max-angle 1e-12",
    )
    .done();
}

#[test]
fn a_table_of_attitudes_is_one_of_rates_where_there_is_nothing_else() {
    let dir = bench();
    let at = dir.path();
    strapd(at, "replay s.mcap -o a.csv").done();
    let ran = strapd(at, "replay a.csv --json -o null:");
    let topic = ran.json()["topics"][0].clone();
    assert_eq!(topic["samples"]["used"], 2001, "{topic}");
}
