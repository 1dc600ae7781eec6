//! Findings of a recorded orientation about the gyro's bias and sigma, and what it must not be believed in.

use super::{codes, flags, found};
use crate::made_logs::{ImuSample, START, written};
use crate::program::strapd;
use crate::replays::fixture;
use serde_json::Value;
use std::path::Path;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::Quaternion;
use strapd_bodies::motion::BandLimited;

const HZ: i64 = 100;

/// A minute in the hand, without a rest; exact but for what `spoil` does.
fn moved(seed: u64, spoil: impl Fn(&mut ImuSample, Quaternion<Nav, Body>)) -> Vec<ImuSample> {
    let mut motion = BandLimited::random(seed, 0.8, 1.5, 6).unwrap();
    (0..60 * HZ)
        .map(|k| {
            let spin = motion.at_nanos((k * 1_000_000_000 / HZ) as u64);
            let q = spin.q_nb.normalised();
            let up = q.to_dcm().as_matrix().transpose() * nalgebra::Vector3::z();
            let mut sample = ImuSample {
                stamp: START + k * 1_000_000_000 / HZ,
                orientation: Some(q.wxyz()),
                gyro: spin.w_nb_b.into(),
                gyro_covariance_0: 0.0,
                accel: (up * 9.80665).into(),
            };
            spoil(&mut sample, q);
            sample
        })
        .collect()
}

/// The ADIS16448 of EuRoC: 4.5 deg/s, 16,000 deg/h.
const BIAS: [f64; 3] = [-0.0022, 0.0208, 0.0758];

fn biased(sample: &mut ImuSample) {
    sample.gyro = std::array::from_fn(|i| sample.gyro[i] + BIAS[i]);
}

/// `--against-recorded` of the log, with flags.
fn against(dir: &Path, flags: &str) -> Value {
    let ran = strapd(
        dir,
        &format!("replay log.mcap -o null: --json --against-recorded {flags}"),
    );
    ran.json()["topics"][0]["recorded"].clone()
}

fn after_long(recorded: &Value, at: usize) -> f64 {
    recorded["bias_left"]["over_long_deg"][at].as_f64().unwrap()
}

#[test]
fn a_gyro_that_is_off_by_16000_degrees_an_hour_is_told_with_the_bias_that_cures_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = written(dir.path(), "log.mcap", &moved(1, |s, _| biased(s)));
    let found = found(&path);
    assert_eq!(codes(&found), ["beyond-sigma", "bias-by-orientation"]);
    let bias = found
        .iter()
        .find(|f| f.code == "bias-by-orientation")
        .unwrap();
    let given: Vec<f64> = flags(bias)
        .strip_prefix("--bias ")
        .unwrap()
        .split(',')
        .map(|v| v.parse().unwrap())
        .collect();
    for (given, bias) in given.iter().zip(BIAS) {
        // Rates are taken for those of the stamp and interpolated: exact to 1e-5 rad/s.
        assert!((given - bias).abs() < 2e-5, "{bias:?}");
    }
    let beyond = found.iter().find(|f| f.code == "beyond-sigma").unwrap();
    assert_eq!(beyond.help, bias.help);

    let before = against(dir.path(), "");
    assert_eq!(before["sigma"]["beyond_3_sigma"], true, "{before}");
    let after = against(dir.path(), &flags(bias));
    assert_eq!(after["sigma"]["beyond_3_sigma"], false, "{after}");
    assert_eq!(after["bias_left"]["worth_removing"], false, "{after}");
    let (before, after) = (after_long(&before, 0), after_long(&after, 0));
    assert!(before > 20.0 && after < 0.05, "{before} to {after} deg");
}

#[test]
fn nothing_is_advised_where_there_is_no_bias_or_the_reference_is_of_something_else() {
    let dir = tempfile::tempdir().unwrap();
    let of = |samples: &[ImuSample]| codes(&found(&written(dir.path(), "log.mcap", samples)));
    for seed in [1, 2, 3] {
        assert_eq!(
            of(&moved(seed, |_, _| ())),
            Vec::<&str>::new(),
            "seed {seed}"
        );
    }
    // A tenth of a degree a second under a class that says one: a bias, but no lie.
    let small = of(&moved(1, |s, _| s.gyro[2] += 0.0017));
    assert_eq!(small, ["bias-by-orientation"]);
    // The same bias, but the orientation is that of other axes.
    let half = 0.5f64.sqrt();
    let turn: Quaternion<Body, Body> = Quaternion::assume_unit([half, half, 0.0, 0.0]);
    let turned = of(&moved(1, |s, q| {
        biased(s);
        s.orientation = Some((q * turn).normalised().wxyz());
    }));
    assert!(turned.contains(&"orientation-other-axes"), "{turned:?}");
    assert!(!turned.contains(&"bias-by-orientation") && !turned.contains(&"beyond-sigma"));
    // Of another body altogether.
    let other = moved(7, |_, _| ());
    let mut unrelated = moved(1, |_, _| ());
    for (sample, other) in unrelated.iter_mut().zip(&other) {
        sample.orientation = other.orientation;
    }
    let unrelated = of(&unrelated);
    assert!(!unrelated.contains(&"bias-by-orientation"), "{unrelated:?}");
    assert!(
        unrelated
            .iter()
            .any(|code| code.starts_with("orientation-")),
        "{unrelated:?}"
    );
}

