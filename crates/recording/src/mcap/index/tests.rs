#![allow(clippy::unwrap_used)]

use super::*;

/// A chunk at `at` of 1000 bytes, and the indexes of these channels' messages behind it.
fn chunk(at: u64, messages: &[(u16, u64)]) -> ChunkIndex<'static> {
    let mut place = at + 1000;
    let mut message_index_offsets = Vec::new();
    for (channel, n) in messages {
        message_index_offsets.push((*channel, place));
        place += MESSAGE_INDEX + 16 * n;
    }
    ChunkIndex {
        message_start_time: 0,
        message_end_time: 9,
        chunk_start_offset: at,
        chunk_length: 1000,
        message_index_offsets,
        message_index_length: place - at - 1000,
        compression: "zstd",
        compressed_size: 900,
        uncompressed_size: 5000,
    }
}

fn statistics(counts: &[(u16, u64)], chunks: u32) -> Statistics {
    Statistics {
        message_count: counts.iter().map(|(_, n)| n).sum(),
        schema_count: 1,
        channel_count: 2,
        attachment_count: 0,
        metadata_count: 0,
        chunk_count: chunks,
        message_start_time: 0,
        message_end_time: 9,
        channel_message_counts: counts.to_vec(),
    }
}

fn index(chunks: &[ChunkIndex<'_>], counts: &[(u16, u64)]) -> Option<Index> {
    let mut gathered = ChunkList::default();
    for chunk in chunks {
        gathered.add(chunk, Limits::default());
    }
    gathered.index(&statistics(counts, chunks.len() as u32), 100_000)
}

fn three() -> [ChunkIndex<'static>; 3] {
    [
        chunk(100, &[(1, 5), (2, 1)]),
        chunk(5000, &[(2, 7)]),
        chunk(9000, &[(2, 0), (1, 2)]),
    ]
}

const COUNTS: [(u16, u64); 2] = [(1, 7), (2, 8)];

#[test]
fn chunks_without_what_is_wanted_are_passed_over_and_the_rest_is_read() {
    let index = index(&three(), &COUNTS).unwrap();
    let passed = index.passed_over([1].into(), false);
    let at: Vec<u64> = passed.chunks.iter().map(|chunk| chunk.at).collect();
    assert_eq!(at, [5000]);
    assert!(passed.agrees(100, 5) && !passed.agrees(100, 4) && passed.agrees(5000, 3));
    let end = 5000 + 1000 + MESSAGE_INDEX + 7 * 16;
    assert_eq!(
        index.rest(&passed.chunks),
        [0..5000 + BEHIND, end..100_000 + BEHIND]
    );
    assert_eq!(passed.bytes(), end - 5000);
    // A channel is met in the first of its chunks that has a message.
    let passed = index.passed_over([1, 2].into(), true);
    let at: Vec<u64> = passed.chunks.iter().map(|chunk| chunk.at).collect();
    assert_eq!(at, [5000, 9000]);
}

/// Makes the words about a chunk wrong.
type Change = fn(&mut ChunkIndex<'_>);

#[test]
fn an_index_that_something_speaks_against_is_not_used() {
    assert!(index(&three(), &COUNTS).is_some());
    assert!(index(&three(), &[(1, 7), (2, 9)]).is_none(), "counts");
    assert!(index(&three(), &[(1, 15)]).is_none(), "channels");
    let mut overlapping = three();
    overlapping[1].chunk_start_offset = 1100;
    assert!(index(&overlapping, &COUNTS).is_none(), "overlap");
    let wrong: [(&str, Change); 6] = [
        ("no index of messages", |c| c.message_index_offsets.clear()),
        ("a hole before them", |c| c.message_index_offsets[0].1 += 16),
        ("a broken length", |c| c.message_index_length += 1),
        ("more than there is", |c| c.compressed_size = 2000),
        ("too large", |c| c.uncompressed_size = 1 << 40),
        ("an unknown packing", |c| c.compression = "rar"),
    ];
    for (what, change) in wrong {
        let mut chunks = three();
        change(&mut chunks[0]);
        assert!(index(&chunks, &COUNTS).is_none(), "{what}");
    }
    let mut gathered = ChunkList::default();
    three()
        .iter()
        .for_each(|c| gathered.add(c, Limits::default()));
    assert!(
        gathered.index(&statistics(&COUNTS, 4), 100_000).is_none(),
        "a chunk too few"
    );
    let mut gathered = ChunkList::default();
    three()
        .iter()
        .for_each(|c| gathered.add(c, Limits::default()));
    assert!(
        gathered.index(&statistics(&COUNTS, 3), 9500).is_none(),
        "beyond the data"
    );
}
