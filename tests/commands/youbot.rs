//! `strapd model youbot` and `strapd simulate youbot` from outside: requests in, answers out.

use assert_cmd::Command;
use serde_json::{Value, json};

/// Answers to requests, and the exit code.
fn ask(arguments: &[&str], requests: &[Value]) -> (Vec<Value>, i32) {
    let input: String = requests.iter().map(|r| format!("{r}\n")).collect();
    let out = Command::cargo_bin("strapd")
        .unwrap()
        .args(["-q", "model", "youbot"])
        .args(arguments)
        .write_stdin(input)
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    let answers = text.lines().map(|l| serde_json::from_str(l).unwrap());
    (answers.collect(), out.status.code().unwrap())
}

fn one(arguments: &[&str], request: Value) -> Value {
    let (mut answers, code) = ask(arguments, &[request]);
    assert_eq!((answers.len(), code), (1, 0), "{answers:?}");
    answers.remove(0)
}

#[track_caller]
fn near(ours: &Value, theirs: &[f64], tolerance: f64) {
    let ours: Vec<f64> = ours
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect();
    assert_eq!(ours.len(), theirs.len());
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= tolerance, "{ours:?} against {theirs:?}");
    }
}

#[test]
fn the_documents_check_pose_in_degrees() {
    let pose = one(&["fk", "--degrees"], json!({"q": [0, 0, 0, 90, 0]}));
    near(&pose["p"], &[0.033, 0.0, 0.655], 1e-15);
    near(&pose["r"][0], &[-1.0, 0.0, 0.0], 1e-15);
    near(&pose["r"][2], &[0.0, 0.0, 1.0], 1e-15);
    assert_eq!(pose["within_limits"], true);
    assert!((pose["quat"]["z"].as_f64().unwrap().abs() - 1.0).abs() < 1e-15);
}

#[test]
fn a_pose_as_it_is_answered_is_a_request() {
    let pose = one(&["fk"], json!({"q": [0.3, 0.4, -0.9, 0.8, 0.2]}));
    let back = one(&["ik"], pose.clone());
    let found = back["solutions"].as_array().unwrap();
    let is_it = |s: &Value| (s["q"][2].as_f64().unwrap() + 0.9).abs() < 1e-9;
    assert!(found.iter().any(is_it), "{back}");
    let mut other = pose;
    other["quat"] = json!({"w": 1, "x": 0, "y": 0, "z": 0});
    let (answers, code) = ask(&["ik"], &[other]);
    assert_eq!(code, 3);
    assert!(
        answers[0]["error"]
            .as_str()
            .unwrap()
            .contains("two orientations"),
        "{answers:?}"
    );
}

#[test]
fn joints_of_the_driver_go_in_and_come_out() {
    let u = [20.0, 60.0, -100.0, 90.0, 120.0];
    let request = json!({"q": u, "joints": "driver", "preset": "urdf"});
    let pose = one(&["fk", "--degrees"], request);
    let back = one(
        &["ik", "--degrees"],
        json!({"p": pose["p"], "quat": pose["quat"], "joints": "driver", "preset": "urdf", "q_current": u}),
    );
    let chosen = back["chosen"].as_u64().unwrap() as usize;
    near(&back["solutions"][chosen]["q"], &u, 1e-9);
    assert_eq!(back["solutions"][chosen]["within_limits"], true);
    assert!(back["residual"]["angle"].as_f64().unwrap() < 1e-12);
    // The encoders run backwards: so do the columns of the Jacobian, and the torques.
    let q: Vec<f64> = [169.0, 65.0, -146.0, 192.5, 167.5]
        .iter()
        .zip(u)
        .map(|(z, u)| z - u)
        .collect();
    let question = |joints: &str, q: &[f64]| json!({"q": q, "joints": joints, "preset": "urdf"});
    let ours = one(&["jacobian", "--degrees"], question("driver", &u));
    let seed = one(&["jacobian", "--degrees"], question("seed", &q));
    for row in 0..6 {
        let theirs: Vec<f64> = seed["jacobian"][row]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| -x.as_f64().unwrap())
            .collect();
        near(&ours["jacobian"][row], &theirs, 1e-12);
    }
    let ours = one(&["dynamics", "--degrees"], question("driver", &u));
    let seed = one(&["dynamics", "--degrees"], question("seed", &q));
    for joint in 0..5 {
        let (a, b) = (&ours["tau"][joint], &seed["tau"][joint]);
        assert!((a.as_f64().unwrap() + b.as_f64().unwrap()).abs() < 1e-12);
    }
    near(
        &ours["mass_matrix"][1],
        &seed["mass_matrix"][1]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect::<Vec<_>>(),
        1e-12,
    );
}

