//! The 416 files of the MCAP conformance suite (foxglove/mcap, MIT): every record our listing gives
//! equals the one the suite's authors wrote down, in the same order.

use serde_json::{Map, Value, json};
use std::ops::ControlFlow;
use std::path::Path;
use strapd_recording::mcap::{
    DataEnd, HeaderRecord, MetadataIndex, MetadataRecord, Reader, Record, SummaryOffset, list, op,
};

/// A record in the suite's notation: numbers as text, bytes as lists of numbers as text.
fn notation(record: &Record<'_>) -> (&'static str, Value) {
    let n = |n: u64| json!(n.to_string());
    let bytes = |b: &[u8]| json!(b.iter().map(u8::to_string).collect::<Vec<_>>());
    let texts = |pairs: &[(&str, &str)]| {
        Value::Object(
            pairs
                .iter()
                .map(|(k, v)| ((*k).to_owned(), json!(v)))
                .collect::<Map<_, _>>(),
        )
    };
    let numbers = |pairs: &[(u16, u64)]| {
        let map: Map<_, _> = pairs
            .iter()
            .map(|(k, v)| (k.to_string(), json!(v.to_string())))
            .collect();
        Value::Object(map)
    };
    match record {
        Record::Header(HeaderRecord { profile, library }) => {
            ("Header", json!({"library": library, "profile": profile}))
        }
        Record::Footer(f) => (
            "Footer",
            json!({"summary_crc": n(f.summary_crc.into()), "summary_start": n(f.summary_start),
                "summary_offset_start": n(f.summary_offset_start)}),
        ),
        Record::Schema(s) => (
            "Schema",
            json!({"id": n(s.id.into()), "name": s.name, "encoding": s.encoding,
                "data": bytes(s.data)}),
        ),
        Record::Channel(c) => (
            "Channel",
            json!({"id": n(c.id.into()), "schema_id": n(c.schema_id.into()), "topic": c.topic,
                "message_encoding": c.message_encoding, "metadata": texts(&c.metadata)}),
        ),
        Record::Message(m) => (
            "Message",
            json!({"channel_id": n(m.channel_id.into()), "sequence": n(m.sequence.into()),
                "log_time": n(m.log_time), "publish_time": n(m.publish_time),
                "data": bytes(m.data)}),
        ),
        Record::ChunkIndex(c) => (
            "ChunkIndex",
            json!({"message_start_time": n(c.message_start_time),
                "message_end_time": n(c.message_end_time),
                "chunk_start_offset": n(c.chunk_start_offset),
                "chunk_length": n(c.chunk_length),
                "message_index_offsets": numbers(&c.message_index_offsets),
                "message_index_length": n(c.message_index_length),
                "compression": c.compression, "compressed_size": n(c.compressed_size),
                "uncompressed_size": n(c.uncompressed_size)}),
        ),
        Record::Attachment(a) => {
            // The suite leaves the CRC out; it covers everything before itself.
            (
                "Attachment",
                json!({"log_time": n(a.log_time), "create_time": n(a.create_time),
                "name": a.name, "media_type": a.media_type, "data": bytes(a.data.0)}),
            )
        }
        Record::AttachmentIndex(a) => (
            "AttachmentIndex",
            json!({"offset": n(a.offset), "length": n(a.length), "log_time": n(a.log_time),
                "create_time": n(a.create_time), "data_size": n(a.data_size), "name": a.name,
                "media_type": a.media_type}),
        ),
        Record::Statistics(s) => (
            "Statistics",
            json!({"message_count": n(s.message_count), "schema_count": n(s.schema_count.into()),
                "channel_count": n(s.channel_count.into()),
                "attachment_count": n(s.attachment_count.into()),
                "metadata_count": n(s.metadata_count.into()),
                "chunk_count": n(s.chunk_count.into()),
                "message_start_time": n(s.message_start_time),
                "message_end_time": n(s.message_end_time),
                "channel_message_counts": numbers(&s.channel_message_counts)}),
        ),
        Record::Metadata(MetadataRecord { name, metadata }) => (
            "Metadata",
            json!({"name": name, "metadata": texts(metadata)}),
        ),
        Record::MetadataIndex(MetadataIndex {
            offset,
            length,
            name,
        }) => (
            "MetadataIndex",
            json!({"offset": n(*offset), "length": n(*length), "name": name}),
        ),
        Record::SummaryOffset(SummaryOffset {
            group_opcode,
            group_start,
            group_length,
        }) => (
            "SummaryOffset",
            json!({"group_opcode": n((*group_opcode).into()), "group_start": n(*group_start),
                "group_length": n(*group_length)}),
        ),
        Record::DataEnd(DataEnd { data_section_crc }) => (
            "DataEnd",
            json!({"data_section_crc": n((*data_section_crc).into())}),
        ),
        other => panic!("{other:?} is not in the suite's listings"),
    }
}

