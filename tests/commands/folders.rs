//! Promise: a folder that a phone or a recorder wrote is a recording: one file has the rates, those beside it what
//! corrects them, paired by their stamps. What is used is said; what cannot be told is not guessed.

use crate::program::{Ran, strapd, strapd_fed};
use crate::replays::fixture;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// Standard gravity, m/s^2.
const G: f64 = 9.806_65;

/// A sample of a sensor: when, and what it says.
type Row = (i64, [f64; 3]);

/// A hand's ten seconds, by sensor: the force every 20 ms and 3 ms behind the rate, the field every 50 ms.
struct Phone {
    rates: Vec<Row>,
    forces: Vec<Row>,
    fields: Vec<Row>,
}

fn phone(at: &Path) -> Phone {
    let made = "simulate hand --duration 20 --rate-hz 100 --mag --seed 3 --noise consumer_imu,turn-on-bias=1800,scale-ppm=0,misalignment=0,accel-bias=0,accel-scale-ppm=0,accel-misalignment=0 -o hand.ndjson -o truth.csv";
    strapd(at, made).done();
    let text = std::fs::read_to_string(at.join("hand.ndjson")).unwrap();
    let lines: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let lines: Vec<Value> = lines
        .into_iter()
        .filter(|line| line["class"] == "RATE" && line["id"] != "truth")
        .collect();
    let rows = |name: &str, every: usize, behind: i64| -> Vec<Row> {
        let row = |line: &Value| {
            let stamp = &line["stamp"];
            let nanos =
                stamp["sec"].as_i64().unwrap() * 1_000_000_000 + stamp["nsec"].as_i64().unwrap();
            let v: Vec<f64> = line[name]
                .as_array()
                .unwrap()
                .iter()
                .map(|x| x.as_f64().unwrap())
                .collect();
            (nanos + behind, [v[0], v[1], v[2]])
        };
        lines.iter().step_by(every).map(row).collect()
    };
    Phone {
        rates: rows("gyro", 1, 0),
        forces: rows("accel", 2, 3_000_000),
        fields: rows("mag", 5, 0),
    }
}

/// Table as Sensor Logger writes it: columns z, y, x.
fn sensor_logger(rows: &[Row], by: f64) -> String {
    let mut text = "time,seconds_elapsed,z,y,x\n".to_owned();
    for (stamp, v) in rows {
        let [x, y, z] = v.map(|value| value * by);
        let secs = (stamp - rows[0].0) as f64 * 1e-9;
        writeln!(text, "{stamp},{secs},{z},{y},{x}").unwrap();
    }
    text
}

impl Phone {
    fn write(&self, folder: &Path) {
        std::fs::create_dir(folder).unwrap();
        let put = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
        put("Gyroscope.csv", sensor_logger(&self.rates, 1.0));
        put("GyroscopeUncalibrated.csv", sensor_logger(&self.rates, 1.5));
        put("TotalAcceleration.csv", sensor_logger(&self.forces, 1.0));
        put("Accelerometer.csv", sensor_logger(&self.forces, 0.01));
        put("Gravity.csv", sensor_logger(&self.forces, 1.0));
        // In microtesla.
        put("Magnetometer.csv", sensor_logger(&self.fields, 1e6));
        put(
            "Location.csv",
            "time,seconds_elapsed,latitude,longitude\n1,2,3,4\n".to_owned(),
        );
        put(".hidden.csv", sensor_logger(&self.rates, 2.0));
    }

    /// The same as lines, each with what one sensor says, in the order of their stamps.
    fn lines(&self) -> String {
        let all = [
            ("mag", &self.fields, 1e6),
            ("accel", &self.forces, 1.0),
            ("gyro", &self.rates, 1.0),
        ];
        let mut lines: Vec<(i64, String)> = Vec::new();
        for (name, rows, by) in all {
            for (stamp, v) in rows {
                let v = v.map(|value| value * by);
                lines.push((
                    *stamp,
                    format!("{{\"stamp_ns\":{stamp},\"{name}\":{v:?}}}\n"),
                ));
            }
        }
        lines.sort_by_key(|(stamp, _)| *stamp);
        lines.into_iter().map(|(_, line)| line).collect()
    }
}

