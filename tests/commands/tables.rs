//! Promise: another maker's table is a log like any other: the same attitude as from an MCAP of its samples, in every
//! command, from a file and a pipe; how it was read is said so that it can be said again.

use crate::made_logs::{ImuSample, START, motion, written};
use crate::program::{strapd, strapd_fed};
use crate::replays::fixture;
use std::fmt::Write;
use std::path::Path;

/// Standard gravity, m/s^2.
const G: f64 = 9.806_65;

fn source(name: &str) -> std::path::PathBuf {
    fixture("source").join(name)
}

/// The rows of the attitudes of a replay without their stamps, these, and what was said.
fn attitudes(at: &Path, arguments: &str, stdin: Vec<u8>) -> (Vec<String>, Vec<i64>, String) {
    let ran = strapd_fed(at, &format!("replay {arguments} -o out.csv --force"), stdin);
    let ran = ran.done();
    let text = std::fs::read_to_string(at.join("out.csv")).unwrap();
    let split = |row: &str| {
        let (stamp, rest) = row.split_once(',').unwrap();
        (rest.to_owned(), stamp.parse::<i64>().unwrap())
    };
    let (rows, stamps) = text.lines().skip(1).map(split).unzip();
    (rows, stamps, format!("{}{}", ran.out, ran.err))
}

#[test]
fn recordings_of_makers_give_the_attitude_of_the_same_recordings_as_mcap() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (text, log) in [
        ("xsens_mti.txt", "xsens_mti.mcap --topic /imu/data"),
        ("ximu3_inertial.csv", "ximu3.mcap --topic /imu/data_raw"),
    ] {
        let (log, topic) = log.split_once(' ').unwrap();
        std::fs::copy(source(text), at.join(text)).unwrap();
        std::fs::copy(fixture(log), at.join(log)).unwrap();
        for flags in [
            "",
            "--aid gravity --bias none",
            "--sample-kind average --bias 0.01,0,0 --body Zxy",
        ] {
            let (expected, stamps, _) =
                attitudes(at, &format!("{log} {topic} {flags}"), Vec::new());
            let (rows, own, said) = attitudes(at, &format!("{text} {flags}"), Vec::new());
            assert!(
                rows.len() >= 500 && rows == expected,
                "{text} {flags}: {said}"
            );
            // Both count from their own start.
            let shift: Vec<i64> = stamps.iter().zip(&own).map(|(a, b)| a - b).collect();
            assert!(shift.iter().all(|s| *s == START), "{text}: {shift:?}");
            let piped = attitudes(
                at,
                &format!("- {flags}"),
                std::fs::read(source(text)).unwrap(),
            );
            assert_eq!(
                (&piped.0, &piped.1),
                (&rows, &own),
                "{text} {flags} on standard input"
            );
        }
    }
}

#[test]
fn a_recorded_orientation_in_a_table_is_a_reference() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for name in [
        "ximu3_inertial.csv",
        "ximu3_quaternion.csv",
        "xsens_mti.txt",
    ] {
        std::fs::copy(source(name), at.join(name)).unwrap();
    }
    for name in ["ximu3.mcap", "xsens_mti.mcap"] {
        std::fs::copy(fixture(name), at.join(name)).unwrap();
    }
    let figures = |arguments: &str| {
        let mut found = strapd(at, &format!("compare {arguments} --json"))
            .done()
            .json();
        for name in ["estimate", "reference", "est", "ref"] {
            found.as_object_mut().unwrap().remove(name);
        }
        found
    };
    for kind in ["text", "mcap"] {
        let log = if kind == "text" {
            "ximu3_inertial.csv"
        } else {
            "ximu3.mcap"
        };
        strapd(
            at,
            &format!("replay {log} --sample-kind average -o {kind}.csv"),
        )
        .done();
    }
    let by_table = figures("text.csv ximu3_quaternion.csv");
    let by_log = figures("mcap.csv ximu3.mcap --ref-topic /reference/orientation");
    assert_eq!(by_table["total"], by_log["total"]);
    let worst = by_table["total"]["max_deg"].as_f64().unwrap();
    assert!(worst > 0.1 && worst < 60.0, "{worst}");
    // Beside the samples.
    strapd(at, "replay xsens_mti.txt -o x.csv").done();
    strapd(at, "replay xsens_mti.mcap --topic /imu/data -o y.csv").done();
    assert_eq!(
        figures("x.csv xsens_mti.txt")["total"],
        figures("y.csv xsens_mti.mcap --ref-topic /imu/data")["total"]
    );
}

