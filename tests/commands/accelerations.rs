//! Promise: `--linear-acceleration` gives what a moving body accelerates by, without gravity, in every format alike, as
//! well as its sigma says; and where no vertical is known it gives nothing.

use crate::program::strapd;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Gravity of the simulator, m/s^2.
const GRAVITY: f64 = 9.806_65;
const NAME: &str = "linear_acceleration";

/// Columns of a table by name; what is no number is NaN.
fn columns(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(Into::into).collect();
    let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for row in reader.records() {
        for (name, cell) in names.iter().zip(&row.unwrap()) {
            let column = columns.entry(name.clone()).or_default();
            column.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

fn vectors(of: &BTreeMap<String, Vec<f64>>, name: &str) -> Vec<Vector3<f64>> {
    let [x, y, z] = ["x", "y", "z"].map(|axis| &of[&format!("{name}_{axis}")]);
    (0..x.len())
        .map(|n| Vector3::new(x[n], y[n], z[n]))
        .collect()
}

/// Acceleration of the body, its axes, by the forces of a sensor without errors and the true attitude.
fn truth(samples: &BTreeMap<String, Vec<f64>>) -> Vec<Vector3<f64>> {
    let forces = vectors(samples, "accel");
    let up = |n: usize| {
        let [w, x, y, z] = ["qw", "qx", "qy", "qz"].map(|part| samples[part][n]);
        let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        q.inverse() * Vector3::new(0.0, 0.0, GRAVITY)
    };
    forces.iter().enumerate().map(|(n, f)| f - up(n)).collect()
}

/// Root mean square of a component's error from 10 s on, and the share within three sigma.
fn scored(at: &Path, estimate: &str) -> (f64, f64) {
    let truth = truth(&columns(&at.join("exact.csv")));
    let found = columns(&at.join(estimate));
    let (of, sigma) = (
        vectors(&found, NAME),
        vectors(&found, "sigma_linear_acceleration"),
    );
    assert_eq!(of.len(), truth.len());
    let (mut squares, mut inside, mut count) = (0.0, 0, 0);
    for n in 1000..of.len() {
        for axis in 0..3 {
            let error: f64 = of[n][axis] - truth[n][axis];
            squares += error * error;
            inside += usize::from(error.abs() <= 3.0 * sigma[n][axis]);
            count += 1;
        }
    }
    (
        (squares / count as f64).sqrt(),
        inside as f64 / count as f64,
    )
}

/// The same motion by a sensor without errors and by an ordinary one, forces and rates at the instants of their stamps.
fn hand(at: &Path) {
    let motion = "simulate hand --duration 60 --seed 5 --sample-kind rate -q";
    for (name, noise) in [("exact", ""), ("made", "--noise consumer_imu")] {
        strapd(at, &format!("{motion} {noise} -o {name}.csv")).done();
    }
}

#[test]
fn it_is_that_of_the_body_as_well_as_its_sigma_says() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    hand(at);
    let replay = "replay IN --aid gravity --sample-kind rate --linear-acceleration -q";
    for (input, how, most) in [
        ("exact", "", 0.03),
        ("exact", "--smooth", 0.03),
        ("made", "", 0.45),
        ("made", "--smooth", 0.35),
        ("made", "--method commit", 0.5),
    ] {
        let replay = replay.replace("IN", &format!("{input}.csv"));
        strapd(at, &format!("{replay} {how} --force -o out.csv")).done();
        let (rms, inside) = scored(at, "out.csv");
        println!("{input} {how}: {rms:.3} m/s^2, {inside:.3} within three sigma");
        assert!(rms < most, "{input} {how}: {rms} m/s^2");
        assert!(inside >= 0.97, "{input} {how}: {inside}");
    }
}

#[test]
fn in_every_world_it_is_the_force_less_what_holds_a_body_up() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    hand(at);
    let forces = vectors(&columns(&at.join("exact.csv")), "accel");
    for (world, up, axes) in [
        ("--world level", 9.81, Vector3::new(1.0, 1.0, 1.0)),
        // Forward, left, up becomes forward, right, down.
        (
            "--world ned --init rpy=0,0,40",
            -9.81,
            Vector3::new(1.0, -1.0, -1.0),
        ),
    ] {
        let replay = "replay exact.csv --aid gravity --sample-kind rate --linear-acceleration -q";
        strapd(at, &format!("{replay} {world} --force -o out.csv")).done();
        let found = columns(&at.join("out.csv"));
        let (body, in_world) = (
            vectors(&found, NAME),
            vectors(&found, "world_linear_acceleration"),
        );
        for n in 0..body.len() {
            let [w, x, y, z] = ["qw", "qx", "qy", "qz"].map(|part| found[part][n]);
            let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            assert!((q * body[n] - in_world[n]).norm() < 1e-9, "{world}: {n}");
            let held = Vector3::new(0.0, 0.0, up);
            let left = q * forces[n].component_mul(&axes) - held - in_world[n];
            // What is learned of an accelerometer without errors.
            assert!(left.norm() < 0.05, "{world}: {n}: {left}");
        }
    }
}

/// Reads the accelerations of an MCAP by a library that nobody here made, beside those of lines.
const READER: &str = r#"
import json, math, sys
from mcap_ros2.reader import read_ros2_messages
lines = [json.loads(line) for line in open(sys.argv[2])]
read = [m for m in read_ros2_messages(sys.argv[1]) if m.channel.topic.endswith("/linear_acceleration")]
assert len(read) == len(lines) > 100, (len(read), len(lines))
for message, line in zip(read, lines):
    found = message.ros_msg
    a, covariance = found.accel.accel, list(found.accel.covariance)
    assert [a.linear.x, a.linear.y, a.linear.z] == line["linear_acceleration"]
    assert math.isnan(a.angular.x) and math.isnan(covariance[-1])
    sigma = [math.sqrt(covariance[7 * i]) for i in range(3)]
    assert sigma == line["sigma_linear_acceleration"], (sigma, line)
    assert covariance[1] == covariance[6] and covariance[2] == covariance[12]
    stamp = found.header.stamp
    assert (stamp.sec, stamp.nanosec) == (line["stamp"]["sec"], line["stamp"]["nsec"])
print("read", len(read), read[0].schema.name, found.header.frame_id)
"#;

#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn others_read_from_an_mcap_what_the_lines_say() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/xsens_mti.mcap");
    let replay = "--aid gravity --linear-acceleration -q -o a.mcap -o a.ndjson -o a.csv";
    strapd(at, &format!("replay {fixture} {replay}")).done();
    let output = Command::new(python)
        .args(["-c", READER])
        .args([at.join("a.mcap"), at.join("a.ndjson")])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}{error}");
    assert!(
        said.contains("geometry_msgs/msg/AccelWithCovarianceStamped imu_link"),
        "{said}"
    );
    // And the table has the same numbers.
    let table = vectors(&columns(&at.join("a.csv")), NAME);
    let lines = std::fs::read_to_string(at.join("a.ndjson")).unwrap();
    for (line, row) in lines.lines().zip(&table) {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        for axis in 0..3 {
            assert_eq!(line[NAME][axis].as_f64(), Some(row[axis]));
        }
    }
}

