//! Promise: what a daemon is sent packed, kept as it came, is a recording like the lines it stands for.

use crate::program::{strapd, strapd_fed};
use serde_json::Value;
use std::path::Path;

const NAMES: &str = "{\"class\":\"PACKED\",\"stream\":7,\"id\":\"a\",\"sample_kind\":\"rate\"}\n";

/// docs/protocol.md, by hand.
fn packed(stream: u32, seq: u64, nanos: i64, numbers: &[f64]) -> Vec<u8> {
    let mut bytes = vec![0xF8, 1, 24 + 8 * numbers.len() as u8, 0];
    bytes.extend(stream.to_le_bytes());
    bytes.extend(seq.to_le_bytes());
    bytes.extend(nanos.to_le_bytes());
    bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// Lines of a simulated body and the same packed, sample by sample.
fn samples(at: &Path) -> Vec<(String, Vec<u8>)> {
    let simulation = "simulate top --duration 2 --rate-hz 200 -o samples.ndjson";
    strapd(at, simulation).done();
    let text = std::fs::read_to_string(at.join("samples.ndjson")).unwrap();
    let both = |line: &str| {
        let mut object: Value = serde_json::from_str(line).unwrap();
        if object["class"] != "RATE" {
            return None;
        }
        object["id"] = "a".into();
        let of = |value: &Value| value.as_i64().unwrap();
        let nanos = of(&object["stamp"]["sec"]) * 1_000_000_000 + of(&object["stamp"]["nsec"]);
        let numbers: Vec<f64> = ["gyro", "accel"]
            .iter()
            .flat_map(|of| {
                (0..3)
                    .map(|i| object[of][i].as_f64().unwrap())
                    .collect::<Vec<_>>()
            })
            .collect();
        let seq = object["seq"].as_u64().unwrap();
        Some((format!("{object}\n"), packed(7, seq, nanos, &numbers)))
    };
    let all: Vec<_> = text.lines().filter_map(both).collect();
    assert!(all.len() > 300);
    all
}

fn text(at: &Path, file: &str) -> String {
    std::fs::read_to_string(at.join(file)).unwrap()
}

#[test]
fn packed_and_mixed_with_lines_from_file_and_pipe_it_gives_the_attitudes_of_the_lines() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let all = samples(at);
    let lines: String = all.iter().map(|(line, _)| line.as_str()).collect();
    std::fs::write(at.join("lines.ndjson"), &lines).unwrap();
    strapd(at, "replay lines.ndjson -o expected.csv").done();
    let expected = text(at, "expected.csv");
    let whole: Vec<u8> = all.iter().flat_map(|(_, object)| object.clone()).collect();
    let whole = [NAMES.as_bytes(), &whole].concat();
    let mixed = all.iter().enumerate().flat_map(|(n, (line, object))| {
        if n % 3 == 0 {
            line.clone().into_bytes()
        } else {
            object.clone()
        }
    });
    let mixed = [NAMES.as_bytes(), &mixed.collect::<Vec<u8>>()].concat();
    for (name, bytes) in [("whole", whole), ("mixed", mixed)] {
        std::fs::write(at.join("kept.ndjson"), &bytes).unwrap();
        strapd(at, "replay kept.ndjson -o out.csv --force").done();
        assert!(text(at, "out.csv") == expected, "{name}");
        strapd_fed(at, "replay - -o out.csv --force", bytes).done();
        assert!(text(at, "out.csv") == expected, "{name} on a pipe");
        for command in ["info kept.ndjson", "cat kept.ndjson"] {
            strapd(at, command).done();
        }
    }
}

