//! Account of a run: text, `--json`, `--progress json`, `info`, `compare`, `cat`.

use super::{bench, strapd};
use crate::replays::fixture;

#[test]
fn the_summary_in_words_has_every_line_a_user_looks_for() {
    let dir = bench();
    let ran = strapd(dir.path(), "replay log.mcap -o a.mcap");
    ran.done();
    assert_eq!(ran.err, "", "nothing to warn of");
    for words in [
        "log.mcap  /imu/data_raw  sensor_msgs/msg/Imu [cdr]",
        "  samples  300 in, 300 used; 2.990 s at 100.00 Hz, header clock",
        "  method   auto",
        "  frames   input flu -> body flu -> world start; initial attitude: identity",
        "  bias     none removed",
        "  turned   ",
        "  final    roll ",
        "  sigma    ",
        "  numeric  integration error at most about ",
        "  gaps     none",
        "  lost     nothing",
        "  wrote    a.mcap",
        "  took     ",
    ] {
        assert!(
            ran.out.contains(words),
            "`{words}` is missing:\n{}",
            ran.out
        );
    }
}

#[test]
fn a_run_that_was_served_says_where_and_one_that_was_kept_nowhere_says_how() {
    let dir = bench();
    let served = strapd(dir.path(), "replay log.mcap -o tcp-listen://127.0.0.1:0");
    assert_eq!(served.code, Some(0), "{}", served.err);
    assert!(
        served.out.contains("  served   tcp-listen://127.0.0.1:0"),
        "{}",
        served.out
    );
    assert!(!served.out.contains("wrote"), "{}", served.out);
    let kept_nowhere = strapd(dir.path(), "replay log.mcap").done().out.clone();
    assert!(
        kept_nowhere.contains("  wrote    nothing: add -o "),
        "{kept_nowhere}"
    );
}

#[test]
fn the_summary_as_json_is_one_object_with_the_same_numbers() {
    let dir = bench();
    let ran = strapd(dir.path(), "replay log.mcap -o a.mcap -o a.ndjson --json");
    let json = ran.done().json();
    assert_eq!(json["source"], "log.mcap");
    assert_eq!(json["lossy"], false);
    assert_eq!(json["file_losses"], 0);
    let topic = &json["topics"][0];
    assert_eq!(topic["samples"]["total"], 300);
    assert_eq!(topic["samples"]["by_verdict"]["accepted"], 300);
    assert_eq!(topic["written"], 300);
    assert_eq!(topic["output_topic"], "/imu/data");
    assert_eq!(topic["sample_kind"], "rate");
    assert_eq!(topic["clock"], "header");
    // 299 steps of exactly 10 ms.
    assert!((topic["duration_s"].as_f64().unwrap() - 2.99).abs() < 1e-9);
    assert!((topic["rate_hz"].as_f64().unwrap() - 100.0).abs() < 1e-9);
    // The last line of the output is the final attitude.
    let text = std::fs::read_to_string(dir.path().join("a.ndjson")).unwrap();
    let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(topic["final"]["q"], last["q"]);
    for (k, output) in json["outputs"].as_array().unwrap().iter().enumerate() {
        let name = output["name"].as_str().unwrap();
        let bytes = std::fs::metadata(dir.path().join(name)).unwrap().len();
        assert_eq!(output["bytes"], bytes, "{name}");
        // An Imu and a transform per attitude; a line.
        assert_eq!(output["messages"], [600, 300][k], "{name}");
    }
}

#[test]
fn several_logs_are_an_array_and_a_shard_without_any_an_empty_one() {
    let dir = bench();
    std::fs::copy(dir.path().join("log.mcap"), dir.path().join("b.mcap")).unwrap();
    let both = strapd(dir.path(), "replay log.mcap b.mcap --json");
    assert_eq!(both.done().json().as_array().unwrap().len(), 2);
    let none = strapd(dir.path(), "replay log.mcap --shard 1/2 --json");
    assert_eq!(none.done().json().as_array().unwrap().len(), 0);
}

#[test]
fn progress_as_json_is_one_object_a_line_on_stderr() {
    let dir = bench();
    let ran = strapd(
        dir.path(),
        "replay log.mcap -o null: --quiet --progress json",
    );
    ran.done();
    assert_eq!(ran.out, "");
    assert!(
        !ran.err.is_empty(),
        "at least one line, however short the run"
    );
    for line in ran.err.lines() {
        let object: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(object["class"], "PROGRESS");
        let fraction = object["fraction"].as_f64().unwrap();
        assert!((0.0..=1.0).contains(&fraction), "{line}");
        assert!(object["samples"].as_u64().unwrap() <= 300, "{line}");
    }
}