#[test]
fn the_same_is_said_of_an_attitude_in_a_file_of_any_format() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "log.mcap", &moved(1, |s, _| biased(s)));
    for output in ["a.mcap", "a.ndjson", "a.csv"] {
        strapd(dir.path(), &format!("replay log.mcap -o {output} --quiet")).done();
        let said = strapd(dir.path(), &format!("compare {output} log.mcap --json")).json();
        let sigma = &said["sigma"];
        assert_eq!(sigma["beyond_3_sigma"], true, "{output}: {said}");
        // MCAP has the whole covariance, the others its diagonal: turned into the world's axes that is near it.
        let share = sigma["heading"]["within_3_sigma"].as_f64().unwrap();
        assert!(share < 0.9, "{output}: {sigma}");
        let left = said["bias_left"]["bias_rad_s"]["z"].as_f64().unwrap();
        assert!((left - BIAS[2]).abs() < 2e-5, "{output}: {said}");
        let text = strapd(dir.path(), &format!("compare {output} log.mcap"));
        assert!(
            text.done().out.contains("the error is beyond 3 sigma"),
            "{text:?}"
        );
    }
    // An attitude that is good says so, and nothing of a bias.
    strapd(
        dir.path(),
        "replay log.mcap -o good.mcap --quiet --bias -0.0022,0.0208,0.0758",
    )
    .done();
    let good = strapd(dir.path(), "compare good.mcap log.mcap --json").json();
    assert_eq!(good["sigma"]["beyond_3_sigma"], false, "{good}");
    assert_eq!(good["bias_left"], Value::Null, "{good}");
}

#[test]
fn an_attitude_of_other_body_axes_is_said_to_be_one_by_compare() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "log.mcap", &moved(1, |_, _| ()));
    for (mount, angle) in [("", None), ("--mount rpy=0,0,40", Some(40.0))] {
        let replay = format!("replay log.mcap -o a.mcap --force --quiet {mount}");
        strapd(dir.path(), &replay).done();
        let said = strapd(dir.path(), "compare a.mcap log.mcap --json").json();
        let found = said["other_axes"]["angle_deg"].as_f64();
        let off = found.zip(angle).map(|(found, angle)| found - angle);
        assert_eq!(found.is_some(), angle.is_some(), "{said}");
        assert!(off.is_none_or(|off: f64| off.abs() < 1.0), "{said}");
        let ran = strapd(dir.path(), "compare a.mcap log.mcap");
        let text = &ran.done().out;
        assert_eq!(
            text.contains("--base-frame NAME"),
            angle.is_some(),
            "{text}"
        );
    }
}

#[test]
fn a_summary_says_what_its_sigma_is_made_of() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "log.mcap", &moved(1, |_, _| ()));
    let terms = |flags: &str| {
        let ran = strapd(
            dir.path(),
            &format!("replay log.mcap -o null: --json {flags}"),
        );
        ran.json()["topics"][0]["sigma_terms"].clone()
    };
    let alone = terms("--noise tactical --bias 0,0,1e-3");
    assert_eq!(alone["by"], "noise");
    assert_eq!(alone["class"], "tactical");
    for (name, value) in [
        ("white_noise", 0.15),
        ("flicker", 0.85),
        ("turn_on_bias", 0.03 * 2.8e-3),
        ("scale", 0.05),
        ("axes", 1e-3f64.to_degrees()),
        ("initial_tilt", 0.0),
        ("bridged_gaps", 0.0),
        ("rate_random_walk", 0.0),
    ] {
        let said = alone["terms"][name]["value"].as_f64();
        let said = said.unwrap_or_else(|| panic!("{name}: {alone}"));
        assert!(
            (said - value).abs() < 1e-9 * value.max(1.0),
            "{name}: {said}"
        );
    }
    let aided = terms("--aid gravity");
    assert_eq!(aided["by"], "filter", "{aided}");
    assert!(
        aided["terms"]["accelerometer_bias"]["value"]
            .as_f64()
            .unwrap()
            > 0.0,
        "{aided}"
    );
    assert_eq!(aided["terms"]["delay"]["value"], 2.0, "{aided}");
    let industrial = terms("--aid gravity --noise industrial");
    assert_eq!(industrial["terms"]["delay"]["value"], 1.0, "{industrial}");
    assert_eq!(industrial["terms"]["case"]["value"], 1.5e-3f64.to_degrees());
    let text = strapd(dir.path(), "replay log.mcap -o null:").out;
    assert!(
        text.contains("of (class consumer, --noise): white noise 0.84 deg/sqrt(h)"),
        "{text}"
    );
}