fn replayed(at: &Path, of: &str, flags: &str) -> (String, Ran) {
    let ran = strapd(at, &format!("replay {of} -o out.csv --force {flags}"));
    (
        std::fs::read_to_string(at.join("out.csv")).unwrap_or_default(),
        ran,
    )
}

/// The last attitude: w, x, y, z.
fn last(at: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(at.join("out.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let cells: Vec<&str> = lines.last().unwrap().split(',').collect();
    let cell = |name: &str| {
        cells[names.iter().position(|n| *n == name).unwrap()]
            .parse()
            .unwrap()
    };
    ["qw", "qx", "qy", "qz"].map(cell).to_vec()
}

fn rms(at: &Path) -> f64 {
    let compared = strapd(at, "compare out.csv truth.csv --json --align heading").json();
    compared["total"]["rms_deg"].as_f64().unwrap()
}

#[test]
fn the_files_of_a_phone_are_one_recording_with_the_bits_of_its_lines() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let phone = phone(at);
    phone.write(&at.join("phone"));
    std::fs::write(at.join("phone.ndjson"), phone.lines()).unwrap();
    // The bias of a rest is of what can be read twice.
    for flags in [
        "--aid auto --bias none --noise consumer",
        "--aid gravity+mag --bias none --noise consumer",
        "--smooth --aid gravity --bias none",
    ] {
        let (rows, ran) = replayed(at, "phone", flags);
        ran.done();
        assert!(
            ran.out
                .contains("the specific force is from TotalAcceleration.csv"),
            "{}",
            ran.out
        );
        assert!(
            ran.out
                .contains("the magnetic field is from Magnetometer.csv"),
            "{}",
            ran.out
        );
        let off = rms(at);
        assert!(off < 1.5, "{flags}: {off}");
        let lines = replayed(at, "phone.ndjson", flags).0;
        assert!(rows.lines().count() == 2002 && rows == lines, "{flags}");
        let piped = strapd_fed(
            at,
            &format!("replay - -o out.csv --force {flags}"),
            phone.lines(),
        );
        piped.done();
        assert!(
            std::fs::read_to_string(at.join("out.csv")).unwrap() == rows,
            "{flags}: a pipe"
        );
    }
    // What `cat` prints is the recording, too.
    let flags = "--aid auto --bias none --noise consumer";
    let (rows, _) = replayed(at, "phone", flags);
    let cat = strapd(at, "cat phone").out;
    strapd_fed(at, &format!("replay - -o out.csv --force {flags}"), cat).done();
    assert!(std::fs::read_to_string(at.join("out.csv")).unwrap() == rows);
    // Without the force the same rates drift.
    replayed(at, "phone/Gyroscope.csv", "").1.done();
    assert!(rms(at) > 3.0);
}

#[test]
fn a_field_of_a_topic_of_its_own_goes_through_lines_with_the_bits_of_the_log() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    strapd(at, "simulate hand --duration 20 --rate-hz 100 --mag --seed 5 --noise consumer_imu -o hand.mcap").done();
    // Bias of a rest and class by the data are of what can be read twice.
    let flags = "--aid gravity+mag --sample-kind average --bias none --noise consumer";
    let (rows, ran) = replayed(at, "hand.mcap", flags);
    ran.done();
    let lines = strapd(at, "cat hand.mcap").done().out.clone();
    assert_eq!(
        lines
            .lines()
            .filter(|line| line.contains("\"mag\""))
            .count(),
        2001
    );
    strapd_fed(at, &format!("replay - -o out.csv --force {flags}"), lines).done();
    assert!(std::fs::read_to_string(at.join("out.csv")).unwrap() == rows);
    // A row has no place for it, which is said.
    let csv = strapd(at, "cat hand.mcap --format csv");
    assert!(csv.err.contains("2001 forces or fields"), "{}", csv.err);
}

