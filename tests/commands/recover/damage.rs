//! Damaged logs: what comes out is what the walk can prove, and all of that.

use super::{Whole, by_the_crate, extras, furnished, recover, walked};
use crate::mcap_logs::{PACKINGS, Read, log, messages, random, stretches};
use crate::shared_data::shared;
use std::path::{Path, PathBuf};
use strapd_recording::mcap::ProblemKind;

/// Recovers a file and holds the output against the walk of the input.
fn same_as_walked(input: &Path, output: &Path) -> (usize, bool) {
    let (expected, survey) = walked(input);
    let recovered = recover(input, output, 2);
    let out = std::fs::read(output).unwrap();
    let written = by_the_crate(&out);
    assert!(
        written == expected,
        "{}: {} messages",
        input.display(),
        written.len()
    );
    assert_eq!(recovered.written.messages, expected.len() as u64);
    // What was wrong with messages is said; attachments may add to it.
    assert!(
        recovered.survey.problems.total() >= survey.problems.total(),
        "{}: {:?} became {:?}",
        input.display(),
        survey.problems,
        recovered.survey.problems
    );
    let (again, clean) = walked(output);
    assert!(
        again == expected && clean.problems.is_empty(),
        "{}",
        input.display()
    );
    (written.len(), recovered.was_damaged())
}

fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let mut logs: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "mcap"))
        .collect();
    logs.sort();
    logs
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_hostile_and_foreign_log_gives_what_the_walk_yields() {
    let dir = tempfile::tempdir().unwrap();
    let output = dir.path().join("out.mcap");
    for folder in ["logs/hostile", "logs/native"] {
        let Some(folder) = shared(folder) else { return };
        let logs = logs_in(&folder);
        assert!(logs.len() > 4, "{}", folder.display());
        for path in logs {
            let (found, damaged) = same_as_walked(&path, &output);
            // The counts of shared/logs/README.md.
            let expected = match path.file_stem().unwrap().to_str().unwrap() {
                "01_no_summary" | "06_big_endian_cdr" => Some((953, false)),
                "02_truncated_mid_chunk" => Some((381, true)),
                "09_gap_2s" => Some((853, false)),
                "13_two_imu_topics" => Some((1907, false)),
                "25_header_only" => Some((0, false)),
                "mcap-0.25.0-hang" => Some((141, true)),
                "tiryoh_test_sample_truncated" => Some((found, true)),
                _ => None,
            };
            if let Some(expected) = expected {
                assert_eq!((found, damaged), expected, "{}", path.display());
            }
        }
    }
}

#[test]
fn a_log_cut_anywhere_gives_what_lies_wholly_before_the_cut() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    for (name, packing) in PACKINGS {
        let bytes = log(packing, 512, &messages(60, 0));
        let stretches = stretches(&bytes);
        assert!(stretches.len() > 5, "{name}");
        // A prime step meets every kind of place: heads, bodies, indexes, the summary.
        for cut in (8..bytes.len()).step_by(61).chain([bytes.len() - 1]) {
            std::fs::write(&input, &bytes[..cut]).unwrap();
            let expected: Vec<Read> = stretches
                .iter()
                .filter(|(end, _)| *end <= cut)
                .flat_map(|(_, messages)| messages.clone())
                .collect();
            let recovered = recover(&input, &output, 2);
            let out: Vec<Read> = by_the_crate(&std::fs::read(&output).unwrap())
                .into_iter()
                .map(|(topic, log_time, _, sequence, data)| (topic, log_time, sequence, data))
                .collect();
            assert!(out == expected, "{name} cut at {cut}: {}", out.len());
            assert!(recovered.was_damaged(), "{name} cut at {cut} and not said");
        }
    }
}

#[test]
fn a_recording_cut_at_many_offsets_gives_what_the_walk_yields() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/xsens_mti.mcap");
    let bytes = std::fs::read(fixture).unwrap();
    let mut seen = std::collections::BTreeSet::new();
    for n in 1..40 {
        let cut = bytes.len() * n / 40;
        std::fs::write(&input, &bytes[..cut]).unwrap();
        let (found, damaged) = same_as_walked(&input, &output);
        assert!(damaged, "cut at {cut}");
        seen.insert(found);
    }
    assert!(seen.len() > 1, "the cuts fall between chunks: {seen:?}");
}

#[test]
fn flipped_bits_cost_what_the_walk_says_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    let mut state = 11;
    for (name, packing) in PACKINGS {
        let bytes = furnished(packing, 60);
        let mut damaged = 0;
        for _ in 0..60 {
            let mut broken = bytes.clone();
            for _ in 0..1 + random(&mut state) % 3 {
                let at = 8 + random(&mut state) as usize % (bytes.len() - 8);
                broken[at] ^= 1 << (random(&mut state) % 8);
            }
            std::fs::write(&input, &broken).unwrap();
            damaged += u32::from(same_as_walked(&input, &output).1);
        }
        assert!(damaged > 40, "{name}: only {damaged} of 60 noticed");
    }
}

