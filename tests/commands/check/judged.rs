//! `check` says what `replay` does: of every verdict, and of what was asked for and is not there.

use crate::program::{Ran, strapd, strapd_fed};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use strapd_attitude::record::Verdict;

const FIRST: i64 = 1_700_000_000_000_000_000;
const STEP: i64 = 10_000_000;
const FAULTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/faults.mcap");

/// Rows of a gyro at 100 Hz.
fn rows(n: i64) -> Vec<String> {
    let row = |i: i64| {
        let (sin, cos) = (0.01 * i as f64).sin_cos();
        format!("{},{:.6},{:.6},0.2", FIRST + i * STEP, 0.5 * sin, 0.3 * cos)
    };
    (0..n).map(row).collect()
}

fn at(i: i64, rate: &str) -> String {
    format!("{},{rate},0.1,0.2", FIRST + i * STEP)
}

/// Rows of which one gets this verdict, and the flags that it takes.
fn giving(verdict: Verdict) -> (Vec<String>, &'static str) {
    let mut rows = rows(400);
    let mut flags = "";
    match verdict {
        Verdict::Accepted => {}
        Verdict::Reordered => rows.swap(100, 101),
        Verdict::Undecodable => rows[100] = "no,number,at,all".to_owned(),
        Verdict::NoGyro => {}
        Verdict::NotFinite => rows[100] = at(100, "nan"),
        Verdict::Huge => rows[100] = at(100, "100001"),
        Verdict::Repeated => rows.insert(100, rows[100].clone()),
        Verdict::DuplicateStamp => rows.insert(100, at(100, "0.7")),
        Verdict::Late => {
            let late = rows.remove(100);
            rows.insert(300, late);
        }
        Verdict::NoStamp => rows[100] = "0,0.1,0.2,0.3".to_owned(),
        Verdict::Trimmed => flags = "--until 2",
        // Two on one stamp, and a step of two behind it.
        Verdict::Restamped => rows[101] = at(100, "0.7"),
        Verdict::StrayStamp => rows[100] = at(100_000, "0.1"),
        Verdict::FarStamp => rows[100] = format!("{},0.1,0.2,0.3", i64::MAX - 1),
    }
    (rows, flags)
}

fn table(rows: &[String]) -> String {
    format!("stamp_ns,gyro_x,gyro_y,gyro_z\n{}\n", rows.join("\n"))
}

fn json(ran: &Ran) -> Value {
    serde_json::from_str(&ran.out).unwrap_or_else(|why| unreachable!("{why}: {ran:?}"))
}

fn found(dir: &Path, file: &str, flags: &str) -> (Vec<(String, String)>, Option<i32>) {
    let ran = strapd(dir, &format!("check {file} {flags} --json"));
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    let findings = json(&ran)["findings"].as_array().unwrap().clone();
    let all = findings
        .iter()
        .map(|f| (text(f, "severity"), text(f, "code")));
    (all.collect(), ran.code)
}

#[test]
fn every_verdict_of_a_replay_has_its_finding() {
    let dir = tempfile::tempdir().unwrap();
    let (clean, _) = giving(Verdict::Accepted);
    std::fs::write(dir.path().join("clean.csv"), table(&clean)).unwrap();
    let (plain, code) = found(dir.path(), "clean.csv", "");
    assert_eq!(code, Some(0), "{plain:?}");
    for verdict in Verdict::ALL {
        if verdict == Verdict::Accepted {
            continue;
        }
        let (rows, flags) = giving(verdict);
        // Rows have no mark for a gyro that is absent.
        let name = match verdict {
            Verdict::NoGyro => FAULTS,
            _ => "log.csv",
        };
        std::fs::write(dir.path().join("log.csv"), table(&rows)).unwrap();
        let ran = strapd(
            dir.path(),
            &format!("replay {name} {flags} --json -o null:"),
        );
        let counts = &json(&ran)["topics"][0]["samples"]["by_verdict"];
        let n = counts[verdict.name()].as_u64().unwrap();
        assert!(n > 0, "{verdict:?}: {counts}");
        let (all, code) = found(dir.path(), name, flags);
        let new: Vec<_> = all.iter().filter(|f| !plain.contains(f)).collect();
        assert!(!new.is_empty(), "{verdict:?}: {all:?}");
        if verdict.is_loss() {
            assert_eq!((ran.code, code), (Some(3), Some(3)), "{verdict:?}");
            let is_error = |f: &&(String, String)| f.0 == "error";
            assert!(
                new.into_iter().any(|f| is_error(&f)),
                "{verdict:?}: {all:?}"
            );
        }
    }
}

