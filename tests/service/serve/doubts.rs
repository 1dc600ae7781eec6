//! Findings about the samples of a live sensor: each fault within twenty seconds of motion, none of a good stream; what
//! was found outlives a `RESET` and a restart.

use super::client::Client;
use super::daemon::{Daemon, Process, TCP, eventually, listening};
use super::runs::Fed;
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::Value;
use std::path::Path;
use strapd_attitude::estimate::{Aid, EstimationSettings};

/// A sample: rad/s, m/s^2, uT.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) gyro: [f64; 3],
    accel: [f64; 3],
    mag: [f64; 3],
}

/// Seconds of rest before the motion, and of motion.
const REST: f64 = 2.0;
const MOTION: f64 = 20.0;
const HZ: f64 = 100.0;

/// A body at rest, then turned every way by hand, at 100 Hz, with the noise of a consumer sensor.
pub(super) fn good() -> Vec<Sample> {
    let mut state = 1_u64;
    let mut noise = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut attitude = UnitQuaternion::identity();
    (0..((REST + MOTION) * HZ) as usize)
        .map(|n| {
            let t = n as f64 / HZ - REST;
            let rate = match t > 0.0 {
                true => Vector3::new(
                    1.6 * (1.7 * t).sin(),
                    1.2 * (1.1 * t).sin(),
                    1.4 * (0.6 * t).sin(),
                ),
                false => Vector3::zeros(),
            };
            attitude *= UnitQuaternion::from_scaled_axis(rate / HZ);
            let to_body = attitude.inverse();
            let force = to_body * Vector3::new(0.0, 0.0, 9.81);
            let field = to_body * Vector3::new(0.0, 20.0, -44.0);
            let mut noisy = |of: Vector3<f64>, size: f64| of.map(|v| v + size * noise()).into();
            Sample {
                gyro: noisy(rate, 0.01),
                accel: noisy(force, 0.1),
                mag: noisy(field, 0.3),
            }
        })
        .collect()
}

/// The sample as a line of `id`, stamped so.
pub(super) fn line(id: &str, sample: &Sample, stamp: &str) -> String {
    let Sample { gyro, accel, mag } = sample;
    format!("{{\"id\":\"{id}\",{stamp},\"gyro\":{gyro:?},\"accel\":{accel:?},\"mag\":{mag:?}}}\n")
}

fn lines(id: &str, samples: &[Sample], from: usize) -> String {
    let stamp = |n: usize| 1_700_000_000_000_000_000 + 10_000_000 * (from + n) as u64;
    let all = samples.iter().enumerate();
    all.map(|(n, s)| line(id, s, &format!("\"stamp_ns\":{}", stamp(n))))
        .collect()
}

/// Name, change of the samples, the finding that it raises, and a part of its settings.
type Fault = (
    &'static str,
    fn(usize, &mut Sample),
    &'static str,
    &'static str,
);

