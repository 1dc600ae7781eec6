//! Promise: the tree of frames of a robot stays one: `--tf`, `--world-frame`, `--frame-id` say which transform is written,
//! `--base-frame` gives the attitude of the robot by the mounting in its own `/tf_static`, and a copied `/tf` has one channel.

use crate::program::strapd;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn oracle(what: &str, path: &Path) -> String {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/robot.py");
    let output = Command::new(python)
        .arg(script)
        .arg(what)
        .arg(path)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout).unwrap()
}

/// Transforms of a replay of the robot's recording with these flags.
fn replayed(at: &Path, flags: &str) -> Value {
    let replay = "replay robot.mcap --aid gravity -q --force -o out.mcap";
    strapd(at, &format!("{replay} {flags}")).done();
    serde_json::from_str(&oracle("read", &at.join("out.mcap"))).unwrap()
}

fn parent<'v>(read: &'v Value, child: &str) -> Option<&'v str> {
    read["last"][child][0].as_str()
}

/// Roll and yaw of a transform, degrees, by its quaternion.
fn roll_and_yaw(read: &Value, child: &str) -> [f64; 2] {
    let [w, x, y, z] = [0, 1, 2, 3].map(|n| read["last"][child][1][n].as_f64().unwrap());
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    [roll, yaw].map(f64::to_degrees)
}

#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn a_robots_tree_stays_one_and_its_base_has_the_attitude() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    oracle("write", &at.join("robot.mcap"));
    // The sensor itself: upside down, a child of the world.
    let sensor = replayed(at, "");
    assert_eq!(parent(&sensor, "imu_link"), Some("world"));
    assert!(roll_and_yaw(&sensor, "imu_link")[0].abs() > 179.0);
    // The robot: upright, turning to the left as it truly does, and only the base has a parent.
    let robot = replayed(at, "--base-frame base_link --world-frame odom --copy-input");
    assert_eq!(parent(&robot, "base_link"), Some("odom"));
    assert_eq!(parent(&robot, "imu_link"), None);
    assert_eq!(parent(&robot, "wheel"), Some("base_link"));
    assert_eq!(
        (&robot["channels"], &robot["transforms"]),
        (&1.into(), &550.into())
    );
    let [roll, yaw] = roll_and_yaw(&robot, "base_link");
    assert!(roll.abs() < 0.1, "{roll}");
    let turned = (0.5_f64 * 4.99).to_degrees();
    assert!(
        (yaw - turned).abs() < 1.0 || (yaw - turned).abs() > 359.0,
        "{yaw}, {turned}"
    );
    // The other way round, and none.
    let reverse = replayed(at, "--tf reverse --base-frame base_link");
    assert_eq!(parent(&reverse, "world"), Some("base_link"));
    let [_, back] = roll_and_yaw(&reverse, "world");
    assert!((back + yaw).abs() < 1e-6, "{back} {yaw}");
    // Copied beside its own tree, the sensor would have two parents; and how it is mounted is no attitude of it.
    let torn = strapd(at, "replay robot.mcap --copy-input --force -o torn.mcap -v");
    let both = format!("{}{}", torn.out, torn.err);
    assert!(
        both.contains("imu_link hangs on base_link by /tf_static")
            && both.contains("--base-frame base_link"),
        "{both}"
    );
    let report = strapd(at, "report robot.mcap --force -o robot.html");
    assert!(!report.err.contains("from the reference"), "{report:?}");
    assert_eq!(
        parent(&replayed(at, "--frame-id body"), "body"),
        Some("world")
    );
    let none = replayed(at, "--tf none");
    assert_eq!(
        (&none["channels"], &none["transforms"]),
        (&0.into(), &0.into())
    );
    let copied = replayed(at, "--tf none --copy-input");
    assert_eq!(
        (&copied["channels"], &copied["transforms"]),
        (&1.into(), &50.into())
    );
    for (flags, says) in [
        ("--base-frame nowhere", "does not say how"),
        (
            "--base-frame base_link --mount q=1,0,0,0",
            "cannot be used with",
        ),
    ] {
        let ran = strapd(
            at,
            &format!("replay robot.mcap {flags} --force -o out2.mcap"),
        );
        assert!(ran.code != Some(0) && ran.err.contains(says), "{ran:?}");
    }
    // What judges the attitude takes the same frame.
    let roll = |flags: &str| {
        let page = strapd(
            at,
            &format!("report robot.mcap --json --aid gravity {flags}"),
        )
        .json();
        let angle = page["topics"][0]["replay"]["final"]["roll_deg"].as_f64();
        angle.unwrap_or_else(|| panic!("{page:#}"))
    };
    let rolls = [roll(""), roll("--base-frame base_link")];
    assert!(rolls[0].abs() > 179.0 && rolls[1].abs() < 0.1, "{rolls:?}");
    let check = strapd(at, "check robot.mcap --base-frame nowhere");
    assert!(check.err.contains("does not say how"), "{check:?}");
}

#[test]
fn a_recording_without_frames_says_what_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/xsens_mti.mcap");
    let asked = format!("replay {fixture} --base-frame base_link -o out.mcap");
    strapd(dir.path(), &asked).refused(1, &["there is no /tf_static", "--mount"]);
}