#[test]
fn a_capture_holds_the_orientation_of_its_device_as_a_reference() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::copy(fixture("ximu3.mcap"), at.join("ximu3.mcap")).unwrap();
    // The same numbers as the device sends them.
    let mut messages = Vec::new();
    for (letter, name) in [('I', "ximu3_inertial.csv"), ('Q', "ximu3_quaternion.csv")] {
        let table = std::fs::read_to_string(source(name)).unwrap();
        let rows = table.lines().skip(1);
        messages.extend(rows.map(|row| {
            let stamp: u64 = row.split(',').next().unwrap().parse().unwrap();
            (stamp, format!("{letter},{row}\r\n"))
        }));
    }
    messages.sort();
    let bytes: String = messages.into_iter().map(|(_, text)| text).collect();
    std::fs::write(at.join("capture.bin"), bytes).unwrap();
    let against = |log: &str| {
        let flags = "--sample-kind average --against-recorded --force -o a.csv --json";
        let ran = strapd(at, &format!("replay {log} {flags}")).done().json();
        let topic = &ran["topics"][0];
        let figure = |value: &serde_json::Value| value.as_f64().unwrap();
        let kinds = topic["against_recorded"].as_array().unwrap();
        let medians = kinds.iter().map(|kind| figure(&kind["median_deg"]));
        let sigma = &topic["recorded"]["sigma"];
        let rms = ["tilt", "heading"].map(|name| figure(&sigma[name]["rms_deg"]));
        medians.chain(rms).collect::<Vec<f64>>()
    };
    let (capture, log) = (against("capture.bin"), against("ximu3.mcap"));
    assert_eq!(capture.len(), 6);
    for (one, other) in capture.iter().zip(&log) {
        // The device sends f32.
        assert!((one - other).abs() < 1e-4, "{capture:?} {log:?}");
    }
}

/// Samples as a maker writes them, and the same in SI.
struct Made {
    name: &'static str,
    text: String,
    samples: Vec<ImuSample>,
    flags: &'static str,
}

fn made() -> Vec<Made> {
    let samples = motion(800);
    let table = |head: &str, row: &dyn Fn(usize, &ImuSample) -> String| {
        let mut text = head.to_owned();
        for (k, sample) in samples.iter().enumerate() {
            writeln!(text, "{}", row(k, sample)).unwrap();
        }
        text
    };
    let joined = |separator: &str, numbers: &[f64]| {
        let each: Vec<String> = numbers.iter().map(|n| format!("{n:?}")).collect();
        each.join(separator)
    };
    let in_degrees: Vec<ImuSample> = samples
        .iter()
        .map(|sample| ImuSample {
            gyro: sample.gyro.map(|w| w.to_degrees().to_radians()),
            accel: sample.accel.map(|f| f / G * G),
            ..*sample
        })
        .collect();
    vec![
        Made {
            name: "euroc.csv",
            text: table(
                "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n",
                &|_, s| format!("{},{}", s.stamp, joined(",", &[s.gyro, s.accel].concat())),
            ),
            samples: samples.clone(),
            flags: "--aid gravity",
        },
        Made {
            name: "degrees.tsv",
            text: table(
                "time_us\tGyro X (deg/s)\tGyro Y (deg/s)\tGyro Z (deg/s)\tAcc X (g)\tAcc Y (g)\tAcc Z (g)\n",
                &|_, s| {
                    let numbers = [s.gyro.map(f64::to_degrees), s.accel.map(|f| f / G)].concat();
                    format!("{}\t{}", s.stamp / 1000, joined("\t", &numbers))
                },
            ),
            samples: in_degrees,
            flags: "--aid gravity",
        },
        Made {
            name: "Gyroscope.csv",
            text: table("time,seconds_elapsed,z,y,x\n", &|k, s| {
                let [x, y, z] = s.gyro;
                format!("{},{}.{:02},{z:?},{y:?},{x:?}", s.stamp, k / 100, k % 100)
            }),
            samples: samples.clone(),
            flags: "--aid none",
        },
        Made {
            name: "phyphox.txt",
            text: table(
                "\"Time (s)\";\"Gyroscope x (rad/s)\";\"Gyroscope y (rad/s)\";\"Gyroscope z (rad/s)\"\n",
                &|k, s| {
                    let secs = format!(
                        "{}.{:02}E0",
                        START / 1_000_000_000 + k as i64 / 100,
                        k % 100
                    );
                    format!("{secs};{}", joined(";", &s.gyro)).replace('.', ",")
                },
            ),
            samples: samples.clone(),
            flags: "--aid none",
        },
    ]
}