#[test]
fn quiet_says_nothing_of_a_run_that_went_well() {
    let dir = bench();
    let ran = strapd(dir.path(), "replay log.mcap -o a.csv --quiet");
    ran.done();
    assert_eq!((ran.out.as_str(), ran.err.as_str()), ("", ""));
}

#[test]
fn data_on_stdout_is_data_alone() {
    let dir = bench();
    let ran = strapd(dir.path(), "replay log.mcap -o -");
    ran.done();
    assert_eq!(ran.out.lines().count(), 300);
    for line in ran.out.lines() {
        let object: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(object["class"], "ATT");
    }
    assert!(ran.err.contains("300 in, 300 used"), "{}", ran.err);
}

#[test]
fn a_warning_and_what_helps_stand_behind_their_label() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = crate::made_logs::motion(100);
    for sample in &mut samples {
        sample.stamp = 0;
    }
    let mut messages = crate::made_logs::logged("/imu", &samples);
    for (k, message) in messages.iter_mut().enumerate() {
        message.log_time = 1_000_000_000 + k as u64 * 10_000_000;
    }
    let bytes = crate::made_logs::bytes(None, 4096, &messages);
    std::fs::write(dir.path().join("zero.mcap"), bytes).unwrap();
    let ran = strapd(dir.path(), "replay zero.mcap");
    ran.done();
    let lines: Vec<&str> = ran.out.lines().collect();
    let warning = lines
        .iter()
        .find(|l| l.contains("header stamps are 0"))
        .unwrap();
    assert!(
        warning.starts_with("  warning  ") && warning.contains("; --time log makes this explicit"),
        "{}",
        ran.out
    );
}

#[test]
fn info_names_the_topic_its_rate_and_the_next_command() {
    let dir = bench();
    let ran = strapd(dir.path(), "info log.mcap");
    ran.done();
    for words in [
        "/imu/data_raw  sensor_msgs/msg/Imu [cdr]",
        "300 samples",
        "100.00 Hz",
        "frame imu_link",
        "strapd replay log.mcap -o attitude.mcap",
    ] {
        assert!(
            ran.out.contains(words),
            "`{words}` is missing:\n{}",
            ran.out
        );
    }
    let json = strapd(dir.path(), "info log.mcap --json").done().json();
    assert!(json.is_object(), "{json}");
    // The command it proposes is one that works.
    let next = ran.out.lines().find(|l| l.starts_with("next")).unwrap();
    let command = next.trim_start_matches("next").trim();
    let arguments = command.strip_prefix("strapd ").unwrap();
    strapd(dir.path(), arguments).done();
}

#[test]
fn compare_measures_what_was_put_in_and_a_limit_decides_the_exit_code() {
    let dir = bench();
    let at = dir.path();
    strapd(at, "replay log.mcap -o a.csv").done();
    // The same attitudes, turned by 3 degrees about the vertical of the world.
    strapd(
        at,
        "replay log.mcap -o b.ndjson --world enu --init rpy=0,0,3",
    )
    .done();
    let apart = |align: &str| {
        let ran = strapd(
            at,
            &format!("compare b.ndjson a.csv --json --align {align}"),
        );
        ran.done().json()["total"]["max_deg"].as_f64().unwrap()
    };
    // 3 degrees by construction; the numbers in the files read back to the last bit, and the
    // angle of a quaternion near zero loses half of them: 1e-7 deg.
    assert!((apart("none") - 3.0).abs() < 1e-6, "{}", apart("none"));
    assert!(apart("first") < 1e-5, "{}", apart("first"));
    assert!(apart("heading") < 1e-5, "{}", apart("heading"));
    let limited = |limit: &str| strapd(at, &format!("compare b.ndjson a.csv --align none {limit}"));
    limited("--max-angle 3.1").done();
    let over = limited("--max-angle 2.9");
    assert_eq!(over.code, Some(4), "{over:?}");
    assert!(over.err.contains("--max-angle"), "{over:?}");
}

#[test]
fn an_output_compares_with_its_own_input_in_one_command() {
    let dir = bench();
    let log = fixture("xsens_mti.mcap");
    let log = log.display();
    strapd(
        dir.path(),
        &format!("replay {log} -o a.mcap --sample-kind average"),
    )
    .done();
    let ran = strapd(dir.path(), &format!("compare a.mcap {log} --json"));
    let relative = ran.done().json()["relative_1s"]["median_deg"]
        .as_f64()
        .unwrap();
    // The gate of the recording: 1.390 in `logs/README.md`, 1.40 in issue 2.
    assert!((0.7..=1.40).contains(&relative), "{relative} deg");
}

