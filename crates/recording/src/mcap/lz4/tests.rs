#![allow(clippy::unwrap_used, clippy::expect_used)]

use super::unpack;
use lz4_flex::frame::{BlockMode, BlockSize, FrameDecoder, FrameEncoder, FrameInfo};
use proptest::prelude::*;
use std::io::{Read, Write};

/// Bytes with repetitions near and far, so that matches reach over block borders.
fn data(n: usize, seed: u64) -> Vec<u8> {
    let mut state = seed | 1;
    (0..n)
        .map(|i| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(seed | 1);
            if i % 346 < 300 {
                (i % 346) as u8
            } else {
                (state >> 60) as u8
            }
        })
        .collect()
}

fn pack(plain: &[u8], info: FrameInfo) -> Vec<u8> {
    let mut out = FrameEncoder::with_frame_info(info, Vec::new());
    out.write_all(plain).unwrap();
    out.finish().unwrap()
}

fn infos(n: usize) -> Vec<FrameInfo> {
    let mut all = Vec::new();
    for mode in [BlockMode::Linked, BlockMode::Independent] {
        for size in [BlockSize::Max64KB, BlockSize::Max256KB, BlockSize::Max4MB] {
            for (block, content) in [(false, false), (true, false), (false, true), (true, true)] {
                let info = FrameInfo::new()
                    .block_mode(mode)
                    .block_size(size)
                    .block_checksums(block)
                    .content_checksum(content)
                    .content_size((block == content).then_some(n as u64));
                all.push(info);
            }
        }
    }
    all
}

#[test]
fn every_kind_of_frame_unpacks_to_what_was_packed() {
    for n in [0, 1, 100, 65_536, 65_537, 300_000] {
        let plain = data(n, 3);
        for info in infos(n) {
            let packed = pack(&plain, info.clone());
            let mut out = vec![0; n];
            assert_eq!(unpack(&packed, &mut out), Some(n), "{n} {info:?}");
            assert!(out == plain, "{n} {info:?}");
            // One byte too little room is not enough, and no panic.
            if n > 0 {
                assert_eq!(unpack(&packed, &mut out[..n - 1]), None, "{n} {info:?}");
            }
        }
    }
}

#[test]
fn frames_of_the_reference_library_unpack() {
    // The `mcap` crate packs with liblz4: linked 64 KiB blocks and a content checksum.
    let options = mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Lz4))
        .chunk_size(None);
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).unwrap();
    let id = writer
        .add_channel(0, "/a", "x", &Default::default())
        .unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: id,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    writer
        .write_to_known_channel(&header, &data(500_000, 5))
        .unwrap();
    writer.finish().unwrap();
    let bytes = writer.into_inner().into_inner();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let index = &summary.chunk_indexes[0];
    let from = index.compressed_data_offset().unwrap() as usize;
    let packed = &bytes[from..from + index.compressed_size as usize];
    let mut ours = vec![0; index.uncompressed_size as usize];
    assert_eq!(unpack(packed, &mut ours), Some(ours.len()));
    let mut theirs = Vec::new();
    FrameDecoder::new(packed).read_to_end(&mut theirs).unwrap();
    assert!(ours == theirs);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    #[test]
    fn damaged_frames_never_panic(
        seed in any::<u64>(),
        n in 0usize..200_000,
        kind in 0usize..24,
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut packed = pack(&data(n, seed), infos(n)[kind].clone());
        for (at, value) in hits {
            let at = at.index(packed.len());
            packed[at] = value;
        }
        let mut out = vec![0; n];
        let _ = unpack(&packed, &mut out);
        let cut = cut.index(packed.len());
        let _ = unpack(&packed[..cut], &mut out);
    }
}