const FAULTS: [Fault; 27] = [
    ("good", |_, _| {}, "", ""),
    ("absent", |_, s| s.gyro = [0.0; 3], "gyro-dead", ""),
    (
        "reversed",
        |_, s| s.gyro[0] *= -1.0,
        "gyro-axes",
        "gyro_axes xYZ",
    ),
    (
        "swapped",
        |_, s| s.gyro.swap(0, 1),
        "gyro-axes",
        "gyro_axes YXZ",
    ),
    (
        "doubled",
        |_, s| s.gyro = s.gyro.map(|v| 2.0 * v),
        "gyro-scale",
        "gyro_scale 0.5",
    ),
    (
        "halved",
        |_, s| s.gyro = s.gyro.map(|v| 0.5 * v),
        "gyro-scale",
        "gyro_scale 2",
    ),
    (
        "degrees",
        |_, s| s.gyro = s.gyro.map(f64::to_degrees),
        "unit-against-gravity",
        "gyro_unit deg",
    ),
    (
        "swapped, degrees",
        |_, s| {
            s.gyro.swap(0, 1);
            s.gyro = s.gyro.map(f64::to_degrees);
        },
        "gyro-axes",
        "gyro_unit deg",
    ),
    (
        "one axis doubled",
        |_, s| s.gyro[1] *= 2.0,
        "gyro-scale",
        ",0.",
    ),
    (
        "clipped",
        |_, s| s.gyro = s.gyro.map(|v| v.clamp(-1.1, 1.1)),
        "saturated",
        "gyro_range 1.1",
    ),
    (
        "accelerometer's glitches",
        |n, s| s.accel[0] += if n % 300 == 250 { 78.0 } else { 0.0 },
        "accel-spikes",
        "spikes keep",
    ),
    ("dead", |_, s| s.gyro[1] = 0.0, "axis-dead", ""),
    (
        "field dead",
        |_, s| s.mag[1] = 0.0,
        "field-axis-dead",
        "aid gravity",
    ),
    (
        "wraps",
        |_, s| s.gyro = s.gyro.map(|v| (v + 1.1).rem_euclid(2.2) - 1.1),
        "wrapped",
        "",
    ),
    (
        "hangs",
        |n, s| {
            if (900..1000).contains(&n) {
                s.gyro[0] = 0.731
            }
        },
        "stuck",
        "",
    ),
    (
        "glitches",
        |n, s| {
            if n % 300 == 250 {
                s.gyro[1] += 8.0
            }
        },
        "spikes",
        "",
    ),
    (
        "in g",
        |_, s| s.accel = s.accel.map(|v| v / 9.81),
        "accel-unit",
        "",
    ),
    (
        "kinematic",
        |_, s| s.accel = s.accel.map(|v| -v),
        "looks-frd",
        "accel_sign kinematic",
    ),
    (
        "field turned",
        |_, s| s.mag = [s.mag[1], -s.mag[0], s.mag[2]],
        "mag-axes",
        "mag_axes",
    ),
    (
        "field hangs",
        |_, s| s.mag = [0.5, 20.5, -44.5],
        "field-frozen",
        "",
    ),
    (
        "field at its end",
        |_, s| s.mag = s.mag.map(|v| v.clamp(-25.0, 25.0)),
        "field-saturated",
        "",
    ),
    ("no field", |_, s| s.mag = [0.0; 3], "field-empty", ""),
    (
        "degrees half way",
        |n, s| {
            if n >= 1100 {
                s.gyro = s.gyro.map(f64::to_degrees)
            }
        },
        "gyro-unit-change",
        "",
    ),
    (
        "g half way",
        |n, s| {
            if n >= 1100 {
                s.accel = s.accel.map(|v| v / 9.81)
            }
        },
        "accel-unit-change",
        "",
    ),
    (
        "other way half way",
        |n, s| {
            if n >= 1100 {
                s.accel = s.accel.map(|v| -v)
            }
        },
        "accel-unit-change",
        "",
    ),
    (
        "both in other axes half way",
        |n, s| {
            if n >= 1100 {
                s.gyro = [s.gyro[0], s.gyro[2], -s.gyro[1]];
                s.accel = [s.accel[0], s.accel[2], -s.accel[1]];
                s.mag = [s.mag[0], s.mag[2], -s.mag[1]];
            }
        },
        "gravity-leap",
        "",
    ),
    (
        "two",
        |n, s| {
            if n % 2 == 1 {
                s.accel = [s.accel[2], s.accel[0], s.accel[1]];
                s.gyro = [s.gyro[2], s.gyro[0], s.gyro[1]];
            }
        },
        "two-sensors",
        "",
    ),
];

fn faulty(fault: fn(usize, &mut Sample)) -> Vec<Sample> {
    let mut samples = good();
    samples
        .iter_mut()
        .enumerate()
        .for_each(|(n, s)| fault(n, s));
    samples
}

fn source<'a>(status: &'a Value, id: &str) -> Option<&'a Value> {
    status["sources"].as_array()?.iter().find(|s| s["id"] == id)
}