#[test]
fn cat_prints_every_sample_in_three_forms_and_stops_where_told() {
    let dir = bench();
    let at = dir.path();
    let lines = strapd(at, "cat log.mcap");
    assert_eq!(lines.done().out.lines().count(), 300);
    let csv = strapd(at, "cat log.mcap --format csv");
    assert_eq!(csv.done().out.lines().count(), 301);
    let table = strapd(at, "cat log.mcap --format table -n 5");
    assert_eq!(table.done().out.lines().count(), 6);
    assert_eq!(strapd(at, "cat log.mcap -n 0").done().out, "");
    let first: serde_json::Value = serde_json::from_str(lines.out.lines().next().unwrap()).unwrap();
    let sample = crate::made_logs::motion(1)[0];
    assert_eq!(first["gyro"][2].as_f64(), Some(sample.gyro[2]));
    assert_eq!(first["stamp"]["sec"], 1_700_000_000);
}

#[test]
fn every_figure_of_noise_is_in_the_sigma_of_the_summary() {
    let dir = bench();
    let ran = |noise: &str| {
        let command = format!("replay log.mcap -o null: --json --noise {noise}");
        let json = strapd(dir.path(), &command).done().json();
        let topic = &json["topics"][0];
        let sigma = topic["final"]["sigma_deg"].as_array().unwrap();
        let squared: f64 = sigma.iter().map(|s| s.as_f64().unwrap().powi(2)).sum();
        (squared, topic["drift_deg_per_h"].as_f64().unwrap())
    };
    // However the body turned, the sum of the variances is that of the start.
    let (squared, drift) = ran("arw=0,initial=0.1/0.2/0.2");
    assert!((squared.sqrt() - 0.3).abs() < 1e-9, "{squared}");
    assert_eq!(drift, 0.0);
    // A bias that walks from nothing: K sqrt(t) of it after the 2.99 s of the log.
    let rrw = 12_000.0;
    let (squared, drift) = ran("arw=0,rrw=12000");
    let walked = rrw * (2.99f64 / 3600.0).sqrt();
    assert!((drift / walked - 1.0).abs() < 1e-9, "{drift}");
    // At most K^2 t^3 / 3 about each axis, as if it had not turned; it turned by less than one.
    let still = rrw * rrw * (2.99f64 / 3600.0).powi(3);
    assert!(
        squared <= still * (1.0 + 1e-9) && squared > 0.2 * still,
        "{squared} {still}"
    );
    let (_, drift) = ran("arw=0,turn-on-bias=60/0/0,bias-instability=80/0/0");
    // The flicker of an instability B is 1.7 B, and 3 % of a turn-on bias outlive its removal.
    let expected = 60f64.hypot(1.7 * 80.0).hypot(0.03 * 60.0);
    assert!((drift / expected - 1.0).abs() < 1e-9, "{drift}");
    let json = strapd(dir.path(), "replay log.mcap -o null: --json")
        .done()
        .json();
    let error = json["topics"][0]["integration_error_deg"].as_f64().unwrap();
    assert!(error > 0.0 && error < 1.0, "{error}");
    let coarse = strapd(
        dir.path(),
        "replay log.mcap -o null: --json --method dcm-left",
    );
    assert!(coarse.done().json()["topics"][0]["integration_error_deg"].is_null());
}

#[test]
fn a_message_of_zeros_amid_motion_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let mut samples = crate::made_logs::motion(300);
    for n in [100, 200] {
        samples[n].gyro = [0.0; 3];
    }
    crate::made_logs::written(dir.path(), "log.mcap", &samples);
    let ran = strapd(dir.path(), "replay log.mcap -o null:");
    assert!(
        ran.done().out.contains("2 of 300 samples are exactly zero"),
        "{ran:?}"
    );
    // So are a hundred in a row: no body stops, and goes on, within a sample.
    samples[100..200].iter_mut().for_each(|s| s.gyro = [0.0; 3]);
    crate::made_logs::written(dir.path(), "log.mcap", &samples);
    let ran = strapd(dir.path(), "replay log.mcap -o null:");
    assert!(
        ran.done()
            .out
            .contains("101 of 300 samples are exactly zero"),
        "{ran:?}"
    );
    // A body that comes to rest, without noise, is another thing.
    samples[200].gyro = samples[201].gyro;
    for (n, sample) in samples.iter_mut().enumerate() {
        let slow = (n.abs_diff(150) as f64 - 50.0).clamp(0.0, 40.0) / 40.0;
        sample.gyro = sample.gyro.map(|rate| rate * slow);
    }
    crate::made_logs::written(dir.path(), "log.mcap", &samples);
    let ran = strapd(dir.path(), "replay log.mcap -o null:");
    assert!(!ran.done().out.contains("exactly zero"), "{ran:?}");
}

#[test]
fn a_line_that_can_not_be_read_is_named_by_its_line_and_a_failed_read_by_its_byte() {
    let dir = bench();
    std::fs::write(
        dir.path().join("t.ndjson"),
        "{\"class\":\"X\"}\n\n{\"class\":5}\n",
    )
    .unwrap();
    strapd(dir.path(), "replay log.mcap -o a.csv").done();
    strapd(dir.path(), "compare a.csv t.ndjson").refused(1, &["t.ndjson: line 3:"]);
}

