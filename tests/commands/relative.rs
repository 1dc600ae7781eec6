//! Promise: two sensors without a magnetometer, replayed each by itself, give the angle of the hinge between them, and
//! what is no hinge is said to be none.

use crate::program::strapd;
use nalgebra::Vector3;
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::{Quaternion, RotationVector};

const STEP: f64 = 0.01;
const SAMPLES: usize = 4_000;

fn about<To, From>(axis: Vector3<f64>, angle: f64) -> Quaternion<To, From> {
    Quaternion::from_rotation_vector(&RotationVector(axis * angle))
}

/// Bend of the knee and attitudes of thigh and shank at an instant; the sensors are worn askew.
fn leg(t: f64, sideways: f64) -> (f64, [Quaternion<Nav, Body>; 2]) {
    let bend = 0.5 * (1.0 - (5.0 * t).cos());
    let facing = 1.2 * (0.1 * t).sin() + 0.4 * (0.5 * t).sin();
    let thigh = about::<Nav, Nav>(Vector3::z(), facing)
        * about::<Nav, Body>(Vector3::y(), 0.4 * (5.0 * t + 1.0).sin())
        * about::<Body, Body>(Vector3::x(), 0.1 * (0.7 * t).sin());
    let shank = thigh
        * about::<Body, Body>(Vector3::y(), bend)
        * about::<Body, Body>(Vector3::x(), sideways * (3.1 * t).sin());
    let worn = [
        about(Vector3::new(0.6, 0.0, 0.8), 1.1),
        about(Vector3::new(0.0, -0.6, 0.8), -2.0),
    ];
    (bend, [thigh * worn[0], shank * worn[1]])
}

/// Means of the rates and gravity at the end of each step, one table a sensor.
fn tables(at: &Path, sideways: f64) {
    let mut texts = [String::new(), String::new()];
    for text in &mut texts {
        text.push_str("time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2\n");
    }
    for k in 0..SAMPLES {
        let t = k as f64 * STEP;
        for (index, text) in texts.iter_mut().enumerate() {
            let of = |t| leg(t, sideways).1[index];
            let RotationVector(turned) = (of(t).inverse() * of(t + STEP)).rotation_vector();
            let [gx, gy, gz] = <[f64; 3]>::from(turned / STEP);
            let up = of(t + STEP).inverse().to_dcm();
            let [ax, ay, az] = <[f64; 3]>::from(*up.as_matrix() * Vector3::z() * 9.81);
            let _ = writeln!(text, "{},{gx},{gy},{gz},{ax},{ay},{az}", t + STEP);
        }
    }
    std::fs::write(at.join("thigh.csv"), &texts[0]).unwrap();
    std::fs::write(at.join("shank.csv"), &texts[1]).unwrap();
    for name in ["thigh", "shank"] {
        strapd(
            at,
            &format!("replay {name}.csv --aid gravity --sample-kind average -o {name}.mcap"),
        )
        .done();
    }
}

#[test]
fn the_angle_of_a_knee_is_found_without_a_common_heading() {
    let at = tempfile::tempdir().unwrap();
    tables(at.path(), 0.0);
    let ran = strapd(
        at.path(),
        "relative thigh.mcap shank.mcap -o knee.csv --plot knee.svg --json",
    );
    let said: Value = serde_json::from_str(&ran.done().out).unwrap();
    assert_eq!(said["heading"], "hinge");
    let misfit = said["hinge"]["misfit_deg"].as_f64().unwrap();
    assert!(misfit < 0.5, "{misfit} deg");
    let text = std::fs::read_to_string(at.path().join("knee.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let (mut sum, mut rows_read, mut first) = (0.0, 0, None);
    // The sign of the axis is a convention; the knee of this leg bends to one side alone.
    let most = said["angle_deg"][1].as_f64().unwrap();
    let least = said["angle_deg"][0].as_f64().unwrap();
    let sign = if most > -least { 1.0 } else { -1.0 };
    for row in rows.records() {
        let row = row.unwrap();
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let truth = leg(number(0) * 1e-9, 0.0).0.to_degrees();
        let error = sign * number(1) - (truth - *first.get_or_insert(truth));
        // The tilt is known after a while.
        let is_early = number(0) < 10e9;
        assert!(
            number(3) > 0.0 && (is_early || number(3) < 5.0),
            "sigma {} deg",
            number(3)
        );
        sum += error * error;
        rows_read += 1;
    }
    let rms = (sum / f64::from(rows_read)).sqrt();
    assert!(
        rows_read > 3_900 && rms < 0.3,
        "{rows_read} rows, {rms} deg rms"
    );
    assert!(
        std::fs::read_to_string(at.path().join("knee.svg"))
            .unwrap()
            .contains("<svg")
    );
    let text = strapd(at.path(), "relative thigh.mcap shank.mcap -o knee.sto")
        .done()
        .out
        .clone();
    assert!(
        text.contains("hinge    axis (") && text.contains("sigma"),
        "{text}"
    );
    let sto = std::fs::read_to_string(at.path().join("knee.sto")).unwrap();
    let head: Vec<&str> = sto.lines().take(7).collect();
    assert!(
        head.contains(&"inDegrees=yes") && head[6] == "time\tangle",
        "{head:?}"
    );
    assert_eq!(sto.lines().count() - 7, rows_read as usize);
}

#[test]
fn a_joint_of_several_axes_is_said_to_be_no_hinge() {
    let at = tempfile::tempdir().unwrap();
    tables(at.path(), 0.8);
    let text = strapd(at.path(), "relative thigh.mcap shank.mcap")
        .done()
        .out
        .clone();
    assert!(
        text.contains("as recorded; no hinge: the best axis is off by"),
        "{text}"
    );
    strapd(at.path(), "relative thigh.mcap shank.mcap --heading hinge")
        .refused(1, &["no hinge", "several axes"]);
    let start = strapd(at.path(), "relative thigh.mcap shank.mcap --heading start")
        .done()
        .out
        .clone();
    assert!(start.contains("equal at the first instant"), "{start}");
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let at = tempfile::tempdir().unwrap();
    let table = "stamp_ns,qw,qx,qy,qz\n0,1,0,0,0\n10000000,1,0,0,0\n";
    std::fs::write(at.path().join("a.csv"), table).unwrap();
    std::fs::write(
        at.path().join("b.csv"),
        table
            .replace("\n0,", "\n5000000000000,")
            .replace("\n1", "\n500001"),
    )
    .unwrap();
    strapd(at.path(), "relative a.csv b.csv").refused(1, &["no instant in common"]);
    strapd(at.path(), "relative a.csv a.csv -o x.pdf").refused(2, &[".csv or .sto"]);
    strapd(at.path(), "relative - -").refused(2, &["standard input comes once"]);
    strapd(at.path(), "relative a.csv a.csv --plot x.png").refused(2, &["SVG"]);
    // Two rows of rest: too short for a hinge, and said.
    let text = strapd(at.path(), "relative a.csv a.csv").done().out.clone();
    assert!(text.contains("less than 10 s in common"), "{text}");
}
