//! `--smooth`: a whole recording at once, through the command line.

use crate::program::{strapd, strapd_fed};
use crate::shared_data::shared;
use std::path::Path;

/// A sensor in a hand, at rest before and after, with errors of its class that the smoother is to find.
fn carried(dir: &Path) {
    let ran = strapd(
        dir,
        "simulate hand --noise consumer_imu --mag --rate-hz 100 --duration 90 --seed 5 -o hand.mcap -o truth.tum -q",
    );
    ran.done();
}

/// Error against the truth, heading made equal at the first common instant, deg: total, heading, inclination, rms.
fn error(dir: &Path, estimate: &str) -> [f64; 3] {
    let ran = strapd(
        dir,
        &format!("compare {estimate} hand.mcap --ref-topic /truth --align first-heading --json"),
    );
    let found = ran.json();
    ["total", "heading", "inclination"].map(|part| found[part]["rms_deg"].as_f64().unwrap())
}

#[test]
fn it_is_nearer_to_the_truth_than_the_filter_and_says_what_it_learned() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    carried(dir);
    // With the class that is no better known than the smoother's.
    strapd(
        dir,
        "replay hand.mcap --aid gravity --noise consumer -o filter.mcap",
    )
    .done();
    let ran = strapd(
        dir,
        "replay hand.mcap --aid gravity --smooth -o smooth.mcap --json",
    );
    let summary = ran.json();
    let smooth = &summary["topics"][0]["smooth"];
    assert_eq!(smooth["outcome"], "converged", "{smooth}");
    assert!(smooth["standstills"].as_u64().unwrap() > 0, "{smooth}");
    let (filter, smoothed) = (error(dir, "filter.mcap"), error(dir, "smooth.mcap"));
    assert!(
        smoothed[0] < 0.5 * filter[0] && smoothed[2] < 0.2 * filter[2],
        "filter {filter:?}, smoothed {smoothed:?}"
    );
}

#[test]
fn where_it_leads_nowhere_the_attitude_is_the_filters_to_the_bit() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    // It never rests, and goes farther than the smoother believes of what never rests.
    strapd(
        dir,
        "simulate car --noise consumer --rate-hz 100 --duration 120 --seed 1 -o car.mcap -q",
    )
    .done();
    let filter = strapd(dir, "replay car.mcap --aid gravity -o - -q");
    let smooth = strapd(dir, "replay car.mcap --aid gravity --smooth -o -");
    assert!(smooth.err.contains("NOT SMOOTHED"), "{}", smooth.err);
    assert!(filter.done().out == smooth.done().out);
    // And so is all that is said of it and saved.
    let learned = |flags: &str| {
        let saved = format!("replay car.mcap --aid gravity {flags} -o null: --json --force");
        let ran = strapd(dir, &format!("{saved} --save-calibration car.toml"));
        let file = std::fs::read_to_string(dir.join("car.toml")).unwrap();
        let topic = ran.json()["topics"][0].clone();
        (file, topic["sigma_terms"].clone(), topic["method"].clone())
    };
    let (filter, smooth) = (learned(""), learned("--smooth"));
    assert!(filter.0.contains("bias"), "{}", filter.0);
    assert_eq!(filter, smooth);
}

#[test]
fn neither_threads_nor_a_pipe_change_a_byte() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    carried(dir);
    let lines = strapd(dir, "cat hand.mcap").done().out.clone();
    std::fs::write(dir.join("hand.ndjson"), &lines).unwrap();
    let one = strapd(
        dir,
        "replay hand.ndjson --aid gravity --bias none --noise consumer --smooth --threads 1 -o - -q",
    );
    let rates = lines.lines().filter(|line| line.contains("\"gyro\""));
    assert_eq!(one.done().lines().len(), rates.count());
    for threads in [2, 4] {
        let other = strapd(
            dir,
            &format!(
                "replay hand.ndjson --aid gravity --bias none --noise consumer --smooth --threads {threads} -o - -q"
            ),
        );
        assert!(one.out == other.done().out, "{threads} threads");
    }
    // A pipe is not looked through for a rest or a class beforehand.
    let piped = strapd_fed(
        dir,
        "replay - --aid gravity --bias none --noise consumer --smooth -o - -q",
        lines,
    );
    assert!(one.out == piped.done().out, "a pipe");
}

#[test]
fn what_it_learned_is_saved_and_serves_the_filter() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    carried(dir);
    let ran = strapd(
        dir,
        "replay hand.mcap --aid gravity --smooth --save-calibration hand.toml -o null:",
    );
    ran.done();
    let file = std::fs::read_to_string(dir.join("hand.toml")).unwrap();
    assert!(file.contains("bias") && file.contains("G"), "{file}");
    strapd(dir, "replay hand.mcap --aid gravity -o before.mcap").done();
    strapd(
        dir,
        "replay hand.mcap --aid gravity --calibration hand.toml -o after.mcap",
    )
    .done();
    let (before, after) = (error(dir, "before.mcap"), error(dir, "after.mcap"));
    // Of the tilt: it is a third to two thirds for each of six seeds. What the heading has drifted by without a rest is
    // chance, and larger with a calibration for three of them.
    assert!(
        after[2] < 0.7 * before[2],
        "{after:?} after, {before:?} before"
    );
}

