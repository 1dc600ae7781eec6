//! Promise: what is written of a record is what is read of it, and the crate `mcap`, which strapd does not read or write
//! with, says the same of its bytes.

#![allow(clippy::unwrap_used)]

use super::*;
use ::mcap::records::{self as theirs, Record as Theirs};

fn written(push: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = b"before".to_vec();
    push(&mut out);
    out.split_off(6)
}

/// Our reading and theirs of a whole record.
fn both(bytes: &[u8]) -> (Record<'_>, Theirs<'_>) {
    let length = u64::from_le_bytes(*bytes[1..].first_chunk().unwrap());
    assert_eq!(length as usize + HEAD, bytes.len());
    let body = &bytes[HEAD..];
    (
        Record::parse(bytes[0], body).unwrap(),
        ::mcap::parse_record(bytes[0], body).unwrap(),
    )
}

#[test]
fn every_record_is_read_as_it_was_written_by_us_and_by_the_crate_mcap() {
    let statistics = Statistics {
        message_count: 1 << 40,
        schema_count: 2,
        channel_count: 3,
        attachment_count: 4,
        metadata_count: 5,
        chunk_count: 6,
        message_start_time: 7,
        message_end_time: u64::MAX,
        channel_message_counts: vec![(1, 9), (u16::MAX, 10)],
    };
    let bytes = written(|out| statistics.push(out));
    let (ours, theirs) = both(&bytes);
    assert_eq!(ours, Record::Statistics(statistics.clone()));
    let Theirs::Statistics(theirs) = theirs else {
        panic!("{theirs:?}");
    };
    assert_eq!(theirs.message_end_time, u64::MAX);
    let counts: Vec<_> = theirs.channel_message_counts.into_iter().collect();
    assert_eq!(counts, statistics.channel_message_counts);

    let channel = ChannelRecord {
        id: 7,
        schema_id: 8,
        topic: "/imu",
        message_encoding: "cdr",
        metadata: vec![("a", "b"), ("\u{e9}", "")],
    };
    let bytes = written(|out| channel.push(out));
    let (ours, theirs) = both(&bytes);
    assert_eq!(ours, Record::Channel(channel));
    let Theirs::Channel(theirs::Channel {
        topic, metadata, ..
    }) = theirs
    else {
        panic!("{theirs:?}");
    };
    assert_eq!((topic.as_str(), metadata["\u{e9}"].as_str()), ("/imu", ""));

    let schema = SchemaRecord {
        id: 8,
        name: "n",
        encoding: "ros2msg",
        data: &[0, 255],
    };
    let bytes = written(|out| schema.push(out));
    let (ours, theirs) = both(&bytes);
    assert_eq!(ours, Record::Schema(schema));
    assert!(
        matches!(theirs, Theirs::Schema { header, data } if header.id == 8 && *data == [0, 255])
    );

    let chunk_index = ChunkIndex {
        message_start_time: 1,
        message_end_time: 2,
        chunk_start_offset: 3,
        chunk_length: 4,
        message_index_offsets: vec![(5, 6)],
        message_index_length: 7,
        compression: "zstd",
        compressed_size: 8,
        uncompressed_size: 9,
    };
    let bytes = written(|out| chunk_index.push(out));
    let (ours, theirs) = both(&bytes);
    assert_eq!(ours, Record::ChunkIndex(chunk_index));
    assert!(
        matches!(theirs, Theirs::ChunkIndex(i) if i.uncompressed_size == 9 && i.message_index_offsets[&5] == 6)
    );

    let entries = [[1_u64, 2], [3, 4]].map(|pair| pair.map(u64::to_le_bytes).concat());
    let index = MessageIndex {
        channel_id: 3,
        entries: Entries(&entries.concat()),
    };
    let bytes = written(|out| index.push(out));
    let (ours, theirs) = both(&bytes);
    assert_eq!(ours, Record::MessageIndex(index));
    assert!(matches!(theirs, Theirs::MessageIndex(i) if i.records[1].offset == 4));

    let data = [9; 300];
    let attachment = AttachmentRecord {
        log_time: 1,
        create_time: 2,
        name: "n",
        media_type: "text/plain",
        data: Carried(&data),
        crc: 0,
    };
    let bytes = written(|out| attachment.push(out));
    assert_eq!(
        Record::parse(bytes[0], &bytes[HEAD..]),
        Some(Record::Attachment(attachment))
    );

    let data = [1, 2, 3];
    let head = MessageRecord::head(4, 5, (6, 7), data.len());
    let bytes = [&head[..], &data].concat();
    let (ours, theirs) = both(&bytes);
    assert!(matches!(ours, Record::Message(m) if m.publish_time == 7 && m.data == data));
    assert!(
        matches!(theirs, Theirs::Message { header, data: of } if header.log_time == 6 && *of == data)
    );
}

#[test]
fn a_body_whose_lengths_do_not_add_up_is_none_and_one_that_goes_on_is_read() {
    let metadata = MetadataRecord {
        name: "name",
        metadata: vec![("key", "value")],
    };
    let bytes = written(|out| metadata.push_with(3, out));
    let body = &bytes[HEAD..];
    assert_eq!(bytes[1] as usize, body.len() + 3);
    for cut in 0..body.len() {
        assert_eq!(MetadataRecord::parse(&body[..cut]), None, "{cut}");
    }
    let longer = [body, &[1, 2, 3]].concat();
    assert_eq!(MetadataRecord::parse(&longer), Some(metadata));
    let ragged = [&2_u16.to_le_bytes()[..], &15_u32.to_le_bytes(), &[0; 15]].concat();
    assert_eq!(MessageIndex::parse(&ragged), None);
    // 65,537 pairs of nothing.
    let many = vec![("", ""); <&str>::MOST + 1];
    for (count, is_read) in [(<&str>::MOST, true), (<&str>::MOST + 1, false)] {
        let bytes = written(|out| {
            let metadata = many[..count].to_vec();
            MetadataRecord { name: "", metadata }.push(out);
        });
        let read = Record::parse(op::METADATA, &bytes[HEAD..]);
        assert_eq!(read.is_some(), is_read);
    }
}