#[test]
fn a_run_without_any_attitude_claims_no_sigma_and_is_an_error_in_both() {
    let dir = tempfile::tempdir().unwrap();
    let fast: Vec<String> = (0..200).map(|i| at(i, "100001")).collect();
    let far = |i: i64| format!("{},0.1,0.2,0.3", i64::MAX - 200 + i);
    let far: Vec<String> = (0..200).map(far).collect();
    for (name, rows, code) in [
        ("fast.csv", fast, "huge-rate"),
        ("far.csv", far, "far-stamp"),
    ] {
        std::fs::write(dir.path().join(name), table(&rows)).unwrap();
        let ran = strapd(dir.path(), &format!("replay {name} -o null:"));
        assert_eq!(ran.code, Some(3), "{ran:?}");
        assert!(!ran.out.contains("sigma"), "{ran:?}");
        assert!(ran.out.contains("no attitude"), "{ran:?}");
        let ran = strapd(dir.path(), &format!("replay {name} -o null: --json"));
        assert_eq!(json(&ran)["topics"][0]["final"], Value::Null);
        let (all, exit) = found(dir.path(), name, "");
        assert_eq!(exit, Some(3), "{all:?}");
        for code in [code, "nothing-used"] {
            let is = |(severity, found): &(String, String)| severity == "error" && found == code;
            assert!(all.iter().any(is), "{name}: {code}: {all:?}");
        }
        let ran = strapd(dir.path(), &format!("report {name} --json"));
        assert_eq!(ran.code, Some(3), "{ran:?}");
        assert_eq!(json(&ran)["verdict"]["level"], "bad");
    }
}

/// 10 s about x by a rate, with the forces and fields that belong to it.
fn with_field(field: impl Fn(f64) -> [f64; 3]) -> String {
    let mut out =
        "stamp_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,mag_x,mag_y,mag_z\n".to_owned();
    for i in 0..1000 {
        let angle = 0.5 * 0.01 * i as f64;
        let (sin, cos) = angle.sin_cos();
        let [x, y, z] = field(angle);
        let stamp = FIRST + i * STEP;
        let _ = writeln!(
            out,
            "{stamp},0.5,0,0,0,{},{},{x},{y},{z}",
            9.80665 * sin,
            9.80665 * cos
        );
    }
    out
}

#[test]
fn north_is_not_claimed_without_a_field() {
    let dir = tempfile::tempdir().unwrap();
    let good = with_field(|angle| {
        let (sin, cos) = angle.sin_cos();
        [20.0, -45.0 * sin, -45.0 * cos]
    });
    let mut without: String = String::new();
    for line in good.lines() {
        let cells: Vec<&str> = line.split(',').take(7).collect();
        without += &format!("{}\n", cells.join(","));
    }
    for (name, text, words) in [
        ("good", good, ""),
        ("none", without, "no sample carries a magnetic field"),
        ("zero", with_field(|_| [0.0; 3]), "is zero"),
        ("frozen", with_field(|_| [20.0, 0.0, -45.0]), "frozen"),
    ] {
        std::fs::write(dir.path().join(format!("{name}.csv")), text).unwrap();
        let ran = strapd(
            dir.path(),
            &format!("replay {name}.csv --aid gravity+mag -o {name}.mcap"),
        );
        let written = dir.path().join(format!("{name}.mcap")).exists();
        let (all, exit) = found(dir.path(), &format!("{name}.csv"), "--aid gravity+mag");
        if words.is_empty() {
            assert_eq!((ran.code, written), (Some(0), true), "{ran:?}");
            assert!(all.iter().all(|f| f.1 != "refused"), "{all:?}");
            continue;
        }
        assert_eq!((ran.code, written), (Some(1), false), "{name}: {ran:?}");
        assert!(ran.err.contains(words), "{ran:?}");
        assert!(!ran.out.contains("north"), "{ran:?}");
        assert_eq!(exit, Some(3), "{all:?}");
    }
}

#[test]
fn a_window_without_a_sample_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("log.csv"), table(&rows(400))).unwrap();
    for (flags, code) in [
        ("--start 100", 1),
        ("--start 3.995 --until 3.999", 1),
        ("--start 2 --until 1", 2),
        ("--until -1", 2),
    ] {
        let ran = strapd(dir.path(), &format!("replay log.csv {flags} -o out.csv"));
        assert_eq!(ran.code, Some(code), "{flags}: {ran:?}");
        assert!(ran.err.contains("error: "), "{ran:?}");
        assert!(!dir.path().join("out.csv").exists(), "{flags}");
        let ran = strapd(dir.path(), &format!("check log.csv {flags}"));
        assert_ne!(ran.code, Some(0), "{flags}: {ran:?}");
    }
}

#[test]
fn a_clock_that_was_set_is_told_by_how_much_and_where() {
    let dir = tempfile::tempdir().unwrap();
    let shifted = |by_secs: i64| {
        let mut all = rows(2000);
        for (i, row) in all.iter_mut().enumerate().skip(1000) {
            let (_, rest) = row.split_once(',').unwrap();
            *row = format!(
                "{},{rest}",
                FIRST + i as i64 * STEP + by_secs * 1_000_000_000
            );
        }
        all
    };
    for (name, by, told) in [
        (
            "back.csv",
            -3600,
            "set back once, by 3599.990 s, 9.990 s after the start",
        ),
        (
            "forth.csv",
            850_000_000,
            "the longest 850000000.010 s, 10.0 s after the start",
        ),
    ] {
        std::fs::write(dir.path().join(name), table(&shifted(by))).unwrap();
        let check = strapd(dir.path(), &format!("check {name} --sample-kind rate"));
        assert_eq!(check.code, Some(3));
        assert!(check.out.contains(told), "{check:?}");
        assert!(!check.out.contains("are missing"), "{check:?}");
        let replay = strapd(
            dir.path(),
            &format!("replay {name} -o null: --sample-kind rate"),
        );
        assert!(!replay.out.contains("; -"), "{replay:?}");
        if by < 0 {
            assert!(replay.out.contains("19.980 s at 100.00 Hz"), "{replay:?}");
            assert!(replay.out.contains(told), "{replay:?}");
        }
    }
}

