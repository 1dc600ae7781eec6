//! Promise: what a user of PX4 records with ROS 2 reads alike from both of its containers, and is what px4_msgs says it is:
//! microseconds, forward-right-down, the mean over an interval or the rotation in it.

use crate::program::strapd;
use std::path::Path;
use std::process::Command;

/// Recordings by somebody else's program (`tests/oracles/px4_recordings.py`).
fn recorded(at: &Path) {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/px4_recordings.py");
    let output = Command::new(&python).arg(&script).arg(at).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(
        text.contains("sensor_combined: 400 samples, vehicle_imu: 400 samples"),
        "{text}"
    );
}

#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn messages_of_px4_read_alike_from_sqlite_and_mcap_and_as_they_are_defined() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    recorded(at);
    for (topic, kind) in [("sensor_combined", "average"), ("vehicle_imu", "rotation")] {
        let expected = std::fs::read_to_string(at.join(format!("{topic}.csv"))).unwrap();
        let mut runs = Vec::new();
        for form in ["db3", "mcap"] {
            let of = format!("{form} --topic /fmu/out/{topic}");
            let told = strapd(at, &format!("cat {of} --format csv"));
            let mut rows = told.done().out.lines();
            let names: Vec<&str> = rows.next().unwrap().split(',').collect();
            let place = |name: &str| names.iter().position(|known| *known == name).unwrap();
            let read: Vec<Vec<String>> = rows
                .map(|row| row.split(',').map(str::to_owned).collect())
                .collect();
            assert_eq!(read.len(), 400, "{form}, {topic}");
            for (row, expected) in read.iter().zip(expected.lines()) {
                let wanted: Vec<&str> = expected.split(',').collect();
                assert_eq!(row[place("stamp_ns")], wanted[0], "{form}, {topic}");
                assert_eq!(row[place("interval_ns")], wanted[7], "{form}, {topic}");
                assert_eq!(row[place("sample_kind")], kind, "{form}, {topic}");
                let number = |text: &str| text.parse::<f64>().unwrap();
                for (n, name) in ["gyro_x", "gyro_y", "gyro_z"].iter().enumerate() {
                    let found = number(&row[place(name)]);
                    assert_eq!(found, number(wanted[1 + n]), "{form}, {topic}, {name}");
                }
                // A quotient by an interval that is no number of 64 bits: two roundings.
                for (n, name) in ["accel_x", "accel_y", "accel_z"].iter().enumerate() {
                    let (found, wanted) = (number(&row[place(name)]), number(wanted[4 + n]));
                    let off = (found - wanted).abs() / wanted.abs();
                    assert!(off < 4e-16, "{form}, {topic}, {name}: {found} {wanted}");
                }
            }
            strapd(at, &format!("replay {of} -o {form}.csv --force")).done();
            runs.push(std::fs::read_to_string(at.join(format!("{form}.csv"))).unwrap());
        }
        assert_eq!(runs[0].lines().count(), 401, "{topic}");
        assert_eq!(runs[0], runs[1], "{topic}");
    }
}
