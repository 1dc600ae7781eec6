//! Inputs that are none, each with the words a user needs.

use super::{bench, strapd, strapd_fed};
use crate::made_logs::{PACKINGS, bytes, logged, motion};
use crate::replays::fixture;
use crate::shared_data::shared;

#[test]
fn what_is_not_there_a_directory_empty_or_no_mcap_is_called_so_by_every_command() {
    let dir = bench();
    let at = dir.path();
    std::fs::create_dir(at.join("folder")).unwrap();
    std::fs::write(at.join("empty.mcap"), b"").unwrap();
    std::fs::write(at.join("text.mcap"), b"timestamp,x,y,z\n").unwrap();
    std::fs::write(at.join("short.mcap"), b"\x89MCAP").unwrap();
    for command in ["replay -o out.csv", "replay", "info", "cat"] {
        let on = |file: &str| strapd(at, &format!("{command} {file}"));
        on("nowhere.mcap").refused(1, &["nowhere.mcap", "cannot open", "No such file"]);
        on("folder").refused(
            1,
            &[
                "folder",
                "a folder without a recording",
                "help: name a file",
            ],
        );
        on("empty.mcap").refused(1, &["empty.mcap", "is empty"]);
        on("text.mcap").refused(
            1,
            &["text.mcap", "is a table of text", "help: call it .csv"],
        );
        on("short.mcap").refused(1, &["short.mcap", "no format that is read"]);
    }
    assert!(!at.join("out.csv").exists());
    strapd(at, "compare nowhere.mcap log.mcap").refused(1, &["nowhere.mcap", "cannot open"]);
}

