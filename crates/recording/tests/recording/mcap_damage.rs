//! Damaged logs: everything that is intact is read, nothing is made up, and what is lost is said.

use crate::mcap_logs::{PACKINGS, Read, fine, from_bytes, log, messages, on_disk, pool};
use crate::mcap_logs::{random, read, read_some, stretches};
use crate::meter::Meter;
use std::path::Path;
use std::time::Duration;
use strapd_recording::Error;
use strapd_recording::mcap::{ProblemKind, Reader, op};

/// Reads a log cut or broken in some way, from a file with two threads and from a stream with one; both must agree.
fn read_both(bytes: &[u8], dir: &Path, pool: &rayon::ThreadPool) -> Option<(Vec<Read>, u64)> {
    let path = dir.join("b.mcap");
    std::fs::write(&path, bytes).unwrap();
    let reader = match Reader::open(&path) {
        Ok(reader) => reader,
        Err(Error::Empty { .. } | Error::NotMcap { .. }) => {
            assert!(from_bytes(bytes).is_err());
            return None;
        }
        Err(e) => panic!("{e}"),
    };
    // A small look-ahead makes the walk let go while it still reads.
    let mut options = fine(None);
    options.lookahead.blocks = 2;
    let (alone, first) = read_some(from_bytes(bytes).unwrap(), &options, |_| true);
    options.pool = Some(pool);
    let (items, report) = read_some(reader, &options, |_| true);
    let losses = report.survey.problems.losses();
    if first.survey.problems.is_empty() || report.survey.problems.is_empty() {
        assert!(items == alone, "without problems, file and stream agree");
    }
    Some((items, losses))
}

#[test]
fn a_log_cut_at_any_byte_gives_what_lies_wholly_before_the_cut() {
    let dir = tempfile::tempdir().unwrap();
    let pool = pool(2);
    for (name, packing) in PACKINGS {
        let bytes = log(packing, 512, &messages(60, 0));
        let stretches = stretches(&bytes);
        assert!(stretches.len() > 5, "{name}");
        for cut in 0..bytes.len() {
            let expected: Vec<Read> = stretches
                .iter()
                .filter(|(end, _)| *end <= cut)
                .flat_map(|(_, messages)| messages.clone())
                .collect();
            match read_both(&bytes[..cut], dir.path(), &pool) {
                None => assert!(cut < 8, "{name} cut at {cut}"),
                Some((items, losses)) => {
                    assert!(items == expected, "{name} cut at {cut}: {}", items.len());
                    assert!(losses > 0, "{name} cut at {cut} and not noticed");
                }
            }
        }
        let (items, losses) = read_both(&bytes, dir.path(), &pool).unwrap();
        assert_eq!((items.len(), losses), (60, 0), "{name} uncut");
    }
}

/// One byte changed: the messages are those that were written, or the damage is noticed.
fn change_one_byte(every: usize) {
    let dir = tempfile::tempdir().unwrap();
    let pool = pool(2);
    for (name, packing) in PACKINGS {
        let written = messages(60, 0);
        let bytes = log(packing, 512, &written);
        let mut cases = 0;
        for at in (0..bytes.len()).step_by(every) {
            for flip in [0x01, 0x80, 0xFF] {
                let mut broken = bytes.clone();
                broken[at] ^= flip;
                let Some((items, losses)) = read_both(&broken, dir.path(), &pool) else {
                    assert!(at < 8, "{name}: byte {at} ^ {flip:#x}");
                    continue;
                };
                assert!(
                    losses > 0 || items == written,
                    "{name}: byte {at} ^ {flip:#x} not noticed: {} messages",
                    items.len()
                );
                // Nothing may be made up. Unchunked messages have no CRC of their own: there the
                // damage is noticed at the end of the data, after they were used.
                if name != "unchunked" {
                    assert!(
                        items.iter().all(|m| written.contains(m)),
                        "{name}: byte {at}"
                    );
                    assert!(
                        items.len() + 15 >= written.len(),
                        "{name}: byte {at}: more than a chunk"
                    );
                }
                cases += 1;
            }
        }
        eprintln!("{name}: {cases} changed logs");
    }
}

#[test]
fn one_changed_byte_is_noticed_or_harmless() {
    change_one_byte(7);
}

#[test]
#[ignore = "every byte of every packing; minutes in a debug build"]
fn every_changed_byte_is_noticed_or_harmless() {
    change_one_byte(1);
}

