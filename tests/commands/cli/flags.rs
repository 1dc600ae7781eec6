//! Flags that cannot be: exit code 2, the flag named, nothing written.

use super::{bench, names, strapd};

#[test]
fn a_flag_that_can_not_be_is_refused_by_name_before_anything_is_read() {
    let dir = bench();
    for (flags, words) in [
        ("--nonsense", &["--nonsense"] as &[&str]),
        ("--method foo", &["--method", "foo", "auto", "dcm-left"]),
        ("--method magnus --window 40", &["--window", "24"]),
        ("--method magnus --window 0", &["--window"]),
        ("--method magnus --order 3", &["--order", "'3'"]),
        ("--method dcm-left --window 4", &["--window", "dcm-left"]),
        ("--window four", &["--window", "four"]),
        (
            "--sample-kind mean",
            &["--sample-kind", "average", "delta-angle"],
        ),
        ("--gyro-unit rpm", &["--gyro-unit", "deg"]),
        ("--body XXX", &["--body", "XXX"]),
        ("--world moon", &["--world", "moon", "enu"]),
        (
            "--mount q=1,1,1,1",
            &["--mount", "unit quaternion", "norm 2"],
        ),
        ("--mount q=1,0,0", &["--mount", "4"]),
        ("--init sideways", &["--init", "gravity", "rpy="]),
        ("--init q=0,0,0,0", &["--init", "norm 0"]),
        ("--init rpy=1,2", &["--init", "3"]),
        ("--bias 1,2", &["--bias", "x,y,z"]),
        ("--bias nan,0,0", &["--bias"]),
        ("--max-gap -1", &["--max-gap", "-1"]),
        ("--max-gap nan", &["--max-gap"]),
        ("--gyro-range -3", &["--gyro-range", "-3"]),
        ("--start 5 --until 4", &["--start 5", "--until 4"]),
        ("--start inf", &["--start"]),
        ("--noise loud", &["--noise", "consumer", "navigation"]),
        ("--noise arw=-1", &["--noise"]),
        ("--time index", &["--time index", "--rate-hz"]),
        ("--time index --rate-hz 0", &["--rate-hz", "0"]),
        ("--rate-hz 100", &["--rate-hz", "--time index"]),
        ("--time noon", &["--time", "header"]),
        ("--speed 0", &["--speed", "max"]),
        ("--speed fast", &["--speed", "fast"]),
        ("--out-rate 0", &["--out-rate"]),
        ("--out-rate -1", &["--out-rate"]),
        ("--shard 2/2", &["--shard", "0/4"]),
        ("--shard 1", &["--shard"]),
        ("--threads many", &["--threads"]),
        ("--encoding xml", &["--encoding", "cdr"]),
        ("--json -o -", &["--json", "-o -"]),
    ] {
        let ran = strapd(dir.path(), &format!("replay log.mcap -o a.csv {flags}"));
        ran.refused(2, words);
    }
    assert_eq!(names(dir.path()), ["log.mcap"]);
    strapd(dir.path(), "replay").refused(2, &["SOURCE"]);
    strapd(dir.path(), "teleport log.mcap").refused(2, &["teleport"]);
    strapd(dir.path(), "compare log.mcap").refused(2, &["REF"]);
    strapd(dir.path(), "compare log.mcap log.mcap --align up").refused(2, &["--align", "heading"]);
}

#[test]
fn every_form_of_the_initial_attitude_is_taken_and_named_in_the_summary() {
    let dir = bench();
    for (init, origin) in [
        ("identity", "identity"),
        ("q=0.5,0.5,0.5,0.5", "as given"),
        ("q=-1,0,0,0", "as given"),
        ("rpy=10,-20,179.5", "as given"),
        ("rpy=-10,20,-30", "as given"),
    ] {
        let ran = strapd(dir.path(), &format!("replay log.mcap --init {init} --json"));
        assert_eq!(ran.done().json()["topics"][0]["initial"], origin, "{init}");
    }
    let bias = strapd(dir.path(), "replay log.mcap --bias -0.01,0.02,-0.03 --json");
    assert_eq!(bias.done().json()["topics"][0]["bias_rad_s"]["z"], -0.03);
}

#[test]
fn an_environment_variable_is_the_default_and_a_flag_beats_it() {
    let dir = bench();
    let with_env = |more: &[&str]| {
        let output = assert_cmd::Command::cargo_bin("strapd")
            .unwrap()
            .current_dir(dir.path())
            .env("STRAPD_METHOD", "dcm-left")
            .args(["replay", "log.mcap", "--json"])
            .args(more)
            .output()
            .unwrap();
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["topics"][0]["method"].as_str().unwrap().to_owned()
    };
    assert_eq!(with_env(&[]), "dcm-left");
    assert_eq!(with_env(&["--method", "dcm-mean"]), "dcm-mean");
}