#[test]
fn a_log_of_another_format_is_called_by_its_name_with_the_command_that_makes_it_readable() {
    let dir = bench();
    let at = dir.path();
    let cases: [(&str, &[u8], &str, &str); 6] = [
        (
            "clip.mp4",
            b"\0\0\0\x14ftypmp42\0\0\0\0mp41",
            "a video (MP4, MOV)",
            "Gyroflow exports",
        ),
        (
            "log.gz",
            &[0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3],
            "a file packed with gzip",
            "gunzip -c log.gz",
        ),
        (
            "00000042.BIN",
            b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n",
            "ArduPilot DataFlash",
            "mavlogdump.py --types IMU --format json 00000042.BIN",
        ),
        (
            "phone.csv",
            b"\xff\xfet\0i\0m\0e\0",
            "text in UTF-16",
            "iconv -f UTF-16 -t UTF-8 phone.csv",
        ),
        (
            "a b.mat",
            b"MATLAB 5.0 MAT-file, Platform: GLNXA64",
            "a MATLAB file",
            "scipy.io.loadmat",
        ),
        (
            "log.mcap",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
            "a pointer of Git LFS",
            "git lfs pull",
        ),
    ];
    for (file, bytes, name, way_in) in cases {
        std::fs::write(at.join(file), bytes).unwrap();
        for command in ["replay", "info", "cat", "check"] {
            let run = std::process::Command::new(env!("CARGO_BIN_EXE_strapd"))
                .args([command, file])
                .current_dir(at)
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&run.stderr).into_owned();
            assert_eq!(run.status.code(), Some(1), "{command} {file}: {said}");
            for words in [file, name, "help: ", way_in] {
                assert!(said.contains(words), "{command} {file}: {said}");
            }
        }
        if !name.contains("Git LFS") {
            strapd_fed(at, "replay - -o null:", bytes.to_vec())
                .refused(1, &["standard input", name, "help: "]);
        }
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read_says_why() {
    use std::os::unix::fs::PermissionsExt;
    let dir = bench();
    let log = dir.path().join("log.mcap");
    std::fs::set_permissions(&log, std::fs::Permissions::from_mode(0o000)).unwrap();
    if std::fs::File::open(&log).is_ok() {
        eprintln!("SKIPPED: this user may read everything");
        return;
    }
    strapd(dir.path(), "replay log.mcap").refused(1, &["log.mcap", "Permission denied"]);
}

#[test]
fn standard_input_that_is_empty_or_no_log_is_called_so() {
    let dir = bench();
    let fed = |bytes: &[u8]| strapd_fed(dir.path(), "replay - -o null:", bytes.to_vec());
    fed(b"").refused(1, &["standard input", "empty"]);
    fed(b"hello\nworld\n").refused(
        1,
        &["standard input", "line 1", "help: one JSON object per line"],
    );
    fed(b"{\"class\":\"STATUS\"}\n").refused(1, &["standard input", "no line carries a body rate"]);
    fed(&[0xff; 3000]).refused(1, &["standard input", "line 1"]);
    // One line without end.
    fed(&vec![b'7'; 3 << 20]).refused(1, &["standard input", "line 1"]);
}

#[test]
fn of_two_sensors_in_lines_that_come_once_the_first_is_taken_and_the_other_named() {
    let dir = bench();
    let line = |id: &str, n: u64| {
        format!(
            "{{\"class\":\"RATE\",\"id\":\"{id}\",\"stamp\":{{\"sec\":{n},\"nsec\":0}},\"gyro\":[0.1,0,0]}}\n"
        )
    };
    let text = line("left", 1) + &line("right", 1) + &line("left", 2);
    let at = dir.path();
    for (flags, sensor, total) in [("", "left", 2), ("--topic right", "right", 1)] {
        let command = format!("replay - -o null: --json {flags}");
        let one = strapd_fed(at, &command, text.clone().into_bytes());
        let (topic, other) = (one.json()["topics"][0].clone(), one.json().to_string());
        assert_eq!(topic["topic"], sensor, "{one:?}");
        assert_eq!(topic["samples"]["total"], total, "{one:?}");
        assert!(other.contains("several-topics"), "{one:?}");
    }
    // Of a file all are known: none is taken for the one that is meant.
    std::fs::write(at.join("two.ndjson"), text).unwrap();
    strapd(at, "replay two.ndjson -o null:").refused(
        1,
        &["left  RATE [NDJSON]  2 messages", "right  RATE", "--topic"],
    );
}

#[test]
fn attitudes_beside_the_samples_of_a_sensor_are_no_other_sensor() {
    let dir = bench();
    let at = dir.path();
    let line = |n: u64| {
        format!(
            "{{\"id\":\"a\",\"stamp\":{{\"sec\":{n},\"nsec\":0}},\"gyro\":[0.1,0,0]}}\n\
             {{\"class\":\"ATT\",\"id\":\"a\",\"stamp\":{{\"sec\":{n},\"nsec\":0}},\"q\":{{\"w\":1,\"x\":0,\"y\":0,\"z\":0}},\"rate\":[0.1,0,0]}}\n\
             {{\"stamp\":{{\"sec\":{n},\"nsec\":5}},\"orientation\":{{\"w\":1,\"x\":0,\"y\":0,\"z\":0}}}}\n"
        )
    };
    let text: String = (1..40).map(line).collect();
    std::fs::write(at.join("mixed.ndjson"), &text).unwrap();
    let piped = strapd_fed(at, "replay - -o null: --json", text.into_bytes());
    for ran in [piped, strapd(at, "replay mixed.ndjson -o null: --json")] {
        let topic = ran.done().json()["topics"][0].clone();
        assert_eq!(topic["topic"], "a", "{ran:?}");
        assert_eq!(topic["samples"]["total"], 39, "{ran:?}");
        let warnings = topic["warnings"].to_string();
        assert!(!warnings.contains("taken"), "{ran:?}");
    }
}

#[test]
fn several_imu_topics_are_listed_and_each_can_be_taken() {
    let dir = bench();
    let at = dir.path();
    let samples = motion(100);
    let mut both = logged("/left/imu", &samples);
    both.extend(logged("/right/imu", &samples));
    both.sort_by_key(|m| m.log_time);
    std::fs::write(at.join("two.mcap"), bytes(PACKINGS[2].1, 4096, &both)).unwrap();
    for command in ["replay", "cat"] {
        strapd(at, &format!("{command} two.mcap")).refused(
            1,
            &["/left/imu ", "/right/imu ", "100 messages", "--topic NAME"],
        );
    }
    let one = strapd(at, "replay two.mcap --topic /right/imu --json");
    assert_eq!(one.done().json()["topics"][0]["topic"], "/right/imu");
    let all = strapd(at, "replay two.mcap --topic all --json -o all.ndjson");
    let topics = all.done().json()["topics"].clone();
    assert_eq!(topics.as_array().unwrap().len(), 2, "{topics}");
    let text = std::fs::read_to_string(at.join("all.ndjson")).unwrap();
    for id in ["/left/imu", "/right/imu"] {
        assert_eq!(text.matches(&format!("\"id\":\"{id}\"")).count(), 100);
    }
}

#[test]
fn a_wrong_field_or_topic_lists_what_would_do() {
    let dir = bench();
    let at = dir.path();
    strapd(at, "replay log.mcap --field gyro=gyroscope").refused(
        1,
        &[
            "/imu/data_raw",
            "`gyroscope`",
            "angular_velocity",
            "--field gyro=",
        ],
    );
    strapd(at, "replay log.mcap --field gyroscope").refused(2, &["--field", "gyroscope"]);
    strapd(at, "replay log.mcap --field speed=a.b").refused(2, &["--field", "speed"]);
    strapd(at, "replay log.mcap --topic /imu").refused(1, &["no topic `/imu`", "/imu/data_raw"]);
    strapd(at, "info log.mcap --topic /imu").refused(1, &["no topic `/imu`", "/imu/data_raw"]);
    // The right one is taken, though it is not the usual one.
    let accel = strapd(
        at,
        "replay log.mcap --field gyro=linear_acceleration --json",
    );
    assert_eq!(accel.done().json()["topics"][0]["samples"]["used"], 300);
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn an_encoding_nobody_knows_is_an_error_that_names_it() {
    let Some(path) = shared("logs/native/rosbag2_wrong_format.mcap") else {
        return;
    };
    let dir = bench();
    strapd(dir.path(), &format!("replay {}", path.display()))
        .refused(1, &["/test_topic", "wrong_format"]);
}

#[test]
fn a_log_that_has_lost_samples_ends_with_3_and_says_what_even_when_quiet() {
    let dir = bench();
    let log = fixture("faults.mcap");
    let log = log.display();
    let ran = strapd(dir.path(), &format!("replay {log} -o null:"));
    assert_eq!(ran.code, Some(3), "{ran:?}");
    for word in [
        "8 of 602 samples",
        "2 not finite",
        "1 huge",
        "1 undecodable",
        "1 held",
    ] {
        assert!(ran.out.contains(word), "`{word}` is missing: {}", ran.out);
    }
    // The stamp that is zero is no time: "at -1700000000 s" helps nobody.
    assert!(!ran.out.contains("at -17"), "{}", ran.out);

    let quiet = strapd(dir.path(), &format!("replay {log} -o null: --quiet"));
    assert_eq!((quiet.code, quiet.out.as_str()), (Some(3), ""), "{quiet:?}");
    for word in ["lost 8 of 602 samples", "1 gaps were not integrated over"] {
        assert!(
            quiet.err.contains(word),
            "`{word}` is missing: {}",
            quiet.err
        );
    }
}

#[test]
fn one_bad_log_of_several_does_not_stop_the_others() {
    let dir = bench();
    let at = dir.path();
    std::fs::copy(at.join("log.mcap"), at.join("more.mcap")).unwrap();
    let ran = strapd(
        at,
        "replay log.mcap nowhere.mcap more.mcap -o {stem}.csv --json",
    );
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(
        ran.err.contains("error: nowhere.mcap: cannot open"),
        "{ran:?}"
    );
    let json: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    let sources: Vec<_> = json
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["source"].clone())
        .collect();
    assert_eq!(sources, ["log.mcap", "more.mcap"]);
    assert!(at.join("log.csv").exists() && at.join("more.csv").exists());
}

#[test]
fn shards_take_every_log_once() {
    let dir = bench();
    let at = dir.path();
    let logs: Vec<String> = (0..5).map(|k| format!("log{k}.mcap")).collect();
    for log in &logs {
        std::fs::copy(at.join("log.mcap"), at.join(log)).unwrap();
    }
    std::fs::create_dir(at.join("out")).unwrap();
    let list = logs.join(" ");
    let mut taken = Vec::new();
    for shard in 0..3 {
        let ran = strapd(
            at,
            &format!("replay {list} -o out/ --shard {shard}/3 --json"),
        );
        for summary in ran.done().json().as_array().unwrap() {
            taken.push(summary["source"].as_str().unwrap().to_owned());
        }
    }
    taken.sort();
    assert_eq!(taken, logs);
    assert_eq!(super::names(&at.join("out")).len(), 5);
}

#[test]
fn of_samples_and_the_attitude_made_of_them_the_samples_are_taken() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let made = strapd(dir, "simulate top --duration 2 -q -o top.mcap");
    assert_eq!(made.code, Some(0), "{made:?}");
    // The input beside the output, as in a recording of the daemon.
    let ran = strapd(dir, "replay top.mcap -q -o both.mcap --copy-input");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let again = strapd(dir, "replay both.mcap -o again.csv");
    assert_eq!(again.code, Some(0), "{again:?}");
    assert!(again.out.contains("/imu/data_raw"), "{again:?}");
    // Nobody is led to integrate what was integrated, and `compare` knows which of the two is strapd's.
    assert!(!again.out.contains("could be taken too"), "{again:?}");
    let compared = strapd(dir, "compare both.mcap top.mcap");
    assert!(compared.out.contains("both.mcap /imu/data"), "{compared:?}");
    let looked = strapd(dir, "info both.mcap");
    assert!(!looked.out.contains("--topic /imu/data\n"), "{looked:?}");
    strapd(dir, "replay top.mcap -q -o first.csv");
    let read = |name: &str| std::fs::read_to_string(dir.join(name)).unwrap();
    assert_eq!(read("first.csv"), read("again.csv"));
    // Without the input it is the output that is taken.
    strapd(dir, "replay top.mcap -q -o alone.mcap");
    let alone = strapd(dir, "replay alone.mcap -o alone.csv");
    assert_eq!(alone.code, Some(0), "{alone:?}");
}