#[test]
fn rates_and_velocities_are_each_others_inverse() {
    let q = json!([0.3, -0.5, -1.2, 1.5, 0.4]);
    let there = one(
        &["jacobian"],
        json!({"q": q, "qd": [0.1, -0.2, 0.3, -0.4, 0.5]}),
    );
    let back = one(&["jacobian"], json!({"q": q, "twist": there["twist"]}));
    near(&back["qd"], &[0.1, -0.2, 0.3, -0.4, 0.5], 1e-13);
    let degrees = |key: &str, v: &Value| json!({"q": [17.0, -29.0, -69.0, 86.0, 23.0], key: v});
    let there = one(
        &["jacobian", "--degrees"],
        degrees("qd", &json!([1, 2, 3, 4, 5])),
    );
    let back = one(
        &["jacobian", "--degrees"],
        degrees("twist", &there["twist"]),
    );
    near(&back["qd"], &[1.0, 2.0, 3.0, 4.0, 5.0], 1e-11);
}

#[test]
fn what_can_not_be_is_said_on_its_line_with_a_reason_and_exit_code_3() {
    let upright = json!([[-1, 0, 0], [0, -1, 0], [0, 0, 1]]);
    let requests = [
        json!({"p": [0.033, 0, 0.675], "r": upright}),
        json!({"p": [0.3, 0.1, 0.3], "r": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]}),
        json!({"p": [0.3, 0.1, 0.3], "r": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], "policy": "keep-position"}),
        json!({"p": [0.3, 0.1, 0.3], "r": [[0, 0, 1], [0, 1, 0], [-1, 0, 0.1]]}),
        json!({"p": [0.3, 0.1, 0.3]}),
        json!({"p": [0.3, 0.1, 0.3], "r": upright, "policy": "weighted", "tolerance": {"position": 1, "angle": 1}}),
        json!({"p": [0.3, 0.1], "r": upright}),
    ];
    let (answers, code) = ask(&["ik"], &requests);
    assert_eq!((answers.len(), code), (7, 3));
    let reason = |i: usize| answers[i]["reason"].as_str().unwrap_or_default();
    assert_eq!(reason(0), "out-of-reach");
    assert!(
        answers[0]["error"]
            .as_str()
            .unwrap()
            .contains("too far by 0.020000 m")
    );
    assert_eq!(reason(1), "out-of-plane");
    let kept = &answers[2];
    assert!(kept.get("error").is_none(), "{kept}");
    assert!(kept["residual"]["angle"].as_f64().unwrap() > 0.01);
    assert!(kept["residual"]["position"].as_f64().unwrap() < 1e-15);
    assert_eq!(reason(3), "not-a-rotation");
    for (i, what) in [(4, "r, quat"), (5, "another policy"), (6, "invalid length")] {
        assert!(
            answers[i]["error"].as_str().unwrap().contains(what),
            "{}",
            answers[i]
        );
    }
    let (answers, code) = ask(
        &["dynamics"],
        &[json!({"q": [0, 0, 0, 0, 0], "payload": {"mass": -1}})],
    );
    assert_eq!(
        (answers[0]["reason"].as_str(), code),
        (Some("not-physical"), 3)
    );
    // Past a stop is an answer; nothing is chosen.
    let beyond = one(&["fk", "--degrees"], json!({"q": [0, 80, 5, 90, 0]}));
    assert_eq!(beyond["within_limits"], false);
}

#[test]
fn payload_gripper_gravity_and_tip_change_the_torques() {
    let q = json!([0.0, -1.57, 0.0, 1.57, 0.0]);
    let tau = |extra: Value| {
        let mut request = json!({"q": q});
        for (k, v) in extra.as_object().unwrap() {
            request[k] = v.clone();
        }
        one(&["dynamics"], request)["tau"][1].as_f64().unwrap()
    };
    let bare = tau(json!({}));
    assert!(tau(json!({"gripper": true})).abs() > bare.abs() + 0.1);
    assert!(tau(json!({"payload": {"mass": 0.5}})).abs() > bare.abs() + 1.0);
    assert!(tau(json!({"gravity": [0, 0, 0]})).abs() < 1e-12);
    let pressed = tau(json!({"tip": {"force": [5, 0, 0]}}));
    assert!((pressed - bare).abs() > 0.5);
    let ball =
        json!({"payload": {"mass": 0.5, "inertia_cg": [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]}});
    assert!((tau(ball) - tau(json!({"payload": {"mass": 0.5}}))).abs() < 1e-12);
}