#[test]
fn every_command_says_a_finding_in_the_same_words() {
    let dir = bench();
    std::fs::copy(fixture("faults.mcap"), dir.path().join("faults.mcap")).unwrap();
    let said = |line: &str| {
        let ran = strapd(dir.path(), line);
        assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
        serde_json::from_str::<serde_json::Value>(&ran.out).unwrap()
    };
    let found = |list: &serde_json::Value, code: &str| {
        let list = list.as_array().unwrap();
        let of = |f: &&serde_json::Value| f["code"] == code;
        let one = list
            .iter()
            .find(of)
            .unwrap_or_else(|| panic!("{code} in {list:?}"));
        ["severity", "topic", "what", "advice", "flags"].map(|k| one[k].clone())
    };
    let check = said("check faults.mcap --json");
    let info = said("info faults.mcap --json");
    let replay = said("replay faults.mcap -o null: --json");
    let report = said("report faults.mcap -o r.html --json");
    // What a run could not use is missing from it, too: `info` counts what is in the log.
    assert_eq!(
        found(&report["findings"], "missing"),
        found(&check["findings"], "missing")
    );
    for code in ["undecodable", "gyro-absent"] {
        let mut in_check = found(&check["findings"], code);
        assert_eq!(found(&report["findings"], code), in_check);
        // What is about one topic alone needs no name of it.
        in_check[1] = "".into();
        let mut in_info = found(&info["imu"][0]["findings"], code);
        in_info[1] = "".into();
        assert_eq!(in_info, in_check);
    }
    assert_eq!(
        found(&replay["topics"][0]["findings"], "gyro-absent"),
        found(&check["findings"], "gyro-absent")
    );
    let line = "1 of 602 samples mark their gyro as absent (covariance -1); some drivers set the mark wrongly; \
                if the rates are good, use them: --ignore-covariance-flag";
    for command in ["info faults.mcap", "replay faults.mcap -o null:"] {
        let ran = strapd(dir.path(), command);
        assert!(ran.out.contains(line), "{ran:?}");
    }
}

/// Standard output of a command as a user types it, without what tests add.
fn typed(dir: &std::path::Path, arguments: &str) -> String {
    let output = std::process::Command::new(assert_cmd::cargo::cargo_bin("strapd"))
        .current_dir(dir)
        .env_remove("STRAPD_LOG")
        .env("STRAPD_AID", "auto")
        .args(arguments.split_whitespace())
        .output()
        .unwrap();
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn what_is_printed_fits_a_screen_and_the_rest_is_there_for_who_asks() {
    let dir = bench();
    for name in [
        "xsens_mti.mcap",
        "px4_flight.ulg",
        "faults.mcap",
        "gopro_hero6.raw",
    ] {
        let log = fixture(name);
        let replay = format!("replay {} -o out.mcap --force", log.display());
        let brief = typed(dir.path(), &replay);
        let lines: Vec<&str> = brief.lines().collect();
        assert!((4..=8).contains(&lines.len()), "{name}:\n{brief}");
        assert!(
            lines.iter().all(|line| line.len() <= 260),
            "{name}:\n{brief}"
        );
        for label in [
            "  samples  ",
            "  final    ",
            "  wrote    out.mcap",
            "  next     strapd ",
        ] {
            assert!(
                brief.contains(label),
                "{name}: `{label}` is missing:\n{brief}"
            );
        }
        let whole = typed(dir.path(), &format!("{replay} -v"));
        assert!(whole.lines().count() > lines.len(), "{name}:\n{whole}");
        let check = typed(dir.path(), &format!("check {}", log.display()));
        let findings = |text: &str| {
            let kinds = ["  error ", "  warning ", "  note "];
            text.lines()
                .filter(|l| kinds.iter().any(|k| l.starts_with(k)))
                .count()
        };
        assert!(findings(&check) <= 10, "{name}:\n{check}");
        let all = typed(dir.path(), &format!("check {} -v", log.display()));
        let left = findings(&all) - findings(&check);
        assert_eq!(
            check.contains(&format!("and {left} more")),
            left > 0,
            "{name}:\n{check}"
        );
    }
    // Of eight topics of a flight seven are taken by nobody, and a dropout of 0 ms is none.
    let flight = typed(
        dir.path(),
        &format!("check {}", fixture("px4_flight.ulg").display()),
    );
    assert!(
        !flight.contains("sensor_gyro/1: ") && !flight.contains("within 0 ms"),
        "{flight}"
    );
    // The filter learns the bias.
    assert!(flight.contains("  note     bias "), "{flight}");
}
