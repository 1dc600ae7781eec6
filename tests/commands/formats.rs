//! Promise: what strapd writes it reads back, whatever the file is called and however it comes.

use crate::made_databases::database;
use crate::mcap_logs::read_some;
use crate::program::{strapd, strapd_fed};
use crate::replays::fixture;
use std::path::Path;
use strapd_recording::mcap::{Channel, Order, Reader, WalkOptions};

/// A directory with the same samples as `s.mcap`, `s.ndjson` and `s.csv`.
fn bench() -> tempfile::TempDir {
    bench_of("coning_average.mcap")
}

fn bench_of(log: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::copy(fixture(log), at.join("s.mcap")).unwrap();
    for (format, name) in [("ndjson", "s.ndjson"), ("csv", "s.csv")] {
        let ran = strapd(at, &format!("cat s.mcap --format {format}"));
        std::fs::write(at.join(name), &ran.done().out).unwrap();
    }
    std::fs::write(at.join("s.db3"), in_sqlite(&at.join("s.mcap"))).unwrap();
    dir
}

/// The messages of a log as a recording of ROS 2 in SQLite.
fn in_sqlite(log: &Path) -> Vec<u8> {
    let reader = Reader::open(log).unwrap();
    let survey = strapd_recording::mcap::survey(&reader, &WalkOptions::default()).unwrap();
    let kind = |channel: &Channel| channel.schema.as_deref().unwrap().name.clone();
    let channels = survey.channels.iter().map(|found| &found.channel);
    let topics: Vec<(String, String)> = channels.map(|c| (c.topic.clone(), kind(c))).collect();
    let options = WalkOptions {
        order: Order::File,
        ..WalkOptions::default()
    };
    let (messages, _) = read_some(reader, &options, |_| true);
    let nth = |topic: &str| topics.iter().position(|known| known.0 == topic).unwrap();
    let messages: Vec<_> = messages
        .iter()
        .map(|(topic, time, _, data)| (nth(topic), *time, data.as_slice()))
        .collect();
    let topics: Vec<_> = topics
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    database(16_384, &topics, &messages)
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
    for (from, holds) in [
        ("s.mcap", "MCAP"),
        ("s.ndjson", "NDJSON"),
        ("s.csv", "CSV"),
        ("s.db3", "rosbag2 SQLite"),
    ] {
        for (to, called) in [
            ("x.mcap", "MCAP"),
            ("x.JSONL", "NDJSON"),
            ("x.csv", "CSV"),
            ("x.db3", "rosbag2 SQLite"),
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
fn a_table_that_names_no_rate_says_which_columns_are_needed() {
    let dir = bench();
    let at = dir.path();
    for (header, why) in [
        ("stamp_ns,temperature,pressure", "names a rate"),
        ("stamp_ns,gyro_x,gyro_y", "names a rate"),
        ("\u{1b}[2Jstamp_ns", "three cells"),
    ] {
        std::fs::write(at.join("other.csv"), format!("{header}\n1,2,3,4\n")).unwrap();
        strapd(at, "replay other.csv -o null:")
            .refused(1, &["other.csv", why, "help: ", "--columns gyro="]);
    }
    std::fs::write(at.join("still.csv"), "stamp_ns,qw,qx,qy,qz\n1,1,0,0,0\n").unwrap();
    strapd(at, "replay still.csv -o null:").refused(1, &["no row carries a body rate"]);
    strapd(at, "replay s.csv --field gyro=accel -o null:")
        .refused(1, &["s.csv", "--field", "--columns gyro="]);
    // No line end in three megabytes.
    std::fs::write(at.join("long.csv"), vec![b'7'; 3 << 20]).unwrap();
    strapd(at, "replay long.csv -o null:").refused(1, &["long.csv", "three cells"]);
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

/// Every command that reads a recording, over every format, from a file and from standard input: the same answer. What is
/// said of the file itself and of what its samples are called may differ.
#[test]
fn every_command_reads_every_format_from_a_file_and_from_standard_input() {
    // A real sensor, with its own orientation beside its rates, received later than stamped.
    let dir = bench_of("xsens_mti.mcap");
    let at = dir.path();
    let samples = "s.mcap";
    strapd(at, "replay s.mcap -o a.mcap -o a.ndjson -o truth.csv").done();
    for (command, keys) in [
        ("info FILE --json", &["/imu/0"][..]),
        ("check FILE --json", &["/findings"][..]),
        ("allan FILE --json", &[""][..]),
        ("report FILE --json", &["/topics/0"][..]),
        (
            "report FILE --json --reference truth.csv",
            &["/topics/0"][..],
        ),
        ("compare a.mcap FILE --align heading --json", &[""][..]),
        ("cat FILE", &[][..]),
    ] {
        let of = |file: &str, stdin: Vec<u8>| {
            let ran = strapd_fed(at, &command.replace("FILE", file), stdin);
            assert!(matches!(ran.code, Some(0 | 3)), "{command} {file}: {ran:?}");
            assert!(!ran.out.is_empty(), "{command} {file}: {ran:?}");
            (ran.code, same_but_for_names(&ran.out, keys))
        };
        let expected = of(samples, Vec::new());
        for file in ["s.mcap", "s.ndjson", "s.csv", "s.db3"] {
            assert_eq!(of(file, Vec::new()), expected, "{command} {file}");
            assert_eq!(of("-", read(at, file)), expected, "{command} - <{file}");
        }
    }
    for estimate in ["a.mcap", "a.ndjson", "truth.csv"] {
        let compare = "--align none --max-angle 1e-12 --quiet";
        strapd(at, &format!("compare {estimate} a.mcap {compare}")).done();
        strapd_fed(
            at,
            &format!("compare - a.mcap {compare}"),
            read(at, estimate),
        )
        .done();
        strapd_fed(
            at,
            &format!("compare a.mcap - {compare}"),
            read(at, estimate),
        )
        .done();
    }
    strapd(at, "compare - -").refused(2, &["standard input comes once"]);
}

/// The parts of a JSON answer that are about the samples, without what they are called; lines as they are but for the id.
fn same_but_for_names(out: &str, keys: &[&str]) -> Vec<serde_json::Value> {
    let mut values: Vec<serde_json::Value> = out
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    if !keys.is_empty() {
        let whole = values.remove(0);
        let part = |key: &&str| {
            whole
                .pointer(key)
                .unwrap_or_else(|| panic!("{key}: {whole}"))
                .clone()
        };
        values = keys.iter().map(part).collect();
    }
    values.retain(|value| value.get("gyro").is_some() || value.get("mag").is_none());
    for value in &mut values {
        forget(value);
    }
    values
}

/// Takes out names, and what only an MCAP has: a frame, a log time of its own, and topics of fields beside the
/// samples, which are lines of their own, and which rows have not.
fn forget(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(map) => {
            for name in [
                "topic",
                "id",
                "type",
                "decoded_as",
                "frame",
                "frame_id",
                "output_topic",
                "header_minus_log_s",
                "field",
                "field_topics",
                "field_topic_taken",
            ] {
                map.remove(name);
            }
            map.values_mut().for_each(forget);
        }
        serde_json::Value::Array(all) => all.iter_mut().for_each(forget),
        _ => {}
    }
}

#[test]
fn what_is_no_recording_is_called_so_on_standard_input_too() {
    let dir = bench();
    let at = dir.path();
    for command in ["info", "check", "allan", "cat", "report --json"] {
        let fed = |bytes: &[u8]| strapd_fed(at, &format!("{command} -"), bytes.to_vec());
        fed(b"").refused(1, &["standard input", "empty"]);
        fed(b"hello\nworld\n").refused(1, &["standard input", "no format that is read", "hello"]);
        fed(&[0xff; 3000]).refused(1, &["standard input", "no format that is read"]);
        fed(b"{\"class\":\"STATUS\"}\n").refused(1, &["standard input", "no line carries"]);
        fed(b"{]\n").refused(
            1,
            &["standard input", "line 1: JSON", "help: one JSON object"],
        );
        fed(b"stamp_ns,gyro_x,gyro_y,gyro_z\n").refused(1, &["standard input", "no row carries"]);
        fed(b"stamp_ns,gyro_x,gyro_y,gyro_z\n1,2\n").refused(1, &["line 2: 2 cells"]);
        // No end of a line in three megabytes.
        fed(&[b"{", vec![b'7'; 3 << 20].as_slice()].concat()).refused(1, &["line 1"]);
    }
}

#[test]
fn a_recording_in_a_named_pipe_is_read_like_one_in_a_file() {
    let dir = bench();
    let at = dir.path();
    let made = std::process::Command::new("mkfifo")
        .arg(at.join("pipe"))
        .status();
    assert!(made.unwrap().success());
    let expected = strapd(at, "info s.csv --json").json()["imu"].clone();
    let writer = std::thread::spawn({
        let (pipe, bytes) = (at.join("pipe"), read(at, "s.csv"));
        move || std::fs::write(pipe, bytes).unwrap()
    });
    let got = strapd(at, "info pipe --json").json()["imu"].clone();
    writer.join().unwrap();
    assert_eq!(got, expected);
}

#[test]
fn several_sensors_in_a_text_are_topics_of_which_one_is_named() {
    let dir = bench();
    let at = dir.path();
    let mut text = String::new();
    for n in 0..400u64 {
        for (id, rate) in [("left", 0.1), ("right", 0.2)] {
            text.push_str(&format!(
                "{{\"class\":\"RATE\",\"id\":\"{id}\",\"stamp_ns\":{},\"gyro\":[{rate},0,0]}}\n",
                1_700_000_000_000_000_000 + n * 10_000_000
            ));
        }
    }
    std::fs::write(at.join("two.txt"), &text).unwrap();
    for command in ["cat", "allan"] {
        strapd(at, &format!("{command} two.txt"))
            .refused(1, &["left ", "right ", "400 messages", "--topic NAME"]);
    }
    let one = strapd(at, "cat two.txt --topic right");
    assert_eq!(one.done().lines().len(), 400);
    assert!(one.lines().iter().all(|line| line["gyro"][0] == 0.2));
    let info = strapd(at, "info two.txt --json").json();
    let counts = info["imu"].as_array().unwrap().iter();
    let counts: Vec<_> = counts
        .map(|t| (t["topic"].clone(), t["samples"].clone()))
        .collect();
    assert_eq!(
        counts,
        [("left".into(), 400.into()), ("right".into(), 400.into())]
    );
    strapd(at, "info two.txt --topic up").refused(1, &["no topic `up`", "left", "right"]);
    let checked = strapd(at, "check two.txt");
    assert!(
        checked
            .out
            .contains("left (400 samples), right (400 samples)"),
        "{checked:?}"
    );
}

#[test]
fn samples_with_their_truth_are_told_apart_in_lines_as_in_a_log() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(
        at,
        "simulate coning --duration 4 --rate-hz 100 -o c.mcap -o c.ndjson -o c.csv",
    )
    .done();
    let summary = |file: &str| {
        let report = strapd(at, &format!("report {file} --json")).json();
        report["topics"].as_array().unwrap().len()
    };
    for file in ["c.mcap", "c.ndjson", "c.csv"] {
        assert_eq!(summary(file), 1, "{file}");
    }
    let info = strapd(at, "info c.ndjson");
    assert!(
        info.done().out.contains("imu  RATE [NDJSON]  401 samples"),
        "{info:?}"
    );
    assert!(
        info.out.contains("truth  ATT [NDJSON]  401 messages"),
        "{info:?}"
    );
    assert!(
        info.out.contains("802 samples of 2 sensors; NDJSON"),
        "{info:?}"
    );
}
