#![allow(clippy::unwrap_used)]

use super::*;

/// A record of this opcode with so many bytes.
fn record(opcode: u8, len: usize) -> Vec<u8> {
    let mut record = vec![opcode];
    record.extend((len as u64).to_le_bytes());
    record.resize(9 + len, 7);
    record
}

#[test]
fn a_chunk_is_unpacked_no_further_than_there_are_records() {
    const SIZE: usize = 16 << 20;
    // Records that end far from a piece's end, at one, and one across several.
    for lengths in [
        vec![],
        vec![300; 3],
        vec![PIECE - 9],
        vec![1, 5 * PIECE, 40],
    ] {
        let mut plain: Vec<u8> = lengths.iter().flat_map(|n| record(5, *n)).collect();
        let records = plain.len();
        plain.resize(SIZE, 0);
        let packed = zstd::bulk::compress(&plain, 19).unwrap();
        let mut out = vec![1; SIZE];
        let end = records + 9;
        assert_eq!(
            unzstd_records(&packed, &mut out).unwrap(),
            Unpacked::Records(end),
            "{lengths:?}"
        );
        assert!(out.starts_with(&plain[..end]));
        let untouched = out.iter().rev().take_while(|b| **b == 1).count();
        assert!(
            SIZE - untouched <= records + 3 * PIECE,
            "{lengths:?}: {untouched} bytes left alone"
        );
    }
}

#[test]
fn a_chunk_of_records_alone_has_no_such_end() {
    let plain: Vec<u8> = (0..2000).flat_map(|_| record(0x80, 5000)).collect();
    let packed = zstd::bulk::compress(&plain, 19).unwrap();
    assert!(packed.len() < plain.len() / SUSPECT);
    let unpacked = |packed: &[u8], size| unzstd_records(packed, &mut vec![0; size]).unwrap();
    let all = Unpacked::All(plain.len());
    assert_eq!(unpacked(&packed, plain.len()), all);
    // More than is declared, and less.
    assert_eq!(unpacked(&packed, plain.len() + 5), all);
    assert_eq!(unpacked(&packed, 5000), Unpacked::All(5001));
    // A length beyond everything is for who reads the records to name.
    let huge = zstd::bulk::compress(&[5, 255, 255, 255, 255, 255, 255, 255, 255, 0], 1).unwrap();
    assert_eq!(unpacked(&huge, 10), Unpacked::All(10));
}

#[test]
fn a_packed_chunk_has_no_more_messages_than_its_bytes_can_tell_apart() {
    let message = |time: u64| {
        let mut record = record(op::MESSAGE, 22);
        record[15..23].copy_from_slice(&time.to_le_bytes());
        record
    };
    // Just suspect, and most suspect.
    for times in [6_000, 1_000_000] {
        let same = message(7).repeat(times);
        let packed = zstd::bulk::compress(&same, 19).unwrap();
        let mut buffers = Buffers::default();
        let block = |packed: Vec<u8>, size: usize| Block {
            offset: 0,
            kind: Kind::Chunk {
                compression: Compression::Zstd,
                size,
                crc: 0,
                indexed: None,
            },
            payload: Payload::Held(OwnedBytes {
                range: 0..packed.len(),
                bytes: packed,
            }),
        };
        let block_of_same = block(packed, same.len());
        let opened = buffers.open(&block_of_same).unwrap();
        assert!(
            matches!(opened, Err(ProblemKind::Unpack { .. })),
            "{times}: {opened:?}"
        );
        let apart: Vec<u8> = (0..20_000).flat_map(message).collect();
        let packed = zstd::bulk::compress(&apart, 19).unwrap();
        let block = block(packed, apart.len());
        assert_eq!(buffers.open(&block).unwrap(), Ok(&apart[..]));
    }
}