#[test]
fn trajectories_of_every_kind_are_sampled() {
    let own = one(&["trajectory"], json!({"duration": 2, "rate_hz": 50}));
    let samples = own["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 101);
    assert_eq!(own["slow_down"], 1.0);
    let points = json!({"points": [[0, 0, 0, 0, 0], [90, -20, 60, 45, -100]]});
    let points = one(&["trajectory", "--degrees"], points);
    assert!((points["duration"].as_f64().unwrap() - 100.0 / 90.0 * 1.875).abs() < 1e-12);
    near(&points["samples"][0]["q"], &[0.0; 5], 0.0);
    let line = json!({
        "line": {"from": [0.25, -0.15, 0.15, 97, 0], "to": [0.3, 0.2, 0.3, 126, 57], "duration": 0.5},
        "q_start": [-30, -20, -60, 100, 0], "slow_down": true, "rate_hz": 100, "preset": "urdf",
    });
    let line = one(&["trajectory", "--degrees"], line);
    let factor = line["slow_down"].as_f64().unwrap();
    assert!(factor > 1.1, "{factor}");
    assert!((line["duration"].as_f64().unwrap() - 0.5 * factor).abs() < 1e-9);
    near(&line["samples"][0]["p"], &[0.25, -0.15, 0.15], 1e-12);
    let fastest = line["samples"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|s| s["qd"].as_array().unwrap().clone());
    let fastest = fastest
        .map(|w| w.as_f64().unwrap().abs())
        .fold(0.0, f64::max);
    assert!((85.0..90.01).contains(&fastest), "{fastest}");
    let refused = [
        json!({"line": {"from": [0.4, 0, 0.147, 1.5, 0], "to": [0.7, 0, 0.147, 1.5, 0], "duration": 2}, "q_start": [0, -0.35, -1.75, 2.1, 0]}),
        json!({"points": [[0, 0, 0, 0, 0]], "waves": [{}, {}, {}, {}, {}], "duration": 1}),
        json!({"duration": 1, "rate_hz": 1e9}),
        json!({"rate_hz": 10}),
        json!({"duration": "long"}),
    ];
    let (answers, code) = ask(&["trajectory"], &refused);
    assert_eq!((answers.len(), code), (5, 3));
    let words = [
        "s of the path: out of reach: too far by",
        "at most one",
        "at most 100000",
        "duration",
        "invalid type",
    ];
    for (answer, words) in answers.iter().zip(words) {
        assert!(
            answer["error"].as_str().unwrap().contains(words),
            "{answer}"
        );
    }
}

#[test]
fn a_table_for_people_has_no_braces() {
    let out = Command::cargo_bin("strapd")
        .unwrap()
        .args(["model", "youbot", "ik", "--degrees", "--table"])
        .write_stdin("{\"p\":[0.2,0.1,0.05],\"quat\":{\"w\":0,\"x\":1,\"y\":0,\"z\":0}}\n")
        .output()
        .unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(!text.contains(['{', '}', '[', '"']), "{text}");
    for word in [
        "solutions",
        "base",
        "elbow",
        "front",
        "reach_excess",
        "residual",
    ] {
        assert!(text.contains(word), "{text}");
    }
}

/// The gyro on the gripper, replayed by the program, against the truth beside it.
#[test]
fn simulated_replayed_and_compared_the_attitude_is_the_forward_kinematics() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let run = |arguments: &[&str]| {
        let out = Command::cargo_bin("strapd")
            .unwrap()
            .args(arguments)
            // What the integrator alone does.
            .env("STRAPD_AID", "none")
            .output()
            .unwrap();
        assert!(
            out.status.success(),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&out.stderr)
        );
        String::from_utf8(out.stdout).unwrap()
    };
    let spec = path("path.json");
    let text = json!({
        "points": [[0, 0, 0, 0, 0], [90, -20, 60, 45, -100], [-60, 30, -60, 100, 60], [0, 0, 30, 90, 0]],
        "mount": {"r": [0, 0.03, 0], "quat": {"w": 1, "x": 1, "y": 0, "z": 0}},
    });
    std::fs::write(&spec, text.to_string()).unwrap();
    for (name, extra) in [
        ("own", vec![]),
        ("file", vec!["--trajectory", spec.as_str(), "--degrees"]),
    ] {
        for kind in ["rate", "delta-angle"] {
            let (log, out) = (
                path(&format!("{name}-{kind}.mcap")),
                path(&format!("{name}-{kind}-est.mcap")),
            );
            let mut simulate = vec![
                "-q",
                "simulate",
                "youbot",
                "--rate-hz",
                "200",
                "--duration",
                "20",
            ];
            simulate.extend(["--sample-kind", kind, "-o", &log]);
            simulate.extend(&extra);
            run(&simulate);
            run(&["-q", "replay", &log, "--sample-kind", kind, "-o", &out]);
            let text = run(&[
                "-q",
                "--json",
                "compare",
                &out,
                &log,
                "--ref-topic",
                "/truth",
                "--align",
                "first",
            ]);
            let found: Value = serde_json::from_str(&text).unwrap();
            let max = found["total"]["max_deg"].as_f64().unwrap();
            // Stamps are whole nanoseconds; joint accelerations of the legs have corners.
            assert!(max < 1e-6, "{name}, {kind}: {max} degrees in {found}");
        }
    }
}