#[test]
fn info_says_what_may_correct_the_attitude_from_file_and_pipe_alike() {
    let dir = tempfile::tempdir().unwrap();
    let lines = |force: f64, field: bool| {
        (0..300)
            .map(|k| {
                let mag = if field { ",\"mag\":[0.2,0,-0.45]" } else { "" };
                format!(
                    "{{\"stamp\":{{\"sec\":100,\"nsec\":{}}},\"gyro\":[0,0.1,0],\"accel\":[0,0,{force}]{mag}}}\n",
                    k * 3_000_000
                )
            })
            .collect::<String>()
    };
    let said = |text: &str| {
        std::fs::write(dir.path().join("log.ndjson"), text).unwrap();
        let file = strapd(dir.path(), "info log.ndjson --json").json();
        let piped = crate::program::strapd_fed(dir.path(), "info - --json", text).json();
        assert_eq!(file["imu"][0]["aid"], piped["imu"][0]["aid"]);
        (
            file["imu"][0]["aid"].clone(),
            strapd(dir.path(), "info log.ndjson").out,
        )
    };
    let (aid, text) = said(&lines(9.8, false));
    assert_eq!(aid["auto"], "gravity", "{aid}");
    assert_eq!(aid["force"]["unit"], "m/s^2", "{aid}");
    assert_eq!(aid["field"], Value::Null, "{aid}");
    assert!(text.contains("--aid auto takes gravity"), "{text}");
    let (aid, text) = said(&lines(1.0, true));
    assert_eq!(aid["force"]["unit"], "g", "{aid}");
    assert_eq!(aid["field"]["unit"], "G", "{aid}");
    assert!(
        text.contains("--aid gravity+mag takes the heading"),
        "{text}"
    );
    // A phone's acceleration without gravity.
    let (aid, text) = said(&lines(0.1, false));
    assert_eq!(aid["auto"], "none", "{aid}");
    assert_eq!(aid["force"]["plausible"], false, "{aid}");
    assert!(text.contains("force_implausible"), "{text}");
    // What auto would do it does.
    std::fs::write(dir.path().join("log.ndjson"), lines(0.1, false)).unwrap();
    let replayed = strapd(dir.path(), "replay log.ndjson -o null: --json --aid auto");
    assert_eq!(replayed.json()["topics"][0]["aid"], Value::Null);
}

/// A minute of a gyro alone at 100 Hz, of a motion of this size, beside its orientation; exact but for the factor of its
/// rates.
fn gyro_alone(dir: &Path, size: f64, factor: f64) {
    let mut motion = BandLimited::random(7, size, 1.5, 6).unwrap();
    let mut table = String::from("stamp_ns,gyro_x,gyro_y,gyro_z,qw,qx,qy,qz\n");
    for k in 0..60 * HZ {
        let nanos = k * 1_000_000_000 / HZ;
        let spin = motion.at_nanos(nanos as u64);
        let rate: [f64; 3] = (spin.w_nb_b * factor).into();
        let numbers = rate.into_iter().chain(spin.q_nb.normalised().wxyz());
        let cells: Vec<String> = numbers.map(|number| number.to_string()).collect();
        table += &format!("{},{}\n", START + nanos, cells.join(","));
    }
    std::fs::write(dir.join("gyro.csv"), table).unwrap();
}

/// Code, severity and first advice of what is wrong in the log by these flags.
fn wrong(dir: &Path, flags: &str) -> Vec<[String; 3]> {
    wrong_in(dir, "gyro.csv", flags)
}

fn wrong_in(dir: &Path, log: &str, flags: &str) -> Vec<[String; 3]> {
    let ran = strapd(dir, &format!("check {log} --json {flags}"));
    let json: Value = serde_json::from_str(&ran.out).unwrap();
    let word = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let findings = json["findings"].as_array().unwrap().iter();
    findings
        .map(|f| [&f["code"], &f["severity"], &f["flags"]].map(word))
        .filter(|[_, severity, _]| severity != "note")
        .collect()
}

