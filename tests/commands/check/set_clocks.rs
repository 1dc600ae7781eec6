//! Promise: where a vehicle's clock is set once, the attitude is right, and what is advised leads to a right one.

use crate::program::strapd;
use serde_json::Value;
use std::path::Path;

/// Checksum of MAVLink: X.25 of the frame behind its mark, and of the number of the message's layout.
fn checksum(bytes: &[u8], layout: u8) -> u16 {
    bytes
        .iter()
        .chain([&layout])
        .fold(0xffff, |crc: u16, byte| {
            let mut low = byte ^ (crc as u8);
            low ^= low << 4;
            let low = u16::from(low);
            (crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)
        })
}

/// A message as a ground station logs it, received at `at` us.
fn frame(at: u64, id: u8, layout: u8, payload: &[u8]) -> Vec<u8> {
    let mut frame = vec![0xfe, payload.len() as u8, 0, 1, 1, id];
    frame.extend(payload);
    let sum = checksum(&frame[1..], layout);
    [&at.to_be_bytes()[..], &frame, &sum.to_le_bytes()].concat()
}

/// A minute of a vehicle that turns to the right by 0.1 rad/s, whose clock is set by so many us after half of it.
fn telemetry(path: &Path, set: i64) {
    let mut log = Vec::new();
    for k in 0..3100_i64 {
        let t = k * 20_000;
        let at = (1_795_860_000_000_000 + t) as u64;
        let boot = 60_000_000 + t + if k < 1500 { 0 } else { set };
        let noise = |n: i64| ((k * n) % 1009 - 504) as f32 * 4e-6;
        let sample = [noise(7919), noise(7907), noise(7901) - 9.81];
        let rates = [noise(7883), noise(7879), 0.1 + noise(7877)];
        let others = [0.2, 0.0, 0.4, 0.0, 0.0, 0.0, 20.0];
        let numbers = sample.into_iter().chain(rates).chain(others);
        let mut imu = boot.to_le_bytes().to_vec();
        imu.extend(numbers.flat_map(f32::to_le_bytes));
        imu.extend([0xff; 2]);
        log.extend(frame(at, 105, 93, &imu));
        if k % 5 == 0 {
            let angles = [0.0, 0.0, 1e-7 * t as f32, 0.0, 0.0, 0.1];
            let mut attitude = ((boot / 1000) as u32).to_le_bytes().to_vec();
            attitude.extend(angles.into_iter().flat_map(f32::to_le_bytes));
            log.extend(frame(at, 30, 39, &attitude));
        }
    }
    std::fs::write(path, log).unwrap();
}

#[test]
fn a_vehicles_clock_that_is_set_once_is_said_once_and_what_is_advised_compares() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for (set, way) in [
        (37_000_000, "ahead"),
        (-8_003_000, "back"),
        (-70_000_000, "back"),
    ] {
        telemetry(&at.join("t.tlog"), set);
        let found = |flags: &str| -> Vec<(String, String)> {
            let ran = strapd(at, &format!("check t.tlog --json {flags}"));
            let found: Value = serde_json::from_str(&ran.out).unwrap();
            let text =
                |found: &Value, key: &str| found[key].as_str().unwrap_or_default().to_owned();
            let found = found["findings"].as_array().unwrap().iter();
            found.map(|f| (text(f, "code"), text(f, "what"))).collect()
        };
        let first = found("");
        let has = |found: &[(String, String)], code: &str| found.iter().any(|(c, _)| c == code);
        assert!(
            first[0].0 == "clock-set" && first[0].1.contains(way),
            "{set} {first:?}"
        );
        assert!(has(&first, "no-reference"), "{set} {first:?}");
        // As the note advises: there it is compared, and nothing is wrong.
        let advised = found("--time log");
        for code in ["clock-set", "no-reference"] {
            assert!(!has(&advised, code), "{set} {advised:?}");
        }
        assert!(!has(&first, "clock-drift"), "{set} {first:?}");
        for code in ["heading-drift", "beyond-sigma", "bias-by-orientation"] {
            assert!(!has(&first, code), "{set} {first:?}");
            assert!(!has(&advised, code), "{set} {advised:?}");
        }
        // The gyro's own attitude: 62 s by 0.1 rad/s to the right.
        let ran = strapd(at, "replay t.tlog -o out.csv --force --json --aid none");
        let yaw = ran.json()["topics"][0]["final"]["yaw_deg"]
            .as_f64()
            .unwrap();
        let expected = -(6.198_f64.to_degrees());
        let off = (yaw - expected).rem_euclid(360.0);
        assert!(off.min(360.0 - off) < 0.5, "{set}: {yaw}");
    }
}