/// Random damage of several kinds at once: no panic, no hang, nothing made up in a chunk.
#[test]
fn mutated_logs_end() {
    let cases = std::env::var("STRAPD_MUTATIONS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(400);
    let dir = tempfile::tempdir().unwrap();
    let pool = pool(2);
    let mut state = 99;
    for (name, packing) in PACKINGS {
        let written = messages(120, 5_000);
        let bytes = log(packing, 1_024, &written);
        for case in 0..cases {
            let mut broken = bytes.clone();
            for _ in 0..=random(&mut state) % 3 {
                let at = random(&mut state) as usize % broken.len();
                match random(&mut state) % 5 {
                    0 => broken.truncate(at.max(20)),
                    1 => broken[at] ^= 1 << (random(&mut state) % 8),
                    2 => {
                        let value = [u64::MAX, 1 << 40, random(&mut state), 0][case % 4];
                        let end = (at + 8).min(broken.len());
                        broken[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
                    }
                    3 => {
                        let end = (at + random(&mut state) as usize % 500).min(broken.len());
                        broken.drain(at..end);
                    }
                    _ => {
                        let end = (at + random(&mut state) as usize % 300).min(broken.len());
                        let piece = broken[at..end].to_vec();
                        let to = random(&mut state) as usize % broken.len();
                        broken.splice(to..to, piece);
                    }
                }
                if broken.len() < 20 {
                    break;
                }
            }
            let mut meter = Meter::start();
            read_both(&broken, dir.path(), &pool);
            // Promised are 200 ms per 100 kB; these logs have 10 kB and are read twice.
            meter.lap(Duration::from_secs(5), format_args!("{name}, case {case}"));
        }
    }
}

#[test]
fn a_bad_chunk_is_skipped_and_counted_and_the_rest_is_read() {
    let written = messages(200, 0);
    for (name, packing) in PACKINGS.into_iter().filter(|(_, p)| p.is_some()) {
        let bytes = log(packing, 1_024, &written);
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let third = &summary.chunk_indexes[2];
        let lost: Vec<u32> = summary
            .stream_chunk(&bytes, third)
            .unwrap()
            .map(|m| m.unwrap().sequence)
            .collect();
        let mut broken = bytes.clone();
        let inside = third.compressed_data_offset().unwrap() + third.compressed_size / 2;
        broken[inside as usize] ^= 4;
        let (items, report) = read(from_bytes(&broken).unwrap());
        let kept: Vec<_> = written
            .iter()
            .filter(|m| !lost.contains(&m.2))
            .cloned()
            .collect();
        assert!(items == kept, "{name}");
        let problems = report.survey.problems;
        assert_eq!(problems.total(), 1, "{name}: {problems:?}");
        assert_eq!(
            problems.first()[0].offset,
            third.chunk_start_offset,
            "{name}"
        );
        assert_eq!(problems.messages_lost(), lost.len() as u64, "{name}");
    }
}

#[test]
fn when_the_chunk_with_the_definitions_is_lost_the_summary_defines() {
    let written = messages(200, 0);
    let bytes = log(Some(None), 1_024, &written);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let first = &summary.chunk_indexes[0];
    let inside = summary.stream_chunk(&bytes, first).unwrap().count();
    let mut broken = bytes.clone();
    broken[first.compressed_data_offset().unwrap() as usize + 5] ^= 4;
    let dir = tempfile::tempdir().unwrap();
    let (items, report) = read(on_disk(&broken, dir.path(), "a.mcap"));
    assert!(items == written[inside..]);
    let kinds: Vec<_> = report
        .survey
        .problems
        .first()
        .iter()
        .map(|p| &p.kind)
        .collect();
    assert!(
        matches!(kinds[0], ProblemKind::ChunkCrc { .. }),
        "{kinds:?}"
    );
    let topics: Vec<_> = kinds[1..]
        .iter()
        .map(|k| match k {
            ProblemKind::DefinedBySummary { topic } => topic.as_str(),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(topics.len(), 2);
    assert!(topics.contains(&"/imu") && topics.contains(&"/other"));
    // The schema came with it.
    let channels = &report.survey.channels;
    let imu = channels.iter().find(|c| c.channel.topic == "/imu").unwrap();
    assert_eq!(imu.channel.schema.as_ref().unwrap().data, b"# text");
    // A stream has no summary to turn to: all are counted as undefined.
    let (items, report) = read(from_bytes(&broken).unwrap());
    assert_eq!(items.len(), 0);
    assert_eq!(report.survey.problems.messages_lost(), 200);
}

/// A record: opcode, length, body.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

/// A chunk's body before its records.
fn chunk_head(size: u64, crc: u32, compression: &str, packed: u64) -> Vec<u8> {
    let mut b = vec![0; 16];
    b.extend(size.to_le_bytes());
    b.extend(crc.to_le_bytes());
    b.extend((compression.len() as u32).to_le_bytes());
    b.extend(compression.as_bytes());
    b.extend(packed.to_le_bytes());
    b
}

/// Everything before the summary, and the rest.
fn split_at_data_end(bytes: &[u8]) -> (&[u8], &[u8]) {
    let footer = &bytes[bytes.len() - 28..];
    let summary = u64::from_le_bytes(footer[..8].try_into().unwrap()) as usize;
    // DataEnd is 13 bytes and stands just before the summary.
    bytes.split_at(summary - 13)
}

#[test]
fn lengths_that_can_not_be_are_refused_and_reading_goes_on_at_the_next_chunk() {
    let bytes = log(Some(None), 1_024, &messages(50, 0));
    let whole = read(from_bytes(&bytes).unwrap()).0;
    let (data, rest) = split_at_data_end(&bytes);
    // After the header, before the first chunk.
    let start = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    for length in [
        u64::MAX,
        u64::MAX - 8,
        1 << 62,
        bytes.len() as u64 * 2,
        1 << 26,
    ] {
        for opcode in [
            0,
            op::SCHEMA,
            op::MESSAGE,
            op::CHUNK,
            op::METADATA,
            0x7F,
            0xFE,
        ] {
            let head = [&[opcode][..], &length.to_le_bytes()].concat();
            let broken = [&data[..start], &head, &data[start..], rest].concat();
            let dir = tempfile::tempdir().unwrap();
            let (items, report) = read(on_disk(&broken, dir.path(), "a.mcap"));
            assert!(
                items == whole,
                "opcode {opcode} of {length}: {} messages",
                items.len()
            );
            assert!(
                report.survey.problems.losses() > 0,
                "opcode {opcode} of {length}"
            );
        }
    }
}

#[test]
fn a_chunk_whose_length_is_too_long_does_not_take_its_neighbours_with_it() {
    let written = messages(200, 0);
    let bytes = log(Some(None), 1_024, &written);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let second = &summary.chunk_indexes[1];
    let at = second.chunk_start_offset as usize;
    let lost: Vec<u32> = summary
        .stream_chunk(&bytes, second)
        .unwrap()
        .map(|m| m.unwrap().sequence)
        .collect();
    let mut broken = bytes.clone();
    let length = (second.chunk_length - 9 + 5_000).to_le_bytes();
    broken[at + 1..at + 9].copy_from_slice(&length);
    let (items, report) = read(from_bytes(&broken).unwrap());
    let mut kept = written.clone();
    kept.retain(|m| !lost.contains(&m.2));
    assert!(items == kept, "{} of {}", items.len(), kept.len());
    // The statistics tell how many are missing.
    assert_eq!(report.survey.problems.messages_lost(), lost.len() as u64);
}

#[test]
fn an_index_whose_length_is_too_long_costs_no_messages() {
    let written = messages(200, 0);
    let bytes = log(Some(None), 1_024, &written);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let offsets = &summary.chunk_indexes[1].message_index_offsets;
    let at = *offsets.values().max().unwrap() as usize;
    assert_eq!(bytes[at], op::MESSAGE_INDEX);
    for more in [1, 100, 2_000] {
        let mut broken = bytes.clone();
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) + more;
        broken[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
        let dir = tempfile::tempdir().unwrap();
        // A stream cannot go back to where it still knew what it read; a file can.
        let (items, report) = read(on_disk(&broken, dir.path(), "a.mcap"));
        assert!(items == written, "{more}: {}", items.len());
        assert!(report.survey.problems.losses() > 0, "{more}");
    }
}

#[test]
fn a_record_of_the_summary_that_became_a_message_is_none() {
    let written = messages(50, 0);
    let bytes = log(Some(None), 1_024, &written);
    let (data, rest) = split_at_data_end(&bytes);
    // Behind the 13 bytes of DataEnd the summary begins, with a schema or a channel.
    let at = data.len() + 13;
    assert!(
        matches!(bytes[at], op::SCHEMA | op::CHANNEL),
        "{}",
        rest[13]
    );
    let mut broken = bytes.clone();
    broken[at] = op::MESSAGE;
    let (items, report) = read(from_bytes(&broken).unwrap());
    assert!(items == written);
    assert!(!report.survey.problems.is_empty());
}

#[test]
fn a_chunk_its_writer_never_finished_is_told_and_read_where_it_is_not_compressed() {
    let written = messages(50, 0);
    let bytes = log(Some(None), 1_024, &written);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let last = summary.chunk_indexes.last().unwrap();
    let at = last.chunk_start_offset as usize;
    let inner = last.compressed_data_offset().unwrap() as usize;
    let end = inner + last.compressed_size as usize;
    let unfinished = |compression: &str, cut: usize| {
        let head = chunk_head(u64::MAX, u32::MAX, compression, u64::MAX);
        [
            &bytes[..at],
            &[op::CHUNK],
            &u64::MAX.to_le_bytes(),
            &head,
            &bytes[inner..cut],
        ]
        .concat()
    };
    let before = 50 - summary.stream_chunk(&bytes, last).unwrap().count();
    assert!(before > 0);
    let (items, report) = read(from_bytes(&unfinished("", end)).unwrap());
    assert!(items == written);
    let kinds: Vec<_> = report
        .survey
        .problems
        .first()
        .iter()
        .map(|p| p.kind.clone())
        .collect();
    assert_eq!(kinds[0], ProblemKind::UnfinishedChunk { read_on: true });
    assert_eq!(kinds[1], ProblemKind::NoFooter);
    // One byte less: one message less.
    let (items, _) = read(from_bytes(&unfinished("", end - 1)).unwrap());
    assert!(items == written[..49]);
    let (items, report) = read(from_bytes(&unfinished("zstd", end)).unwrap());
    assert!(items == written[..before]);
    assert_eq!(
        report.survey.problems.first()[0].kind,
        ProblemKind::UnfinishedChunk { read_on: false }
    );
}

#[test]
fn every_fault_of_a_chunk_is_named() {
    let bytes = log(Some(None), 1 << 20, &messages(3, 0));
    let (data, rest) = split_at_data_end(&bytes);
    let packed = zstd::bulk::compress(&[7; 1000], 1).unwrap();
    let n = packed.len() as u64;
    let lz4 = lz4_flex::block::compress(&[7; 1000]);
    let chunk = |head: Vec<u8>, packed: &[u8]| record(op::CHUNK, &[head, packed.to_vec()].concat());
    let over = 65 << 20;
    type Case = (Vec<u8>, fn(&ProblemKind) -> bool);
    let zeros = zstd::bulk::compress(&vec![0; 8 << 20], 1).unwrap();
    let none = chunk_head(8 << 20, 0, "zstd", zeros.len() as u64);
    let skipped = record(0x80, b"a record of a kind that is stepped over");
    let after = [skipped.as_slice(), &vec![0; 8 << 20]].concat();
    let size = after.len() as u64;
    let after = zstd::bulk::compress(&after, 1).unwrap();
    let behind = chunk_head(size, 0, "zstd", after.len() as u64);
    let cases: [Case; 11] = [
        (chunk(chunk_head(1000, 1, "zstd", n), &packed), |k| {
            matches!(k, ProblemKind::ChunkCrc { stored: 1, .. })
        }),
        (chunk(chunk_head(999, 0, "zstd", n), &packed), |k| {
            matches!(k, ProblemKind::Unpack { .. })
        }),
        (chunk(chunk_head(1001, 0, "zstd", n), &packed), |k| {
            *k == ProblemKind::ChunkSize {
                declared: 1001,
                actual: 1000,
            }
        }),
        (chunk(chunk_head(over, 0, "zstd", n), &packed), |k| {
            *k == ProblemKind::ChunkTooBig {
                size: 65 << 20,
                limit: 64 << 20,
            }
        }),
        (chunk(chunk_head(n + 1, 0, "", n), &packed), |k| {
            matches!(k, ProblemKind::ChunkSize { .. })
        }),
        (chunk(chunk_head(1000, 0, "xz", n), &packed), |k| {
            *k == ProblemKind::UnknownCompression {
                name: "xz".to_owned(),
            }
        }),
        (
            chunk(chunk_head(1000, 0, "lz4", lz4.len() as u64), &lz4),
            |k| matches!(k, ProblemKind::Unpack { .. }),
        ),
        (
            chunk(chunk_head(12, 0, "", 12), &record(op::MESSAGE, &[0; 3])),
            |k| *k == ProblemKind::ShortMessages,
        ),
        // Nine zeros would be a record of nothing, and a megabyte of them a hundred thousand.
        (chunk(chunk_head(900, 0, "", 900), &[0; 900]), |k| {
            *k == ProblemKind::NoInnerRecord { at: 0 }
        }),
        // Eight megabytes of them in a few hundred bytes are not even unpacked.
        (chunk(none, &zeros), |k| {
            *k == ProblemKind::NoInnerRecord { at: 0 }
        }),
        (chunk(behind, &after), |k| {
            *k == ProblemKind::NoInnerRecord { at: 48 }
        }),
    ];
    for (i, (chunk, expected)) in cases.into_iter().enumerate() {
        let broken = [data, &chunk, rest].concat();
        let (items, report) = read(from_bytes(&broken).unwrap());
        assert_eq!(items.len(), 3, "case {i}");
        let problems = report.survey.problems;
        assert!(
            expected(&problems.first()[0].kind),
            "case {i}: {problems:?}"
        );
        assert!(problems.losses() > 0, "case {i}");
    }
}