#[test]
fn info_and_check_take_several_logs_and_one_that_is_bad_keeps_none_from_being_looked_at() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for name in ["xsens_mti.mcap", "ximu3.mcap"] {
        std::fs::copy(fixture(name), at.join(name)).unwrap();
    }
    for command in ["info", "check"] {
        let both = strapd(at, &format!("{command} xsens_mti.mcap ximu3.mcap"));
        let each =
            ["xsens_mti.mcap", "ximu3.mcap"].map(|name| strapd(at, &format!("{command} {name}")));
        assert_eq!(both.out, format!("{}\n{}", each[0].out, each[1].out));
        assert_eq!(both.code, each.iter().map(|ran| ran.code).max().unwrap());
        let json = strapd(at, &format!("{command} --json xsens_mti.mcap ximu3.mcap")).lines();
        assert_eq!(json.len(), 2);
        let one_bad = strapd(
            at,
            &format!("{command} xsens_mti.mcap nowhere.mcap ximu3.mcap"),
        );
        assert_eq!((one_bad.code, &one_bad.out), (Some(1), &both.out));
        assert!(
            one_bad.err.contains("nowhere.mcap: cannot open"),
            "{}",
            one_bad.err
        );
    }
}

#[test]
fn every_command_takes_the_folder() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    phone(at).write(&at.join("phone"));
    let info = strapd(at, "info phone").done().out.clone();
    assert!(
        info.contains("2001 samples") && info.contains("--aid auto takes gravity"),
        "{info}"
    );
    let check = strapd(at, "check phone").out;
    assert!(check.contains("2001 samples"), "{check}");
    strapd(at, "report phone -o r.html --aid gravity+mag").done();
    strapd(at, "calibrate phone -o imu.toml --aid gravity").done();
    strapd(at, "allan phone").done();
    assert_eq!(
        strapd(at, "cat phone --format csv -n 5")
            .done()
            .out
            .lines()
            .count(),
        6
    );
}

#[test]
fn files_that_name_their_columns_are_told_by_them() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let phone = phone(at);
    let folder = at.join("phyphox");
    std::fs::create_dir(&folder).unwrap();
    let written = |head: [&str; 3], rows: &[Row], by: f64| {
        let mut text = format!(
            "\"Time (s)\",\"{}\",\"{}\",\"{}\"\n",
            head[0], head[1], head[2]
        );
        for (stamp, v) in rows {
            let [x, y, z] = v.map(|value| value * by);
            let secs = (stamp - phone.rates[0].0) as f64 * 1e-9;
            writeln!(text, "{secs:.9E},{x:.15E},{y:.15E},{z:.15E}").unwrap();
        }
        text
    };
    let put = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
    put(
        "Gyroscope.csv",
        written(
            [
                "Gyroscope x (rad/s)",
                "Gyroscope y (rad/s)",
                "Gyroscope z (rad/s)",
            ],
            &phone.rates,
            1.0,
        ),
    );
    put(
        "Accelerometer.csv",
        written(
            [
                "Acceleration x (g)",
                "Acceleration y (g)",
                "Acceleration z (g)",
            ],
            &phone.forces,
            1.0 / G,
        ),
    );
    put(
        "Linear Acceleration.csv",
        written(
            [
                "Linear Acceleration x (m/s^2)",
                "Linear Acceleration y (m/s^2)",
                "Linear Acceleration z (m/s^2)",
            ],
            &phone.forces,
            0.1,
        ),
    );
    let (_, ran) = replayed(at, "phyphox", "--aid auto");
    ran.done();
    assert!(
        ran.out
            .contains("the specific force is from Accelerometer.csv"),
        "{}",
        ran.out
    );
    // As the same phone's other app has it, but for the last digits.
    let by_phyphox = last(at);
    phone.write(&at.join("phone"));
    replayed(at, "phone", "--aid auto").1.done();
    let product: f64 = by_phyphox.iter().zip(last(at)).map(|(a, b)| a * b).sum();
    assert!(product.abs() > 1.0 - 1e-9, "{product}");
    // Which of two forces is meant cannot be told: said, and none is used.
    put(
        "Acceleration B.csv",
        written(
            [
                "Acceleration x (g)",
                "Acceleration y (g)",
                "Acceleration z (g)",
            ],
            &phone.forces,
            1.0 / G,
        ),
    );
    let (_, ran) = replayed(at, "phyphox", "--aid auto");
    assert!(
        ran.err
            .contains("it may be in Acceleration B.csv, Accelerometer.csv"),
        "{}",
        ran.err
    );
    assert!(ran.out.contains("aid      none"), "{}", ran.out);
}