#[test]
fn each_dialect_gives_the_attitude_of_an_mcap_of_the_same_samples_to_the_bit() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for made in made() {
        written(at, "same.mcap", &made.samples);
        std::fs::write(at.join(made.name), &made.text).unwrap();
        let run = |arguments: &str, stdin| {
            attitudes(
                at,
                &format!("{arguments} --sample-kind rate {}", made.flags),
                stdin,
            )
        };
        let (expected, stamps, _) = run("same.mcap", Vec::new());
        let (rows, own, said) = run(made.name, Vec::new());
        assert_eq!((rows.len(), &own), (800, &stamps), "{}", made.name);
        assert!(rows == expected, "{}", made.name);
        // By the flag that it prints; on standard input, where a name tells nothing.
        let flag = said
            .split("--columns '")
            .nth(1)
            .unwrap()
            .split('\'')
            .next()
            .unwrap();
        let columns: String = flag.replace(' ', "\u{1}");
        for (name, stdin) in [(made.name, String::new()), ("-", made.text.clone())] {
            let mut arguments: Vec<String> = format!(
                "replay {name} --sample-kind rate {} -o out.csv --force --columns",
                made.flags
            )
            .split(' ')
            .map(str::to_owned)
            .collect();
            arguments.push(columns.replace('\u{1}', " "));
            let ran = assert_cmd::Command::cargo_bin("strapd")
                .unwrap()
                .current_dir(at)
                .args(&arguments)
                .write_stdin(stdin)
                .output()
                .unwrap();
            assert!(ran.status.success(), "{}: {ran:?}", made.name);
            let text = std::fs::read_to_string(at.join("out.csv")).unwrap();
            let again: Vec<&str> = text
                .lines()
                .skip(1)
                .map(|row| row.split_once(',').unwrap().1)
                .collect();
            assert!(
                again == expected,
                "{} by {name} --columns {flag}",
                made.name
            );
        }
    }
}

#[test]
fn every_command_takes_a_table() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let made = &made()[1];
    std::fs::write(at.join("t.tsv"), &made.text).unwrap();
    written(at, "m.mcap", &made.samples);
    let info = strapd(at, "info t.tsv");
    for words in [
        "800 samples of 1 sensors; CSV",
        "read as --columns 'gyro=Gyro X (deg/s)",
        "rad/s",
        "gravity",
    ] {
        assert!(
            info.done().out.contains(words),
            "`{words}` is missing: {info:?}"
        );
    }
    assert!(
        !info.out.contains("--gyro-unit"),
        "the unit is stated: {info:?}"
    );
    let piped = strapd_fed(at, "info - --json", made.text.clone());
    let said = piped.done().json()["read_as"].to_string();
    assert!(said.contains("stamp=time_us:us"), "{said}");
    let checked = strapd(at, "check t.tsv --json");
    assert!(matches!(checked.code, Some(0 | 3)), "{checked:?}");
    assert!(!checked.out.contains("unit"), "{checked:?}");
    strapd(at, "report t.tsv -o r.html").done();
    strapd(at, "allan t.tsv").done();
    // What is cut from it is it, in SI and under strapd's own names.
    let (expected, ..) = attitudes(at, "m.mcap --aid gravity --sample-kind rate", Vec::new());
    for format in ["csv", "ndjson"] {
        let cat = strapd(at, &format!("cat t.tsv --format {format}"));
        let (rows, ..) = attitudes(
            at,
            "- --aid gravity --sample-kind rate",
            cat.done().out.clone().into_bytes(),
        );
        assert!(rows == expected, "by cat --format {format}");
    }
    let (cut, table) = (
        strapd(at, "cat m.mcap --format csv"),
        strapd(at, "cat t.tsv --format csv"),
    );
    // The log states what its samples mean.
    assert_eq!(cut.done().out.replace(",rate\n", ",\n"), table.done().out);
}

