//! Other people's reader: Python's `mcap` reads what was recovered, in file order and through the index.

use super::{Whole, furnished, recover, walked};
use crate::mcap_logs::PACKINGS;
use crate::shared_data::shared;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

fn sha256(messages: &[Whole]) -> String {
    let mut sha = Sha256::new();
    for (topic, log_time, publish_time, sequence, data) in messages {
        let numbers = [
            topic.len() as u64,
            *log_time,
            *publish_time,
            u64::from(*sequence),
            data.len() as u64,
        ];
        for number in numbers {
            sha.update(number.to_le_bytes());
        }
        sha.update(topic);
        sha.update(data);
    }
    sha.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// `STRAPD_ORACLES_PYTHON` names a Python with the packages that `read_recovered.py` lists.
#[test]
#[cfg_attr(
    not(all(has_shared, has_oracles)),
    ignore = "needs ../shared (optional recordings) and STRAPD_ORACLES_PYTHON=PYTHON with the packages of benches/peers/requirements.txt"
)]
fn python_mcap_reads_every_recovered_log() {
    let python = std::env::var_os("STRAPD_ORACLES_PYTHON").expect("it is not set");
    let dir = tempfile::tempdir().unwrap();
    let mut inputs: Vec<PathBuf> = Vec::new();
    for (name, packing) in PACKINGS {
        let bytes = furnished(packing, 60);
        for (what, bytes) in [("whole", &bytes[..]), ("cut", &bytes[..bytes.len() / 2])] {
            inputs.push(dir.path().join(format!("{name}-{what}")));
            std::fs::write(inputs.last().unwrap(), bytes).unwrap();
        }
    }
    for name in [
        "02_truncated_mid_chunk",
        "13_two_imu_topics",
        "mcap-0.25.0-hang",
    ] {
        let Some(path) = shared(&format!("logs/hostile/{name}.mcap")) else {
            return;
        };
        inputs.push(path);
    }
    let outputs: Vec<PathBuf> = (0..inputs.len())
        .map(|n| dir.path().join(format!("{n}.mcap")))
        .collect();
    for (input, output) in inputs.iter().zip(&outputs) {
        recover(input, output, 2);
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles/read_recovered.py");
    let ran = std::process::Command::new(python)
        .arg(script)
        .args(&outputs)
        .output()
        .unwrap();
    let (out, err) = (
        String::from_utf8_lossy(&ran.stdout),
        String::from_utf8_lossy(&ran.stderr),
    );
    assert!(ran.status.success(), "{out}{err}");
    assert_eq!(out.lines().count(), inputs.len(), "{out}{err}");
    for (input, line) in inputs.iter().zip(out.lines()) {
        let said: serde_json::Value = serde_json::from_str(line).unwrap();
        let (expected, _) = walked(input);
        assert!(!expected.is_empty(), "{}", input.display());
        for count in ["messages", "indexed", "counted"] {
            assert_eq!(
                said[count],
                expected.len(),
                "{} {count}: {line}",
                input.display()
            );
        }
        assert_eq!(said["sha256"], sha256(&expected), "{}", input.display());
        if input.to_string_lossy().ends_with("whole") {
            assert_eq!(said["attachments"].as_array().unwrap().len(), 2, "{line}");
            assert_eq!(said["metadata"][1][1]["run"], "40", "{line}");
        }
    }
}