#[test]
fn what_is_cut_broken_or_of_a_stream_nobody_named_is_counted_and_the_rest_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let all = samples(at);
    let objects: Vec<u8> = all.iter().take(100).flat_map(|(_, o)| o.clone()).collect();
    let rest: Vec<u8> = all.iter().skip(100).flat_map(|(_, o)| o.clone()).collect();
    let names = NAMES.as_bytes();
    let count = |bytes: Vec<u8>, lost: u64, words: &str| {
        let ran = strapd_fed(at, "replay - -o null: --json", bytes);
        assert_eq!(ran.code, Some(3), "{ran:?}");
        let summary: Value = serde_json::from_str(&ran.out).unwrap();
        let counts = &summary["topics"][0]["samples"]["by_verdict"];
        assert_eq!(counts["undecodable"], lost, "{counts}");
        assert_eq!(
            counts["accepted"].as_u64(),
            Some(all.len() as u64),
            "{counts}"
        );
        assert!(ran.err.contains(words), "{words}: {}", ran.err);
    };
    // Cut within one more object, at each of its bytes.
    for cut in [1, 2, 3, 4, 7, 8, 24, 47] {
        let more = &packed(7, 0, 0, &[0.0; 3])[..cut];
        count(
            [names, &objects, &rest, more].concat(),
            1,
            "no whole packed object",
        );
    }
    // A length that no object has: what follows up to the next line is skipped.
    let broken = b"\xF8\x01\x03\x00 and so on\n";
    count(
        [names, &objects, broken, &rest].concat(),
        1,
        "no whole packed object",
    );
    let kind = [0xF8, 9, 12, 0, 7, 0, 0, 0, 0, 0, 0, 0];
    count([names, &objects, &kind, &rest].concat(), 1, "packed kind 9");
    let other = packed(8, 0, 0, &[0.0; 3]);
    count(
        [names, &objects, &other, &rest].concat(),
        1,
        "packed stream 8",
    );
    let unnamed = strapd_fed(at, "replay - -o null:", objects);
    assert_eq!(unnamed.code, Some(1), "{unnamed:?}");
    let words = "no line before says which sensor it is";
    assert!(unnamed.err.contains(words), "{unnamed:?}");
}

#[test]
fn what_a_line_says_of_units_and_meaning_holds_and_what_it_can_not_mean_is_counted() {
    let dir = tempfile::tempdir().unwrap();
    let line = |of: &str| format!("{{\"class\":\"PACKED\",\"stream\":7,\"id\":\"a\"{of}}}\n");
    // About z, a second long, with one sample at its beginning.
    let turned = |of: &str, z: f64| {
        let nanos = |k: u64| 1_700_000_000_000_000_000 + k as i64 * 10_000_000;
        let objects = (0..=100).flat_map(|k| packed(7, k, nanos(k), &[0.0, 0.0, z]));
        let bytes = [line(of).into_bytes(), objects.collect()].concat();
        let ran = strapd_fed(dir.path(), "replay - -o null: --json", bytes);
        ran.done().json()["topics"][0].clone()
    };
    for (of, z, kind) in [
        // Nothing states it: by the step of 10 ms.
        ("", 0.5, "average"),
        (
            ",\"gyro_unit\":\"deg\",\"sample_kind\":\"rate\"",
            0.5_f64.to_degrees(),
            "rate",
        ),
        (
            ",\"gyro_unit\":\"mrad\",\"sample_kind\":\"average\"",
            500.0,
            "average",
        ),
        (",\"sample_kind\":\"delta-angle\"", 0.005, "delta-angle"),
        (",\"sample_kind\":\"rotation\"", 0.005, "rotation"),
    ] {
        let topic = turned(of, z);
        let yaw = topic["final"]["yaw_deg"].as_f64().unwrap();
        assert!((yaw - 0.5_f64.to_degrees()).abs() < 1e-9, "{of}: {yaw}");
        assert_eq!(topic["sample_kind"], kind, "{of}");
    }
    let all = samples(dir.path());
    let objects: Vec<u8> = all.iter().flat_map(|(_, object)| object.clone()).collect();
    for (bad, words) in [
        (line(",\"gyro_unit\":\"rpm\""), "no gyro_unit `rpm`"),
        (line(",\"sample_kind\":\"mean\""), "no sample_kind `mean`"),
        (
            "{\"class\":\"PACKED\",\"id\":\"a\"}\n".to_owned(),
            "missing field `stream`",
        ),
    ] {
        // Not believed, and nothing bound by the line before is bound anew.
        let bytes = [NAMES.as_bytes(), &objects, bad.as_bytes(), &objects[..72]].concat();
        let ran = strapd_fed(dir.path(), "replay - -o null: --json", bytes);
        assert_eq!(ran.code, Some(3), "{ran:?}");
        assert!(ran.err.contains(words), "{words}: {}", ran.err);
    }
}
