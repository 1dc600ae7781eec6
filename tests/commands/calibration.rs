//! Promise: what was learned of a sensor is its errors, is found again in another log of it, and is of its own axes.

mod iron;
mod several;
mod text;

use crate::program::{strapd, strapd_fed};
use crate::shared_data::shared;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use std::path::Path;
use strapd::config::calibration::parse;
use strapd_attitude::estimate::SensorCalibration;

/// Errors of the sensor made here. Symmetric: what is not is mounting, which no accelerometer tells.
fn errors() -> (Matrix3<f64>, Vector3<f64>, Vector3<f64>) {
    let g = Matrix3::new(5e-3, 1.5e-3, -2e-3, 1.5e-3, -4e-3, 1e-3, -2e-3, 1e-3, 3e-3);
    (
        g,
        Vector3::new(0.012, -0.009, 0.006),
        Vector3::new(0.02, -0.015, 0.01),
    )
}

/// A thing in a hand, as a sensor with those errors and white noise measures it.
fn log(dir: &Path, name: &str, seed: u64, secs: u32) {
    let made = format!(
        "simulate hand --duration {secs} --rate-hz 100 --seed {seed} --noise arw=0.3,accel_noise=150 -o - --quiet"
    );
    let (g, bias, force_bias) = errors();
    let undone = (Matrix3::identity() + g).try_inverse().unwrap();
    let lines: Vec<String> = strapd(dir, &made)
        .done()
        .out
        .lines()
        .map(|line| {
            let mut line: Value = serde_json::from_str(line).unwrap();
            if line["class"] == "RATE" {
                let gyro = undone * vector(&line["gyro"]) + bias;
                let accel = vector(&line["accel"]) + force_bias;
                line["gyro"] = gyro.as_slice().into();
                line["accel"] = accel.as_slice().into();
            }
            line.to_string()
        })
        .collect();
    std::fs::write(dir.join(name), lines.join("\n") + "\n").unwrap();
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| value[i].as_f64().unwrap())
}

fn saved(dir: &Path, name: &str) -> SensorCalibration {
    parse(&std::fs::read_to_string(dir.join(name)).unwrap()).unwrap()
}

fn attitudes(text: &str, id: &str) -> Vec<(f64, UnitQuaternion<f64>)> {
    let lines = text.lines().map(|l| serde_json::from_str(l).unwrap());
    lines
        .filter(|l: &Value| l["class"] == "ATT" && (id.is_empty() || l["id"] == id))
        .map(|l| {
            let of = |key: &str| l["q"][key].as_f64().unwrap();
            let q = Quaternion::new(of("w"), of("x"), of("y"), of("z"));
            let stamp = &l["stamp"];
            let secs = stamp["sec"].as_f64().unwrap() + stamp["nsec"].as_f64().unwrap() * 1e-9;
            (secs, UnitQuaternion::from_quaternion(q))
        })
        .collect()
}

/// Root mean square of the error of the first `secs` seconds, degrees, the heading set right at the first sample.
fn error(dir: &Path, flags: &str, log: &str, secs: f64) -> f64 {
    let ran = strapd(dir, &format!("replay {log} -o - --quiet {flags}"));
    let found = attitudes(&ran.done().out, "");
    let truth = attitudes(&std::fs::read_to_string(dir.join(log)).unwrap(), "truth");
    let first = found[0].0;
    let mut turn = None;
    let mut squares = Vec::new();
    let mut truth = truth.iter();
    for (at, q) in found.iter().take_while(|(at, _)| at - first <= secs) {
        let (_, reference) = truth.find(|(t, _)| (t - at).abs() < 1e-6).unwrap();
        let off = q * reference.inverse();
        let turn = turn.get_or_insert_with(|| {
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -2.0 * off.k.atan2(off.w))
        });
        squares.push((*turn * off).angle().to_degrees().powi(2));
    }
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_sensor_with_known_errors_gives_them_back_within_three_sigma() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (g, bias, force_bias) = errors();
    for seed in 1..=3 {
        log(at, "h.ndjson", seed, 240);
        let run = "replay h.ndjson --aid gravity --save-calibration c.toml --force";
        let said = strapd(at, run).done().out.clone();
        assert!(
            said.contains("c.toml  calibration; observed: bias, G"),
            "{said}"
        );
        let known = saved(at, "c.toml");
        assert_eq!(known.sensor.as_deref(), Some("imu"));
        assert_eq!(known.date.as_deref(), Some("2023-11-14T22:17:20Z"));
        assert_eq!(known.sources, ["h.ndjson"]);
        let scale = known.gyro.unwrap();
        let mut worst = 0.0_f64;
        for i in 0..9 {
            let sigma = scale.sigma_of(i).unwrap();
            // Of 4e-3, and 2e-3 between axes: it is known, and not only not denied.
            let most = if i % 4 == 0 { 2e-3 } else { 1.5e-3 };
            assert!(sigma < most, "G {i}: {sigma}");
            worst = worst.max((scale.value[i] - g[(i / 3, i % 3)]).abs() / sigma);
        }
        assert!(worst < 3.0, "G, seed {seed}: {worst} sigma");
        for (name, found, truth) in [
            ("bias", known.bias.unwrap(), bias),
            ("ba", known.force_bias.unwrap(), force_bias),
        ] {
            for i in 0..3 {
                let off = (found.value[i] - truth[i]).abs() / found.sigma.unwrap()[i];
                assert!(off < 3.0, "{name}, seed {seed}: {found:?}");
            }
        }
        // Not only within what switching on may change: to 0.05 deg/s, and 0.7 were put in.
        let off = (Vector3::from(known.bias.unwrap().value) - bias).amax();
        assert!(off < 8e-4, "bias, seed {seed}: {off} rad/s");
    }
}