#[test]
fn an_orientation_tells_the_unit_of_a_gyro_without_an_accelerometer() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    gyro_alone(at, 0.8, 1.0);
    assert_eq!(wrong(at, ""), Vec::<[String; 3]>::new());
    let cure = ["gyro-scale", "error", "--gyro-unit rad, or --mend"];
    for unit in ["deg", "mrad"] {
        assert_eq!(wrong(at, &format!("--gyro-unit {unit}")), [cure]);
        let mended = wrong(at, &format!("--gyro-unit {unit} --mend"));
        assert_eq!(mended, Vec::<[String; 3]>::new());
    }
    // At 50 Hz an angle a sample is nearly a rate in degrees.
    let xsens = wrong_in(
        at,
        fixture("xsens_mti.mcap").to_str().unwrap(),
        "--gyro-unit deg",
    );
    assert_eq!(xsens, [cure]);
    // Degrees of a motion so slow that nobody doubts their size.
    gyro_alone(at, 0.05, 1_f64.to_degrees());
    let cure = ["gyro-scale", "error", "--gyro-unit deg, or --mend"];
    assert_eq!(wrong(at, ""), [cure]);
}

#[test]
fn an_orientation_that_turns_as_far_refutes_a_scale_that_accelerations_look_like() {
    let dir = tempfile::tempdir().unwrap();
    let runner = "simulate running --worn foot --duration 120 --rate-hz 100 --seed 843";
    strapd(
        dir.path(),
        &format!("{runner} --noise consumer_mems -o gyro.csv"),
    )
    .done();
    let is_scale = |found: &[String; 3]| found[0] == "gyro-scale";
    assert!(!wrong(dir.path(), "").iter().any(is_scale));
    // Without it the accelerometer is believed.
    let named = "--columns orientation=none";
    assert!(wrong(dir.path(), named).iter().any(is_scale));
}

#[test]
fn a_meaning_that_is_certain_is_the_only_cause_that_is_named() {
    let dir = tempfile::tempdir().unwrap();
    gyro_alone(dir.path(), 0.8, 1.0);
    let cure = ["sample-kind", "error", "--sample-kind rate"];
    assert_eq!(wrong(dir.path(), "--sample-kind delta-angle"), [cure]);
}

/// Codes of a minute in the hand, spoilt, and the first advice of the first.
fn of_spoilt(samples: &[ImuSample]) -> (Vec<&'static str>, String) {
    let dir = tempfile::tempdir().unwrap();
    let found = found(&written(dir.path(), "log.mcap", samples));
    let help = found.first().map(flags).unwrap_or_default();
    (codes(&found), help)
}

#[test]
fn an_orientation_of_another_clock_is_told_with_its_shift_and_blamed_for_nothing_else() {
    let sound = moved(3, |_, _| ());
    assert_eq!(of_spoilt(&sound).0, Vec::<&str>::new());
    for late in [-40_isize, 25, 120] {
        let last = sound.len() - 1;
        let mut shifted = sound.clone();
        for (i, sample) in shifted.iter_mut().enumerate() {
            let then = i.saturating_add_signed(-late).min(last);
            sample.orientation = sound[then].orientation;
        }
        assert_eq!(of_spoilt(&shifted).0, ["orientation-shifted"], "{late}");
        let dir = tempfile::tempdir().unwrap();
        written(dir.path(), "log.mcap", &shifted);
        strapd(dir.path(), "replay log.mcap -o est.mcap").done();
        let ran = strapd(dir.path(), "compare est.mcap log.mcap --json");
        let found = ran.json()["late_s"].as_f64().unwrap();
        assert!((found - late as f64 * 0.01).abs() < 5e-3, "{late}: {found}");
    }
}

#[test]
fn a_clock_at_half_speed_is_a_factor_between_gyro_and_orientation() {
    let mut slow = moved(4, |sample, _| sample.accel = [0.0; 3]);
    slow.iter_mut()
        .for_each(|sample| sample.stamp = START + (sample.stamp - START) / 2);
    let (codes, help) = of_spoilt(&slow);
    assert!(codes.contains(&"gyro-scale"), "{codes:?}");
    assert!(help.starts_with("--gyro-scale 2"), "{help}");
}

#[test]
fn an_accelerometer_that_two_others_contradict_is_the_one_that_is_wrong() {
    let mirrored = moved(5, |sample, _| sample.accel[0] *= -1.0);
    let (codes, help) = of_spoilt(&mirrored);
    assert_eq!(codes, ["accel-axes"]);
    assert!(help.contains("--accel-axes xYZ"), "{help}");
    // No map of the gyro shows a sign of all axes, and gravity stands as still.
    let reversed = moved(5, |sample, _| sample.accel = sample.accel.map(|a| -a));
    let dir = tempfile::tempdir().unwrap();
    written(dir.path(), "log.mcap", &reversed);
    let of = |flags: &str| wrong_in(dir.path(), "log.mcap", &format!("--aid gravity {flags}"));
    let cure = ["orientation-leans", "warning", "--accel-axes xyz"];
    assert_eq!(of(""), [cure]);
    assert_eq!(of(cure[2]), Vec::<[String; 3]>::new());
}