/// Folder as an x-IMU3 leaves it: the force stands beside the rate, and another accelerometer has a file of its own.
#[test]
fn a_force_in_the_rows_of_the_rates_is_not_looked_for_elsewhere() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let folder = at.join("ximu3");
    std::fs::create_dir(&folder).unwrap();
    let inertial = fixture("source").join("ximu3_inertial.csv");
    std::fs::copy(&inertial, folder.join("Inertial.csv")).unwrap();
    std::fs::copy(&inertial, at.join("alone.csv")).unwrap();
    let quaternions = fixture("source").join("ximu3_quaternion.csv");
    std::fs::copy(quaternions, folder.join("Quaternion.csv")).unwrap();
    let text = std::fs::read_to_string(&inertial).unwrap();
    let other: Vec<String> = text
        .lines()
        .map(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            format!("{},{}", cells[0], cells[4..7].join(","))
        })
        .collect();
    std::fs::write(folder.join("HighGAccelerometer.csv"), other.join("\n")).unwrap();
    let (rows, ran) = replayed(at, "ximu3", "--aid gravity");
    ran.done();
    assert!(!ran.out.contains("beside it"), "{}", ran.out);
    assert!(rows.lines().count() > 400);
    assert!(replayed(at, "alone.csv", "--aid gravity").0 == rows);
}

#[test]
fn an_acceleration_without_gravity_levels_nothing_and_that_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    phone(at).write(&at.join("phone"));
    std::fs::remove_file(at.join("phone/TotalAcceleration.csv")).unwrap();
    let ran = strapd(at, "replay phone -o out.csv --aid auto -v");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(
        ran.err.contains("Accelerometer.csv is without gravity")
            && ran.err.contains("Total Acceleration"),
        "{}",
        ran.err
    );
    assert!(ran.out.contains("aid      none"), "{}", ran.out);
}

#[test]
fn a_bad_row_beside_is_counted_and_named_with_its_file() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let phone = phone(at);
    phone.write(&at.join("phone"));
    let file = at.join("phone/TotalAcceleration.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    let mut rows: Vec<&str> = text.lines().collect();
    rows.insert(100, "1700000000000000000,0.5,9.8,here,0");
    std::fs::write(&file, rows.join("\n")).unwrap();
    let (_, ran) = replayed(at, "phone", "--aid auto");
    assert_eq!(ran.code, Some(3), "{}", ran.out);
    assert!(
        ran.out.contains("TotalAcceleration.csv, line 101"),
        "{}{}",
        ran.out,
        ran.err
    );
}

#[test]
fn a_folder_of_one_log_is_that_log_and_of_none_or_several_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let folder = at.join("rosbag2");
    std::fs::create_dir(&folder).unwrap();
    strapd(at, "info rosbag2").refused(1, &["a folder without a recording that is read: no files"]);
    std::fs::write(
        folder.join("metadata.yaml"),
        "rosbag2_bagfile_information:\n  version: 5\n",
    )
    .unwrap();
    strapd(at, "info rosbag2").refused(
        1,
        &[
            "the metadata of a rosbag2 recording",
            "name the .mcap or .db3 file",
        ],
    );
    std::fs::copy(fixture("xsens_mti.mcap"), folder.join("rosbag2_0.mcap")).unwrap();
    std::fs::copy(fixture("xsens_mti.mcap"), at.join("alone.mcap")).unwrap();
    let (rows, ran) = replayed(at, "rosbag2", "");
    ran.done();
    assert_eq!(rows, replayed(at, "alone.mcap", "").0);
    std::fs::copy(fixture("xsens_mti.mcap"), folder.join("rosbag2_1.mcap")).unwrap();
    strapd(at, "replay rosbag2 -o out.csv --force").refused(
        1,
        &[
            "rosbag2_1.mcap: 19.040 s of it are in rosbag2/rosbag2_0.mcap too",
            "name one of them",
        ],
    );
}

