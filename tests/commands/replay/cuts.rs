//! A log cut at any byte, or with any byte changed: no panic, no error but those documented, and
//! exactly the samples that stand wholly inside intact chunks.
//!
//! CI takes some of the offsets; `STRAPD_EVERY_OFFSET=1` takes all of them.

use crate::made_logs::{PACKINGS, TOPIC, bytes, logged, motion};
use crate::replays::replay_of;
use strapd::error::Error;
use strapd::pipeline::replay::run;
use strapd::pipeline::request::ReplayRequest;
use strapd::report::summary::RunSummary;
use strapd_recording::pool::Pool;

/// Samples in each log: some forty chunks' worth of bytes would only take longer.
const SAMPLES: usize = 40;

fn every_offset() -> bool {
    std::env::var_os("STRAPD_EVERY_OFFSET").is_some()
}

/// End of the last whole record before the end of `bytes`: nine bytes of head (opcode, length),
/// then the body.
pub(crate) fn whole_records(bytes: &[u8]) -> usize {
    record_ends(bytes).last().copied().unwrap_or(MAGIC)
}

const MAGIC: usize = 8;
const CHUNK: u8 = 6;
const MESSAGE: u8 = 5;

fn record_ends(bytes: &[u8]) -> Vec<usize> {
    let mut at = MAGIC;
    let mut ends = Vec::new();
    while let Some(head) = bytes.get(at..at + 9) {
        let length = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        let end = at + 9 + length;
        if end > bytes.len() {
            break;
        }
        ends.push(end);
        at = end;
    }
    ends
}

/// Ends of each stretch of the file that stands or falls together, and the samples in
/// it. Chunks by the `mcap` crate's index; unchunked messages record by record.
fn stretches(bytes: &[u8]) -> Vec<(usize, u64)> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    if !summary.chunk_indexes.is_empty() {
        return summary
            .chunk_indexes
            .iter()
            .map(|index| {
                let end = index.chunk_start_offset + index.chunk_length;
                let inside = summary.stream_chunk(bytes, index).unwrap();
                (end as usize, inside.map(Result::unwrap).count() as u64)
            })
            .collect();
    }
    let mut from = MAGIC;
    let mut out = Vec::new();
    for end in record_ends(bytes) {
        if bytes[from] == MESSAGE {
            out.push((end, 1));
        }
        from = end;
    }
    out
}

struct Bench {
    dir: tempfile::TempDir,
    pool: Pool,
}

impl Bench {
    fn new() -> Bench {
        Bench {
            dir: tempfile::tempdir().unwrap(),
            // One thread: thousands of tiny logs, and what is tested is not the threads.
            pool: Pool::new(1).unwrap(),
        }
    }

    fn replay(&self, bytes: &[u8]) -> Result<RunSummary, Error> {
        let path = self.dir.path().join("log.mcap");
        std::fs::write(&path, bytes).unwrap();
        self.run(&replay_of(&path))
    }

    fn run(&self, replay: &ReplayRequest) -> Result<RunSummary, Error> {
        run(replay, &self.pool, &mut |_| {})
    }
}

/// The samples used; 0 when there was no topic to use any of.
fn used(result: &Result<RunSummary, Error>) -> u64 {
    result.as_ref().map_or(0, |summary| {
        summary.topics.iter().map(|t| t.counts.used()).sum()
    })
}

/// Asserts how a damaged log may end. Anything else (an `Open`, a `Usage`) would blame the wrong thing.
fn assert_documented(result: &Result<RunSummary, Error>, what: &str) {
    match result {
        Ok(summary) => {
            for topic in &summary.topics {
                let finite = topic.final_wxyz.iter().all(|v| v.is_finite())
                    && topic.final_sigma.iter().all(|v| v.is_finite());
                assert!(finite, "{what}: {topic:?}");
            }
            // Every way to say it must work too.
            let _ = (summary.text(), summary.json());
        }
        Err(
            Error::Recording(strapd_recording::Error::Empty { .. })
            | Error::Recording(strapd_recording::Error::NotMcap { .. })
            | Error::Recording(strapd_recording::Error::NoImuTopic { .. })
            | Error::Recording(strapd_recording::Error::SeveralImuTopics { .. })
            | Error::Recording(strapd_recording::Error::Unsupported { .. })
            | Error::Recording(strapd_recording::Error::Topic { .. }),
        ) => {}
        Err(other) => panic!("{what}: {other:?}"),
    }
}

#[test]
fn a_log_cut_at_any_byte_gives_the_samples_in_whole_chunks_and_says_that_it_was_cut() {
    // A prime, so that the offsets fall on every kind of byte.
    let step = if every_offset() { 1 } else { 61 };
    let bench = Bench::new();
    for (packing_name, packing) in PACKINGS {
        let whole = bytes(packing, 1500, &logged(TOPIC, &motion(SAMPLES)));
        let stretches = stretches(&whole);
        let all: u64 = stretches.iter().map(|(_, n)| n).sum();
        assert_eq!(all, SAMPLES as u64);
        assert!(stretches.len() >= 8, "{packing_name}: {}", stretches.len());
        // The edges of every stretch are the places where a comparison is off by one.
        let edges = stretches
            .iter()
            .flat_map(|(end, _)| [end - 1, *end, end + 1]);
        let mut cuts: Vec<usize> = (0..whole.len())
            .step_by(step)
            .chain(edges)
            .chain([
                1,
                7,
                8,
                9,
                whole.len() - 9,
                whole.len() - 8,
                whole.len() - 1,
            ])
            .collect();
        cuts.sort_unstable();
        cuts.dedup();
        let mut ends = [0u64; 2];
        for cut in &cuts {
            let what = format!("{packing_name} cut at {cut} of {}", whole.len());
            let result = bench.replay(&whole[..*cut]);
            assert_documented(&result, &what);
            let inside = stretches.iter().filter(|(end, _)| end <= cut);
            let expected: u64 = inside.map(|(_, n)| n).sum();
            assert_eq!(used(&result), expected, "{what}: {result:?}");
            match &result {
                Ok(summary) => {
                    assert!(summary.is_lossy(), "{what}: {summary:?}");
                    assert!(!summary.file_problems.is_empty(), "{what}");
                    ends[0] += 1;
                }
                Err(error) => {
                    assert_eq!(expected, 0, "{what}: {error}");
                    ends[1] += 1;
                }
            }
        }
        let intact = bench.replay(&whole).unwrap();
        assert!(!intact.is_lossy(), "{packing_name}: {intact:?}");
        assert_eq!(used(&Ok(intact)), SAMPLES as u64);
        eprintln!(
            "{packing_name}: {} cuts of {} bytes; {} summaries, {} errors",
            cuts.len(),
            whole.len(),
            ends[0],
            ends[1]
        );
        // A cut that leaves a whole chunk leaves a summary: most cuts do.
        assert!(ends[0] > ends[1] && ends[1] > 0, "{packing_name}: {ends:?}");
    }
}