#[test]
fn nothing_is_given_where_no_vertical_is_known() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(at, "simulate hand --duration 5 -q -o made.csv").done();
    strapd(
        at,
        "replay made.csv --aid none --linear-acceleration -o out.csv",
    )
    .refused(2, &["has no vertical", "--aid gravity"]);
    // A gyro alone, levelled at its start, has one.
    strapd(
        at,
        "replay made.csv --aid none --init gravity --linear-acceleration -q -o out.csv",
    )
    .done();
    let found = vectors(&columns(&at.join("out.csv")), NAME);
    assert!(found.iter().all(|a| a.iter().all(|c| c.is_finite())));
    // Rates and nothing else.
    let rates: String = std::iter::once("t_ns,gyro_x,gyro_y,gyro_z\n".to_owned())
        .chain((0..300_i64).map(|n| format!("{},0.1,0.2,0.3\n", n * 10_000_000)))
        .collect();
    std::fs::write(at.join("rates.csv"), rates).unwrap();
    let ran = strapd(
        at,
        "replay rates.csv --aid auto --linear-acceleration --force -o out.csv",
    );
    ran.refused(
        1,
        &["--linear-acceleration", "no vertical", "accelerometer"],
    );
    // Without the flag nothing of it is written.
    strapd(at, "replay made.csv --aid gravity -q --force -o out.csv").done();
    let text = std::fs::read_to_string(at.join("out.csv")).unwrap();
    assert!(!text.contains(NAME));
}
