//! Replays in this process, and what came out of them, bit by bit.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::expect_used)]

use std::path::{Path, PathBuf};
use strapd::error::Result;
use strapd::pipeline::replay::run;
use strapd::pipeline::request::ReplayRequest;
use strapd::report::summary::{RunSummary, TopicSummary};
use strapd::sink::Target;
use strapd_attitude::estimate::EstimationSettings;
use strapd_recording::Source;
use strapd_recording::pool::Pool;

/// A replay of a file into nothing, every setting at its default.
pub fn replay_of(path: &Path) -> ReplayRequest {
    ReplayRequest {
        targets: vec![Target::Null],
        command: "test".to_owned(),
        ..ReplayRequest::new(Source::File(path.to_owned()))
    }
}

/// The same with a plan.
pub fn replay_with(path: &Path, plan: EstimationSettings) -> ReplayRequest {
    ReplayRequest {
        plan,
        ..replay_of(path)
    }
}

/// The same of one topic.
pub fn replay_named(path: &Path, topic: &str) -> ReplayRequest {
    let mut replay = replay_of(path);
    replay.selection.topic = Some(topic.to_owned());
    replay
}

/// The same with a `--field`.
pub fn replay_by(path: &Path, field: &str) -> ReplayRequest {
    let mut replay = replay_of(path);
    replay.selection.decode.fields = vec![field.parse().unwrap()];
    replay
}

/// Runs it on two threads, watched by nobody.
pub fn done(replay: &ReplayRequest) -> Result<RunSummary> {
    run(replay, &Pool::new(2).unwrap(), &mut |_| {})
}

/// The summary's only topic.
pub fn only(summary: &RunSummary) -> &TopicSummary {
    assert_eq!(summary.topics.len(), 1, "{summary:?}");
    &summary.topics[0]
}

/// One attitude as it was written, in bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bits {
    pub stamp: i64,
    pub wxyz: [u64; 4],
}

impl Bits {
    pub fn numbers(&self) -> [f64; 4] {
        self.wxyz.map(f64::from_bits)
    }
}

/// The attitudes of an NDJSON output. Its numbers are the shortest that read back to the same bits,
/// and this reader (`float_roundtrip`) reads them so.
pub fn ndjson(text: &str) -> Vec<Bits> {
    text.lines()
        .map(|line| {
            let object: serde_json::Value = serde_json::from_str(line).unwrap();
            let whole = |key: &str| object["stamp"][key].as_i64().unwrap();
            Bits {
                stamp: whole("sec") * 1_000_000_000 + whole("nsec"),
                wxyz: ["w", "x", "y", "z"].map(|c| object["q"][c].as_f64().unwrap().to_bits()),
            }
        })
        .collect()
}

/// The attitudes of a CSV output.
pub fn csv(text: &str) -> Vec<Bits> {
    text.lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            Bits {
                stamp: cells[0].parse().unwrap(),
                wxyz: [1, 2, 3, 4].map(|i| cells[i].parse::<f64>().unwrap().to_bits()),
            }
        })
        .collect()
}

/// The attitudes in the Imu messages of an MCAP output, by the `mcap` crate and by offset: behind
/// the encapsulation (4), the stamp (8) and the frame's text, on a multiple of eight.
pub fn mcap(bytes: &[u8], topic: &str) -> Vec<Bits> {
    mcap::MessageStream::new(bytes)
        .unwrap()
        .map(|message| message.unwrap())
        .filter(|message| message.channel.topic == topic)
        .map(|message| {
            let data = &message.data;
            let u32_at = |at: usize| u32::from_le_bytes(data[at..at + 4].try_into().unwrap());
            let numbers = 4 + (12 + u32_at(12) as usize).next_multiple_of(8);
            let bits = |i: usize| {
                let at = numbers + 8 * i;
                u64::from_le_bytes(data[at..at + 8].try_into().unwrap())
            };
            Bits {
                stamp: i64::from(u32_at(4)) * 1_000_000_000 + i64::from(u32_at(8)),
                wxyz: [bits(3), bits(0), bits(1), bits(2)],
            }
        })
        .collect()
}

/// Replays into an NDJSON file under `dir` and reads the attitudes back.
pub fn attitudes(replay: &ReplayRequest, dir: &Path) -> (RunSummary, Vec<Bits>) {
    let path = dir.join("attitudes.ndjson");
    let mut replay = replay.clone();
    replay.targets = vec![target(&path)];
    replay.options.force = true;
    let summary = done(&replay).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    (summary, ndjson(&text))
}

pub fn target(path: &Path) -> Target {
    Target::parse(path.to_str().unwrap()).unwrap()
}

/// A file of `fixtures/`.
pub fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name)
}

/// Every number finite, every quaternion a rotation. 1e-12: the bound of the promise "unit norm"
///; one rounding of a norm is 1e-16.
pub fn assert_rotations(attitudes: &[Bits], what: &str) {
    for a in attitudes {
        let norm = a.numbers().iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!((norm - 1.0).abs() <= 1e-12, "{what}: {a:?} has norm {norm}");
    }
}