#[test]
fn another_log_of_the_sensor_begins_better_by_what_the_first_has_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "a.ndjson", 1, 120);
    log(at, "b.ndjson", 2, 40);
    strapd(
        at,
        "replay a.ndjson --aid gravity --save-calibration c.toml",
    )
    .done();
    // In motion from the first sample.
    for (flags, better) in [
        ("--aid gravity --start 3.5", 1.5),
        ("--aid none --init gravity", 4.0),
    ] {
        let without = error(at, flags, "b.ndjson", 10.0);
        let with = error(
            at,
            &format!("{flags} --calibration c.toml"),
            "b.ndjson",
            10.0,
        );
        assert!(with * better < without, "{flags}: {with} {without}");
    }
    let summary = strapd(at, "replay b.ndjson --json --calibration c.toml").json();
    let topic = &summary["topics"][0];
    assert_eq!(topic["bias_rad_s"]["origin"], "as calibrated", "{summary}");
    // 0.3 deg/s of switching it on again, not the 1 deg/s of its class.
    let drift = topic["drift_deg_per_h"].as_f64().unwrap();
    assert!((1000.0..1300.0).contains(&drift), "{drift}");
}

#[test]
fn numbers_that_a_run_has_told_nothing_of_are_handed_through() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "h.ndjson", 1, 240);
    strapd(
        at,
        "replay h.ndjson --aid gravity --save-calibration a.toml",
    )
    .done();
    let more = "\n[A]\nvalue = [[0.001, 0.0, 0.0], [0.0, -0.002, 0.0], [0.0005, 0.0, 0.0]]\nsigma = [[0.001, 0.001, 0.001], [0.001, 0.001, 0.001], [0.001, 0.001, 0.001]]\nobserved = true\n\n[mag_lead]\nvalue = 0.003\nobserved = false\n\n[truncation_step]\nvalue = 0.001065\nobserved = true\n";
    let text = std::fs::read_to_string(at.join("a.toml")).unwrap() + more;
    std::fs::write(at.join("a.toml"), &text).unwrap();
    // Too short for a correction.
    let again =
        "replay h.ndjson --aid gravity --until 0.05 --calibration a.toml --save-calibration b.toml";
    strapd(at, again).done();
    let (a, b) = (saved(at, "a.toml"), saved(at, "b.toml"));
    assert_eq!(
        b,
        SensorCalibration {
            date: b.date.clone(),
            ..a.clone()
        }
    );
    // And with the rest of the log it is the same sensor still, known no worse.
    let again = "replay h.ndjson --aid gravity --calibration a.toml --save-calibration c.toml";
    strapd(at, again).done();
    let c = saved(at, "c.toml");
    assert_eq!(
        (c.force, c.field_lead, c.truncation_step),
        (a.force, a.field_lead, a.truncation_step)
    );
    let (a, c) = (a.gyro.unwrap(), c.gyro.unwrap());
    for i in 0..9 {
        let sigma = a.sigma_of(i).unwrap();
        assert!(c.sigma_of(i).unwrap() <= sigma);
        assert!((a.value[i] - c.value[i]).abs() < 3.0 * sigma, "{a:?} {c:?}");
    }
}

#[test]
fn a_calibration_is_of_the_sensors_axes_however_it_is_mounted() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "h.ndjson", 1, 60);
    // Axes in turn: the priors of scale and of angles between axes are those of either.
    let third = "--body ZXY --mount q=0.5,0.5,0.5,0.5";
    for (name, flags) in [("a", ""), ("b", "--mount q=0.5,0.5,0.5,0.5"), ("c", third)] {
        let run = format!("replay h.ndjson --aid gravity --save-calibration {name}.toml {flags}");
        strapd(at, &run).done();
    }
    for name in ["b.toml", "c.toml"] {
        let (a, b) = (saved(at, "a.toml"), saved(at, name));
        let all = |c: &SensorCalibration| {
            let (bias, ba) = (c.bias.unwrap().value, c.force_bias.unwrap().value);
            let scale = c.gyro.unwrap().value;
            [bias.as_slice(), ba.as_slice(), scale.as_slice()].concat()
        };
        for (one, other) in all(&a).iter().zip(all(&b)) {
            assert!((one - other).abs() < 1e-7, "{a:?} {b:?}");
        }
    }
    // Taken out under any mounting it is the same sensor: the attitude is the other's, turned.
    let q = UnitQuaternion::from_quaternion(Quaternion::new(0.8, 0.1, -0.5, 0.3));
    let [x, y, z, w]: [f64; 4] = q.coords.into();
    let run = |flags: &str| {
        let run =
            format!("replay h.ndjson --aid gravity --calibration a.toml -o - --quiet {flags}");
        attitudes(&strapd(at, &run).done().out, "")
    };
    let plain = run("");
    let turned = run(&format!("--mount q={w},{x},{y},{z}"));
    assert_eq!(plain.len(), turned.len());
    for ((t, one), (_, other)) in plain.iter().zip(&turned) {
        // C_bs takes the sensor's axes to the body's, and the heading of the start is each body's own.
        let off = (one * q.inverse()) * other.inverse();
        let tilt = 2.0 * off.i.hypot(off.j).asin();
        // Rest is looked for axis by axis, and so begins a few samples sooner or later.
        assert!(tilt < 1e-3, "{t}: {tilt}");
    }
}