pub(super) fn codes(status: &Value, id: &str) -> Vec<String> {
    let found = source(status, id).and_then(|s| s["findings"].as_array());
    let found = found.into_iter().flatten();
    let found = found.filter(|f| f["severity"] != "note");
    found
        .map(|f| f["code"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn each_fault_is_found_within_twenty_seconds_of_motion_and_a_good_stream_has_no_finding() {
    let daemon = Daemon::start(listening(&[TCP]));
    let mut wrong = Vec::new();
    for (id, fault, code, helps) in FAULTS {
        let samples = faulty(fault);
        let mut sender = Client::tcp(daemon.address(0));
        sender.send_bytes(lines(id, &samples, 0).as_bytes());
        eventually("all samples", || {
            source(&daemon.status(), id).is_some_and(|s| s["samples"] == samples.len())
        });
        let status = daemon.status();
        let found = source(&status, id).unwrap()["findings"]
            .as_array()
            .unwrap()
            .clone();
        let found: Vec<&Value> = found.iter().filter(|f| f["severity"] != "note").collect();
        let is_as_expected = match code {
            "" => found.is_empty(),
            code => found.iter().any(|f| {
                f["code"] == code
                    && f["flags"]
                        .as_str()
                        .is_some_and(|flags| flags.contains(helps))
            }),
        };
        if !is_as_expected {
            wrong.push(format!("{id}: {found:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn started(state: &Path, more: &[&str]) -> Process {
    let args = ["--listen", TCP, "--state", state.to_str().unwrap()];
    Process::start(&[&args[..], more].concat())
}

fn status_of(process: &Process) -> Value {
    let mut client = Client::tcp(process.address(0));
    client.object("VERSION");
    client.send("{\"class\":\"POLL\"}");
    client.object("STATUS")
}

#[test]
fn what_was_found_outlives_a_reset_and_a_restart_but_not_the_setting_that_cures_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("state.json");
    let samples = faulty(|_, s| s.gyro.swap(0, 1));
    let (first, later) = samples.split_at(samples.len() - 100);
    let mut process = started(&path, &["--aid", "auto"]);
    let mut sender = Client::tcp(process.address(0));
    sender.send_bytes(lines("imu0", first, 0).as_bytes());
    let says = |process: &Process| codes(&status_of(process), "imu0") == ["gyro-axes"];
    eventually("the finding", || says(&process));
    sender.send("{\"class\":\"RESET\",\"id\":\"imu0\"}");
    sender.send_bytes(lines("imu0", &later[..50], first.len()).as_bytes());
    let samples = |process: &Process| {
        source(&status_of(process), "imu0").map_or(0, |s| s["samples"].as_u64().unwrap())
    };
    eventually("samples after the reset", || {
        samples(&process) == first.len() as u64 + 50
    });
    assert!(says(&process), "{}", status_of(&process));
    eventually("the finding in the file", || {
        std::fs::read_to_string(&path).is_ok_and(|text| text.contains("gyro-axes"))
    });
    process.child.kill().unwrap();
    process.child.wait().unwrap();

    let after = |process: &Process| {
        let mut sender = Client::tcp(process.address(0));
        sender.send_bytes(lines("imu0", &later[50..], first.len() + 50).as_bytes());
        eventually("samples", || samples(process) == 50);
        codes(&status_of(process), "imu0")
    };
    let kept = std::fs::read(&path).unwrap();
    let mut process = started(&path, &["--aid", "auto"]);
    // What was saved may be some samples older than what had come: a gap, which is said, too.
    assert!(after(&process).contains(&"gyro-axes".to_owned()));
    process.child.kill().unwrap();
    process.child.wait().unwrap();
    std::fs::write(&path, kept).unwrap();
    let process = started(&path, &["--aid", "auto", "--gyro-axes", "YXZ"]);
    assert!(!after(&process).contains(&"gyro-axes".to_owned()));
}

/// Attitudes of a daemon that is sent these, and its findings.
fn attitudes(aid: Aid, samples: &[Sample]) -> (Vec<Value>, Vec<String>) {
    let plan = EstimationSettings {
        aid,
        ..EstimationSettings::default()
    };
    let mut daemon = Fed::of(&plan);
    let text = lines("imu0", samples, 0);
    let got = daemon.lines(text.lines().map(str::to_owned));
    let status: Value = serde_json::from_slice(&daemon.hub.status()).unwrap();
    let attitudes = got.attitudes.iter();
    let attitudes = attitudes.map(|a| serde_json::from_str(a).unwrap());
    (attitudes.collect(), codes(&status, "imu0"))
}

fn rotation(attitude: &Value) -> UnitQuaternion<f64> {
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|c| attitude["q"][c].as_f64().unwrap());
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
}

#[test]
fn a_spike_in_a_stream_is_taken_back_with_the_sample_that_shows_it() {
    let good = good();
    for aid in [Aid::None, Aid::Auto] {
        let (clean, none) = attitudes(aid, &good);
        assert!(none.is_empty(), "{none:?}");
        for size in [8.0, -30.0, 60.0] {
            let mut spiked = good.clone();
            spiked[1200].gyro[1] += size;
            let (found, said) = attitudes(aid, &spiked);
            assert_eq!(said, ["spikes"], "{size}");
            let off = |n: usize| {
                rotation(&found[n])
                    .angle_to(&rotation(&clean[n]))
                    .to_degrees()
            };
            assert!(off(1200) > 1.0, "it had left");
            let is_marked =
                |a: &&Value| a["status"].as_array().unwrap().contains(&"repaired".into());
            let first = found.iter().position(|a| is_marked(&a)).unwrap();
            assert!(first <= 1202 && found.iter().filter(is_marked).count() == 1);
            // The line between its neighbours is not quite what the body did.
            let worst = (first..found.len()).map(off).fold(0.0, f64::max);
            assert!(worst < 0.05, "{aid:?} {size}: {worst} degrees");
        }
    }
}
