//! A stamp that is a bare number in a log: one unit for its channel, the same in every command, told by
//! the first messages or refused with the flag that states it.

use super::{Ran, strapd, strapd_fed};
use crate::made_logs::START;
use crate::writer::Proto;
use std::io::Cursor;
use std::path::Path;

const N: i64 = 200;

/// A clock's number at the n-th sample.
type Count = fn(i64) -> i64;

/// Kind of a log: message encoding, schema, and a message with this stamp.
struct Kind {
    encoding: &'static str,
    schema: Vec<u8>,
    /// Message with a whole number, and with a fraction.
    whole: fn(i64) -> Vec<u8>,
    float: fn(f64) -> Vec<u8>,
}

fn xyz() -> Proto {
    Proto::default()
        .double(1, 0.01)
        .double(2, 0.2)
        .double(3, 0.5)
}

/// JSON, and protobuf with the stamp in field 2, whose type is the descriptor's `kind`.
fn kinds(kind: u64) -> [Kind; 2] {
    let axis = |name: &str, number| Proto::field(name, number, false, 1, "");
    let vector = Proto::message_type("Vec", vec![axis("x", 1), axis("y", 2), axis("z", 3)]);
    let fields = vec![
        Proto::field("gyro", 1, false, 11, ".p.Vec"),
        Proto::field("timestamp", 2, false, kind, ""),
    ];
    [
        Kind {
            encoding: "json",
            schema: b"{\"type\":\"object\"}".to_vec(),
            whole: |stamp| json(&stamp.to_string()),
            float: |stamp| json(&stamp.to_string()),
        },
        Kind {
            encoding: "protobuf",
            schema: Proto::file_set("p", vec![vector, Proto::message_type("Imu", fields)]),
            whole: |stamp| Proto::default().message(1, xyz()).varint(2, stamp as u64).0,
            float: |stamp| Proto::default().message(1, xyz()).double(2, stamp).0,
        },
    ]
}

fn json(stamp: &str) -> Vec<u8> {
    format!("{{\"timestamp\":{stamp},\"gyro\":{{\"x\":0.01,\"y\":0.2,\"z\":0.5}}}}").into_bytes()
}

/// A log of these messages on `/imu`, the n-th recorded at `recorded(n)`.
fn write(dir: &Path, name: &str, kind: &Kind, messages: &[Vec<u8>], recorded: Count) {
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let language = match kind.encoding {
        "json" => "jsonschema",
        other => other,
    };
    let schema = writer.add_schema("p.Imu", language, &kind.schema).unwrap();
    let channel_id = writer
        .add_channel(schema, "/imu", kind.encoding, &Default::default())
        .unwrap();
    for (n, payload) in messages.iter().enumerate() {
        let log_time = recorded(n as i64) as u64;
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: n as u32,
            log_time,
            publish_time: log_time,
        };
        writer.write_to_known_channel(&header, payload).unwrap();
    }
    writer.finish().unwrap();
    std::fs::write(dir.join(name), writer.into_inner().into_inner()).unwrap();
}

/// All of it at once, as what converts a file does.
fn in_a_burst(n: i64) -> i64 {
    START + n
}

/// 200 Hz, by a clock that has nothing to do with the stamps' but its speed.
fn as_it_came(n: i64) -> i64 {
    START + n * 5_000_000
}

/// Samples used, and their time span in seconds.
#[track_caller]
fn used(ran: &Ran) -> (i64, f64) {
    let topic = &ran.done().json()["topics"][0];
    let samples = &topic["samples"];
    (
        samples["used"].as_i64().unwrap(),
        (topic["duration_s"].as_f64().unwrap() * 1e6).round() / 1e6,
    )
}

#[test]
fn whatever_the_clock_counts_all_samples_are_integrated_over_the_right_time() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // 200 Hz each. The fourth is near our time in seconds by its size, the fifth in microseconds.
    let clocks: [(&str, Count); 6] = [
        ("ns from 0", |n| n * 5_000_000),
        ("ns from 1 s", |n| 1_000_000_000 + n * 5_000_000),
        ("us from 0", |n| n * 5_000),
        ("us from half an hour", |n| 1_800_000_000 + n * 5_000),
        ("ns from 20 days", |n| 1_728_000_000_000_000 + n * 5_000_000),
        ("ms of our time", |n| 1_690_000_000_000 + n * 5),
    ];
    for (what, stamp) in clocks {
        for kind in kinds(3) {
            for (recorded, how) in [(in_a_burst as Count, "burst"), (as_it_came, "live")] {
                let messages: Vec<Vec<u8>> = (0..N).map(|n| (kind.whole)(stamp(n))).collect();
                write(at, "log.mcap", &kind, &messages, recorded);
                let what = format!("{what}, {}, {how}", kind.encoding);
                let file = strapd(at, "replay log.mcap --topic /imu --json");
                assert_eq!(used(&file), (N, 0.995), "{what}: {}", file.out);
                let bytes = std::fs::read(at.join("log.mcap")).unwrap();
                let piped = strapd_fed(at, "replay - --topic /imu --json", bytes);
                assert_eq!(used(&piped), (N, 0.995), "{what}: {}", piped.out);
            }
        }
    }
}