#[test]
fn rows_that_are_none_are_counted_and_the_first_is_shown_with_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let made = &made()[0];
    let mut rows: Vec<String> = made.text.lines().map(str::to_owned).collect();
    rows[1] = "not,a,row".to_owned();
    rows[300].push_str(",7");
    rows[301] = rows[301].replacen('.', "x", 1);
    std::fs::write(at.join("bad.csv"), rows.join("\n")).unwrap();
    for arguments in ["replay bad.csv -o null:", "replay - -o null:"] {
        let ran = strapd_fed(at, arguments, rows.join("\n"));
        assert_eq!(ran.code, Some(3), "{ran:?}");
        for words in ["3 undecodable", "line 2: 3 cells, but 7 columns"] {
            assert!(ran.out.contains(words), "`{words}` is missing: {ran:?}");
        }
    }
    let checked = strapd(at, "check bad.csv");
    assert_eq!(checked.code, Some(3), "{checked:?}");
    assert!(checked.out.contains("3"), "{checked:?}");
    // Stamps twice and in disorder are the conditioner's, as in any log.
    let mut rows: Vec<&str> = made.text.lines().collect();
    rows.swap(100, 101);
    rows.insert(200, rows[200]);
    let ran = strapd_fed(at, "replay - -o null:", rows.join("\n"));
    assert!(
        ran.out.contains("1 put back in order") || ran.out.contains("reordered"),
        "{ran:?}"
    );
    assert!(
        ran.out.contains("repeat") || ran.out.contains("duplicate"),
        "{ran:?}"
    );
}

#[test]
fn what_is_missing_is_asked_for_and_a_flag_that_says_nothing_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let rows: String = (0..50).map(|k| format!("{k},0.1,0.2,0.3\n")).collect();
    std::fs::write(
        at.join("timeless.csv"),
        format!("n,gyro_x,gyro_y,gyro_z\n{rows}"),
    )
    .unwrap();
    strapd(at, "replay timeless.csv -o null:").refused(
        1,
        &[
            "neither the message stamps nor the log time advance",
            "--time index --rate-hz",
            "--columns stamp=",
        ],
    );
    let ran = strapd(
        at,
        "replay timeless.csv --time index --rate-hz 100 -o null:",
    );
    let said = &ran.done().out;
    assert!(said.contains("0.490 s at 100.00 Hz"), "{said}");
    assert!(
        said.contains("the unit of the rates is not stated"),
        "{said}"
    );
    let ran = strapd(
        at,
        "replay timeless.csv --columns stamp=n:ms --gyro-unit deg -o null:",
    );
    assert!(!ran.done().out.contains("is not stated"), "{ran:?}");
    written(at, "m.mcap", &motion(20));
    std::fs::write(at.join("l.ndjson"), "{\"stamp_s\":1,\"gyro\":[1,2,3]}\n").unwrap();
    for log in ["m.mcap", "l.ndjson"] {
        for flag in ["--columns gyro=1:2:3", "--delimiter tab"] {
            for command in ["replay -o null:", "info", "check", "cat"] {
                strapd(at, &format!("{command} {log} {flag}"))
                    .refused(1, &[log, "are for tables of text"]);
            }
        }
    }
    strapd(at, "replay timeless.csv --columns gyro=a -o null:")
        .refused(2, &["--columns", "made of 3 columns"]);
    strapd(at, "info timeless.csv --delimiter 12").refused(2, &["--delimiter", "one of tab"]);
    strapd(at, "replay timeless.csv --field gyro=x -o null:")
        .refused(1, &["--field", "--columns gyro="]);
    strapd(at, "info nothing.csv").refused(1, &["cannot open"]);
    // Named for another format than it holds, and by no name at all.
    std::fs::copy(at.join("timeless.csv"), at.join("x.mcap")).unwrap();
    let info = strapd(at, "info x.mcap");
    assert!(
        info.done().err.contains("is called MCAP, but holds CSV"),
        "{info:?}"
    );
}