#[test]
fn what_is_no_calibration_of_this_sensor_is_refused_or_said() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "h.ndjson", 1, 5);
    std::fs::write(
        at.join("bias.toml"),
        "sensor = 'other'\nbias = [0.01, 0, 0]\n",
    )
    .unwrap();
    std::fs::write(at.join("bad.toml"), "[bias]\nvalue = [1, 2, nan]\n").unwrap();
    std::fs::write(at.join("large.toml"), vec![b'#'; 70_000]).unwrap();
    std::fs::write(at.join("bytes.toml"), [0xff, 0xfe]).unwrap();
    std::fs::create_dir(at.join("folder")).unwrap();
    for (flags, words) in [
        (
            "--calibration bad.toml",
            &["bad.toml", "line 2", "bias.value"] as &[&str],
        ),
        ("--calibration large.toml", &["large.toml", "64 KiB"]),
        ("--calibration bytes.toml", &["bytes.toml", "no text"]),
        ("--calibration folder", &["folder", "is a folder"]),
        (
            "--calibration bias.toml --bias 0.1,0,0",
            &["--bias", "calibration"],
        ),
        (
            "--save-calibration h.ndjson --aid gravity",
            &["h.ndjson", ".toml"],
        ),
        (
            "--save-calibration a.toml --aid none",
            &["--save-calibration", "--aid"],
        ),
        (
            "--save-calibration a.toml --aid auto --topic all",
            &["--topic NAME"],
        ),
    ] {
        strapd(at, &format!("replay h.ndjson {flags}")).refused(2, words);
    }
    strapd(at, "replay h.ndjson --calibration no.toml").refused(1, &["no.toml"]);
    strapd(
        at,
        "replay h.ndjson --aid gravity --save-calibration bias.toml",
    )
    .refused(1, &["--force"]);
    strapd(
        at,
        "replay h.ndjson h.ndjson --aid gravity --save-calibration a.toml",
    )
    .refused(2, &["{stem}"]);
    let said = strapd(at, "replay h.ndjson --calibration bias.toml")
        .done()
        .out
        .clone();
    assert!(said.contains("`other`") && said.contains("`imu`"), "{said}");
    // A fifth of a bar nobody has measured: taken out, and known no better than before.
    assert!(said.contains("as calibrated"), "{said}");
}

/// A truncation that the data of a stream cannot show in time.
#[test]
fn a_known_step_of_truncation_is_undone_in_what_can_be_read_only_once() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    log(at, "h.ndjson", 1, 5);
    std::fs::write(at.join("c.toml"), "truncation_step = 0.001\n").unwrap();
    let lines = std::fs::read(at.join("h.ndjson")).unwrap();
    let run = |flags: &str| {
        let replay = format!("replay - -o - --quiet {flags}");
        attitudes(&strapd_fed(at, &replay, lines.clone()).done().out, "")
    };
    for aid in ["none", "gravity"] {
        let by_flag = run(&format!("--aid {aid} --undo-truncation on=0.001"));
        assert_eq!(run(&format!("--aid {aid} --calibration c.toml")), by_flag);
        let off = format!("--aid {aid} --calibration c.toml --undo-truncation off");
        assert_eq!(run(&off), run(&format!("--aid {aid}")));
        assert_ne!(by_flag, run(&format!("--aid {aid}")));
    }
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn the_same_recording_saves_the_same_bytes_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let log = shared("logs/broad/01_undisturbed_slow_rotation_A.mcap").unwrap();
    let mut texts = Vec::new();
    for threads in [1, 2] {
        let run = format!(
            "replay {} --aid gravity --topic /imu/data --until 60 --threads {threads} --save-calibration {threads}.toml",
            log.display()
        );
        strapd(at, &run).done();
        texts.push(std::fs::read_to_string(at.join(format!("{threads}.toml"))).unwrap());
    }
    assert_eq!(texts[0], texts[1]);
    // The driver of this sensor cuts: in steps of 0.061 deg/s.
    let step = parse(&texts[0]).unwrap().step().unwrap();
    assert!((step - 1.0653e-3).abs() < 2e-6, "{step}");
}