#[test]
fn seconds_with_a_fraction_keep_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for from in [0.0, 12.0, 1_690_000_000.0] {
        for kind in kinds(1) {
            let stamp = |n: i64| from + n as f64 * 0.005;
            let messages: Vec<Vec<u8>> = (0..N).map(|n| (kind.float)(stamp(n))).collect();
            write(at, "log.mcap", &kind, &messages, in_a_burst);
            let ran = strapd(at, "replay log.mcap --topic /imu --json");
            assert_eq!(
                used(&ran),
                (N, 0.995),
                "{from}, {}: {}",
                kind.encoding,
                ran.out
            );
        }
    }
}

/// 1 kHz in ns, or 1 Hz in us: nothing in the messages tells.
fn ambiguous(dir: &Path, kind: &Kind, recorded: Count) {
    let messages: Vec<Vec<u8>> = (0..N).map(|n| (kind.whole)(n * 1_000_000)).collect();
    write(dir, "log.mcap", kind, &messages, recorded);
}

#[test]
fn what_can_not_be_told_is_refused_by_every_command_with_the_flag_that_states_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for kind in kinds(3) {
        ambiguous(at, &kind, in_a_burst);
        let path = match kind.encoding {
            "json" => "PATH",
            _ => "timestamp",
        };
        let flag = format!("--field stamp={path}:ns (or us, ms, s)");
        let words = ["/imu", "bare number", "steps of 1000000", "ns or us", &flag];
        for command in [
            "replay",
            "check",
            "report -o out.html",
            "cat",
            "info",
            "allan",
        ] {
            let ran = strapd(at, &format!("{command} --topic /imu log.mcap"));
            assert_eq!(ran.code, Some(1), "{command}: {ran:?}");
            for word in words {
                assert!(ran.err.contains(word), "{command}: `{word}`: {}", ran.err);
            }
        }
        let bytes = std::fs::read(at.join("log.mcap")).unwrap();
        let piped = strapd_fed(at, "replay - --topic /imu", bytes.clone());
        piped.refused(1, &words);
        for (unit, secs) in [("ns", 0.199), ("us", 199.0)] {
            let flags = format!("--topic /imu --json --field stamp=timestamp:{unit}");
            let ran = strapd(at, &format!("replay log.mcap {flags}"));
            assert_eq!(used(&ran), (N, secs), "{}", kind.encoding);
            let piped = strapd_fed(at, &format!("replay - {flags}"), bytes.clone());
            assert_eq!(used(&piped), (N, secs), "{}", kind.encoding);
        }
        // Who takes other stamps needs no unit of these.
        let ran = strapd(
            at,
            "replay log.mcap --topic /imu --json --time index --rate-hz 200",
        );
        assert_eq!(used(&ran), (N, 0.995));
        // And a recorder's clock that goes as fast tells it.
        ambiguous(at, &kind, |n| START + n * 1_000_000);
        let ran = strapd(at, "replay log.mcap --topic /imu --json");
        assert_eq!(used(&ran), (N, 0.199), "{}", kind.encoding);
    }
}

/// Poses that turn by 2 mrad each.
fn poses(stamp: Count) -> Vec<Vec<u8>> {
    let pose = |n: i64| {
        let (z, w) = (n as f64 * 0.001).sin_cos();
        format!(
            "{{\"timestamp\":{},\"orientation\":{{\"w\":{w},\"x\":0,\"y\":0,\"z\":{z}}}}}",
            stamp(n)
        )
        .into_bytes()
    };
    (0..N).map(pose).collect()
}

#[test]
fn an_attitude_to_compare_with_is_read_in_the_unit_of_its_steps_too() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let [kind, _] = kinds(3);
    let messages = poses(|n| 2_000_000_000 + n * 5_000_000);
    write(at, "poses.mcap", &kind, &messages, in_a_burst);
    let rows = |n: i64| {
        let (z, w) = (n as f64 * 0.001).sin_cos();
        format!(
            "{{\"class\":\"ATT\",\"stamp\":{{\"sec\":{},\"nsec\":{}}},\"q\":{{\"w\":{w},\"x\":0,\"y\":0,\"z\":{z}}}}}\n",
            2 + n / 200,
            n % 200 * 5_000_000
        )
    };
    std::fs::write(at.join("same.ndjson"), (0..N).map(rows).collect::<String>()).unwrap();
    let compare = "compare poses.mcap same.ndjson --align none --max-angle 0.000001";
    strapd(at, compare).done();
    let messages = poses(|n| 2_000_000_000 + n * 1_000_000);
    write(at, "poses.mcap", &kind, &messages, in_a_burst);
    strapd(at, compare).refused(1, &["/imu", "ns or us", "stamp_ns"]);
    // Slower than any gyro, in seconds of our time.
    let messages = poses(|n| START / 1_000_000_000 + n * 5);
    write(at, "slow.mcap", &kind, &messages, |n| {
        START + n * 5_000_000_000
    });
    let ran = strapd(at, "compare slow.mcap same.ndjson");
    ran.refused(1, &["1700000000000000000 to 1700000995000000000 ns"]);
}