/// The offset of the `n`th chunk record, and its whole length.
fn chunk(bytes: &[u8], n: usize) -> (usize, usize) {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let index = &summary.chunk_indexes[n];
    (
        index.chunk_start_offset as usize,
        index.chunk_length as usize,
    )
}

#[test]
fn a_chunk_whose_length_was_never_written_gives_its_records_when_they_are_not_packed() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    for (name, packing) in &PACKINGS[..3] {
        let bytes = furnished(*packing, 60);
        let (at, length) = chunk(&bytes, 3);
        // A writer that streams a chunk fills in these two lengths when it closes it; here it died
        // 150 bytes before the end.
        let mut crashed = bytes[..at + length - 150].to_vec();
        let packed_at = at + 9 + 8 + 8 + 8 + 4 + 4 + if *name == "none" { 0 } else { name.len() };
        crashed[at + 1..at + 9].fill(0xFF);
        crashed[packed_at..packed_at + 8].fill(0xFF);
        std::fs::write(&input, &crashed).unwrap();
        let recovered = recover(&input, &output, 2);
        let before = mcap::Summary::read(&bytes).unwrap().unwrap();
        let whole: usize = before.chunk_indexes[..3]
            .iter()
            .map(|index| before.stream_chunk(&bytes, index).unwrap().count())
            .sum();
        let written = by_the_crate(&std::fs::read(&output).unwrap());
        let read_on = *name == "none";
        assert_eq!(
            written.len() > whole,
            read_on,
            "{name}: {} of {whole}",
            written.len()
        );
        assert!(written.len() >= whole, "{name}");
        let problems = recovered.survey.problems.first();
        assert!(
            problems
                .iter()
                .any(|p| p.kind == ProblemKind::UnfinishedChunk { read_on }),
            "{name}: {problems:?}"
        );
        same_as_walked(&input, &output);
    }
}

#[test]
fn a_chunk_with_a_wrong_crc_is_left_out_whole_and_its_bytes_are_counted() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    let bytes = furnished(Some(None), 60);
    let all = by_the_crate(&bytes);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let lost: Vec<Whole> = summary
        .stream_chunk(&bytes, &summary.chunk_indexes[2])
        .unwrap()
        .map(|m| m.unwrap())
        .map(|m| {
            (
                m.channel.topic.clone(),
                m.log_time,
                m.publish_time,
                m.sequence,
                m.data.to_vec(),
            )
        })
        .collect();
    let (at, length) = chunk(&bytes, 2);
    let mut broken = bytes.clone();
    broken[at + length - 20] ^= 1;
    std::fs::write(&input, &broken).unwrap();
    let recovered = recover(&input, &output, 2);
    let written = by_the_crate(&std::fs::read(&output).unwrap());
    let expected: Vec<Whole> = all.into_iter().filter(|m| !lost.contains(m)).collect();
    assert!(written == expected && expected.len() == 60 - lost.len());
    let problems = &recovered.survey.problems;
    assert_eq!(problems.messages_lost(), lost.len() as u64);
    // Everything of the chunk but its head: nine bytes and the forty before the records.
    assert_eq!(problems.bytes_skipped(), length as u64 - 49);
}

#[test]
fn an_attachment_that_is_not_what_was_written_is_left_out_and_said() {
    let dir = tempfile::tempdir().unwrap();
    let (input, output) = (dir.path().join("in.mcap"), dir.path().join("out.mcap"));
    let bytes = furnished(Some(None), 60);
    let index = mcap::Summary::read(&bytes)
        .unwrap()
        .unwrap()
        .attachment_indexes[0]
        .clone();
    // Its data, its name, its CRC.
    for place in [70, 30, index.length as usize - 1] {
        let mut broken = bytes.clone();
        broken[index.offset as usize + place] ^= 4;
        std::fs::write(&input, &broken).unwrap();
        let recovered = recover(&input, &output, 2);
        let (attachments, metadata) = extras(&std::fs::read(&output).unwrap());
        assert_eq!((attachments.len(), metadata.len()), (1, 2), "byte {place}");
        assert_eq!(attachments[0].0, "calibration 40");
        assert_eq!(recovered.written.messages, 60);
        assert!(recovered.was_damaged());
        let said = recovered.survey.problems.first()[0].to_string();
        assert!(
            said.contains("attachment record skipped: its CRC is wrong"),
            "{said}"
        );
    }
}