#[test]
fn the_rate_is_the_median_and_not_that_of_the_end() {
    let dir = tempfile::tempdir().unwrap();
    let mut all = rows(1000);
    for (i, row) in all.iter_mut().enumerate().skip(800) {
        let (_, rest) = row.split_once(',').unwrap();
        *row = format!(
            "{},{rest}",
            FIRST + 799 * STEP + (i as i64 - 799) * STEP / 10
        );
    }
    std::fs::write(dir.path().join("log.csv"), table(&all)).unwrap();
    let ran = strapd(dir.path(), "replay log.csv -o null:");
    assert!(ran.out.contains("at 100.00 Hz"), "{ran:?}");
}

#[test]
fn check_judges_the_attitude_of_replay_with_its_flags() {
    let dir = tempfile::tempdir().unwrap();
    let made = strapd(dir.path(), "simulate random --duration 10 -o s.mcap");
    assert_eq!(made.code, Some(0), "{made:?}");
    let (auto, _) = found(dir.path(), "s.mcap", "--aid auto");
    let (alone, _) = found(dir.path(), "s.mcap", "--aid none");
    let says = |all: &[(String, String)]| all.iter().any(|f| f.1 == "gyro-alone");
    assert!(!says(&auto) && says(&alone), "{auto:?} {alone:?}");
    // A force that cannot level is named by both.
    let tenfold: String = with_field(|_| [1.0, 0.0, 0.0])
        .lines()
        .enumerate()
        .map(|(i, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            for cell in cells.iter_mut().skip(4).take(3).filter(|_| i > 0) {
                *cell = (10.0 * cell.parse::<f64>().unwrap()).to_string();
            }
            cells.join(",") + "\n"
        })
        .collect();
    std::fs::write(dir.path().join("tenfold.csv"), tenfold).unwrap();
    let ran = strapd(dir.path(), "replay tenfold.csv --aid auto -o null:");
    assert!(ran.out.contains("10.0 times as long"), "{ran:?}");
    assert!(!ran.out.contains("without gravity"), "{ran:?}");
    let (all, exit) = found(dir.path(), "tenfold.csv", "--aid auto");
    assert!(all.iter().any(|f| f.1 == "force-implausible"), "{all:?}");
    assert_eq!(exit, Some(3));
    // A flag that deals with it is no finding any more.
    let ran = strapd(dir.path(), "check tenfold.csv --aid none --json");
    let said = json(&ran);
    assert!(
        said["findings"]
            .as_array()
            .unwrap()
            .iter()
            .all(|f| f["code"] != "force-implausible")
    );
}

#[test]
fn all_topics_of_a_pipe_are_taken() {
    let dir = tempfile::tempdir().unwrap();
    let row = |i: i64| {
        let id = ["a", "b"][i as usize % 2];
        format!(
            "{{\"id\":\"{id}\",\"stamp_ns\":{},\"gyro\":[0.1,0.2,0.3]}}\n",
            FIRST + i * STEP
        )
    };
    let text: String = (0..400).map(row).collect();
    std::fs::write(dir.path().join("two.ndjson"), &text).unwrap();
    let from_file = strapd(dir.path(), "replay two.ndjson --topic all -o null: --json");
    let from_pipe = strapd_fed(dir.path(), "replay - --topic all -o null: --json", text);
    for ran in [&from_file, &from_pipe] {
        let topics = json(ran)["topics"].as_array().unwrap().len();
        assert_eq!(topics, 2, "{ran:?}");
    }
    for name in ["ardupilot.tlog", "px4_flight.ulg", "constant_rate.mcap"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("fixtures")
            .join(name);
        let flags = "--topic all -o null: --json";
        let from_file = strapd(dir.path(), &format!("replay {} {flags}", path.display()));
        let bytes = std::fs::read(&path).unwrap();
        let from_pipe = strapd_fed(dir.path(), &format!("replay - {flags}"), bytes);
        assert_eq!(from_file.code, from_pipe.code, "{name}: {from_pipe:?}");
        if from_file.code == Some(1) {
            let why = |ran: &Ran| {
                ran.err
                    .split_once(": ")
                    .unwrap()
                    .1
                    .split_once(": ")
                    .unwrap()
                    .1
                    .to_owned()
            };
            assert_eq!(why(&from_file), why(&from_pipe), "{name}");
            continue;
        }
        let names = |ran: &Ran| -> Vec<Value> {
            let topics = json(ran)["topics"].as_array().unwrap().clone();
            topics.iter().map(|topic| topic["topic"].clone()).collect()
        };
        assert_eq!(names(&from_file), names(&from_pipe), "{name}");
    }
}
