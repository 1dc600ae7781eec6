//! Promise: an estimator that sets its heading anew (`quat_reset_counter` of PX4's EKF2) is no error of the gyro: the
//! comparison is cut there, which is reported; a jump that nobody announces is one.

use crate::program::strapd;
use nalgebra::Vector3;
use serde_json::Value;
use std::path::Path;
use strapd_attitude::frames::{Body, Nav};
use strapd_attitude::quaternion::{Quaternion, RotationVector};

const STEP_US: u64 = 5_000;
const SAMPLES: u64 = 12_000;

/// A minute of flight: rates, and every second sample the attitude, whose heading is another by `jumps[k]` degrees from
/// the k-th third on; the counter says so where they are `announced`.
fn flight(at: &Path, name: &str, jumps: [f64; 3], announced: bool) {
    let record = |kind: u8, body: &[u8]| {
        let length = (body.len() as u16).to_le_bytes();
        [&length[..], &[kind], body].concat()
    };
    let mut log = b"ULog\x01\x12\x35\x01".to_vec();
    log.extend(5_000_u64.to_le_bytes());
    log.extend(record(b'B', &[0; 40]));
    for format in [
        "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;",
        "vehicle_attitude:uint64_t timestamp;uint64_t timestamp_sample;float[4] q;float[4] delta_q_reset;uint8_t quat_reset_counter;",
    ] {
        log.extend(record(b'F', format.as_bytes()));
    }
    log.extend(record(b'A', b"\0\x01\0sensor_combined"));
    log.extend(record(b'A', b"\0\x02\0vehicle_attitude"));
    let turned = |degrees: f64| {
        let by = RotationVector(Vector3::z() * degrees.to_radians());
        Quaternion::<Nav, Nav>::from_rotation_vector(&by)
    };
    let mut q = Quaternion::<Nav, Body>::identity();
    for n in 0..SAMPLES {
        let t = n as f64 * STEP_US as f64 * 1e-6;
        let rate = Vector3::new((1.1 * t).sin(), (0.7 * t).cos(), 0.5 * (0.3 * t).sin());
        let rate = rate.map(|w| f64::from(w as f32));
        q = q
            .advanced(&RotationVector(rate * (STEP_US as f64 * 1e-6)))
            .normalised();
        let stamp = 1_000_000 + n * STEP_US;
        let mut body = 1_u16.to_le_bytes().to_vec();
        body.extend(stamp.to_le_bytes());
        rate.iter()
            .for_each(|w| body.extend((*w as f32).to_le_bytes()));
        body.extend((STEP_US as u32).to_le_bytes());
        log.extend(record(b'D', &body));
        if n % 2 == 0 {
            let part = (3 * n / SAMPLES) as usize;
            let mut body = 2_u16.to_le_bytes().to_vec();
            body.extend(stamp.to_le_bytes());
            body.extend(stamp.to_le_bytes());
            let shown = (turned(jumps[part]) * q).wxyz();
            shown
                .iter()
                .for_each(|c| body.extend((*c as f32).to_le_bytes()));
            body.extend([0; 16]);
            // It may have been set anew before, and begins again at 256.
            body.push(if announced {
                255_u8.wrapping_add(part as u8)
            } else {
                255
            });
            log.extend(record(b'D', &body));
        }
    }
    std::fs::write(at.join(name), log).unwrap();
}

fn first(value: &Value) -> &Value {
    value.get(0).unwrap_or(value)
}

#[test]
fn a_heading_that_was_reset_is_cut_there_and_each_part_aligned_by_itself() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let jumps = [0.0, 70.0, -40.0];
    flight(at, "reset.ulg", jumps, true);
    flight(at, "whole.ulg", [0.0; 3], true);
    flight(at, "jump.ulg", jumps, false);
    let mut found = Vec::new();
    for log in ["reset", "whole", "jump"] {
        strapd(at, &format!("replay {log}.ulg -o {log}.mcap -q")).done();
        let compared = strapd(
            at,
            &format!("compare {log}.mcap {log}.ulg --align first --json"),
        );
        let value = compared.json();
        let heading = value["heading"]["rms_deg"].as_f64().unwrap();
        let drift = value["drift_deg_per_h"]["total"].as_f64().unwrap();
        let over_1s = value["relative_1s"]["p95_deg"].as_f64().unwrap();
        found.push((heading, drift, over_1s, value["parts"].as_u64()));
    }
    let [reset, whole, jump] = found[..] else {
        panic!()
    };
    // The truth is rounded to 32 bits, and constant within a step.
    assert!(whole.0 < 0.2 && whole.1 < 60.0, "{whole:?}");
    assert!(
        reset.0 < 0.2 && reset.1 < 60.0 && reset.2 < 0.1,
        "{reset:?}"
    );
    assert_eq!((reset.3, jump.3), (Some(3), Some(1)));
    assert!(jump.0 > 20.0, "nobody announced it: {jump:?}");
    let text = strapd(at, "compare reset.mcap reset.ulg --align first");
    assert!(text.done().out.contains("was reset 2 times"), "{text:?}");

    for (log, resets) in [("reset", 2), ("whole", 2), ("jump", 0)] {
        let replay = strapd(
            at,
            &format!("replay {log}.ulg --against-recorded --json -o null:"),
        )
        .json();
        let topic = &first(&replay)["topics"][0];
        assert_eq!(topic["recorded"]["resets"], resets, "{log}: {topic:#}");
        let rms = topic["recorded"]["sigma"]["heading"]["rms_deg"].as_f64();
        if let Some(rms) = rms {
            assert_eq!(rms < 1.0, log != "jump", "{log}: {rms}");
        }
        let check = strapd(at, &format!("check {log}.ulg --json"));
        let said = check.out.contains("orientation-reset");
        assert_eq!(said, resets > 0, "{log}: {check:?}");
        let blamed =
            check.out.contains("bias-by-orientation") || check.out.contains("beyond-sigma");
        assert!(!blamed || log == "jump", "{log}: {check:?}");
    }
}