#[test]
fn a_changed_byte_is_never_believed_where_a_checksum_covers_it() {
    let step = if every_offset() { 1 } else { 37 };
    let bench = Bench::new();
    for (packing_name, packing) in PACKINGS {
        let whole = bytes(packing, 1500, &logged(TOPIC, &motion(SAMPLES)));
        let good = bench.replay(&whole).unwrap();
        let spans = chunk_payloads(&whole);
        let mut noticed = 0u64;
        let mut tried = 0u64;
        for at in (0..whole.len()).step_by(step) {
            let mut bad = whole.clone();
            // All bits, or one: lengths become huge, or off by a power of two.
            bad[at] ^= if at % 2 == 0 { 0xff } else { 1 << (at % 8) };
            let what = format!("{packing_name}, byte {at} of {}", whole.len());
            let result = bench.replay(&bad);
            assert_documented(&result, &what);
            assert!(used(&result) <= SAMPLES as u64, "{what}: {result:?}");
            tried += 1;
            if let Ok(summary) = &result
                && summary.is_lossy()
            {
                noticed += 1;
            }
            if spans.iter().any(|(from, to)| (*from..*to).contains(&at)) {
                // Inside a chunk's records the CRC stands watch: the chunk goes, the rest stays.
                let Ok(summary) = &result else {
                    panic!("{what}: the other chunks are intact: {result:?}");
                };
                // Compressors have bits that mean nothing: then the records come out as they were.
                let unharmed = packing_name != "none"
                    && summary.topics[0].final_wxyz == good.topics[0].final_wxyz;
                assert!(
                    unharmed || (summary.is_lossy() && used(&result) < SAMPLES as u64),
                    "{what}: {summary:?}"
                );
            } else if let Ok(summary) = &result
                && packing.is_some()
                && used(&result) == SAMPLES as u64
                && !summary.is_lossy()
            {
                // Nothing lost, nothing said: then nothing may be different.
                assert_eq!(
                    summary.topics[0].final_wxyz, good.topics[0].final_wxyz,
                    "{what}"
                );
            }
        }
        eprintln!("{packing_name}: {tried} changed bytes, {noticed} reported as loss");
    }
}

/// Places of the (packed) records of every chunk but the first. The first holds the channel: when
/// it goes, what its messages are is known by the summary alone.
fn chunk_payloads(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut from = MAGIC;
    let mut out = Vec::new();
    for end in record_ends(bytes) {
        if bytes[from] == CHUNK {
            // Head 9; start, end, size 24; CRC 4; compression 4 + text; length of the records 8.
            let text = u32::from_le_bytes(bytes[from + 37..from + 41].try_into().unwrap());
            out.push((from + 41 + text as usize + 8, end));
        }
        from = end;
    }
    out.into_iter().skip(1).collect()
}

#[test]
fn a_log_grown_by_rubbish_or_cut_to_its_end_magic_is_read_to_its_last_sample() {
    let bench = Bench::new();
    let whole = bytes(PACKINGS[2].1, 1500, &logged(TOPIC, &motion(SAMPLES)));
    let mut grown = whole.clone();
    grown.extend([0u8; 1000]);
    let mut twice = whole.clone();
    twice.extend(&whole);
    for (what, log) in [("zeros behind", grown), ("the log twice", twice)] {
        let result = bench.replay(&log);
        assert_documented(&result, what);
        assert!(used(&result) >= SAMPLES as u64, "{what}: {result:?}");
    }
}

#[test]
fn a_cut_pipe_gives_what_a_cut_file_gives() {
    let whole = bytes(PACKINGS[2].1, 1500, &logged(TOPIC, &motion(SAMPLES)));
    let bench = Bench::new();
    for cut in (0..whole.len()).step_by(whole.len() / 12) {
        let from_file = bench.replay(&whole[..cut]);
        let output = assert_cmd::Command::cargo_bin("strapd")
            .unwrap()
            .args(["replay", "-", "-o", "null:", "--json", "--threads", "1"])
            .env("STRAPD_AID", "none")
            .write_stdin(&whole[..cut])
            .output()
            .unwrap();
        let what = format!("cut at {cut}: {output:?}");
        match from_file {
            Err(_) => assert_eq!(output.status.code(), Some(1), "{what}"),
            Ok(summary) => {
                assert_eq!(output.status.code(), Some(3), "{what}");
                let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
                let used = json["topics"][0]["samples"]["used"].as_u64().unwrap();
                assert_eq!(used, summary.topics[0].counts.used(), "{what}");
            }
        }
    }
}
