//! Promise: what is written for other programs, and sent to them, is the attitude of the run in their own form; and what
//! they record is read.

use crate::program::strapd;
use crate::replays::fixture;
use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Rows of cells behind the line that begins so.
fn rows(text: &str, header: &str) -> Vec<Vec<String>> {
    let mut lines = text.lines();
    lines.find(|line| line.starts_with(header)).unwrap();
    let cells = |line: &str| line.split(['\t', ',', ' ']).map(str::to_owned).collect();
    lines.map(cells).collect()
}

fn stamp(line: &serde_json::Value) -> i64 {
    let part = |name: &str| line["stamp"][name].as_i64().unwrap();
    part("sec") * 1_000_000_000 + part("nsec")
}

#[test]
fn a_gcsv_has_the_rates_to_the_bit_and_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let log = fixture("xsens_mti.mcap").display().to_string();
    let ran = strapd(dir.path(), &format!("replay {log} -o a.gcsv -o -"));
    let lines = ran.done().lines();
    let text = std::fs::read_to_string(dir.path().join("a.gcsv")).unwrap();
    assert!(text.starts_with("GYROFLOW IMU LOG\nversion,1.3\nid,imu_data\norientation,ZYx\n"));
    let written = rows(&text, "t,gx,gy,gz,ax,ay,az");
    assert_eq!((written.len(), lines.len()), (953, 953));
    let back = strapd(dir.path(), "cat a.gcsv");
    let back = back.done().lines();
    assert_eq!(back.len(), 953);
    for ((row, line), back) in written.iter().zip(&lines).zip(&back) {
        let since = stamp(line) - stamp(&lines[0]);
        assert_eq!(row[0], since.to_string());
        assert_eq!(stamp(back), since);
        for axis in 0..3 {
            let rate = line["rate"][axis].as_f64().unwrap();
            assert_eq!(
                row[1 + axis].parse::<f64>().unwrap().to_bits(),
                rate.to_bits()
            );
            assert_eq!(
                back["gyro"][axis].as_f64().unwrap().to_bits(),
                rate.to_bits()
            );
            // In m/s^2, by the scale that makes g of it: two roundings.
            let force: f64 = row[4 + axis].parse().unwrap();
            let read = back["accel"][axis].as_f64().unwrap();
            assert!(
                (read - force).abs() <= force.abs() * 1e-15,
                "{read} {force}"
            );
        }
    }
    let ran = strapd(
        dir.path(),
        &format!("replay {log} --world ned -o ned.gcsv -q"),
    );
    ran.done();
    let text = std::fs::read_to_string(dir.path().join("ned.gcsv")).unwrap();
    assert!(text.contains("orientation,zyx\n"));
}

#[test]
fn tables_of_poses_have_every_sensor_at_even_times() {
    let dir = tempfile::tempdir().unwrap();
    let mut lines = String::new();
    for n in 0..200 {
        lines += &format!(
            "{{\"id\":\"left\",\"stamp_ms\":{},\"gyro\":[0,0,1]}}\n",
            10 * n
        );
        if n % 2 == 0 {
            let at = 10 * n + 5;
            lines += &format!("{{\"id\":\"right\",\"stamp_ms\":{at},\"gyro\":[1,0,0]}}\n");
        }
    }
    std::fs::write(dir.path().join("two.ndjson"), lines).unwrap();
    let ran = strapd(
        dir.path(),
        "replay two.ndjson --topic all -o a.sto -o a.bvh -q",
    );
    assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
    let sto = std::fs::read_to_string(dir.path().join("a.sto")).unwrap();
    assert!(sto.starts_with("DataRate=") && sto.contains("\nDataType=Quaternion\n"));
    let table = rows(&sto, "time\t");
    let bvh = std::fs::read_to_string(dir.path().join("a.bvh")).unwrap();
    let joints = bvh.matches("JOINT ").count();
    let motion = rows(&bvh, "Frame Time:");
    assert!(joints == 2 && table.len() > 150);
    assert_eq!(table[0].len(), 1 + 4 * joints);
    assert_eq!(
        (motion.len(), motion[0].len()),
        (table.len(), 6 + 3 * joints)
    );
    for row in &table {
        for q in row[1..].chunks(4) {
            let norm: f64 = q.iter().map(|c| c.parse::<f64>().unwrap().powi(2)).sum();
            assert!((norm - 1.0).abs() < 1e-12, "{row:?}");
        }
    }
}

