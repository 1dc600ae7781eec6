//! Simulations that cannot be: which flag, why, with the numbers; nothing is written.

use crate::program::strapd;

#[test]
fn what_can_not_be_is_refused_with_its_numbers_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (flags, words) in [
        (
            "top --case gliding",
            &["gliding", "cusped", "steady-slow", "falling"] as &[&str],
        ),
        (
            "top --noise loud",
            &["loud", "tactical", "navigation", "consumer"],
        ),
        ("top --noise arw=-1", &["arw", "0 to"]),
        (
            "top --noise tactical,colour=3",
            &["colour", "bias_instability"],
        ),
        ("top --duration=-1", &["duration", "-1"]),
        ("top --duration nan", &["duration", "NaN"]),
        ("top --rate-hz 0", &["rate", "0"]),
        ("top --rate-hz 30", &["30 Hz", "half a turn", "40.0"]),
        (
            "coning --half-angle-deg 90 --frequency-hz 100 --rate-hz 150",
            &["half a turn", "--rate-hz"],
        ),
        (
            "top --spin-hz 2 --case steady-slow",
            &["no steady precession", "53."],
        ),
        (
            "top --inertia 0.001,0.003",
            &["0.003", "0.002", "no matter"],
        ),
        ("top --inertia 0.001", &["--inertia", "2"]),
        ("top --mass=-1", &["mass", "-1"]),
        ("top --case wavy --euler 0,10,0", &["--case", "--euler"]),
        ("top --euler-rates 1,2,3", &["--euler"]),
        (
            "rigid-body --inertia 1,1,3",
            &["1, 1, 3", "sum of the others"],
        ),
        ("rigid-body --inertia 1,1", &["--inertia", "JSON"]),
        (
            r#"rigid-body --inertia {"mass":1,"colour":2}"#,
            &["colour", "inertia_cg"],
        ),
        ("rigid-body --body-rate 1,2", &["--body-rate", "3"]),
        ("rigid-body --body-rate 1e9,0,0", &["rate"]),
        ("rigid-body --attitude gravity", &["--attitude", "rpy"]),
        ("coning --half-angle-deg 181", &["--half-angle-deg"]),
        ("random --rms=-1", &["--rms"]),
        ("random --sines 0", &["--sines"]),
        ("random --sines 100000", &["--sines", "1000"]),
        ("walking --worn hat", &["hat", "waist", "foot"]),
        ("car --lever-arm 1,2", &["--lever-arm", "3"]),
        ("car --lever-arm 1000,1000,0", &["lever arm", "1000"]),
        ("random --start-stamp now", &["--start-stamp", "now"]),
        (
            "random --start-stamp 9223372036",
            &["--start-stamp", "64-bit"],
        ),
        ("random --drop 2", &["drop", "--drop"]),
        ("random --drop 0.9 --burst 1", &["burst"]),
        ("random --jitter 0.6", &["jitter", "0.499"]),
        ("random --speed 0", &["--speed"]),
        ("gyroscope", &["gyroscope", "simulate"]),
    ] {
        strapd(at, &format!("simulate {flags} -o a.mcap")).refused(2, words);
    }
    strapd(at, "simulate top").refused(2, &["--output"]);
    strapd(at, "simulate top -o tcp://localhost").refused(2, &["HOST:PORT", "FILE.mcap"]);
    strapd(at, "simulate top -o a.mcap -o a.mcap").refused(2, &["given twice"]);
    strapd(at, "simulate top -o - --json").refused(2, &["--json"]);
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 0);
}

#[test]
fn an_output_that_exists_is_kept_unless_forced() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    std::fs::write(at.join("a.mcap"), b"precious").unwrap();
    strapd(at, "simulate coning -o a.mcap").refused(1, &["a.mcap", "already exists", "--force"]);
    assert_eq!(std::fs::read(at.join("a.mcap")).unwrap(), b"precious");
    strapd(at, "simulate coning --duration 1 -o a.mcap --force").done();
}

#[test]
fn what_is_possible_but_hardly_meant_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (flags, word) in [
        ("top --case falling", "below the threshold of"),
        ("top --spin-hz 1", "tips over"),
        ("top --case sleeping --spin-hz 5", "11.1"),
        ("top --noise low,range=100", "end of the sensor's range"),
        ("coning --start-stamp 3000000000 -o far.mcap", "2038"),
        ("random --rms 200 --f-max 20 --rate-hz 130", "half a turn"),
    ] {
        let ran = strapd(at, &format!("simulate {flags} -o null:"));
        assert!(ran.done().out.contains(word), "{flags}: {}", ran.out);
    }
    // And what is right says nothing.
    let ran = strapd(at, "simulate top -o null:");
    assert!(!ran.done().out.contains("note"), "{}", ran.out);
    // An upright top in body axes: tilt zero is no trouble for a gyro.
    strapd(at, "simulate top --tilt-deg 0 -o null:").done();
}
