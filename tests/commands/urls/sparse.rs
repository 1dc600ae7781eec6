//! Promise: of a log with many topics only what is wanted is fetched; an index that does not hold is found out.

use super::server::{Manner, Server};
use crate::program::strapd;
use std::io::Cursor;
use strapd_recording::mcap::op;

/// A log of eight topics that say nothing of use, a second at a time, and one with rates in every eighth second.
fn log() -> Vec<u8> {
    let options = mcap::WriteOptions::new()
        .compression(None)
        .chunk_size(None)
        .profile("");
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let none = Default::default();
    let imu = writer.add_channel(0, "/imu", "json", &none).unwrap();
    let others: Vec<u16> = (0..8)
        .map(|n| {
            writer
                .add_channel(0, &format!("/camera/{n}"), "json", &none)
                .unwrap()
        })
        .collect();
    let mut state = 3;
    let mut noise = vec![b'"'; 600_000];
    for byte in &mut noise[1..599_999] {
        *byte = b'a' + (crate::mcap_logs::random(&mut state) % 26) as u8;
    }
    let header = |channel_id, log_time| mcap::records::MessageHeader {
        channel_id,
        sequence: 0,
        log_time,
        publish_time: log_time,
    };
    for second in 0..40_u64 {
        let t = 1_700_000_000_000_000_000 + second * 1_000_000_000;
        if second == 0 {
            // Every topic begins at once.
            for channel in &others {
                writer
                    .write_to_known_channel(&header(*channel, t), b"\"x\"")
                    .unwrap();
            }
        }
        if second % 8 == 0 {
            for n in 0..800_u64 {
                let t = t + n * 10_000_000;
                let line = format!(
                    "{{\"stamp_ns\":{t},\"gyro\":[0.1,{},0.3],\"accel\":[0,0,9.81]}}",
                    n as f64 * 1e-4
                );
                writer
                    .write_to_known_channel(&header(imu, t), line.as_bytes())
                    .unwrap();
            }
            writer.flush().unwrap();
        }
        for channel in &others {
            writer
                .write_to_known_channel(&header(*channel, t), &noise)
                .unwrap();
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Bytes of the chunks that hold a message of the topic, with the indexes behind them.
fn needed(log: &[u8], topic: &str) -> usize {
    let summary = mcap::Summary::read(log).unwrap().unwrap();
    let channel = summary
        .channels
        .values()
        .find(|c| c.topic == topic)
        .unwrap();
    let chunks = summary.chunk_indexes.iter();
    chunks
        .filter(|chunk| chunk.message_index_offsets.contains_key(&channel.id))
        .map(|chunk| (chunk.chunk_length + chunk.message_index_length) as usize)
        .sum()
}

#[test]
fn no_more_is_fetched_than_the_chunks_of_the_topic_and_both_ends() {
    let dir = tempfile::tempdir().unwrap();
    let log = log();
    std::fs::write(dir.path().join("log.mcap"), &log).unwrap();
    let run = "--topic /imu --force -q";
    strapd(dir.path(), &format!("replay log.mcap {run} -o file.csv")).done();
    let needed = needed(&log, "/imu");
    assert!(needed * 20 < log.len(), "{needed} of {}", log.len());
    for threads in [1, 2] {
        let server = Server::of(Manner::Good, log.clone());
        let there = server.url("log.mcap");
        let ran = strapd(
            dir.path(),
            &format!("--threads {threads} replay {there} {run} -o there.csv"),
        );
        ran.done();
        let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
        assert!(read("there.csv") == read("file.csv"));
        let most = needed * 105 / 100 + (128 << 10);
        println!(
            "{} fetched of {}, {needed} needed",
            server.sent(),
            log.len()
        );
        assert!(server.sent() <= most, "{} of {most}", server.sent());
    }
    // What was left out is said, and what is in the log is not less for it.
    let server = Server::of(Manner::Good, log.clone());
    let ran = strapd(
        dir.path(),
        &format!("replay {} --topic /imu -o null:", server.url("a.mcap")),
    );
    assert!(ran.done().err.contains("were not fetched"), "{}", ran.err);
}

/// The log with the summary's words about chunks changed, and its CRC made right again.
fn with_index(log: &[u8], change: impl Fn(usize, &mut ChunkIndexBytes<'_>)) -> Vec<u8> {
    let mut log = log.to_vec();
    let end = log.len() - 8;
    let footer = end - 29;
    let start = u64::from_le_bytes(log[footer + 9..footer + 17].try_into().unwrap()) as usize;
    let (mut at, mut number) = (start, 0);
    while at < footer {
        let opcode = log[at];
        let length = u64::from_le_bytes(log[at + 1..at + 9].try_into().unwrap()) as usize;
        if opcode == op::CHUNK_INDEX {
            change(
                number,
                &mut ChunkIndexBytes(&mut log[at + 9..at + 9 + length]),
            );
            number += 1;
        }
        at += 9 + length;
    }
    let crc = crc32fast::hash(&log[start..end - 4]);
    log[end - 4..end].copy_from_slice(&crc.to_le_bytes());
    log
}

/// The body of a chunk index.
struct ChunkIndexBytes<'a>(&'a mut [u8]);

impl ChunkIndexBytes<'_> {
    /// Gives the first channel of its messages another id.
    fn rename(&mut self, from: u16, to: u16) {
        let entries = u32::from_le_bytes(self.0[32..36].try_into().unwrap()) as usize / 10;
        for n in 0..entries {
            let id = &mut self.0[36 + n * 10..38 + n * 10];
            if id == from.to_le_bytes() {
                id.copy_from_slice(&to.to_le_bytes());
            }
        }
    }
}

/// Two chunks of ten messages, each of a topic of its own.
fn two_chunks() -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(None).chunk_size(None);
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let none = Default::default();
    let channels =
        ["/imu", "/other"].map(|topic| writer.add_channel(0, topic, "json", &none).unwrap());
    let blank = " ".repeat(60_000);
    for channel_id in channels {
        for n in 0..10 {
            let log_time = 1_700_000_000_000_000_000 + n * 10_000_000;
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: 0,
                log_time,
                publish_time: log_time,
            };
            let line = format!("{{\"stamp_ns\":{log_time},\"gyro\":[0.1,0.2,0.3]}}{blank}");
            writer
                .write_to_known_channel(&header, line.as_bytes())
                .unwrap();
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn an_index_that_does_not_add_up_is_not_used_and_one_that_lies_is_found_out() {
    let dir = tempfile::tempdir().unwrap();
    let log = two_chunks();
    let summary = mcap::Summary::read(&log).unwrap().unwrap();
    let mut ids: Vec<u16> = summary.channels.keys().copied().collect();
    ids.sort_unstable();
    let [imu, other] = ids[..] else {
        panic!("{ids:?}");
    };
    std::fs::write(dir.path().join("log.mcap"), &log).unwrap();
    let run = "--topic /imu --force -q";
    strapd(dir.path(), &format!("replay log.mcap {run} -o file.csv")).done();
    let there = |log: Vec<u8>| {
        let server = Server::of(Manner::Good, log);
        let url = server.url("log.mcap");
        let ran = strapd(dir.path(), &format!("replay {url} {run} -o there.csv"));
        (ran, server.sent())
    };
    let same = || {
        let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
        read("there.csv") == read("file.csv")
    };
    // As it is, the second chunk is fetched for the first message of its topic alone; of it, nothing is left out.
    let (ran, _) = there(log.clone());
    assert!(ran.code == Some(0) && same(), "{ran:?}");
    // It names one channel twice as often as the statistics: all is read.
    let (ran, sent) = there(with_index(&log, |_, index| index.rename(imu, other)));
    assert!(ran.code == Some(0) && same(), "{ran:?}");
    assert_eq!(sent, log.len());
    // The two changed places, which adds up.
    let lies = with_index(&log, |number, index| match number {
        0 => index.rename(imu, other),
        _ => index.rename(other, imu),
    });
    let (ran, _) = there(lies);
    ran.refused(
        1,
        &[
            "its index of chunks is not what is there",
            "save it to a file",
        ],
    );
}