#[test]
fn opentrack_gets_each_attitude_as_six_doubles_and_a_bad_address_says_what_there_is() {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket
        .set_read_timeout(Some(Duration::from_secs(60)))
        .unwrap();
    let address = socket.local_addr().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let heard = std::thread::spawn(move || {
        let mut heard = Vec::new();
        let mut buffer = [0; 2048];
        while heard.len() < 101 {
            let length = socket.recv(&mut buffer).unwrap();
            heard.push(buffer[..length].to_vec());
        }
        heard
    });
    let ran = strapd(
        dir.path(),
        &format!(
            "simulate coning --rate-hz 100 --duration 1 --speed 1 -o - -o opentrack://{address}"
        ),
    );
    let lines = ran.done().lines();
    let truth: Vec<_> = lines.iter().filter(|line| line["class"] == "ATT").collect();
    let heard = heard.join().unwrap();
    assert_eq!(heard.len(), truth.len());
    for (datagram, line) in heard.iter().zip(truth) {
        let numbers: Vec<f64> = datagram
            .chunks_exact(8)
            .map(|eight| f64::from_le_bytes(eight.try_into().unwrap()))
            .collect();
        let q = ["w", "x", "y", "z"].map(|c| line["q"][c].as_f64().unwrap());
        let [roll, pitch, yaw] = strapd::sink::roll_pitch_yaw(q).map(f64::to_degrees);
        // Of a simulation x is east, and a heading counts from north to the right.
        assert_eq!(line["world"], "enu");
        let wanted = [0.0, 0.0, 0.0, 90.0 - yaw, -pitch, roll];
        assert!(
            numbers
                .iter()
                .zip(wanted)
                .all(|(a, b)| (a - b).abs() < 1e-9),
            "{numbers:?} {wanted:?}"
        );
    }
    for (address, words) in [
        ("opentrack://h", "HOST:PORT is needed"),
        ("osc://h:1?rate=-1", "a rate above 0 Hz"),
        ("vcm://h:1", "vmc://HOST:PORT"),
    ] {
        let ran = strapd(
            dir.path(),
            &format!("simulate coning --duration 1 -o {address}"),
        );
        ran.refused(2, &[words]);
    }
}

/// The frames of the log without the times before them.
fn captured() -> Vec<u8> {
    let log = std::fs::read(fixture("ardupilot.tlog")).unwrap();
    let (mut out, mut at) = (Vec::new(), 0);
    while at < log.len() {
        let length = usize::from(log[at + 9]);
        let total = match log[at + 8] {
            0xfe => 8 + 8 + length,
            _ => 8 + 12 + 13 * usize::from(log[at + 10] & 1) + length,
        };
        out.extend(&log[at + 8..at + total]);
        at += total;
    }
    out
}

#[test]
fn captured_bytes_of_a_link_are_a_recording_with_the_samples_of_the_log() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("link.bytes"), captured()).unwrap();
    let log = fixture("ardupilot.tlog").display().to_string();
    for topic in ["RAW_IMU", "SCALED_IMU2"] {
        let of = |file: &str| {
            let ran = strapd(dir.path(), &format!("cat {file} --topic {topic}"));
            assert!(matches!(ran.code, Some(0 | 3)), "{ran:?}");
            let lines = ran.lines();
            let values = |line: &serde_json::Value| {
                (stamp(line), line["gyro"].clone(), line["accel"].clone())
            };
            lines.iter().map(values).collect::<Vec<_>>()
        };
        let (ours, theirs) = (of("link.bytes"), of(&log));
        assert_eq!(ours.len(), 9);
        assert_eq!(ours, theirs, "{topic}");
    }
    // It has a gap of minutes, which is a finding.
    let info = strapd(dir.path(), "info link.bytes --json");
    let said: serde_json::Value = serde_json::from_str(&info.out).unwrap();
    assert_eq!(said["format"], "MAVLink capture");
}

/// `STRAPD_ORACLES_PYTHON` names a Python with the packages of `benches/peers/requirements.txt`.
#[test]
#[cfg_attr(
    not(has_oracles),
    ignore = "needs STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn readers_of_other_people_read_what_the_ndjson_says() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/other_programs.py");
    let output = Command::new(python)
        .arg(script)
        .arg(env!("CARGO_BIN_EXE_strapd"))
        .args([fixture("xsens_mti.mcap"), fixture("ardupilot.tlog")])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert_eq!(text.matches(" read, worst ").count(), 7, "{text}");
}