#[test]
fn the_heading_is_norths_with_a_field_and_that_of_init_without() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    carried(dir);
    let yaw = |flags: &str| -> f64 {
        let ran = strapd(dir, &format!("replay hand.mcap --smooth {flags} -o - -q"));
        let first = &ran.done().lines()[0];
        let q = ["w", "x", "y", "z"].map(|c| first["q"][c].as_f64().unwrap());
        let [w, x, y, z] = q;
        (2.0 * (w * z + x * y))
            .atan2(1.0 - 2.0 * (y * y + z * z))
            .to_degrees()
    };
    let given = yaw("--aid gravity --init rpy=0,0,40 --world enu");
    assert!((given - 40.0).abs() < 1e-6, "{given}");
    // The field of the simulation points north.
    strapd(
        dir,
        "replay hand.mcap --smooth --aid gravity+mag --world enu -o north.mcap -q",
    )
    .done();
    let ran = strapd(
        dir,
        "compare north.mcap hand.mcap --ref-topic /truth --align none --json",
    );
    let heading = ran.json()["heading"]["rms_deg"].as_f64().unwrap();
    assert!(heading < 5.0, "{heading}");
}

#[test]
fn flags_that_do_not_go_with_it_and_logs_that_can_not_be_smoothed_are_said() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    carried(dir);
    for (flags, word) in [
        ("--aid none", "--aid gravity"),
        ("--aid gravity --method magnus", "--method"),
        (
            "--aid gravity --earth-rate 48 --world enu --init rpy=0,0,0",
            "--earth-rate",
        ),
    ] {
        let ran = strapd(dir, &format!("replay hand.mcap --smooth {flags} -o null:"));
        ran.refused(2, &["--smooth", word]);
    }
    let gyro: String = (0..300)
        .map(|i| {
            format!(
                "{{\"stamp_ns\":{},\"gyro\":[0,0,0.1]}}\n",
                i64::from(i) * 10_000_000
            )
        })
        .collect();
    for aid in ["auto", "gravity"] {
        let flags = format!("replay - --aid {aid} --smooth -o null:");
        let ran = strapd_fed(dir, &flags, gyro.clone());
        ran.refused(1, &["specific force", "leave --smooth out"]);
    }
    // Three samples are too few for anything, and no reason to end without a word.
    let three: String = (0..3)
        .map(|i| format!("{{\"stamp_s\":{i},\"gyro\":[0,0,0.1],\"accel\":[0,0,9.81]}}\n"))
        .collect();
    let ran = strapd_fed(
        dir,
        "replay - --aid gravity --smooth -o - --max-gap 5",
        three,
    );
    assert_eq!(ran.lines().len(), 3, "{ran:?}");
}

#[test]
fn the_report_has_its_calibration() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    carried(dir);
    strapd(dir, "report hand.mcap --aid gravity --smooth -o r.html").done();
    let html = std::fs::read_to_string(dir.join("r.html")).unwrap();
    assert!(html.contains("Calibration by the whole recording"));
    assert!(html.contains("gyro bias in the middle, deg/s"));
    assert!(html.contains("id=\"force-size\"") && !html.contains("id=\"field-size\""));

    strapd(
        dir,
        "report hand.mcap --aid gravity+mag --smooth -o mag.html",
    )
    .done();
    let html = std::fs::read_to_string(dir.join("mag.html")).unwrap();
    for part in [
        "known to +-",
        "hard iron, uT",
        "id=\"force-size\"",
        "id=\"field-size\"",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert!(html.contains("field ") && html.contains("uT (spread "));
    let json = strapd(
        dir,
        "replay hand.mcap --aid gravity+mag --smooth -o null: --json",
    )
    .json();
    let smooth = &json["topics"][0]["smooth"];
    // The unit has hard iron of some uT.
    let spread = |what: &str, when: &str| smooth[what][when]["deviation"].as_f64().unwrap();
    let fields = ["measured", "calibrated"].map(|when| spread("field_ut", when));
    assert!(fields[1] < 0.5 * fields[0], "{smooth}");
    let gravity = |when: &str| smooth["force_at_rest_m_s2"][when]["mean"].as_f64().unwrap();
    assert!((gravity("measured") - 9.81).abs() > 0.1, "{smooth}");
    assert!((gravity("calibrated") - 9.81).abs() < 0.02, "{smooth}");
}

/// A wheeled robot out of doors, 395 s, of which gravity does not show the bias about the vertical; the gyro alone is
/// 45 degrees off at most. Against its own orientation.
#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared")]
fn a_wheeled_robot_is_not_turned_away() {
    let Some(log) = shared("logs/real/husky_ros1_lz4.mcap") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let log = log.display();
    let ran = strapd(
        dir,
        &format!("replay {log} --aid gravity --smooth -o husky.mcap --json"),
    );
    let smooth = ran.json()["topics"][0]["smooth"].clone();
    assert!(smooth["held_bias"]["rate_deg_s"].is_number(), "{smooth}");
    let ran = strapd(
        dir,
        &format!("compare husky.mcap {log} --align first-heading --json"),
    );
    let most = ran.json()["heading"]["max_deg"].as_f64().unwrap();
    assert!(most <= 45.0, "{most}");
}