#[test]
#[cfg_attr(not(has_python), ignore = "needs python3")]
fn a_zip_of_a_phones_folder_gives_the_bits_of_the_folder() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    phone(at).write(&at.join("walk"));
    // By somebody else's writer: the folder in it, and its files alone.
    for (archive, of, inside) in [("a.zip", "walk", "."), ("b.zip", ".", "walk")] {
        let made = std::process::Command::new("python3")
            .current_dir(at.join(inside))
            .args(["-m", "zipfile", "-c"])
            .arg(at.join(archive))
            .arg(of)
            .status()
            .unwrap();
        assert!(made.success());
        for (from, to) in [("walk", "folder.csv"), (archive, "zip.csv")] {
            strapd(at, &format!("replay {from} --aid gravity -o {to} --force")).done();
        }
        let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
        assert!(read("folder.csv") == read("zip.csv"), "{archive}");
        let said = strapd(at, &format!("info {archive} --json"));
        assert!(said.done().out.contains("Gyroscope.csv"), "{said:?}");
    }
}

/// Table as MATLAB writes a timetable of its phone logs: local dates, to the millisecond.
fn matlab(rows: &[Row], by: f64) -> String {
    let mut text = "Timestamp,X,Y,Z\n".to_owned();
    for (stamp, v) in rows {
        let [x, y, z] = v.map(|value| value * by);
        let ms = (stamp - rows[0].0) / 1_000_000;
        let (minute, second) = (ms / 60_000, ms % 60_000);
        let clock = format!("10:{minute:02}:{:02}.{:03}", second / 1000, second % 1000);
        writeln!(text, "28-Oct-2026 {clock},{x},{y},{z}").unwrap();
    }
    text
}

#[test]
fn a_folder_of_matlabs_phone_logs_is_one_recording() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let phone = phone(at);
    let folder = at.join("matlab");
    std::fs::create_dir(&folder).unwrap();
    let put = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
    put("AngularVelocity.csv", matlab(&phone.rates, 1.0));
    put("Acceleration.csv", matlab(&phone.forces, 1.0));
    put("MagneticField.csv", matlab(&phone.fields, 1e6));
    // Azimuth, pitch and roll, which are not read.
    put("Orientation.csv", matlab(&phone.fields, 1.0));
    let (_, ran) = replayed(at, "matlab", "--aid gravity+mag -v");
    let said = format!("{}{}", ran.done().out, ran.err);
    for words in [
        "Acceleration.csv",
        "MagneticField.csv",
        "gravity and field",
        "lost     nothing",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
#[cfg_attr(not(has_python), ignore = "needs python3")]
fn what_a_phone_says_of_its_own_orientation_is_found_in_its_folder_and_its_zip() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    phone(at).write(&at.join("walk"));
    // The truth, as Sensor Logger writes an orientation, and another file that has one.
    let truth = std::fs::read_to_string(at.join("truth.csv")).unwrap();
    let mut lines = truth
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let place = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let wanted = ["true_ns", "qz", "qy", "qx", "qw"].map(place);
    let mut own = "time,seconds_elapsed,qz,qy,qx,qw\n".to_owned();
    for cells in lines {
        let [time, z, y, x, w] = wanted.map(|n| cells[n]);
        writeln!(own, "{time},0,{z},{y},{x},{w}").unwrap();
    }
    std::fs::write(at.join("walk/Orientation.csv"), &own).unwrap();
    strapd(at, "replay walk -o out.csv").done();
    let by_hand = rms(at);
    let zip = "-m zipfile -c walk.zip walk".split(' ');
    let made = std::process::Command::new("python3")
        .current_dir(at)
        .args(zip)
        .status();
    assert!(made.unwrap().success());
    for reference in ["walk", "walk.zip"] {
        let ran = strapd(
            at,
            &format!("compare out.csv {reference} --json --align heading"),
        );
        let found = ran.json()["total"]["rms_deg"].as_f64().unwrap();
        assert!(
            (found - by_hand).abs() < 1e-3,
            "{reference}: {found} {by_hand}"
        );
        let text = strapd(at, &format!("compare out.csv {reference}"));
        let name = format!("{reference}/Orientation.csv");
        assert!(text.done().out.contains(&name), "{text:?}");
    }
    // Of two that may be meant none is taken.
    std::fs::rename(at.join("walk/Orientation.csv"), at.join("walk/A.csv")).unwrap();
    std::fs::write(at.join("walk/B.csv"), &own).unwrap();
    let ran = strapd(at, "compare out.csv walk");
    assert!(
        ran.code == Some(1) && ran.err.contains("holds no attitude"),
        "{ran:?}"
    );
}