fn expected(path: &Path) -> Vec<(String, Value)> {
    let text = std::fs::read_to_string(path).unwrap();
    let listing: Value = serde_json::from_str(&text).unwrap();
    let record = |r: &Value| {
        let fields = r["fields"].as_array().unwrap().iter();
        let fields: Map<_, _> = fields
            .map(|f| (f[0].as_str().unwrap().to_owned(), f[1].clone()))
            .collect();
        (
            r["type"].as_str().unwrap().to_owned(),
            Value::Object(fields),
        )
    };
    listing["records"]
        .as_array()
        .unwrap()
        .iter()
        .map(record)
        .collect()
}

fn ours(reader: Reader) -> Vec<(String, Value)> {
    let mut records = Vec::new();
    let (_, problems) = list(reader, |listed| {
        // Message indexes are part of the file, not of the suite's listings.
        if !matches!(
            listed.record,
            Record::MessageIndex(_) | Record::Unknown { .. }
        ) {
            let (name, fields) = notation(&listed.record);
            records.push((name.to_owned(), fields));
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(problems.is_empty(), "{problems:?}");
    records
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_conformance_file_lists_as_its_authors_say() {
    let Some(root) = crate::shared_data::shared("logs/conformance") else {
        return;
    };
    let mut files = 0;
    let mut records = 0;
    for group in std::fs::read_dir(root.join("mcap")).unwrap() {
        let group = group.unwrap();
        for file in std::fs::read_dir(group.path()).unwrap() {
            let path = file.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let json = root
                .join("expected_json")
                .join(group.file_name())
                .join(format!("{name}.json"));
            let expected = expected(&json);
            let from_file = ours(Reader::open(&path).unwrap());
            assert_eq!(from_file, expected, "{name}");
            let bytes = std::io::Cursor::new(std::fs::read(&path).unwrap());
            assert_eq!(
                ours(Reader::from_stream(&name, Box::new(bytes)).unwrap()),
                expected,
                "{name}"
            );
            files += 1;
            records += expected.len();
        }
    }
    // The suite's own counts: a loop that finds nothing proves nothing.
    assert_eq!((files, records), (416, 4868));
}

#[test]
#[cfg_attr(not(has_shared), ignore = "needs ../shared (optional recordings)")]
fn every_attachment_of_the_suite_has_the_crc_it_carries() {
    let Some(root) = crate::shared_data::shared("logs/conformance/mcap/OneAttachment") else {
        return;
    };
    let mut seen = 0;
    for file in std::fs::read_dir(root).unwrap() {
        let reader = Reader::open(&file.unwrap().path()).unwrap();
        list(reader, |listed| {
            if let Record::Attachment(a) = listed.record {
                // Everything of the record but the CRC itself, at the end of the known fields.
                let covered =
                    8 + 8 + 4 + a.name.len() + 4 + a.media_type.len() + 8 + a.data.0.len();
                assert_eq!(crc32(&listed.body[..covered]), a.crc);
                assert_eq!(listed.body[covered..][..4], a.crc.to_le_bytes());
                seen += 1;
            }
            ControlFlow::Continue(())
        })
        .unwrap();
    }
    assert_eq!(seen, 14);
    assert_eq!(op::ATTACHMENT, 9);
}

/// CRC-32 (IEEE 802.3), bit by bit: independent of the crate the reader uses.
fn crc32(data: &[u8]) -> u32 {
    !data.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            (c >> 1) ^ (0xEDB8_8320 & (c & 1).wrapping_neg())
        })
    })
}