/// A table of two sensors at 100 Hz, the second of which turns the other way.
fn of_two(column: &str, names: [&str; 2]) -> String {
    let mut text = format!("time_ms,{column},gyro_x[rad/s],gyro_y[rad/s],gyro_z[rad/s]\n");
    for n in 0..400 {
        for (name, sign) in names.iter().zip([1.0, -1.0]) {
            let rate = sign * (f64::from(n) * 0.01).sin();
            writeln!(text, "{},{name},{rate},{sign},0.1", n * 10).unwrap();
        }
    }
    text
}

#[test]
fn of_two_sensors_in_a_table_the_first_is_taken_and_the_other_is_named_with_what_takes_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let columns = [
        ("device", ["left", "right"]),
        ("imu_id", ["0", "1"]),
        ("MAC", ["d4:22:cd:00:00:01", "d4:22:cd:00:00:02"]),
        ("instance", ["3", "7"]),
    ];
    for (column, [first, second]) in columns {
        std::fs::write(at.join("two.csv"), of_two(column, [first, second])).unwrap();
        let ran = strapd(at, "replay two.csv -o out.csv --force --json");
        let topic = ran.json()["topics"][0].clone();
        assert_eq!(
            (&topic["topic"], &topic["samples"]["used"]),
            (&first.into(), &400.into())
        );
        let said = topic["findings"].to_string();
        for part in [
            "several-topics",
            &format!("column {column}"),
            &format!("left out {second} (400 samples)"),
            &format!("--topic {second}"),
        ] {
            assert!(said.contains(part), "{part}: {said}");
        }
        let (taken, _, _) = attitudes(at, "two.csv", Vec::new());
        let alone = format!("two.csv --where {column}={first}");
        assert_eq!(attitudes(at, &alone, Vec::new()).0, taken, "{column}");
        let other = attitudes(at, &format!("two.csv --topic {second}"), Vec::new());
        assert_ne!(other.0, taken);
        let info = strapd(at, "info two.csv");
        assert!(
            info.out.contains(first) && info.out.contains(second),
            "{info:?}"
        );
        let listed = strapd(at, "cat two.csv");
        assert!(
            listed.err.contains(&format!("left out {second}")),
            "{listed:?}"
        );
    }
}

#[test]
fn rows_of_another_value_are_left_out_and_counted_from_a_file_and_a_pipe() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let text = of_two("body", ["1", "2"]);
    std::fs::write(at.join("two.csv"), &text).unwrap();
    let lines = text.lines().enumerate();
    let alone: String = lines
        .filter(|(n, _)| n % 2 == 0)
        .map(|(_, row)| format!("{row}\n"))
        .collect();
    // The header, and every second row behind it.
    let alone = format!(
        "{}\n{}",
        text.lines().next().unwrap(),
        alone.split_once('\n').unwrap().1
    );
    std::fs::write(at.join("one.csv"), alone).unwrap();
    let (expected, ..) = attitudes(at, "one.csv", Vec::new());
    for source in ["two.csv", "-"] {
        let flags = format!("{source} --where body=2");
        let (rows, _, said) = attitudes(at, &flags, text.clone().into_bytes());
        assert_eq!(rows, expected, "{source}");
        assert!(said.contains("400 of 800 rows were left out"), "{said}");
    }
    for (flags, words) in [
        (
            "--where colour=red",
            &["no column `colour`", "time_ms, body, gyro_x"][..],
        ),
        (
            "--where body=3",
            &["none of 800 rows", "they have body 1, 2"],
        ),
    ] {
        for source in ["two.csv", "-"] {
            let command = format!("replay {source} -o null: {flags}");
            strapd_fed(at, &command, text.clone()).refused(1, words);
        }
    }
    strapd(at, "replay two.csv -o null: --where body").refused(2, &["no COLUMN=VALUE"]);
}
